"""A body that follows a wall of straight faces by where its antenna bends most."""

from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Annotated, Any, ClassVar

import numpy as np
import pandas as pd

from feeler.antenna.segments import Antenna
from feeler.errors import InvalidInput
from feeler.objects.bodies import Object
from feeler.objects.motion import BaseMotion
from feeler.objects.shapes import Feature
from feeler.physics.contact import get_contact
from feeler.physics.engine import DEFAULT_ENGINE, choose_timestep
from feeler.physics.scene import Scene
from feeler.physics.simulation import Simulations
from feeler.records import Ge, Gt, Lt, Record, Shown, Unit, freeze
from feeler.validation import checked
from feeler.wall.approach import (
    Approach,
    Posture,
    approach,
    find_parabolic_peak,
    make_kernel,
    make_wall_scene,
)
from feeler.wall.distance import DistanceMap, explain_bending, fit_distance

# Courses: a wall of straight faces with angled turns, on the right of a body that runs along
# it.

RUN_UP = 150.0  # [C] mm of straight wall before the first turn, about 12 wall distances
_MARGIN = 100.0  # mm; the first and the last face go on by this, or by 2/3 of a longer one
_THICK = 10.0  # mm; from a face to the back of its block
# mm; a block goes on by this behind the next face where the wall turns towards the body
_OVERLAP = 5.0
_ROUND = 150.0  # degrees; blocks that turn by more in all are divided, so that they stay convex


@dataclass(frozen=True, kw_only=True, eq=False)
class _Faces(Feature):
    """A wall's faces along a line of corners with blocks behind them, on the right of the line.

    Attributes
    ----------
    corners : np.ndarray
        (corner, 2) [mm] seen from above: the body looks along +y, so that the frame's first axis is
        −x.
    """

    corners: np.ndarray
    kind: ClassVar[str] = "course"
    rounding: ClassVar[float] = 0.0
    wide: ClassVar[bool] = True

    def __post_init__(self) -> None:
        object.__setattr__(self, "corners", freeze(np.array(self.corners, dtype=float)))
        super().__post_init__()

    def make_parts(self) -> list[np.ndarray]:
        """A block for each stretch that only turns away from the body."""
        along = np.diff(self.corners, axis=0)
        along /= np.hypot(along[:, 0], along[:, 1])[:, None]
        behind, turn = _THICK * along[:, ::-1] * [1.0, -1.0], _measure_turns(along)
        blocks, first = [], 0
        for last in range(len(along)):
            if last < len(turn) and turn[last] < 0 and turn[first : last + 1].sum() > -_ROUND:
                continue
            line = self.corners[first : last + 2].copy()
            line[0] -= (_OVERLAP if first and turn[first - 1] > 0 else 0.0) * along[first]
            line[-1] += (_OVERLAP if last < len(turn) and turn[last] > 0 else 0.0) * along[last]
            blocks.append(
                -np.concatenate([line, [line[-1] + behind[last], line[0] + behind[first]]])
            )
            first = last + 1
        return blocks


def _measure_turns(along: np.ndarray) -> np.ndarray:
    """Turns between unit vectors (face, 2) [degrees], positive to the left."""
    before, after = along[:-1], along[1:]
    sine = before[:, 0] * after[:, 1] - before[:, 1] * after[:, 0]
    return np.degrees(np.arctan2(sine, (before * after).sum(axis=1)))


