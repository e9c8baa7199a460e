"""The data contract: one Dataset (trial, sensor, time), its quantities, and what breaks the
contract.
"""

import json
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd
import xarray as xr

from feeler.antenna.segments import SPACE_PLANES
from feeler.errors import InvalidInput
from feeler.records import Registry
from feeler.tensors import transforms as accessor  # noqa: F401  # whoever has a Dataset of touches has ds.feeler
from feeler.validation import checked

# Quantities: all that a Dataset of touches may hold, each with its unit, its meaning, its dims
# and how it is made.
#
# A new one is one entry here, or one ``QUANTITIES.register(name, Quantity(...))`` from outside
# the package.

DIMS = ("trial", "sensor", "time")
MAX_LISTED = 1000  # trials, above which `trials` among the attributes is left out
_PATH = ("trial", "time", "axis")
IN_SPACE = {
    "angle": ("trial", "plane", "sensor", "time"),
    "curvature": ("trial", "plane", "sensor", "time"),
    "velocity": ("trial", "plane", "sensor", "time"),
    "base_moment": _PATH,
}
"""Dims of those quantities that have others for an antenna in space; its ``axis`` has z as well."""


@dataclass(frozen=True, kw_only=True)
class Quantity:
    """One variable or coordinate of a Dataset.

    Attributes
    ----------
    unit : str
        As the library pint reads it; "1" for a number without unit, empty for text.
    meaning : str
        Half a sentence; it becomes ``long_name``.
    dims : tuple[str, ...]
        Its dims; a quantity of touches begins with ``trial``.
    make : Callable[[Any, Any], np.ndarray | None] | None
        ``make(antenna, motion)`` gives one trial's values, dims without ``trial``; None where the
        motion lacks it.
    coordinate : bool
        A label of trials, sensors or samples rather than a measured variable.
    required : bool
        Whether each Dataset must have it.
    optional : bool
        Recorded only where asked for by name (``save=``).
    gaps : bool
        Whether it may be NaN, where there is nothing to tell.
    """

    unit: str = ""
    meaning: str = ""
    dims: tuple[str, ...]
    make: Callable[[Any, Any], np.ndarray | None] | None = None
    coordinate: bool = False
    required: bool = False
    optional: bool = False
    gaps: bool = False


def _take(name: str) -> Callable[[Any, Any], np.ndarray | None]:
    return lambda antenna, motion: getattr(motion, name, None)


def _label(unit: str, meaning: str, dim: str = "trial", required: bool = False) -> Quantity:
    return Quantity(
        unit=unit,
        meaning=meaning,
        dims=(dim,),
        coordinate=True,
        required=required,
        gaps=dim == "trial",
    )


def _find_contact(antenna: Any, motion: Any) -> np.ndarray | None:
    """Points (sample, axis) [mm] at the arc lengths of a motion's contacts; None if unknown."""
    place = getattr(motion, "contact_place", None)
    if place is None:
        return None
    arc, start = np.asarray(place) * antenna.length, antenna.hinge_position
    last = antenna.n_segments - 1
    number = np.clip(np.searchsorted(start, np.nan_to_num(arc), "right") - 1, 0, last)
    share = (arc - start[number]) / antenna.segment_length[number]
    points, rows = antenna.shape(motion.angle), np.arange(len(arc))
    first, second = points[rows, number], points[rows, number + 1]
    return first + share[:, None] * (second - first)


