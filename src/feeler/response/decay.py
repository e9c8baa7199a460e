"""A damped cosine fitted to a whole record: another frequency and damping ratio."""

from dataclasses import dataclass
from typing import Annotated

import numpy as np
from scipy.optimize import least_squares

from feeler.errors import InvalidInput
from feeler.records.checked import checked
from feeler.response.trace import check_trace


@dataclass(frozen=True, kw_only=True)
class DampedCosine:
    """``offset + amplitude · exp(−ζ ω₀ t) · cos(2π f t + phase)``, ω₀ = 2π f / √(1 − ζ²).

    t runs from the first sample.

    Attributes
    ----------
    frequency : float
        Damped frequency f [kHz].
    damping_ratio : float
        ζ [1].
    residual : float
        Root-mean-square residual over the root-mean-square signal [1].
    """

    frequency: float
    damping_ratio: float
    amplitude: float
    phase: float
    offset: float
    residual: float


@checked
def fit_damped_cosine(
    time: np.ndarray,
    signal: np.ndarray,
    frequency: Annotated[float, "> 0"],
    damping_ratio: Annotated[float, "> 0"] = 0.3,
) -> DampedCosine:
    """Least-squares damped cosine over the whole record, from a first guess.

    Only decay rate and frequency are searched; amplitude, phase and offset are linear and solved
    for exactly (variable projection, Golub & Pereyra 1973, doi:10.1137/0710036).
    """
    time, signal = check_trace(time, signal)
    t = time - time[0]
    omega = 2 * np.pi * frequency
    start = np.log([omega * damping_ratio / np.sqrt(1 - min(damping_ratio, 0.95) ** 2), omega])

    def residual(x: np.ndarray) -> np.ndarray:
        basis = _basis(t, x)
        return basis @ np.linalg.lstsq(basis, signal, rcond=None)[0] - signal

    if not np.isfinite(start).all():
        raise InvalidInput(
            f"frequency {frequency:g} kHz and damping_ratio {damping_ratio:g} are no first guess:"
            " give what the trace shows, roughly."
        )
    limit = np.log([1e-4, 1e4])
    bounds = (start + limit[0], start + limit[1])
    best = least_squares(residual, start, bounds=bounds, x_scale=0.1, xtol=1e-12, ftol=1e-12)
    cosine, sine, offset = np.linalg.lstsq(_basis(t, best.x), signal, rcond=None)[0]
    decay, omega = np.exp(best.x)
    return DampedCosine(
        frequency=float(omega / (2 * np.pi)),
        damping_ratio=float(decay / np.hypot(decay, omega)),
        amplitude=float(np.hypot(cosine, sine)),
        phase=float(np.arctan2(-sine, cosine)),
        offset=float(offset),
        residual=float(np.sqrt(np.mean(best.fun**2) / np.mean((signal - signal.mean()) ** 2))),
    )


def _basis(t: np.ndarray, x: np.ndarray) -> np.ndarray:
    decay, omega = np.exp(x)
    envelope = np.exp(-decay * t)
    return np.stack(
        [envelope * np.cos(omega * t), envelope * np.sin(omega * t), np.ones_like(t)], axis=1
    )
