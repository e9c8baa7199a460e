"""A wall that comes nearer in small steps to an antenna held at its base: the equilibrium at each distance."""

from dataclasses import dataclass

import numpy as np

from feeler.antenna.antenna import Antenna
from feeler.checked import checked
from feeler.errors import InvalidInput
from feeler.wall.posture import Posture
from feeler.wall.rod import place_nodes, settle
from feeler.wall.table import R_RADIUS, make_half_plane, make_table

DISTANCES = tuple(np.linspace(25.0, 5.0, 20))  # [C] mm, far to near; the paper states none
SUBSTEP = 0.5  # mm; the wall moves in steps no longer than this between two equilibria
TOLERANCE = 1e-6  # rad; greatest out-of-balance torque over hinge stiffness
MAX_STEPS = 400  # of one relaxation
TUCK = 1.0  # mm; how much nearer than its reach the wall stands to a straight antenna that is laid in a J
ROTATION_STEPS = 60  # from backward to the base angle, prebend "rotation"


@dataclass(frozen=True, kw_only=True, eq=False)
class Sweep:
    """Equilibria of one antenna at several distances, farthest first."""

    antenna: Antenna
    """The antenna with its slack shape (mirrored on the left side)."""
    posture: Posture
    distance: np.ndarray
    """Distance (step,) of the wall from the antenna's base [mm]."""
    angle: np.ndarray
    """Hinge angles (step, segment) [rad]."""
    contact: np.ndarray
    """Whether (step,) the antenna touches the wall."""
    inverted: np.ndarray
    """Whether (step,) it is an inverted J: in contact, base forward, tip backward (heading from 90° to 270°)."""
    balanced: np.ndarray
    """Whether (step,) the relaxation ended in an equilibrium."""

    @property
    def points(self) -> np.ndarray:
        """Base, hinges and tip (step, segment + 1, 2) [mm]."""
        return self.antenna.shape(self.angle, base_angle=self.posture.sign * self.posture.base_angle)

    @property
    def bend(self) -> np.ndarray:
        """Hinge angles beyond the slack shape (step, segment) [rad]: what a strain sensor feels."""
        return self.angle - self.antenna.rest_angle


class _Holder:
    """The state of a relaxation: an antenna on the right side, its base at the origin."""

    def __init__(self, antenna: Antenna, posture: Posture) -> None:
        self.table, self.friction = make_table(antenna), float(posture.friction)
        self.base = np.array([0.0, 0.0, posture.base_angle, posture.base_angle])
        n = antenna.n_segments
        self.heading, self.points = posture.base_angle + np.cumsum(antenna.rest_angle), np.zeros((n + 1, 2))
        self.anchor, self.pressed = np.full((n, 2), np.nan), np.zeros((n, 2))
        self.lay(self.heading)

    def lay(self, heading: np.ndarray) -> None:
        """Put the antenna into a shape."""
        self.heading = np.array(heading, dtype=float)
        place_nodes(self.table, self.base, self.heading, self.points)

    def relax(self, distance: float) -> tuple[float, int]:
        """Equilibrium with the wall at ``distance``; (imbalance [rad], touching nodes)."""
        faces = make_half_plane(distance, 0.0, (-1.0, 0.0))
        state = (self.heading, self.points, self.anchor, self.pressed)
        imbalance, count, _, _ = settle(self.table, faces, self.friction, self.base, *state, TOLERANCE, MAX_STEPS)
        return imbalance, count

    def bring(self, distance: float, goal: float, substep: float) -> tuple[float, int]:
        """Move the wall from ``distance`` to ``goal`` and relax at every step; the last (imbalance, touching nodes)."""
        walls = np.linspace(distance, goal, 1 + int(np.ceil((distance - goal) / substep - 1e-9)))
        for wall in walls[1:] if len(walls) > 1 else walls:
            imbalance, count = self.relax(wall)
        return imbalance, count


