"""The surrogate's electronics: from true hinge angles to the capacitances of a real device."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from feeler.compiled import compiled
from feeler.errors import InvalidInput
from feeler.robot.gap import Gap
from feeler.robot.sensor import SensorCalibration, fit_sensors

_BASE = 5.0  # [C] pF of a straight hinge
_SENSITIVITY = 1.2  # [C] pF/rad
_SPREAD = 0.15  # [C] sd of base and sensitivity between hinges, as a share
_BEND_ANGLE = 0.35  # rad at which Gap.bend is stated
_BENCH_RANGE = np.deg2rad(40.0)  # [C] rad
_BENCH_LEVELS, _BENCH_REPEATS = 17, 6  # [C]
_BENCH_INTERVAL = 500.0  # [C] ms between readings


@dataclass(frozen=True, kw_only=True, eq=False)
class Sensing:
    """Eight capacitive channels with their faults; arrays are (hinge,).

    Attributes
    ----------
    base : np.ndarray
        Capacitance of the straight hinge [pF].
    sensitivity : np.ndarray
        Capacitance per angle [pF/rad].
    gain : np.ndarray
        Gain during recordings relative to the calibration bench [1].
    """

    base: np.ndarray
    sensitivity: np.ndarray
    gain: np.ndarray
    gap: Gap

    def read(
        self, angle: np.ndarray, rng: np.random.Generator, *, on_bench: bool = False
    ) -> np.ndarray:
        """Capacitances (hinge, sample) [pF] of true angles (hinge, sample) [rad] at 1 kHz.

        In order: hysteresis (a play operator), cross-talk from neighbours, bent characteristic,
        gain, wander, noise, quantisation. On the bench the gain is 1 and nothing wanders.
        """
        gap = self.gap
        if len(angle) != len(self.base):
            raise InvalidInput(
                f"the robot senses {len(self.base)} hinges, got angles of {len(angle)}."
            )
        seen = play(np.ascontiguousarray(angle, dtype=float), gap.hysteresis)
        seen = seen + gap.crosstalk * _sum_neighbours(seen)
        signal = seen * (1 + gap.bend * seen / _BEND_ANGLE)
        if not on_bench:
            signal = signal * self.gain[:, None]
            signal = signal + np.cumsum(
                gap.drift / np.sqrt(1000) * rng.standard_normal(signal.shape), axis=1
            )
        signal = signal + gap.noise * rng.standard_normal(signal.shape)
        capacitance = self.base[:, None] + self.sensitivity[:, None] * signal
        step = gap.quantum * _SENSITIVITY
        return np.round(capacitance / step) * step if step > 0 else capacitance

    def bench(self, rng: np.random.Generator) -> dict[str, Any]:
        """A calibration table (reading,).

        Each hinge is bent by itself through known angles, up and down, several times.

        Keys ``hinge``, ``angle`` [rad], ``capacitance`` [pF], ``time`` [ms].
        """
        up = np.linspace(-_BENCH_RANGE, _BENCH_RANGE, _BENCH_LEVELS)
        angles = np.tile(np.concatenate([up, up[::-1]]), _BENCH_REPEATS)
        n = self.base.size
        readings = []
        for hinge in range(n):
            bent = np.zeros((n, angles.size))
            bent[hinge] = angles
            readings.append(self.read(bent, rng, on_bench=True)[hinge])
        return {
            "hinge": np.repeat(np.arange(1, n + 1), angles.size),
            "angle": np.tile(angles, n),
            "capacitance": np.concatenate(readings),
            "time": np.arange(n * angles.size) * _BENCH_INTERVAL,
        }

    def calibrate(self, rng: np.random.Generator, robot: str) -> SensorCalibration:
        """The lines that a user of this robot would fit to a bench table."""
        return fit_sensors(**self.bench(rng), robot=robot)


def draw_sensing(gap: Gap, n_hinges: int, rng: np.random.Generator) -> Sensing:
    """Channels drawn at random."""
    return Sensing(
        base=_BASE * np.exp(_SPREAD * rng.standard_normal(n_hinges)),
        sensitivity=_SENSITIVITY * np.exp(_SPREAD * rng.standard_normal(n_hinges)),
        gain=np.exp(gap.gain * rng.standard_normal(n_hinges)),
        gap=gap,
    )


@compiled
def play(signal: np.ndarray, half_width: float) -> np.ndarray:
    """Play (backlash) operator on each row: the output moves only when an end of the gap pushes it.

    ``y_t = min(max(y_{t−1}, x_t − r), x_t + r)`` from y_0 = x_0, r = ``half_width``.
    """
    moved = np.empty_like(signal)
    for row in range(signal.shape[0]):
        y = signal[row, 0]
        for t in range(signal.shape[1]):
            x = signal[row, t]
            y = min(max(y, x - half_width), x + half_width)
            moved[row, t] = y
    return moved


def _sum_neighbours(signal: np.ndarray) -> np.ndarray:
    total = np.zeros_like(signal)
    total[1:] += signal[:-1]
    total[:-1] += signal[1:]
    return total
