"""Laws of the chain engine that need no other engine: closed forms, conservation, symmetry, lanes
that do not mix.
"""

from dataclasses import replace
from threading import Event

import numpy as np
import pytest
from numba.core.runtime import _nrt_python, rtsys

from feeler.antenna.segments import Antenna, compute_mass_matrix
from feeler.errors import InvalidInput
from feeler.objects import Trial, Wall, make_feature
from feeler.objects.bodies import Object
from feeler.physics.chain.fields import B_PULL_X
from feeler.physics.chain.stepper import ChainStepper
from feeler.physics.contact import Contact, get_contact
from feeler.physics.engine import ENGINES
from feeler.physics.run import advance, run_scene, simulate
from feeler.physics.scene import Clock, Motion, Path, Scene, make_scene
from feeler.presets import make_preset

from .scenes import CHAINS, DYNAMIC, compute_energy, touch, uniform


def test_one_segment_is_a_torsion_pendulum():
    antenna = uniform(1)
    omega = np.sqrt(antenna.stiffness[0] / (1e-6 * 0.3**2 / 3))
    clock = Clock(duration=1, sample_interval=0.01, timestep=1e-4)
    found = run_scene(Scene(antenna=antenna, angle=np.array([0.4])), clock, "chain")
    np.testing.assert_allclose(
        found.angle[:, 0], 0.4 * np.cos(omega * clock.time), atol=0.4 * omega * 1e-4
    )


def test_undamped_free_motion_keeps_its_energy_to_first_order():
    antenna, rng = uniform(6, stiffness=1e-4), np.random.default_rng(5)
    scene = Scene(antenna=antenna, angle=rng.normal(0, 0.3, 6))
    drift = []
    for h in (5e-5, 2.5e-5):
        energy = compute_energy(
            antenna,
            run_scene(scene, Clock(duration=4, sample_interval=0.1, timestep=h), "chain"),
        )
        drift.append(np.abs(energy / energy[0] - 1).max())
    assert drift[0] < 0.05
    assert drift[1] < 0.6 * drift[0]


def find_centre(scene: Scene, radius: float, time: np.ndarray) -> np.ndarray:
    """Centre of the scene's ball at times."""
    ball = scene.objects[0]
    return (
        np.asarray(ball.place)
        + time * np.asarray(ball.velocity)
        - radius * np.asarray(ball.forward)
    )


def hit(n: int) -> Scene:
    """A chain of hinges that are as good as free, hit at its last segment by a heavy ball without
    friction.
    """
    antenna = uniform(n, stiffness=1e-20)
    trial = Trial(
        feature=make_feature("ball", 0.3),
        location=1 - 0.4 / n,
        speed=0.3,
        lead=0.3,
        friction=0.0,
    )
    return make_scene(antenna, trial, "hard")


def compute_momentum(antenna: Antenna, motion: Motion) -> np.ndarray:
    """Angular momentum about the clamp at each sample, positive from +y towards +x [g·mm²/ms]."""
    heading, turn = np.cumsum(motion.angle, axis=1), np.cumsum(motion.velocity, axis=1)
    length, mass = antenna.segment_length, antenna.segment_mass
    points = antenna.shape(motion.angle)
    along = np.stack([np.cos(heading), -np.sin(heading)], axis=-1) * (turn * length)[..., None]
    velocity = np.cumsum(along, axis=1) - along / 2
    centre = (points[:, 1:] + points[:, :-1]) / 2
    orbit = centre[..., 1] * velocity[..., 0] - centre[..., 0] * velocity[..., 1]
    return (mass * orbit + mass * length**2 / 12 * turn).sum(axis=1)