class Course(Record):
    """A wall that starts along +y and turns; the free side is on the left of its direction.

    Attributes
    ----------
    lengths : tuple[Annotated[float, Gt(10), Unit(mm)], ...]
        Length of each face [mm], > 10.
    turns : tuple[Annotated[float, Gt(-80), Lt(80), Unit(degrees)], ...]
        Turn after each face but the last [degrees]: positive turns towards the body, negative away
        from it.

    Raises
    ------
    InvalidInput
        No face, a face that is too short for a corner, or a turn of 80 degrees and more.
    """

    lengths: tuple[Annotated[float, Gt(10), Unit("mm")], ...] = (RUN_UP, RUN_UP)
    turns: tuple[Annotated[float, Gt(-80), Lt(80), Unit("degrees")], ...] = (30.0,)

    def _check(self) -> None:
        if len(self.lengths) < 1 or len(self.turns) != len(self.lengths) - 1:
            raise InvalidInput(
                f"a Course needs one turn fewer than it has faces, got {len(self.lengths)} lengths"
                f" and {len(self.turns)} turns."
            )

    @property
    def corners(self) -> np.ndarray:
        """Points (face + 1, 2) [mm] from the start of the wall to its end."""
        heading = -np.radians(np.concatenate(([0.0], np.cumsum(self.turns))))
        along = np.stack([np.sin(heading), np.cos(heading)], axis=1)
        steps = np.array(self.lengths)[:, None] * along
        return np.concatenate([np.zeros((1, 2)), np.cumsum(steps, axis=0)])

    @cached_property
    def line(self) -> np.ndarray:
        """The corners with the first and the last face prolonged (face + 1, 2) [mm], read-only."""
        line = self.corners
        line[0], line[-1] = _prolong(line[1], line[0]), _prolong(line[-2], line[-1])
        return freeze(line)

    def make_object(self, friction: float = 0.0) -> Object:
        """The wall as an object of a scene."""
        faces = _Faces(corners=self.line)
        front = max(block[:, 0].max() for block in faces.make_parts())
        return Object(
            feature=faces, place=(-front, 0.0), forward=(-1.0, 0.0), friction=friction
        )

    def measure(self, points: np.ndarray) -> np.ndarray:
        """Distance [mm] of points (point, 2) from the nearest face (point,), negative behind it."""
        start, along = self.line[:-1], np.diff(self.line, axis=0)
        length = np.hypot(along[:, 0], along[:, 1])
        along /= length[:, None]
        offset = np.asarray(points, dtype=float)[:, None, :] - start
        place = np.clip((offset * along).sum(axis=2), 0.0, length)
        foot = offset - place[..., None] * along
        far = np.hypot(foot[..., 0], foot[..., 1])
        row, best = np.arange(len(far)), far.argmin(axis=1)
        left = offset[row, best, 1] * along[best, 0] - offset[row, best, 0] * along[best, 1]
        return np.where(left < 0, -1.0, 1.0) * far[row, best]


def _prolong(start: np.ndarray, end: np.ndarray) -> np.ndarray:
    length = np.hypot(*(end - start))
    return end + max(_MARGIN, 2 / 3 * length) * (end - start) / length


@checked
def make_turn(angle: float, lengths: Sequence[float] = (RUN_UP, RUN_UP)) -> Course:
    """A wall with one turn of ``angle`` degrees, positive towards the body."""
    return Course(lengths=tuple(lengths), turns=(float(angle),))


# A body that follows a wall by where its antenna bends most.

# [C] ms; how often a body feels and steers, or once per timestep where that is longer
_PERIOD = 1.0
_SPEED = 0.45  # [C] mm/ms
_LENGTH = 42.0  # [D] mm; the flagellum to which speed, course, target and distances were chosen
Watch = Callable[[np.ndarray, np.ndarray], None]
"""Called after each period with the body (3,) and the antenna's hinge angles (segment,); what it
raises ends the run.
"""
# [C] mm; a body nearer than this has run into the wall; less in proportion to a shorter antenna
BODY_LOST = 1.0
# [C] mm; the wall's steps to where a run starts; running forgets it within the settling time
RUN_SUBSTEP = 5.0
_GRID = 0.5  # mm; samples of the smoothed curvature in the loop
CALIBRATION = tuple(np.arange(6.0, 22.1, 1.0))  # [C] mm
SETTLING, LISTENING = (
    150.0,
    50.0,
)  # [C] ms of a calibration run before, and while, the peak is read

