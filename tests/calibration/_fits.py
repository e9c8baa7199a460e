"""A fit with known numbers, for what prints, draws and keeps one."""

from typing import Any

import numpy as np

from feeler.calibration.traces import TraceFit

FIT: dict[str, Any] = {
    "names": ("p1", "p2"),
    "animals": ("one", "two"),
    "each": np.array([[1.1, 0.9], [1.3, 0.7]]),
    "p": np.array([1.2, 0.8]),
    "low": np.array([1.05, 0.65]),
    "high": np.array([1.35, 0.95]),
    "residual": np.array([0.02, 0.04]),
    "simulated": np.array([[1.0, 0.3, -0.1], [1.0, 0.2, 0.1]]),
    "interval": "spread between animals",
    "band": None,
    "directions": None,
}


def make_fit(**other: Any) -> TraceFit:
    """The fit, with ``other`` fields in the place of its own."""
    return TraceFit(**FIT | other)
