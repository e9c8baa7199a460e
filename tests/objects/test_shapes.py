"""The contract of shapes: convex parts grown by a rounding, foremost point at 0, one label each."""

import copy
import pickle
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from feeler import Ball, Box, Outline, Trial, Triangle, Wall, presets
from feeler.errors import InvalidInput
from feeler.objects import SHAPES, Feature, load_objects, make_feature, parse_feature, place
from feeler.objects.bodies import DEPTH
from feeler.objects.distance import compute_clearance
from feeler.objects.shapes import _is_convex, measure_area, trace_rim

from ._capsule import Capsule

HOOK = ((0.0, 0.1), (-2.0, 1.5), (-1.0, 0.3), (-3.0, -1.0), (-1.0, -1.2))
EXAMPLES = [
    Ball(radius=1.5),
    Box(half_width=1.5, half_height=1.0),
    Box(half_width=1.5, half_height=1.0, rounding=0.2),
    Triangle(half_width=1.5, rounding=0.1),
    Outline(vertices=HOOK),
    Outline(vertices=HOOK, rounding=0.3, name="hook"),
    Wall(),
]


@pytest.fixture
def capsule():
    SHAPES.register("capsule", Capsule)
    yield Capsule(half_length=1.0, rounding=0.5)
    SHAPES.unregister("capsule")


@pytest.mark.parametrize("feature", EXAMPLES, ids=lambda f: f.name)
def test_parts_are_convex_set_back_and_read_only(feature):
    assert max(part[:, 0].max() for part in feature.parts) + feature.rounding == pytest.approx(
        0.0, abs=1e-15
    )
    for part in feature.parts:
        assert part.dtype == float
        assert not part.flags.writeable
        assert len(part) < 3 or (measure_area(part) > 0 and _is_convex(part, slack=1e-12))


@pytest.mark.parametrize("feature", EXAMPLES, ids=lambda f: f.name)
@pytest.mark.parametrize(
    "copied", [copy.deepcopy, lambda f: pickle.loads(pickle.dumps(f)), lambda f: replace(f)]
)
def test_copies_are_equal_and_stay_read_only(feature, copied):
    feature.parts  # noqa: B018 - kept for speed; a copy makes its own
    twin = copied(feature)
    assert twin == feature
    assert hash(twin) == hash(feature)
    assert not any(part.flags.writeable for part in twin.parts)
    assert not np.asarray(getattr(twin, "vertices", feature.parts[0])).flags.writeable


@pytest.mark.parametrize("feature", EXAMPLES, ids=lambda f: f.name)
def test_plain_data_gives_the_feature_back(feature):
    assert make_feature(feature.to_plain()) == feature


@pytest.mark.parametrize("feature", EXAMPLES, ids=lambda f: f.name)
def test_the_mirror_image_of_the_mirror_image_is_the_feature(feature):
    image = feature.mirror()
    assert image.mirror() == feature
    assert (image.name, image.kind, image.size) == (feature.name, feature.kind, feature.size)
    across = [np.concatenate([part[:, 1] for part in each.parts]) for each in (feature, image)]
    assert across[0].min() == pytest.approx(-across[1].max())


def test_a_wall_s_face_lies_across_the_motion_and_a_trial_may_come_at_any_angle():
    (part,) = Wall().parts
    front = part[part[:, 0] > -1.0]
    np.testing.assert_array_equal(front[:, 0], 0.0)
    assert len(front) == 2 and front[0, 1] == -front[1, 1]
    for approach in (0.5, 179.5):
        assert (
            Trial(feature=Ball(radius=1.0), location=0.5, speed=0.3, approach=approach).approach
            == approach
        )
    for approach in (0.0, 180.0):
        with pytest.raises(InvalidInput, match="approach"):
            Trial(feature=Ball(radius=1.0), location=0.5, speed=0.3, approach=approach)


