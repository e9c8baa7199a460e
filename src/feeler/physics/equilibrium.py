"""Static equilibria of an antenna in front of a wall, with friction, by Newton's method in O(n).

The antenna is a chain of segments with headings φ_i (from +y towards +x), p_i = p_(i−1) + ℓ_i
(sin φ_i, cos φ_i), on a base at the origin; the wall is x ≥ d. It touches with its hinges and its
tip, each as thick as the thicker of its two segments, by a spring at each, so stiff that these sink
in by some 0.001 mm. Friction sticks by a spring as stiff, and slips at the coefficient times the
normal force of the step before.

A step of length h solves, for every segment,

    T_i − T_(i+1) = t_i · Σ_(j ≥ i) f_j,    T_i = k_i (θ_i − rest_i) + c_i (θ_i − θ_i⁻) / h,
    t_i = ∂p_i/∂φ_i,

backward Euler without inertia: h → ∞ gives an equilibrium, reached along the antenna's own damping.
The linear system of a Newton iteration is solved like an articulated body: one sweep from the tip
that condenses everything distal into a 3 × 3 response of the segment's near end, one sweep
outwards. Where a pivot is not positive the turning of the levers is left out, so that every step
descends.

Postures under dead forces stand at the end.
"""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from scipy.linalg import cho_factor, cho_solve

from feeler.antenna.segments import Antenna, require_plane
from feeler.compiled import compiled, nested
from feeler.errors import FeelerError, InvalidInput
from feeler.execute.workers import hold_blas
from feeler.physics.engine import announce_compiling

FIRMNESS = 1e3  # [C] 1/mm²; contact stiffness over that of the node's hinge per rad
_BALANCED = 1e-6  # rad; greatest out-of-balance torque over hinge stiffness at rest
_MAX_STEPS = 400  # of one relaxation
_FIRST_STEP, _LONGEST_STEP = 0.5, 1e7  # ms
_CALM = 0.05  # rad per step
# rad; an antenna that moves less per step, nearly balanced, is as balanced as rounding lets it be
_ROUNDING = 1e-9
_MAX_TURN = 0.3  # rad; largest change of a heading in one Newton iteration
_MAX_ITERATIONS, _MAX_HALVINGS = 40, 16
_WALL_START = -1e4  # mm; where places along the wall are counted from
# columns of the antenna's table, one row per segment, and of its contacts
R_LENGTH, R_STIFFNESS, R_DAMPING, R_REST, R_RADIUS, R_FIRMNESS = range(6)
C_DEPTH, C_PLACE = range(2)


class _Standing(NamedTuple):
    """The antenna's table (segment, column), and what changes.

    Attributes
    ----------
    heading : np.ndarray
        Of every segment (segment,) [rad].
    points : np.ndarray
        Base, hinges and tip (segment + 1, 2) [mm].
    anchor : np.ndarray
        Where on the wall a node sticks (segment,) [mm]; NaN where it has just come or is away.
    pressed : np.ndarray
        Normal forces at the end of the step before (segment,) [N].
    push : np.ndarray
        Contacts of the last step (segment, column); depth ≤ 0: none.
    """

    table: np.ndarray
    heading: np.ndarray
    points: np.ndarray
    anchor: np.ndarray
    pressed: np.ndarray
    push: np.ndarray


class Rest(NamedTuple):
    """How a relaxation ended.

    Attributes
    ----------
    imbalance : float
        Greatest out-of-balance torque over the hinge's stiffness [rad]; infinite where it got
        stuck.
    n_contacts : int
        Touching nodes.
    """

    imbalance: float
    n_contacts: int

    @property
    def balanced(self) -> bool:
        """Whether it is an equilibrium."""
        return self.imbalance < 10 * _BALANCED


