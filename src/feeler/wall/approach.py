"""A wall that comes nearer to an antenna held at its base: postures, equilibria, and where it
bends most.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, Any, Literal

import numpy as np
import xarray as xr

from feeler.antenna.segments import Antenna
from feeler.errors import InvalidInput
from feeler.execute import Executor
from feeler.objects.bodies import Object, Wall
from feeler.physics.contact import get_contact
from feeler.physics.engine import DEFAULT_ENGINE, choose_timestep
from feeler.physics.equilibrium import Equilibrium, Rest
from feeler.physics.run import Result, expect_motions, simulate
from feeler.physics.scene import Clock, Motion, Scene
from feeler.records import Choice, Ge, Gt, Le, Record, Shown, Unit
from feeler.tensors.schema import make_motion_tensors
from feeler.validation import checked

# How an antenna meets a wall: angle, pre-bend, friction and side, each an unstated choice with
# its reason.


class Posture(Record):
    """An antenna held at its base, bent into an inverted J (tip pointing backward), beside a wall
    parallel to the body.

    The body looks along +y, the antenna's base is the origin, the wall's face is the line x =
    distance (right side) or x = −distance (left). The defaults were fixed before any R² was
    computed; docs/guide/wall.md gives the reasons.

    Attributes
    ----------
    inter_antennal_angle : float
        [P] about 30 degrees, in (0, 90].
    reading : Literal[midline, total]
        ``midline``: each antenna is that far from the midline [B: Camhi & Johnson 1999]; ``total``:
        half of it each.
    prebend : Literal[rest, placed, rotation, none]
        ``rest``: the J is the antenna's slack shape; ``placed``: a straight antenna laid in a J and
        released; ``rotation``: a straight antenna that points backward is turned forward along the
        wall by its base; ``none``: no J, a straight antenna whose tip bends forward along the wall
        [C].
    hook_share : float
        Share of the length that the slack hook takes, in (0, 1], of constant curvature; the rest is
        straight [C].
    tip_heading : float
        Heading of the slack tip [degrees], above 90; 180 is straight backward, and the most. A
        choice [C].
    fold_radius : float
        Radius [mm] of the fold in which a ``placed`` antenna is laid, > 0 [C].
    friction : float
        Coefficient of friction of the wall, ≥ 0 [C].
    side : Literal[left, right]
        Side of the body on which wall and antenna are: ``right`` or its mirror image ``left``.
    """

    inter_antennal_angle: Annotated[float, Gt(0), Le(90), Unit("degrees")] = 30.0
    reading: Literal["midline", "total"] = "midline"
    prebend: Literal["rest", "placed", "rotation", "none"] = "rest"
    hook_share: Annotated[float, Gt(0), Le(1)] = 0.25
    tip_heading: Annotated[float, Gt(90), Le(180), Unit("degrees")] = 180.0
    fold_radius: Annotated[float, Gt(0), Unit("mm")] = 2.0
    friction: Annotated[float, Ge(0)] = 0.3
    side: Literal["left", "right"] = "right"

    @property
    def base_angle(self) -> float:
        """Heading of the antenna's base from the midline, towards the wall [rad]."""
        angle = float(np.radians(self.inter_antennal_angle))
        return angle / 2 if self.reading == "total" else angle

    @property
    def sign(self) -> float:
        """+1 on the right, −1 on the left."""
        return 1.0 if self.side == "right" else -1.0

    def bend(self, antenna: Antenna) -> Antenna:
        """The antenna with the slack shape of this posture, as seen on the right side.

        With ``rest``, hook angles are added to whatever rest angles the antenna has: the hook has
        constant curvature.
        """
        if self.prebend != "rest":
            return antenna
        length = antenna.segment_length
        share = np.where(
            antenna.hinge_position >= (1 - self.hook_share) * antenna.length, length, 0.0
        )
        if not share.any():
            share[-1] = 1.0  # a hook shorter than the last segment sits in its hinge
        turn = np.radians(self.tip_heading) - self.base_angle
        return antenna.replace(rest_angle=antenna.rest_angle + turn * share / share.sum())

    def reach(self, antenna: Antenna) -> float:
        """Greatest distance [mm] at which the antenna, slack and bent as it is, touches the
        wall.
        """
        return _measure_reach(self.bend(antenna), self.base_angle)

    def lay(self, antenna: Antenna, distance: float) -> np.ndarray:
        """Headings (segment,) of a fold: straight to the wall, an arc of ``fold_radius``, straight
        back along it.
        """
        base, fold = self.base_angle, self.fold_radius
        near = distance - float(antenna.radius.max()) - fold * (1 + np.cos(base))
        start = max(near, 0.0) / np.sin(base)
        middle = antenna.hinge_position + antenna.segment_length / 2
        return base + np.clip((middle - start) / fold, 0.0, np.pi - base)