@pytest.mark.parametrize(
    "feature", [EXAMPLES[0], EXAMPLES[1], EXAMPLES[3], EXAMPLES[6]], ids=lambda f: f.kind
)
def test_balls_boxes_triangles_and_flat_walls_are_their_own_mirror_images(feature):
    assert feature.symmetric and feature.mirror() is feature
    for part in feature.parts:
        mirrored = {tuple(corner) for corner in np.round(part * [1.0, -1.0], 12) + 0.0}
        assert mirrored == {tuple(corner) for corner in np.round(part, 12) + 0.0}


@pytest.mark.parametrize("rounding", [0.0, 0.2])
def test_a_rim_runs_round_a_part_at_its_rounding(rounding):
    (part,) = Box(half_width=1.5, half_height=1.0).parts
    rim = trace_rim(part, rounding)
    ends = [rim.min(axis=0), rim.max(axis=0)]
    np.testing.assert_allclose(
        ends, [part.min(axis=0) - rounding, part.max(axis=0) + rounding], atol=1e-2 * rounding
    )


def test_boxes_and_triangles_are_as_deep_and_wide_as_they_say():
    for feature, depth in [
        (Box(half_width=1.5, half_height=0.7), 1.4),
        (Triangle(half_width=1.5, half_height=0.7), 1.4),
        (Triangle(half_width=1.5), 3.0),
    ]:
        (corners,) = feature.parts
        assert (corners[:, 0].max(), corners[:, 0].min()) == pytest.approx((0.0, -depth))
        assert (corners[:, 1].max(), corners[:, 1].min()) == pytest.approx((1.5, -1.5))


def test_size_is_half_the_outer_extent():
    assert Box(half_width=1.5, half_height=1.0, rounding=0.2).size == pytest.approx(1.7)
    assert Ball(radius=1.5).size == 1.5
    assert Outline(vertices=HOOK, rounding=0.5).size == pytest.approx(1.35 + 0.5)


def test_labels_default_to_the_kind_and_tell_outlines_apart():
    first, second = Outline(vertices=HOOK), Outline(vertices=[(x, y + 0.01) for x, y in HOOK])
    assert first.size == pytest.approx(second.size)
    assert first.name != second.name
    sides = " x ".join(f"{side:.3g}" for side in np.ptp(first.vertices, axis=0))
    assert first.name.startswith(f"outline {sides} mm (")
    assert replace(first, vertices=second.vertices).name == second.name
    assert (
        Outline(vertices=HOOK, name="hook").name == replace(first, name="hook").name == "hook"
    )
    assert Ball(radius=1.0).name == "ball"
    assert Ball(radius=1.0, name="pea") != Ball(radius=1.0)


def test_a_flat_box_of_no_width_grown_is_nearly_a_ball():
    """Rounding is a true growth: what is far from the core by ``rounding`` is the surface, also
    past a corner.
    """
    point = np.array([[2.0, 2.0], [2.0, 3.0]])
    box = Box(half_width=1.0, half_height=0.5, rounding=0.25)
    gap = compute_clearance(point, np.array([0.1]), box, np.zeros(2), np.array([1.0, 0.0]))
    assert gap == pytest.approx(np.hypot(2.25, 1.0) - 0.25 - 0.1)


@pytest.mark.parametrize("radius", [(0.1, 0.2, 0.3), (0.3, 0.2, 0.1)])
@pytest.mark.parametrize("nearest", [0, 1, 2, 3])
def test_a_flat_wall_is_as_far_as_the_nearest_end_of_any_segment(nearest, radius):
    points = np.array([[5.0, 0.0], [6.0, 1.0], [7.0, 2.0], [8.0, 3.0]])
    points[nearest, 0] = 4.0
    gap = compute_clearance(
        points, np.array(radius), Wall(), np.array([1.0, 9.0]), np.array([1.0, 0.0])
    )
    meeting = radius[max(nearest - 1, 0) : nearest + 1]  # of the segments that end there
    assert gap == pytest.approx(4.0 - 1.0 - max(meeting))


