"""The chain engine against MuJoCo at the same timestep: the same discrete equations, so the same
angles.

The scenes are free of ties (a face exactly along a straight chain, a gap of a whole number of
steps), because a tie is decided by the last bit of either engine and means nothing.
"""

import mujoco as engine
import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from feeler.objects import Box, Trial, Triangle, Wall, make_feature
from feeler.objects.bodies import Object
from feeler.objects.motion import BaseMotion
from feeler.physics import mujoco
from feeler.physics.contact import Contact, get_contact
from feeler.physics.run import run_scene
from feeler.physics.scene import Clock, Path, Scene, make_scene
from feeler.presets import make_preset

from .mesh import make_like_mujoco, run_like_mujoco, take_over
from .scenes import HOOK, make_stub, touch

PROFILES = ("exponential", "linear", "uniform")
MESHES = ("triangle", "outline")
# MuJoCo stores the corners of a mesh in single precision, which turns a slanted triangle by up to
# 1e-7 rad
MESH = 2e-8


def difference(scene: Scene, clock: Clock, run=run_like_mujoco) -> np.ndarray:
    """Largest difference over the joints at each sample [rad]."""
    ours, theirs = run(scene, clock), run_scene(scene, clock, "mujoco")
    assert np.abs(theirs.angle).max() > 1e-3  # something moved
    return np.abs(ours.angle - theirs.angle).max(axis=1)


@pytest.mark.further
@pytest.mark.parametrize("profile", PROFILES)
def test_free_motion_is_mujoco_to_rounding(profile):
    rng = np.random.default_rng(1)
    n = 140
    scene = Scene(
        antenna=make_preset(profile),
        angle=rng.normal(0, 0.01, n),
        velocity=rng.normal(0, 0.002, n),
        base=(0.0, 0.0, 0.3),
    )
    assert difference(scene, Clock(duration=20.5, timestep=0.02)).max() < 1e-12


@pytest.mark.further
@pytest.mark.parametrize("profile", PROFILES)
@pytest.mark.parametrize("kind", ["ball", "box"])
def test_first_touch_of_a_whole_antenna_is_mujoco(kind, profile):
    trial = Trial(feature=make_feature(kind, 1.5), location=0.7123, speed=0.6, lead=1.2345)
    scene = make_scene(make_preset(profile), trial, "hard")
    assert difference(scene, Clock(duration=6, timestep=0.02)).max() < 1e-9


@pytest.mark.parametrize("kind", MESHES)
def test_exact_corners_differ_from_mujocos_by_single_precision(kind):
    feature = HOOK if kind == "outline" else make_feature(kind, 0.8)
    scene = touch(feature, approach=57.3)
    clock = Clock(duration=15, sample_interval=0.5, timestep=0.02)
    exact = difference(scene, clock, lambda scene, clock: run_scene(scene, clock, "chain"))
    assert difference(scene, clock).max() < exact.max() < MESH


@pytest.mark.further
@pytest.mark.parametrize("kind", ["ball", "box", "triangle", "outline"])
@pytest.mark.parametrize("approach", [90.0, 57.3, 121.9])
@pytest.mark.parametrize("contact", ["smooth", "hard"])
def test_touch_of_a_stub_is_mujoco(kind, approach, contact):
    feature = HOOK if kind == "outline" else make_feature(kind, 0.8)
    scene = touch(feature, approach=approach, contact=contact)
    assert (
        difference(scene, Clock(duration=15, sample_interval=0.5, timestep=0.02)).max() < 1e-9
    )


