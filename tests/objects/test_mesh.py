"""Meshes from files: what is a solid is cut into convex parts, what is none is refused in words."""

import numpy as np
import pytest

import feeler
from feeler.errors import InvalidInput
from feeler.objects import Box, Mesh, Object, Peg, Trial
from feeler.objects.distance import find_gap, make_hull, measure
from feeler.objects.meshes import list_solids
from feeler.objects.shapes import make_feature, parse_feature
from feeler.physics.simulation import Simulation


@pytest.fixture
def trimesh():
    return pytest.importorskip("trimesh")


def save(mesh, tmp_path, kind: str = "stl"):
    path = tmp_path / f"solid.{kind}"
    mesh.export(path)
    return path


@pytest.fixture
def brick(trimesh):
    return trimesh.creation.box(
        extents=(1.0, 2.0, 3.0), transform=np.eye(4) + 5 * np.eye(4, k=3)
    )


@pytest.mark.long
def test_a_convex_mesh_is_one_solid_with_its_front_at_its_place(brick, tmp_path):
    mesh = Mesh.from_file(save(brick, tmp_path), width=4.0, rounding=0.5)
    (corners,) = list_solids(mesh)
    np.testing.assert_allclose(corners.min(axis=0), [-2.5, -2.0, -3.0], atol=1e-6)
    np.testing.assert_allclose(corners.max(axis=0), [-0.5, 2.0, 3.0], atol=1e-6)
    assert mesh.size == pytest.approx(2.5)
    assert make_feature(mesh.to_plain()) == mesh
    assert mesh.mirror().mirror() == mesh


@pytest.mark.long
def test_a_ring_is_cut_into_parts_that_leave_its_hole(trimesh, tmp_path):
    pytest.importorskip("coacd")
    ring = trimesh.creation.torus(2.0, 0.5, major_sections=24, minor_sections=12)
    path = save(ring, tmp_path, "obj")
    mesh = parse_feature(f"mesh:file={path},scale=2,threshold=0.1")
    assert len(mesh.starts) > 3
    volume = sum(trimesh.convex.convex_hull(part).volume for part in list_solids(mesh))
    assert volume == pytest.approx(8 * ring.volume, rel=0.15)


def spoil(brick, how: str):
    if how == "open":
        brick.update_faces(np.arange(11))
    elif how == "inside out":
        brick.invert()
    return brick


@pytest.mark.further
@pytest.mark.parametrize(
    ("how", "words"), [("open", "is open: 3 of its 18 edges"), ("inside out", "is inside out")]
)
def test_what_bounds_no_solid_is_refused(how, words, brick, tmp_path):
    with pytest.raises(InvalidInput, match=words):
        Mesh.from_file(save(spoil(brick, how), tmp_path))


@pytest.mark.long
def test_very_many_triangles_are_simplified_on_request(trimesh, tmp_path):
    path = save(trimesh.creation.icosphere(subdivisions=7), tmp_path)
    with pytest.raises(InvalidInput, match=r"327,680 triangles, more than 100,000\. Simplify"):
        Mesh.from_file(path)
    mesh = Mesh.from_file(path, simplify=400)
    assert mesh.size == pytest.approx(1.0, abs=0.03)


@pytest.mark.parametrize(
    ("fields", "words"),
    [
        ({"vertices": np.eye(4, 3)[:3]}, "4 to 5000 corners"),
        (
            {"vertices": [(0, 0, 0), (1, 0, 0), (0, 1, 0), (1, 1, 0)]},
            "part 0 lies in one plane",
        ),
        ({"vertices": np.eye(8, 3), "starts": (0, 6)}, "at least four corners to a part"),
    ],
)
def test_wrong_corners_are_refused(fields, words):
    with pytest.raises(InvalidInput, match=words):
        Mesh(**fields)


WEDGE = Mesh(vertices=[(0, 0, 0), (-2, -1, 0), (-2, 1, 0.2), (-2, 0, 1.5), (-1, 0, -1)])


@pytest.mark.long
def test_a_mesh_touches_a_whisker_and_no_planar_antenna():
    whisker = feeler.presets.make_preset("rat-whisker")
    trial = Trial(feature=WEDGE, location=0.6, speed=0.1, azimuth=30.0)
    runs = Simulation(whisker, trial)
    runs.step(15.0)
    assert len(runs.contacts)
    assert np.linalg.norm(runs.force) > 0
    with pytest.raises(InvalidInput, match=r"mesh .* is a solid in space"):
        Simulation(feeler.presets.cockroach(), Object(feature=WEDGE, place=(-5.0, 20.0)))


def test_a_mesh_that_starts_around_the_antenna_is_refused():
    whisker = feeler.presets.make_preset("rat-whisker")
    x, y, z = whisker.shape()[whisker.n_segments // 2]
    inside = Object(feature=WEDGE, place=(x + 1.2, y, z - 0.1))
    with pytest.raises(InvalidInput, match="starts inside the antenna"):
        Simulation(whisker, inside)


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


def test_the_gap_to_a_turned_box_is_that_of_its_faces():
    """Also where the nearest place is on the diagonal that parts a face in two triangles."""
    rng = np.random.default_rng(3)
    half, share = np.array([0.5, 0.7, 0.3]), np.linspace(0, 1, 4001)[:, None]
    corners = np.array(np.meshgrid(*zip(-half, half, strict=True))).reshape(3, -1).T
    for _ in range(60):
        turn = np.linalg.qr(rng.normal(0, 1, (3, 3)))[0]
        ends = rng.normal(0, 1, (2, 3))
        places = ends[0] + share * (ends[1] - ends[0])
        gap = np.linalg.norm(np.maximum(np.abs(places) - half, 0), axis=1).min()
        found = find_gap(ends @ turn, np.array([0.1]), *make_hull(corners @ turn))
        assert found == pytest.approx(gap - 0.1, abs=1e-3) if gap else found <= -0.1


def test_a_shape_without_depth_has_no_solid():
    with pytest.raises(InvalidInput, match="half_length must be > 0 mm"):
        Box(half_width=1, half_height=1, half_length=0.0)
    assert len(list_solids(Peg(radius=1.0))[0]) == 2
