"""Tactile tensors: the one Dataset that every producer makes and every analysis reads."""

import json
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np
import xarray as xr

from feeler.antenna.space import SPACE_PLANES
from feeler.errors import InvalidInput
from feeler.records.checked import checked
from feeler.tensors import accessor  # noqa: F401  # whoever has a Dataset of touches has ds.feeler
from feeler.tensors.quantities import (
    IN_SPACE,
    QUANTITIES,
    derive_curvature,
    find_dims,
    list_required,
)

SOURCES = ("simulation", "robot", "surrogate")


@checked
def make_tensors(
    *,
    time: np.ndarray,
    segment: Sequence[int] | np.ndarray,
    position: np.ndarray,
    segment_length: np.ndarray,
    trials: Mapping[str, Sequence[object]],
    attrs: Mapping[str, object] | None = None,
    dtype: str = "float64",
    **quantities: np.ndarray | None,
) -> xr.Dataset:
    """The Dataset of the data contract, units attached.

    Parameters
    ----------
    time
        (time,) [ms].
    segment, position, segment_length
        Per sensor: hinge number, arc length over antenna length, and length [mm] of the segment it
        carries.
    trials
        Coordinates, one value per trial: ``feature, size, location, speed, antenna, source, seed``
        and any others; ``trial`` are their numbers, by default from 0.
    attrs
        ``configuration`` and whatever else should travel; mappings are stored as JSON.
    dtype
        Type of the variables, ``float64`` or ``float32``.
    quantities
        Values by the names of :data:`feeler.tensors.quantities.QUANTITIES`, in their dims and
        units: ``angle`` (trial, sensor, time) [rad], and ``tip``, ``force`` … where there are any.
        Of an antenna in space ``angle`` is (trial, plane, sensor, time).

    Returns
    -------
    xarray.Dataset
        The quantities given, and ``curvature`` = angle / segment_length.
    """
    missing = [name for name in list_required("trial") if name not in trials]
    if missing:
        raise InvalidInput(
            f"trials lacks {', '.join(missing)}; each trial needs"
            f" {', '.join(list_required('trial'))}."
        )
    if quantities.get("angle") is None:
        raise InvalidInput("the tensors need angle= (trial, sensor, time) [rad].")
    given = {
        name: np.asarray(values, dtype=dtype)
        for name, values in quantities.items()
        if values is not None
    }
    length = np.asarray(segment_length, dtype=float)
    given.setdefault(
        "curvature", derive_curvature(given["angle"], length[:, None]).astype(dtype)
    )
    spatial = given["angle"].ndim == len(IN_SPACE["angle"])
    variables = {name: (find_dims(name, spatial), values) for name, values in given.items()}
    coordinates = {
        "time": ("time", np.asarray(time, dtype=float)),
        "sensor": ("sensor", np.arange(1, len(segment) + 1)),
        "segment": ("sensor", np.asarray(segment, dtype=int)),
        "position": ("sensor", np.asarray(position, dtype=float)),
        "segment_length": ("sensor", length),
        "trial": ("trial", np.arange(given["angle"].shape[0])),
        **{name: ("trial", np.asarray(list(values))) for name, values in trials.items()},
    }
    if any("axis" in dims for dims, _ in variables.values()):
        coordinates["axis"] = ("axis", np.array(["x", "y", "z"][: 3 if spatial else 2]))
    if spatial:
        planes = given["angle"].shape[1]
        coordinates["plane"] = ("plane", np.array(SPACE_PLANES[:planes]))
    plain = {
        name: json.dumps(value, sort_keys=True)
        if isinstance(value, Mapping | list | tuple)
        else value
        for name, value in (attrs or {}).items()
    }
    return label_units(xr.Dataset(variables, coordinates, attrs=plain))


def make_motion_tensors(
    antenna: Any,
    motions: Sequence[Any],
    *,
    trials: Mapping[str, Sequence[object]],
    attrs: Mapping[str, object] | None = None,
    **given: np.ndarray,
) -> xr.Dataset:
    """The Dataset of motions of one antenna: all quantities that they have, but the optional ones.

    Parameters
    ----------
    antenna, motions
        One motion per trial, all sampled at the same times; the antenna's sensors are recorded.
    given
        Quantities made otherwise, which take the place of those made from the motions.
    """
    readings = [reduce_motion(antenna, motion, without=given) for motion in motions]
    return stack_readings(
        antenna, motions[0].time, readings, trials=trials, attrs=attrs, **given
    )


def reduce_motion(
    antenna: Any,
    motion: Any,
    save: Sequence[str] | None = None,
    dtype: str = "float64",
    without: Iterable[str] = (),
) -> dict[str, np.ndarray]:
    """What is kept of one motion: values by name, dims as in the contract without ``trial``.

    Raises
    ------
    InvalidInput
        ``save`` names a quantity that the motion does not have.
    """
    wanted = {
        name: QUANTITIES[name].make for name in choose_quantities(save) if name not in without
    }
    values = {name: make(antenna, motion) for name, make in wanted.items()}  # type: ignore[misc]
    absent = [name for name in save or () if name in values and values[name] is None]
    if absent:
        raise InvalidInput(
            f"this engine's motions have no {', '.join(absent)}; leave it out of save=."
        )
    return {
        name: np.array(value, dtype=dtype)
        for name, value in values.items()
        if value is not None
    }


def stack_readings(
    antenna: Any, time: np.ndarray, readings: Sequence[Mapping[str, np.ndarray]], **fields: Any
) -> xr.Dataset:
    """The Dataset of what :func:`reduce_motion` kept of several motions; ``fields`` go to
    :func:`make_tensors`.
    """
    index = antenna.sensors - 1
    stacked: dict[str, Any] = {
        name: np.stack([reading[name] for reading in readings]) for name in readings[0]
    }
    kinds = [values.dtype.name for values in stacked.values()]
    return make_tensors(
        time=time,
        segment=antenna.sensors,
        position=antenna.hinge_position[index] / antenna.length,
        segment_length=antenna.segment_length[index],
        dtype=kinds[0] if kinds else "float64",
        **stacked,
        **fields,
    )


def choose_quantities(save: Sequence[str] | None) -> list[str]:
    """Names of the quantities to be made from motions; an unknown name in ``save`` is an
    InvalidInput.
    """
    if isinstance(save, str):
        raise InvalidInput(
            f"save must be a list of names, got the text {save!r}; write save=({save!r},)."
        )
    if save is None:
        return [
            name
            for name, quantity in QUANTITIES.items()
            if quantity.make and not quantity.optional
        ]
    for name in save:
        if QUANTITIES[name].coordinate:
            raise InvalidInput(
                f"{name!r} is a coordinate and always saved; save= names variables."
            )
    return [name for name in dict.fromkeys(("angle", *save)) if QUANTITIES[name].make]


def label_units(dataset: xr.Dataset) -> xr.Dataset:
    """Attach ``units`` and ``long_name`` to every variable that the contract knows."""
    for name, variable in dataset.variables.items():
        quantity = QUANTITIES.get(str(name))
        if quantity and quantity.unit:
            variable.attrs["units"] = quantity.unit
        if quantity and quantity.meaning:
            variable.attrs["long_name"] = quantity.meaning
    return dataset
