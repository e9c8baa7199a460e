"""A base that gives way, and a flow that drags: against MuJoCo, and against closed forms."""

import numpy as np
import pytest

from feeler.antenna.files import parse_antenna, write_antenna
from feeler.antenna.segments import Antenna, Follicle
from feeler.errors import InvalidInput
from feeler.objects.motion import Flow
from feeler.physics.run import run_group, run_scene
from feeler.physics.scene import Clock, Scene
from feeler.physics.simulation import Simulation
from tests.physics.scenes import FORCES, check_alike
from tests.physics.test_space import CARRIED, compare, hit, make, shake

pytestmark = pytest.mark.long

SOFT = Follicle(stiffness=(0.02, 0.05, 0.03), damping=(0.01, 0.02, 0.005))
STREAM = Flow(drag=2e-5, velocity=(0.3, -0.2, 0.1))


@pytest.mark.parametrize(
    ("follicle", "flow", "planes"),
    [
        pytest.param(SOFT, None, 2, marks=pytest.mark.long),
        pytest.param(None, STREAM, 2, marks=pytest.mark.long),
        (SOFT, STREAM, 3),
    ],
)
def test_free_motion_is_mujoco_to_rounding(follicle, flow, planes):
    """1,000 steps with angles beyond 1 rad, on a base that shakes in all six degrees of freedom."""
    antenna = make(planes, 8, follicle=follicle)
    angle = np.random.default_rng(planes).normal(0, 0.5, (planes, 8))
    scene = Scene(
        antenna=antenna,
        angle=angle,
        gravity=(0.0, -9.8e-3, 1e-3),
        base_motion=shake(10.0),
        flow=flow,
    )
    ours, theirs = compare(scene, Clock(duration=10, timestep=0.01))
    assert np.abs(theirs.angle).max() > 1.0
    check_alike(ours, theirs, 1e-12, 1e-9)


@pytest.mark.parametrize("kind", ["ball", pytest.param("peg", marks=pytest.mark.slow)])
def test_contact_is_mujoco(kind):
    """60 ms on a carried base that gives way, in a flow: 1e-9 rad."""
    antenna = make(3, follicle=SOFT)
    scene = Scene(
        antenna=antenna, objects=(hit(kind, antenna),), base_motion=CARRIED, flow=STREAM
    )
    ours, theirs = compare(scene, Clock(duration=60, sample_interval=2.0, timestep=0.02))
    assert np.linalg.norm(theirs.force, axis=1).max() > 1e-4
    check_alike(ours, theirs, 1e-9, 1e-7, ("force", *FORCES))


def test_lanes_with_and_without_a_follicle_do_not_know_each_other():
    scenes = [
        Scene(antenna=make(2, 6, follicle=follicle), base_motion=CARRIED, flow=flow)
        for follicle, flow in ((SOFT, None), (None, None), (SOFT, STREAM))
    ]
    clock = Clock(duration=5, timestep=0.02)
    for scene, found in zip(scenes, run_group(scenes, clock, "chain"), strict=True):
        alone = run_scene(scene, clock, "chain")
        for name in ("angle", "base", "base_force", "base_moment", "work"):
            np.testing.assert_array_equal(getattr(found, name), getattr(alone, name))


def test_a_flow_across_bends_a_beam_and_pushes_its_follicle():
    """Load per length w = c u: base force w L, moment w L²/2, tip at w L⁴/8EI + w L/k."""
    length, wind, stiff = 30.0, 0.2, 0.004
    antenna = Antenna.from_beam(
        length=length,
        radius=0.15,
        modulus=3000,
        density=1.2e-3,
        damping_time=30,
        n_segments=40,
        planes=2,
    ).replace(follicle=Follicle(stiffness=(1.0, 1.0, stiff), damping=(0.5, 0.5, 0.1)))
    flow = Flow(drag=1e-6, velocity=(0.0, 0.0, wind))
    runs = Simulation(antenna, flow=flow)
    runs.step(1500.0)
    load, bend = flow.drag * wind, 3000 * np.pi / 4 * 0.15**4
    np.testing.assert_allclose(
        runs.base_force, [0.0, 0.0, -load * length], rtol=1e-4, atol=1e-8
    )
    assert runs.base_moment[0] == pytest.approx(-load * length**2 / 2, rel=1e-3)
    assert runs.base[2] == pytest.approx(load * length / stiff, rel=1e-3)
    assert runs.tip[2] == pytest.approx(
        load * (length**4 / 8 / bend + length / stiff), rel=5e-3
    )


def test_a_follicle_is_kept_in_files_and_moments():
    antenna = make(2, 5, follicle=SOFT)
    assert parse_antenna(write_antenna(antenna)).antenna == antenna
    assert "follicle" not in make(2, 5).to_plain()
    assert Antenna(**antenna.to_plain()) == antenna
    runs = Simulation(antenna, gravity=(0.0, 0.0, 9.8e-3))
    runs.step(3.0)
    moment = runs.snapshot()
    runs.step(3.0)
    place = runs.base
    runs.restore(moment)
    runs.step(3.0)
    np.testing.assert_array_equal(runs.base, place)
    assert abs(place[2]) > 1e-6


def test_the_plane_has_neither():
    flat = make(2, 5).flatten()
    with pytest.raises(InvalidInput, match="follicle is for antennas in space"):
        flat.replace(follicle=SOFT)
    with pytest.raises(InvalidInput, match="flow drags antennae in space only"):
        Simulation(flat, flow=STREAM)
    with pytest.raises(InvalidInput, match=r"Follicle.stiffness must be 3 numbers > 0 N/mm"):
        Follicle(stiffness=(0.0, 1.0, 1.0))
