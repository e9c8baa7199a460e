"""The speed of active touch: from tracked trials to the equivalent lateral speed of the antenna."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from feeler.errors import InvalidInput
from feeler.records.checked import checked
from feeler.tracking.angle import SIDES, compute_antenna_angle
from feeler.tracking.speed import CUTOFF, MIN_PROMINENCE, Sweeps, find_sweeps
from feeler.tracking.tracks import Tracks

_ANTENNA_LENGTH = 42.0  # [D] mm


@dataclass(frozen=True, kw_only=True, eq=False)
class Exploration:
    """Average maximum angular speeds of several trials.

    Attributes
    ----------
    mean_peak : np.ndarray
        (trial, side) [rad/ms]; NaN where a side made no sweep.
    n_peaks : np.ndarray
        (trial, side).
    sweeps : tuple[tuple[Sweeps, Sweeps], ...]
        Motion of (left, right) in each trial.
    length : float
        Antenna length [mm].
    error : np.ndarray
        (trial, side) one standard error of ``mean_peak`` [rad/ms]: the peaks' spread over √n, and
        the noise of one speed, by about which a peak, the largest of several noisy values, comes
        out too high.
    source : str
        ``tracked``, or ``synthetic`` if any trial is made up.
    """

    mean_peak: np.ndarray
    n_peaks: np.ndarray
    sweeps: tuple[tuple[Sweeps, Sweeps], ...]
    length: float
    error: np.ndarray
    source: str

    @property
    def mean(self) -> float:
        """Average over trials and sides [rad/ms]."""
        return float(np.nanmean(self.mean_peak))

    @property
    def lateral_speed(self) -> float:
        """Equivalent lateral speed of the tip, mean · length [mm/ms = m/s]."""
        return self.mean * self.length


@checked
def measure_exploration(
    trials: Sequence[Tracks],
    *,
    length: float = _ANTENNA_LENGTH,
    cutoff: float = CUTOFF,
    max_gap: int = 0,
    min_prominence: float = MIN_PROMINENCE,
    landmarks: Mapping[str, Any] | None = None,
) -> Exploration:
    """Average maximum angular speed per trial and side, and the lateral speed that it amounts to.

    Per trial and side: angle between antenna and body, second-order zero-phase Butterworth
    low-pass, derivative, peaks of the absolute speed, their mean (Supplementary Methods, antenna
    slow exploration speed).

    Parameters
    ----------
    trials
        Tracks with the landmarks left_tip, right_tip, head, abdomen.
    length
        Antenna length [mm].
    cutoff, max_gap, min_prominence
        Low-pass [kHz], longest gap bridged by a straight line [frames], least prominence of a peak
        [rad/ms]; none is stated in the paper. A gap that is left open cuts the motion in two, and
        its ends give false peaks or hide true ones.
    landmarks
        What the landmarks are called, as for :func:`compute_antenna_angle`: ``tips``, ``bases``,
        ``head``, ``abdomen``.

    Raises
    ------
    InvalidInput
        No trial, or not one peak in any of them.
    """
    if not trials:
        raise InvalidInput("measure_exploration needs at least one trial, got none.")
    if not (np.isfinite(length) and length > 0):
        raise InvalidInput(f"length must be > 0 mm, got {length}.")
    options: dict[str, Any] = {
        "cutoff": cutoff,
        "max_gap": max_gap,
        "min_prominence": min_prominence,
    }

    def find(tracks: Tracks) -> tuple[Sweeps, Sweeps]:
        one, other = compute_antenna_angle(tracks, **(landmarks or {}))
        return find_sweeps(one, tracks.interval, **options), find_sweeps(
            other, tracks.interval, **options
        )

    sweeps = tuple(find(tracks) for tracks in trials)
    mean_peak = np.array([[side.mean_peak for side in pair] for pair in sweeps])
    if np.isnan(mean_peak).all():
        raise InvalidInput(
            f"no sweep in {len(trials)} trials × {len(SIDES)} sides: no peak of angular speed rises"
            f" {np.rad2deg(min_prominence) * 1e3:.3g} °/s above its neighbourhood. Is"
            " the frame rate right, and do the tips move?"
        )
    return Exploration(
        mean_peak=mean_peak,
        n_peaks=np.array([[side.peak_speed.size for side in pair] for pair in sweeps]),
        sweeps=sweeps,
        length=float(length),
        error=np.array([[side.error for side in pair] for pair in sweeps]),
        source="synthetic"
        if any(tracks.source == "synthetic" for tracks in trials)
        else "tracked",
    )
