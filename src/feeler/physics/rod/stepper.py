"""The rod engine: a scene as plain arrays, stepped, without inertia or with."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import NamedTuple

import numpy as np

from feeler.antenna.segments import Antenna, require_plane
from feeler.errors import InvalidInput
from feeler.objects.bodies import Object
from feeler.objects.shapes import Feature
from feeler.physics.contact import Contact, _find_radius, get_contact
from feeler.physics.engine import Contacts, Engine, State, Stepper, _announce_compiling
from feeler.physics.rod import newton as f
from feeler.physics.rod.newton import march, place_nodes, relax
from feeler.physics.scene import Scene

# A scene as plain arrays: what the rod's compiled functions read and write.

# [C] 1/mm²; contact stiffness over that of the node's hinge per rad. At rest nodes sink in by some
# 1e-3 mm, in motion, where
# a harder contact would cost more iterations than it is worth, by some 0.02 mm.
FIRMNESS, SOFT = 1e3, 20.0
_FAR = 1e4  # mm; half length of a face without end


class _RodModel(NamedTuple):
    """What stays as it is.

    Attributes
    ----------
    table : np.ndarray
        (segment, column)
    faces : np.ndarray
        (face, column), in the frames of their objects; a part's faces run clockwise, the last joins
        the first.
    parts : np.ndarray
        (part, column)
    gravity : np.ndarray
        (2,) [mm/ms²]
    """

    table: np.ndarray
    faces: np.ndarray
    parts: np.ndarray
    gravity: np.ndarray


class _RodLane(NamedTuple):
    """What moves.

    Attributes
    ----------
    heading : np.ndarray
        Of every segment (segment,) [rad].
    points : np.ndarray
        Base, hinges and tip (segment + 1, 2) [mm].
    velocity : np.ndarray
        Of every node but the base (segment, 2) [mm/ms]; stays 0 without inertia.
    rate : np.ndarray
        Of the hinges (segment,) [rad/ms].
    anchor : np.ndarray
        Where on a part's rim a node sticks (segment, part) [mm]; NaN where it has just come or is
        away.
    pressed : np.ndarray
        Normal forces at the end of the step before (segment, part) [N].
    push : np.ndarray
        Contacts of the last step (segment, part, column); depth ≤ 0: none.
    base : np.ndarray
        x, y [mm] and heading [rad].
    drive : np.ndarray
        Their rates (3,).
    objects : np.ndarray
        (object, column)
    faces : np.ndarray
        (face, column) in the world.
    wrench : np.ndarray
        Force [N] and moment [N·mm] of the base on the antenna (3,).
    work : np.ndarray
        Work done on the antenna by its base and by each object (1 + object,) [mJ].
    sink : np.ndarray
        How deep nodes have sunk in at most (1,), over the smaller radius.
    """

    heading: np.ndarray
    points: np.ndarray
    velocity: np.ndarray
    rate: np.ndarray
    anchor: np.ndarray
    pressed: np.ndarray
    push: np.ndarray
    base: np.ndarray
    drive: np.ndarray
    objects: np.ndarray
    faces: np.ndarray
    wrench: np.ndarray
    work: np.ndarray
    sink: np.ndarray


def _make_rod_model(scene: Scene, firmness: float) -> _RodModel:
    """The scene's constants.

    Raises
    ------
    InvalidInput
        Hinges with neither stiffness nor damping, or a shape with corners that would slip in
        between two hinges.
    """
    antenna = scene.antenna
    if np.any(antenna.stiffness + antenna.damping <= 0):
        raise InvalidInput(
            "the rod engine needs stiffness or damping > 0 in every hinge; use"
            " engine='chain-consistent'."
        )
    faces, parts, first = [], [], 0
    for o, item in enumerate(scene.objects):
        for rim in _list_rims(item.feature):
            _check_corners(antenna, item, rim)
            endless = np.inf if item.feature.unbounded else rim[:, f.F_LENGTH].sum()
            parts.append(
                [
                    first,
                    first + len(rim),
                    o,
                    item.friction,
                    item.feature.rounding,
                    endless,
                    _find_radius(item),
                ]
            )
            faces.append(rim)
            first += len(rim)
    return _RodModel(
        table=_make_table(antenna, firmness),
        faces=np.concatenate([np.empty((0, f.N_FACE)), *faces]),
        parts=np.array(parts, dtype=float).reshape(-1, f.N_PART),
        gravity=np.array(scene.gravity, dtype=float),
    )


def _make_table(antenna: Antenna, firmness: float) -> np.ndarray:
    """A node touches with the thicker of its two capsules; it has the inertia of its own segment
    and half the weight of both."""
    mass = antenna.segment_mass
    columns = (
        antenna.segment_length,
        antenna.stiffness,
        antenna.damping,
        antenna.rest_angle,
        np.maximum(antenna.radius, np.append(antenna.radius[1:], 0.0)),
        mass,
        0.5 * (mass + np.append(mass[1:], 0.0)),
        firmness * np.maximum(antenna.stiffness, 1e-6 * antenna.stiffness.max()),
    )
    return np.ascontiguousarray(np.stack(columns, axis=1))


def _list_rims(feature: Feature) -> list[np.ndarray]:
    """The faces (face, column) of every part; a point is a face of no length."""
    if feature.unbounded:
        return [np.array([[0.0, _FAR, 1.0, 0.0, 2 * _FAR, 0.0, 0.0]])]
    return [_make_rim(part) for part in feature.parts]


def _make_rim(part: np.ndarray) -> np.ndarray:
    corners = part[::-1]  # clockwise, so that the free side is on the left of the way round
    along = np.roll(corners, -1, axis=0) - corners
    length = np.hypot(along[:, 0], along[:, 1])
    unit = along / length[:, None] if len(part) > 1 else np.array([[0.0, -1.0]])
    before = np.roll(unit, 1, axis=0)
    turn = np.abs(
        np.arctan2(
            before[:, 0] * unit[:, 1] - before[:, 1] * unit[:, 0], (before * unit).sum(axis=1)
        )
    )
    start = np.cumsum(length) - length
    return np.column_stack(
        [corners, -unit[:, 1], unit[:, 0], length, start, np.cumsum(turn) - turn[0]]
    )


def _check_corners(antenna: Antenna, item: Object, rim: np.ndarray) -> None:
    """Refuse a corner that would reach the antenna's axis between two nodes, which are all that
    feels.

    Two nodes at distance 2 a astride a corner of turn τ, on the outline that the radius r and the
    rounding shift outwards by ρ: the axis between them comes nearer by ρ − √(ρ² − a²), or, where
    they stand beyond the corner's arc, by ρ (1 − cos τ/2) + (a − ρ sin τ/2) tan τ/2. It must not
    exceed r.
    """
    needed = _measure_slip(antenna, item, rim)
    if needed is not None:
        raise InvalidInput(
            "the rod engine feels at the hinges and the tip only, up to"
            f" {antenna.segment_length.max():.3g} mm apart, and the corners of {item.name!r} are"
            f" sharp enough to slip in between. Give it a rounding ≥ {needed:.3g} mm, the antenna"
            " shorter segments, or use engine='chain-consistent'."
        )


def find_slips(antenna: Antenna, objects: Sequence[Object]) -> bool:
    """Whether a corner of these objects could slip in between two hinges, so that the rod refuses
    them.
    """
    return any(
        _measure_slip(antenna, item, rim) is not None
        for item in objects
        for rim in _list_rims(item.feature)
    )


def _measure_slip(antenna: Antenna, item: Object, rim: np.ndarray) -> float | None:
    """The least rounding [mm] of a rim whose corners could slip in; None where none can."""
    if item.feature.unbounded:
        return None
    half, radius = antenna.segment_length / 2, antenna.radius
    reach = radius + item.feature.rounding
    turn = np.append(rim[1:, f.F_TURN], 2 * np.pi) - rim[:, f.F_TURN]
    bow = min(turn.max(), np.pi) / 2
    beyond = reach * (1 - np.cos(bow)) + (half - reach * np.sin(bow)) * np.tan(bow)
    arc = reach - np.sqrt(np.maximum(reach**2 - half**2, 0.0))
    sag = np.where(half <= reach * np.sin(bow), arc, beyond)
    if not np.any(sag > radius):
        return None
    return float(np.max((half**2 - radius**2) / (2 * radius)))


def _make_rod_lane(scene: Scene, model: _RodModel) -> _RodLane:
    """The scene's first state; nodes move with the base and turn with their hinges."""
    n, n_parts = scene.antenna.n_segments, len(model.parts)
    objects = [[*o.place, *o.forward, *o.velocity, o.turn] for o in scene.objects]
    drive, rate = np.array(scene.base_velocity), np.array(scene.initial_velocity)
    heading = scene.base_pose[2] + np.cumsum(scene.initial_angle)
    swing = ((drive[2] + np.cumsum(rate)) * scene.antenna.segment_length)[:, None]
    across = np.stack([np.cos(heading), -np.sin(heading)], axis=1)
    return _RodLane(
        heading=heading,
        points=np.zeros((n + 1, 2)),
        velocity=drive[:2] + np.cumsum(swing * across, axis=0),
        rate=rate,
        anchor=np.full((n, n_parts), np.nan),
        pressed=np.zeros((n, n_parts)),
        push=np.zeros((n, n_parts, f.N_CONTACT)),
        base=scene.base_pose,
        drive=drive,
        objects=np.array(objects, dtype=float).reshape(-1, f.N_OBJECT),
        faces=model.faces.copy(),
        wrench=np.zeros(3),
        work=np.zeros(1 + len(objects)),
        sink=np.zeros(1),
    )