@checked
def approach(
    antenna: Antenna,
    posture: Posture | None = None,
    distances: np.ndarray = DISTANCES,
    *,
    substep: float = SUBSTEP,
) -> Sweep:
    """Let a wall approach a held, pre-bent antenna step by step and record each equilibrium (Fig. 3A, B).

    Each equilibrium is the minimum of Σ ½ k_i (θ_i − rest_i)² with all nodes in front of the wall, reached from the one
    before along the antenna's own damping; with friction, a node slips where its tangential force exceeds
    friction · normal force.

    Parameters
    ----------
    antenna
        Any antenna.
    posture
        Angle, pre-bend, friction and side.
    distances
        Distances of the wall from the antenna's base (step,) [mm], > 0; visited from far to near.
    substep
        The wall moves in steps no longer than this [mm] between two equilibria. With friction the answer depends on it.

    Returns
    -------
    Sweep
        Farthest first. Where the antenna does not reach the wall, ``contact`` is False and nothing is bent.

    Raises
    ------
    InvalidInput
        No distance, a wall behind the body (distance ≤ 0), or a pre-bend that starts inside the wall.
    """
    posture = posture or Posture()
    if not (np.isfinite(substep) and substep > 0):
        raise InvalidInput(f"substep must be finite and > 0 mm, got {substep}.")
    distance = _check_distances(distances, antenna)
    bent = posture.bend(antenna)
    holder, wall = _begin(bent, posture, distance[0])
    steps, imbalance, count = [], [], []
    for goal in distance:
        left, touching = (0.0, 0) if goal > wall else holder.bring(wall, goal, substep)
        wall = min(wall, goal)
        steps.append(np.diff(holder.heading, prepend=posture.base_angle) if goal <= wall else bent.rest_angle)
        imbalance.append(left)
        count.append(touching)
    angle, contact = np.array(steps), np.array(count) > 0
    tip = posture.base_angle + angle.sum(axis=1)
    inverted = contact & (np.cos(tip) < 0) & (tip > np.pi / 2) & (tip < 3 * np.pi / 2)
    sign = posture.sign
    return Sweep(
        antenna=bent if sign > 0 else bent.replace(rest_angle=-bent.rest_angle),
        posture=posture,
        distance=distance,
        angle=sign * angle,
        contact=contact,
        inverted=inverted,
        balanced=np.array(imbalance) < 10 * TOLERANCE,
    )


def _check_distances(distances: np.ndarray, antenna: Antenna) -> np.ndarray:
    values = np.atleast_1d(np.asarray(distances, dtype=float))
    if values.size == 0 or values.ndim != 1:
        raise InvalidInput(f"distances must be a list of at least one distance [mm], got shape {values.shape}.")
    if not np.all(np.isfinite(values)) or values.min() <= 0:
        bad = values[~(values > 0) | ~np.isfinite(values)][0]
        raise InvalidInput(
            f"every distance must be finite and > 0 mm: a wall at {bad:g} mm is behind the body. Leave it out."
        )
    if values.min() <= antenna.radius[0]:
        raise InvalidInput(
            f"the pre-bend starts inside the wall: at {values.min():g} mm the wall cuts the antenna's base, whose "
            f"radius is {antenna.radius[0]:g} mm. Use larger distances."
        )
    return np.unique(values)[::-1]


def _begin(antenna: Antenna, posture: Posture, first: float) -> tuple[_Holder, float]:
    """The pre-bend, and the distance at which the wall then stands."""
    holder = _Holder(antenna, posture)
    if posture.prebend in ("rest", "none"):
        return holder, max(first, float(np.max(holder.points[1:, 0] + holder.table[:, R_RADIUS])))
    wall = min(first, posture.reach(antenna) - TUCK)
    room = float(antenna.radius.max()) + posture.fold_radius * (1 + np.cos(posture.base_angle))
    if wall < room:
        raise InvalidInput(
            f"the pre-bend starts inside the wall: it needs {room:.3g} mm, the wall stands at {wall:.3g} mm. Begin "
            "farther away, or use a wider inter_antennal_angle, a smaller fold_radius, or prebend='rest'."
        )
    if posture.prebend == "placed":
        holder.lay(posture.lay(antenna, wall))
    else:
        holder.base[2:] = np.pi
        holder.lay(np.pi + np.cumsum(antenna.rest_angle))
        for heading in np.linspace(np.pi, posture.base_angle, ROTATION_STEPS + 1)[1:]:
            holder.base[2] = heading
            holder.relax(wall)
    return holder, wall
