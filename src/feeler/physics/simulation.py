"""Simulations that are stepped, steered, saved and restored: one, or many side by side."""

import warnings
from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import wait
from dataclasses import dataclass, fields, replace
from functools import wraps
from threading import Event, RLock
from typing import Any
from weakref import finalize

import numpy as np

from feeler.antenna.segments import Antenna
from feeler.errors import InvalidInput, ModelValidityWarning
from feeler.execute import ThreadExecutor
from feeler.objects.bodies import Object, check_clear, make_objects
from feeler.objects.motion import (
    BaseMotion,
    Flow,
    Vector,
    check_number,
    check_vector,
    lift,
    lift_turn,
    read_base,
)
from feeler.objects.shapes import trace_rim
from feeler.objects.trials import Trial
from feeler.physics.contact import (
    DEEP,
    DOUBT,
    Contact,
    describe_sink,
    get_contact,
    list_validity_warnings,
)
from feeler.physics.engine import (
    DEFAULT_ENGINE,
    ENGINES,
    MICRO,
    Contacts,
    State,
    Stepper,
    choose_timestep,
)
from feeler.physics.run import _explain_end, advance, advance_freely, count_chunk
from feeler.physics.scene import MAX_STEPS, Scene
from feeler.records import make_picture
from feeler.validation import Count, checked

# Snapshots: a moment of simulations, and what it belongs to.

BUILT = ("antenna", "objects", "contact", "gravity", "flow", "base")
"""The parts of a scene that an engine's tables are made of; commands do not change them."""
_PARTS = (*BUILT, "paths", "base_motion")


@dataclass(frozen=True, kw_only=True, eq=False)
class Snapshot:
    """A moment of some lanes, to which they can go back as often as one likes.

    Attributes
    ----------
    lanes : tuple[tuple, ...]
        Of each lane: its number, step and scene, the scene before commands replaced a recorded
        path, what ended it, and what its stepper saved.
    engine, timestep
        Of the simulations [ms].
    owner : object
        The simulations themselves, whose lanes may have begun other scenes since.
    """

    lanes: tuple[tuple[int, int, Scene, Scene, Exception | None, Any], ...]
    engine: str
    timestep: float
    owner: object


def _describe(name: str, here: Any, there: Any) -> str:
    if name == "antenna":
        return f"antenna {there.name!r} for {here.name!r} ({_list_fields(here, there)})"
    if name == "objects" and [o.name for o in here] == [o.name for o in there]:
        pairs = [(a, b) for a, b in zip(here, there, strict=True) if a != b]
        return ", ".join(f"object {a.name!r} ({_list_fields(a, b)})" for a, b in pairs)
    if name == "objects":
        names = [", ".join(o.name for o in some) or "none" for some in (there, here)]
        return f"objects {names[0]} for {names[1]}"
    if name in ("gravity", "base"):
        return f"{name} {there} for {here}"
    if name == "contact":
        return f"contact ({_list_fields(here, there)})"
    return {"base_motion": "base motion", "paths": "paths of objects"}.get(name, name)


def _list_fields(here: Any, there: Any) -> str:
    """Names of the fields in which two records of one class differ."""
    own = (field.name for field in fields(here))
    return ", ".join(
        name for name in own if _differs(getattr(here, name), getattr(there, name))
    )


def _differs(a: Any, b: Any) -> bool:
    arrays = isinstance(a, np.ndarray) or isinstance(b, np.ndarray)
    return not (np.array_equal(a, b) if arrays else a == b)


# Simulations side by side: many scenes, each stepped, steered, saved and reset by itself.

Turn = float | tuple[float, float, float]
MAX_TURN = 0.1  # rad; [C] the most that a base or an object may turn in one timestep


def _alone(method: Callable) -> Callable:
    """A method that waits until no other thread steps, steers or reads the same simulations."""

    @wraps(method)
    def run(self: "Simulations", *args: Any, **options: Any) -> Any:
        with self._turn:
            return method(self, *args, **options)

    return run


