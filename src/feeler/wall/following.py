"""A body that follows a wall by where its antenna bends most."""

from dataclasses import dataclass
from typing import Annotated

import numpy as np

from feeler.antenna.antenna import Antenna
from feeler.checked import checked
from feeler.errors import InvalidInput, SimulationDiverged
from feeler.wall.course import Course, measure_distance
from feeler.wall.distance_map import DistanceMap, fit_distance
from feeler.wall.peak import SMOOTHING
from feeler.wall.posture import Posture
from feeler.wall.runner import BODY_LOST, run_loop
from feeler.wall.sweep import approach
from feeler.wall.table import make_half_plane, make_table

SOFT = 20.0  # [C] 1/mm²; contact in the loop, softer than at rest: nodes sink in by some 0.02 mm
SUBSTEP = 5.0  # [C] mm; the wall's steps to where a run starts; running forgets it within the settling time
GRID = 0.5  # mm; samples of the smoothed curvature in the loop
CALIBRATION = tuple(np.arange(6.0, 22.1, 1.0))  # [C] mm
SETTLING, LISTENING = 150.0, 50.0  # [C] ms of a calibration run before, and while, the peak is read

# [C] the posture in which bodies follow by default: of those tried, the one with a usable map
FOLLOWING = Posture(prebend="none", friction=0.0)


@dataclass(frozen=True, kw_only=True)
class Controller:
    """Proportional and derivative steering on the estimated distance, as turn rate = K_p e + K_d de/dt.

    On a straight wall the distance then obeys e'' + v K_d e' + v K_p e = 0, so the gains follow from a natural
    frequency and a damping ratio at any speed v (Cowan, Lee & Full 2006, J Exp Biol 209:1617, but with a delay).
    """

    target: float = 12.0
    """Distance to keep, from the antenna's base [mm], > 0 [C]."""
    frequency: float = 0.02
    """Natural angular frequency [rad/ms], > 0 [C]."""
    damping_ratio: float = 1.0
    """[1], ≥ 0 [C]."""
    delay: float = 10.0
    """From touch to turn [ms], ≥ 0 [C]."""
    max_turn: float = 0.03
    """Greatest turn rate [rad/ms], > 0; 0.03 is 1700 °/s [C]."""
    smoothing: float = 5.0
    """Time constant of the low-pass on the estimate [ms], > 0 [C]."""

    def __post_init__(self) -> None:
        for name in ("target", "frequency", "max_turn", "smoothing"):
            if not (np.isfinite(getattr(self, name)) and getattr(self, name) > 0):
                raise InvalidInput(f"Controller.{name} must be finite and > 0, got {getattr(self, name)}.")
        for name in ("damping_ratio", "delay"):
            if not (np.isfinite(getattr(self, name)) and getattr(self, name) >= 0):
                raise InvalidInput(f"Controller.{name} must be finite and ≥ 0, got {getattr(self, name)}.")


@dataclass(frozen=True, kw_only=True, eq=False)
class Run:
    """One run along a course."""

    time: np.ndarray
    """(sample,) [ms]"""
    body: np.ndarray
    """x, y [mm] and heading [rad] of the body (sample, 3), the antenna's base at x, y."""
    distance: np.ndarray
    """True distance from the wall (sample,) [mm]."""
    estimate: np.ndarray
    """Estimated distance (sample,) [mm], NaN without contact."""
    target: float
    collided: bool
    """Whether the body ran into the wall; the run ends there."""
    map: DistanceMap | None
    """The map in use; None for a body that is told the true distance."""

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
    distances: Annotated[np.ndarray, "distance"] = CALIBRATION,
    *,
    speed: float = 0.45,
) -> DistanceMap:
    """The map read while the body runs parallel to a straight wall at known distances.

    It differs from the quasi-static map by the wall's drag. Distances without contact, or with the peak at the base
    hinge, are not fitted.
    """
    posture = posture or FOLLOWING
    distances = np.sort(np.asarray(distances, dtype=float))[::-1]
    sweep = approach(antenna, posture.replace(side="right"), distances, substep=SUBSTEP)
    runs = [
        _drive(
            antenna, posture, make_half_plane(d, 0.0, (-1.0, 0.0)), (0.0, 0.0, 0.0), angle, speed, SETTLING + LISTENING
        )
        for d, angle in zip(sweep.distance, sweep.angle, strict=True)
    ]
    listened = [position[round(SETTLING) :] for _, _, position, _ in runs]
    position = np.array([np.median(p) if np.isfinite(p).all() else np.nan for p in listened])
    at_base = position < GRID / 2
    used = np.isfinite(position) & ~at_base
    return fit_distance(sweep.distance, position, used, at_base, float(antenna.segment_length.max()))


