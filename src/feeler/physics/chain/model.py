"""A scene as plain arrays: what the compiled sweeps read."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from feeler.antenna.segments import Antenna
from feeler.objects.bodies import Object
from feeler.physics.chain import fields as f
from feeler.physics.chain.contact import MIN_VALUE
from feeler.physics.contact import MIN_FRICTION, Contact, find_invweight, find_radius
from feeler.physics.scene import Scene

_MARGIN = 1e-5  # mm; [C] what the search for near segments allows for rounding

_Part = tuple[int, np.ndarray]
"""Kind and corners (corner, 2) of a convex part."""


@dataclass(frozen=True, kw_only=True, eq=False)
class ChainModel:
    """One lane's constants: ``constants`` (field, segment), ``base`` (field,), ``obj`` and
    ``place`` (object, field), and the convex ``parts`` of all objects, object after object,
    ``owner`` (object + 1,) being the first part of each.

    Attributes
    ----------
    bounds : np.ndarray
        (part, 4): bounding boxes, rounding included.
    """

    constants: np.ndarray
    base: np.ndarray
    obj: np.ndarray
    place: np.ndarray
    parts: tuple[_Part, ...]
    owner: np.ndarray
    bounds: np.ndarray


@lru_cache(
    maxsize=8 * f.LANES
)  # as many as are run at once; with an accuracy each of them is run more than once
def make_model(scene: Scene) -> ChainModel:
    """The scene's arrays; they depend on no timestep."""
    shapes = [
        [(_get_kind(part), np.asarray(part)) for part in o.feature.parts] for o in scene.objects
    ]
    boxes = [
        _make_box(corners, o.feature.rounding)
        for o, s in zip(scene.objects, shapes, strict=True)
        for _, corners in s
    ]
    return ChainModel(
        constants=_make_constants(scene.antenna, scene.contact),
        base=_make_base(scene),
        obj=np.array([_make_object(o, scene) for o in scene.objects]).reshape(-1, f.N_OBJECT),
        place=np.array([_make_place(o, scene) for o in scene.objects]).reshape(-1, f.N_PLACE),
        parts=tuple(part for shape in shapes for part in shape),
        owner=np.cumsum([0, *map(len, shapes)]),
        bounds=np.array(boxes).reshape(-1, 4),
    )


def _get_kind(part: np.ndarray) -> int:
    """How contact with a convex part is found: one corner is a ball, an upright rectangle a box,
    all else a polygon.
    """
    if len(part) == 1:
        return f.KIND_BALL
    if len(part) == 4 and all(np.unique(part[:, axis]).size == 2 for axis in (0, 1)):
        return f.KIND_BOX
    return f.KIND_POLYGON


def _order_box(corners: np.ndarray) -> np.ndarray:
    """A rectangle's corners counter-clockwise, the lower one of the leading face first."""
    (low_x, low_y), (high_x, high_y) = corners.min(axis=0), corners.max(axis=0)
    return np.array([[high_x, low_y], [high_x, high_y], [low_x, high_y], [low_x, low_y]])


@lru_cache(maxsize=8)  # antennae compare by identity and never change
def _make_constants(antenna: Antenna, contact: Contact) -> np.ndarray:
    table = np.zeros((f.N_CONSTANTS, antenna.n_segments))
    fill_segments(table, antenna, contact)
    table[f.C_STIFFNESS], table[f.C_DAMPING], table[f.C_REST] = (
        antenna.stiffness,
        antenna.damping,
        antenna.rest_angle,
    )
    table[f.C_INERTIA] = antenna.segment_mass * antenna.segment_length**2 / 3
    return table


def fill_segments(table: np.ndarray, antenna: Antenna, contact: Contact) -> None:
    """Put the segments' sizes and what their contacts are like into the rows of a table."""
    table[f.C_LENGTH], table[f.C_MASS], table[f.C_RADIUS] = (
        antenna.segment_length,
        antenna.segment_mass,
        antenna.radius,
    )
    table[f.C_START] = antenna.hinge_position / antenna.length
    table[f.C_PORTION] = antenna.segment_length / antenna.length
    table[f.C_INVWEIGHT] = find_invweight(antenna)
    time_constant, damping_ratio = contact.solref
    soft = contact.soften(antenna)
    high = table[f.C_D_MAX] = soft.d_max
    table[f.C_WIDTH], table[f.C_SLOW], table[f.C_WIDEST] = soft.width, soft.slow, soft.widest
    table[f.C_K] = 1 / np.maximum(MIN_VALUE, (high * time_constant * damping_ratio) ** 2)
    table[f.C_B] = 2 / np.maximum(MIN_VALUE, high * time_constant)