NEAREST = Posture(inter_antennal_angle=35.0, hook_share=1.0, tip_heading=150.0)
"""Of the 324 configurations declared before they were run, the one whose R² come nearest to all
three of the paper's; the paper does not say which it used.
"""


def _measure_reach(antenna: Antenna, base_angle: float) -> float:
    """How far [mm] the surface of an antenna in its slack shape extends to the right of its
    base.
    """
    # a node is as thick as the thicker of its two segments
    thick = np.maximum(np.append(antenna.radius, 0.0), np.append(0.0, antenna.radius))
    return float(np.max(antenna.shape(base_angle=base_angle)[:, 0] + thick))


# A wall that comes nearer in small steps to an antenna held at its base: the equilibrium at
# each distance.

DISTANCES = tuple(np.linspace(25.0, 5.0, 20))  # [C] mm, far to near; the paper states none
_SUBSTEP = 0.5  # mm; the wall moves in steps no longer than this between two equilibria
# mm; how much nearer than its reach the wall stands to a straight antenna that is laid in a J
_TUCK = 1.0
_ROTATION_STEPS = 60  # from backward to the base angle, prebend "rotation"


@checked
@dataclass(frozen=True, kw_only=True, eq=False)
class Approach(Shown):
    """Equilibria of one antenna at several distances, farthest first.

    Attributes
    ----------
    antenna : Antenna
        The antenna with its slack shape (mirrored on the left side).
    distance : np.ndarray
        Distance (step,) of the wall from the antenna's base [mm].
    angle : np.ndarray
        Hinge angles (step, segment) [rad].
    contact : np.ndarray
        Whether (step,) the antenna touches the wall.
    inverted : np.ndarray
        Whether (step,) it is an inverted J: in contact, base forward, tip backward (heading from
        90° to 270°).
    balanced : np.ndarray
        Whether (step,) the relaxation ended in an equilibrium.
    contact_position : np.ndarray
        Arc length (step,) from the base of the wall's push [mm], the mean over its points weighted
        by their normal force; NaN without contact.
    """

    antenna: Antenna
    posture: Posture
    distance: Annotated[np.ndarray, "step"]
    angle: Annotated[np.ndarray, "step segment"]
    contact: Annotated[np.ndarray, "step"]
    inverted: Annotated[np.ndarray, "step"]
    balanced: Annotated[np.ndarray, "step"]
    contact_position: Annotated[np.ndarray, "step"]

    def __post_init__(self) -> None:
        n_segments = self.antenna.n_segments
        if np.shape(self.angle)[1] != n_segments:
            raise InvalidInput(
                f"Approach.angle must have {n_segments} segments, as its antenna, got an array of"
                f" shape {np.shape(self.angle)}."
            )

    @property
    def points(self) -> np.ndarray:
        """Base, hinges and tip (step, segment + 1, 2) [mm]."""
        return self.antenna.shape(
            self.angle, base_angle=self.posture.sign * self.posture.base_angle
        )

    @property
    def bend(self) -> np.ndarray:
        """Hinge angles beyond the slack shape (step, segment) [rad]: what a strain sensor feels."""
        return self.angle - self.antenna.rest_angle


def make_wall_scene(
    antenna: Antenna,
    posture: Posture,
    distance: float,
    *,
    velocity: tuple[float, float] = (0.0, 0.0),
    **fields: object,
) -> Scene:
    """A wall at a distance [mm] from a held antenna's base, on the posture's side; ``fields`` are
    the Scene's.
    """
    sign = posture.sign
    wall = Object(
        feature=Wall(),
        place=(sign * float(distance), 0.0),
        forward=(-sign, 0.0),
        velocity=velocity,
        friction=posture.friction,
    )
    base: dict[str, Any] = {
        "base": (0.0, 0.0, sign * posture.base_angle),
        "label": f"wall at {distance:g} mm",
        "contact": get_contact(None, antenna),
    }
    return Scene(antenna=antenna, objects=(wall,), **base | fields)


