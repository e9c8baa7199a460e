"""Laws of the chain engine that need no other engine: closed forms, conservation, symmetry, lanes that do not mix."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from numba.core.runtime import _nrt_python, rtsys

from feeler.antenna.antenna import Antenna
from feeler.antenna.modes import compute_mass_matrix
from feeler.errors import InvalidInput, SimulationDiverged
from feeler.physics import chain
from feeler.physics.chain.batch import Batch
from feeler.physics.chain.fields import O_GRAVITY_X, O_PULL_X
from feeler.physics.chain.model import compute_invweight, make_model
from feeler.physics.clock import Clock
from feeler.physics.scene import Contact, Motion, Path, Scene, make_scene
from feeler.presets import make_preset
from feeler.stimulus import Trial, Wall, make_feature


def uniform(n: int, stiffness: float = 1e-3, damping: float = 0.0, **fields: object) -> Antenna:
    """A chain of equal segments, 0.3 mm and 1 µg each."""
    base = {"segment_length": np.full(n, 0.3), "segment_mass": 1e-6, "radius": 0.1}
    return Antenna(**base, stiffness=stiffness, damping=damping, **fields)


def touch(kind: str = "ball", size: float = 1.0, n: int = 30, **fields: object) -> Scene:
    """A cockroach's last segments, touched from the left."""
    whole = make_preset("cockroach")
    names = ("segment_length", "segment_mass", "radius", "stiffness", "damping")
    antenna = Antenna(**{name: getattr(whole, name)[-n:] for name in names})
    options = {"location": 0.6123, "speed": 0.3, "lead": 0.5432} | fields
    return make_scene(antenna, Trial(feature=make_feature(kind, size), **options))


def compute_energy(antenna: Antenna, motion: Motion) -> np.ndarray:
    """Kinetic plus elastic energy at each sample [N·mm]."""
    heading, turn = np.cumsum(motion.angle, axis=1), np.cumsum(motion.velocity, axis=1)
    length, mass = antenna.segment_length, antenna.segment_mass
    along = np.stack([np.cos(heading), -np.sin(heading)], axis=-1) * (turn * length)[..., None]
    centre = np.cumsum(along, axis=1) - along / 2
    kinetic = 0.5 * (mass * (centre**2).sum(-1) + mass * length**2 / 12 * turn**2).sum(axis=1)
    return kinetic + 0.5 * (antenna.stiffness * (motion.angle - antenna.rest_angle) ** 2).sum(axis=1)


def densify(points: np.ndarray) -> np.ndarray:
    """Many points along a polyline."""
    return np.concatenate([np.linspace(a, b, 1000) for a, b in pairwise(points)])


def test_one_segment_is_a_torsion_pendulum():
    antenna = uniform(1)
    omega = np.sqrt(antenna.stiffness[0] / (1e-6 * 0.3**2 / 3))
    clock = Clock(duration=1, sample_interval=0.01, timestep=1e-4)
    found = chain.run(Scene(antenna=antenna, angle=np.array([0.4])), clock)
    np.testing.assert_allclose(found.angle[:, 0], 0.4 * np.cos(omega * clock.time), atol=0.4 * omega * 1e-4)


def test_one_damped_segment_creeps_as_implicit_euler_says():
    antenna = uniform(1, stiffness=1e-3, damping=2.0)
    h, inertia = 0.1, 1e-6 * 0.3**2 / 3
    q, v, expected = 0.4, 0.0, []
    for _ in range(50):
        expected.append(q)
        v += h * (-1e-3 * q - 2.0 * v) / (inertia + h * 2.0)
        q += h * v
    found = chain.run(Scene(antenna=antenna, angle=np.array([0.4])), Clock(duration=5, sample_interval=h, timestep=h))
    np.testing.assert_allclose(found.angle[:, 0], expected, rtol=1e-12)


def test_small_step_starts_with_the_dense_mass_matrix():
    antenna, rng = make_preset("cockroach"), np.random.default_rng(3)
    angle = antenna.rest_angle + 1e-9 * rng.normal(size=140)
    h = 1e-3
    found = chain.run(Scene(antenna=antenna, angle=angle), Clock(duration=2 * h, sample_interval=h, timestep=h))
    mass = compute_mass_matrix(antenna) + h * np.diag(antenna.damping)
    expected = h * np.linalg.solve(mass, -antenna.stiffness * (angle - antenna.rest_angle))
    np.testing.assert_allclose(found.velocity[1], expected, atol=1e-8 * np.abs(expected).max())


