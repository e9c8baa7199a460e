"""Tasks of active touch and the arena in which their episodes run side by side."""

import math
from collections.abc import Iterable, Sequence
from dataclasses import KW_ONLY, field, replace
from functools import cached_property
from typing import Annotated, Any, ClassVar

import numpy as np
from scipy.special import log_softmax

from feeler.antenna.animals import SampledAntennas, cockroach
from feeler.antenna.segments import Antenna, require_plane
from feeler.errors import InvalidInput
from feeler.objects import Nuisances, Task, parse_noise
from feeler.objects.motion import BaseMotion
from feeler.objects.task import SampledTrials, is_number
from feeler.objects.trials import make_features
from feeler.physics.contact import DEEP, get_contact
from feeler.physics.engine import DEFAULT_ENGINE, MICRO, State
from feeler.physics.scene import Scene, make_scene
from feeler.physics.simulation import Simulations
from feeler.records import Ge, Gt, Record, Unit
from feeler.validation import checked, show
from feeler.wall.approach import Approach, Posture, approach
from feeler.wall.following import BODY_LOST, FOLLOWING, RUN_SUBSTEP, Course, make_course_scene

# Tasks of active touch: what may be met, how it is felt, how the body may move, and what that
# costs.

SAMPLE = 1.0  # ms; one step of the body, and one sample of every sensor


class Start(Record):
    """How one episode begins.

    Attributes
    ----------
    scene : Scene
        The antenna and what it may meet; nothing moves yet.
    direction : tuple[float, ...]
        Where the body goes when it goes ahead, in the world [unit vector], in space three numbers.
    target : float
        What is asked for, as it is now.
    course : Course | None
        The wall, where there is one.
    """

    scene: Scene
    direction: tuple[float, ...]
    target: float
    course: Course | None = None


class ActiveTask(Record, kw_only=False):
    """What all tasks share: an antenna on a body that moves by speed and turn, and is asked
    something all the while.

    Attributes
    ----------
    antenna : Antenna | SampledAntennas
        Or several, of which episodes draw.
    noise : Any
        On each sample of each sensor: a :class:`feeler.objects.Noise`, text such as
        ``"common:0.03"``, or a number, the standard deviation in rad [C]. What a noise is
        relative to is a sample of all sensors.
    duration : float
        Length of an episode [ms].
    window : int
        Samples of every sensor that an observation shows, the last one last [C].
    max_speed : float
        Greatest speed of the body, ahead and back [mm/ms], [C].
    acceleration : float
        Greatest change of its speed in a millisecond [mm/ms per ms]; the first action sets the
        speed of arrival [C].
    max_turn : float
        Greatest turn rate [rad/ms]; 0.03 is 1700 °/s [C].
    time_cost : float
        Reward lost per millisecond [C].
    work_cost : float
        Reward lost per µJ of work on the antenna [C].
    timestep : float
        Of the integration [ms]: the coarsest that the contact allows [C].
    seed : int
        Of what may be met; episodes draw from it with a generator of their own.
    """

    antenna: Antenna | SampledAntennas = field(default_factory=cockroach)
    _: KW_ONLY
    noise: Any = "common:0.03"
    duration: Annotated[float, Gt(0), Unit("ms")] = 200.0
    window: Annotated[int, Gt(0)] = 5
    max_speed: Annotated[float, Gt(0), Unit("mm/ms")] = 1.2
    acceleration: Annotated[float, Gt(0), Unit("mm/ms²")] = 0.2
    max_turn: Annotated[float, Gt(0), Unit("rad/ms")] = 0.03
    time_cost: Annotated[float, Ge(0)] = 0.0
    work_cost: Annotated[float, Ge(0)] = 0.0
    timestep: Annotated[float, Gt(0), Unit("ms")] = 0.1
    engine: str = DEFAULT_ENGINE
    seed: int = 0

    n_outputs: ClassVar[int] = 1
    """How many numbers a prediction is."""

    def _check(self) -> None:
        vars(self)["noise"] = parse_noise(self.noise)

    @property
    def first_antenna(self) -> Antenna:
        """The antenna, or the one of which others were drawn."""
        return (
            self.antenna.antenna if isinstance(self.antenna, SampledAntennas) else self.antenna
        )

    def measure_noise(self, angle: np.ndarray) -> np.ndarray:
        """Standard deviation [rad] of the noise of samples (…, sensor), in their shape."""
        samples = angle.reshape(-1, angle.shape[-1], 1)
        return np.broadcast_to(self.noise.sd(samples), samples.shape).reshape(angle.shape)

    def begin(self, rng: np.random.Generator) -> Start:
        """Draw an episode."""
        raise NotImplementedError

    def measure(self, start: Start, _base: np.ndarray) -> float:
        """What is asked for, with the base at x, y [mm] and heading [rad] (3,)."""
        return start.target

    def is_over(self, _target: float) -> bool:
        """Whether the episode has come to its end before its time."""
        return False

    def compute_loss(self, prediction: np.ndarray, target: np.ndarray) -> np.ndarray:
        """Loss (lane,) of predictions (lane, output) of targets (lane,)."""
        raise NotImplementedError

    def compute_cost(self, target: np.ndarray) -> np.ndarray:
        """What is lost (lane,) in a millisecond for where the body is, whatever it predicts."""
        return np.zeros(len(target))