@checked
def approach(
    antenna: Antenna,
    posture: Posture | None = None,
    distances: Sequence[float] | np.ndarray = DISTANCES,
    *,
    substep: Annotated[float, Gt(0)] = _SUBSTEP,
) -> Approach:
    """Let a wall approach a held, pre-bent antenna step by step and record each equilibrium (Fig.
    3A, B).

    Each equilibrium is the minimum of Σ ½ k_i (θ_i − rest_i)² with all nodes in front of the wall,
    reached from the one before along the antenna's own damping; with friction, a node slips where
    its tangential force exceeds friction · normal force.

    Parameters
    ----------
    antenna
        Any antenna.
    posture
        Angle, pre-bend, friction and side.
    distances
        Distances of the wall from the antenna's base (step,) [mm], > 0; visited from far to near.
    substep
        The wall moves in steps no longer than this [mm] between two equilibria. With friction the
        answer depends on it.

    Returns
    -------
    Approach
        Farthest first. Where the antenna does not reach the wall, ``contact`` is False and nothing
        is bent.

    Raises
    ------
    InvalidInput
        No distance, a wall behind the body (distance ≤ 0), or a pre-bend that starts inside the
        wall.
    """
    posture = posture or Posture()
    distance = _check_distances(distances, antenna)
    bent = posture.bend(antenna)
    standing, wall = _begin(bent, posture, distance[0])
    steps, rests, places = [], [], []
    for goal in distance:
        rests.append(Rest(0.0, 0) if goal > wall else _bring(standing, wall, goal, substep))
        steps.append(bent.rest_angle if goal > wall else standing.angle)
        places.append(np.nan if goal > wall else standing.contact_place)
        wall = min(wall, goal)
    angle, contact = np.array(steps), np.array([rest.n_contacts > 0 for rest in rests])
    tip = posture.base_angle + angle.sum(axis=1)
    inverted = contact & (np.cos(tip) < 0) & (tip > np.pi / 2) & (tip < 3 * np.pi / 2)
    sign = posture.sign
    return Approach(
        antenna=bent if sign > 0 else bent.replace(rest_angle=-bent.rest_angle),
        posture=posture,
        distance=distance,
        angle=sign * angle,
        contact=contact,
        inverted=inverted,
        balanced=np.array([rest.balanced for rest in rests]),
        contact_position=antenna.length * np.array(places),
    )


def _check_distances(distances: Sequence[float] | np.ndarray, antenna: Antenna) -> np.ndarray:
    values = np.atleast_1d(np.asarray(distances, dtype=float))
    if values.size == 0 or values.ndim != 1:
        raise InvalidInput(
            f"distances must be a list of at least one distance [mm], got shape {values.shape}."
        )
    if not np.all(np.isfinite(values)) or values.min() <= 0:
        bad = values[~(values > 0) | ~np.isfinite(values)][0]
        raise InvalidInput(
            f"every distance must be finite and > 0 mm: a wall at {bad:g} mm is behind the body."
            " Leave it out."
        )
    if values.min() <= antenna.radius[0]:
        raise InvalidInput(
            f"the pre-bend starts inside the wall: at {values.min():g} mm the wall cuts the"
            f" antenna's base, whose radius is {antenna.radius[0]:g} mm. Use larger distances."
        )
    return np.unique(values)[::-1]


def _bring(standing: Equilibrium, distance: float, goal: float, substep: float) -> Rest:
    """Move the wall from ``distance`` to ``goal`` and relax at every step; how the last one
    ended.
    """
    walls = np.linspace(distance, goal, 1 + int(np.ceil((distance - goal) / substep - 1e-9)))
    return [standing.settle(wall) for wall in (walls[1:] if len(walls) > 1 else walls)][-1]


def _begin(antenna: Antenna, posture: Posture, first: float) -> tuple[Equilibrium, float]:
    """The pre-bend, and the distance at which the wall then stands; on the right side."""
    base = posture.base_angle
    reach = _measure_reach(antenna, base)
    if posture.prebend in ("rest", "none"):
        return Equilibrium(antenna, posture.friction, base), max(first, reach)
    wall = min(first, reach - _TUCK)
    room = float(antenna.radius.max()) + posture.fold_radius * (1 + np.cos(base))
    if wall < room:
        raise InvalidInput(
            f"the pre-bend starts inside the wall: it needs {room:.3g} mm, the wall stands at"
            f" {wall:.3g} mm. Begin farther away, or use a wider inter_antennal_angle, a smaller"
            " fold_radius, or prebend='rest'."
        )
    if posture.prebend == "placed":
        angle = np.diff(posture.lay(antenna, wall), prepend=base)
        return Equilibrium(antenna, posture.friction, base, angle), wall
    standing = Equilibrium(antenna, posture.friction, np.pi)
    for heading in np.linspace(np.pi, base, _ROTATION_STEPS + 1)[1:]:
        standing.settle(wall, heading)
    return standing, wall