def test_undamped_free_motion_keeps_its_energy_to_first_order():
    antenna, rng = uniform(6, stiffness=1e-4), np.random.default_rng(5)
    scene = Scene(antenna=antenna, angle=rng.normal(0, 0.3, 6))
    drift = []
    for h in (5e-5, 2.5e-5):
        energy = compute_energy(antenna, chain.run(scene, Clock(duration=4, sample_interval=0.1, timestep=h)))
        drift.append(np.abs(energy / energy[0] - 1).max())
    assert drift[0] < 0.05
    assert drift[1] < 0.6 * drift[0]


def hit(n: int) -> Scene:
    """A chain of hinges that are as good as free, hit at its last segment by a heavy ball without friction."""
    antenna = uniform(n, stiffness=1e-20)
    trial = Trial(feature=make_feature("ball", 0.3), location=1 - 0.4 / n, speed=0.3, lead=0.3, friction=0.0)
    return make_scene(antenna, trial)


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


@pytest.mark.parametrize("scheme", chain.SCHEMES)
@pytest.mark.parametrize("n", [2, 3])
def test_a_free_collision_gives_its_impulse_to_the_chain(n, scheme):
    """Change of angular momentum about the clamp = impulse × lever; without friction the force goes through the ball's
    centre. Hinges are free, so nothing else acts about the clamp. First order in the timestep."""
    scene, errors = hit(n), []
    for h in (2e-3, 1e-3):
        motion = chain.run(scene, Clock(duration=1.5, sample_interval=h, timestep=h), scheme=scheme)
        steps = np.arange(len(motion.time) - 1)[:, None]
        centre = np.asarray(scene.origin) + (0.3 * h * steps - 0.3) * np.asarray(scene.forward)
        torque = centre[:, 1] * motion.force[1:, 0] - centre[:, 0] * motion.force[1:, 1]
        momentum = compute_momentum(scene.antenna, motion)
        assert momentum[-1] > 1e-7
        errors.append(np.abs(momentum[1:] - np.cumsum(h * torque)).max() / momentum.max())
    assert errors[0] < 0.01
    assert errors[1] < 0.7 * errors[0] or errors[1] < 1e-6


@pytest.mark.parametrize("scheme", chain.SCHEMES)
def test_a_collision_gives_no_more_energy_than_the_object_spends(scheme):
    scene, h = hit(3), 1e-3
    motion = chain.run(scene, Clock(duration=1.5, sample_interval=h, timestep=h), scheme=scheme)
    work = h * (motion.force @ (0.3 * np.asarray(scene.forward))).sum()
    energy = compute_energy(scene.antenna, motion)[-1]
    assert 0 < energy < 1.01 * work


@pytest.mark.parametrize("profile", ["exponential", "constant"])
def test_consistent_scheme_is_stable_at_the_largest_timestep(profile):
    """Half the contact's time constant, the fastest of the paper's touches, the stiffest damping."""
    trial = Trial(feature=make_feature("box", 1.5), location=0.5, speed=0.6)
    scene = make_scene(make_preset(profile), trial)
    coarse, fine = (chain.run(scene, Clock(duration=60, timestep=h), scheme="consistent").angle for h in (0.1, 0.0125))
    assert np.abs(coarse - fine).max() < 0.15 * np.abs(fine).max()


@pytest.mark.parametrize("lanes", [1, 8])
def test_a_step_allocates_nothing(lanes):
    _nrt_python.memsys_enable_stats()
    scene = touch()
    batch = Batch([scene] * lanes, [make_model(scene, 0.02)] * lanes, Clock(duration=1, timestep=0.02))
    batch._step(0, 200)
    assert batch.contacts[3].max() >= 0
    counts = []
    for n_steps in (1, 1000):
        before = rtsys.get_allocation_stats().alloc
        batch._step(200, n_steps)
        counts.append(rtsys.get_allocation_stats().alloc - before)
    assert counts[0] == counts[1]


def test_damping_only_takes_energy():
    antenna, rng = uniform(12, damping=1e-3), np.random.default_rng(7)
    scene = Scene(antenna=antenna, angle=rng.normal(0, 0.3, 12))
    energy = compute_energy(antenna, chain.run(scene, Clock(duration=4, sample_interval=0.05, timestep=1e-4)))
    assert np.all(np.diff(energy) < 1e-3 * energy[0])
    assert energy[-1] < 0.5 * energy[0]