@pytest.mark.parametrize("engine", CHAINS)
@pytest.mark.parametrize("n", [2, 3])
def test_a_free_collision_gives_its_impulse_to_the_chain(n, engine):
    """Change of angular momentum about the clamp = impulse × lever; without friction the force goes
    through the ball's centre. Hinges are free, so nothing else acts about the clamp. First order in
    the timestep."""
    scene, errors = hit(n), []
    for h in (2e-3, 1e-3):
        motion = run_scene(scene, Clock(duration=1.5, sample_interval=h, timestep=h), engine)
        steps = np.arange(len(motion.time) - 1)[:, None]
        centre = find_centre(scene, 0.3, h * steps)
        torque = centre[:, 1] * motion.force[1:, 0] - centre[:, 0] * motion.force[1:, 1]
        momentum = compute_momentum(scene.antenna, motion)
        assert momentum[-1] > 1e-7
        errors.append(np.abs(momentum[1:] - np.cumsum(h * torque)).max() / momentum.max())
    assert errors[0] < 0.01
    assert errors[1] < 0.7 * errors[0] or errors[1] < 1e-6


@pytest.mark.parametrize("contact", ["smooth", "hard"])
@pytest.mark.parametrize("profile", ["exponential", "uniform"])
def test_consistent_scheme_is_stable_at_the_largest_timestep(profile, contact):
    """Half the contact's time constant, the fastest of the paper's touches, the stiffest
    damping.
    """
    trial = Trial(feature=make_feature("box", 1.5), location=0.5, speed=0.6)
    scene = make_scene(make_preset(profile), trial, contact)
    coarse, fine = (
        run_scene(scene, Clock(duration=60, timestep=h), "chain-consistent").angle
        for h in (0.1, 0.0125)
    )
    assert np.abs(coarse - fine).max() < 0.15 * np.abs(fine).max()


@pytest.mark.parametrize("damped", [False, True])
@pytest.mark.parametrize("lanes", [1, 8])
def test_a_step_allocates_nothing(lanes, damped):
    _nrt_python.memsys_enable_stats()
    stepper = ChainStepper([touch()] * lanes, 0.02, damped)
    stepper.step(200)
    assert stepper.tables.number.min() > 0
    counts = []
    for n_steps in (1, 1000):
        before = rtsys.get_allocation_stats().alloc
        stepper.step(n_steps)
        counts.append(rtsys.get_allocation_stats().alloc - before)
    assert counts[0] == counts[1]


@pytest.mark.parametrize("engine", DYNAMIC)
def test_frictionless_ball_pushes_through_its_centre(engine):
    """Along the line from the centre to the nearest point of the one segment."""
    scene, h = touch(size=0.15, n=1, friction=0.0), 0.02
    motion = run_scene(scene, Clock(duration=1.5, sample_interval=h, timestep=h), engine)
    pushed = np.flatnonzero(motion.force[:, 0] > 1e-7)
    assert pushed.size > 5
    for k in pushed:  # the force belongs to the state before the sample
        (start, end) = scene.antenna.shape(motion.angle[k - 1])
        centre = find_centre(scene, 0.15, h * (k - 1))
        share = (centre - start) @ (end - start) / np.sum((end - start) ** 2)
        away = start + share * (end - start) - centre
        assert 0 < share < 1
        turned = (
            np.linalg.det([away, motion.force[k]])
            / np.hypot(*away)
            / np.hypot(*motion.force[k])
        )
        assert abs(turned) < 1e-12


