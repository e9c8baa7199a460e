"""Drawings show touches as they were: the moments, the sensors and the way of the object."""

import numpy as np
import pytest
from matplotlib.colors import Normalize
from matplotlib.figure import Figure

from feeler.experiments.tactile import touch
from feeler.objects import Ball, Trial
from feeler.presets import cockroach
from feeler.tensors.transforms import compute_bend, reconstruct_posture
from paper.fig1_touch import draw_moment


@pytest.fixture(scope="module")
def touched():
    """An antenna, a touch of it and what its sensors recorded."""
    trial = Trial(feature=Ball(radius=1.5), location=0.5, speed=0.6)
    return cockroach(), trial, touch(cockroach(), trial, duration=40.0)


def test_the_antenna_stands_where_the_touch_has_bent_it(touched):
    antenna, trial, tensors = touched
    ax, now = Figure().subplots(), 25
    drawn = draw_moment(antenna, trial, tensors, now, ax, Normalize(0, 1))
    points = np.array(drawn.colours.get_segments())
    truth = reconstruct_posture(tensors, antenna).values[0, now]
    np.testing.assert_allclose(points[:, 0], truth[:-1])
    np.testing.assert_allclose(drawn.colours.get_array(), compute_bend(tensors, antenna)[now])
    place = ax.patches[0].get_path().vertices.mean(axis=0)
    assert abs(place[1] - 0.5 * antenna.length) < 0.5  # mm, it flies on at this height
