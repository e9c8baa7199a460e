"""Small oscillations of an antenna about its straight shape: mass matrix, modes, damping."""

from dataclasses import dataclass
from typing import Annotated

import numpy as np
import scipy

from feeler.antenna.antenna import Antenna
from feeler.checked import checked


@dataclass(frozen=True, kw_only=True)
class Modes:
    """Modes, slowest first: ``frequency`` (mode,) [kHz], ``damping_ratio`` (mode,) [1], ``angle``
    (mode, segment).
    """

    frequency: np.ndarray
    damping_ratio: np.ndarray
    angle: np.ndarray


def compute_mass_matrix(antenna: Antenna) -> np.ndarray:
    """Joint-space inertia (segment, segment) [g·mm²] of the straight antenna, thin rods.

    ``M_ij = Σ_{n ≥ max(i, j)} m_n (c_n − s_i)(c_n − s_j) + I_n`` with c_n the segment's centre, s_i
    the hinge's place and I_n = m_n ℓ_n² / 12.
    """
    s, m = antenna.hinge_position, antenna.segment_mass
    centre = s + antenna.segment_length / 2
    arm = np.maximum(centre[:, None] - s[None, :], 0.0)
    arm[np.triu_indices(arm.shape[0], 1)] = 0.0
    inertia = np.cumsum((m * antenna.segment_length**2 / 12)[::-1])[::-1]
    index = np.arange(antenna.n_segments)
    return (arm.T * m) @ arm + inertia[np.maximum.outer(index, index)]


@checked
def compute_modes(antenna: Antenna, n_modes: Annotated[int, "> 0"]) -> Modes:
    """Undamped modes of the straight antenna and the damping ratio of each taken by itself.

    Solves ``K v = ω² M v`` with K the hinge stiffnesses; ``ζ = vᵀ C v / (2 ω vᵀ M v)``, exact for
    damping proportional to stiffness and the first-order value otherwise.
    """
    n_modes = min(n_modes, antenna.n_segments)
    mass = compute_mass_matrix(antenna)
    soft = 1 / np.sqrt(antenna.stiffness)
    # As ``K^-½ M K^-½ y = y / ω²`` the slow modes have the largest eigenvalues, which come out to
    # the last digits; as
    # ``K v = ω² M v`` they were off by 5e-6, and differently with another number of threads.
    first = antenna.n_segments - n_modes
    shares, vectors = scipy.linalg.eigh(
        soft[:, None] * mass * soft, subset_by_index=(first, first + n_modes - 1)
    )
    omega = 1 / np.sqrt(shares[::-1])
    vectors = soft[:, None] * vectors[:, ::-1] * omega
    modal_damping = np.einsum("im,i,im->m", vectors, antenna.damping, vectors)
    return Modes(
        frequency=omega / (2 * np.pi), damping_ratio=modal_damping / (2 * omega), angle=vectors.T
    )


@checked
def compute_base_response(antenna: Antenna, frequency: np.ndarray) -> np.ndarray:
    """How far base, hinges and tip swing when the base is shaken sideways by one: complex
    (frequency, segment + 1).

    Small motions of the straight antenna at steady state, ``(K + iωC − ω²M) θ = ω² b`` with ``b_j =
    Σ_n m_n (c_n − s_j)₊``; the argument is the phase against the base. ``frequency`` in kHz, 0 or
    more.
    """
    omega = 2 * np.pi * np.atleast_1d(np.asarray(frequency, dtype=float))
    s, mass = antenna.hinge_position, compute_mass_matrix(antenna)
    pull = antenna.segment_mass @ np.maximum((s + antenna.segment_length / 2)[:, None] - s, 0.0)
    spring, arm = (
        np.diag(antenna.stiffness),
        np.maximum(np.append(s, antenna.length)[:, None] - s, 0.0),
    )
    damping = np.diag(antenna.damping)
    angles = [np.linalg.solve(spring + 1j * w * damping - w**2 * mass, w**2 * pull) for w in omega]
    return 1 + np.array(angles) @ arm.T
