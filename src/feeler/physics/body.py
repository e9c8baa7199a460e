"""A rigid body that carries several antennas among objects, which it can push."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from feeler.antenna.segments import Antenna, to_matrix, to_vector
from feeler.errors import InvalidInput
from feeler.objects.bodies import Object, check_clear
from feeler.objects.motion import Vector, check_number, check_vector, lift, lift_turn
from feeler.physics.contact import get_contact
from feeler.physics.engine import DEFAULT_ENGINE, Contacts, choose_timestep
from feeler.physics.scene import Scene
from feeler.physics.simulation import Simulations, Turn, read_rate_in_space, warn_of_misses
from feeler.validation import checked

# Everything is computed in space. A heading h in the plane, positive from +y towards +x, is the
# rotation vector (0, 0, −h), and a moment in the plane is one about −z.


@checked
class Body:
    """Several antennas on one rigid body against the same objects, stepped by hand.

    The body moves as it is told (:meth:`set_velocity`); what the antennas do to it is in
    ``force`` and ``moment``, so that a controller or a robot's own dynamics can close the loop.
    Objects move as they are told, or, with a mass, by what pushes them. Antennas do not touch each
    other. All antennas lie in one plane, or all are in space; vectors have two numbers or three.

    Parameters
    ----------
    antennas
        By name.
    mounts
        By name, where on the body each stands: x, y [mm] and heading [rad] in the body's frame, in
        space x, y, z and a rotation vector. An antenna of heading 0 points along the body's +y.
    objects
        What all antennas may touch, in the world.
    masses
        By the object's name, its mass [g]: the object is pushed by the antennas and by
        ``step(forces=…)``. It should be heavier than the part of the antenna that moves with it.
    pose
        Of the body at time 0, in the world, given as a mount is.
    contact, gravity, engine, timestep
        As for :class:`feeler.Simulation`; gravity acts on the antennas.

    Raises
    ------
    InvalidInput
        Names that do not fit each other, antennas of different dimensions, or an object that
        starts inside an antenna.

    Notes
    -----
    Velocity of a mount at r from the body's origin: v + ω × r. An object of mass m follows
    m dv/dt = F − Σ f, F the force that is given and f its contact forces on the antennas [N], by
    explicit steps of one timestep; it does not turn by what pushes it.

    Examples
    --------
    >>> import feeler
    >>> antenna = feeler.presets.robot()
    >>> body = feeler.Body(
    ...     {"left": antenna, "right": antenna},
    ...     {"left": (-10.0, 0.0, -0.5), "right": (10.0, 0.0, 0.5)},
    ...     feeler.Object(feature=feeler.Ball(radius=3.0), place=(40.0, 60.0)),
    ... )
    >>> body.set_velocity((0.1, 0.0))
    >>> body.step(5.0)
    """

    def __init__(
        self,
        antennas: Mapping[str, Antenna],
        mounts: Mapping[str, Sequence[float]],
        objects: Object | Sequence[Object] = (),
        *,
        masses: Mapping[str, float] | None = None,
        pose: Sequence[float] | None = None,
        contact: Any = None,
        gravity: Vector = (0.0, 0.0),
        engine: str = DEFAULT_ENGINE,
        timestep: float | None = None,
    ) -> None:
        objects = (objects,) if isinstance(objects, Object) else tuple(objects)
        self.antennas = dict(antennas)
        if not antennas or {*antennas} != {*mounts}:
            raise InvalidInput(
                "antennas and mounts are given by the same names, at least one; got"
                f" {', '.join(antennas) or 'none'} and {', '.join(mounts) or 'none'}."
            )
        spatial = {antenna.spatial for antenna in antennas.values()}
        if len(spatial) != 1:
            raise InvalidInput(
                "some antennas lie in the plane and others are in space; antenna.unflatten() puts"
                " one into space."
            )
        self.dims = 3 if spatial.pop() else 2
        self._mounts = {name: self._read_pose(mount, name) for name, mount in mounts.items()}
        self._start = self._read_pose(pose or (0.0,) * (3 if self.dims == 2 else 6), "pose")
        self._place, self._axes = self._start
        contacts = [get_contact(contact, antenna) for antenna in antennas.values()]
        step = choose_timestep(timestep, engine, *contacts)
        scenes = {}
        for (name, antenna), softness in zip(antennas.items(), contacts, strict=True):
            base = self._place_base(name, *self._start)
            called = antenna.replace(name=name)  # errors name the mount
            scene = Scene(
                antenna=called, objects=objects, contact=softness, gravity=gravity, base=base
            )
            check_clear(scene.antenna, objects, scene.initial_angle, scene.base_pose)
            warn_of_misses(scene)
            scenes[name] = scene
        kinds: dict[tuple[int, ...], list[str]] = {}
        for name, antenna in antennas.items():
            kinds.setdefault(antenna.rest_angle.shape, []).append(name)
        self._groups = [
            Simulations([scenes[name] for name in group], engine=engine, timestep=step)
            for group in kinds.values()
        ]
        lanes = zip(self._groups, kinds.values(), strict=True)
        self._lanes = {name: (sims, k) for sims, own in lanes for k, name in enumerate(own)}
        self.timestep = self._groups[0].timestep
        self._velocity, self._spin = np.zeros(3), np.zeros(3)
        self.masses: dict[str, float] = {}
        for name, mass in (masses or {}).items():
            self._set_mass(name, mass)
        self._began = dict(self.masses)

    def __repr__(self) -> str:
        return (
            f"Body with {', '.join(self.antennas)} and {', '.join(self.names) or 'no objects'} at"
            f" {self.time:g} ms"
        )

    def _read_pose(self, pose: Sequence[float], name: str) -> tuple[np.ndarray, np.ndarray]:
        """Place (3,) and rotation (3, 3)."""
        values = check_vector(pose, name, (3 if self.dims == 2 else 6,))
        if self.dims == 2:
            x, y, heading = values
            values = (x, y, 0.0, 0.0, 0.0, -heading)
        return np.array(values[:3]), to_matrix(values[3:])

    def _place_base(self, name: str, place: np.ndarray, axes: np.ndarray) -> tuple[float, ...]:
        """Where the base of an antenna is with the body there, as scenes have it."""
        mount, turned = self._mounts[name]
        return self._flatten(place + axes @ mount, axes @ turned)

    def _flatten(self, place: np.ndarray, axes: np.ndarray) -> tuple[float, ...]:
        if self.dims == 3:
            return (*place.tolist(), *to_vector(axes).tolist())
        return (*place[:2].tolist(), float(np.arctan2(axes[0, 1], axes[0, 0])))

    def _find(self, name: str) -> tuple[Simulations, int]:
        if name not in self._lanes:
            raise InvalidInput(
                f"there is no antenna {name!r}; valid: {', '.join(self.antennas)}."
            )
        return self._lanes[name]

    def _set_mass(self, name: str, mass: float) -> None:
        if check_number(mass, f"masses[{name!r}]") <= 0:
            raise InvalidInput(f"masses[{name!r}] must be > 0 g, got {mass:g}.")
        if name not in self.names:
            raise InvalidInput(
                f"there is no object {name!r} to have a mass; valid:"
                f" {', '.join(self.names) or 'none'}."
            )
        self.masses[name] = mass

    @property
    def names(self) -> tuple[str, ...]:
        """The objects' names, in the order of ``place``."""
        return tuple(item.name for item in self._groups[0].get_scene(0).objects)

    @property
    def time(self) -> float:
        """[ms]"""
        return float(self._groups[0].time[0])

    @property
    def pose(self) -> np.ndarray:
        """x, y [mm] and heading [rad] of the body (3,); in space place and rotation vector (6,)."""
        return np.array(self._flatten(self._place, self._axes))

    @property
    def place(self) -> np.ndarray:
        """Where each object's ``place`` is in the world (object, 2) [mm]."""
        return self._groups[0].place[0].copy()

    def angle(self, name: str) -> np.ndarray:
        """Hinge angles (segment,) [rad] of one antenna."""
        group, lane = self._find(name)
        return group.angle[lane].copy()

    def shape(self, name: str) -> np.ndarray:
        """Base, hinges and tip (segment + 1, 2) [mm] of one antenna in the world."""
        group, lane = self._find(name)
        return group.shape[lane]

    def contacts(self, name: str) -> Contacts:
        """The contacts of one antenna in the last step, in the world."""
        group, lane = self._find(name)
        return group.read_contacts(lane)

    def _compute_reaction(self, name: str) -> tuple[np.ndarray, np.ndarray]:
        """Force and moment about the body's origin (3,) of an antenna on the body, in its frame."""
        group, lane = self._find(name)
        force = -self._axes.T @ lift(group.base_force[lane])
        moment = group.base_moment[lane]
        own = -self._axes.T @ (lift_turn(float(moment)) if self.dims == 2 else moment)
        return force, own + np.cross(self._mounts[name][0], force)

    @property
    def forces(self) -> dict[str, np.ndarray]:
        """By antenna, its force on the body (2,) [N] in the last step, in the body's frame."""
        return {name: self._compute_reaction(name)[0][: self.dims] for name in self.antennas}

    @property
    def moments(self) -> dict[str, Any]:
        """By antenna, its moment on the body about the body's origin [N·mm] in the last step, in
        the body's frame; positive as angles are, in space a vector (3,).
        """
        found = {name: self._compute_reaction(name)[1] for name in self.antennas}
        return (
            found if self.dims == 3 else {k: -float(moment[2]) for k, moment in found.items()}
        )

    @property
    def force(self) -> np.ndarray:
        """Force of all antennas on the body (2,) [N], in its frame."""
        return np.sum([*self.forces.values()], axis=0)

    @property
    def moment(self) -> Any:
        """Moment of all antennas on the body about its origin [N·mm], in its frame."""
        return sum(self.moments.values())

    def set_velocity(
        self, velocity: Vector = (0.0, 0.0), turn: Turn = 0.0, *, of: str = "body"
    ) -> None:
        """From the next step on the body, or the object ``of`` this name, moves with ``velocity``
        [mm/ms] and turns with ``turn`` [rad/ms] about its origin, both in the world's axes.
        """
        if of == "body":
            self._velocity, self._spin = map(np.array, read_rate_in_space(velocity, turn))
            return
        for group, lane in self._lanes.values():
            group.set_velocity(lane, of, velocity, turn)

    def step(self, ms: float, forces: Mapping[str, Vector] | None = None) -> None:
        """Go on by ``ms`` [ms], a whole number of timesteps.

        Parameters
        ----------
        forces
            By name of objects that have a mass, the force on each [N] during this step, in the
            world.

        Raises
        ------
        SimulationDivergedError
            Numbers left the finite ones, now or before.
        InvalidInput
            No whole number of timesteps, or a force on an object without a mass.
        """
        pushed = {name: np.zeros(self.dims) for name in self.masses}
        for name, force in (forces or {}).items():
            if name not in self.masses:
                raise InvalidInput(
                    f"object {name!r} has no mass, so that no force moves it; masses= gave one to:"
                    f" {', '.join(self.masses) or 'none'}."
                )
            pushed[name] = np.array(check_vector(force, f"forces[{name!r}]", (self.dims,)))
        n_steps = self._groups[0]._count_steps(ms)
        whole = 1 if self.masses or self._spin.any() else n_steps
        for _ in range(0, n_steps, whole):
            self._command(whole * self.timestep)
            self._push(pushed)
            for group in self._groups:
                group.step(whole * self.timestep)
                for error in group.failed:
                    if error is not None:
                        raise error

    def _command(self, ms: float) -> None:
        """Let the bases be where the body carries them in ``ms``."""
        place = self._place + ms * self._velocity
        axes = to_matrix(ms * self._spin) @ self._axes if self._spin.any() else self._axes
        turn: Any = self._spin if self.dims == 3 else -float(self._spin[2])
        for name, (group, lane) in self._lanes.items():
            arm = self._mounts[name][0]
            way = place + axes @ arm - self._place - self._axes @ arm
            rate = tuple((way / ms)[: self.dims].tolist())
            group.move_base(lane, rate, turn if self.dims == 2 else tuple(turn.tolist()))
        self._place, self._axes = place, axes

    def _push(self, pushed: Mapping[str, np.ndarray]) -> None:
        """Give objects of a mass the velocity that the forces on them make in a timestep."""
        for name, given in pushed.items():
            o = self.names.index(name)
            back = sum(group.force[lane, o] for group, lane in self._lanes.values())
            change = self.timestep * (given - back) / self.masses[name]
            for group, lane in self._lanes.values():
                stepper, k = group._find(lane)
                rate = stepper.read_rates(k)[1][o]
                turn = rate[2] if self.dims == 2 else tuple(rate[3:].tolist())
                velocity = tuple((rate[: self.dims] + change).tolist())
                group.move_object(lane, o, velocity, turn)

    @property
    def objects(self) -> tuple[Object, ...]:
        """The objects as they stand and move now."""
        return self._groups[0].list_objects(0)

    def _set_objects(self, objects: Sequence[Object]) -> None:
        for group, lane in self._lanes.values():  # all are asked before any is changed
            base, scene = group.base[lane], group.get_scene(lane)
            new = [item for item in objects if item not in group.list_objects(lane)]
            check_clear(scene.antenna, new, group.angle[lane], base)
        for group, lane in self._lanes.values():
            group.set_objects(lane, objects)

    def add_object(self, item: Object, mass: float | None = None) -> None:
        """Put one more object into the world, clear of all antennas."""
        self._set_objects([*self.objects, item])
        if mass is not None:
            self._set_mass(item.name, mass)

    def remove_object(self, name: str) -> None:
        """Take an object out of the world."""
        o = self._groups[0]._find_object(0, name)
        self._set_objects(self.objects[:o] + self.objects[o + 1 :])
        self.masses.pop(name, None)

    def place_object(self, name: str, place: Vector, forward: Vector | None = None) -> None:
        """Put an object elsewhere, clear of all antennas; it keeps its velocity."""
        o, objects = self._groups[0]._find_object(0, name), [*self.objects]
        objects[o] = objects[o].replace(place=place, forward=forward or objects[o].forward)
        self._set_objects(objects)

    def reset(self) -> None:
        """Begin again, as it was made."""
        for group, lane in self._lanes.values():
            group.reset(lane)
        (self._place, self._axes), self.masses = self._start, dict(self._began)
        self._velocity, self._spin = np.zeros(3), np.zeros(3)