QUANTITIES: Registry[Quantity] = Registry("quantity")
for _name, _quantity in {
    "angle": Quantity(
        unit="rad",
        meaning="hinge angle, positive towards +x, in space also towards +z, and of twisting",
        dims=DIMS,
        make=lambda antenna, motion: np.moveaxis(motion.angle[..., antenna.sensors - 1], 0, -1),
        required=True,
    ),
    "curvature": Quantity(
        unit="1/mm",
        meaning="hinge angle over the length of the segment it carries",
        dims=DIMS,  # derived from angle and segment_length, never made from a motion
    ),
    "velocity": Quantity(
        unit="rad/ms",
        meaning="angular velocity of the hinge",
        dims=DIMS,
        make=lambda antenna, motion: np.moveaxis(
            motion.velocity[..., antenna.sensors - 1], 0, -1
        ),
        optional=True,
    ),
    "tip": Quantity(
        unit="mm",
        meaning="place of the tip, base at the origin, straight antenna along +y",
        dims=_PATH,
        make=lambda antenna, motion: antenna.tip(motion.angle),
    ),
    "force": Quantity(
        unit="N", meaning="total contact force on the antenna", dims=_PATH, make=_take("force")
    ),
    "base_force": Quantity(
        unit="N", meaning="force that holds the base", dims=_PATH, make=_take("base_force")
    ),
    "base_moment": Quantity(
        unit="N*mm",
        meaning="moment that holds the base",
        dims=("trial", "time"),
        make=_take("base_moment"),
    ),
    "contact_place": Quantity(
        unit="1",
        meaning="arc length of the contact over antenna length, NaN without contact",
        dims=("trial", "time"),
        make=_take("contact_place"),
        gaps=True,
    ),
    "contact_point": Quantity(
        unit="mm",
        meaning="place of the contact on the antenna's axis, as that of the tip, NaN without",
        dims=_PATH,
        make=_find_contact,
        optional=True,
        gaps=True,
    ),
    "base_pose": Quantity(
        meaning="x, y [mm] and heading [rad] of the base; in space x, y, z and rotation vector",
        dims=("trial", "time", "pose"),
        make=_take("base"),
        optional=True,
    ),
    "work": Quantity(
        unit="uJ",
        meaning="work done on the antenna since time 0, by its base and by all objects",
        dims=("trial", "time", "mover"),
        make=_take("work"),
        optional=True,
    ),
    "timestep": Quantity(
        unit="ms",
        meaning="integration step that reached the accuracy",
        dims=("trial",),
        make=_take("timestep"),
        optional=True,
    ),
    "sink": Quantity(
        unit="1",
        meaning="greatest depth that a contact sank in, over the smaller radius",
        dims=("trial",),
        make=lambda antenna, motion: motion.sink[-1] if hasattr(motion, "sink") else None,
    ),
    "error": Quantity(
        unit="1",
        meaning="greatest error over the peak, as other timesteps tell (with accuracy= contacts)",
        dims=("trial",),
        make=_take("error"),
        optional=True,
    ),
    "rate": Quantity(
        unit="Hz", meaning="rate of spikes of the unit", dims=("trial", "unit", "time")
    ),
    "spike_time": Quantity(
        unit="ms",
        meaning="time of a spike, NaN beyond the unit's last",
        dims=("trial", "unit", "event"),
        gaps=True,
    ),
    "time": _label("ms", "", "time", required=True),
    "position": _label(
        "1", "arc length of the sensor's hinge over antenna length", "sensor", required=True
    ),
    "segment": _label(
        "", "number of the sensor's hinge, 1 at the base", "sensor", required=True
    ),
    "segment_length": _label(
        "mm", "length of the segment that the sensor's hinge carries", "sensor"
    ),
    "unit_position": _label("1", "arc length of the unit over antenna length", "unit"),
    "unit_side": _label(
        "", "the side of the antenna that the unit answers to, 1 or -1", "unit"
    ),
    "unit_around": _label(
        "deg", "where around the antenna side 1 lies, from x towards z", "unit"
    ),
    "feature": _label("", "the object's name", required=True),
    "kind": _label("", "the object's shape: ball, box …"),
    "size": _label("mm", "half-width or radius of the object", required=True),
    "location": _label(
        "1", "place of the touch, arc length over antenna length", required=True
    ),
    "speed": _label("mm/ms", "speed of the object", required=True),
    "approach": _label("deg", "angle between the motion and the antenna"),
    "azimuth": _label("deg", "angle by which the approach is turned about the touched segment"),
    "side": _label("", "the side the object comes from"),
    "lead": _label("ms", "time before contact"),
    "friction": _label("1", "coefficient of sliding friction"),
    "base": _label("", "how the base moves; empty where it is clamped"),
    "antenna": _label("", "name of the antenna", required=True),
    "antenna_stiffness": _label("1", "stiffness over that of the antenna it is a variant of"),
    "antenna_damping": _label("1", "damping over that of the antenna it is a variant of"),
    "antenna_mass": _label("1", "mass over that of the antenna it is a variant of"),
    "antenna_gradient": _label("1", "added to the logarithm of the stiffness from base to tip"),
    "source": _label("", "simulation, robot or surrogate", required=True),
    "seed": _label("", "the trial's own seed", required=True),
}.items():
    QUANTITIES.register(_name, _quantity)