@pytest.mark.further
@pytest.mark.parametrize("rounding", [0.0, 0.2])
@pytest.mark.parametrize(
    ("location", "approach"), [(0.35, 75.0), (0.85, 75.0), (0.6123, 20.0), (0.6123, 160.0)]
)
@pytest.mark.parametrize(("half_width", "half_height"), [(2.0, 0.3), (0.3, 2.0)])
def test_flat_and_tall_boxes_are_mujoco(half_width, half_height, location, approach, rounding):
    """A box's two sizes and its corners far from its centre."""
    box = Box(half_width=half_width, half_height=half_height, rounding=rounding)
    scene = touch(box, location=location, approach=approach)
    assert (
        difference(scene, Clock(duration=10, sample_interval=0.1, timestep=0.02)).max() < 1e-9
    )


@pytest.mark.further
@pytest.mark.parametrize("friction", [0.0, 0.8])
@pytest.mark.parametrize("shape", [Box, Triangle])
@pytest.mark.parametrize("approach", [90.0, 57.3, 121.9])
def test_rounded_shapes_are_mujoco(shape, approach, friction):
    scene = touch(
        shape(half_width=0.6, half_height=0.4, rounding=0.25),
        approach=approach,
        friction=friction,
    )
    assert (
        difference(scene, Clock(duration=12, sample_interval=0.1, timestep=0.02)).max() < 1e-9
    )


def test_wall_across_the_tip_is_mujoco():
    forward = (np.sin(0.5), -np.cos(0.5))
    path = Path(velocity=((0.3 * forward[0], 0.3 * forward[1]), (-0.1, 0.2)), end=(6.0,))
    antenna = make_stub(40)
    wall = Object(feature=Wall(), place=(0.0, antenna.length + 0.7), forward=forward)
    scene = Scene(antenna=antenna, objects=(wall,), paths=(path,), contact=get_contact("hard"))
    assert difference(scene, Clock(duration=15, timestep=0.02)).max() < 1e-9


@pytest.mark.further
@pytest.mark.parametrize("solref", [(0.2, 1.0), (0.1, 0.5), (1.0, 1.3)])
@pytest.mark.parametrize(
    "solimp",
    [(0.9, 0.95, 0.001, 0.5, 2.0), (0.5, 0.99, 0.05, 0.3, 1.0), (0.2, 0.9, 0.1, 0.6, 3.0)],
)
@pytest.mark.parametrize("friction", [0.0, 0.05, 0.4])
def test_contact_parameters_mean_what_mujoco_means(solref, solimp, friction):
    scene = touch(n=12, friction=friction, contact=Contact(solref=solref, solimp=solimp))
    assert difference(scene, Clock(duration=4, sample_interval=0.5, timestep=0.02)).max() < 1e-9


def draw_antenna(n: int, rng: np.random.Generator):
    """A stub of random sizes and posture."""
    return make_stub(
        n,
        segment_length=rng.uniform(0.2, 0.5, n),
        segment_mass=rng.uniform(0.5e-6, 5e-6, n),
        rest_angle=rng.normal(0, 0.1, n),
    )


def throw(
    points: np.ndarray,
    kind: str,
    speed: float,
    rng: np.random.Generator,
    drift=(0.0, 0.0),
    **fields,
) -> Object:
    """An object thrown from a random direction at a random hinge, which drifts."""
    size = rng.uniform(0.4, 1.5)
    if kind.startswith("rounded"):
        feature = make_feature(kind.split()[1], size, rounding=rng.uniform(0.05, 0.5))
    else:
        feature = HOOK if kind == "outline" else make_feature(kind, size)
    direction = rng.uniform(-np.pi, np.pi)
    forward = np.array([np.cos(direction), np.sin(direction)])
    side = np.array([-forward[1], forward[0]])
    target = points[rng.integers(1, len(points))] + rng.uniform(-0.3, 0.3) * side
    place = target - rng.uniform(5.0, 8.0) * forward * speed - 0.25 * forward
    velocity = tuple(speed * forward + drift)
    fields = {"friction": rng.uniform(0.05, 1.2)} | fields
    return Object(
        feature=feature, place=tuple(place), forward=tuple(forward), velocity=velocity, **fields
    )