# [C] the posture in which bodies follow by default: of those tried, the one with a usable map
FOLLOWING = Posture(prebend="none", friction=0.0)


class Controller(Record):
    """Proportional and derivative steering on the estimated distance, as turn rate = K_p e + K_d
    de/dt.

    On a straight wall the distance then obeys e'' + v K_d e' + v K_p e = 0, so the gains follow
    from a natural frequency and a damping ratio at any speed v (Cowan, Lee & Full 2006, J Exp Biol
    209:1617, but with a delay).

    Attributes
    ----------
    target : float
        Distance to keep, from the antenna's base [mm], > 0 [C].
    frequency : float
        Natural angular frequency [rad/ms], > 0 [C].
    damping_ratio : float
        [1], ≥ 0 [C].
    delay : float
        From touch to turn [ms], ≥ 0 [C].
    max_turn : float
        Greatest turn rate [rad/ms], > 0; 0.03 is 1700 °/s [C].
    smoothing : float
        Time constant of the low-pass on the estimate [ms], > 0 [C].
    """

    target: Annotated[float, Gt(0), Unit("mm")] = 12.0
    frequency: Annotated[float, Gt(0), Unit("rad/ms")] = 0.02
    damping_ratio: Annotated[float, Ge(0)] = 1.0
    delay: Annotated[float, Ge(0), Unit("ms")] = 10.0
    max_turn: Annotated[float, Gt(0), Unit("rad/ms")] = 0.03
    smoothing: Annotated[float, Gt(0), Unit("ms")] = 5.0

    @classmethod
    def for_antenna(cls, antenna: Antenna, **fields: Any) -> "Controller":
        """The defaults with the target at the same share of the antenna's length, 12 of 42 mm."""
        return cls(**{"target": 12.0 * measure_scale(antenna)} | fields)

    def begin(
        self, speed: float, period: float, first: float | None = None
    ) -> Callable[[float], float]:
        """A controller at work: from each distance seen [mm], one ``period`` [ms] after the other,
        to the turn rate [rad/ms] of the period that follows, at a ``speed`` [mm/ms]. Its low-pass
        begins at ``first`` [mm], by default the target.
        """
        gain, damp = self.frequency**2 / speed, 2 * self.damping_ratio * self.frequency / speed
        waiting = deque([0.0] * round(self.delay / period))
        share = period / (self.smoothing + period)
        filtered = self.target if first is None else first

        def steer(seen: float) -> float:
            nonlocal filtered
            change = share * (seen - filtered)
            filtered += change
            turn = gain * (filtered - self.target) + damp * change / period
            waiting.append(min(max(turn, -self.max_turn), self.max_turn))
            return waiting.popleft()

        return steer


