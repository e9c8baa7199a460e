"""Boxes and prisms in space against MuJoCo, moving and turning, on each of their features."""

import mujoco
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from feeler.antenna.segments import Antenna
from feeler.objects import Ball, Box, Mesh, Outline, Triangle
from feeler.objects.bodies import Object
from feeler.objects.distance import make_hull
from feeler.objects.meshes import list_solids
from feeler.objects.shapes import Feature
from feeler.physics.chain import fields as f
from feeler.physics.engine import ENGINES, Engine
from feeler.physics.run import run_scene
from feeler.physics.scene import Clock, Scene
from feeler.physics.simulation import Simulation
from feeler.physics.spec import compile_model
from tests.physics.scenes import FORCES, check_alike
from tests.physics.test_space import CARRIED, make

pytestmark = pytest.mark.long

WAYS = {
    "face": ((1.0, 0.05, 0.02), (0.0, 1.0, 0.3)),
    "edge": ((1.0, 1.0, 0.1), (-1.0, 1.0, 0.05)),
    "corner": ((1.0, 0.9, 0.8), (-1.0, 1.0, 0.0)),
}


def send(feature: Feature, antenna, way: str, friction: float = 0.7) -> Object:
    """An object that comes from aside and turns, face, edge or corner ahead."""
    forward, left = map(np.array, WAYS[way])
    forward /= np.linalg.norm(forward)
    left -= left @ forward * forward
    return Object(
        feature=feature,
        place=(-0.06, 0.6 * antenna.length, 0.0),
        forward=tuple(forward),
        left=tuple(left / np.linalg.norm(left)),
        velocity=(0.03, 0.004, 0.003),
        turn=(0.002, 0.01, 0.003),
        friction=friction,
    )


def compare(scene: Scene, engine: str, slack: float, duration: float = 60.0) -> None:
    clock = Clock(duration=duration, sample_interval=2.0, timestep=0.02)
    ours, theirs = run_scene(scene, clock, engine), run_scene(scene, clock, "mujoco")
    assert np.linalg.norm(theirs.force, axis=1).max() > 1e-4
    assert np.abs(theirs.angle).max() > 0.1
    check_alike(ours, theirs, slack, 1e2 * slack, ("force", "contact_place", "sink", *FORCES))


@pytest.mark.parametrize(
    ("way", "rounding", "friction"),
    [
        ("face", 0.0, 0.0),
        pytest.param("corner", 0.0, 0.7, marks=pytest.mark.long),
        ("edge", 0.2, 0.7),
        pytest.param("edge", 0.0, 0.0, marks=pytest.mark.slow),
        pytest.param("corner", 0.2, 0.7, marks=pytest.mark.slow),
        pytest.param("face", 0.2, 0.0, marks=pytest.mark.slow),
    ],
)
def test_a_box_is_mujocos(way, rounding, friction):
    """Within 1e-9 rad, where MuJoCo is that near to itself: where the antenna sticks and slips on a
    sharp edge, 1e-15 rad at the start are 1e-7 to 0.1 rad after 60 ms.
    """
    antenna = make(3)
    box = Box(half_width=0.6, half_height=0.5, half_length=0.8, rounding=rounding)
    item = send(box, antenna, way, friction)
    compare(Scene(antenna=antenna, objects=(item,), base_motion=CARRIED), "chain", 1e-9)


def read_corners(scene: Scene) -> list[np.ndarray]:
    """Corners (corner, 3) of each mesh as MuJoCo keeps them, in single precision about a centre of
    its own, in the frames of their objects.
    """
    model, turn, found = compile_model(scene, 0.02), np.empty(9), []
    for geom in np.flatnonzero(model.geom_type == mujoco.mjtGeom.mjGEOM_MESH):
        mesh, start = model.geom_dataid[geom], model.mesh_vertadr[model.geom_dataid[geom]]
        corners = model.mesh_vert[start : start + model.mesh_vertnum[mesh]].astype(float)
        mujoco.mju_quat2Mat(turn, model.geom_quat[geom])
        world = corners @ turn.reshape(3, 3).T + model.geom_pos[geom]
        item = scene.objects[model.geom_bodyid[geom] - scene.antenna.n_segments - 2]
        found.append(world @ item.axes.T)
    return found


def make_alike(scenes, timestep):
    """The chain with MuJoCo's corners."""
    stepper = ENGINES["chain"].make(scenes, timestep)
    own = [c for item in scenes[0].objects for c in list_solids(item.feature)]
    for k, (corners, before) in enumerate(zip(read_corners(scenes[0]), own, strict=True)):
        assert np.abs(np.sort(corners, axis=0) - np.sort(before, axis=0)).max() < 1e-6
        hull, _ = make_hull(corners)
        first, stop = (int(stepper.tables.solids[0, k, at]) for at in (f.S_FIRST, f.S_STOP))
        assert len(hull) == stop - first
        stepper.tables.hulls[0, first:stop] = hull
    return stepper


LEAF = Outline(vertices=[(0, 0), (-0.5, 0.9), (-0.3, 0.1), (-0.9, -0.4)], half_length=0.7)