def test_turning_the_base_turns_nothing_else():
    scene = Scene(antenna=make_preset("cockroach"), angle=np.random.default_rng(9).normal(0, 0.01, 140))
    clock = Clock(duration=5, timestep=0.02)
    level, turned = chain.run(scene, clock), chain.run(replace(scene, base_angle=1.234), clock)
    np.testing.assert_allclose(turned.angle, level.angle, atol=1e-13)


@pytest.mark.parametrize("kind", ["ball", "triangle"])
def test_mirrored_touch_is_the_mirror_image(kind):
    clock = Clock(duration=10, timestep=0.02)
    left, right = (chain.run(touch(kind, side=side), clock) for side in ("left", "right"))
    assert np.abs(left.angle).max() > 0.01
    np.testing.assert_allclose(right.angle, -left.angle, atol=1e-12)
    np.testing.assert_allclose(right.force * [-1, 1], left.force, atol=1e-12)


def test_nothing_moves_before_contact_and_the_object_pushes_forward():
    motion = chain.run(touch(lead=2.5), Clock(duration=6, timestep=0.02))
    assert np.abs(motion.angle[motion.time < 2.5]).max() < 1e-15
    assert np.all(motion.force[motion.time < 2.5] == 0)
    assert motion.force[4:, 0].mean() > 0


def test_frictionless_ball_pushes_through_its_centre():
    scene, h = touch(size=0.15, n=1, friction=0.0), 0.02
    motion = chain.run(scene, Clock(duration=4, sample_interval=h, timestep=h), scheme="consistent")
    pushed = np.flatnonzero(motion.force[:, 0] > 1e-7)
    assert pushed.size > 5
    for k in pushed:  # the force belongs to the state before the sample
        points = densify(scene.antenna.shape(motion.angle[k - 1]))
        away = points - (np.asarray(scene.origin) + (0.3 * h * (k - 1) - 0.15) * np.asarray(scene.forward))
        nearest = away[np.hypot(*away.T).argmin()]
        force = motion.force[k]
        turned = (nearest[0] * force[1] - nearest[1] * force[0]) / np.hypot(*nearest) / np.hypot(*force)
        assert abs(turned) < 2e-3  # the chain is sampled every 0.4 µm


def test_resting_on_a_wall_is_statics():
    """The last hinge's spring balances one force that acts on the last segment. Only the consistent scheme comes to
    rest: at this damping MuJoCo's keeps chattering, on the chain and in MuJoCo alike."""
    antenna = uniform(8, stiffness=np.linspace(2e-2, 1e-2, 8), damping=0.05)
    forward = np.array([np.cos(0.2), -np.sin(0.2)])
    path = Path(velocity=(tuple(0.05 * forward), (0.0, 0.0)), end=(6.0,))
    scene = Scene(antenna=antenna, feature=Wall(), origin=(-0.1, 2.6), forward=tuple(forward), path=path, friction=0.01)
    motion = chain.run(scene, Clock(duration=300, sample_interval=10, timestep=0.02), scheme="consistent")
    torque = -antenna.stiffness[-1] * motion.angle[-1, -1]
    force, points = motion.force[-1], antenna.shape(motion.angle[-1])
    assert np.hypot(*force) > 1e-5
    assert np.abs(motion.velocity[-1]).max() < 1e-6
    lever = -torque / np.hypot(*force)  # the last hinge's torque over the force: where along the segment it acts
    assert 0 < lever <= np.hypot(*(points[-1] - points[-2])) * 1.02 + 0.1 * 0.02


def test_softer_contact_sinks_deeper():
    deep, clock = [], Clock(duration=8, sample_interval=0.1, timestep=0.02)
    for softness in (0.1, 0.4):
        scene = replace(touch(), contact=Contact(solref=(softness, 1.0)))
        motion = chain.run(scene, clock, scheme="consistent")
        centre = np.asarray(scene.origin) + (0.3 * clock.time[:, None] - 1.0) * np.asarray(scene.forward)
        gap = [
            np.hypot(*(densify(scene.antenna.shape(q)) - c).T).min() for q, c in zip(motion.angle, centre, strict=True)
        ]
        deep.append(1.0 + scene.antenna.radius[0] - min(gap))
    assert 0 < 1.5 * deep[0] < deep[1] < 0.1


