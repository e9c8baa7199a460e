"""Stiffness and damping along an antenna with the interval that a fit leaves them."""

from dataclasses import dataclass

import numpy as np

from feeler.calibration.hinges import Hinges
from feeler.checked import checked

_STEP = 1e-3  # of a parameter's typical change


@dataclass(frozen=True, kw_only=True, eq=False)
class Band:
    """A fitted profile (quantity, segment), base to tip.

    The quantities are stiffness [N·mm/rad] and damping [N·mm·ms/rad].

    Attributes
    ----------
    place : np.ndarray
        Place of each hinge as a fraction of the length (segment,).
    """

    place: np.ndarray
    middle: np.ndarray
    low: np.ndarray
    high: np.ndarray

    def describe(self) -> str:
        """Where each quantity is known best and worst, in words."""
        parts = []
        for name, low, high in zip(("stiffness", "damping"), self.low, self.high, strict=True):
            factor = np.sqrt(high / low)
            best, worst = int(factor.argmin()), int(factor.argmax())
            parts.append(
                f"{name} is known best at {self.place[best]:.2f} of the length (within a factor of"
                f" {factor[best]:.3g}) and worst at {self.place[worst]:.2f} ({factor[worst]:.3g})"
            )
        return "; ".join(parts) + "."


@checked
def compute_band(hinges: Hinges, p: np.ndarray, covariance: np.ndarray, factor: float) -> Band:
    """Profiles at ``p`` and ``factor`` standard deviations around, from the covariance of ``x``.

    Linear in the logarithms: sd(ln k_n)² = g Σ gᵀ with g the derivatives of ln k_n.
    """

    def read(x: np.ndarray) -> np.ndarray:
        antenna = hinges.build(hinges.to_p(x))
        return np.log(np.stack([antenna.stiffness, antenna.damping]))

    x, steps = hinges.to_x(p), _STEP * hinges.scale
    slope = np.stack([(read(x + d) - read(x - d)) / (2 * d.sum()) for d in np.diag(steps)], axis=-1)
    spread = factor * np.sqrt(np.einsum("qnp,pr,qnr->qn", slope, covariance, slope))
    antenna, middle = hinges.build(hinges.to_p(x)), read(x)
    return Band(
        place=antenna.hinge_position / antenna.length,
        middle=np.exp(middle),
        low=np.exp(middle - spread),
        high=np.exp(middle + spread),
    )