@dataclass(frozen=True, kw_only=True, eq=False)
class Run(Shown):
    """One run along a course.

    Attributes
    ----------
    time : np.ndarray
        (sample,) [ms]
    body : np.ndarray
        x, y [mm] and heading [rad] of the body (sample, 3), the antenna's base at x, y.
    distance : np.ndarray
        True distance from the wall (sample,) [mm].
    estimate : np.ndarray
        Estimated distance (sample,) [mm], NaN without contact.
    collided : bool
        Whether the body ran into the wall; the run ends there.
    map : DistanceMap | None
        The map in use; None for a body that is told the true distance.
    antenna : Antenna | None
        The antenna with its slack shape.
    angle : np.ndarray | None
        Hinge angles (sample, segment) [rad].
    course : Course | None
        The wall.
    settings : dict
        What was chosen: speed [mm/ms], engine, timestep [ms], posture, controller; and the greatest
        ``penetration`` of a contact [mm].
    """

    time: np.ndarray
    body: np.ndarray
    distance: np.ndarray
    estimate: np.ndarray
    target: float
    collided: bool
    map: DistanceMap | None
    antenna: Antenna | None = None
    angle: np.ndarray | None = None
    course: Course | None = None
    settings: dict[str, Any] = field(default_factory=dict)

    @property
    def error(self) -> float:
        """Tracking error: root mean square of true distance − target [mm]."""
        return float(np.sqrt(np.mean((self.distance - self.target) ** 2)))

    @property
    def estimate_error(self) -> float:
        """Root mean square of estimate − true distance while touching [mm]; NaN if never."""
        gap = (self.estimate - self.distance)[np.isfinite(self.estimate)]
        return float(np.sqrt(np.mean(gap**2))) if gap.size else np.nan

    @property
    def nearest(self) -> float:
        """Least true distance [mm]."""
        return float(self.distance.min())

    @property
    def touching(self) -> float:
        """Share of the samples with contact; NaN for a body that is told the distance."""
        return float("nan" if self.map is None else np.isfinite(self.estimate[1:]).mean())

    @property
    def posture(self) -> Posture:
        """How the antenna is held."""
        return Posture.from_plain(self.settings["posture"])

    def to_frame(self) -> pd.DataFrame:
        """A row per sample: time, the body's place and heading, true and estimated distance."""
        x, y, heading = self.body.T
        return pd.DataFrame(
            {
                "time_ms": self.time,
                "x_mm": x,
                "y_mm": y,
                "heading_deg": np.degrees(heading),
                "distance_mm": self.distance,
                "estimate_mm": self.estimate,
            }
        )


@checked
def calibrate(
    antenna: Antenna,
    posture: Posture | None = None,
    distances: Sequence[float] | np.ndarray | None = None,
    *,
    speed: float | None = None,
    engine: str = DEFAULT_ENGINE,
    timestep: float | None = None,
    watch: Watch | None = None,
) -> DistanceMap:
    """The map read while the body runs parallel to a straight wall at known distances, by default
    6 to 22 mm for an antenna of 42 mm, and in proportion for others.

    It differs from the quasi-static map by the wall's drag. Distances without contact, or with the
    peak at the base hinge, are not fitted. ``speed``, ``engine`` and ``timestep`` as for
    :func:`follow`.
    """
    posture = (posture or FOLLOWING).replace(side="right")
    if distances is None:
        distances = measure_scale(antenna) * np.array(CALIBRATION)
    speed = _choose_speed(antenna) if speed is None else speed
    timestep = _choose_timestep(antenna, speed, engine, timestep)
    distances = np.sort(np.atleast_1d(np.asarray(distances, dtype=float)))[::-1]
    sweep = approach(antenna, posture, distances, substep=RUN_SUBSTEP)
    listened = []
    for distance, angle in zip(sweep.distance, sweep.angle, strict=True):
        runner = _Runner(
            make_wall_scene(sweep.antenna, posture, distance, angle=angle),
            speed,
            engine,
            timestep,
            watch,
        )
        peaks = []
        while runner.time < SETTLING + LISTENING:
            runner.go(0.0)
            peaks.append(runner.feel())
        listened.append(peaks[round(SETTLING / runner.period) - 1 :])
    position = np.array([np.median(p) if np.isfinite(p).all() else np.nan for p in listened])
    at_base = position < _GRID / 2
    used = np.isfinite(position) & ~at_base
    found = fit_distance(
        sweep.distance, position, used, at_base, float(antenna.segment_length.max())
    )
    return replace(found, bending=explain_bending(antenna))


def measure_scale(antenna: Antenna) -> float:
    """How many times as long as a cockroach's 42 mm an antenna is, to three digits."""
    return float(f"{antenna.length / _LENGTH:.3g}")


def _choose_speed(antenna: Antenna) -> float:
    """The default speed [mm/ms]: 0.45, or less for an antenna shorter than the cockroach's, which
    then runs past as many of its lengths in a second.
    """
    return _SPEED * min(1.0, measure_scale(antenna))