class TouchTask(ActiveTask):
    """Which object is it? The body moves towards one of several, whose place, distance and
    direction it is not told.

    A prediction is a score for each object; the loss is the cross entropy of their softmax [nat],
    ln K for one who knows nothing.

    Attributes
    ----------
    features : Any
        Objects that may be met, equally likely: features, or text such as ``"ball:radius=2"``.
    sizes : Any
        Half-widths [mm], a spread; default: as large as the features are.
    locations : Any
        Where it meets the antenna, as a share of its length, a spread.
    gap : Any
        How far the object is at first [mm], a spread.
    approach : Any
        Angle of the motion to the antenna [degrees], a spread.
    friction : Any
        Coefficient of friction, a spread.
    azimuth : Any
        Of an antenna in space: by how much the approach is turned about the touched segment
        [degrees], a spread; the body goes that way.
    pool : int
        How many touches are drawn beforehand, of which episodes take one at random.
    """

    features: Any = field(default_factory=make_features)
    sizes: Any = None
    locations: Any = (0.5, 0.9)
    gap: Any = (2.0, 8.0)
    approach: Any = (86.0, 94.0)
    friction: Any = (0.6, 1.0)
    azimuth: Any = 0.0
    pool: Annotated[int, Gt(0)] = 2048

    def _check(self) -> None:
        super()._check()
        if not isinstance(self.features, Sequence) or isinstance(self.features, str):
            raise InvalidInput(
                f"features must be a list of objects, got {show(self.features)}."
            )
        if not self.features:
            raise InvalidInput(
                "there is nothing to touch: give features=, such as [Ball(radius=2), Box(...)]."
            )
        vars(self)["features"] = tuple(self.features)

    def to_plain(self) -> dict[str, Any]:
        """The task as plain data; an azimuth of 0 is left out, as in the plane there is none."""
        return {k: v for k, v in super().to_plain().items() if k != "azimuth" or v}

    @property
    def n_outputs(self) -> int:  # type: ignore[override]
        """One score for each object."""
        return len(self.features)

    @cached_property
    def trials(self) -> SampledTrials:
        """Every touch that may be met, at 1 mm/ms: their lead [ms] is the gap [mm]."""
        spreads = {
            "size": self.sizes,
            "location": self.locations,
            "approach": self.approach,
            "friction": self.friction,
            "azimuth": self.azimuth,
        }
        # for a task, a single number would be how far off the value may lie
        by = {
            name: (spread, spread) if is_number(spread) else spread
            for name, spread in spreads.items()
        }
        question = Task(
            objects=self.features,
            locations=(1.0,),
            speeds=(1.0,),
            nuisances=Nuisances(**by | {"size": by["size"] or 0.0}),
            noise=self.noise,
            lead=self.gap,
            deadline=self.duration,
        )
        return question.mix(self.pool, self.first_antenna, seed=self.seed)

    def begin(self, rng: np.random.Generator) -> Start:
        """Draw a touch: the object stands, and the body is to come."""
        return self.make_start(int(rng.integers(len(self.trials))))

    def make_start(self, index: int) -> Start:
        """The beginning of touch number ``index``."""
        antenna = self.antenna
        if isinstance(antenna, SampledAntennas):
            antenna = antenna[index % len(antenna)]
        contact = get_contact(None, self.first_antenna)  # one timestep for all
        scene = make_scene(antenna, self.trials[index], contact)
        velocity = scene.objects[0].velocity
        stopped = scene.objects[0].replace(velocity=(0.0,) * len(velocity))
        return Start(
            scene=replace(scene, objects=(stopped,)),
            direction=tuple(-v for v in velocity),
            target=self.get_target(index),
        )

    def get_target(self, index: int) -> float:
        """Number of the object of touch ``index``."""
        return float(self.trials.columns["feature"][index])

    def compute_loss(self, prediction: np.ndarray, target: np.ndarray) -> np.ndarray:
        """Cross entropy (lane,) [nat]."""
        scores = log_softmax(prediction, axis=1)
        return -scores[np.arange(len(target)), target.astype(int)]


