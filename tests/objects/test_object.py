"""Objects: where a trial says, each with a name, none inside the antenna."""

import itertools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from feeler import Ball, BaseMotion, Box, Object, Outline, Trial, Triangle, presets
from feeler.errors import InvalidInput
from feeler.objects import make_object, make_objects, place
from feeler.objects.bodies import check_clear
from feeler.objects.shapes import split_convex
from feeler.objects.trials import trials

ANTENNA = presets.cockroach()
BALL = Ball(radius=1.0)


@pytest.mark.parametrize("side", ["left", "right"])
@pytest.mark.parametrize("approach", [90.0, 63.0])
def test_the_object_of_a_trial_stands_where_the_trial_is_placed(side, approach):
    feature = Outline(vertices=[(0, 0), (-1, 1.5), (-3, 1), (-2, -1)], name="thorn")
    trial = Trial(
        feature=feature,
        location=0.6,
        speed=0.3,
        side=side,
        approach=approach,
        friction=0.4,
        name="left one",
    )
    item, start = make_object(ANTENNA, trial), place(ANTENNA, trial)
    np.testing.assert_array_equal(item.place, start.origin)
    np.testing.assert_array_equal(item.velocity, start.velocity)
    np.testing.assert_array_equal(item.forward, start.forward)
    assert (item.name, item.friction, item.feature, item.turn) == (
        "left one",
        0.4,
        trial.shape,
        0.0,
    )


def test_objects_and_trials_may_stand_together():
    trial = Trial(feature=Triangle(half_width=1), location=0.5, speed=0.3)
    made = make_objects(ANTENNA, [trial, Object(feature=BALL, place=(8, 20))])
    assert [item.name for item in made] == ["triangle", "ball"]
    assert made[0] == make_object(ANTENNA, trial)


@pytest.mark.parametrize(
    ("objects", "match"),
    [
        ([Object(feature=BALL, place=(5, 5))] * 2, "two objects are called 'ball'"),
        ([Object(feature=BALL, place=(0.9, 20))], "'ball' starts inside the antenna"),
        ([BALL], "objects must be a list of Object objects or Trial objects, got"),
        (
            [
                Trial(feature=BALL, location=0.5, speed=0.3, base=base)
                for base in (None, BaseMotion(turn=0.001))
            ],
            "in different ways",
        ),
    ],
)
def test_objects_that_cannot_be_are_refused(objects, match):
    with pytest.raises(InvalidInput, match=match):
        make_objects(ANTENNA, objects)


@pytest.mark.parametrize(
    ("fields", "match"),
    [
        ({"feature": "ball"}, "feature must be a ball, box"),
        ({"place": (np.nan, 0)}, r"place must be 2 numbers"),
        ({"place": 3}, "place must be 2 numbers"),
        ({"forward": (1, 1)}, "forward must be a unit vector"),
        ({"velocity": (1, 2, 3, 4)}, "velocity must be 2 numbers or 3 numbers"),
        ({"turn": np.inf}, "turn must be finite"),
        ({"friction": -1}, "friction must be ≥ 0"),
        ({"name": 3}, "name must be text"),
    ],
)
def test_bad_fields_are_named(fields, match):
    with pytest.raises(InvalidInput, match=match):
        Object(**({"feature": BALL, "place": (5, 5)} | fields))


@pytest.mark.parametrize(
    ("pose", "hit"),
    [
        (None, False),
        ((0.0, 0.0, 0.0), False),
        ((1.0, 0.0, 0.0), True),
        ((0.0, 20.0, np.pi / 2), True),
    ],
)
def test_a_ball_beside_an_antenna_at_the_origin_is_clear_of_it_and_not_of_one_on_a_base_elsewhere(
    pose, hit
):
    """Its surface is 0.7 mm beside an antenna that stands along +y, 20 mm from the base."""
    ball = Object(feature=BALL, place=(0.7, 20.0), forward=(-1.0, 0.0))
    more = {} if pose is None else {"pose": pose}
    if hit:
        with pytest.raises(InvalidInput, match="starts inside the antenna"):
            check_clear(ANTENNA, [ball], **more)
    else:
        check_clear(ANTENNA, [ball], **more)


def test_what_is_clear_at_the_start_may_be_met_a_millisecond_later():
    carried = Trial(feature=BALL, location=0.5, speed=0.3, base=BaseMotion(velocity=(1.0, 0.0)))
    near = Object(feature=BALL, place=(0.7, 20.0), forward=(-1.0, 0.0), name="near")
    assert [item.name for item in make_objects(ANTENNA, [carried, near])] == [BALL.name, "near"]


@pytest.mark.parametrize("forward", [(1.0, 0.0), (0.0, -1.0), (0.6, 0.8)])
@pytest.mark.parametrize(
    ("feature", "back"),
    [(Ball(radius=1.5), 1.5), (Box(half_width=1.0, half_height=2.0, rounding=0.5), 2.5)],
)
def test_an_object_stands_with_its_foremost_point_at_its_place(feature, back, forward):
    item = Object(feature=feature, place=(3.0, -1.0), forward=forward)
    np.testing.assert_allclose(item.centre + back * np.array(forward), item.place, atol=1e-12)


def test_an_object_in_the_antenna_is_told_where_its_middle_is():
    item = Object(feature=Ball(radius=2.0), place=(1.0, 20.0))
    with pytest.raises(
        InvalidInput, match=r"foremost point, and its middle is at \(-1, 20\) mm"
    ):
        make_objects(presets.cockroach(), [item])


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


def test_ninety_touches_are_six_features_at_five_places_and_three_speeds():
    """Speeds [P]; half-sizes and places [C], the first place [D]."""
    found = trials()
    kinds = {
        (
            t.feature.kind,
            t.feature.size,
            getattr(t.feature, "half_height", None),
            t.feature.rounding,
        )
        for t in found
    }
    assert kinds == {
        *((("ball", size, None, size)) for size in (1.5, 3.0)),
        *(((kind, size, size, 0.0)) for kind in ("box", "triangle") for size in (1.5, 3.0)),
    }
    assert len(found) == 90
    grid = {(t.feature.kind, t.feature.size, t.location, t.speed) for t in found}
    expected = itertools.product(
        ("ball", "box", "triangle"), (1.5, 3.0), (0.5, 0.6, 0.7, 0.8, 0.9), (0.6, 0.3, 0.06)
    )
    assert grid == set(expected)
