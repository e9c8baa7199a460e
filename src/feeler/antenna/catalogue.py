"""Antennas of other animals and robots: one file each in ``species``, with the source of every
number.
"""

from importlib.resources import files

from feeler.antenna.parse import AntennaFile, parse_antenna

SPECIES = ("cricket", "stick-insect", "lobster", "whisker", "multi-legged")


def read_species(name: str) -> AntennaFile:
    """The antenna and the sources of its quantities."""
    file = f"{name}.toml"
    return parse_antenna(
        (files("feeler.antenna") / "species" / file).read_text(encoding="utf-8"), file
    )