@checked
class Simulations:
    """Scenes of one segment count in lanes that share SIMD registers; the numbers of each are those
    it has alone.

    Threads may share them: while one steps, steers or reads, the others wait. Pickled or copied at
    any moment they go on from there, independently.

    Parameters
    ----------
    scenes
        One per lane; :func:`feeler.physics.simulation.build_scene` makes them of an antenna and
        objects.
    engine, timestep
        As for :class:`feeler.Simulation`.
    workers
        Threads that step the lanes; the numbers do not depend on it.

    Attributes
    ----------
    failed
        The error that ended each lane, or None. The other lanes go on; ``reset`` brings a lane
        back.
    quiet
        Whether contacts that sink in too deep are not warned of, where ``state.sink`` is read
        instead.
    """

    def __init__(
        self,
        scenes: Sequence[Scene],
        *,
        engine: str = DEFAULT_ENGINE,
        timestep: float | None = None,
        workers: Count = 1,
    ) -> None:
        scenes, self._fixed = list(scenes), timestep is not None
        step = choose_timestep(timestep, engine, *(scene.contact for scene in scenes))
        self.timestep = check_number(step, "timestep")
        if not scenes or len({scene.antenna.rest_angle.shape for scene in scenes}) != 1:
            raise InvalidInput(
                "simulations side by side need at least one scene, and one number of segments and"
                " of planes for all."
            )
        if self.timestep <= 0:
            raise InvalidInput(f"timestep must be > 0 ms, got {timestep}.")
        self._engine, self._workers, self._owner = engine, workers, object()
        self.quiet = False
        for scene in scenes:
            self._check_rate(scene, scene.base_velocity, "the base")
            scene.timed_contact.check_timestep(self.timestep)
            if scene.objects:
                told = scene.antenna, scene.contact, scene.speed, self.timestep
                self._warn(list_validity_warnings(*told, fixed=self._fixed))
        self._build(scenes)

    def _build(self, scenes: list[Scene]) -> None:
        """Put one scene into each lane, at time 0."""
        kind = ENGINES[self._engine]
        lanes = 1 if len(scenes) == 1 else kind.lanes
        idle = replace(
            scenes[-1], objects=(), paths=(), base_motion=None, angle=None, velocity=None
        )
        filled = [*scenes, *[idle] * (-len(scenes) % lanes)]
        self._steppers = [
            kind.make(filled[k : k + lanes], self.timestep)
            for k in range(0, len(filled), lanes)
        ]
        self._lanes, self._n, self._began = lanes, len(scenes), list(scenes)
        self._steps = [[0] * lanes for _ in self._steppers]
        self._chunk = count_chunk(filled[:lanes])
        self._look_for_guides()
        self.failed: list[Exception | None] = [None] * len(scenes)
        self._state: State | None = None
        self._stop, self._turn = Event(), RLock()
        self._sunk = [np.zeros(lanes, dtype=bool) for _ in self._steppers]
        workers = min(self._workers, len(self._steppers))
        self._pool = ThreadExecutor(workers) if workers > 1 else None
        if self._pool is not None:
            finalize(self, self._pool.kill)

    @_alone
    def __getstate__(self) -> dict[str, Any]:
        kept = (
            "timestep",
            "quiet",
            "_fixed",
            "_engine",
            "_workers",
            "_owner",
            "_began",
            "_sunk",
        )
        return {"moment": self.snapshot()} | {name: vars(self)[name] for name in kept}

    def __setstate__(self, state: dict[str, Any]) -> None:
        moment, sunk = state.pop("moment"), state.pop("_sunk")
        vars(self).update(state)
        self._build(self._began)
        self._sunk = [np.array(lanes) for lanes in sunk]
        self.restore(moment)

    def __len__(self) -> int:
        return self._n

    def _find(self, lane: int) -> tuple[Stepper, int]:
        if not 0 <= lane < self._n:
            raise InvalidInput(f"there is no lane {lane}; valid: 0 to {self._n - 1}.")
        return self._steppers[lane // self._lanes], lane % self._lanes

    def get_scene(self, lane: int) -> Scene:
        """The scene of a lane as it began, less what commands have replaced."""
        stepper, k = self._find(lane)
        return stepper.scenes[k]

    @_alone
    def step(self, ms: float) -> None:
        """Go on by ``ms`` [ms], a whole number of timesteps.

        Raises
        ------
        InvalidInput
            No whole number of timesteps, or a base whose recorded path ends before; nothing has
            moved then.
        KeyboardInterrupt
            After :meth:`cancel` in another thread, or Ctrl-C; ``time`` says how far each lane came,
            and all can go on.
        """
        n_steps = self._count_steps(ms)
        if self._guided:
            self._check_paths(n_steps)
        self._state = None
        groups, futures = range(len(self._steppers)), []
        try:
            if self._pool is None:
                self._advance(groups, n_steps)
            else:
                count = self._pool.workers
                futures = [
                    self._pool.submit(self._advance, groups[k::count], n_steps)
                    for k in range(count)
                ]
            for future in futures:
                future.result()
        except KeyboardInterrupt:
            self._stop.set()
            wait(futures)
            self._stop.clear()
            raise
        for stepper, sunk in zip(self._steppers, self._sunk, strict=True):
            sink = stepper.read_sink()
            if not self.quiet and np.any((sink > DEEP) & ~sunk):
                lane = int(np.argmax(sink))
                contact = stepper.scenes[lane].contact
                self._warn([describe_sink(float(sink[lane]), contact, fixed=self._fixed)])
                sunk |= sink > DEEP

    @staticmethod
    def _warn(doubts: Iterable[str]) -> None:
        for doubt in doubts:
            warnings.warn(ModelValidityWarning(DOUBT, doubt), stacklevel=4)

    def _advance(self, groups: range, n_steps: int) -> None:
        """Step the lanes of these steppers, one after the other."""
        go = advance if self._guided or n_steps > self._chunk else advance_freely
        for group in groups:
            if go(self._steppers[group], self._steps[group], n_steps, self._stop):
                stepper = self._steppers[group]
                for k in np.flatnonzero(stepper.find_broken()):
                    lane = group * self._lanes + int(k)
                    if lane < self._n and self.failed[lane] is None:
                        self.failed[lane] = _explain_end(
                            stepper, int(k), self._steps[group][k] * self.timestep
                        )

    def _count_steps(self, ms: float) -> int:
        count = check_number(ms, "ms") / self.timestep
        if count > MAX_STEPS:
            raise InvalidInput(
                f"{ms:g} ms are {count:.3g} timesteps of {self.timestep:g} ms; one command takes at"
                f" most {MAX_STEPS:.0e}, {MAX_STEPS * self.timestep:g} ms."
            )
        whole = round(count)
        if whole < 1 or abs(count - whole) > 1e-6 * count:
            raise InvalidInput(
                f"a simulation goes on by whole timesteps of {self.timestep:g} ms, got {ms} ms. Use"
                f" for example {max(1, whole) * self.timestep:g} ms."
            )
        return whole

    def _look_for_guides(self) -> None:
        """Note whether any lane needs more than its commands, so that a short step costs what it
        computes.
        """
        self._guided = any(
            scene.guided for stepper in self._steppers for scene in stepper.scenes
        )

    def _check_paths(self, n_steps: int) -> None:
        for stepper, steps in zip(self._steppers, self._steps, strict=True):
            for step, scene in zip(steps, stepper.scenes, strict=True):
                if scene.base_motion is not None and scene.follows:
                    scene.base_motion.compute_pose(np.array([(step + n_steps) * self.timestep]))

    def cancel(self) -> None:
        """End a running :meth:`step` within some 50 ms; it raises KeyboardInterrupt in its own
        thread.
        """
        self._stop.set()

    @property
    def time(self) -> np.ndarray:
        """(lane,) [ms]."""
        return self.timestep * np.array(self._steps).ravel()[: self._n]

    @property
    @_alone
    def state(self) -> State:
        """Where every lane is now; all arrays have the lane first."""
        if self._state is None:
            parts = [stepper.read() for stepper in self._steppers]
            self._state = (
                parts[0]
                if len(parts) == 1 and self._lanes == self._n
                else _join(parts, self._n)
            )
        return self._state

    @property
    def shape(self) -> np.ndarray:
        """Base, hinges and tip (lane, segment + 1, 2) [mm] in the world; in space (…, 3)."""
        state, antennas = self.state, [self.get_scene(lane).antenna for lane in range(self._n)]
        dims = 3 if antennas[0].spatial else 2
        turned = state.base[:, dims:] if dims == 3 else state.base[:, 2]
        rows = zip(antennas, state.angle, turned, state.base, strict=True)
        return np.stack([a.shape(angle, turn) + base[:dims] for a, angle, turn, base in rows])

    @_alone
    def read_contacts(self, lane: int) -> Contacts:
        """The contacts of a lane's last step."""
        stepper, k = self._find(lane)
        return stepper.read_contacts(k)

    @_alone
    def move_base(self, lane: int, velocity: Vector = (0.0, 0.0), turn: Turn = 0.0) -> None:
        """From the next step on a lane's base moves with ``velocity`` [mm/ms] and turns with
        ``turn`` [rad/ms], in space both vectors.

        The change takes one timestep, in which the antenna feels the acceleration. A recorded path
        is left for good.

        Raises
        ------
        InvalidInput
            Not finite, or faster than the timestep can follow.
        """
        stepper, k = self._find(lane)
        velocity, turn = _read_rate(stepper.scenes[k], velocity, turn)
        self._check_rate(stepper.scenes[k], np.hstack([velocity, turn]), "the base")
        if stepper.scenes[k].follows:
            start = tuple(stepper.scenes[k].base_pose.tolist())
            stepper.scenes[k] = replace(stepper.scenes[k], base=start, base_motion=None)
        stepper.move_base(k, velocity, turn)

    @_alone
    def move_object(
        self, lane: int, o: int, velocity: Vector = (0.0, 0.0), turn: Turn = 0.0
    ) -> None:
        """From the next step on object number ``o`` of a lane moves and turns like this [mm/ms,
        rad/ms].

        Raises
        ------
        InvalidInput
            No such object, not finite, or faster than the timestep can follow.
        """
        stepper, k = self._find(lane)
        scene = stepper.scenes[k]
        o = self._find_object(lane, o)
        velocity, turn = _read_rate(scene, velocity, turn)
        self._check_rate(
            scene, np.hstack([velocity, turn]), f"object {o} ({scene.objects[o].name})"
        )
        paths = [*scene.paths, *[None] * (len(scene.objects) - len(scene.paths))]
        if paths[o] is not None:
            paths[o] = None
            stepper.scenes[k] = replace(scene, paths=tuple(paths))
        stepper.move_object(k, o, velocity, turn)

    def _check_rate(self, scene: Scene, rate: Sequence[float] | np.ndarray, what: str) -> None:
        far = float(scene.antenna.radius.min())
        dims = 3 if scene.antenna.spatial else 2
        speed, turn = np.hypot.reduce(rate[:dims]), np.hypot.reduce(rate[dims:])
        if self.timestep * speed > far or self.timestep * turn > MAX_TURN:
            raise InvalidInput(
                f"{what} moves faster than the timestep of {self.timestep:g} ms can follow: at most"
                f" {far / self.timestep:.3g} mm/ms (the antenna's least radius in a step)"
                f" and {MAX_TURN / self.timestep:.3g} rad/ms, got"
                f" {speed:.3g} and {turn:.3g}. Use a smaller timestep or move slower."
            )

    def set_velocity(
        self, lane: int, what: int | str, velocity: Vector = (0.0, 0.0), turn: Turn = 0.0
    ) -> None:
        """From the next step on the ``"base"`` of a lane, or an object by name or number, moves
        with ``velocity`` [mm/ms] and turns with ``turn`` [rad/ms]; what is left out is 0.

        Raises
        ------
        InvalidInput
            As for :meth:`move_base` and :meth:`move_object`.
        """
        if what == "base":
            self.move_base(lane, velocity, turn)
        else:
            self.move_object(lane, self._find_object(lane, what), velocity, turn)

    def _find_object(self, lane: int, which: int | str) -> int:
        names = [item.name for item in self.get_scene(lane).objects]
        if isinstance(which, str):
            if which not in names:
                raise InvalidInput(
                    f"there is no object {which!r}; valid: {', '.join(names) or 'none'}."
                )
            return names.index(which)
        if not 0 <= which < len(names):
            raise InvalidInput(f"there is no object {which}; the scene has {len(names)}.")
        return which

    @_alone
    def list_objects(self, lane: int) -> tuple[Object, ...]:
        """The objects of a lane as they stand and move now."""
        stepper, k = self._find(lane)
        scene, state = stepper.scenes[k], self.state
        _, rates = stepper.read_rates(k)
        dims, found = 3 if scene.antenna.spatial else 2, []
        for o, item in enumerate(scene.objects):
            forward = state.forward[lane, o]
            turned = dims == 3 and not np.allclose(forward, item.forward, rtol=0, atol=1e-9)
            if turned or (dims == 3 and np.any(rates[o, 3:])):
                raise InvalidInput(
                    f"object {item.name!r} has turned in space, where objects cannot be read while"
                    " they turn; use objects that only move."
                )
            turn = rates[o, 2] if dims == 2 else tuple(rates[o, 3:].tolist())
            found.append(
                item.replace(
                    place=tuple(state.place[lane, o].tolist()),
                    forward=tuple((forward / np.hypot.reduce(forward)).tolist()),
                    velocity=tuple(rates[o, :dims].tolist()),
                    turn=turn,
                )
            )
        return tuple(found)

    @_alone
    def set_objects(self, lane: int, objects: Sequence[Object]) -> None:
        """Replace the objects of a lane; antenna, base and time go on. The works done since time 0,
        and how deep contacts have sunk, count anew; the softness of contact follows from the speeds
        of this moment.

        Raises
        ------
        InvalidInput
            Two objects of one name, one that overlaps the antenna, or a lane whose base or objects
            follow recorded paths; nothing has changed then.
        """
        stepper, k = self._find(lane)
        scene, state = stepper.scenes[k], self.state
        if scene.guided:
            raise InvalidInput(
                "objects cannot be changed while base or objects follow recorded paths; steer them"
                " by set_velocity() instead."
            )
        names, old = [item.name for item in objects], self.list_objects(lane)
        if twice := {name for name in names if names.count(name) > 1}:
            raise InvalidInput(
                f"two objects are called {twice.pop()!r}; give each its own name=."
            )
        rate, _ = stepper.read_rates(k)
        dims = 3 if scene.antenna.spatial else 2
        turn = tuple(rate[3:].tolist()) if dims == 3 else float(rate[2])
        now = replace(
            scene,
            objects=tuple(objects),
            paths=(),
            base=tuple(state.base[lane].tolist()),
            base_motion=BaseMotion(velocity=tuple(rate[:dims].tolist()), turn=turn),
            angle=state.angle[lane].copy(),
            velocity=state.velocity[lane].copy(),
        )
        new = [item for item in objects if item not in old]
        check_clear(scene.antenna, new, now.initial_angle, now.base_pose)
        steps, began = self._steps[lane // self._lanes][k], self._began[lane]
        self.reset(lane, now)
        self._steps[lane // self._lanes][k], self._began[lane] = steps, began

    def add_object(self, lane: int, item: Object) -> None:
        """Put one more object into a lane, clear of the antenna."""
        self.set_objects(lane, [*self.list_objects(lane), item])

    def remove_object(self, lane: int, which: int | str) -> None:
        """Take an object, by name or number, out of a lane."""
        o, objects = self._find_object(lane, which), self.list_objects(lane)
        self.set_objects(lane, objects[:o] + objects[o + 1 :])

    def place_object(
        self, lane: int, which: int | str, place: Vector, forward: Vector | None = None
    ) -> None:
        """Put an object of a lane elsewhere, clear of the antenna, and turn it to ``forward``; it
        keeps its velocity.
        """
        o, objects = self._find_object(lane, which), [*self.list_objects(lane)]
        objects[o] = objects[o].replace(place=place, forward=forward or objects[o].forward)
        self.set_objects(lane, objects)

    @property
    def angle(self) -> np.ndarray:
        """Hinge angles (lane, segment) [rad]."""
        return self.state.angle

    @property
    def velocity(self) -> np.ndarray:
        """Rates of the hinges (lane, segment) [rad/ms]."""
        return self.state.velocity

    @property
    def base(self) -> np.ndarray:
        """x, y [mm] and heading [rad] of the bases (lane, 3)."""
        return self.state.base

    @property
    def place(self) -> np.ndarray:
        """Where each object's ``place`` is (lane, object, 2) [mm]."""
        return self.state.place

    @property
    def force(self) -> np.ndarray:
        """Contact force of each object on the antenna (lane, object, 2) [N] in the last step."""
        return self.state.force

    @property
    def base_force(self) -> np.ndarray:
        """Force of the base on the antenna (lane, 2) [N] in the last step."""
        return self.state.base_force

    @property
    def base_moment(self) -> np.ndarray:
        """Moment of the base on the antenna (lane,) [N·mm], positive as angles are; in space (lane,
        3).
        """
        return self.state.base_moment

    @_alone
    def snapshot(self, lanes: Iterable[int] | None = None) -> Snapshot:
        """This moment of some lanes (default all)."""
        kept = []
        for lane in range(self._n) if lanes is None else lanes:
            stepper, k = self._find(lane)
            step, began = self._steps[lane // self._lanes][k], self._began[lane]
            ended, saved = self.failed[lane], stepper.save(k)
            kept.append((lane, step, stepper.scenes[k], began, ended, saved))
        return Snapshot(
            lanes=tuple(kept),
            engine=self._engine,
            timestep=self.timestep,
            owner=self._owner,
        )

    @_alone
    def restore(self, snapshot: Snapshot) -> None:
        """Go back to a moment, to the last bit; only the lanes of the snapshot do.

        The moment is one of these simulations, or of others with the same engine, timestep and
        scenes.

        Raises
        ------
        InvalidInput
            A snapshot of something else; the message says what differs, and nothing has changed.
        """
        self._check_snapshot(snapshot)
        for lane, step, scene, began, failed, saved in snapshot.lanes:
            stepper, k = self._find(lane)
            now = stepper.scenes[k]
            if any(getattr(now, name) != getattr(scene, name) for name in BUILT):
                stepper.reset(k, scene)  # tables of another scene, but for its state
            stepper.scenes[k], self._began[lane] = scene, began
            stepper.load(k, saved)
            self._steps[lane // self._lanes][k], self.failed[lane] = step, failed
        self._state = None
        self._look_for_guides()

    def _check_snapshot(self, snapshot: Snapshot) -> None:
        """Refuse a snapshot of other simulations, unless these are the same in all that counts."""
        if not isinstance(snapshot, Snapshot):
            raise InvalidInput(
                f"restore takes what snapshot() gave, got {type(snapshot).__name__}."
            )
        if snapshot.owner is self._owner:
            return
        found = [
            f"{name} {there} for {here}"
            for name, there, here in (
                ("engine", snapshot.engine, self._engine),
                ("timestep", f"{snapshot.timestep:g} ms", f"{self.timestep:g} ms"),
            )
            if there != here
        ]
        for lane, _, _, began, _, _ in snapshot.lanes:
            self._find(lane)
            where = f"in lane {lane} " if self._n > 1 else ""
            here = vars(self._began[lane])
            found += [
                where + _describe(name, here[name], there)
                for name, there in vars(began).items()
                if name in _PARTS and here[name] != there
            ]
        if found:
            raise InvalidInput(
                f"the snapshot is of another simulation: it has {'; '.join(found)}. Restore it in"
                " one that is made as that was."
            )

    @_alone
    def reset(self, lane: int, scene: Scene | None = None) -> None:
        """Begin another scene in one lane (default: its own again); its neighbours go on as if
        nothing had been.
        """
        stepper, k = self._find(lane)
        scene = scene or self._began[lane]
        own, other = stepper.scenes[k].antenna, scene.antenna
        if own.rest_angle.shape != other.rest_angle.shape:
            what = "planes" if own.n_segments == other.n_segments else "segments"
            counts = [len(a.planes) if what == "planes" else a.n_segments for a in (own, other)]
            raise InvalidInput(
                f"a lane keeps its number of {what}: it has {counts[0]}, the new antenna"
                f" {counts[1]}. Begin new simulations for it."
            )
        scene.timed_contact.check_timestep(self.timestep)
        self._check_rate(scene, scene.base_velocity, "the base")
        stepper.reset(k, scene)
        self._began[lane] = scene
        self._steps[lane // self._lanes][k], self.failed[lane], self._state = 0, None, None
        self._look_for_guides()


def _read_rate(scene: Scene, velocity: Vector, turn: Turn) -> tuple[Vector, Turn]:
    """What a base or an object is told to do: velocity (2,) and turn rate; in space both (3,).

    Raises
    ------
    InvalidInput
        Not finite, or of three numbers where the antenna lies in the plane.
    """
    if not scene.antenna.spatial:
        return check_vector(velocity, "velocity"), check_number(turn, "turn")
    return read_rate_in_space(velocity, turn)


def read_rate_in_space(velocity: Vector, turn: Turn) -> tuple[Vector, Turn]:
    """Velocity and angular velocity (3,), also of what is given in the plane."""
    flat = np.ndim(turn) == 0
    spin = check_number(turn, "turn") if flat else check_vector(turn, "turn", (3,))
    return lift(check_vector(velocity, "velocity", (2, 3))), lift_turn(spin)


def _join(parts: Sequence[State], n: int) -> State:
    """The states of several groups as one, lanes that only fill up left out; fewer objects than
    most: NaN.
    """
    most = max(part.place.shape[1] for part in parts)
    fields = {}
    for name in parts[0].__dataclass_fields__:
        arrays = [getattr(part, name) for part in parts]
        if name in ("force", "place", "forward", "object_work"):
            arrays = [_widen(array, most) for array in arrays]
        fields[name] = np.concatenate(arrays)[:n]
    return State(**fields)


def _widen(array: np.ndarray, most: int) -> np.ndarray:
    if array.shape[1] == most:
        return array
    missing = [(0, 0), (0, most - array.shape[1]), *[(0, 0)] * (array.ndim - 2)]
    return np.pad(array, missing, constant_values=np.nan)


# A simulation in the hand: step it, steer it, look at it, save it, go back.


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
    start = check_hinges(antenna, angle, "angle")
    found = make_objects(antenna, given)
    scene = Scene(
        antenna=antenna,
        objects=found,
        contact=get_contact(contact, antenna),
        gravity=check_vector(gravity, "gravity", (2, 3)),
        base_motion=moved[0] if moved else read_base(base),
        flow=None if flow is None else Flow.from_plain(flow),
        angle=start,
        velocity=check_hinges(antenna, velocity, "velocity"),
        label=label or ", ".join(o.name for o in found) or antenna.name,
    )
    check_clear(antenna, found, scene.initial_angle, scene.base_pose)
    return scene


def warn_of_misses(scene: Scene) -> None:
    """Warn of objects that move past the base farther away than the antenna reaches, as long as
    nothing is commanded.
    """
    dims = 3 if scene.antenna.spatial else 2
    if scene.guided or np.any(scene.base_velocity[dims:]):
        return
    reach = scene.antenna.length + float(scene.antenna.radius.max())
    for item in scene.objects:
        rate = np.asarray(item.velocity) - scene.base_velocity[:dims]
        speed = float(np.hypot.reduce(rate))
        if not speed or item.feature.unbounded:
            continue
        gap = np.asarray(item.place) - scene.base_pose[:dims]
        time = max(0.0, -float(gap @ rate) / speed**2)
        nearest = float(np.hypot.reduce(gap + time * rate))
        if nearest > reach + item.extent:
            text = (
                f"object {item.name!r} never comes near, as it moves now. Check place= and"
                " velocity=, which are in the world's axes."
            )
            details = f"Its place passes the base at {nearest:.3g} mm, and the antenna reaches"
            warning = ModelValidityWarning(text, f"{details} {reach:.3g} mm.")
            warnings.warn(warning, stacklevel=4)


def check_hinges(antenna: Antenna, values: np.ndarray | None, name: str) -> np.ndarray | None:
    if values is None:
        return None
    array = np.array(values, dtype=float)
    if array.shape != antenna.rest_angle.shape or not np.isfinite(array).all():
        rows = (
            f" in each of {len(antenna.planes)} rows, one per plane" if antenna.spatial else ""
        )
        raise InvalidInput(
            f"{name} must be {antenna.n_segments} finite numbers, one per segment{rows}, got"
            f" shape {array.shape}."
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
        How the base moves from time 0 on; steer it later by :meth:`set_velocity`.
    flow
        What drags an antenna in space along: a :class:`feeler.objects.motion.Flow`.
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
    >>> simulation.set_velocity("ball", (0.0, 0.0))
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
        self.antenna, self.engine = antenna, engine
        warn_of_misses(scene)

    @property
    def names(self) -> tuple[str, ...]:
        """The objects' names, in the order of ``place`` and ``force``."""
        return tuple(item.name for item in self._lanes.get_scene(0).objects)

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
        features = [item.feature for item in self._lanes.get_scene(0).objects]
        turns = zip(features, *flat, strict=True)
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
        SimulationDivergedError
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
        self._lanes.move_object(0, self._lanes._find_object(0, which), velocity, turn)

    def set_velocity(
        self, what: int | str, velocity: Vector = (0.0, 0.0), turn: Turn = 0.0
    ) -> None:
        """From the next step on the ``"base"``, or an object by name or number, moves with
        ``velocity`` [mm/ms] and turns with ``turn`` [rad/ms]; what is left out is 0.
        """
        self._lanes.set_velocity(0, what, velocity, turn)

    @property
    def objects(self) -> tuple[Object, ...]:
        """The objects as they stand and move now."""
        return self._lanes.list_objects(0)

    def add_object(self, item: Object) -> None:
        """Put one more object into the scene, clear of the antenna; works count anew."""
        self._lanes.add_object(0, item)

    def remove_object(self, which: int | str) -> None:
        """Take an object out of the scene; works count anew."""
        self._lanes.remove_object(0, which)

    def place_object(
        self, which: int | str, place: Vector, forward: Vector | None = None
    ) -> None:
        """Put an object elsewhere, clear of the antenna, and turn it to ``forward``; it keeps its
        velocity, and works count anew.
        """
        self._lanes.place_object(0, which, place, forward)

    def reset(self) -> None:
        """Begin again, as it was made."""
        self._lanes.reset(0, self._lanes._began[0])

    def snapshot(self) -> Snapshot:
        """This moment, for :meth:`restore`."""
        return self._lanes.snapshot()

    def restore(self, snapshot: Snapshot) -> None:
        """Go back to a moment of this simulation, or of another one made alike, to the last bit
        and with the objects that it had then.

        Raises
        ------
        InvalidInput
            A snapshot of another antenna, other objects, gravity, contact, base, flow, timestep or
            engine; the message says what differs, and nothing has changed.
        """
        self._lanes.restore(snapshot)