def _choose_timestep(
    antenna: Antenna, speed: float, engine: str, timestep: float | None
) -> float:
    """The timestep [ms]; by default the longest part of 1 ms that contact and base allow."""
    if timestep is not None:
        return timestep
    usual = choose_timestep(None, engine, get_contact(None, antenna))
    return _PERIOD / np.ceil(_PERIOD / min(usual, float(antenna.radius.min()) / speed) - 1e-9)


@checked
def follow(
    antenna: Antenna,
    course: Course | None = None,
    *,
    posture: Posture | None = None,
    controller: Controller | None = None,
    speed: Annotated[float, Gt(0)] | None = None,
    start: Annotated[float, Gt(0)] | None = None,
    distance_map: DistanceMap | None = None,
    oracle: bool = False,
    engine: str = DEFAULT_ENGINE,
    timestep: float | None = None,
    watch: Watch | None = None,
) -> Run:
    """Run a body along a wall with turns, steering by the point of greatest curvature of its
    antenna.

    The body is a point with a heading that runs at constant ``speed`` and steers once per
    millisecond; its antenna is simulated against the course's wall. Without contact there is no
    estimate, and the body steers as at the farthest calibrated distance.

    Parameters
    ----------
    course, controller
        By default a turn of 30° after 150 mm, and 12 mm to keep, for an antenna of 42 mm; for
        others in proportion to their length.
    speed
        [mm/ms]; cockroaches follow walls at 0.3 to 0.6. By default 0.45, and less in proportion for
        an antenna shorter than 42 mm.
    start
        Distance at which it begins, running along the wall [mm]; default: the controller's target.
    distance_map
        From :func:`calibrate`; made here if missing.
    oracle
        Steer by the true distance: what steering alone can reach.
    engine, timestep
        As for :func:`feeler.touch`; by default the longest timestep that divides 1 ms and follows
        the base.
    watch
        Called after each period, with the body (3,) and the hinge angles (segment,).

    Returns
    -------
    Run

    Raises
    ------
    InvalidInput
        The target or the start lies beyond the antenna's length, or the map is undefined (the
        antenna's peak does not move with distance), so that there is nothing to steer by; the
        message says why.
    """
    posture = (posture or FOLLOWING).replace(side="right")
    controller = controller or Controller.for_antenna(antenna)
    course = course or make_turn(30.0, [RUN_UP * measure_scale(antenna)] * 2)
    speed = _choose_speed(antenna) if speed is None else speed
    start = controller.target if start is None else start
    if not 0 < max(controller.target, start) <= antenna.length:
        raise InvalidInput(
            f"the wall must be within the antenna's reach of {antenna.length:g} mm: the target is"
            f" {controller.target:g} mm, the start {start:g} mm. Give a nearer target=."
        )
    if not oracle:
        distance_map = distance_map or calibrate(
            antenna, posture, speed=speed, engine=engine, timestep=timestep
        )
        if distance_map.undefined:
            raise InvalidInput(
                f"the '{antenna.name}' antenna gives no map to steer by: {distance_map.undefined}."
                f" It {distance_map.bending or explain_bending(antenna)}. Use another antenna, or"
                " oracle=True."
            )
    sweep = approach(antenna, posture, [start], substep=RUN_SUBSTEP)
    timestep = _choose_timestep(antenna, speed, engine, timestep)
    runner = _Runner(make_course_scene(sweep, 0, course), speed, engine, timestep, watch)
    run = _run(runner, course, controller, None if oracle else distance_map)
    chosen = {"posture": posture.to_plain(), "controller": controller.to_plain()}
    sunk = float(runner.simulation.state.sink[0] * antenna.radius.min())
    settings = {"speed": speed, "engine": engine, "timestep": timestep, "penetration": sunk}
    settings |= chosen
    return replace(run, antenna=sweep.antenna, course=course, settings=settings)


