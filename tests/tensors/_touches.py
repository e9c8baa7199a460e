"""A small set of real touches, the same here and in the processes that get killed."""

import json

import numpy as np

import feeler
from feeler.objects.shapes import make_feature

N_TRIALS = 24
N = 12
antenna = feeler.Antenna(
    segment_length=np.full(N, 2.0),
    segment_mass=1e-4,
    radius=0.2,
    stiffness=0.5 * np.exp(-0.2 * np.arange(N)),
    damping=0.3,
    name="small",
)
trials = [
    feeler.Trial(
        feature=make_feature(("ball", "box", "triangle")[i % 3], 1.0),
        location=0.5 + 0.01 * i,
        speed=0.3,
    )
    for i in range(N_TRIALS)
]
options = {"duration": 60.0, "timestep": 0.02, "seed": 3}


def run(**changes):
    """The tensors of the set."""
    return feeler.touch(antenna, trials, **{**options, **changes})


def pick(tensors, indices):
    """Some of the trials, as a run of these alone gives them."""
    made = json.loads(tensors.attrs["trials"])
    return tensors.isel(trial=indices).assign_attrs(
        trials=json.dumps([made[n] for n in indices], sort_keys=True)
    )
