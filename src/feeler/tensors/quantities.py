"""Quantities: all that a Dataset of touches may hold, each with its unit, its meaning, its dims and
how it is made.

A new one is one entry here, or one ``QUANTITIES.register(name, Quantity(...))`` from outside the
package.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from feeler.records.registry import Registry

DIMS = ("trial", "sensor", "time")
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


def list_required(dim: str) -> tuple[str, ...]:
    """Names of the coordinates along ``dim`` that each Dataset must have."""
    return tuple(
        name
        for name, q in QUANTITIES.items()
        if q.coordinate and q.required and q.dims == (dim,)
    )


def derive_curvature(angle: Any, segment_length: Any) -> Any:
    """Curvature [1/mm] from angle [rad] and the length [mm] of the segments, of the same dims."""
    return angle / segment_length
