"""Static postures under dead forces, solved directly and not by waiting for a run to settle."""

from collections.abc import Sequence

import numpy as np
from scipy.linalg import cho_factor, cho_solve

from feeler.antenna.segments import Antenna, require_plane
from feeler.errors import FeelerError, InvalidInput
from feeler.execute.threads import hold_blas

_MAX_ITERATIONS = 200
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
        found = _newton(antenna, angle, share * load, at)
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


def _newton(
    antenna: Antenna, angle: np.ndarray, force: np.ndarray, at: float
) -> np.ndarray | None:
    """Newton's method from ``angle``; None where it does not reach the balance."""
    for _ in range(_MAX_ITERATIONS):
        residual, hessian = _balance(antenna, angle, force, at)
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


def _balance(
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
