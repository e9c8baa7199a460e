"""A small store of made-up touches: each trial's angle tells which trial it is."""

import numpy as np
import pytest

from feeler.tensors import make_tensors
from feeler.tensors.store import _save_store

N, SENSORS, SAMPLES = 600, 4, 5


def make_touches(n=N):
    rng = np.random.default_rng(0)
    angle = np.zeros((n, SENSORS, SAMPLES))
    angle += np.arange(n)[:, None, None]
    trials = {
        "feature": [("ball", "box", "triangle")[k % 3] for k in range(n)],
        "size": rng.uniform(1, 3, n),
        "location": rng.uniform(0.4, 0.9, n),
        "speed": [0.3] * n,
        "antenna": [f"exponential {k % 30}" for k in range(n)],
        "source": ["simulation"] * n,
        "seed": range(n),
    }
    sensors = {
        "segment": range(1, SENSORS + 1),
        "position": np.arange(SENSORS) / SENSORS,
        "segment_length": np.ones(SENSORS),
    }
    return make_tensors(
        time=np.arange(float(SAMPLES)), angle=angle, trials=trials, dtype="float32", **sensors
    )


@pytest.fixture(scope="session")
def store(tmp_path_factory):
    path = tmp_path_factory.mktemp("learn") / "set.zarr"
    _save_store(make_touches().drop_vars("curvature"), path, group_size=64)
    return path