class Equilibrium:
    """An antenna on a base at the origin, with a wall on its right that is moved from one
    equilibrium to the next.

    Parameters
    ----------
    antenna
        In the plane.
    friction
        Of the wall.
    heading
        Of the base [rad].
    angle
        Hinge angles to begin with (segment,) [rad]; default: at rest.

    Raises
    ------
    InvalidInput
        Hinges with neither stiffness nor damping, or an antenna in space.
    """

    def __init__(
        self,
        antenna: Antenna,
        friction: float,
        heading: float,
        angle: np.ndarray | None = None,
    ) -> None:
        require_plane(antenna, "a wall")
        if np.any(antenna.stiffness + antenna.damping <= 0):
            raise InvalidInput(
                "a wall needs stiffness or damping > 0 in every hinge of the antenna."
            )
        self.antenna, self.friction, self.heading = antenna, float(friction), float(heading)
        columns = (
            antenna.segment_length,
            antenna.stiffness,
            antenna.damping,
            antenna.rest_angle,
            np.maximum(antenna.radius, np.append(antenna.radius[1:], 0.0)),
            FIRMNESS * np.maximum(antenna.stiffness, 1e-6 * antenna.stiffness.max()),
        )
        n = antenna.n_segments
        self._own = _Standing(
            table=np.ascontiguousarray(np.stack(columns, axis=1)),
            heading=heading + np.cumsum(antenna.rest_angle if angle is None else angle),
            points=np.zeros((n + 1, 2)),
            anchor=np.full(n, np.nan),
            pressed=np.zeros(n),
            push=np.zeros((n, 2)),
        )
        _place_nodes(self._own.table, self._own.heading, self._own.points)

    def settle(self, wall: float, heading: float | None = None) -> Rest:
        """Relax to the equilibrium nearest along the antenna's own damping, with the wall at this
        distance [mm] and, where it is given, the base turned to a ``heading`` [rad], along with the
        antenna.
        """
        before, self.heading = self.heading, self.heading if heading is None else heading
        with announce_compiling("wall"):
            found = _relax(self._own, float(wall), self.friction, before, self.heading)
        return Rest(*found)

    @property
    def angle(self) -> np.ndarray:
        """Hinge angles (segment,) [rad]."""
        return np.diff(self._own.heading, prepend=self.heading)

    @property
    def contact_place(self) -> float:
        """Where the wall presses, weighted by force, as a share of the length; NaN without
        contact.
        """
        depth = self._own.push[:, C_DEPTH]
        node = np.flatnonzero(depth > 0)
        force = self._own.table[node, R_FIRMNESS] * depth[node]
        place = np.cumsum(self.antenna.segment_length)[node] / self.antenna.length
        return float(force @ place / force.sum()) if node.size else float("nan")


@compiled
def _place_nodes(table, heading, points):
    """Fill ``points`` (segment + 1, 2) from the headings (segment,)."""
    for i in range(table.shape[0]):
        points[i + 1, 0] = points[i, 0] + table[i, R_LENGTH] * math.sin(heading[i])
        points[i + 1, 1] = points[i, 1] + table[i, R_LENGTH] * math.cos(heading[i])


@nested
def _add_forces(own, wall, friction, points, force, stiffness):
    """Contact at every node: force (segment, 2) and stiffness (segment, 2: xx, yy); contacts are
    noted in ``own.push``. Returns (energy, touching nodes).

    Friction is limited by ``own.pressed``, the normal force at the end of the step before, so that
    a step has a potential energy.
    """
    energy, count = 0.0, 0
    for i in range(own.table.shape[0]):
        firm, place = own.table[i, R_FIRMNESS], points[i + 1, 1] - _WALL_START
        force[i] = stiffness[i] = 0.0
        depth = own.push[i, C_DEPTH] = own.table[i, R_RADIUS] - (wall - points[i + 1, 0])
        if depth <= 0.0:
            continue
        count += 1
        energy += 0.5 * firm * depth * depth
        force[i, 0], stiffness[i, 0] = -firm * depth, firm
        own.push[i, C_PLACE] = place
        held, limit = own.anchor[i], friction * own.pressed[i]
        if limit > 0.0 and not np.isnan(held):
            slip = place - held
            if abs(slip) * firm <= limit:
                energy += 0.5 * firm * slip * slip
                force[i, 1], stiffness[i, 1] = -firm * slip, firm
            else:
                energy += limit * (abs(slip) - 0.5 * limit / firm)
                force[i, 1] = -limit if slip > 0.0 else limit
    return energy, count


