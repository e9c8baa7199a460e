"""Where an antenna bends most: at a hinge, or on a smoothed curve between hinges."""

from dataclasses import dataclass
from typing import Annotated

import numpy as np

from feeler.antenna.antenna import Antenna
from feeler.errors import InvalidInput
from feeler.records.checked import checked
from feeler.wall.sweep import Approach

_METHODS = ("smooth", "hinge")
_QUANTITIES = ("bend", "total")
_SMOOTHING = 1.0  # [C] mm; standard deviation of the smoothing kernel, three to seven segments
_GRID = 0.1  # mm; spacing of the smoothed curve before the parabola
_FAINTEST = 1e-6  # 1/mm; a shape bent less than this everywhere has no peak


@dataclass(frozen=True, kw_only=True, eq=False)
class Peak:
    """The point of greatest curvature of each shape; NaN where a shape is not bent.

    Attributes
    ----------
    position : np.ndarray
        Arc length (shape,) from the base [mm].
    curvature : np.ndarray
        Signed curvature (shape,) there [1/mm].
    at_base : np.ndarray
        Whether (shape,) the peak sits at the base hinge, where it says nothing about distance.
    """

    position: np.ndarray
    curvature: np.ndarray
    at_base: np.ndarray


@checked
def compute_curvature(
    antenna: Antenna, angle: Annotated[np.ndarray, "... segment"]
) -> np.ndarray:
    """Curvature θ_n / ℓ_n (…, segment) [1/mm] of hinge angles (…, segment) [rad] (paper, tactile
    tensor).
    """
    return _check_hinges(antenna, angle) / antenna.segment_length


def _check_hinges(antenna: Antenna, angle: np.ndarray) -> np.ndarray:
    angle = np.asarray(angle, dtype=float)
    if angle.shape[-1:] != (antenna.n_segments,) or not np.all(np.isfinite(angle)):
        raise InvalidInput(
            f"curvature needs finite angles of all {antenna.n_segments} hinges [rad], got shape"
            f" {angle.shape}."
        )
    return angle


@checked
def compute_smooth_curvature(
    antenna: Antenna,
    angle: Annotated[np.ndarray, "... segment"],
    position: Annotated[np.ndarray, "point"],
    smoothing: float = _SMOOTHING,
) -> np.ndarray:
    """Curvature (shape, point) [1/mm] at arc lengths ``position`` (point,) [mm]: Σ θ_n G(s − s_n) /
    Σ ℓ_n G(s − s_n).

    G is a Gaussian of standard deviation ``smoothing`` [mm]; a circular arc keeps its curvature up
    to both ends.
    """
    return (
        np.atleast_2d(_check_hinges(antenna, angle))
        @ make_kernel(antenna, position, smoothing).T
    )


def make_kernel(
    antenna: Antenna, position: np.ndarray, smoothing: float = _SMOOTHING
) -> np.ndarray:
    """What makes the smoothed curvature of hinge angles (point, segment) [1/mm]."""
    if not (np.isfinite(smoothing) and smoothing > 0):
        raise InvalidInput(
            f"smoothing must be finite and > 0 mm, got {smoothing}. Use method='hinge' for no"
            " smoothing."
        )
    weight = np.exp(-0.5 * ((position[:, None] - antenna.hinge_position) / smoothing) ** 2)
    return weight / (weight @ antenna.segment_length)[:, None]


@checked
def find_peak(
    antenna: Antenna,
    angle: np.ndarray,
    *,
    method: str = "smooth",
    smoothing: float = _SMOOTHING,
) -> Peak:
    """The point of greatest curvature, in size, of each shape.

    Parameters
    ----------
    angle
        Hinge angles (shape, segment) [rad], or beyond the slack shape: what is peaked is what is
        given.
    method
        ``hinge``: the hinge with the greatest |θ_n / ℓ_n|. ``smooth``: the greatest of the smoothed
        curve, between grid points by a parabola, so finer than a segment.
    """
    if method not in _METHODS:
        raise InvalidInput(f"unknown peak method {method!r}; valid: {', '.join(_METHODS)}.")
    angle = np.atleast_2d(_check_hinges(antenna, angle))
    if method == "hinge":
        curve, place = compute_curvature(antenna, angle), antenna.hinge_position
    else:
        place = np.linspace(
            0.0, antenna.hinge_position[-1], max(2, round(antenna.length / _GRID))
        )
        curve = compute_smooth_curvature(antenna, angle, place, smoothing)
    size, row = np.abs(curve), np.arange(len(curve))
    best = size.argmax(axis=1)
    position = place[best] if method == "hinge" else place_top(size, place)
    faint = size[row, best] < _FAINTEST
    return Peak(
        position=np.where(faint, np.nan, position),
        curvature=np.where(faint, np.nan, curve[row, best]),
        at_base=(best == 0) & ~faint,
    )


def place_top(size: np.ndarray, place: np.ndarray) -> np.ndarray:
    """Top (shape,) of the parabola through the greatest sample of each row and its neighbours; at
    the ends the sample.
    """
    best = size.argmax(axis=1)
    inner = np.clip(best, 1, size.shape[1] - 2)
    row = np.arange(len(size))
    before, top, after = size[row, inner - 1], size[row, inner], size[row, inner + 1]
    bow = before - 2 * top + after
    shift = np.where(bow < 0, 0.5 * (before - after) / np.where(bow < 0, bow, 1.0), 0.0)
    step = place[1] - place[0]
    return np.where(inner == best, place[inner] + np.clip(shift, -0.5, 0.5) * step, place[best])


@checked
def find_sweep_peak(
    sweep: Approach,
    *,
    quantity: str = "bend",
    method: str = "smooth",
    smoothing: float = _SMOOTHING,
) -> Peak:
    """Peaks of a sweep; NaN where the antenna does not touch the wall: no contact, no estimate.

    ``quantity``: ``bend``, beyond the slack shape, as a strain sensor feels it; ``total``, as a
    camera sees it.
    """
    if quantity not in _QUANTITIES:
        raise InvalidInput(f"unknown quantity {quantity!r}; valid: {', '.join(_QUANTITIES)}.")
    angle = sweep.bend if quantity == "bend" else sweep.angle
    peak = find_peak(sweep.antenna, angle, method=method, smoothing=smoothing)
    return Peak(
        position=np.where(sweep.contact, peak.position, np.nan),
        curvature=np.where(sweep.contact, peak.curvature, np.nan),
        at_base=peak.at_base & sweep.contact,
    )
