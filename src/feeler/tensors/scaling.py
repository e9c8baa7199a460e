"""On the way to an encoder: non-negative, scaled tensors, never baked into what is stored; and the
labels of what comes back.
"""

import warnings
from collections.abc import Sequence
from typing import Any, TypeVar

import numpy as np
import xarray as xr

from feeler.errors import Doubtful, InvalidInput
from feeler.records.checked import checked
from feeler.records.rules import show

SQUARED = (1e-140, 1e140)
"""Magnitudes whose squares, and sums of them, are numbers."""
Tensors = TypeVar("Tensors", xr.DataArray, np.ndarray)
MUCH = 0.25
"""Share of a trial's sum of squares that is not left out where bending both ways can be kept [C];
of the insect's touches from the left that were tried, at most 0.1 is negative."""
_MOST = 0.4  # [C] as MUCH, that is not left out without a word; a robot that rings reaches 0.37


@checked
def fold_planes(tensors: Tensors) -> Tensors:
    """Tensors (trial, sensor, time) of those in space (trial, plane, sensor, time): the sensors of
    one plane after those of the other. What has no planes stays as it is.
    """
    if "plane" not in getattr(tensors, "dims", ()):
        return tensors
    own: Any = tensors
    stacked = own.stack(line=("plane", "sensor"), create_index=False)
    return (
        stacked.drop_vars("sensor", errors="ignore")
        .rename(line="sensor")
        .transpose("trial", "sensor", "time")
    )


def refuse_masked(values: Any) -> None:
    """Refuse a NumPy array of which entries are masked: as plain numbers they would count."""
    if np.ma.is_masked(values):
        count = int(np.ma.count_masked(values))
        raise InvalidInput(
            f"{count} of {np.size(values)} entries are masked, and would be taken as measured."
            " Leave such trials out, or fill the gaps: np.ma.filled(X, value)."
        )


def find_scale(values: np.ndarray) -> float:
    """The power of two below the greatest magnitude, by which division rounds nothing; 1 where all
    is 0.
    """
    high = np.abs(values).max(initial=0.0)
    return float(2.0 ** (np.frexp(high)[1] - 1)) if high > 0 else 1.0


def check_squares(values: np.ndarray, name: str = "tensors") -> None:
    """Refuse what is too small or too large for its squares to be numbers."""
    high = np.abs(values).max(initial=0.0)
    if high > 0 and not SQUARED[0] <= high <= SQUARED[1]:
        raise InvalidInput(
            f"The greatest magnitude of the {name} is {high:.3g}; it must lie between"
            f" {SQUARED[0]:g} and {SQUARED[1]:g}, where squares are numbers. Choose another unit,"
            " or scale them: feeler.tensors.scale_common(X)."
        )


@checked
def rectify(tensors: Tensors) -> Tensors:
    """The tensors with negative values set to 0, as in the published video [D].

    Bending away from an object is positive after :func:`feeler.tensors.mirror_to_left`. Where more
    than 40 % of a trial's sum of squares is set to 0, a ``Doubtful`` warning says how much.
    """
    share = measure_negative(tensors)
    lost = share > _MOST
    if lost.any():
        warnings.warn(
            f"rectify sets up to {share.max():.0%} of a trial's signal (sum of squares) to 0, in"
            f" {lost.sum()} of {lost.size} trials more than {_MOST:.0%}. Objects from the right"
            " bend the antenna to the negative side: use mirror_to_left first, or fold_signs,"
            " which keeps bending both ways.",
            Doubtful,
            stacklevel=3,
        )
    return tensors.clip(min=0)


def measure_negative(tensors: xr.DataArray | np.ndarray) -> np.ndarray:
    """The share of each trial's sum of squares that is negative, Σ min(x, 0)² / Σ x² (trial,); 0
    for a trial that is 0 everywhere. What has no trials counts as one.
    """
    if getattr(getattr(tensors, "dtype", None), "kind", "") not in tuple("biuf"):
        raise InvalidInput(f"tensors must be an array of numbers, got {show(tensors)}.")
    if isinstance(tensors, xr.DataArray):
        alone = "trial" not in tensors.dims
        values = tensors.transpose("trial", ..., missing_dims="ignore").values
    else:
        values, alone = tensors, tensors.ndim < 3
    return np.array([_measure_negative(one) for one in (values[None] if alone else values)])