class LocaliseTask(TouchTask):
    """Where on the antenna is it? The loss is the squared error over the variance of what may be
    met, 1 for one who knows nothing but that."""

    @property
    def n_outputs(self) -> int:  # type: ignore[override]
        """A place."""
        return 1

    def get_target(self, index: int) -> float:
        """Where touch ``index`` begins, as a share of the antenna's length."""
        return float(self.trials.columns["location"][index])

    def compute_loss(self, prediction: np.ndarray, target: np.ndarray) -> np.ndarray:
        """Squared error (lane,), relative."""
        variance = max(float(np.var(self.trials.columns["location"])), 1e-12)
        return (prediction[:, 0] - target) ** 2 / variance


# An arena: episodes of one task side by side, each with its own noise, begun and moved by
# itself.

_BLOCK = 64  # [C] samples of noise that a lane draws at a time


@checked
class Arena:
    """Episodes of one task in SIMD lanes.

    The first action of an episode sets the speed with which the body arrives, the antenna carried
    along unbent; from then on speed changes by at most ``task.acceleration`` in a millisecond. So
    an episode of one constant speed is a touch at that speed, to the last bit.

    Parameters
    ----------
    workers
        Threads over which the lanes are spread; the numbers do not depend on it.

    Attributes
    ----------
    time : np.ndarray
        Since the beginning (lane,) [ms].
    base : np.ndarray
        Way gone ahead [mm], heading [rad], speed [mm/ms], turn rate [rad/ms] (lane, 4).
    work : np.ndarray
        Work done on the antennas (lane,) [µJ]: what bringing them to the speed of arrival took,
        and all since; what they give back when they are slowed down is taken off.
    fresh : np.ndarray
        Whether (lane,) an episode has begun and not moved yet.
    n_felt : int
        Numbers that a body feels: in space the sensors of one plane after those of the other.
    """

    def __init__(self, task: ActiveTask, n: int = 1, workers: int = 1) -> None:
        self.task, self.n = task, n
        self.sensors = task.first_antenna.sensors - 1
        first = task.begin(np.random.default_rng(0))
        self.simulations = Simulations(
            [first.scene] * n,
            engine=task.engine,
            timestep=first.scene.contact.scale_timestep(task.timestep),
            workers=min(workers, n),
        )
        self.starts = [first] * n
        self.state: State | None = None
        self.time = np.zeros(n)
        self.base = np.zeros((n, 4))
        self.work = np.zeros(n)
        self.fresh = np.ones(n, bool)
        self._paid = np.zeros(n)
        self._rate: list[tuple[float, ...]] = [(0.0, 0.0, 0.0)] * n
        self._heading = np.zeros(n)
        self._rngs = [np.random.default_rng(0)] * n
        self.n_felt = len(task.first_antenna.planes) * len(self.sensors)
        self._window = np.zeros((n, task.window, self.n_felt))
        self._drawn = np.zeros((n, _BLOCK, self.n_felt))
        self._used = np.full(n, _BLOCK)

    def save(self) -> tuple[Any, ...]:
        """This moment of all lanes, for :meth:`load`."""
        kept = (self.base, self.time, self._paid, self.work, self.fresh)
        copies = (array.copy() for array in kept)
        return (self.simulations.snapshot(), [*self._rate], self.state, *copies)

    def load(self, saved: tuple[Any, ...]) -> None:
        """Go back to a moment, to the last bit; what was felt and its noise stay as they are."""
        snapshot, rate, self.state, *kept = saved
        self.simulations.restore(snapshot)
        self._rate = [*rate]
        copies = (array.copy() for array in kept)
        self.base, self.time, self._paid, self.work, self.fresh = copies

    def begin(self, lane: int, rng: np.random.Generator, start: Start | None = None) -> None:
        """Begin an episode in one lane, which draws what it meets (unless given) and its noise from
        ``rng``.
        """
        self.starts[lane] = start = start or self.task.begin(rng)
        self._rngs[lane], self._used[lane], self.fresh[lane] = rng, _BLOCK, True
        self.base[lane] = self.time[lane] = self.work[lane] = 0.0
        self._heading[lane] = start.scene.base[2]
        rest = self._feel(start.scene.initial_angle[None])[0]
        for _ in range(self.task.window):
            self._push([lane], rest[None])

    def _push(self, lanes: Sequence[int], angle: np.ndarray) -> None:
        """A sample (lane, sensor) of some lanes, to which their noise is added."""
        self._window[lanes, :-1] = self._window[lanes, 1:]
        if not self.task.noise.is_gaussian:
            for lane, clean in zip(lanes, angle, strict=True):
                noisy = self.task.noise.add(clean[None, :, None], self._rngs[lane])
                self._window[lane, -1] = noisy[0, :, 0]
            return
        for lane in lanes:
            if self._used[lane] == _BLOCK:
                self._drawn[lane] = self._rngs[lane].standard_normal(self._drawn.shape[1:])
                self._used[lane] = 0
        drawn = self._drawn[lanes, self._used[lanes]]
        self._window[lanes, -1] = angle + self.task.measure_noise(angle) * drawn
        self._used[lanes] += 1

    def _feel(self, angle: np.ndarray) -> np.ndarray:
        """What sensors feel (lane, number) of the hinges' angles (lane, segment), in space (lane,
        plane, segment)."""
        return angle[..., self.sensors].reshape(-1, self.n_felt)

    def check_action(self, action: np.ndarray) -> np.ndarray:
        """Speeds and turn rates (lane, 2), if the bodies may move so; else an error that names the
        first lane.
        """
        action = np.asarray(action, dtype=float)
        if action.shape != (self.n, 2):
            raise InvalidInput(
                f"an action is a speed and a turn rate for each lane, ({self.n}, 2); got"
                f" {action.shape}."
            )
        limits = np.array([self.task.max_speed, self.task.max_turn])
        wrong = np.flatnonzero(~(np.abs(action) <= limits * (1 + 1e-6)).all(axis=1))
        if wrong.size:
            speed, turn = action[wrong[0]]
            raise InvalidInput(
                f"the action of lane {wrong[0]} is outside the space: speed {speed:g} mm/ms (at"
                f" most ±{limits[0]:g}), turn {turn:g} rad/ms (at most ±{limits[1]:g}). Nothing has"
                " moved; clip it."
            )
        return action

    def step(self, action: np.ndarray, lanes: Iterable[int] | None = None) -> None:
        """Go on by a millisecond with actions (lane, 2); ``lanes`` (default all) are those whose
        episodes go on.

        Raises
        ------
        InvalidInput
            An action outside the space; nothing has moved then.
        """
        action = self.check_action(action)
        active = [*range(self.n)] if lanes is None else [int(lane) for lane in lanes]
        for lane, (speed, turn) in zip(active, action[active].tolist(), strict=True):
            self._command(lane, speed, turn)
        self.simulations.step(SAMPLE)
        self.state = state = self.simulations.state
        self.time[active] += SAMPLE
        self.base[active, 0] += SAMPLE * self.base[active, 2]
        sound = [lane for lane in active if self.simulations.failed[lane] is None]
        self._push(sound, self._feel(state.angle[sound]))
        if self.task.first_antenna.spatial:  # whose turns are all about z
            self.base[sound, 1] += SAMPLE * self.base[sound, 3]
        else:
            self.base[sound, 1] = state.base[sound, 2] - self._heading[sound]
        spent = state.base_work + np.nansum(state.object_work, axis=1)
        self.work[sound] = (self._paid + MICRO * spent)[sound]

    def _command(self, lane: int, speed: float, turn: float) -> None:
        """Move one base by its action."""
        start = self.starts[lane]
        _, heading, before, _ = self.base[lane].tolist()
        if not self.fresh[lane]:
            change = self.task.acceleration * SAMPLE
            speed = before + min(max(speed - before, -change), change)
        x, y, *up = start.direction
        if heading:  # from +y towards +x
            c, s = math.cos(heading), math.sin(heading)
            x, y = c * x + s * y, c * y - s * x
        self.base[lane, 2:] = speed, turn
        rate = (speed * x, speed * y, *(speed * z for z in up), turn)
        if self.fresh[lane]:
            moving = BaseMotion(velocity=rate[:-1], turn=turn)  # type: ignore[arg-type]  # 2 or 3
            self.simulations.reset(lane, replace(start.scene, base_motion=moving))
            self._paid[lane] = _compute_energy(start.scene, rate)
            self.fresh[lane] = False
        elif rate != self._rate[lane]:
            self.simulations.move_base(lane, rate[:-1], turn)
        self._rate[lane] = rate

    def observe(self) -> dict[str, np.ndarray]:
        """What the bodies know now, in arrays of their own.

        ``angle`` (lane, window, sensor) [rad] holds the last samples of every sensor with their
        noise, the newest last, in space the sensors of one plane after those of the other; ``base``
        (lane, 4) and ``time`` (lane, 1) are the arena's.
        """
        return {
            "angle": self._window.copy(),
            "base": self.base.copy(),
            "time": self.time[:, None].copy(),
        }

    @property
    def felt(self) -> np.ndarray:
        """What the sensors would say without noise (lane, sensor) [rad]."""
        rest = self._feel(np.array([start.scene.initial_angle for start in self.starts]))
        now = rest if self.state is None else self._feel(self.state.angle)
        return np.where(self.fresh[:, None], rest, now)

    @property
    def targets(self) -> np.ndarray:
        """What is asked for (lane,), as it is now."""
        bases = np.zeros((self.n, 3)) if self.state is None else self.state.base
        return np.array(
            [
                self.task.measure(start, np.array(start.scene.base) if fresh else base)
                for start, base, fresh in zip(self.starts, bases, self.fresh, strict=True)
            ]
        )

    @property
    def touching(self) -> np.ndarray:
        """Whether (lane,) the antenna is in contact: what the body is not told."""
        if self.state is None:
            return np.zeros(self.n, bool)
        return np.isfinite(self.state.contact_place) & ~self.fresh

    @property
    def valid(self) -> np.ndarray:
        """Whether (lane,) no contact of the episode has sunk in too deep for solid bodies."""
        if self.state is None:
            return np.ones(self.n, bool)
        return (self.state.sink <= DEEP) | self.fresh

    @property
    def failed(self) -> list[Exception | None]:
        """The error that ended each lane's episode, or None."""
        return [
            None if fresh else error
            for error, fresh in zip(self.simulations.failed, self.fresh, strict=True)
        ]

    @property
    def over(self) -> np.ndarray:
        """Whether (lane,) the time is up."""
        return self.time >= self.task.duration - 1e-9


