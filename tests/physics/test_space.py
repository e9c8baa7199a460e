"""The chain in space against MuJoCo, against the chain in the plane, and against itself turned."""

import numpy as np
import pytest

import feeler
from feeler.antenna.segments import Antenna, to_matrix, to_vector
from feeler.errors import InvalidInput
from feeler.objects import Ball, Wall
from feeler.objects.bodies import Object
from feeler.objects.motion import BaseMotion
from feeler.objects.shapes import Peg
from feeler.physics.chain import fields as f
from feeler.physics.chain.model import make_model
from feeler.physics.engine import ENGINES
from feeler.physics.run import run_group, run_scene
from feeler.physics.scene import Clock, Motion, Scene
from feeler.physics.simulation import Simulation, Simulations

from .scenes import FORCES, check_alike

pytestmark = pytest.mark.long

CARRIED = BaseMotion(velocity=(0.01, 0.02, 0.005), turn=(0.001, 0.002, 0.005))
FORWARD = tuple(np.array([0.8, 0.1, 0.6]) / np.sqrt(1.01))
SOLIDS = {"ball": Ball(radius=0.7), "peg": Peg(radius=0.4, half_length=2.0), "wall": Wall()}


FAST = (("ball", 0.0), ("peg", 0.7), ("wall", 0.7))


def make(planes: int = 2, n: int = 12, firm: float = 1.0, seed: int = 3, **changes) -> Antenna:
    """Uneven in every way; segments of µg."""
    rng = np.random.default_rng(seed)
    fields = {"segment_length": rng.uniform(0.4, 0.6, n), "radius": 0.05, "taper": 0.7}
    fields |= {"segment_mass": rng.uniform(1, 2, n) * 1e-5, "damping": 1e-3 * firm}
    fields |= {"stiffness": firm * rng.uniform(0.005, 0.01, (planes, n))}
    return Antenna(**(fields | changes))


def shake(duration: float) -> BaseMotion:
    """A recorded path in all six degrees of freedom, far from any one axis."""
    time = np.linspace(0, duration, 9)
    swing = np.sin(time[:, None] * [0.5, 0.7, 0.3, 0.4, 0.6, 0.2])
    return BaseMotion(time=time, pose=swing * [0.4, 0.2, 0.3, 0.9, 0.5, 0.8])


def hit(kind: str, antenna: Antenna, friction: float = 0.7) -> Object:
    """An object that comes from aside and turns."""
    push, middle = np.array(FORWARD), np.array([0, 0.6 * antenna.length, 0])
    back = 0.7 if kind == "wall" else 0.3
    return Object(
        feature=SOLIDS[kind],
        place=tuple(middle - back * push),
        forward=FORWARD,
        velocity=tuple(0.03 * push + [0, 0.01, 0.003]),
        turn=(0.002, 0.01, 0.003),
        friction=friction,
    )


def compare(scene: Scene, clock: Clock) -> tuple[Motion, Motion]:
    return run_scene(scene, clock, "chain"), run_scene(scene, clock, "mujoco")


@pytest.mark.parametrize("planes", [2, 3])
@pytest.mark.parametrize(
    "base", [None, CARRIED, shake(10.0)], ids=["still", "carried", "shaken"]
)
def test_free_motion_is_mujoco_to_rounding(planes, base):
    """1,000 steps, with angles beyond 1 rad, gravity, and what the base does and feels."""
    antenna = make(planes)
    angle = np.random.default_rng(planes).normal(0, 0.5, (planes, 12))
    scene = Scene(antenna=antenna, angle=angle, gravity=(0.0, -9.8e-3, 1e-3), base_motion=base)
    ours, theirs = compare(scene, Clock(duration=10, timestep=0.01))
    assert np.abs(theirs.angle).max() > 1.0
    check_alike(ours, theirs, 1e-12, 1e-9)


CASES = [
    pytest.param(
        kind, friction, marks=[pytest.mark.slow] if (kind, friction) not in FAST else []
    )
    for kind in SOLIDS
    for friction in (0.0, 0.7)
]


@pytest.mark.parametrize(("kind", "friction"), CASES)
def test_contact_is_mujoco(kind, friction):
    """60 ms, sliding, turning, with torsion and a moving base: 1e-9 rad, and all forces."""
    antenna = make(3, firm=10.0 if kind == "wall" else 1.0)
    scene = Scene(antenna=antenna, objects=(hit(kind, antenna, friction),), base_motion=CARRIED)
    ours, theirs = compare(scene, Clock(duration=60, sample_interval=2.0, timestep=0.02))
    assert np.linalg.norm(theirs.force, axis=1).max() > 1e-4
    assert np.abs(theirs.angle).max() > 0.1
    check_alike(ours, theirs, 1e-9, 1e-7, ("force", "contact_place", *FORCES))


