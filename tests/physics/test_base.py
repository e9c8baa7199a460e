"""Laws of a base that moves: frames, parity with MuJoCo, and where its energy goes."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.interpolate import CubicSpline

from feeler.objects.motion import BaseMotion
from feeler.physics.engine import ENGINES
from feeler.physics.run import run_scene
from feeler.physics.scene import Clock, Path, Scene

from .mesh import run_like_mujoco
from .scenes import DYNAMIC, compute_kinetic, compute_spring, make_stub, shake, touch


def carry(scene: Scene, base: tuple[float, float, float]) -> Scene:
    """The whole scene on a base elsewhere, turned with it."""
    x, y, turn = base
    turned = np.array(
        [[np.cos(turn), np.sin(turn)], [-np.sin(turn), np.cos(turn)]]
    )  # from +y towards +x

    def move(item):
        place, forward, velocity = (
            turned @ np.array(v) for v in (item.place, item.forward, item.velocity)
        )
        return item.replace(
            place=(place[0] + x, place[1] + y), forward=tuple(forward), velocity=tuple(velocity)
        )

    return replace(scene, base=base, objects=tuple(map(move, scene.objects)))


@pytest.mark.further
@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize("contact", ["smooth", "hard"])
def test_a_base_at_constant_velocity_is_objects_that_come_the_other_way(engine, contact):
    scene = touch(n=20, contact=contact, approach=77.7)
    clock = Clock(duration=15, timestep=0.02)
    velocity = (0.2, -0.1)
    moved = tuple(
        item.replace(velocity=tuple(np.add(item.velocity, velocity))) for item in scene.objects
    )
    still = run_scene(scene, clock, engine)
    going = run_scene(
        replace(scene, objects=moved, base_motion=BaseMotion(velocity=velocity)), clock, engine
    )
    assert np.abs(still.angle).max() > 0.01
    np.testing.assert_allclose(going.angle, still.angle, atol=1e-10)
    np.testing.assert_allclose(going.force, still.force, atol=1e-9)
    np.testing.assert_allclose(going.base, clock.time[:, None] * [*velocity, 0.0], atol=1e-12)


@pytest.mark.parametrize("engine", ENGINES)
def test_a_scene_on_a_base_elsewhere_is_the_same_scene(engine):
    scene = touch("box", n=20, contact="smooth", approach=77.7)
    clock = Clock(duration=15, timestep=0.02)
    here = run_scene(scene, clock, engine)
    there = run_scene(carry(scene, (3.0, -2.0, 0.7)), clock, engine)
    c, s = np.cos(0.7), np.sin(0.7)
    np.testing.assert_allclose(there.angle, here.angle, atol=1e-10)
    np.testing.assert_allclose(there.force, here.force @ [[c, -s], [s, c]], atol=1e-9)
    np.testing.assert_allclose(there.base_moment, here.base_moment, atol=1e-9)
    np.testing.assert_allclose(there.work, here.work, atol=1e-10)


def test_a_recorded_base_stands_where_it_was_recorded_and_speed_alone_bends_nothing():
    scene = Scene(
        antenna=make_stub(), base=(1.0, 2.0, 0.3), base_motion=BaseMotion(velocity=(0.5, -0.2))
    )
    clock = Clock(duration=20, timestep=0.02)
    assert np.abs(run_scene(scene, clock, "chain").angle).max() < 1e-12
    motion = shake(20.0)
    found = run_scene(replace(scene, base_motion=motion), clock, "chain").base
    np.testing.assert_allclose(
        found - found[0], motion.compute_pose(clock.time) - motion.pose[0], atol=1e-12
    )


@pytest.mark.further
@pytest.mark.parametrize(
    "motion", [(1.0, 0.0), (0.0, 1.0), (1.0, 1.0)], ids=["shift", "turn", "both"]
)
def test_a_free_antenna_on_a_shaken_base_is_mujoco_to_rounding(motion):
    scene = Scene(
        antenna=make_stub(),
        base=(0.5, 1.5, 0.3),
        base_motion=shake(60.0, 3.0 * motion[0], motion[0], 0.3 * motion[1]),
        gravity=(2e-3, -9.81e-3),
    )
    check(scene, 1e-12)


@pytest.mark.long
@pytest.mark.parametrize(
    "motion", [{"turn": 0.0}, {"across": 0.0, "along": 0.0}], ids=["shift", "turn"]
)
@pytest.mark.parametrize("contact", ["smooth", "hard"])
@pytest.mark.parametrize("kind", ["ball", "box"])
def test_a_touched_antenna_on_a_shaken_base_is_mujoco(kind, contact, motion):
    scene = replace(
        touch(kind, n=12, contact=contact, approach=77.7, speed=0.03),
        base_motion=shake(60.0, **motion),
    )
    assert np.abs(check(scene, 1e-9).force).max() > 1e-5


def test_a_whole_antenna_on_a_shaken_base_is_mujoco():
    scene = replace(touch(whole=True, size=1.5, contact="smooth"), base_motion=shake(8.0))
    assert np.abs(check(scene, 1e-9, 8.0).force).max() > 1e-5


def check(scene: Scene, limit: float, duration: float = 60.0):
    """The same angles, forces of the base and works as MuJoCo's."""
    clock = Clock(duration=duration, sample_interval=0.5, timestep=0.02)
    ours, theirs = run_like_mujoco(scene, clock), run_scene(scene, clock, "mujoco")
    assert np.abs(theirs.angle - theirs.angle[0]).max() > 1e-3
    assert np.abs(ours.angle - theirs.angle).max() < limit
    for name in ("base_force", "base_moment", "work"):
        expected = getattr(theirs, name)
        assert (
            np.abs(getattr(ours, name) - expected).max() < 1e4 * limit * np.abs(expected).max()
        ), name
    return ours


