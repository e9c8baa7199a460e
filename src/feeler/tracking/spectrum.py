"""Spectrum of an angle: how fast the motion is, and which low-pass keeps it and removes noise."""

import numpy as np
from scipy.signal import periodogram

MIN_FRAMES = 10  # frames of the shortest stretch that is filtered
_N_CANDIDATES = 100
_HIGHEST = (
    0.48  # [C] highest cut-off, as a share of the frame rate (1/2 is the Nyquist frequency)
)
_ABOVE = 4.0  # [C] highest cut-off over the highest frequency of the motion
_OCTAVES = 1 / 3  # [C] width of the bands in which the motion is told from the noise
_OVER = 2.0  # [C] times the noise's power that a band with motion has on top of it
_CHANCE = 6.0  # [C] sd by which a band with motion is louder than noise would be by chance
_MOTION = 1.5  # [C] the motion lies below this multiple of the best cut-off


class MotionSpectrum:
    """Power spectrum of an angle, as motion plus white noise of the tracker.

    The noise density N is the median over the upper half of the frequencies, where a camera that
    is fast enough sees no motion. The best cut-off minimises Stein's unbiased estimate of the
    squared error of the angular speed, Σ (2πf)² [(1 − G)² P + (2 G − 1) N], with P the periodogram
    and G the gain of the filter: what the filter takes from the motion, and what it leaves of the
    noise (Stein 1981, Ann Stat 9:1135). It is at most four times the highest frequency at which
    the motion stands out of the noise, because noise that is not quite white would raise it.

    Attributes
    ----------
    noise : float
        sd of the angle that comes from the tracker [rad].
    best_cutoff : float
        [kHz]
    frequency : float
        Mean frequency of the speed's spectrum [kHz]; NaN where there is no motion above the noise.
    """

    def __init__(self, stretches: list[np.ndarray], interval: float) -> None:
        """``stretches`` of finite angles (frame,) [rad], ``interval`` between frames [ms]."""
        self._interval = interval
        pieces = [piece for piece in stretches if piece.size >= MIN_FRAMES]
        highest = _HIGHEST / interval
        self.noise, self.best_cutoff, self.frequency = 0.0, highest, float("nan")
        self._f = self._weight = self._power = np.zeros(0)
        if not pieces:
            return
        spectra = [
            [
                values[1:-1]
                for values in periodogram(piece, 1 / interval, "hann", detrend="linear")
            ]
            for piece in pieces
        ]
        frequency = self._f = np.concatenate([f for f, _ in spectra])
        self._power = np.concatenate([power for _, power in spectra])
        # a density becomes a variance by the width of a bin; long stretches count more
        self._weight = (2 * np.pi * frequency) ** 2 * np.concatenate(
            [
                np.full(f.size, piece.size * f[0])
                for (f, _), piece in zip(spectra, pieces, strict=True)
            ]
        )
        density = float(np.median(self._power[frequency > 0.25 / interval]) / np.log(2))
        self.noise = float(np.sqrt(0.5 * density / interval))
        lowest = min(3 / (interval * max(piece.size for piece in pieces)), 0.5 * highest)
        highest = max(lowest, min(highest, _ABOVE * _find_edge(spectra, density)))
        candidates = np.geomspace(lowest, highest, _N_CANDIDATES)[::-1]
        error = [
            np.sum(self._weight * ((1 - gain) ** 2 * self._power + (2 * gain - 1) * density))
            for gain in map(self._compute_gain, candidates)
        ]
        self.best_cutoff = float(candidates[np.argmin(error)])
        self._motion = np.where(
            frequency < _MOTION * self.best_cutoff, self._weight * (self._power - density), 0.0
        )
        if (total := self._motion.sum()) > 0:
            self.frequency = float(np.clip(self._motion @ frequency / total, 0, 0.5 / interval))

    def _compute_gain(self, cutoff: float) -> np.ndarray:
        """Gain of :func:`feeler.tracking.speed.smooth` at the spectrum's frequencies."""
        warp = np.tan(np.pi * self._f * self._interval) / np.tan(
            np.pi * cutoff * self._interval
        )
        return 1 / (1 + warp**4)

    def find_loss(self, cutoff: float) -> tuple[float, float]:
        """Share of the speed's rms that a low-pass takes from the motion, and the frequency [kHz]
        at which it takes most.
        """
        if not np.isfinite(self.frequency):
            return 0.0, float("nan")
        gain = self._compute_gain(cutoff)
        kept = np.clip((gain**2 @ self._motion) / self._motion.sum(), 0, 1)
        return float(1 - np.sqrt(kept)), float(self._f[np.argmax((1 - gain**2) * self._motion)])


def _find_edge(spectra: list[list[np.ndarray]], density: float) -> float:
    """Highest frequency [kHz] of a band with motion; 0 without one."""
    frequency = np.concatenate([f for f, _ in spectra])
    power = np.concatenate([p for _, p in spectra])
    band = np.floor(np.log2(frequency / frequency.min()) / _OCTAVES).astype(int)
    count = np.bincount(band)
    mean = np.bincount(band, power) / np.maximum(count, 1)
    least = 1 + np.maximum(_OVER, _CHANCE / np.sqrt(np.maximum(count, 1)))
    loud = np.flatnonzero(mean > least * density)
    return float(frequency[band == loud[-1]].max()) if loud.size else 0.0
