"""Antennas by their making: a slender beam of one material, as segments and hinges."""

import warnings
from collections.abc import Callable
from typing import Any

import numpy as np

from feeler.antenna.formula import evaluate
from feeler.errors import Doubtful, InvalidInput

DENSITIES = (1e-4, 2e-2)  # [C] g/mm3; beams outside are warned of
MODULI = (1e-1, 1e6)  # [C] MPa; from resilin to diamond

Along = float | str | Callable[[np.ndarray], Any]
"""One number, or a formula or function of the place x along the length (0 base, 1 tip)."""


def compute_beam(
    length: float,
    n_segments: int,
    radius: Along | None,
    width: Along | None,
    thickness: Along | None,
    modulus: Along,
    density: Along,
    damping_time: Along,
) -> dict[str, np.ndarray]:
    """Fields of an antenna for a beam; see :meth:`feeler.Antenna.from_beam`."""
    if (radius is None) == (width is None or thickness is None) or (width is None) != (
        thickness is None
    ):
        raise InvalidInput("a beam needs either radius [mm], or width and thickness [mm].")
    for name, value in (("length", length), ("n_segments", n_segments)):
        if not (np.isfinite(value) and value > 0):
            raise InvalidInput(f"{name} must be finite and > 0, got {value}.")
    size = length / n_segments
    hinge = np.arange(n_segments) / n_segments
    middle = hinge + 0.5 / n_segments
    if radius is not None:
        area, moment = (
            np.pi * _at("radius", radius, middle) ** 2,
            np.pi / 4 * _at("radius", radius, hinge) ** 4,
        )
        half = _at("radius", radius, middle)
    else:
        area = _at("width", width, middle) * _at("thickness", thickness, middle)
        moment = _at("width", width, hinge) * _at("thickness", thickness, hinge) ** 3 / 12
        half = _at("thickness", thickness, middle) / 2
    firm, heavy = _at("modulus", modulus, hinge), _at("density", density, middle)
    _doubt("density", heavy, DENSITIES, "g/mm3 (water: 1e-3)")
    _doubt("modulus", firm, MODULI, "MPa (cuticle: some 1e3)")
    stiffness = firm * moment / size
    stiffness[0] *= (
        2  # hinge 1 bends for the half segment that lies beyond it, the others for two halves
    )
    return {
        "segment_length": np.full(n_segments, size),
        "segment_mass": heavy * area * size,
        "radius": half,
        "stiffness": stiffness,
        "damping": _at("damping_time", damping_time, hinge, least=0.0) * stiffness,
    }


def _doubt(name: str, values: np.ndarray, usual: tuple[float, float], unit: str) -> None:
    """Warn of numbers that look like another unit's."""
    low, high = usual
    if values.min() < low or values.max() > high:
        warnings.warn(
            f"{name} of {values.min():.4g} to {values.max():.4g} is outside {low:g} to {high:g}:"
            f" is it in {unit}?",
            Doubtful,
            stacklevel=5,
        )


def _at(
    name: str, value: Along | None, x: np.ndarray, least: float = np.nextafter(0, 1)
) -> np.ndarray:
    """A quantity at places along the beam."""
    found = (
        evaluate(value, {"x": x})
        if isinstance(value, str)
        else value(x)
        if callable(value)
        else value
    )
    values = np.broadcast_to(np.asarray(found, dtype=float), x.shape).copy()
    if not np.all(np.isfinite(values) & (values >= least)):
        raise InvalidInput(
            f"{name} must be finite and {'>' if least else '≥'} 0 all along the beam, got"
            f" {values.min():.4g} to {values.max():.4g}."
        )
    return values
