"""A wall that comes nearer in small steps to an antenna held at its base: the equilibrium at each
distance.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np

from feeler.antenna.antenna import Antenna
from feeler.errors import InvalidInput
from feeler.physics.contact import get_contact
from feeler.physics.rod.stepper import Rest, RodStepper
from feeler.physics.scene import Scene
from feeler.records.checked import checked
from feeler.stimulus.object import Object
from feeler.stimulus.wall import Wall
from feeler.wall.posture import Posture, measure_reach

DISTANCES = tuple(np.linspace(25.0, 5.0, 20))  # [C] mm, far to near; the paper states none
_SUBSTEP = 0.5  # mm; the wall moves in steps no longer than this between two equilibria
# mm; how much nearer than its reach the wall stands to a straight antenna that is laid in a J
_TUCK = 1.0
_ROTATION_STEPS = 60  # from backward to the base angle, prebend "rotation"


@checked
@dataclass(frozen=True, kw_only=True, eq=False)
class Approach:
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
    substep: Annotated[float, "> 0"] = _SUBSTEP,
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
    rod, wall = _begin(bent, posture.replace(side="right"), distance[0])
    steps, rests, places = [], [], []
    for goal in distance:
        rests.append(Rest(0.0, 0) if goal > wall else _bring(rod, wall, goal, substep))
        state = rod.read()
        steps.append(bent.rest_angle if goal > wall else state.angle[0])
        places.append(np.nan if goal > wall else state.contact_place[0])
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


def _bring(rod: RodStepper, distance: float, goal: float, substep: float) -> Rest:
    """Move the wall from ``distance`` to ``goal`` and relax at every step; how the last one
    ended.
    """
    walls = np.linspace(distance, goal, 1 + int(np.ceil((distance - goal) / substep - 1e-9)))
    return [
        rod.settle(place=[(wall, 0.0)]) for wall in (walls[1:] if len(walls) > 1 else walls)
    ][-1]


def _begin(antenna: Antenna, posture: Posture, first: float) -> tuple[RodStepper, float]:
    """The pre-bend, and the distance at which the wall then stands; on the right side."""
    base = posture.base_angle
    reach = measure_reach(antenna, base)
    if posture.prebend in ("rest", "none"):
        return _hold(antenna, posture, first), max(first, reach)
    wall = min(first, reach - _TUCK)
    room = float(antenna.radius.max()) + posture.fold_radius * (1 + np.cos(base))
    if wall < room:
        raise InvalidInput(
            f"the pre-bend starts inside the wall: it needs {room:.3g} mm, the wall stands at"
            f" {wall:.3g} mm. Begin farther away, or use a wider inter_antennal_angle, a smaller"
            " fold_radius, or prebend='rest'."
        )
    if posture.prebend == "placed":
        return (
            _hold(
                antenna, posture, wall, angle=np.diff(posture.lay(antenna, wall), prepend=base)
            ),
            wall,
        )
    rod = _hold(antenna, posture, wall, base=(0.0, 0.0, np.pi))
    for heading in np.linspace(np.pi, base, _ROTATION_STEPS + 1)[1:]:
        rod.settle(base=(0.0, 0.0, heading))
    return rod, wall


def _hold(antenna: Antenna, posture: Posture, distance: float, **fields: Any) -> RodStepper:
    return RodStepper([make_wall_scene(antenna, posture, distance, **fields)], timestep=1.0)