def make_hills() -> Mesh:
    """Two upright wedges below each square of a ground of uneven heights."""
    heights = 0.25 * np.sin(np.arange(24).reshape(4, 6) ** 1.7)
    along, across = (0.4 * (np.arange(n) - (n - 1) / 2) for n in heights.shape)
    ground = np.stack([heights, *np.meshgrid(along, across, indexing="ij")], axis=2)
    first, below, beside, last = (
        ground[:-1, :-1],
        ground[1:, :-1],
        ground[:-1, 1:],
        ground[1:, 1:],
    )
    tops = np.stack([[first, below, last], [first, last, beside]]).transpose(2, 3, 0, 1, 4)
    feet = tops.copy()
    feet[..., 0] = heights.min() - 1.0
    wedges = np.concatenate([tops, feet], axis=3).reshape(-1, 3)
    return Mesh(vertices=wedges, starts=np.arange(0, len(wedges), 6))


HILLS = make_hills()
BODIES = {
    "triangle": Triangle(half_width=0.6, rounding=0.1, half_length=0.9),
    "leaf": LEAF,
    "hills": HILLS,
}


@pytest.mark.parametrize(
    ("body", "way"),
    [
        pytest.param("triangle", "face", marks=pytest.mark.long),
        ("hills", "face"),
        pytest.param("leaf", "face", marks=pytest.mark.slow),
    ],
)
def test_prisms_are_mujocos_meshes(body, way):
    """Within 1e-7 rad: MuJoCo finds their contacts by iteration, to 1e-12 mm or so."""
    antenna = make(3)
    item = send(BODIES[body], antenna, way, friction=0.0)
    ENGINES.register("alike", Engine(make=make_alike, timestep=0.02))
    try:
        compare(Scene(antenna=antenna, objects=(item,), base_motion=CARRIED), "alike", 1e-7)
    finally:
        ENGINES.unregister("alike")


RADIUS, CENTRE = 1.5, np.array([-0.5, 12.0, 0.0])
ROD = Antenna(
    segment_length=[20.0],
    segment_mass=[1e-3],
    radius=0.1,
    stiffness=np.ones((2, 1)),
    damping=np.ones((2, 1)),
)


def press(feature: Feature, short: float = 0.0) -> Simulation:
    """A rod on a spring that rests against a solid whose middle has come to CENTRE; its front is
    ``short`` of the ball's.
    """
    start = (-0.2 - short, CENTRE[1], 0.0)
    item = Object(feature=feature, place=start, velocity=(0.12, 0.0, 0.0), friction=0.0)
    runs = Simulation(ROD, item, timestep=0.02, contact="hard")
    runs.step(10.0)
    runs.move_object(0)
    runs.step(15.0)
    assert np.abs(runs.velocity).max() < 1e-9
    return runs


def read_rest(runs: Simulation) -> tuple[float, float, float]:
    """How far the solid reaches towards the rod's axis, less how deep the rod has sunk in; the
    place of contact [mm]; the force [N].
    """
    along = runs.tip / ROD.length
    aside = float(np.linalg.norm(CENTRE - CENTRE @ along * along))
    contacts = runs.contacts
    reach = aside - ROD.radius[0] - contacts.distance[0]
    return reach, contacts.place[0] * ROD.length, float(np.linalg.norm(contacts.force))


def test_a_rod_rests_against_a_ball_as_a_tangent():
    """Force over the arm is the spring's moment, at the foot of the perpendicular."""
    runs = press(Ball(radius=RADIUS))
    reach, place, force = read_rest(runs)
    assert reach == pytest.approx(RADIUS, abs=1e-9)
    assert place == pytest.approx(CENTRE @ runs.tip / ROD.length, abs=1e-9)
    assert force == pytest.approx(runs.angle[0, 0] / place, rel=1e-9)


@pytest.mark.parametrize("turned", range(3))
@pytest.mark.parametrize(
    "subdivisions", [1, 2, 3, pytest.param(4, marks=pytest.mark.slow)], ids="{} cuts".format
)
def test_a_mesh_of_more_faces_comes_to_the_ball(subdivisions, turned):
    """Its faces lie at most w = e²/6R within the ball (e: their greatest edge), a quarter of it for
    each cut; the place a of contact is off by at most the half width e/√3 of a face; the force
    F = kθ/a so by k w/a² + F e/√3a.
    """
    trimesh = pytest.importorskip("trimesh")
    ball = trimesh.creation.icosphere(subdivisions=subdivisions, radius=RADIUS)
    corners = ball.vertices @ Rotation.random(random_state=turned).as_matrix()
    edge = ball.edges_unique_length.max()
    within = RADIUS - np.sqrt(RADIUS**2 - edge**2 / 3)
    runs = press(Mesh(vertices=corners), short=RADIUS - corners[:, 0].max())
    reach, place, force = read_rest(runs)
    _, foot, wanted = read_rest(press(Ball(radius=RADIUS)))
    beside, nearest = edge / np.sqrt(3), foot - edge / np.sqrt(3)
    assert -1e-9 < RADIUS - reach < within
    assert abs(place - CENTRE @ runs.tip / ROD.length) < beside
    assert abs(force - wanted) < (within / nearest + wanted * beside) / nearest
