"""Small tensors with known truths."""

import numpy as np
import pytest

from feeler.encoding import ConvolutiveNMF, reconstruct


def make_touches(n_trials=12, n_sensors=14, n_times=90, seed=0):
    """Bumps that travel along the sensors, each for a while: what touches look like."""
    rng = np.random.default_rng(seed)
    sensor, time = np.arange(n_sensors)[:, None], np.arange(n_times)[None, :]
    tensors = []
    for trial in range(n_trials):
        onset, last = rng.integers(5, 25), rng.integers(15, 45)
        phase = (time - onset) / last
        place = n_sensors * (0.2 + 0.6 * (trial % 3) / 2) + 2 * phase
        envelope = np.where(
            (phase > 0) & (phase < 1), np.sin(np.pi * np.clip(phase, 0, 1)) ** 2, 0
        )
        tensors.append(np.exp(-0.5 * ((sensor - place) / 1.5) ** 2) * envelope)
    return np.array(tensors)


@pytest.fixture
def touches():
    return make_touches()


@pytest.fixture(scope="session")
def planted():
    """Tensors made of three bases, played at few moments that keep apart: (tensors, bases,
    activations).
    """
    rng = np.random.default_rng(5)
    bases = rng.random((3, 12, 8)) * (
        rng.random((3, 12, 8)) < 0.3
    )  # smooth ones could trade width with activations
    activations = np.zeros((15, 3, 80))
    for trial in activations:
        for row in trial:
            row[rng.choice(np.arange(4, 70), 3, replace=False)] = rng.uniform(0.5, 2, 3)
    return reconstruct(bases, activations), bases, activations


@pytest.fixture(scope="session")
def fitted():
    """An encoder of the touches."""
    return ConvolutiveNMF(3, 12, random_state=0, n_restarts=2, tol=1e-3).fit(make_touches())
