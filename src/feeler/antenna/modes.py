"""Small oscillations of an antenna about its straight shape: mass matrix, modes, damping."""

from dataclasses import dataclass

import numpy as np
import scipy

from feeler.antenna.segments import Antenna, require_plane
from feeler.errors import InvalidInput
from feeler.validation import Count, checked, show

_FASTEST = 2 * np.pi * 1e9  # [C] rad/ms; no part of an antenna swings so fast


@dataclass(frozen=True, kw_only=True)
class Modes:
    """Modes, slowest first: ``frequency`` (mode,) [kHz], ``damping_ratio`` (mode,) [1], ``angle``
    (mode, segment).
    """

    frequency: np.ndarray
    damping_ratio: np.ndarray
    angle: np.ndarray


def compute_mass_matrix(antenna: Antenna) -> np.ndarray:
    """Joint-space inertia (segment, segment) [g·mm²] of the straight antenna in one plane, thin.

    ``M_ij = Σ_{n ≥ max(i, j)} m_n (c_n − s_i)(c_n − s_j) + I_n`` with c_n the segment's centre, s_i
    the hinge's place and I_n = m_n ℓ_n² / 12.
    """
    s, m = antenna.hinge_position, antenna.segment_mass
    centre = s + antenna.mass_centre
    arm = np.maximum(centre[:, None] - s[None, :], 0.0)
    arm[np.triu_indices(arm.shape[0], 1)] = 0.0
    inertia = np.cumsum(antenna.inertia[::-1])[::-1]
    index = np.arange(antenna.n_segments)
    return (arm.T * m) @ arm + inertia[np.maximum.outer(index, index)]


@checked
def compute_modes(antenna: Antenna, n_modes: Count) -> Modes:
    """Undamped modes of the straight antenna and the damping ratio of each taken by itself.

    Solves ``K v = ω² M v`` with K the hinge stiffnesses; ``ζ = vᵀ C v / (2 ω vᵀ M v)``, exact for
    damping proportional to stiffness and the first-order value otherwise. Of an antenna in space
    these are the modes of bending of both planes, and ``angle`` is (mode, plane, segment).
    """
    n_modes, mass = min(n_modes, antenna.n_segments), compute_mass_matrix(antenna)
    planes = zip(
        *(np.atleast_2d(rows)[:2] for rows in (antenna.stiffness, antenna.damping)), strict=True
    )
    found = [_solve(mass, stiffness, damping, n_modes) for stiffness, damping in planes]
    if not antenna.spatial:
        return found[0]
    angle = np.zeros((2 * n_modes, len(antenna.planes), antenna.n_segments))
    for k, modes in enumerate(found):
        angle[k * n_modes : (k + 1) * n_modes, k] = modes.angle
    frequency, ratio = (
        np.concatenate([getattr(modes, name) for modes in found])
        for name in ("frequency", "damping_ratio")
    )
    order = np.argsort(frequency, kind="stable")[:n_modes]
    return Modes(frequency=frequency[order], damping_ratio=ratio[order], angle=angle[order])


def _solve(mass: np.ndarray, stiffness: np.ndarray, damping: np.ndarray, n_modes: int) -> Modes:
    """The modes in one plane."""
    soft = 1 / np.sqrt(stiffness)
    # As ``K^-½ M K^-½ y = y / ω²`` the slow modes have the largest eigenvalues, which come out to
    # the last digits; as
    # ``K v = ω² M v`` they were off by 5e-6, and differently with another number of threads.
    first = len(mass) - n_modes
    shares, vectors = scipy.linalg.eigh(
        soft[:, None] * mass * soft, subset_by_index=(first, first + n_modes - 1)
    )
    omega = 1 / np.sqrt(shares[::-1])
    vectors = soft[:, None] * vectors[:, ::-1] * omega
    modal_damping = np.einsum("im,i,im->m", vectors, damping, vectors)
    return Modes(
        frequency=omega / (2 * np.pi),
        damping_ratio=modal_damping / (2 * omega),
        angle=vectors.T,
    )


@checked
def compute_base_response(antenna: Antenna, frequency: np.ndarray) -> np.ndarray:
    """How far base, hinges and tip swing when the base is shaken sideways by one: complex
    (frequency, segment + 1).

    Small motions of the straight antenna at steady state, ``(K + iωC − ω²M) θ = ω² b`` with ``b_j =
    Σ_n m_n (c_n − s_j)₊``; the argument is the phase against the base. ``frequency`` in kHz, 0 or
    more.
    """
    require_plane(antenna, "compute_base_response")
    omega = 2 * np.pi * np.atleast_1d(np.asarray(frequency, dtype=float))
    if omega.ndim != 1 or not omega.size or not np.all(np.abs(omega) < _FASTEST):
        raise InvalidInput(
            f"frequency must be one or more numbers below {_FASTEST / (2 * np.pi):g} kHz, got"
            f" {show(frequency)}."
        )
    s, mass = antenna.hinge_position, compute_mass_matrix(antenna)
    pull = antenna.segment_mass @ np.maximum((s + antenna.segment_length / 2)[:, None] - s, 0.0)
    spring, arm = (
        np.diag(antenna.stiffness),
        np.maximum(np.append(s, antenna.length)[:, None] - s, 0.0),
    )
    damping = np.diag(antenna.damping)
    angles = [
        np.linalg.solve(spring + 1j * w * damping - w**2 * mass, w**2 * pull) for w in omega
    ]
    return 1 + np.array(angles) @ arm.T
