"""Touches that tell nothing: white tensors, one tensor whatever touches, shuffled labels."""

import numpy as np
import xarray as xr

from feeler.tensors.schema import label_units

N_SENSORS, N_TIMES = 12, 190


def make_white(touches, rng, n_times=N_TIMES):
    """Noise of one size, whatever touches, wherever and how fast."""
    return rng.random((len(touches), N_SENSORS, n_times))


def make_one(touches, rng, n_times=N_TIMES):
    """The same blob for every touch."""
    blob = _make_blobs(touches[:1], n_times)
    return np.repeat(blob / blob.max(), len(touches), axis=0)


def make_shuffled(touches, rng, n_times=N_TIMES):
    """A blob for each touch, given to another touch."""
    return _make_blobs(touches, n_times)[rng.permutation(len(touches))]


NOTHING = {"white": make_white, "one": make_one, "shuffled": make_shuffled}


def _make_blobs(touches, n_times):
    """A blob at the place of contact, the later the slower; its width is the object's size."""
    time, sensor = np.arange(n_times), np.arange(N_SENSORS)
    angle = np.zeros((len(touches), N_SENSORS, n_times))
    for k, trial in enumerate(touches):
        width = 1 + trial.feature.size / 2 + (trial.feature.kind == "ball")
        row = np.exp(-0.5 * ((sensor - N_SENSORS * trial.location) / width) ** 2)
        late = 40 + 60 * trial.location + 20 * (trial.speed < 0.1)
        angle[k] = row[:, None] * np.exp(-0.5 * ((time - late) / (10 * width)) ** 2)
    return angle


def make_dataset(touches, angle, rng):
    """A Dataset of touches as :func:`feeler.touch` gives it; force and work are nothing, too."""
    n_times = angle.shape[2]
    force = rng.random((len(touches), n_times, 2))
    force[:, -2:] = 0.0  # each lets go within the recording
    work = np.cumsum(force, axis=1)
    tensor, vector = ("trial", "sensor", "time"), ("trial", "time", "axis")
    known = {
        "feature": [trial.feature.kind for trial in touches],
        "size": [trial.feature.size for trial in touches],
        "location": [trial.location for trial in touches],
        "speed": [trial.speed for trial in touches],
    }
    dataset = xr.Dataset(
        {
            "angle": (tensor, angle),
            "curvature": (tensor, angle),
            "force": (vector, force),
            "work": (("trial", "time", "end"), work),
        },
        coords={"time": np.arange(float(n_times))}
        | {name: ("trial", values) for name, values in known.items()},
    )
    return label_units(dataset)
