"""Tensors with known bases, on which the encoder is judged beside torchnmf.

Four kinds of bases, three of each, 56 sensors and 40 lags: thirty trials of 380 samples in which
each basis is played three times. The seeds of DEVELOPMENT are for finding out what works. Those of
JUDGED are run once the method stands, and their figures are the ones that are printed
(benchmarks/encoding.py). Both were written down before either was run.
"""

from collections.abc import Callable

import numpy as np

N_COMPONENTS, N_SENSORS, N_LAGS, N_TRIALS, N_TIMES = 3, 56, 40, 30, 380
DEVELOPMENT = (5, 6)
JUDGED = (21, 22)
STARTS, THEIR_STARTS = 5, 1  # of each kind and seed, so forty of ours in all
PLACE, LAG = np.arange(N_SENSORS)[:, None], np.arange(N_LAGS)[None, :]


def decay(rng: np.random.Generator) -> np.ndarray:
    """Bumps that begin at once, travel towards the tip and fade: (component, sensor, lag)."""
    return np.stack(
        [
            np.exp(-0.5 * ((PLACE - 12 - 14 * i - 0.15 * LAG) / 4) ** 2) * np.exp(-LAG / 15)
            for i in range(N_COMPONENTS)
        ]
    )


def swell(rng: np.random.Generator) -> np.ndarray:
    """Bumps that swell, each at its own pace, and end suddenly with the last lag."""
    return np.stack(
        [
            np.exp(-0.5 * ((PLACE - rng.uniform(5, 50)) / rng.uniform(3, 6)) ** 2)
            * np.exp((LAG - N_LAGS) / rng.uniform(6, 20))
            for _ in range(N_COMPONENTS)
        ]
    )


def blobs(rng: np.random.Generator) -> np.ndarray:
    """Three smooth blobs in each basis, anywhere between the first and the last lags."""
    bases = np.zeros((N_COMPONENTS, N_SENSORS, N_LAGS))
    for basis in bases:
        for _ in range(3):
            height, place, lag = rng.uniform(0.3, 1), rng.uniform(3, 53), rng.uniform(8, 32)
            basis += height * np.exp(-0.5 * ((PLACE - place) ** 2 + (LAG - lag) ** 2) / 16)
    return bases


def waves(rng: np.random.Generator) -> np.ndarray:
    """Pulses that run over much of the antenna, either way, through all lags."""
    bases = []
    for _ in range(N_COMPONENTS):
        start, end, width = rng.uniform(5, 50), rng.uniform(5, 50), rng.uniform(2, 5)
        path = start + (end - start) * LAG / (N_LAGS - 1)
        bases.append(np.exp(-0.5 * ((PLACE - path) / width) ** 2) * rng.uniform(0.5, 1))
    return np.stack(bases)


KINDS: dict[str, Callable[[np.random.Generator], np.ndarray]] = {
    kind.__name__: kind for kind in (decay, swell, blobs, waves)
}


def plant(kind: str, seed: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Tensors (trial, sensor, time) with noise of up to 0.01, their bases and their activations."""
    rng = np.random.default_rng([seed, list(KINDS).index(kind)])
    bases = KINDS[kind](rng)
    activations = np.zeros((N_TRIALS, N_COMPONENTS, N_TIMES))
    tensors = np.zeros((N_TRIALS, N_SENSORS, N_TIMES))
    for trial, tensor in zip(activations, tensors, strict=True):
        for row, basis in zip(trial, bases, strict=True):
            for moment in rng.integers(0, N_TIMES - 50, 3):
                strength = rng.uniform(0.2, 1)
                row[moment] += strength
                tensor[:, moment : moment + N_LAGS] += strength * basis
    return tensors + 0.01 * rng.random(tensors.shape), bases, activations