def test_a_peg_along_the_antenna_has_two_contacts_as_in_mujoco():
    antenna = make(2, firm=10.0)
    peg = Object(
        feature=Peg(radius=0.4, half_length=0.9),
        place=(-0.055, 3.0, 0.0),
        velocity=(0.02, 0.0, 0.0),
        left=(0.0, 0.0, 1.0),
    )
    scene = Scene(antenna=antenna, objects=(peg,))
    ours, theirs = compare(scene, Clock(duration=5, sample_interval=0.1, timestep=0.02))
    np.testing.assert_allclose(ours.angle, theirs.angle, rtol=0, atol=1e-9)


def take_planar_contact(stepper, scene: Scene) -> None:
    """Contacts that reckon with the planar chain's inverse weights, which are half as large."""
    rows = [f.C_INVWEIGHT, f.C_D_MAX, f.C_WIDTH, f.C_SLOW, f.C_WIDEST, f.C_K, f.C_B]
    stepper.tables.constants[rows, :, 0] = make_model(scene).constants[rows]


@pytest.mark.parametrize("damped", [False, True])
def test_a_planar_scene_in_space_is_the_planar_engines(damped):
    """Free, carried, pulled and touched: 1e-12 rad."""
    antenna = make(taper=1.0)
    flat = antenna.flatten()
    ball = Object(feature=Ball(radius=0.7), place=(-0.1, 4.0), velocity=(0.03, 0.0), turn=0.01)
    rest = {"base_motion": BaseMotion(velocity=(0.01, 0.02), turn=0.004), "objects": (ball,)}
    rest["gravity"] = (1e-3, -9.8e-3)
    start = np.random.default_rng(0).normal(0, 0.02, 12)
    planar = Scene(antenna=flat, angle=start, **rest)
    spatial = Scene(antenna=antenna, angle=np.stack([start, np.zeros(12)]), **rest)
    make_chain = ENGINES["chain-consistent" if damped else "chain"].make
    (one,), (other,) = ((make_chain([s], 0.02),) for s in (planar, spatial))
    take_planar_contact(other, planar)
    for _ in range(20):
        one.step(50)
        other.step(50)
        a, b = one.read(), other.read()
        np.testing.assert_allclose(b.angle[:, 0], a.angle, rtol=0, atol=1e-12)
        np.testing.assert_array_equal(b.angle[:, 1], 0.0)
        np.testing.assert_allclose(b.base_force[:, :2], a.base_force, rtol=1e-8, atol=1e-12)
        np.testing.assert_allclose(-b.base_moment[:, 2], a.base_moment, rtol=1e-8, atol=1e-12)
    assert np.linalg.norm(a.force) > 1e-5


def test_a_scene_turned_about_the_antenna_is_the_same_scene():
    """Round segments, in contact, at small angles: forces turn with the scene."""
    antenna = make(2, stiffness=np.full((2, 12), 0.01))
    turn = to_matrix([0.0, 1.1, 0.0])
    found = []
    for rotation in (np.eye(3), turn):
        push = rotation @ [1.0, 0.0, 0.0]
        ball = Object(
            feature=Ball(radius=0.7),
            place=tuple(rotation @ [-0.051, 4.0, 0.0]),
            forward=tuple(push),
            velocity=tuple(0.02 * push),
            friction=0.0,
        )
        scene = Scene(antenna=antenna, objects=(ball,))
        found.append(run_scene(scene, Clock(duration=5, timestep=0.02)))
    straight, turned = found
    assert np.abs(straight.angle).max() < 0.03
    for name in ("force", "base_force", "base_moment"):
        wanted = getattr(straight, name) @ turn.T
        scale = np.abs(wanted).max()
        np.testing.assert_allclose(getattr(turned, name), wanted, rtol=0, atol=3e-3 * scale)
    assert np.abs(straight.force).max() > 1e-6


@pytest.mark.parametrize(
    "engine", [pytest.param("chain", marks=pytest.mark.long), "chain-consistent"]
)
def test_lanes_do_not_know_each_other(engine):
    antenna = make(2, firm=10.0)
    scenes = [
        Scene(antenna=antenna, objects=(hit(kind, antenna),), base_motion=CARRIED)
        for kind in SOLIDS
    ]
    clock = Clock(duration=12, timestep=0.02)
    together = run_group(scenes, clock, engine)
    for scene, found in zip(scenes, together, strict=True):
        alone = run_scene(scene, clock, engine)
        for name in ("angle", "force", "base", "base_force", "base_moment", "work"):
            np.testing.assert_array_equal(getattr(found, name), getattr(alone, name))


