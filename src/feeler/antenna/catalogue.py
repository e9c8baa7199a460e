"""Antennas of other animals and robots: one file each in ``species``, with the source of every
number.

It stands beside them: a result depends on the data files beside the module that names them.
"""

from importlib.resources import files

from feeler.antenna.parse import AntennaFile, parse_antenna

_FILES = files("feeler.antenna") / "species"
SPECIES = tuple(sorted(file.name.removesuffix(".toml") for file in _FILES.iterdir()))


def read_species(name: str) -> AntennaFile:
    """The antenna and the sources of its quantities."""
    file = f"{name}.toml"
    return parse_antenna((_FILES / file).read_text(encoding="utf-8"), file)
