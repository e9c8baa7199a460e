"""Placement in closed form, against the slow and obvious: bisection on the clearance."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import brentq

from feeler import Antenna, Ball, BaseMotion, Box, Outline, Trial, Triangle, Wall, presets
from feeler.errors import InvalidInput
from feeler.objects import place
from feeler.objects.distance import compute_clearance

STRAIGHT = presets.cockroach()
HOOK = ((0.0, 0.1), (-2.0, 1.5), (-1.0, 0.3), (-3.0, -1.0), (-1.0, -1.2))
FEATURES = [
    Ball(radius=1.53),
    Box(half_width=1.5, half_height=1.0, rounding=0.2),
    Triangle(half_width=3.0),
    Outline(vertices=HOOK, rounding=0.1),
    Wall(),
    Wall(profile=[(-6, 0.0), (-2, 1.0), (0, 0.5), (1, 2.0), (6, 0.0)]),
]


def bend(curve, n=30, taper=0.0):
    radius = 0.2 - taper * np.linspace(0, 0.1, n)
    same = {"segment_mass": 1e-5, "stiffness": 1.0, "damping": 1.0}
    return Antenna(
        segment_length=np.ones(n), radius=radius, rest_angle=np.full(n, curve), **same
    )


ANTENNAS = {
    "straight": STRAIGHT,
    "tapered": bend(0.0, taper=1.0),
    "bent": bend(0.02, taper=1.0),
}


def bisect(antenna, trial):
    """The distance back at which the clearance is 0, from first overlap outwards."""
    start = place(antenna, trial)
    target = start.origin + start.velocity * trial.lead  # on the line of motion
    points = antenna.shape()

    def gap(back):
        return compute_clearance(
            points, antenna.radius, trial.shape, target - back * start.forward, start.forward
        )

    low, high = -0.5, 0.5
    assert gap(low) < 0 < gap(high)
    return target - brentq(gap, low, high, xtol=1e-14, rtol=1e-14) * start.forward


@pytest.mark.parametrize("antenna", ANTENNAS.values(), ids=ANTENNAS)
@pytest.mark.parametrize("feature", FEATURES, ids=lambda f: f.name)
@pytest.mark.parametrize(
    ("approach", "side"), [(90.0, "left"), (61.7, "left"), (105.3, "right")]
)
def test_the_closed_form_is_where_bisection_ends(antenna, feature, approach, side):
    trial = Trial(
        feature=feature, location=0.63, speed=0.3, lead=2.0, approach=approach, side=side
    )
    start = place(antenna, trial)
    np.testing.assert_allclose(
        start.origin + 2.0 * start.velocity, bisect(antenna, trial), atol=1e-11
    )
    assert np.hypot(*start.forward) == pytest.approx(1.0, abs=1e-15)
    np.testing.assert_allclose(start.velocity, 0.3 * start.forward)


@settings(max_examples=40, deadline=None)
@given(
    st.lists(st.tuples(st.floats(-3, 3), st.floats(-3, 3)), min_size=4, max_size=8),
    st.floats(0.2, 1.0),
    st.floats(30, 150),
    st.floats(0.0, 0.5),
)
def test_any_convex_outline_touches_when_it_should(points, location, approach, rounding):
    from scipy.spatial import ConvexHull, QhullError

    try:
        corners = np.array(points)[ConvexHull(points, qhull_options="QJ").vertices]
        feature = Outline(
            vertices=corners - [0.0, corners[np.argmax(corners[:, 0]), 1]], rounding=rounding
        )
    except (QhullError, InvalidInput):
        return
    trial = Trial(feature=feature, location=location, speed=0.3, approach=approach)
    start, points, radius = place(STRAIGHT, trial), STRAIGHT.shape(), STRAIGHT.radius

    def gap(time):
        return compute_clearance(
            points, radius, feature, start.origin + time * start.velocity, start.forward
        )

    assert gap(5.0) == pytest.approx(0.0, abs=1e-9)
    assert min(gap(time) for time in np.linspace(0, 4.99, 20)) > 0


@pytest.mark.parametrize("feature", FEATURES, ids=lambda f: f.name)
@pytest.mark.parametrize(
    "base", [None, BaseMotion(velocity=(0.1, 0.2), turn=0.003)], ids=["clamped", "moving"]
)
def test_the_right_side_is_the_mirror_image_to_the_last_bit(feature, base):
    left, right = (
        place(
            STRAIGHT,
            Trial(feature=feature, location=0.6, speed=0.3, approach=70, side=side, base=base),
        )
        for side in ("left", "right")
    )
    for name in ("origin", "forward", "velocity"):
        np.testing.assert_array_equal(getattr(right, name), getattr(left, name) * [-1, 1])
    assert right.heading == -left.heading


def test_a_hook_is_met_inside_where_it_is_open_and_refused_behind_itself():
    """A J: the feature starts in its mouth; with a long lead it would start behind the other
    arm.
    """
    angle = np.zeros(40)
    angle[15:25] = np.pi / 10
    hook = bend(0.0, n=40).replace(rest_angle=angle)
    trial = Trial(feature=Ball(radius=0.5), location=0.3, speed=0.5, lead=2.0, side="right")
    start = place(hook, trial)
    assert 0.7 < start.origin[0] < 4.0
    with pytest.raises(InvalidInput, match="meets another part of it first"):
        place(
            hook,
            Trial(feature=Ball(radius=0.5), location=0.3, speed=0.5, lead=40.0, side="right"),
        )


def test_a_feature_that_passes_by_is_refused():
    off = Outline(vertices=[(0, 30), (-1, 31), (-1, 30)])
    with pytest.raises(InvalidInput, match="misses the antenna"):
        place(STRAIGHT, Trial(feature=off, location=0.9, speed=0.3))


WALK = np.linspace(0, 20, 9)
PATH = BaseMotion(
    time=WALK, pose=np.stack([3 + 0.1 * WALK, np.sin(WALK / 9), 0.3 - 0.01 * WALK], axis=1)
)


@pytest.mark.parametrize(
    "base",
    [BaseMotion(velocity=(0.05, -0.1), turn=0.004), BaseMotion(velocity=(-0.2, 0.3)), PATH],
)
@pytest.mark.parametrize("side", ["left", "right"])
def test_contact_with_a_carried_antenna_begins_after_the_lead(base, side):
    trial = Trial(
        feature=Triangle(half_width=1.5),
        location=0.7,
        speed=0.4,
        lead=5.0,
        base=base,
        side=side,
    )
    start = place(STRAIGHT, trial)

    def gap(time):
        ((x, y, turn),) = trial.base_motion.compute_pose(np.array([time]))
        points = STRAIGHT.shape(base_angle=turn) + np.array([x, y])
        origin = start.origin + time * start.velocity
        return compute_clearance(points, STRAIGHT.radius, trial.shape, origin, start.forward)

    assert gap(5.0) == pytest.approx(0.0, abs=1e-9)
    assert min(gap(time) for time in np.linspace(0, 4.99, 20)) > 0


def test_a_base_that_flees_is_refused():
    trial = Trial(
        feature=Ball(radius=1.0), location=0.5, speed=0.1, base=BaseMotion(velocity=(0.5, 0.0))
    )
    with pytest.raises(InvalidInput, match="base moves away"):
        place(STRAIGHT, trial)


@settings(max_examples=60, deadline=None)
@given(
    st.integers(3, 6),
    st.floats(0.0, 2 * np.pi),
    st.floats(0.3, 1.0),
    st.floats(30, 150),
    st.floats(-0.06, 0.06),
)
def test_any_corner_may_be_the_first(n, turn, location, approach, curve):
    """A bent antenna's kinks and tip meet any face of a polygon that is drawn from any of its
    corners.
    """
    angle = turn + 2 * np.pi * np.arange(n) / n
    corners = 4.0 * np.stack([np.cos(angle), np.sin(angle)], axis=-1)
    antenna, found = bend(curve), []
    for first in range(n):
        trial = Trial(
            feature=Outline(vertices=np.roll(corners, first, axis=0)),
            location=location,
            speed=0.3,
            approach=approach,
        )
        try:
            found.append(place(antenna, trial).origin)
        except InvalidInput:
            found.append([np.nan, np.nan])
    np.testing.assert_allclose(found, np.broadcast_to(found[0], (n, 2)), rtol=0, atol=1e-9)
