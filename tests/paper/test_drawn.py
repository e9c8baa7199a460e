"""Drawings show touches as they were: the moments, the sensors and the way of the object."""

import numpy as np
import pytest
from matplotlib.colors import Normalize
from matplotlib.figure import Figure

from feeler.experiments.tactile import touch
from feeler.objects import Ball, Box, Trial
from feeler.plotting.tensors import take_curvature
from feeler.presets import cockroach
from feeler.tensors.transforms import compute_bend, in_unit, reconstruct_posture
from paper.fig1 import count_active
from paper.fig1_touch import choose_moments, draw_moment, find_touch


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


def test_bends_at_sensors_are_the_curvatures_that_were_recorded(touched):
    antenna, _, tensors = touched
    felt = compute_bend(tensors, antenna)[:, antenna.sensors - 1].T
    np.testing.assert_allclose(felt, take_curvature(tensors)[0], atol=1e-12)


def test_moments_lie_at_even_distances_while_the_touch_is_felt():
    tensor = np.zeros((3, 100))
    tensor[1, 20:81] = 1.0
    assert choose_moments(tensor, 4) == [20, 40, 60, 80]
    assert choose_moments(np.zeros((3, 11)), 3) == [0, 5, 10]  # nothing felt: the whole time


def test_active_is_what_passes_the_threshold(touched):
    _, _, tensors = touched
    angle = in_unit(tensors["angle"], "rad").transpose("trial", "time", "sensor").values[0]
    for threshold in (0.001, 0.05):
        np.testing.assert_array_equal(count_active(tensors, threshold), angle > threshold)


def test_the_greatest_of_the_first_kind_nearest_the_base_is_shown():
    things = [Ball(radius=1.0), Ball(radius=2.0), Box(half_width=3.0, half_height=3.0)]
    touches = [
        Trial(feature=thing, location=place, speed=speed)
        for speed in (0.6, 0.06)
        for place in (0.9, 0.5)
        for thing in things
    ]
    found = touches[find_touch(touches, 0.06)]
    assert (found.feature, found.location, found.speed) == (things[1], 0.5, 0.06)
