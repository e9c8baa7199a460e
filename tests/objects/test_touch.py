"""Laws of features, trials and where they start."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from feeler import Ball, Outline, Trial, Wall, presets
from feeler.errors import InvalidInput
from feeler.objects import make_feature, place
from feeler.objects.shapes import split_convex

ANTENNA = presets.cockroach()


def test_ball_meets_the_surface_at_the_location():
    start = place(ANTENNA, Trial(feature=Ball(radius=1.53), location=0.5, speed=0.6))
    np.testing.assert_allclose(start.origin, [-(0.225 + 0.6 * 5.0), 21.0], atol=1e-9)


@pytest.mark.parametrize(
    ("fields", "message"),
    [
        (
            {"location": 0.0},
            r"location must be > 0 and ≤ 1 \(a fraction of the length\), got 0",
        ),
        ({"location": 1.1}, "location"),
        ({"speed": 0.0}, "speed must be > 0"),
        ({"speed": np.nan}, "speed"),
        ({"lead": -1.0}, "lead must be > 0"),
        ({"approach": 180.0}, "approach"),
        ({"side": "top"}, "left, right"),
        ({"friction": -0.1}, "friction must be ≥ 0"),
        ({"feature": "ball"}, "ball, box, triangle, outline, wall"),
    ],
)
def test_bad_trials_are_named(fields, message):
    with pytest.raises(InvalidInput, match=message):
        Trial(**({"feature": Ball(radius=1.0), "location": 0.5, "speed": 0.3} | fields))


def test_feature_bigger_than_the_antenna_is_refused():
    with pytest.raises(InvalidInput, match="bigger than the antenna: ball of half-width 30"):
        place(ANTENNA, Trial(feature=Ball(radius=30.0), location=0.5, speed=0.3))


@pytest.mark.parametrize(
    ("vertices", "message"),
    [
        ([(0, 0), (1, 1), (1, 0), (0, 1)], "self-intersecting"),
        ([(0, 0), (1, 0)], "3 to 1000 points"),
        (
            [(0, 0, 1), (1, 0, 1), (1, 1, 1)],
            r"must be an array \(corner, 2\), got shape \(3, 3\)",
        ),
        ([0, 0, 1, 0, 1, 1], r"got shape \(6,\)"),
        ([(0, 0), (1, 0), (2, 0)], "no area|self-intersecting"),
        ([(0, 0), (0, 0), (1, 1)], "repeats a corner"),
        ([(0, 0), (np.inf, 0), (1, 1)], "finite"),
    ],
)
def test_bad_outlines_are_refused(vertices, message):
    with pytest.raises(InvalidInput, match=message):
        Outline(vertices=vertices)


def test_unknown_feature_lists_the_valid_ones():
    with pytest.raises(InvalidInput, match="ball, box, triangle, outline, wall"):
        make_feature("cube", 1.0)


def test_wall_has_no_size():
    assert Wall().size == np.inf


@settings(max_examples=60, deadline=None)
@given(st.lists(st.floats(0.5, 3.0), min_size=4, max_size=12))
def test_convex_parts_fill_a_star(radii):
    angle = np.linspace(0, 2 * np.pi, len(radii), endpoint=False)
    corners = np.array(radii)[:, None] * np.stack([np.cos(angle), np.sin(angle)], axis=1)

    def area(ring):
        x, y = ring.T
        return np.sum(x * np.roll(y, -1) - y * np.roll(x, -1)) / 2

    parts = split_convex(corners)
    assert sum(area(part) for part in parts) == pytest.approx(area(corners))
    for part in parts:
        before, after = np.roll(part, 1, axis=0) - part, np.roll(part, -1, axis=0) - part
        assert np.all(after[:, 0] * before[:, 1] - after[:, 1] * before[:, 0] >= -1e-12)
