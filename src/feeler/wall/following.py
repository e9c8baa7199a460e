"""A body that follows a wall by where its antenna bends most."""

from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Annotated

import numpy as np

from feeler.antenna.antenna import Antenna
from feeler.errors import InvalidInput
from feeler.physics.contact import get_contact
from feeler.physics.engine import choose_timestep
from feeler.physics.lanes import Simulations
from feeler.physics.scene import Scene
from feeler.records.checked import checked
from feeler.records.record import Ge, Gt, Record, Unit
from feeler.stimulus.base import BaseMotion
from feeler.wall.course import Course
from feeler.wall.distance_map import DistanceMap, fit_distance
from feeler.wall.peak import make_kernel, place_top
from feeler.wall.posture import Posture
from feeler.wall.sweep import Approach, approach, make_wall_scene

_ENGINE = "rod-inertia"
_PERIOD = (
    1.0  # [C] ms; how often a body feels and steers, or once per timestep where that is longer
)
Watch = Callable[[np.ndarray, np.ndarray], None]
"""Called after each period with the body (3,) and the antenna's hinge angles (segment,); what it
raises ends the run.
"""
BODY_LOST = 1.0  # [C] mm; a body nearer than this has run into the wall
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
class Run:
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
    """

    time: np.ndarray
    body: np.ndarray
    distance: np.ndarray
    estimate: np.ndarray
    target: float
    collided: bool
    map: DistanceMap | None

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


@checked
def calibrate(
    antenna: Antenna,
    posture: Posture | None = None,
    distances: Sequence[float] | np.ndarray = CALIBRATION,
    *,
    speed: float = 0.45,
    engine: str = _ENGINE,
    timestep: float | None = None,
    watch: Watch | None = None,
) -> DistanceMap:
    """The map read while the body runs parallel to a straight wall at known distances.

    It differs from the quasi-static map by the wall's drag. Distances without contact, or with the
    peak at the base hinge, are not fitted.
    """
    posture = (posture or FOLLOWING).replace(side="right")
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
    return fit_distance(
        sweep.distance, position, used, at_base, float(antenna.segment_length.max())
    )


@checked
def follow(
    antenna: Antenna,
    course: Course | None = None,
    *,
    posture: Posture | None = None,
    controller: Controller | None = None,
    speed: Annotated[float, "> 0"] = 0.45,
    start: Annotated[float, "> 0"] | None = None,
    distance_map: DistanceMap | None = None,
    oracle: bool = False,
    engine: str = _ENGINE,
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
    speed
        [mm/ms]; cockroaches follow walls at 0.3 to 0.6.
    start
        Distance at which it begins, running along the wall [mm]; default: the controller's target.
    distance_map
        From :func:`calibrate`; made here if missing.
    oracle
        Steer by the true distance: what steering alone can reach.
    engine, timestep
        As for :func:`feeler.touch`; by default the rod with inertia, whose implicit steps may be 1
        ms long.
    watch
        Called after each period, with the body (3,) and the hinge angles (segment,).

    Returns
    -------
    Run

    Raises
    ------
    InvalidInput
        The target or the start lies beyond the antenna's length, or the map is undefined (the
        antenna's peak does not move with distance), so that there is nothing to steer by.
    """
    posture = (posture or FOLLOWING).replace(side="right")
    controller, course = controller or Controller(), course or Course()
    start = controller.target if start is None else start
    if not 0 < max(controller.target, start) <= antenna.length:
        raise InvalidInput(
            f"the wall must be within the antenna's reach of {antenna.length:g} mm: the target is"
            f" {controller.target:g} mm, the start {start:g} mm."
        )
    if not oracle:
        distance_map = distance_map or calibrate(
            antenna, posture, speed=speed, engine=engine, timestep=timestep
        )
        if distance_map.undefined:
            raise InvalidInput(
                f"the '{antenna.name}' antenna gives no map to steer by: {distance_map.undefined}."
                " Use another antenna or posture, or oracle=True."
            )
    sweep = approach(antenna, posture, [start], substep=RUN_SUBSTEP)
    runner = _Runner(make_course_scene(sweep, 0, course), speed, engine, timestep, watch)
    return _run(runner, course, controller, None if oracle else distance_map)


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
    body, estimate = [runner.body], [np.nan]
    distance = [course.measure(runner.body[None, :2])[0]]
    n_periods = max(1, round((sum(course.lengths) - 20.0) / runner.speed / runner.period))
    while len(body) <= n_periods and (len(body) == 1 or distance[-1] > BODY_LOST):
        runner.go(turn)
        body.append(runner.body)
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
        collided=bool(distance[-1] <= BODY_LOST),
        map=known,
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
        return float(place_top(np.abs(bend)[None], self._place)[0])