@st.composite
def scenes(draw, moving):
    """Stubs of random size, posture and motion, at which an object is thrown from a random
    direction; or two, one of them spinning, at where the antenna will be on a base that moves.
    """
    n = draw(st.integers(2, 12))
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    antenna = draw_antenna(n, rng)
    base = (
        *(moving * rng.uniform(-5, 5, 2)),
        rng.uniform(-1, 1) * draw(st.sampled_from([0, 1])),
    )
    drift = moving * rng.uniform(-0.1, 0.1, 2)
    points = antenna.shape(base_angle=base[2]) + base[:2]
    more = ["rounded box", "rounded triangle"] if moving else ["outline"]
    kind = st.sampled_from(["ball", "box", "triangle", *more])
    speed = draw(st.sampled_from([0.06, 0.1, 0.3, 0.6]))
    frictions = rng.uniform(0.05, 1.2), draw(st.sampled_from([0.0, 0.5]))
    spins = 0.0, rng.uniform(-0.02, 0.02)
    objects = [
        throw(points, draw(kind), speed, rng, drift, turn=turn, friction=friction)
        for turn, friction in zip(spins, frictions, strict=True)
    ]
    return Scene(
        antenna=antenna,
        objects=tuple(objects[: 1 + moving]),
        contact=get_contact(draw(st.sampled_from(["smooth", "hard"]))),
        gravity=tuple(moving * rng.uniform(-0.01, 0.01, 2)),
        angle=antenna.rest_angle + rng.normal(0, 0.02, n),
        velocity=rng.normal(0, 0.002, n),
        base=base,
        base_motion=BaseMotion(velocity=tuple(drift), turn=moving * rng.uniform(-0.01, 0.01)),
        label="random",
    )


