"""Antennas by their making: a slender beam of one material, as segments and hinges."""

import warnings
from collections.abc import Callable
from typing import Any

import numpy as np

from feeler.antenna.formula import evaluate
from feeler.errors import Doubtful, InvalidInput
from feeler.records.rules import show

_DENSITIES = (1e-4, 2e-2)  # [C] g/mm3; beams outside are warned of
_MODULI = (1e-1, 1e6)  # [C] MPa; from resilin to diamond

Along = float | str | Callable[[np.ndarray], Any]
"""One number, or a formula or function of the place x along the length (0 base, 1 tip)."""


@np.errstate(all="ignore")  # the antenna refuses what is no finite number
def compute_beam(
    length: float,
    n_segments: int,
    radius: Along | None,
    width: Along | None,
    thickness: Along | None,
    modulus: Along,
    density: Along,
    damping_time: Along,
    planes: int = 1,
    shear_modulus: Along | None = None,
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
    _doubt("density", heavy, _DENSITIES, "g/mm3 (water: 1e-3)")
    _doubt("modulus", firm, _MODULI, "MPa (cuticle: some 1e3)")
    stiffness = firm * moment / size
    stiffness[0] *= (
        2  # hinge 1 bends for the half segment that lies beyond it, the others for two halves
    )
    found = {
        "segment_length": np.full(n_segments, size),
        "segment_mass": heavy * area * size,
        "radius": half,
        "stiffness": stiffness,
        "damping": _at("damping_time", damping_time, hinge, least=0.0) * stiffness,
    }
    if planes == 1:
        return found
    section = radius, width, thickness
    return found | _bend_in_space(found, section, modulus, density, planes, shear_modulus)


def _measure_section(
    x: np.ndarray, radius: Along | None, width: Along | None, thickness: Along | None
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Of a full circle or a strip, at places x: area [mm²], its moments across the second plane and
    of torsion [mm⁴], and half the thickness [mm].
    """
    if radius is not None:
        r = _at("radius", radius, x, least=0.0)
        return np.pi * r**2, np.pi / 4 * r**4, np.pi / 2 * r**4, r
    w, t = _at("width", width, x, least=0.0), _at("thickness", thickness, x, least=0.0)
    long, short = np.maximum(w, t), np.minimum(w, t)
    flat = short / long
    twist = long * short**3 * (1 / 3 - 0.21 * flat * (1 - flat**4 / 12))  # Young & Budynas
    return w * t, t * w**3 / 12, twist, t / 2


def _bend_in_space(
    plane: dict[str, np.ndarray],
    section: tuple[Along | None, ...],
    modulus: Along,
    density: Along,
    planes: int,
    shear_modulus: Along | None,
) -> dict[str, np.ndarray]:
    """What is different in space: hinges of each plane, and segments that are frusta."""
    if planes not in (2, 3):
        raise InvalidInput(f"planes must be 1, 2, or 3 with torsion, got {planes!r}.")
    if (planes == 3) != (shear_modulus is not None):
        raise InvalidInput(
            "torsion needs its stiffness: give shear_modulus [MPa] with planes=3, and only then."
        )
    n, size = len(plane["segment_length"]), plane["segment_length"][0]
    hinge, middle = np.arange(n) / n, (np.arange(n) + 0.5) / n
    ends = np.arange(n + 1) / n
    area, _, _, thick = _measure_section(ends, *section)
    _, moment, twist, _ = _measure_section(hinge, *section)
    whole = (area[:-1] + 4 * _measure_section(middle, *section)[0] + area[1:]) / 6
    moduli = [_at("modulus", modulus, hinge) * moment]
    if shear_modulus is not None:
        moduli.append(_at("shear_modulus", shear_modulus, hinge) * twist)
    others = np.array(moduli) / size
    others[:, 0] *= 2  # as in the plane
    stiffness = np.concatenate([plane["stiffness"][None], others])
    return {
        "segment_mass": _at("density", density, middle) * whole * size,
        "stiffness": stiffness,
        "damping": plane["damping"] / plane["stiffness"] * stiffness,
        "taper": thick[1:] / thick[:-1],
    }


def _doubt(name: str, values: np.ndarray, usual: tuple[float, float], unit: str) -> None:
    """Warn of numbers that look like another unit's."""
    low, high = usual
    if values.min() < low or values.max() > high:
        ends = dict.fromkeys((f"{values.min():.4g}", f"{values.max():.4g}"))
        warnings.warn(
            f"{name} of {' to '.join(ends)} is outside {low:g} to {high:g}: is it in {unit}?",
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
    try:
        values = np.broadcast_to(np.asarray(found, dtype=float), x.shape).copy()
    except (TypeError, ValueError, OverflowError) as error:
        raise InvalidInput(
            f"{name} must be a number, a formula of x, or a number for each of {x.size} places,"
            f" got {show(found)}."
        ) from error
    if not np.all(np.isfinite(values) & (values >= least)):
        raise InvalidInput(
            f"{name} must be finite and {'>' if least else '≥'} 0 all along the beam, got"
            f" {values.min():.4g} to {values.max():.4g}."
        )
    return values