@pytest.mark.parametrize("scheme", chain.SCHEMES)
def test_lanes_have_the_bits_of_single_runs(scheme):
    scenes = [touch(kind, 1.0, speed=speed) for kind in ("ball", "box", "triangle") for speed in (0.6, 0.3, 0.06)]
    scenes += [touch(n=20), Scene(antenna=scenes[0].antenna, angle=np.full(30, 0.01)), scenes[0]]
    clock = Clock(duration=6, timestep=0.02)
    alone = [chain.run(scene, clock, scheme=scheme) for scene in scenes]
    for order in (range(len(scenes)), reversed(range(len(scenes)))):
        order = list(order)
        together = chain.run_batch([scenes[i] for i in order], clock, workers=2, scheme=scheme)
        for i, found in zip(order, together, strict=True):
            for name in ("angle", "velocity", "force"):
                assert getattr(found, name).tobytes() == getattr(alone[i], name).tobytes()


def test_a_diverging_trial_is_named_and_the_rest_survives():
    good = touch()
    bad = replace(good, velocity=np.full(30, 1e200), label="much too fast")
    clock = Clock(duration=3, timestep=0.02)
    first, second, third = chain.run_batch([good, bad, good], clock)
    assert isinstance(second, SimulationDiverged)
    assert "much too fast" in str(second)
    assert second.time == 1.0
    assert np.isfinite(second.angle).all()
    assert np.array_equal(first.angle, third.angle)
    with pytest.raises(SimulationDiverged, match="much too fast"):
        chain.run(bad, clock)


def test_samples_are_states_at_their_times():
    scene = touch()
    fine = chain.run(scene, Clock(duration=5, sample_interval=0.1, timestep=0.02))
    coarse = chain.run(scene, Clock(duration=5, sample_interval=1.0, timestep=0.02))
    assert np.array_equal(coarse.angle, fine.angle[::10])
    assert np.array_equal(coarse.angle[0], scene.initial_angle)


def test_a_leg_ends_at_its_step():
    scene = replace(touch(), path=Path(velocity=((0.3, 0.0), (0.0, 0.0)), end=(0.4,)))  # stops before it touches
    assert not np.any(chain.run(scene, Clock(duration=5, timestep=0.02)).force)


def test_bad_input_says_what_to_do():
    scene, clock = touch(), Clock(duration=2, timestep=0.02)
    with pytest.raises(InvalidInput, match=r"at most 0\.1 ms"):
        chain.run(scene, Clock(duration=2, timestep=0.2))
    with pytest.raises(InvalidInput, match="valid: parity, consistent"):
        chain.run(scene, clock, scheme="fast")
    with pytest.raises(InvalidInput, match="workers must be at least 1"):
        chain.run_batch([scene], clock, workers=0)
    assert chain.run_batch([], clock) == []


def test_invweight_is_the_dense_inverse():
    antenna = uniform(9)
    s, half = antenna.hinge_position, antenna.segment_length / 2
    jacobian = np.maximum(s[:, None] + half[:, None] - s[None, :], 0.0) * np.tri(9)
    dense = np.einsum("ij,jk,ik->i", jacobian, np.linalg.inv(compute_mass_matrix(antenna)), jacobian) / 3
    np.testing.assert_allclose(compute_invweight(antenna.segment_length, antenna.segment_mass), dense, rtol=1e-8)


def test_tip_force_and_gravity_find_their_balance():
    """For callers of the sweeps: k q = (F + m g / 2) ℓ cos q for one segment pulled along +x."""
    antenna, clock = uniform(1, stiffness=1e-3, damping=0.02), Clock(duration=900, sample_interval=100, timestep=0.02)
    scene = Scene(antenna=antenna)
    model = make_model(scene, clock.timestep)
    model.object[O_PULL_X], model.object[O_GRAVITY_X] = 1e-3, 500.0
    q = Batch([scene], [model], clock).run()[0].angle[-1, 0]
    assert q == pytest.approx((1e-3 + 1e-6 * 500.0 / 2) * 0.3 * np.cos(q) / 1e-3, rel=1e-9)


@pytest.mark.parametrize("n", [1, 2, 1000])
def test_any_number_of_segments(n):
    rng = np.random.default_rng(n)
    scene = Scene(antenna=uniform(n, stiffness=1.0, damping=1.0), angle=rng.normal(0, 0.01, n))
    motion = chain.run(scene, Clock(duration=3, timestep=0.02))
    assert np.abs(motion.angle[-1]).max() < np.abs(motion.angle[0]).max()
