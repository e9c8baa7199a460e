"""Touches that are made by hand: two lumps of bending that wander along the antenna."""

import numpy as np

from feeler.tensors import make_tensors

POSITION = np.array([0.1, 0.25, 0.45, 0.7, 0.95])


def make_bent(n=3, steps=90, step=1.0, lead=10.0):
    """A Dataset of ``n`` touches whose bending has both signs [rad]."""
    time = step * np.arange(steps)
    since = np.maximum(time - lead, 0)
    place = np.linspace(0.3, 0.8, n)[:, None, None]
    near = np.exp(-(((POSITION[None, :, None] - place) / 0.2) ** 2))
    bend = near * (0.06 * np.sin(since / 17) + 0.02 * np.tanh(since / 5))
    trials = {
        "feature": ["ball"] * n,
        "size": [1.5] * n,
        "location": place[:, 0, 0],
        "speed": [0.3] * n,
        "antenna": ["made"] * n,
        "source": ["simulation"] * n,
        "seed": np.arange(n),
        "lead": [lead] * n,
    }
    return make_tensors(
        time=time,
        segment=np.arange(1, POSITION.size + 1),
        position=POSITION,
        segment_length=np.full(POSITION.size, 0.3),
        trials=trials,
        angle=bend,
    )