# The rod, stepped: one scene.

_MAX_STEPS = 400  # of one relaxation
_BALANCED = 1e-6  # rad; greatest out-of-balance torque over hinge stiffness at rest


class Rest(NamedTuple):
    """How a relaxation ended.

    Attributes
    ----------
    imbalance : float
        Greatest out-of-balance torque over the hinge's stiffness [rad]; infinite where it got
        stuck.
    n_contacts : int
        Touching nodes.
    """

    imbalance: float
    n_contacts: int

    @property
    def balanced(self) -> bool:
        """Whether it is an equilibrium."""
        return self.imbalance < 10 * _BALANCED


class RodStepper(Stepper):
    """One scene as a rod of implicit steps, without inertia (it follows its own damping) or with
    mass at its nodes.
    """

    advice = "Use a smaller timestep, a slower feature, or a hinge damping that is not zero"

    def __init__(
        self, scenes: Sequence[Scene], timestep: float, *, inertia: bool = False
    ) -> None:
        self.timestep, self.inertia, self.scenes = float(timestep), inertia, list(scenes)
        if len(self.scenes) != 1:
            raise InvalidInput(
                f"the rod engine steps one scene at a time, got {len(self.scenes)}."
            )
        self.reset(0, self.scenes[0])
        with _announce_compiling("rod"):
            march(self.model, self.lane, 0, self.timestep, self.drive, self.inertia)

    def reset(self, lane: int, scene: Scene) -> None:
        require_plane(scene.antenna, "the rod engine")
        if scene.initial_velocity.any() and not self.inertia:
            raise InvalidInput(
                "engine 'rod' has no inertia, so that velocity= means nothing to it; leave it out,"
                " or use engine='rod-inertia'."
            )
        self.model = _make_rod_model(scene, SOFT if self.inertia else FIRMNESS)
        self.lane, self.scenes[0], self.lost = _make_rod_lane(scene, self.model), scene, False
        self.drive = np.array([scene.base_velocity])
        place_nodes(self.model.table, self.lane.base, self.lane.heading, self.lane.points)

    def step(self, n_steps: int, drives: Mapping[int, np.ndarray] | None = None) -> bool:
        """Take steps; ``drives`` (step, 3) replace the commanded base velocity. A lost antenna
        stays where it was.
        """
        drive = np.ascontiguousarray(drives[0], dtype=float) if drives else self.drive
        if n_steps and not self.lost:
            self.lost = not march(
                self.model, self.lane, n_steps, self.timestep, drive, self.inertia
            )
            self.drive = drive[-1:].copy()
        return self.lost

    def settle(
        self,
        base: Sequence[float] | None = None,
        place: Sequence[Sequence[float]] | None = None,
    ) -> Rest:
        """Relax to the equilibrium nearest along the antenna's own damping, and stand still there.

        Parameters
        ----------
        base
            Place [mm] and heading [rad] (3,) to which the base is put first; the antenna turns
            along. Default: as it is.
        place
            Places (object, 2) [mm] to which the objects are put first. Default: as they are.
        """
        before = float(self.lane.base[2])
        if base is not None:
            self.lane.base[:] = base
        if place is not None:
            self.lane.objects[:, [f.O_X, f.O_Y]] = place
        self.lane.velocity[:] = 0.0
        rest = Rest(*relax(self.model, self.lane, before, _BALANCED, _MAX_STEPS))
        self.lane.rate[:], self.lost = 0.0, False
        return rest

    def read(self) -> State:
        t, contacts = self.lane, self.read_contacts(0)
        force = np.zeros((len(t.objects), 2))
        np.add.at(force, contacts.object, contacts.force)
        normal = np.sum(contacts.force * contacts.normal, axis=1)
        return State(
            angle=np.diff(t.heading, prepend=t.base[2])[None],
            velocity=t.rate[None].copy(),
            force=force[None],
            place=t.objects[None, :, [f.O_X, f.O_Y]],
            forward=t.objects[None, :, [f.O_FORWARD_X, f.O_FORWARD_Y]],
            object_work=t.work[None, 1:].copy(),
            base=t.base[None].copy(),
            base_force=t.wrench[None, :2].copy(),
            base_moment=t.wrench[2:].copy(),
            base_work=t.work[:1].copy(),
            contact_place=np.array(
                [normal @ contacts.place / normal.sum() if len(contacts) else np.nan]
            ),
            sink=t.sink.copy(),
        )

    def read_sink(self) -> np.ndarray:
        return self.lane.sink

    def read_contacts(self, lane: int) -> Contacts:
        """The contacts of the last step: nodes that touch."""
        node, part = np.nonzero(self.lane.push[:, :, f.C_DEPTH] > 0)
        found, antenna = self.lane.push[node, part], self.scenes[0].antenna
        normal = found[:, [f.C_NX, f.C_NY]]
        near = self.model.table[node, f.R_RADIUS] - found[:, f.C_DEPTH] / 2
        return Contacts(
            object=self.model.parts[part, f.P_OBJECT].astype(int),
            segment=node + 1,
            place=np.cumsum(antenna.segment_length)[node] / antenna.length,
            point=self.lane.points[node + 1] - near[:, None] * normal,
            normal=normal,
            distance=-found[:, f.C_DEPTH],
            force=found[:, [f.C_FX, f.C_FY]],
        )

    def find_broken(self) -> np.ndarray:
        return np.array([self.lost or not np.isfinite(self.lane.heading).all()])

    def move_base(self, lane: int, velocity: tuple[float, float], turn: float) -> None:
        self.drive = np.array([[*velocity, turn]])

    def move_object(
        self, lane: int, o: int, velocity: tuple[float, float], turn: float
    ) -> None:
        self.lane.objects[o, f.O_VX : f.O_TURN + 1] = *velocity, turn

    def read_rates(self, lane: int) -> tuple[np.ndarray, np.ndarray]:
        return self.drive[0].copy(), self.lane.objects[:, f.O_VX : f.O_TURN + 1].copy()

    def save(self, lane: int) -> tuple[_RodLane, np.ndarray, bool]:
        return _RodLane(*(array.copy() for array in self.lane)), self.drive.copy(), self.lost

    def load(self, lane: int, saved: tuple[_RodLane, np.ndarray, bool]) -> None:
        """Go back to where it was saved."""
        self.lane, self.drive, self.lost = (
            _RodLane(*(array.copy() for array in saved[0])),
            saved[1].copy(),
            saved[2],
        )


# The rod as an engine: without inertia, or with.

# [C] radii per step: a face without end is never passed through; other shapes should be as thick
_STRIDE = 10.0


def _check(contact: Contact, timestep: float) -> None:
    """Implicit steps are of any length; surfaces are rigid whatever is asked for."""
    default = get_contact()
    if replace(contact, solref=(default.solref[0], contact.solref[1])) != default:
        raise InvalidInput(
            "the rod engines stand for rigid surfaces: they read neither solref nor solimp. Leave"
            " contact= out, or use engine='chain-consistent'."
        )


ROD = Engine(make=RodStepper, timestep=1.0, check=_check, stride=_STRIDE)
ROD_INERTIA = Engine(
    make=partial(RodStepper, inertia=True), timestep=1.0, check=_check, stride=_STRIDE
)