def step_alike(
    scene: Scene, timestep: float, n_steps: int
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Angular velocities (step, segment) after each of MuJoCo's steps, the chain's after the same
    step from MuJoCo's own state, and what touched in each step (step,): 0 nothing, 1 no mesh, 2 a
    mesh, 3 a mesh in a way that the two see differently: along whose face a segment lies, or into
    which it has sunk more than 0.02 mm.
    """
    theirs, ours = mujoco._MujocoStepper([scene], timestep), make_like_mujoco([scene], timestep)
    n = scene.antenna.n_segments
    found, touched = np.empty((2, n_steps, n)), np.zeros(n_steps, dtype=int)
    after = theirs.read()
    for k in range(n_steps):
        state = after
        take_over(ours, state)
        theirs.step(1)
        ours.step(1)
        after = theirs.read()
        found[:, k] = after.velocity[0], ours.read().velocity[0]
        contacts = theirs.read_contacts(0)
        heading = state.base[0, 2] + np.cumsum(state.angle[0])
        for o, segment, distance in zip(
            contacts.object, contacts.segment, contacts.distance, strict=True
        ):
            feature, mesh = scene.objects[o].feature, scene.objects[o].feature.kind in MESHES
            odd = mesh and (
                distance < -0.02 - feature.rounding
                or lies_along_a_face(feature.parts, state.forward[0, o], heading[segment - 1])
            )
            touched[k] = max(touched[k], 1 + mesh + odd)
    return *found, touched


def lies_along_a_face(
    parts: tuple[np.ndarray, ...], forward: np.ndarray, heading: float
) -> bool:
    """Whether a segment of this heading is within 0.02 rad of parallel to a face of a mesh: a tie
    between its ends.
    """
    x, y = forward
    for part in parts:
        edges = (np.roll(part, -1, axis=0) - part) @ np.array([[x, y], [-y, x]])
        across = edges[:, 0] * np.cos(heading) - edges[:, 1] * np.sin(heading)
        if (np.abs(across) < 0.02 * np.hypot(*edges.T)).any():
            return True
    return False


def check_steps(scene: Scene, timestep: float, n_steps: int) -> np.ndarray:
    """Equal steps where they can be; what touched (step,)."""
    theirs, ours, touched = step_alike(scene, timestep, n_steps)
    assume(not touched[0])  # nothing is thrown at an antenna from inside it
    found = np.abs(ours - theirs).max(axis=1) / np.abs(theirs).max()
    for what, limit in ((0, 1e-12), (1, 1e-9), (2, 1e-5)):
        assert found[touched == what].max(initial=0.0) < limit
    return touched


@pytest.mark.long
@pytest.mark.parametrize(
    ("moving", "timestep", "n_steps", "n_scenes"),
    [
        (False, 0.02, 500, 10),
        (True, 0.04, 250, 6),
        pytest.param(False, 0.02, 500, 40, marks=pytest.mark.slow),
        pytest.param(True, 0.04, 250, 20, marks=pytest.mark.slow),
    ],
)
def test_every_step_of_a_random_scene_is_mujoco(moving, timestep, n_steps, n_scenes):
    """Each step from MuJoCo's own state, so that chaos can neither hide nor make a difference.

    MuJoCo finds the distance to a mesh by iteration; an error of 1e-9 mm there is one of 1e-6 in
    the contact force, because its impedance rises within 1e-3 mm.
    """

    @settings(max_examples=n_scenes, deadline=None, derandomize=True)
    @given(scenes(moving))
    def check(scene):
        check_steps(scene, timestep, n_steps)

    check()


@pytest.mark.further
@pytest.mark.parametrize("kind", ["ball", "box"])
def test_the_reference_engine_is_bare_mj_step(kind):
    """What the reference engine adds to MuJoCo's step, it adds outside of its numbers."""
    scene, h = touch(kind, n=12, approach=77.7), 0.02
    model = mujoco.compile_model(scene, h)
    data, n = engine.MjData(model), scene.antenna.n_segments
    data.qpos[:n] = scene.initial_angle
    data.qvel[n:] = [
        *scene.objects[0].velocity,
        scene.objects[0].turn,
    ]
    motion = run_scene(scene, Clock(duration=10, sample_interval=h, timestep=h), "mujoco")
    assert np.abs(motion.angle).max() > 1e-3
    for angle in motion.angle:
        np.testing.assert_allclose(angle, data.qpos[:n], atol=1e-12)
        engine.mj_step(model, data)


def run_mujoco_consistently(scene: Scene, clock: Clock) -> np.ndarray:
    """MuJoCo made to solve contact with M + hC: armature h·c, damping explicit, contact softness
    left as it was.
    """
    model = mujoco.compile_model(scene, clock.timestep)
    n = scene.antenna.n_segments
    model.dof_armature[:n] = clock.timestep * scene.antenna.damping
    model.opt.disableflags |= engine.mjtDisableBit.mjDSBL_EULERDAMP
    data = engine.MjData(model)
    data.qpos[:n] = scene.initial_angle
    data.qvel[:n] = scene.initial_velocity
    data.qvel[n : n + 2] = scene.objects[0].velocity
    angle = np.empty((clock.n_samples, n))
    for k in range(clock.n_samples):
        angle[k] = data.qpos[:n]
        engine.mj_step(model, data, nstep=clock.steps_per_sample)
    return angle


@pytest.mark.further
@pytest.mark.parametrize("kind", ["ball", "box"])
@pytest.mark.parametrize("profile", PROFILES)
def test_consistent_scheme_is_mujoco_with_damping_as_armature(kind, profile):
    trial = Trial(feature=make_feature(kind, 1.5), location=0.7123, speed=0.6, lead=1.2345)
    scene = make_scene(make_preset(profile), trial, "hard")
    clock = Clock(duration=6, timestep=0.02)
    ours = run_scene(scene, clock, "chain-consistent").angle
    theirs = run_mujoco_consistently(scene, clock)
    assert np.abs(theirs).max() > 1e-3
    assert np.abs(ours - theirs).max() < 1e-9