def test_resting_on_a_wall_is_statics():
    """The last hinge's spring balances one force that acts on the last segment. Only the consistent
    scheme comes to rest: at this damping MuJoCo's keeps chattering, on the chain and in MuJoCo
    alike."""
    antenna = uniform(8, stiffness=np.linspace(2e-2, 1e-2, 8), damping=0.05)
    forward = np.array([np.cos(0.2), -np.sin(0.2)])
    path = Path(velocity=(tuple(0.05 * forward), (0.0, 0.0)), end=(6.0,))
    wall = Object(feature=Wall(), place=(-0.1, 2.6), forward=tuple(forward), friction=0.01)
    scene = Scene(antenna=antenna, objects=(wall,), paths=(path,), contact=get_contact("hard"))
    motion = run_scene(
        scene, Clock(duration=300, sample_interval=10, timestep=0.02), "chain-consistent"
    )
    torque = -antenna.stiffness[-1] * motion.angle[-1, -1]
    force, points = motion.force[-1], antenna.shape(motion.angle[-1])
    assert np.hypot(*force) > 1e-5
    assert np.abs(motion.velocity[-1]).max() < 1e-6
    lever = -torque / np.hypot(
        *force
    )  # the last hinge's torque over the force: where along the segment it acts
    assert 0 < lever <= np.hypot(*(points[-1] - points[-2])) * 1.02 + 0.1 * 0.02


@pytest.mark.parametrize("engine", CHAINS)
def test_lanes_have_the_bits_of_single_runs(engine):
    scenes = [
        touch(kind, 1.0, speed=speed)
        for kind in ("ball", "box", "triangle")
        for speed in (0.6, 0.3, 0.06)
    ]
    scenes += [
        touch(n=20),
        Scene(antenna=scenes[0].antenna, angle=np.full(30, 0.01)),
        scenes[0],
    ]
    clock = Clock(duration=6, timestep=0.02)
    alone = [run_scene(scene, clock, engine) for scene in scenes]
    for order in (range(len(scenes)), reversed(range(len(scenes)))):
        order = list(order)
        together = simulate([scenes[i] for i in order], clock, engine=engine, workers=2)
        for i, found in zip(order, together, strict=True):
            for name in vars(found):
                assert (
                    np.asarray(getattr(found, name)).tobytes()
                    == np.asarray(getattr(alone[i], name)).tobytes()
                ), name


@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize("ends", [(0.4,), (0.06, 0.4), (0.02, 0.04, 1.0)])
def test_a_leg_ends_at_its_step(engine, ends):
    """Where an object stands after each step is the sum of its legs' velocities times their
    times.
    """
    rng, h = np.random.default_rng(1), 0.02
    velocity = rng.normal(0, 0.1, (len(ends) + 1, 2))
    scene = replace(
        touch(size=0.3, n=2), paths=(Path(velocity=tuple(map(tuple, velocity)), end=ends),)
    )
    stepper, spent = ENGINES[engine].make([scene], h), 0
    for step in (1, 3, 4, 19, 20, 21, 22, 50, 51, 70):
        advance(stepper, [spent], step - spent, Event())
        spent, edges = step, np.array([0.0, *ends, np.inf])
        share = np.clip(h * step - edges[:-1], 0.0, np.diff(edges))
        moved = stepper.read().place[0, 0] - scene.objects[0].place
        np.testing.assert_allclose(moved, share @ velocity, atol=1e-13)


def test_an_object_that_stops_short_touches_nothing():
    scene = replace(touch(), paths=(Path(velocity=((0.3, 0.0), (0.0, 0.0)), end=(0.54,)),))
    clock = Clock(duration=5, timestep=0.02)
    assert not np.any(run_scene(scene, clock, "chain").force)
    longer = replace(scene, paths=(Path(velocity=((0.3, 0.0), (0.0, 0.0)), end=(0.56,)),))
    assert np.any(run_scene(longer, clock, "chain").force)


def test_bad_input_says_what_to_do():
    scene, clock = touch(), Clock(duration=2, timestep=0.02)
    with pytest.raises(InvalidInput, match=r"at most 0\.1 ms"):
        run_scene(scene, Clock(duration=2, timestep=0.2), "chain")
    with pytest.raises(
        InvalidInput, match="unknown engine 'fast'; valid: chain-consistent, chain, mujoco"
    ):
        run_scene(scene, clock, "fast")
    with pytest.raises(InvalidInput, match="workers must be a whole number ≥ 1"):
        simulate([scene], clock, engine="chain", workers=0)
    assert simulate([], clock, engine="chain") == []