def _compute_energy(scene: Scene, rate: tuple[float, ...]) -> float:
    """Energy of motion [µJ] of an antenna that is carried along unbent, its segments as points at
    their middle, in space at their centre of mass.
    """
    if scene.antenna.spatial:
        ends = scene.antenna.shape(scene.initial_angle, np.array(scene.base[3:]))
        share = (scene.antenna.mass_centre / scene.antenna.segment_length)[:, None]
        turning = np.cross([0.0, 0.0, -rate[-1]], (1 - share) * ends[:-1] + share * ends[1:])
        square = ((np.array(rate[:-1]) + turning) ** 2).sum(axis=1)
        return MICRO * 0.5 * float(scene.antenna.segment_mass @ square)
    points = scene.antenna.shape(scene.initial_angle, scene.base[2])
    middle = (points[:-1] + points[1:]) / 2
    turned = middle[:, ::-1] * [1.0, -1.0]  # from +y towards +x
    velocity = np.array(rate[:2]) + rate[2] * turned
    return MICRO * 0.5 * float(scene.antenna.segment_mass @ (velocity**2).sum(axis=1))


# Follow a wall: the body runs beside it and is asked how far away it is.

_STARTS = (9.0, 10.5, 12.0, 13.5, 15.0)  # [C] mm from the wall