# Where an antenna bends most: at a hinge, or on a smoothed curve between hinges.

_METHODS = ("smooth", "hinge")
_QUANTITIES = ("bend", "total")
_SMOOTHING = 1.0  # [C] mm; standard deviation of the smoothing kernel, three to seven segments
_GRID = 0.1  # mm; spacing of the smoothed curve before the parabola
_FAINTEST = 1e-6  # 1/mm; a shape bent less than this everywhere has no peak


@dataclass(frozen=True, kw_only=True, eq=False)
class Peak:
    """The point of greatest curvature of each shape; NaN where a shape is not bent.

    Attributes
    ----------
    position : np.ndarray
        Arc length (shape,) from the base [mm].
    curvature : np.ndarray
        Signed curvature (shape,) there [1/mm].
    at_base : np.ndarray
        Whether (shape,) the peak sits at the base hinge, where it says nothing about distance.
    """

    position: np.ndarray
    curvature: np.ndarray
    at_base: np.ndarray


@checked
def _compute_curvature(
    antenna: Antenna, angle: Annotated[np.ndarray, "... segment"]
) -> np.ndarray:
    """Curvature θ_n / ℓ_n (…, segment) [1/mm] of hinge angles (…, segment) [rad] (paper, tactile
    tensor).
    """
    return _check_hinges(antenna, angle) / antenna.segment_length


def _check_hinges(antenna: Antenna, angle: np.ndarray) -> np.ndarray:
    angle = np.asarray(angle, dtype=float)
    if angle.shape[-1:] != (antenna.n_segments,) or not np.all(np.isfinite(angle)):
        raise InvalidInput(
            f"curvature needs finite angles of all {antenna.n_segments} hinges [rad], got shape"
            f" {angle.shape}."
        )
    return angle


@checked
def _compute_smooth_curvature(
    antenna: Antenna,
    angle: Annotated[np.ndarray, "... segment"],
    position: Annotated[np.ndarray, "point"],
    smoothing: float = _SMOOTHING,
) -> np.ndarray:
    """Curvature (shape, point) [1/mm] at arc lengths ``position`` (point,) [mm]: Σ θ_n G(s − s_n) /
    Σ ℓ_n G(s − s_n).

    G is a Gaussian of standard deviation ``smoothing`` [mm]; a circular arc keeps its curvature up
    to both ends.
    """
    return (
        np.atleast_2d(_check_hinges(antenna, angle))
        @ make_kernel(antenna, position, smoothing).T
    )


def make_kernel(
    antenna: Antenna, position: np.ndarray, smoothing: float = _SMOOTHING
) -> np.ndarray:
    """What makes the smoothed curvature of hinge angles (point, segment) [1/mm]."""
    if not (np.isfinite(smoothing) and smoothing > 0):
        raise InvalidInput(
            f"smoothing must be finite and > 0 mm, got {smoothing}. Use method='hinge' for no"
            " smoothing."
        )
    weight = np.exp(-0.5 * ((position[:, None] - antenna.hinge_position) / smoothing) ** 2)
    return weight / (weight @ antenna.segment_length)[:, None]


@checked
def find_peak(
    antenna: Antenna,
    angle: np.ndarray,
    *,
    method: Annotated[str, Choice(_METHODS)] = "smooth",
    smoothing: float = _SMOOTHING,
) -> Peak:
    """The point of greatest curvature, in size, of each shape.

    Parameters
    ----------
    angle
        Hinge angles (shape, segment) [rad], or beyond the slack shape: what is peaked is what is
        given.
    method
        ``hinge``: the hinge with the greatest |θ_n / ℓ_n|. ``smooth``: the greatest of the smoothed
        curve, between grid points by a parabola, so finer than a segment.
    """
    angle = np.atleast_2d(_check_hinges(antenna, angle))
    if method == "hinge":
        curve, place = _compute_curvature(antenna, angle), antenna.hinge_position
    else:
        place = np.linspace(
            0.0, antenna.hinge_position[-1], max(2, round(antenna.length / _GRID))
        )
        curve = _compute_smooth_curvature(antenna, angle, place, smoothing)
    size, row = np.abs(curve), np.arange(len(curve))
    best = size.argmax(axis=1)
    position = place[best] if method == "hinge" else find_parabolic_peak(size, place)
    faint = size[row, best] < _FAINTEST
    return Peak(
        position=np.where(faint, np.nan, position),
        curvature=np.where(faint, np.nan, curve[row, best]),
        at_base=(best == 0) & ~faint,
    )


