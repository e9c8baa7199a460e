"""Noticing contact in noise: the last samples of all sensors, seen along the shapes that touches
bend the antenna into.

Over W samples the mean y of S sensors with noise σ has the noise σ/√W. Seen along k orthonormal
shapes u_i, the sum W Σ (u_i·y)² / σ² is chi-square with k degrees without contact, whatever S is,
and grows with all that contact bends; a limit for single samples of single sensors has to exceed
the loudest of S noises.
"""

from dataclasses import dataclass
from typing import Annotated

import numpy as np
from scipy.stats import chi2

from feeler.active.recorded import Recorded
from feeler.checked import checked
from feeler.errors import InvalidInput

SHAPES, SAMPLES, FALSE = 6, 5, 0.01  # [C]


@dataclass(frozen=True, kw_only=True, eq=False)
class Noticer:
    """Notices contact; :func:`make_noticer` makes one."""

    shapes: np.ndarray
    """(shape, sensor), orthonormal."""
    noise: float
    """[rad]"""
    samples: int
    limit: float
    """Of the statistic."""

    def measure(self, felt: np.ndarray) -> np.ndarray:
        """The statistic (episode, sample) of what is felt, less rest (episode, sample, sensor)
        [rad]; 0 until there are enough samples."""
        seen = np.cumsum(np.asarray(felt, dtype=float) @ self.shapes.T, axis=1)
        seen[:, self.samples :] -= seen[:, : -self.samples].copy()
        found = (seen**2).sum(axis=2) / (self.samples * self.noise**2)
        found[:, : self.samples - 1] = 0.0
        return found

    def notice(self, felt: np.ndarray) -> np.ndarray:
        """Sample at which contact is noticed (episode,); the number of samples where it never is."""
        beyond = self.measure(felt) > self.limit
        return np.where(beyond.any(axis=1), beyond.argmax(axis=1), beyond.shape[1])


@checked
def make_noticer(
    recorded: Recorded,
    noise: Annotated[float, "> 0"],
    *,
    shapes: Annotated[int, "> 0"] = SHAPES,
    samples: Annotated[int, "> 0"] = SAMPLES,
    false_alarms: float = FALSE,
) -> Noticer:
    """A Noticer for touches like those recorded.

    Parameters
    ----------
    false_alarms
        Greatest share of episodes as long as those recorded in which contact is noticed without
        any, in (0, 1). Bonferroni's bound over all samples, so that the true share is smaller.

    Raises
    ------
    InvalidInput
        Nothing in contact, or a share that is none.
    """
    if not 0 < false_alarms < 1:
        raise InvalidInput(f"false_alarms must be a share in (0, 1), got {false_alarms}.")
    touched = recorded.angle[recorded.touching]
    if len(touched) < shapes:
        raise InvalidInput(
            "the episodes hold no contact to learn from; record longer ones, or bodies that move."
        )
    found = np.linalg.svd(
        touched[:: max(1, len(touched) // 5000)].astype(float), full_matrices=False
    )[2][:shapes]
    limit = float(chi2.isf(false_alarms / recorded.angle.shape[1], shapes))
    return Noticer(shapes=found, noise=noise, samples=samples, limit=limit)
