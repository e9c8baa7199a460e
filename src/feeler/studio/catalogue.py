"""The catalogue: what a page can choose from, and where each number comes from."""

from collections.abc import Sequence
from functools import lru_cache
from importlib.metadata import version
from typing import Any

import numpy as np

from feeler.antenna.antenna import Antenna
from feeler.antenna.cockroach import FACTS
from feeler.antenna.fact import SOURCE_TAGS
from feeler.presets import PRESETS, make_preset
from feeler.robot.hinge import ROBOT_FACTS
from feeler.stimulus.ninety import HALF_SIZES, LOCATIONS, SPEEDS
from feeler.studio.touching import describe_antenna
from feeler.studio.wish import AntennaWish, compute_compliance

_HANDLES = 5  # [C] of a profile that is not changed yet


def make_catalogue(first: AntennaWish) -> dict[str, Any]:
    """Presets, shapes, the paper's grid, facts and their tags, as plain data."""
    return {**_make_fixed(), "first": first.to_plain()}


@lru_cache(maxsize=1)
def _make_fixed() -> dict[str, Any]:
    known = {name: make_preset(name) for name in PRESETS if name != "cockroach"}
    return {
        "version": version("feeler"),
        "speeds": SPEEDS,
        "locations": LOCATIONS,
        "sizes": HALF_SIZES,
        "presets": {name: describe_original(antenna) for name, antenna in known.items()},
        "tags": SOURCE_TAGS,
        "facts": {
            name: {"value": fact.value, "unit": fact.unit, "tag": fact.tag, "note": fact.note}
            for name, fact in FACTS.items()
        },
        "robot facts": {
            name: {"unit": fact.unit, "tag": fact.tag, "note": fact.note}
            for name, fact in ROBOT_FACTS.items()
        },
    }


def describe_original(antenna: Antenna) -> dict[str, Any]:
    """An unchanged antenna: what is drawn, and handles from which it may be changed; in space of
    bending towards x.
    """
    shown = describe_antenna(antenna)
    return {
        **shown,
        "compliance": compute_compliance(np.array(shown["stiffness"])),
        "handles": {name: _make_handles(shown[name]) for name in ("stiffness", "damping")},
    }


def _make_handles(values: Sequence[float]) -> list[list[float]]:
    """Handles on a profile, evenly spaced, four digits; every hinge where there are few."""
    n = len(values)
    at = np.unique(np.round(np.linspace(0, n - 1, min(_HANDLES, n))).astype(int))
    share = at / max(n - 1, 1)
    return [
        [float(x), float(f"{max(values[i], 1e-12):.4g}")]
        for x, i in zip(share, at, strict=True)
    ]