def find_parabolic_peak(size: np.ndarray, place: np.ndarray) -> np.ndarray:
    """Top (shape,) of the parabola through the greatest sample of each row and its neighbours; at
    the ends the sample.
    """
    best = size.argmax(axis=1)
    inner = np.clip(best, 1, size.shape[1] - 2)
    row = np.arange(len(size))
    before, top, after = size[row, inner - 1], size[row, inner], size[row, inner + 1]
    bow = before - 2 * top + after
    shift = np.where(bow < 0, 0.5 * (before - after) / np.where(bow < 0, bow, 1.0), 0.0)
    step = place[1] - place[0]
    return np.where(inner == best, place[inner] + np.clip(shift, -0.5, 0.5) * step, place[best])


@checked
def find_sweep_peak(
    sweep: Approach,
    *,
    quantity: Annotated[str, Choice(_QUANTITIES)] = "bend",
    method: Annotated[str, Choice(_METHODS)] = "smooth",
    smoothing: float = _SMOOTHING,
) -> Peak:
    """Peaks of a sweep; NaN where the antenna does not touch the wall: no contact, no estimate.

    ``quantity``: ``bend``, beyond the slack shape, as a strain sensor feels it; ``total``, as a
    camera sees it.
    """
    angle = sweep.bend if quantity == "bend" else sweep.angle
    peak = find_peak(sweep.antenna, angle, method=method, smoothing=smoothing)
    return Peak(
        position=np.where(sweep.contact, peak.position, np.nan),
        curvature=np.where(sweep.contact, peak.curvature, np.nan),
        at_base=peak.at_base & sweep.contact,
    )


# A wall in motion: sliding past at constant distance (Fig. 3C), and coming nearer without
# stopping (Fig. 3D).

_SPEED = (
    0.3  # mm/ms; [P] the paper's medium speed, and within the running speeds of wall following
)
_SLIDE_DURATION = 200.0  # [C] ms
# [C] mm; nearer is at the wall: between force and none an antenna trembles by some 0.001 mm
_CLEARANCE = 0.05


@dataclass(frozen=True, kw_only=True, eq=False)
class WallTouch:
    """Simulated motions of antennae beside a moving wall; all share one clock.

    Attributes
    ----------
    antenna : Antenna
        The antenna with its slack shape.
    distance : np.ndarray
        Distance (motion, sample) of the wall from the base [mm].
    speed : float
        [mm/ms]
    """

    antenna: Antenna
    posture: Posture
    motions: tuple[Motion, ...]
    distance: np.ndarray
    speed: float

    @property
    def base_angle(self) -> float:
        """Heading of the base [rad], negative on the left."""
        return self.posture.sign * self.posture.base_angle

    @property
    def points(self) -> np.ndarray:
        """Base, hinges and tip (motion, sample, segment + 1, 2) [mm]."""
        return np.stack(
            [
                self.antenna.shape(motion.angle, base_angle=self.base_angle)
                for motion in self.motions
            ]
        )

    @property
    def contact(self) -> np.ndarray:
        """Whether (motion, sample) the antenna is at the wall."""
        radius = np.append(self.antenna.radius, self.antenna.radius[-1])
        return (self.posture.sign * self.points[..., 0] + radius).max(
            axis=2
        ) > self.distance - _CLEARANCE

    @property
    def inverted(self) -> np.ndarray:
        """Whether (motion, sample) it is an inverted J: at the wall, tip pointing backward."""
        tip = self.base_angle + np.stack([motion.angle.sum(axis=1) for motion in self.motions])
        return self.contact & (np.cos(tip) < 0)

    def make_dataset(self, *, relative: bool = True) -> xr.Dataset:
        """The tactile tensors by the data contract; ``relative``: hinge angles beyond the slack
        shape.

        ``size`` is infinite (a wall), ``location`` the share of the length at which a straight
        antenna would meet the wall, the extra coordinate ``distance`` the wall's first distance
        [mm].
        """
        antenna = self.antenna
        hinge = antenna.sensors - 1
        angle = np.stack(
            [
                motion.angle - (antenna.rest_angle if relative else 0.0)
                for motion in self.motions
            ]
        )
        n = len(self.motions)
        location = self.distance[:, 0] / np.sin(self.posture.base_angle) / antenna.length
        dataset = make_motion_tensors(
            antenna,
            self.motions,
            angle=angle[:, :, hinge].transpose(0, 2, 1),
            trials={
                "feature": ["wall"] * n,
                "size": [np.inf] * n,
                "location": location,
                "speed": [self.speed] * n,
                "antenna": [antenna.name] * n,
                "source": ["simulation"] * n,
                "seed": [0] * n,
            },
            tip=self.points[:, :, -1],
            attrs={"configuration": {"posture": self.posture.to_plain(), "relative": relative}},
        )
        return dataset.assign_coords(distance=("trial", self.distance[:, 0], {"units": "mm"}))