def make_course_scene(sweep: Approach, row: int, course: Course) -> Scene:
    """An antenna at rest beside the first face of a course, as far away as in a row of a sweep."""
    posture = sweep.posture
    return Scene(
        antenna=sweep.antenna,
        objects=(course.make_object(posture.friction),),
        base=(-sweep.distance[row], 0.0, posture.base_angle),
        angle=sweep.angle[row],
        contact=get_contact(None, sweep.antenna),
        label=f"{sweep.antenna.name} along a wall",
    )


def _run(
    runner: "_Runner", course: Course, controller: Controller, known: DistanceMap | None
) -> Run:
    steer, turn = controller.begin(runner.speed, runner.period, -runner.body[0]), 0.0
    used = np.zeros(1) if known is None else known.distance[known.used]
    near, far = used.min(), used.max()
    body, estimate, angle = [runner.body], [np.nan], [runner.angle]
    distance = [course.measure(runner.body[None, :2])[0]]
    whole = sum(course.lengths)
    size = min(1.0, measure_scale(runner.antenna))
    left = max(20.0 * size, whole / 15)  # [C] mm of wall ahead of the end
    n_periods = max(1, round((whole - left) / runner.speed / runner.period))
    while len(body) <= n_periods and (len(body) == 1 or distance[-1] > BODY_LOST * size):
        runner.go(turn)
        body.append(runner.body)
        angle.append(runner.angle)
        distance.append(course.measure(runner.body[None, :2])[0])
        seen = float(
            distance[-1] if known is None else np.clip(known.predict(runner.feel()), near, far)
        )
        estimate.append(np.nan if known is None else seen)
        turn = steer(far if np.isnan(seen) else seen)
    return Run(
        time=runner.period * np.arange(len(body)),
        body=np.array(body),
        distance=np.array(distance),
        estimate=np.array(estimate),
        target=controller.target,
        collided=bool(distance[-1] <= BODY_LOST * size),
        map=known,
        angle=np.array(angle),
    )


class _Runner:
    """A body with an antenna, that runs at constant speed."""

    def __init__(
        self,
        scene: Scene,
        speed: float,
        engine: str,
        timestep: float | None,
        watch: Watch | None = None,
    ) -> None:
        scene = replace(scene, base_motion=BaseMotion(velocity=(0.0, speed)))
        self.simulation = Simulations(
            [scene], engine=engine, timestep=choose_timestep(timestep, engine, scene.contact)
        )
        self._watch = watch
        self.period, self.speed = max(_PERIOD, self.simulation.timestep), speed
        self.antenna, self._base_angle = scene.antenna, scene.base[2]
        self._place = np.arange(0.0, self.antenna.hinge_position[-1], _GRID)
        self._kernel = make_kernel(self.antenna, self._place)

    @property
    def time(self) -> float:
        """[ms]"""
        return float(self.simulation.time[0])

    @property
    def body(self) -> np.ndarray:
        """x, y [mm] and heading [rad] (3,)."""
        return self.simulation.state.base[0] - [0.0, 0.0, self._base_angle]

    @property
    def angle(self) -> np.ndarray:
        """Hinge angles (segment,) [rad]."""
        return self.simulation.state.angle[0].copy()

    def go(self, turn: float) -> None:
        """Run on for one period with a turn rate [rad/ms], straight ahead as it looks in the middle
        of it.
        """
        middle = self.body[2] + 0.5 * self.period * turn
        self.simulation.move_base(
            0, (self.speed * np.sin(middle), self.speed * np.cos(middle)), turn
        )
        self.simulation.step(self.period)
        if self.simulation.failed[0] is not None:
            raise self.simulation.failed[0]
        if self._watch is not None:
            self._watch(self.body, self.simulation.state.angle[0])

    def feel(self) -> float:
        """Arc length of the greatest smoothed bend beyond the slack shape [mm]; NaN without
        contact.
        """
        state = self.simulation.state
        if np.isnan(state.contact_place[0]):
            return np.nan
        bend = self._kernel @ (state.angle[0] - self.antenna.rest_angle)
        return float(find_parabolic_peak(np.abs(bend)[None], self._place)[0])
