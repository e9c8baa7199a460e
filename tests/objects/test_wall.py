"""Textured walls: parts fill what lies under the profile, whatever its shape, and profiles that are
none are refused.
"""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from feeler import Wall
from feeler.errors import InvalidInput
from feeler.objects.bodies import DEPTH
from feeler.objects.shapes import _is_convex, _measure_area

STEPS = st.lists(st.tuples(st.floats(0.1, 3.0), st.floats(-2.0, 2.0)), min_size=2, max_size=12)


@given(STEPS, st.integers(1, 3))
def test_parts_fill_the_wall_below_the_profile(steps, repeat):
    place = np.cumsum([step for step, _ in steps])
    height = np.array([height for _, height in steps])
    height[-1] = height[0]
    wall = Wall(profile=np.stack([place, height], axis=1), repeat=repeat)
    area = sum(_measure_area(part) for part in wall.parts)
    below = repeat * np.trapezoid(height - height.min() + DEPTH, place)
    assert area == pytest.approx(below)
    assert all(_is_convex(part, slack=1e-9) for part in wall.parts)
    assert max(part[:, 0].max() for part in wall.parts) == 0.0
    assert wall.size == pytest.approx(repeat * np.ptp(place) / 2)


def test_every_place_of_the_profile_is_a_corner_of_the_face():
    profile = np.array([(-3.0, 0.0), (-1.0, 2.0), (0.0, 1.5), (2.0, 1.0)])
    face = np.concatenate(Wall(profile=profile).parts)
    for place, height in profile:
        assert any(np.allclose(corner, (height - 2.0, place)) for corner in face)


def test_two_arrays_and_pairs_are_one_wall():
    place, height = [0.0, 1.0, 2.0], [0.0, 1.0, 0.0]
    assert Wall(profile=(place, height)) == Wall(profile=list(zip(place, height, strict=True)))


def test_textures_are_told_apart_by_name():
    first, second = (Wall(profile=[(0, 0), (1, high), (2, 0)]) for high in (1.0, 1.1))
    assert first.name != second.name
    assert Wall().name == "wall"
    assert Wall(profile=first.profile, name="bark").name == "bark"
    assert Wall(profile=first.profile, repeat=2).name != first.name


def test_a_repeated_profile_is_laid_end_to_end_and_centred():
    one = Wall(profile=[(-1, 0), (0, 1), (1, 0)])
    three = Wall(profile=[(-1, 0), (0, 1), (1, 0)], repeat=3)
    assert len(three.parts) == 3
    np.testing.assert_allclose(three.parts[1], one.parts[0])
    np.testing.assert_allclose(
        three.parts[2] - three.parts[0], np.broadcast_to([0.0, 4.0], (5, 2))
    )


@pytest.mark.parametrize(
    ("fields", "match"),
    [
        (
            {"profile": [(0, 0), (2, 1), (1, 0)]},
            r"no function: .* place 3 \(1 mm\) does not lie beyond place 2",
        ),
        ({"profile": [(0, 0), (0, 1)]}, "no function"),
        ({"profile": [(0, 0)]}, "2 to 1000 pairs"),
        ({"profile": [(0, 0, 0), (1, 1, 1), (2, 0, 0), (3, 1, 1)]}, "2 to 1000 pairs"),
        ({"profile": [0.0, 1.0, 2.0, 3.0]}, "2 to 1000 pairs"),
        ({"profile": "rough"}, "an array of numbers"),
        ({"profile": [(0, np.nan), (1, 0)]}, "finite"),
        ({"profile": [(0, 0), (1, 1)], "repeat": 2}, "end as high as it begins"),
        ({"profile": [(0, 0), (1, 0)], "repeat": 1000}, "repeated 1000 times"),
        ({"profile": [(0, 0), (1, 1)], "repeat": 1.5}, "repeat must be a whole number"),
        ({"repeat": 2}, "need a profile"),
    ],
)
def test_what_is_no_profile_is_refused(fields, match):
    with pytest.raises(InvalidInput, match=match):
        Wall(**fields)