@checked
def slide(
    antenna: Antenna,
    posture: Posture | None = None,
    distances: Sequence[float] = DISTANCES[2::4],
    *,
    speed: Annotated[float, Gt(0)] = _SPEED,
    duration: Annotated[float, Gt(0)] = _SLIDE_DURATION,
    timestep: float | None = None,
    engine: str = DEFAULT_ENGINE,
    workers: int | None = None,
    executor: Executor | None = None,
) -> WallTouch:
    """Let a wall slide backward past the body at constant distances, as when the body runs along it
    (Fig. 3C).

    Each motion starts from the quasi-static equilibrium at its distance, farthest first.
    ``engine``, ``timestep``, ``workers`` and ``executor`` as for :func:`feeler.touch`.
    """
    posture = posture or Posture()
    sweep = approach(antenna, posture, distances)
    scenes = [_begin_sliding(sweep, k, (0.0, -speed)) for k in range(len(sweep.distance))]
    step = choose_timestep(timestep, engine, scenes[0].contact)
    clock = Clock(duration=duration, timestep=step)
    motions = simulate(scenes, clock, engine=engine, workers=workers, executor=executor)
    return _collect(
        sweep, motions, np.repeat(sweep.distance[:, None], clock.n_samples, axis=1), speed
    )


@checked
def drive(
    antenna: Antenna,
    posture: Posture | None = None,
    *,
    far: float = DISTANCES[0],
    near: float = DISTANCES[-1],
    speed: Annotated[float, Gt(0)] = 0.06,
    timestep: float | None = None,
    engine: str = DEFAULT_ENGINE,
    workers: int | None = None,
    executor: Executor | None = None,
) -> WallTouch:
    """Let a wall come from ``far`` to ``near`` [mm] without stopping (Fig. 3D), one motion.

    ``speed`` [mm/ms], by default the paper's slow exploration speed; the rest as for :func:`slide`.
    """
    posture = posture or Posture()
    if not 0 < near < far:
        raise InvalidInput(
            f"the wall must come from far to near with 0 < near < far, got far={far:g},"
            f" near={near:g} mm."
        )
    duration = (far - near) / speed
    sweep = approach(antenna, posture, [far])
    scenes = [_begin_sliding(sweep, 0, (-posture.sign * speed, 0.0))]
    step = choose_timestep(timestep, engine, scenes[0].contact)
    clock = Clock(duration=duration, timestep=step)
    motions = simulate(scenes, clock, engine=engine, workers=workers, executor=executor)
    return _collect(sweep, motions, far - speed * clock.time[None, :], speed)


def _begin_sliding(sweep: Approach, step: int, velocity: tuple[float, float]) -> Scene:
    """The scene that goes on from one equilibrium."""
    return make_wall_scene(
        sweep.antenna,
        sweep.posture,
        sweep.distance[step],
        velocity=velocity,
        angle=sweep.angle[step],
    )


def _collect(
    sweep: Approach, motions: Sequence[Result | None], distance: np.ndarray, speed: float
) -> WallTouch:
    return WallTouch(
        antenna=sweep.antenna,
        posture=sweep.posture,
        motions=tuple(expect_motions(motions)),
        distance=distance,
        speed=speed,
    )