def test_a_shape_from_outside_is_placed_and_described(capsule):
    trial = Trial(feature=capsule, location=0.6, speed=0.3, lead=2.0)
    start = place(presets.cockroach(), trial)
    np.testing.assert_allclose(start.origin, [-(0.225 + 0.6), 0.6 * 42.0], atol=1e-9)
    assert make_feature("capsule", 0.5) == Capsule(half_length=0.5, rounding=0.5)
    assert make_feature(capsule.to_plain()) == capsule
    assert capsule.size == 1.5


@pytest.mark.parametrize("feature", EXAMPLES[:-1], ids=lambda f: f.name)
def test_scaled_shapes_are_larger_all_over(feature):
    large = feature.scale(2.0)
    assert large.size == pytest.approx(2 * feature.size)
    assert large.rounding == 2 * feature.rounding
    for part, doubled in zip(feature.parts, large.parts, strict=True):
        np.testing.assert_allclose(doubled, 2 * part, atol=1e-12)


@pytest.mark.parametrize(
    ("text", "feature"),
    [
        ("ball", Ball(radius=1.5)),
        ("box:rounding=0.2", Box(half_width=1.5, half_height=1.5, rounding=0.2)),
        ("box: half_height=3, name=brick", Box(half_width=1.5, half_height=3.0, name="brick")),
        ("wall", Wall()),
    ],
)
def test_a_line_of_text_names_a_shape(text, feature):
    assert parse_feature(text, 1.5) == feature


def test_a_line_of_text_names_a_drawing(tmp_path):
    (tmp_path / "leaf.csv").write_text("0,-1\n4,-1\n4,1\n0,1\n")
    found = parse_feature(f"outline:file={tmp_path / 'leaf.csv'},width=3,name=leaf", 1.0)
    assert (found.name, found.size) == ("leaf", 1.5)


@pytest.mark.parametrize(
    ("make", "match"),
    [
        (lambda: Ball(radius="x"), "Ball.radius must be a number, got 'x'"),
        (lambda: Ball(radius=-1), "Ball.radius must be > 0 mm, got -1"),
        (
            lambda: Box(half_width=1, half_height=1, rounding=-0.1),
            "Box.rounding must be ≥ 0 mm",
        ),
        (lambda: Triangle(half_width=None), "Triangle.half_width must be a number"),
        (lambda: Ball(radius=1.0, name=3), "Ball.name must be text of at most 200"),
        (lambda: make_feature("ball"), r"'ball' needs radius \[mm\]"),
        (lambda: make_feature("outline", 1.0), "needs its vertices; a size is not enough"),
        (
            lambda: make_feature("box", 1.0, depth=2.0),
            "box has no 'depth'; it has name, half_length, half_width, half_height, rounding",
        ),
        (lambda: make_feature({"radius": 1.0}), "unknown shape None"),
        (lambda: parse_feature("box:wide", 1.0), "'wide' has no value"),
        (lambda: parse_feature("box:file=a.svg", 1.0), "box has no 'file'"),
        (
            lambda: parse_feature("outline:file=a.svg,size=3"),
            "a drawing has no 'size'; valid: file, width",
        ),
    ],
)
def test_what_makes_no_shape_is_said(make, match):
    with pytest.raises(InvalidInput, match=match):
        make()


@pytest.mark.parametrize(
    ("core", "match"),
    [
        ([], "gave no part"),
        ([[(0, 0), (2, 0), (0.5, 0.5), (0, 2)]], "not convex"),
        ([[0, 1]], "corners"),
    ],
)
def test_a_new_shape_with_bad_parts_is_told_at_first_use(core, match):
    class Bad(Feature):
        kind, rounding = "bad", 0.0

        def make_parts(self):
            return core

    with pytest.raises(InvalidInput, match=match):
        Bad().parts  # noqa: B018


