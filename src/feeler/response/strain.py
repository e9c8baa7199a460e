"""Strain at the surface: what a sensor on a side of the antenna feels."""

from collections.abc import Sequence

import xarray as xr

from feeler.antenna.antenna import Antenna
from feeler.errors import InvalidInput
from feeler.records.checked import checked
from feeler.tensors.scaling import project_planes
from feeler.tensors.unit import in_unit, need


@checked
def compute_strain(
    touches: xr.Dataset,
    antenna: Antenna,
    around: float | Sequence[float] = 0.0,
    *,
    turn: float = 0.0,
) -> xr.DataArray:
    """Strain at the surface of each sensor's segment, positive where it is stretched.

    ε = −r (κ_x cos φ + κ_z sin φ) for curvature κ [1/mm], the antenna's radius r [mm] and a side at
    φ: what bends towards a side is compressed there (Euler and Bernoulli). Campaniform sensilla sit
    on sides, and answer to compression.

    Parameters
    ----------
    touches
        A Dataset with ``curvature``, in the plane or in space.
    antenna
        The antenna that was touched; its ``radius`` is the distance of the surface from the axis.
    around
        Where the sides lie: φ [degrees], 0 towards x and 90 towards z, in the segment's frame.
    turn
        How much farther around each sensor sits than the one before it [degrees].

    Returns
    -------
    xarray.DataArray
        ``strain`` [1] (trial, side, sensor, time), with the coordinate ``around`` (side) [deg].

    Raises
    ------
    InvalidInput
        Sensors that the antenna has not.
    """
    need(touches, "segment", "curvature")
    segment = touches["segment"].values
    if segment.max() > antenna.n_segments:
        raise InvalidInput(
            f"the touches have a sensor on segment {segment.max()}, but {antenna.name!r} has"
            f" {antenna.n_segments}: give the antenna that was touched."
        )
    radius = xr.DataArray(antenna.radius[segment - 1], dims="sensor")
    found = -radius * project_planes(in_unit(touches["curvature"], "1/mm"), around, turn)
    found = found.transpose("trial", "side", "sensor", "time").rename("strain")
    found["around"].attrs = {
        "units": "deg",
        "long_name": "where the side lies, from x towards z",
    }
    return found.assign_attrs(
        units="1", long_name="strain at the surface, positive if stretched"
    )