def _measure_negative(values: np.ndarray) -> float:
    known = values[np.isfinite(values)].astype(float)
    known /= np.abs(known).max(initial=0.0) or 1.0  # no square over- or underflows
    return float(np.sum(known[known < 0] ** 2) / (np.sum(known**2) or 1.0))


@checked
def fold_signs(tensors: Tensors) -> Tensors:
    """Non-negative tensors (trial, sensor, time) that keep bending both ways: max(x, 0) of every
    sensor, then max(−x, 0) of every sensor as further sensors; those in space as
    :func:`fold_planes` has them.

    For what needs values ≥ 0, such as ``ConvolutiveNMF``, where an antenna is touched on both
    sides.
    """
    folded: Any = fold_planes(tensors)
    ways = [folded.clip(min=0), (-folded).clip(min=0)]
    if not isinstance(folded, xr.DataArray):
        found: Any = np.concatenate(ways, axis=-2)
    else:
        found = xr.concat(ways, "sensor", coords="minimal", compat="override")
    return found


@checked
def scale_common(tensors: xr.DataArray | np.ndarray) -> xr.DataArray | np.ndarray:
    """The set divided by its greatest magnitude: one factor for all tensors, so that they stay
    comparable.

    Non-negative input comes out in [0, 1], as SSIM with range 1 needs it. To compare sets (speeds,
    antennas), scale them together, then split them.
    """
    tensors = tensors if isinstance(tensors, xr.DataArray) else np.asarray(tensors)
    largest = float(np.max(np.abs(np.asarray(tensors)), initial=0.0))
    if not (np.isfinite(largest) and largest > 0):
        raise InvalidInput(
            f"cannot scale tensors whose greatest magnitude is {largest}; did any contact take"
            " place?"
        )
    return tensors / largest


def label_like(
    values: np.ndarray, given: Any, dims: tuple[str, ...], name: str, **attrs: object
) -> Any:
    """``values`` with these dims and the coordinates of ``given`` along them; plain where ``given``
    is plain.
    """
    if not isinstance(given, xr.DataArray):
        return values
    sizes = dict(zip(dims, values.shape, strict=True))
    coords = {
        key: item
        for key, item in given.coords.items()
        if item.dims and all(sizes.get(str(dim)) == given.sizes[dim] for dim in item.dims)
    }
    return xr.DataArray(values, dims=dims, coords=coords, name=name, attrs=attrs)


@checked
def project_planes(
    tensors: xr.DataArray, around: float | Sequence[float] = 0.0, turn: float = 0.0
) -> xr.DataArray:
    """Bending towards sides of the antenna: b_x cos φ + b_z sin φ (trial, side, sensor, time).

    Parameters
    ----------
    tensors
        Angles or curvature, in space (trial, plane, sensor, time); those of an antenna in one plane
        have b_z = 0. Torsion bends nothing.
    around
        Where the sides lie around the antenna: φ [degrees], 0 towards x and 90 towards z, in the
        frame of each segment.
    turn
        How much farther around each sensor sits than the one before it [degrees].
    """
    sides = np.atleast_1d(np.asarray(around, dtype=float))
    if not np.isfinite([*sides, turn]).all():
        raise InvalidInput(
            f"around and turn must be finite angles [degrees], got {around}, {turn}."
        )
    rank = xr.DataArray(np.arange(tensors.sizes["sensor"]), dims="sensor")
    at = np.deg2rad(xr.DataArray(sides, dims="side") + turn * rank)
    if "plane" in tensors.dims:
        x, z = (tensors.isel(plane=k, drop=True) for k in range(2))
        found = x * np.cos(at) + z * np.sin(at)
    else:
        found = tensors * np.cos(at)
    found = found.assign_coords(around=("side", sides)).assign_attrs(tensors.attrs)
    return found.transpose("trial", "side", "sensor", "time")