def find_dims(name: str, spatial: bool) -> tuple[str, ...]:
    """Dims of a quantity, of touches in the plane or in space."""
    dims = QUANTITIES[name].dims
    return IN_SPACE.get(name, dims) if spatial else dims


def derive_curvature(angle: Any, segment_length: Any) -> Any:
    """Curvature [1/mm] from angle [rad] and the length [mm] of the segments, of the same dims."""
    return angle / segment_length


# Tactile tensors: the one Dataset that every producer makes and every analysis reads.

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
        Values by the names of :data:`feeler.tensors.schema.QUANTITIES`, in their dims and
        units: ``angle`` (trial, sensor, time) [rad], and ``tip``, ``force`` … where there are any.
        Of an antenna in space ``angle`` is (trial, plane, sensor, time).

    Returns
    -------
    xarray.Dataset
        The quantities given, and ``curvature`` = angle / segment_length.
    """
    required = [
        name
        for name, q in QUANTITIES.items()
        if q.coordinate and q.required and q.dims == ("trial",)
    ]
    if missing := [name for name in required if name not in trials]:
        raise InvalidInput(
            f"trials lacks {', '.join(missing)}; each trial needs {', '.join(required)}."
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
    dims = {name: quantity.dims for name, quantity in QUANTITIES.items()}
    dims |= IN_SPACE if spatial else {}
    variables = {
        name: (dims.get(name) or QUANTITIES[name].dims, values)  # which refuses unknown names
        for name, values in given.items()
    }
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
    # Left to find out what arrays are, xarray loads each array library that is installed: 0.7 s.
    indexes = {
        name: xr.indexes.PandasIndex(pd.Index(values), name, values.dtype)
        for name, (dims, values) in coordinates.items()
        if name == dims
    }
    wrapped = {
        name: xr.Variable(dims, values, fastpath=True)
        for name, (dims, values) in (coordinates | variables).items()
        if name not in indexes
    }
    for index in indexes.values():
        wrapped |= index.create_variables()
    coords = xr.Coordinates({name: wrapped.pop(name) for name in coordinates}, indexes)
    return label_units(xr.Dataset(wrapped, coords, attrs=plain))


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
        name: quantity.make
        for name, quantity in choose_quantities(save).items()
        if name not in without
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
    antenna: Any,
    time: np.ndarray,
    readings: Sequence[Mapping[str, np.ndarray]],
    *,
    trials: Mapping[str, Sequence[object]],
    attrs: Mapping[str, object] | None = None,
    **given: np.ndarray,
) -> xr.Dataset:
    """The Dataset of what :func:`reduce_motion` kept of several motions; arguments as in
    :func:`make_tensors`.
    """
    index = antenna.sensors - 1
    stacked: dict[str, Any] = {
        name: np.stack([reading[name] for reading in readings]) for name in readings[0]
    }
    kinds = [values.dtype.name for values in stacked.values()]
    return make_tensors.__wrapped__(  # type: ignore[attr-defined]
        time=time,
        segment=antenna.sensors,
        position=antenna.hinge_position[index] / antenna.length,
        segment_length=antenna.segment_length[index],
        trials=trials,
        attrs=attrs,
        dtype=kinds[0] if kinds else "float64",
        **stacked | given,
    )


def choose_quantities(save: Sequence[str] | None) -> dict[str, Quantity]:
    """The quantities to be made from motions, by name; an unknown name in ``save`` is an
    InvalidInput.
    """
    if isinstance(save, str):
        raise InvalidInput(
            f"save must be a list of names, got the text {save!r}; write save=({save!r},)."
        )
    if save is None:
        return {name: q for name, q in QUANTITIES.items() if q.make and not q.optional}
    chosen = {name: QUANTITIES[name] for name in ("angle", *save)}
    for name, quantity in chosen.items():
        if quantity.coordinate:
            raise InvalidInput(
                f"{name!r} is a coordinate and always saved; save= names variables."
            )
    return {name: quantity for name, quantity in chosen.items() if quantity.make}


def label_units(dataset: xr.Dataset) -> xr.Dataset:
    """Attach ``units`` and ``long_name`` to every variable that the contract knows."""
    for name, quantity in QUANTITIES.items():
        if name in dataset.variables:
            attrs = dataset.variables[name].attrs
            attrs |= {"units": quantity.unit} if quantity.unit else {}
            attrs |= {"long_name": quantity.meaning} if quantity.meaning else {}
    return dataset


# The one door: every Dataset of tactile tensors passes here, whoever made it.

BLOCK = 64 * 2**20  # bytes looked at together, so that a lazy Dataset of any size can pass


@checked
def validate(dataset: xr.Dataset) -> xr.Dataset:
    """The same Dataset if it keeps the data contract.

    Raises
    ------
    InvalidInput
        With every breach found, one a line.
    """
    return raise_if_invalid(find_errors(dataset), dataset)


def raise_if_invalid(breaches: list[str], dataset: xr.Dataset) -> xr.Dataset:
    """The Dataset, or one InvalidInput with all its breaches."""
    if breaches:
        raise InvalidInput(
            "not a valid set of tactile tensors:\n"
            + "\n".join(f"  - {breach}" for breach in breaches)
        )
    return dataset


@checked
def find_errors(dataset: xr.Dataset, *, whole: bool = True, numbers: bool = True) -> list[str]:
    """What is wrong with a Dataset, in words; empty where nothing is.

    With ``whole=False`` what is missing is no breach, as in a file of a single variable; with
    ``numbers=False`` the numbers of variables, which a store reads when they are used, are left
    unread: labels, dims, types and units are looked at.
    """
    if whole and "angle" not in dataset:
        return [
            f"variable 'angle' {DIMS} is missing; found {list(dataset.data_vars) or 'no variables'}"
        ]
    breaches = [
        f"coordinate '{name}' along {quantity.dims[0]} is missing"
        for name, quantity in QUANTITIES.items()
        if whole and quantity.coordinate and quantity.required and name not in dataset.coords
    ]
    known = [name for name in map(str, dataset.variables) if name in QUANTITIES]
    spatial = "plane" in dataset.dims
    axes, where = (3, " in space") if spatial else (2, "")
    for name in known:
        wanted, dims = find_dims(name, spatial), dataset[name].dims
        if dims != wanted:
            breaches.append(f"'{name}' must have dims {wanted}{where}, got {dims}")
        elif "axis" in dims and dataset.sizes["axis"] != axes:
            breaches.append(
                f"'{name}' must have {axes} axes{where}, got {dataset.sizes['axis']}"
            )
    if spatial and dataset.sizes["plane"] not in (2, len(SPACE_PLANES)):
        breaches.append(
            f"'plane' must be {', '.join(SPACE_PLANES)} or the first two of them, got"
            f" {dataset.sizes['plane']}"
        )
    unread = set() if numbers else set(map(str, dataset.data_vars))
    return breaches or [
        words for name in known for words in _find_value_breaches(dataset, name, name in unread)
    ]


def _find_value_breaches(dataset: xr.Dataset, name: str, unread: bool) -> Iterator[str]:
    quantity, item = QUANTITIES[name], dataset[name]
    if item.attrs.get("units", quantity.unit) != quantity.unit:
        yield f"'{name}' must be in {quantity.unit}, says {item.attrs['units']!r}"
    if name == "source":
        unknown = sorted(set(map(str, np.unique(item.values))) - set(SOURCES))
        if unknown:
            yield f"'source' must be one of {', '.join(SOURCES)}, got {unknown}"
    elif quantity.unit and not (
        item.dtype.kind in "fiu" and (unread or quantity.gaps or _is_finite(item))
    ):
        yield f"'{name}' has values that are not finite numbers"
    elif name in ("time", "position") and np.any(np.diff(item.values) <= 0):
        order = "" if name == "time" else "sensors must run from base to tip: "
        yield f"{order}'{name}' must rise strictly"


def _is_finite(item: xr.DataArray) -> bool:
    """Whether every value is finite, looked at block by block."""
    rows = max(1, BLOCK * item.shape[0] // max(item.nbytes, 1)) if item.ndim else 1
    blocks = (
        (item[start : start + rows] for start in range(0, item.shape[0], rows))
        if item.ndim
        else (item,)
    )
    return all(bool(np.isfinite(block.values).all()) for block in blocks)
