"""Ready antennas: ``cockroach(profile)``, ``robot()`` and those of ``antenna/species``; every
number with its source.

The cockroach's numbers stand in ``FACTS``; the others' in their files, as :func:`read_preset` gives
them.
"""

from collections.abc import Callable
from functools import partial
from typing import Any

from feeler.antenna.animals import (
    FACTS,
    PROFILE_NAMES,
    SPECIES,
    cockroach,
    list_sources,
    rat_whiskers,
    read_species,
)
from feeler.antenna.files import AntennaFile
from feeler.antenna.segments import Antenna
from feeler.errors import InvalidInput, suggest
from feeler.objects.trials import trials as paper_trials
from feeler.renamed import find_renamed, rename_antenna
from feeler.validation import checked


@checked
def robot(**changes: Any) -> Antenna:
    """The eight-hinge robotic antenna; ``changes`` are :func:`feeler.robot.make_robot`'s."""
    from feeler.robot import make_robot

    return make_robot(**changes)


PRESETS: dict[str, Callable[[], Antenna]] = {
    **{name: partial(cockroach, name) for name in PROFILE_NAMES},
    "cockroach": cockroach,
    "robot": robot,
    **{name: lambda name=name: read_species(name).antenna for name in SPECIES},  # type: ignore[misc]
}


@checked
def make_preset(name: str) -> Antenna:
    """The preset called ``name``; the error lists the valid names."""
    if (name := rename_antenna(name)) not in PRESETS:
        raise InvalidInput(
            f"unknown preset {name!r}; valid: {', '.join(PRESETS)}.{suggest(name, PRESETS)}"
        )
    return PRESETS[name]()


@checked
def read_preset(name: str) -> AntennaFile:
    """A preset with the formulas and sources of its quantities, as ``save_antenna`` writes them."""
    antenna = make_preset(name)
    return (
        read_species(name)
        if name in SPECIES
        else AntennaFile(antenna=antenna, sources=list_sources(antenna.name))
    )


__all__ = [
    "FACTS",
    "PRESETS",
    "SPECIES",
    "cockroach",
    "make_preset",
    "paper_trials",
    "rat_whiskers",
    "read_preset",
    "robot",
]

__getattr__ = find_renamed(__name__)