@nested
def _move_anchors(own, friction):
    """After a step: note the normal forces; nodes that slid drag their anchor along, nodes that
    left forget it.
    """
    for i in range(own.table.shape[0]):
        firm, depth, place = (
            own.table[i, R_FIRMNESS],
            own.push[i, C_DEPTH],
            own.push[i, C_PLACE],
        )
        if depth <= 0.0:
            own.anchor[i], own.pressed[i] = np.nan, 0.0
            continue
        slip, most = place - own.anchor[i], friction * own.pressed[i] / firm
        if np.isnan(slip):
            own.anchor[i] = place
        elif abs(slip) > most:
            own.anchor[i] = place - most if slip > 0.0 else place + most
        own.pressed[i] = firm * depth


@nested
def _balance(table, base, heading, points, old_angle, rate, force, out):
    """Out-of-balance torque of every segment; returns (largest size over stiffness [rad], energy of
    the hinges).
    """
    worst, energy = 0.0, 0.0
    fx = fy = torque = 0.0
    for i in range(table.shape[0] - 1, -1, -1):
        fx, fy = fx + force[i, 0], fy + force[i, 1]
        angle = heading[i] - (heading[i - 1] if i else base)
        bend, turned = angle - table[i, R_REST], angle - old_angle[i]
        drag = rate * table[i, R_DAMPING]
        energy += 0.5 * table[i, R_STIFFNESS] * bend * bend + 0.5 * drag * turned * turned
        own = table[i, R_STIFFNESS] * bend + drag * turned
        turn = (points[i + 1, 1] - points[i, 1]) * fx - (points[i + 1, 0] - points[i, 0]) * fy
        out[i] = own - torque - turn
        worst = max(worst, abs(out[i]) / (table[i, R_STIFFNESS] + drag))
        torque = own
    return worst, energy


@nested
def _newton(table, points, rate, force, stiffness, residual, full, work, change):
    """Fill ``change`` (segment,) with the Newton step; False where a pivot is not positive.

    Without ``full`` the turning of the forces' levers is left out, and the matrix is positive
    whatever the state.
    """
    p00 = p01 = p11 = u0 = u1 = e0 = e1 = z = h = fx = fy = 0.0
    for i in range(table.shape[0] - 1, -1, -1):
        fx, fy = fx + force[i, 0], fy + force[i, 1]
        p00, p11 = p00 - stiffness[i, 0], p11 - stiffness[i, 1]
        t0, t1 = points[i + 1, 1] - points[i, 1], points[i, 0] - points[i + 1, 0]
        q0, q1 = p00 * t0 + p01 * t1 + u0, p01 * t0 + p11 * t1 + u1
        kappa = table[i, R_STIFFNESS] + rate * table[i, R_DAMPING]
        pivot = kappa - (u0 * t0 + u1 * t1 + z) - (t0 * q0 + t1 * q1)
        if full:
            pivot += t0 * fy - t1 * fx
        if not pivot > 1e-9 * kappa:
            return False
        rho = h + t0 * e0 + t1 * e1 - residual[i]
        a, v0, v1, b = kappa / pivot, q0 / pivot, q1 / pivot, rho / pivot
        work[i, 0], work[i, 1], work[i, 2], work[i, 3] = a, v0, v1, b
        z, h = kappa * (a - 1.0), kappa * b
        p00, p01, p11 = p00 + q0 * v0, p01 + q0 * v1, p11 + q1 * v1
        e0, e1 = e0 + q0 * b, e1 + q1 * b
        u0, u1 = q0 * a, q1 * a
    x = y = phi = 0.0
    for i in range(table.shape[0]):
        phi = work[i, 0] * phi + work[i, 1] * x + work[i, 2] * y + work[i, 3]
        change[i] = phi
        x = x + (points[i + 1, 1] - points[i, 1]) * phi
        y = y - (points[i + 1, 0] - points[i, 0]) * phi
    return np.isfinite(phi)


@nested
def _potential(
    own, wall, friction, base, heading, points, old_angle, rate, force, stiffness, residual
):
    """(largest imbalance [rad], potential, touching nodes) at ``heading``; fills points, force,
    stiffness, residual.
    """
    _place_nodes(own.table, heading, points)
    energy, count = _add_forces(own, wall, friction, points, force, stiffness)
    worst, hinges = _balance(own.table, base, heading, points, old_angle, rate, force, residual)
    return worst, energy + hinges, count