@pytest.mark.parametrize("engine", DYNAMIC)
def test_the_largest_timestep_is_half_the_contact_s_time_constant(engine):
    scene = touch(size=0.3, n=2, contact=Contact(solref=(0.3, 1.0)))
    ENGINES[engine].make([scene], 0.15)
    with pytest.raises(InvalidInput, match=r"use at most 0\.1 ms"):
        ENGINES[engine].make([scene], 0.15 * (1 + 1e-6))


@pytest.mark.parametrize("damped", [False, True])
def test_tip_force_and_gravity_find_their_balance(damped):
    """k q = (F + m g / 2) ℓ cos q for one segment pulled along +x; the base holds both and k q."""
    antenna = uniform(1, stiffness=1e-3, damping=0.02)
    stepper = ChainStepper([Scene(antenna=antenna, gravity=(500.0, 0.0))], 0.02, damped)
    stepper.tables.base[0, B_PULL_X] = 1e-3  # for callers of the sweeps
    stepper.step(45_000)
    state = stepper.read()
    q = state.angle[0, 0]
    assert q == pytest.approx((1e-3 + 1e-6 * 500.0 / 2) * 0.3 * np.cos(q) / 1e-3, rel=1e-9)
    np.testing.assert_allclose(state.base_force[0], [-1e-3 - 1e-6 * 500.0, 0.0], atol=1e-12)
    assert state.base_moment[0] == pytest.approx(-1e-3 * q, rel=1e-9)


@pytest.mark.parametrize("n", [1, 2, 1000])
def test_any_number_of_segments(n):
    rng = np.random.default_rng(n)
    scene = Scene(antenna=uniform(n, stiffness=1.0, damping=1.0), angle=rng.normal(0, 0.01, n))
    motion = run_scene(scene, Clock(duration=3, timestep=0.02), "chain")
    assert np.abs(motion.angle[-1]).max() < np.abs(motion.angle[0]).max()


def test_one_damped_segment_creeps_as_implicit_euler_says():
    antenna = uniform(1, stiffness=1e-3, damping=2.0)
    h, inertia = 0.1, 1e-6 * 0.3**2 / 3
    q, v, expected = 0.4, 0.0, []
    for _ in range(50):
        expected.append(q)
        v += h * (-1e-3 * q - 2.0 * v) / (inertia + h * 2.0)
        q += h * v
    found = run_scene(
        Scene(antenna=antenna, angle=np.array([0.4])),
        Clock(duration=5, sample_interval=h, timestep=h),
        "chain",
    )
    np.testing.assert_allclose(found.angle[:, 0], expected, rtol=1e-12)


def test_small_step_starts_with_the_dense_mass_matrix():
    antenna, rng = make_preset("cockroach"), np.random.default_rng(3)
    angle = antenna.rest_angle + 1e-9 * rng.normal(size=140)
    h = 1e-3
    found = run_scene(
        Scene(antenna=antenna, angle=angle),
        Clock(duration=2 * h, sample_interval=h, timestep=h),
        "chain",
    )
    mass = compute_mass_matrix(antenna) + h * np.diag(antenna.damping)
    expected = h * np.linalg.solve(mass, -antenna.stiffness * (angle - antenna.rest_angle))
    np.testing.assert_allclose(found.velocity[1], expected, atol=1e-8 * np.abs(expected).max())


def test_damping_only_takes_energy():
    antenna, rng = uniform(12, damping=1e-3), np.random.default_rng(7)
    scene = Scene(antenna=antenna, angle=rng.normal(0, 0.3, 12))
    energy = compute_energy(
        antenna,
        run_scene(scene, Clock(duration=4, sample_interval=0.05, timestep=1e-4), "chain"),
    )
    assert np.all(np.diff(energy) < 1e-3 * energy[0])
    assert energy[-1] < 0.5 * energy[0]
