"""Distances of segments and convex solids prove themselves, by a plane that parts the two."""

import numpy as np
import pytest

from feeler.errors import InvalidInput
from feeler.objects import Box, Peg
from feeler.objects.distance import find_gap, make_hull, measure
from feeler.objects.meshes import list_solids


def find(corners: np.ndarray, p: np.ndarray, e: np.ndarray):
    table, n_faces = make_hull(corners)
    gap, at, out = measure(table, 0, n_faces, len(table), tuple(p), tuple(e), np.inf)
    return gap, np.array(at), np.array(out), table[:n_faces]


@pytest.mark.parametrize("n", [1, 2, 4, 9, 30])
def test_the_nearest_points_of_bodies_apart_are_proven_by_their_plane(n):
    rng = np.random.default_rng(n)
    for _ in range(300):
        corners, p, e = rng.normal(0, 1, (n, 3)), rng.normal(0, 3, 3), rng.normal(0, 2, 3)
        gap, at, out, faces = find(corners, p, e)
        if gap <= 1e-9:
            continue
        assert np.linalg.norm(out) == pytest.approx(1)
        # no point of the solid is further along the plane, none of the segment nearer: at least gap
        assert (corners @ out).max() <= at @ out + 1e-9
        assert min(p @ out, (p + e) @ out) >= at @ out + gap - 1e-9
        # the point is the solid's own, and the segment passes it so near: at most gap
        assert np.all(faces[:, :3] @ at <= faces[:, 3] + 1e-9)
        t = np.clip((at - p) @ e / (e @ e), 0, 1)
        assert np.linalg.norm(p + t * e - at) == pytest.approx(gap, abs=1e-9)


def test_no_other_way_out_of_a_solid_is_shorter():
    rng = np.random.default_rng(7)
    ways = rng.normal(0, 1, (4000, 3))
    ways /= np.linalg.norm(ways, axis=1)[:, None]
    deep = 0
    for _ in range(200):
        corners, p, e = rng.normal(0, 1, (12, 3)), rng.normal(0, 0.5, 3), rng.normal(0, 2, 3)
        gap, at, out, _ = find(corners, p, e)
        if gap >= 0:
            continue
        deep += 1

        def push(way, ends=(p, p + e), corners=corners):
            """How far the segment must go this way until a plane parts the two."""
            return (corners @ np.atleast_2d(way).T).max(axis=0) - np.min(
                [np.atleast_2d(way) @ end for end in ends], axis=0
            )

        assert push(out)[0] == pytest.approx(-gap, abs=1e-9)
        assert push(ways).min() >= -gap - 1e-9
        assert (corners @ out).max() == pytest.approx(at @ out, abs=1e-9)
    assert deep > 50


def test_a_box_in_space_is_as_deep_as_it_is_told():
    box = Box(half_width=0.5, half_height=0.4, half_length=0.3)
    (corners,) = list_solids(box)
    np.testing.assert_allclose(np.ptp(corners, axis=0), [0.8, 1.0, 0.6])
    points = np.array([[-0.4, -3.0, 1.0], [-0.4, 3.0, 1.0]])
    assert find_gap(points, np.array([0.1]), *make_hull(corners)) == pytest.approx(0.6)
    assert "half_length" not in Box(half_width=1, half_height=1).to_plain()
    assert Box(**{k: v for k, v in box.to_plain().items() if k != "kind"}) == box


def test_a_shape_without_depth_has_no_solid():
    with pytest.raises(InvalidInput, match="half_length must be > 0 mm"):
        Box(half_width=1, half_height=1, half_length=0.0)
    assert len(list_solids(Peg(radius=1.0))[0]) == 2