@compiled(no_cpython_wrapper=True, no_cfunc_wrapper=True)
def _take(own, wall, friction, before, base, timestep, tolerance):
    """Take one implicit step with base and wall where they are at its end, ``before`` being the
    base's heading at its beginning; changes ``own`` in place.

    The step is the minimum of elastic energy + energy of contact + dissipation / h, by Newton's
    method whose steps are halved until the potential falls. Returns (converged, imbalance without
    damping [rad], touching nodes, largest change of a heading [rad]); where it did not converge to
    ``tolerance`` [rad], the antenna is left as it was.
    """
    n, rate = own.table.shape[0], 1.0 / timestep
    old_angle, now, trial, place = np.empty(n), np.empty(n), np.empty(n), np.empty((n + 1, 2))
    place[0, 0], place[0, 1] = own.points[0, 0], own.points[0, 1]
    for i in range(n):
        old_angle[i] = own.heading[i] - (own.heading[i - 1] if i else before)
        now[i] = own.heading[i] + (base - before)  # all turns with the base
    force, stiffness, residual = np.empty((n, 2)), np.empty((n, 2)), np.empty(n)
    work, change = np.empty((n, 4)), np.empty(n)
    worst, energy, count = _potential(
        own, wall, friction, base, now, place, old_angle, rate, force, stiffness, residual
    )
    for _ in range(_MAX_ITERATIONS):
        if worst < tolerance:
            break
        if not _newton(own.table, place, rate, force, stiffness, residual, True, work, change):
            _newton(own.table, place, rate, force, stiffness, residual, False, work, change)
        largest, slope = 0.0, 0.0
        for i in range(n):
            largest, slope = max(largest, abs(change[i])), slope + change[i] * residual[i]
        scale = min(1.0, _MAX_TURN / largest) if largest > 0.0 else 1.0
        better = False
        for _ in range(_MAX_HALVINGS):
            for i in range(n):
                trial[i] = now[i] + scale * change[i]
            new_worst, new_energy, count = _potential(
                own,
                wall,
                friction,
                base,
                trial,
                place,
                old_angle,
                rate,
                force,
                stiffness,
                residual,
            )
            falls = new_energy <= energy + 1e-4 * scale * slope
            if falls or (new_worst < worst and new_worst < 1e-4):
                better = True
                break
            scale *= 0.5
        if not better:
            break
        for i in range(n):  # NumPy's copy takes seconds to compile
            now[i] = trial[i]
        worst, energy = new_worst, new_energy
    if not worst < tolerance:
        return False, np.inf, count, 0.0
    _potential(
        own, wall, friction, base, now, place, old_angle, rate, force, stiffness, residual
    )
    static, _ = _balance(own.table, base, now, place, old_angle, 0.0, force, residual)
    moved = 0.0
    for i in range(n):
        moved = max(moved, abs(now[i] - own.heading[i]))
        own.heading[i] = now[i]
        own.points[i + 1, 0], own.points[i + 1, 1] = place[i + 1, 0], place[i + 1, 1]
    _move_anchors(own, friction)
    return True, static, count, moved


@compiled
def _relax(own, wall, friction, before, base):
    """Go to an equilibrium in place; returns (imbalance [rad], touching nodes).

    The time step grows while little happens, so that the last steps are plain Newton steps to the
    equilibrium; where much happens it stays short, and the antenna moves off along its own damping.
    """
    timestep, static, count = _FIRST_STEP, np.inf, 0
    for _ in range(_MAX_STEPS):
        done, trial, touching, moved = _take(
            own, wall, friction, before, base, timestep, 0.1 * _BALANCED
        )
        if not done:
            timestep *= 0.25
            if timestep < 1e-6:
                return np.inf, count
            continue
        before = base  # the base has arrived
        static, count = trial, touching
        if static < _BALANCED or (static < 10 * _BALANCED and moved < _ROUNDING):
            break
        if moved < _CALM:
            timestep = min(timestep * 4.0, _LONGEST_STEP)
        elif moved > 3 * _CALM:
            timestep *= 0.5
    return static, count


# Static postures under dead forces, solved directly and not by waiting for a run to settle.

_MOST_ITERATIONS = 200
_TOLERANCE = 1e-12  # of the largest torque in the balance