@pytest.mark.further
@pytest.mark.parametrize("engine", DYNAMIC)
def test_a_base_spends_what_the_antenna_holds_and_loses(engine):
    """Work of the base = kinetic + elastic energy + ∫ Σ c ω² dt, from an antenna that starts at the
    base's own speed.
    """
    antenna, h = make_stub(8, damping=1e-3), 0.004 if engine == "mujoco" else 0.002
    motion = shake(20.0)
    scene = Scene(antenna=antenna, base_motion=motion)
    found = run_scene(
        scene,
        Clock(duration=20, sample_interval=0.02 if engine == "mujoco" else h, timestep=h),
        engine,
    )
    rate = CubicSpline(motion.time, motion.pose)(found.time, 1)
    held = compute_kinetic(antenna, found, rate) + compute_spring(antenna, found)
    power = (antenna.damping * found.velocity**2).sum(axis=1)
    lost = np.concatenate(
        [[0.0], np.cumsum((power[1:] + power[:-1]) / 2 * np.diff(found.time))]
    )
    np.testing.assert_allclose(
        1e-3 * found.work[:, 0], held - held[0] + lost, atol=1e-3 * held.max()
    )
    assert lost[-1] > 0.01 * held.max()


@pytest.mark.further
@pytest.mark.parametrize("engine", DYNAMIC)
def test_at_rest_forces_cancel_and_the_base_holds_the_first_spring(engine):
    scene = touch(n=8, size=0.5, contact="smooth", friction=0.5, speed=0.05)
    velocity = scene.objects[0].velocity
    scene = replace(
        scene,
        paths=(Path(velocity=(velocity, (0.0, 0.0)), end=(6.0,)),),
        gravity=(0.0, -9.81e-3),
    )
    found = run_scene(scene, Clock(duration=400, sample_interval=50, timestep=0.05), engine)
    antenna = scene.antenna
    assert np.abs(found.velocity[-1]).max() < 1e-7
    assert np.hypot(*found.force[-1]) > 1e-5
    weight = antenna.segment_mass.sum() * np.array(scene.gravity)
    total = found.base_force[-1] + found.force[-1] + weight
    np.testing.assert_allclose(total, 0.0, atol=1e-4 * np.hypot(*found.force[-1]))
    bend = antenna.stiffness[0] * (antenna.rest_angle[0] - found.angle[-1, 0])
    assert found.base_moment[-1] == pytest.approx(bend, rel=1e-4)
