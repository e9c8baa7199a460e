"""The side that a touch comes from: its sign in the tensors, and peaks that do not depend on it."""

import numpy as np
import xarray as xr
from scipy.special import cosdg, sindg

from feeler.errors import InvalidInput
from feeler.records.checked import checked


@checked
def mirror_to_left(tensors: xr.DataArray) -> xr.DataArray:
    """The tensors as if every object had come from the left: bending away from the object is
    positive, towards it negative.

    Trials whose coordinate ``side`` is "right" are mirrored and then labelled "left"; all others,
    and all trials of tensors without that label, stay as they are. In the plane a mirrored angle
    is −θ. In space the mirror stands across the direction a = (cos φ, sin φ) of the trial's
    ``azimuth`` φ: b − 2 (b · a) a for bending b in both planes, and torsion changes its sign, for
    angles that are small at each hinge.

    Parameters
    ----------
    tensors
        Bending: ``angle``, ``curvature`` or ``velocity`` of a Dataset, (trial, sensor, time) or in
        space (trial, plane, sensor, time).

    Returns
    -------
    xarray.DataArray
        Same dims, unit and coordinates, ``side`` aside.
    """
    right = find_right(tensors)
    if right is None or not right.any():
        return tensors
    found = tensors.where(~right, _mirror(tensors)).transpose(*tensors.dims)
    return found.assign_coords(side=tensors["side"].where(~right, "left"))


def find_right(tensors: xr.DataArray | xr.Dataset) -> xr.DataArray | None:
    """Whether each trial's object came from the right; None where no trial says its side."""
    side = tensors.coords.get("side")
    if side is None or not {*side.dims} <= {"trial"}:
        return None
    return side.drop_vars([name for name in side.coords if name != "trial"]) == "right"


def _mirror(tensors: xr.DataArray) -> xr.DataArray:
    if "plane" not in tensors.dims:
        return -tensors
    azimuth = tensors.coords.get("azimuth", xr.DataArray(0.0)).drop_vars(
        "azimuth", errors="ignore"
    )
    planes = [tensors.isel(plane=[k]) for k in range(tensors.sizes["plane"])]
    x, z = (plane.drop_vars("plane", errors="ignore") for plane in planes[:2])
    away = (cosdg(azimuth), sindg(azimuth))
    along = x * away[0] + z * away[1]
    mirrored = [
        (plane - 2 * along.assign_coords(plane.coords) * share).astype(tensors.dtype)
        for plane, share in zip(planes, away, strict=False)
    ]
    return xr.concat([*mirrored, *(-plane for plane in planes[2:])], "plane")


@checked
def get_bending(tensors: xr.DataArray) -> xr.DataArray:
    """Bending away from the object (trial, sensor, time), as :func:`mirror_to_left` has it; in
    space the length of its vector in both planes, √(b_x² + b_z²), without torsion.
    """
    if "plane" in tensors.dims:
        return (tensors.isel(plane=slice(2)) ** 2).sum("plane") ** 0.5
    return mirror_to_left(tensors)


@checked
def measure_peak(*tensors: xr.DataArray | np.ndarray) -> float:
    """The greatest magnitude in all of the tensors, in their unit, whatever its sign; in space that
    of the vector in both planes (:func:`get_bending`). NaN entries do not count.

    Raises
    ------
    InvalidInput
        No tensors.
    """
    if not tensors:
        raise InvalidInput("measure_peak needs at least one tensor.")
    return max(
        float(np.fmax.reduce(np.abs(_get_values(one)), axis=None, initial=0.0))
        for one in tensors
    )


def _get_values(tensors: xr.DataArray | np.ndarray) -> np.ndarray:
    return np.asarray(get_bending(tensors) if isinstance(tensors, xr.DataArray) else tensors)