def _find_point(antenna: Antenna, at: float) -> tuple[int, float]:
    """Segment index (0 = base) and distance [mm] from its hinge of the point at fraction ``at`` of
    the length.
    """
    if not (np.isfinite(at) and 0 < at <= 1):
        raise InvalidInput(f"`at` must be a fraction of the length in (0, 1], got {at}.")
    arc = at * antenna.length
    ends = np.cumsum(antenna.segment_length)
    n = min(int(np.searchsorted(ends, arc * (1 - 1e-12))), antenna.n_segments - 1)
    return n, arc - (ends[n] - antenna.segment_length[n])


def compute_point(antenna: Antenna, angle: np.ndarray, at: float) -> np.ndarray:
    """Place (…, 2) [mm] of the material point at fraction ``at`` of the length."""
    n, offset = _find_point(antenna, at)
    points = antenna.shape(angle)
    share = offset / antenna.segment_length[n]
    return (1 - share) * points[..., n, :] + share * points[..., n + 1, :]


# on a busy machine two threads wait for each other a hundred times longer than they compute
@hold_blas()
def solve_static(
    antenna: Antenna, force: Sequence[float] | np.ndarray, at: float = 1.0
) -> np.ndarray:
    """Hinge angles (segment,) [rad] at equilibrium under a dead force (x, y) [N] at fraction ``at``
    of the length.

    Minimises ``Σ ½ k (θ − θ₀)² − F·r(θ)`` by Newton's method with load steps; exact for any
    deflection.

    Raises
    ------
    InvalidInput
        A hinge without stiffness, a force that is not finite, or ``at`` outside (0, 1].
    FeelerError
        No equilibrium was found (for example past the collapse of a pushed antenna).
    """
    require_plane(antenna, "solve_static")
    load = np.asarray(force, dtype=float)
    if load.shape != (2,) or not np.all(np.isfinite(load)):
        raise InvalidInput(f"force must be two finite numbers (x, y) in N, got {load}.")
    if np.any(antenna.stiffness <= 0):
        raise InvalidInput(
            "a static load needs stiffness > 0 in every hinge; a free hinge has no equilibrium of"
            " its own."
        )
    angle, done, step = antenna.rest_angle.copy(), 0.0, 1.0
    while done < 1.0:
        share = min(1.0, done + step)
        found = _solve_dead(antenna, angle, share * load, at)
        if found is None:
            step /= 2
            if step < 1e-4:
                raise FeelerError(
                    f"no equilibrium found beyond {done:.1%} of the force {load} N; use a smaller"
                    " force."
                )
        else:
            angle, done, step = found, share, 2 * step
    return angle


def _solve_dead(
    antenna: Antenna, angle: np.ndarray, force: np.ndarray, at: float
) -> np.ndarray | None:
    """Newton's method from ``angle``; None where it does not reach the balance."""
    for _ in range(_MOST_ITERATIONS):
        residual, hessian = _balance_dead(antenna, angle, force, at)
        scale = (
            np.abs(antenna.stiffness * (angle - antenna.rest_angle)).max()
            + np.linalg.norm(force) * antenna.length
        )
        if np.abs(residual).max() <= _TOLERANCE * max(scale, 1e-300):
            return angle
        try:
            step = -cho_solve(cho_factor(hessian), residual)
        except np.linalg.LinAlgError:
            return None
        if np.abs(np.cumsum(step)).max() > 1.0:
            return None
        angle = angle + step
    return angle if np.abs(residual).max() <= 1e3 * _TOLERANCE * scale else None


def _balance_dead(
    antenna: Antenna, angle: np.ndarray, force: np.ndarray, at: float
) -> tuple[np.ndarray, np.ndarray]:
    """Gradient (segment,) and Hessian (segment, segment) of the energy.

    With r_i the arm from hinge i to the loaded point, ∂r/∂θ_i = (r_y, −r_x) and ∂²r/∂θ_i∂θ_j =
    −r_max(i, j).
    """
    n, _ = _find_point(antenna, at)
    arm = compute_point(antenna, angle, at) - antenna.shape(angle)[:-1]
    arm[n + 1 :] = 0.0
    residual = antenna.stiffness * (angle - antenna.rest_angle) - (
        force[0] * arm[:, 1] - force[1] * arm[:, 0]
    )
    index = np.arange(antenna.n_segments)
    hessian = np.diag(antenna.stiffness) + (arm @ force)[np.maximum.outer(index, index)]
    return residual, hessian
