"""A simulation in the hand: step it, steer it, look at it, save it, go back."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from feeler.antenna.antenna import Antenna
from feeler.errors import InvalidInput
from feeler.physics.contact import Contact, get_contact
from feeler.physics.engine import DEFAULT_ENGINE
from feeler.physics.lanes import Simulations, Turn
from feeler.physics.scene import Scene
from feeler.physics.snapshot import Snapshot
from feeler.physics.stepper import MICRO, Contacts
from feeler.records.checked import checked
from feeler.records.shown import make_picture
from feeler.stimulus.base import BaseMotion, Vector, check_vector, read_base
from feeler.stimulus.convex import trace_rim
from feeler.stimulus.flow import Flow
from feeler.stimulus.object import Object, check_clear, make_objects
from feeler.stimulus.trial import Trial


@dataclass(frozen=True, kw_only=True, eq=False)
class Work:
    """Work done on the antenna since time 0 [µJ].

    Attributes
    ----------
    objects : np.ndarray
        (object,)
    """

    base: float
    objects: np.ndarray

    @property
    def total(self) -> float:
        """By base and objects together."""
        return self.base + float(self.objects.sum())


def build_scene(
    antenna: Antenna,
    objects: Object | Trial | Sequence[Object | Trial] = (),
    *,
    contact: Contact | str | None = None,
    gravity: Vector = (0.0, 0.0),
    base: BaseMotion | None = None,
    flow: Flow | None = None,
    angle: np.ndarray | None = None,
    velocity: np.ndarray | None = None,
    label: str = "",
) -> Scene:
    """The scene of an antenna and objects; a Trial stands for the object that it places, and for
    its base motion.

    Raises
    ------
    InvalidInput
        Two objects with one name, an object that starts inside the antenna, two base motions, or
        hinge angles or velocities that are not finite (segment,).
    """
    if not isinstance(antenna, Antenna):
        raise InvalidInput(f"antenna must be an Antenna, got {type(antenna).__name__}.")
    given = [objects] if isinstance(objects, Object | Trial) else list(objects)
    moved = [
        item.base_motion
        for item in given
        if isinstance(item, Trial) and item.base_motion is not None
    ]
    if base is not None and moved:
        raise InvalidInput("base= and a trial both move the base; give one of them.")
    start = _check_hinges(antenna, angle, "angle")
    found = make_objects(antenna, given)
    scene = Scene(
        antenna=antenna,
        objects=found,
        contact=get_contact(contact, antenna),
        gravity=check_vector(gravity, "gravity", (2, 3)),
        base_motion=moved[0] if moved else read_base(base),
        flow=None if flow is None else Flow.from_plain(flow),
        angle=start,
        velocity=_check_hinges(antenna, velocity, "velocity"),
        label=label or ", ".join(o.name for o in found) or antenna.name,
    )
    check_clear(antenna, found, scene.initial_angle, scene.base_pose)
    return scene


def _check_hinges(antenna: Antenna, values: np.ndarray | None, name: str) -> np.ndarray | None:
    if values is None:
        return None
    array = np.array(values, dtype=float)
    if array.shape != antenna.rest_angle.shape or not np.isfinite(array).all():
        rows = (
            f" in each of {len(antenna.planes)} rows, one per plane" if antenna.spatial else ""
        )
        raise InvalidInput(
            f"{name} must be {antenna.n_segments} finite numbers, one per segment{rows}, got"
            f" {array.shape}."
        )
    return array


@checked
class Simulation:
    """One antenna and its objects, stepped by hand.

    Of an antenna in space angles and rates are (plane, segment), places, forces and moments have
    three numbers, ``base`` is its place and rotation vector (6,), and turns are angular velocities.

    Threads may share it: while one steps, steers or reads, the others wait. Pickled or deep-copied
    at any moment it goes on from there, independently.

    Parameters
    ----------
    antenna
        What touches and is touched.
    objects
        An Object or several, or Trials that place them.
    engine
        ``chain-consistent`` (default), ``chain``, ``mujoco`` or another of
        ``feeler.physics.engine.ENGINES``.
    timestep
        Integration step [ms]; default: the engine's own.
    contact
        Softness of contact, or its name in ``feeler.physics.contact.CONTACTS``.
    gravity
        (x, y) [mm/ms²].
    base
        How the base moves from time 0 on; steer it later by :meth:`move_base`.
    flow
        What drags an antenna in space along: a :class:`feeler.stimulus.flow.Flow`.
    angle, velocity
        Hinge angles [rad] and rates [rad/ms] at time 0 (segment,); default: at rest.

    Raises
    ------
    InvalidInput
        What cannot be simulated as given; the message says what to do.

    Examples
    --------
    >>> import feeler
    >>> antenna = feeler.presets.cockroach()
    >>> ball = feeler.Object(feature=feeler.Ball(radius=1.5), place=(-2.0, 25.0), velocity=(0.3,
    0.0))
    >>> simulation = feeler.Simulation(antenna, ball)
    >>> while simulation.time < 20 and not len(simulation.contacts):
    ...     simulation.step(1.0)
    >>> simulation.move_object("ball", velocity=(0.0, 0.0))
    """

    def __init__(
        self,
        antenna: Antenna,
        objects: Object | Trial | Sequence[Object | Trial] = (),
        *,
        engine: str = DEFAULT_ENGINE,
        timestep: float | None = None,
        contact: Contact | str | None = None,
        gravity: Vector = (0.0, 0.0),
        base: BaseMotion | None = None,
        flow: Flow | None = None,
        angle: np.ndarray | None = None,
        velocity: np.ndarray | None = None,
    ) -> None:
        scene = build_scene(
            antenna,
            objects,
            contact=contact,
            gravity=gravity,
            base=base,
            flow=flow,
            angle=angle,
            velocity=velocity,
        )
        self._lanes = Simulations([scene], engine=engine, timestep=timestep)
        self._features = tuple(item.feature for item in scene.objects)
        self.antenna, self.names, self.engine = (
            antenna,
            tuple(o.name for o in scene.objects),
            engine,
        )

    def __repr__(self) -> str:
        names = ", ".join(self.names) or "nothing"
        return (
            f"Simulation of {self.antenna.name!r} and {names} by {self.engine} at {self.time:g} ms,"
            f" {len(self.contacts)} contacts"
        )

    def _repr_html_(self) -> str:
        """The antenna as it stands, and its objects."""
        rims = []
        flat = self.place[:, :2], self.forward[:, :2]  # a touch in space is seen from above
        turns = zip(self._features, *flat, strict=True)
        for feature, place, forward in turns:
            frame = np.stack([forward, [-forward[1], forward[0]]])
            rims += [
                trace_rim(part, feature.rounding).clip(-100, 100) @ frame + place
                for part in feature.parts
            ]
        return make_picture(
            repr(self), [(self.shape()[:, :2], 2 * float(self.antenna.radius.mean()))], rims
        )

    def step(self, ms: float) -> None:
        """Go on by ``ms`` [ms], a whole number of timesteps.

        Raises
        ------
        SimulationDiverged
            Its numbers left the finite ones, now or before; restore a snapshot or reset.
        InvalidInput
            No whole number of timesteps, or a recorded base path that ends before; nothing has
            moved then.
        """
        if self._lanes.failed[0] is None:
            self._lanes.step(ms)
        if self._lanes.failed[0] is not None:
            raise self._lanes.failed[0]

    def cancel(self) -> None:
        """End a running :meth:`step` from another thread; it raises KeyboardInterrupt there."""
        self._lanes.cancel()

    @property
    def timestep(self) -> float:
        """[ms]"""
        return self._lanes.timestep

    @property
    def time(self) -> float:
        """[ms]"""
        return float(self._lanes.time[0])

    @property
    def angle(self) -> np.ndarray:
        """Hinge angles (segment,) [rad]."""
        return self._lanes.state.angle[0]

    @property
    def velocity(self) -> np.ndarray:
        """Rates of the hinges (segment,) [rad/ms]."""
        return self._lanes.state.velocity[0]

    @property
    def tip(self) -> np.ndarray:
        """Place of the tip (2,) [mm] in the world."""
        return self.shape()[-1]

    def shape(self) -> np.ndarray:
        """Base, hinges and tip (segment + 1, 2) [mm] in the world."""
        return self._lanes.shape[0]

    @property
    def base(self) -> np.ndarray:
        """x, y [mm] and heading [rad] of the base (3,)."""
        return self._lanes.state.base[0]

    @property
    def place(self) -> np.ndarray:
        """Where each object's ``place`` is, its foremost point (object, 2) [mm]."""
        return self._lanes.state.place[0]

    @property
    def forward(self) -> np.ndarray:
        """First axis of each object's frame (object, 2)."""
        return self._lanes.state.forward[0]

    @property
    def force(self) -> np.ndarray:
        """Contact force of each object on the antenna (object, 2) [N] in the last step."""
        return self._lanes.state.force[0]

    @property
    def contacts(self) -> Contacts:
        """Every contact of the last step: place along the antenna, point, normal, force."""
        return self._lanes.read_contacts(0)

    @property
    def base_force(self) -> np.ndarray:
        """Force of the base on the antenna (2,) [N] in the last step."""
        return self._lanes.state.base_force[0]

    @property
    def base_moment(self) -> float | np.ndarray:
        """Moment of the base on the antenna [N·mm] in the last step, positive as angles are; in
        space a vector (3,), positive about the axes of the world.
        """
        found = self._lanes.state.base_moment[0]
        return found if self.antenna.spatial else float(found)

    @property
    def work(self) -> Work:
        """Work done on the antenna by its base and by each object since time 0 [µJ]."""
        state = self._lanes.state
        return Work(
            base=MICRO * float(state.base_work[0]), objects=MICRO * state.object_work[0]
        )

    def move_base(self, velocity: Vector = (0.0, 0.0), turn: Turn = 0.0) -> None:
        """From the next step on the base moves with ``velocity`` (x, y) [mm/ms] and turns with
        ``turn`` [rad/ms].

        The change takes one timestep, in which the antenna feels the acceleration; a recorded path
        is left for good.
        """
        self._lanes.move_base(0, velocity, turn)

    def move_object(
        self, which: int | str, velocity: Vector = (0.0, 0.0), turn: Turn = 0.0
    ) -> None:
        """From the next step on an object, by number or name, moves and turns like this [mm/ms,
        rad/ms].
        """
        if isinstance(which, str):
            if which not in self.names:
                raise InvalidInput(
                    f"there is no object {which!r}; valid: {', '.join(self.names) or 'none'}."
                )
            which = self.names.index(which)
        self._lanes.move_object(0, which, velocity, turn)

    def snapshot(self) -> Snapshot:
        """This moment, for :meth:`restore`."""
        return self._lanes.snapshot()

    def restore(self, snapshot: Snapshot) -> None:
        """Go back to a moment of this simulation, or of another one made alike, to the last bit.

        Raises
        ------
        InvalidInput
            A snapshot of another antenna, other objects, gravity, contact, base, flow, timestep or
            engine; the message says what differs, and nothing has changed.
        """
        self._lanes.restore(snapshot)