def _make_base(scene: Scene) -> np.ndarray:
    table = np.zeros(f.N_BASE)
    table[[f.B_X, f.B_Y, f.B_HEADING]] = scene.base_pose
    table[[f.B_VX, f.B_VY, f.B_TURN]] = scene.base_velocity
    table[[f.B_GRAVITY_X, f.B_GRAVITY_Y]] = scene.gravity
    return table


def _make_object(item: Object, scene: Scene) -> np.ndarray:
    table = np.zeros(f.N_OBJECT)
    fill_object(table, item, scene)
    table[f.O_PLANES :] = _make_planes(item).ravel()
    return table


def fill_object(table: np.ndarray, item: Object, scene: Scene) -> None:
    """Put what contacts with an object are like into the first columns of a table."""
    table[f.O_D_MIN], _, _, table[f.O_MIDPOINT], table[f.O_POWER] = scene.contact.solimp
    table[f.O_SLOW], table[f.O_FAST] = scene.contact.widen(scene.speed)
    table[f.O_FRICTION] = max(item.friction, MIN_FRICTION) if item.friction > 0 else 0.0
    table[f.O_ROUNDING] = item.feature.rounding
    table[f.O_RADIUS] = find_radius(item)


def _make_planes(item: Object) -> np.ndarray:
    """Half planes (plane, 3) that hold the grown object: the sides of a triangle or quadrangle,
    else of the bounding box.
    """
    parts = item.feature.parts
    corners = (
        parts[0]
        if len(parts) == 1 and len(parts[0]) in (3, 4)
        else _order_box(np.concatenate(parts))
    )
    along = np.roll(corners, -1, axis=0) - corners
    normal = np.stack([along[:, 1], -along[:, 0]], axis=1)
    if not normal.any(axis=1).all():  # a box without width or height
        normal = np.array([(1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0)])
    normal /= np.hypot(*normal.T)[:, None]
    distance = (normal * corners).sum(axis=1) + item.feature.rounding + _MARGIN
    return np.concatenate([normal, distance[:, None]], axis=1)[[0, 1, 2, -1]]


def _make_place(item: Object, scene: Scene) -> np.ndarray:
    table = np.zeros(f.N_PLACE)
    table[[f.P_X, f.P_Y]] = np.asarray(item.place) - scene.base_pose[:2]
    table[[f.P_FORWARD_X, f.P_FORWARD_Y]] = item.forward
    table[[f.P_VX, f.P_VY]], table[f.P_TURN] = item.velocity, item.turn
    table[f.P_FIRST], table[f.P_LAST] = 1e9, -1.0
    return table


def _make_box(corners: np.ndarray, grow: float) -> np.ndarray:
    return np.concatenate([corners.min(axis=0) - grow, corners.max(axis=0) + grow])


def stack_shapes(models: Sequence[ChainModel]) -> tuple[np.ndarray, ...]:
    """Kinds, corners, first corners, bounding boxes (of parts, of blocks of them) and owners, the
    lane first, padded.
    """
    lanes, n_parts = len(models), max(1, *(len(m.parts) for m in models))
    n_corners = max(1, *(sum(len(c) for _, c in m.parts) for m in models))
    kind, starts = (
        np.zeros((lanes, n_parts), dtype=np.int64),
        np.zeros((lanes, n_parts + 1), dtype=np.int64),
    )
    corners, bounds = np.zeros((lanes, n_corners, 2)), np.zeros((lanes, n_parts, 4))
    blocks = np.zeros((lanes, -(-n_parts // f.BLOCK), 4))
    owner = np.zeros((lanes, max(len(m.owner) for m in models)), dtype=np.int64)
    for lane, model in enumerate(models):
        for k, (kind_, points) in enumerate(model.parts):
            kind[lane, k], starts[lane, k + 1] = kind_, starts[lane, k] + len(points)
            points = _order_box(points) if kind_ == f.KIND_BOX else points
            corners[lane, starts[lane, k] : starts[lane, k + 1]] = points
        bounds[lane, : len(model.bounds)] = model.bounds
        for k in range(0, len(model.bounds), f.BLOCK):
            own = model.bounds[k : k + f.BLOCK]
            blocks[lane, k // f.BLOCK] = [*own[:, :2].min(axis=0), *own[:, 2:].max(axis=0)]
        owner[lane, : len(model.owner)] = model.owner
        owner[lane, len(model.owner) :] = model.owner[-1]
    return kind, corners, starts, bounds, blocks, owner