@pytest.mark.parametrize("size", [1e-3, 1.0, 1e3])
def test_a_hook_is_no_crossing_line_however_small_and_a_bow_is_one_however_large(size):
    hook = size * np.array([(0.0, 0.1), (-2.0, 1.5), (-1.0, 0.3), (-3.0, -1.0), (-1.0, -1.2)])
    filled = sum(measure_area(part) for part in Outline(vertices=hook).parts)
    assert filled == pytest.approx(abs(measure_area(hook)), rel=1e-9)
    bow = [(0, 0), (-1, 1), (0, 1), (-1, 0)]
    with pytest.raises(InvalidInput):
        Outline(vertices=size * np.array(bow, dtype=float))
    # the spike crosses one edge of several
    spike = [(0, 0), (0, 2), (-2, 2), (-2, 0), (-1.5, 0), (-1, 3), (-0.5, 0)]
    with pytest.raises(InvalidInput, match="self-intersecting"):
        Outline(vertices=size * np.array(spike, dtype=float))


STEPS = st.lists(st.tuples(st.floats(0.1, 3.0), st.floats(-2.0, 2.0)), min_size=2, max_size=12)


@given(STEPS, st.integers(1, 3))
def test_parts_fill_the_wall_below_the_profile(steps, repeat):
    place = np.cumsum([step for step, _ in steps])
    height = np.array([height for _, height in steps])
    height[-1] = height[0]
    wall = Wall(profile=np.stack([place, height], axis=1), repeat=repeat)
    area = sum(measure_area(part) for part in wall.parts)
    below = repeat * np.trapezoid(height - height.min() + DEPTH, place)
    assert area == pytest.approx(below)
    assert all(_is_convex(part, slack=1e-9) for part in wall.parts)
    assert max(part[:, 0].max() for part in wall.parts) == 0.0
    assert wall.size == pytest.approx(repeat * np.ptp(place) / 2)


def test_every_place_of_the_profile_is_a_corner_of_the_face():
    profile = np.array([(-3.0, 0.0), (-1.0, 2.0), (0.0, 1.5), (2.0, 1.0)])
    face = np.concatenate(Wall(profile=profile).parts)
    for along, height in profile:
        assert any(np.allclose(corner, (height - 2.0, along)) for corner in face)


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


def test_a_file_gives_its_features_in_order_and_under_their_names(tmp_path):
    ball = 'shape = "ball"\nradius = 3.0'
    lid = 'name = "lid"\nshape = "box"\nhalf_width = 2.0\nhalf_height = 0.5'
    text = f"[[object]]\n{ball}\n[[object]]\n{lid}\n"
    (tmp_path / "o.toml").write_text(text)
    assert load_objects(tmp_path / "o.toml") == [
        Ball(radius=3.0),
        Box(half_width=2.0, half_height=0.5, name="lid"),
    ]


@pytest.mark.parametrize(
    ("text", "match"),
    [
        ("", "must hold 1 to 1000 tables"),
        ("[[object]]\nradius = 1", "object 1: needs a shape"),
        ("[[object]]\nshape = 'bal'\nradius = 1", "unknown shape 'bal'"),
        (
            "[[object]]\nshape = 'ball'\nradius = 1\n[[object]]\nshape = 'ball'\nradius = 2",
            "two objects are called 'ball'",
        ),
        ("[[object]]\nshape = 'ball'\nfile = 'x.svg'", "a ball has no 'file'"),
        ("[[object]]\nshape = 'outline'\nfile = 'x.csv'\nhue = 2", "a drawing has no 'hue'"),
        ("[[object]", "not valid TOML"),
    ],
)
def test_a_wrong_objects_file_is_refused_by_name(tmp_path, text, match):
    (tmp_path / "o.toml").write_text(text)
    with pytest.raises(InvalidInput, match=match):
        load_objects(tmp_path / "o.toml")


def test_a_drawing_lies_beside_the_objects_file(tmp_path):
    (tmp_path / "leaf.csv").write_text("x,y\n0,-3\n0,3\n-5,0\n")
    (tmp_path / "o.toml").write_text(
        '[[object]]\nname = "leaf"\nshape = "outline"\nfile = "leaf.csv"'
    )
    (leaf,) = load_objects(tmp_path / "o.toml")
    assert (leaf.name, leaf.size) == ("leaf", 3)