def test_a_simulation_goes_back_and_on_to_the_last_bit():
    antenna = make(2, firm=10.0)
    runs = Simulation(antenna, [hit("ball", antenna), hit("wall", antenna).replace(name="w")])
    runs.step(4.0)
    moment = runs.snapshot()
    runs.step(6.0)
    first = runs.angle
    runs.restore(moment)
    runs.step(6.0)
    np.testing.assert_array_equal(runs.angle, first)
    runs.move_base(velocity=(0.0, 0.0, 0.02), turn=(0.0, 0.0, 0.01))
    runs.move_object("ball", velocity=(0.0, 0.01))
    runs.step(5.0)
    assert runs.base[2] == pytest.approx(0.1)
    assert runs.base[5] == pytest.approx(0.05)
    assert runs.tip.shape == (3,)
    assert runs.contacts.force.shape[1] == 3
    np.testing.assert_allclose(runs.contacts.force.sum(axis=0), runs.force.sum(axis=0))


def test_rotation_vectors_come_back():
    vectors = np.random.default_rng(1).normal(0, 0.9, (20, 3))
    np.testing.assert_allclose(to_vector(to_matrix(vectors)), vectors, atol=1e-13)


def test_a_mirrored_base_moves_as_a_mirror_shows_it():
    """The mirror image of a turn that lifts towards z still does; one towards x goes the other
    way.
    """
    base = BaseMotion(velocity=(1.0, 2.0, 3.0), turn=(0.1, 0.2, 0.3)).mirror()
    assert base == BaseMotion(velocity=(-1.0, 2.0, 3.0), turn=(0.1, -0.2, -0.3))
    path = shake(5.0)
    assert np.array_equal(path.mirror().mirror().pose, path.pose)


@pytest.mark.parametrize("left", [(1.0, 0.0, 0.0), (0.0, 2.0, 0.0), (0.0, 0.6, 0.6)])
def test_axes_that_are_no_rotation_are_refused(left):
    with pytest.raises(InvalidInput, match="no rotation: they must be unit vectors"):
        Object(feature=Ball(radius=1.0), left=left)


@pytest.mark.parametrize(
    "fields",
    [
        {"objects": (Object(feature=Ball(radius=1.0), place=(0.0, 1.0, 2.0)),)},
        {"gravity": (0.0, 0.0, 1.0)},
        {"base_motion": CARRIED},
    ],
)
def test_a_planar_antenna_stays_in_its_plane(fields):
    with pytest.raises(InvalidInput, match=r"has three numbers .* lies in the plane"):
        Scene(antenna=make().flatten(), **fields)


def test_antennae_of_planes_and_of_space_share_no_lanes():
    with pytest.raises(InvalidInput, match="of planes for all"):
        Simulations([Scene(antenna=make(2)), Scene(antenna=make(3))])


def _follow(antenna):
    from feeler.active.tasks import FollowTask

    return FollowTask(antenna=antenna)


def _paper(antenna):
    from paper.context import Context

    return Context(antenna=antenna)


@pytest.mark.parametrize(
    "verb",
    [feeler.release, feeler.hit, lambda one: feeler.bend(one, 1e-6), _follow, _paper],
    ids=["release", "hit", "bend", "following a wall", "the paper"],
)
def test_what_works_in_the_plane_only_says_so(verb):
    with pytest.raises(InvalidInput, match=r"works in the plane.*antenna\.flatten\(\)"):
        verb(make(2))


def test_a_motion_turns_what_stands_turned():
    """A base's own turn comes first, its motion's after it: turns in space do not commute."""
    own, first = [0.4, -0.2, 0.9], [0.3, 1.1, -0.5]
    pose = np.tile([1.0, 2.0, 3.0, *first], (4, 1))
    motion = BaseMotion(time=np.linspace(0.0, 30.0, 4), pose=pose)
    scene = Scene(antenna=make(2), base=(0.5, 0.1, -0.2, *own), base_motion=motion)
    found = to_matrix(scene.base_pose[3:])
    np.testing.assert_allclose(found, to_matrix(first) @ to_matrix(own), atol=1e-12)
    assert np.abs(found - to_matrix(own) @ to_matrix(first)).max() > 0.1
    np.testing.assert_allclose(scene.base_pose[:3], [1.5, 2.1, 2.8])


def test_a_heading_in_the_plane_is_the_same_heading_in_space():
    """A base that looks from +y towards +x by 0.4 rad does so in space, from where it stands."""
    pose = Scene(antenna=make(), objects=(), base=(1.0, -2.0, 0.4)).base_pose
    np.testing.assert_allclose(pose[:3], [1, -2, 0])
    ahead = to_matrix(pose[3:]) @ [0, 1, 0]
    np.testing.assert_allclose(ahead, [np.sin(0.4), np.cos(0.4), 0], atol=1e-15)