@checked
def follow(
    antenna: Antenna,
    course: Course | None = None,
    *,
    posture: Posture | None = None,
    controller: Controller | None = None,
    speed: float = 0.45,
    distance_map: DistanceMap | None = None,
    oracle: bool = False,
    timestep: float = 1.0,
) -> Run:
    """Run a body along a wall with turns, steering by the point of greatest curvature of its antenna.

    The body is a point with a heading that runs at constant ``speed``; its antenna moves by the implicit chain with
    inertia against the course's faces. Without contact there is no estimate, and the body steers as at the farthest
    calibrated distance.

    Parameters
    ----------
    speed
        [mm/ms]; cockroaches follow walls at 0.3 to 0.6.
    distance_map
        From :func:`calibrate`; made here if missing.
    oracle
        Steer by the true distance: what steering alone can reach.

    Returns
    -------
    Run

    Raises
    ------
    InvalidInput
        The map is undefined (the antenna's peak does not move with distance), so there is nothing to steer by.
    """
    posture, controller, course = posture or FOLLOWING, controller or Controller(), course or Course()
    if not (np.isfinite(speed) and speed > 0):
        raise InvalidInput(f"speed must be finite and > 0 mm/ms, got {speed}.")
    if not oracle:
        distance_map = distance_map or calibrate(antenna, posture, speed=speed)
        if distance_map.undefined:
            raise InvalidInput(
                f"the '{antenna.name}' antenna gives no map to steer by: {distance_map.undefined}. Use another antenna "
                "or posture, or oracle=True."
            )
    start = (-controller.target, 0.0, 0.0)
    angle = approach(antenna, posture.replace(side="right"), [controller.target], substep=SUBSTEP).angle[0]
    duration = (sum(course.lengths) - 20.0) / speed
    body, distance, _, estimate = _drive(
        antenna, posture, course.make_faces(), start, angle, speed, duration, controller, distance_map, oracle, timestep
    )
    return Run(
        time=timestep * np.arange(len(body)),
        body=body,
        distance=distance,
        estimate=estimate,
        target=controller.target,
        collided=bool(distance[-1] <= BODY_LOST),
        map=None if oracle else distance_map,
    )


def _drive(
    antenna,
    posture,
    faces,
    start,
    angle,
    speed,
    duration,
    controller=None,
    distance_map=None,
    oracle=False,
    timestep=1.0,
):
    """Body (sample, 3), true distance, peak position and estimate (sample,) of one run."""
    bent = posture.bend(antenna)
    place = np.arange(0.0, antenna.hinge_position[-1], GRID)
    weight = np.exp(-0.5 * ((place[:, None] - antenna.hinge_position) / SMOOTHING) ** 2)
    weight /= (weight @ antenna.segment_length)[:, None]
    c = controller or Controller()
    steer = np.array(
        [c.target, c.frequency**2 / speed, 2 * c.damping_ratio * c.frequency / speed, c.max_turn, c.smoothing]
    )
    line = np.array([0.0, 0.0, 0.0, 0.0])
    if distance_map is not None and not oracle:
        known = distance_map.distance[distance_map.used]
        line = np.array([distance_map.slope, distance_map.intercept, known.min(), known.max()])
    mode = 0 if controller is None else 2 if oracle else 1
    n_steps = max(1, round(duration / timestep))
    body, position, estimate, count = run_loop(
        make_table(bent, SOFT), faces, float(posture.friction), np.array(start, dtype=float), posture.base_angle, angle,
        speed, timestep, n_steps, place, weight, steer, round(c.delay / timestep), line, mode,
    )  # fmt: skip
    if count < 0:
        raise SimulationDiverged(f"{antenna.name} along a wall", -count * timestep)
    body = body[:count]
    return body, measure_distance(faces, body[:, :2]), position[:count], estimate[:count]