# A straight wall, and walls with one turn to either side [C].
_COURSES = (
    Course(lengths=(400.0,), turns=()),
    *(Course(lengths=(80.0, 320.0), turns=(turn,)) for turn in (-30.0, -15.0, 15.0, 30.0)),
)


class FollowTask(ActiveTask):
    """Keep a distance from a wall on the right, and say what the distance is.

    A prediction is the distance [mm]; the loss is its squared error over the target's square, and
    the same is charged for the distance itself, so that a body which keeps the target and knows it
    loses nothing. A body that runs into the wall has come to its end.

    Attributes
    ----------
    distance : float
        To keep, from the antenna's base [mm], [C].
    courses : tuple[Course, ...]
        Walls of which an episode draws one.
    starts : tuple[float, ...]
        Distances at which an episode may begin [mm].
    """

    distance: Annotated[float, Gt(0), Unit("mm")] = 12.0
    courses: tuple[Course, ...] = _COURSES
    starts: tuple[float, ...] = _STARTS
    posture: Posture = FOLLOWING

    def _check(self) -> None:
        super()._check()
        require_plane(self.first_antenna, "following a wall")
        if not self.courses or not self.starts:
            raise InvalidInput(
                "there is no wall to follow: give at least one of courses= and one of starts=."
            )

    @cached_property
    def rests(self) -> Approach:
        """The antenna at rest beside the wall, at each distance at which an episode may begin, the
        farthest first.
        """
        return approach(
            self.first_antenna,
            self.posture.replace(side="right"),
            sorted(self.starts),
            substep=RUN_SUBSTEP,
        )

    def begin(self, rng: np.random.Generator) -> Start:
        """Draw a wall and a distance."""
        course = self.courses[int(rng.integers(len(self.courses)))]
        return self.make_start(course, int(rng.integers(len(self.rests.distance))))

    def make_start(self, course: Course, row: int) -> Start:
        """The beginning beside a wall, at distance number ``row``, the farthest first."""
        scene = make_course_scene(self.rests, row, course)
        distance = self.rests.distance[row]
        return Start(scene=scene, direction=(0.0, 1.0), target=distance, course=course)

    def measure(self, start: Start, base: np.ndarray) -> float:
        """Distance of the base from the wall [mm]."""
        assert start.course is not None
        return float(start.course.measure(base[None, :2])[0])

    def is_over(self, target: float) -> bool:
        """Whether the body has run into the wall."""
        return target <= BODY_LOST

    def compute_loss(self, prediction: np.ndarray, target: np.ndarray) -> np.ndarray:
        """Squared error (lane,) over the square of the distance to keep."""
        return (prediction[:, 0] - target) ** 2 / self.distance**2

    def compute_cost(self, target: np.ndarray) -> np.ndarray:
        """Tracking cost (lane,)."""
        return (target - self.distance) ** 2 / self.distance**2
