"""Laws and closed forms of touch, bend and release, as their users call them."""

from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_bvp

import feeler
from feeler import Antenna, Ball, Trial, Wall, presets
from feeler.errors import InvalidInput, SimulationDivergedError
from feeler.objects import BaseMotion
from feeler.physics.engine import ENGINES, choose_timestep
from feeler.physics.simulation import Simulation
from feeler.tensors import validate

ANTENNA = presets.cockroach()
TRIAL = Trial(feature=Ball(radius=1.53), location=0.5, speed=0.6)
SHORT = {"duration": 15.0, "timestep": 0.05}


def make_beam(n, length=40.0, bending=5.0, density=1e-4):
    """A uniform beam: the clamp's half segment makes hinge 1 twice as stiff."""
    k = np.full(n, bending * n / length)
    k[0] *= 2
    return Antenna(
        segment_length=np.full(n, length / n),
        segment_mass=density * length / n,
        radius=0.1,
        stiffness=k,
        damping=0.02
        * k,  # ζ = 0.5 % and 3 % in the first two modes; stills the lattice's own fast modes
    )


@pytest.mark.parametrize("engine", ["chain-consistent", "chain", "mujoco"])
def test_no_contact_gives_exact_zeros(engine):
    tensors = feeler.touch(
        ANTENNA,
        Trial(feature=Wall(), location=0.5, speed=0.1, lead=50.0),
        engine=engine,
        **SHORT,
    )
    assert not tensors["angle"].values.any()
    assert not tensors["force"].values.any()


def test_tensors_keep_the_contract():
    tensors = validate(feeler.touch(ANTENNA, [TRIAL], **SHORT))
    assert tensors["angle"].dims == ("trial", "sensor", "time")
    assert tensors["angle"].shape == (1, 56, 15)
    np.testing.assert_allclose(
        tensors["curvature"],
        tensors["angle"] / ANTENNA.segment_length[ANTENNA.sensors - 1][:, None],
    )
    assert (
        feeler.touch(ANTENNA, [TRIAL], all_hinges=True, **SHORT)["angle"].sizes["sensor"] == 140
    )


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"engine": "ode"}, "unknown engine 'ode'; valid: chain-consistent, chain, mujoco"),
        ({"timestep": 0.5}, "too large for the contact"),
        ({"timestep": 0.03}, "whole number of timesteps"),
        ({"duration": -1.0}, "duration must be finite and > 0"),
        ({"workers": 0}, "workers"),
        ({"seed": -1}, "seed"),
        ({"trials": []}, "at least one Trial"),
    ],
)
def test_bad_calls_are_named(options, message):
    with pytest.raises(InvalidInput, match=message):
        feeler.touch(**({"antenna": ANTENNA, "trials": [TRIAL]} | SHORT | options))


def test_a_diverging_trial_is_named_and_the_others_survive():
    """Without damping, hinges this stiff for their mass make any explicit spring unstable at this
    step.
    """
    wild = ANTENNA.replace(stiffness=ANTENNA.stiffness * 1e6, damping=0.0)
    trials = [
        Trial(feature=Ball(radius=1.0), location=0.5, speed=0.6, lead=lead)
        for lead in (5.0, 400.0)
    ]
    with pytest.raises(
        SimulationDivergedError, match=r"ball \(radius 1 mm\) at 0.5 L.* diverged at"
    ) as caught:
        feeler.touch(wild, trials, duration=60.0, timestep=0.05)
    assert caught.value.tensors.sizes["trial"] == 1
    with np.load(caught.value.state_file) as state:
        assert np.isfinite(state["angle"]).all()
    assert caught.value.state_file in str(caught.value)
    Path(caught.value.state_file).unlink()


def test_small_force_bends_a_uniform_chain_as_a_cantilever():
    beam, force = make_beam(120), 1e-6
    tip = feeler.bend(beam, force=[force])["tip"].values[0, 0]
    assert tip == pytest.approx(force * 40.0**3 / (3 * 5.0), rel=2e-3)


def test_large_force_follows_the_elastica():
    """Against the boundary value problem EI φ″ = −F cos φ, φ(0) = 0, φ′(L) = 0 of the continuous
    beam.
    """
    beam, force, bending, length = make_beam(200), 0.02, 5.0, 40.0
    s = np.linspace(0, length, 400)
    solution = solve_bvp(
        lambda s, y: np.array([y[1], -force / bending * np.cos(y[0])]),
        lambda a, b: np.array([a[0], b[1]]),
        s,
        np.array([s / length, np.full_like(s, 1 / length)]),
        tol=1e-8,
    )
    phi = solution.sol(s)[0]
    expected = np.trapezoid(np.sin(phi), s), np.trapezoid(np.cos(phi), s)
    found = feeler.bend(beam, force=[force])["tip"].values[0]
    assert expected[0] > 0.5 * length
    np.testing.assert_allclose(found, expected, rtol=5e-3)


@pytest.mark.parametrize("mode", [0, 1])
def test_free_release_rings_at_euler_bernoulli_frequencies(mode):
    """Released in the shape of one mode, a uniform beam swings at that mode's frequency."""
    from feeler.antenna import compute_modes

    beam, root = make_beam(100), (1.8751041, 4.6940911)[mode]
    expected = root**2 * np.sqrt(5.0 / (1e-4 * 40.0**4)) / (2 * np.pi)
    shape = compute_modes(beam, 2).angle[mode]
    released = feeler.release(
        beam,
        angle=1e-3 * shape / np.abs(shape).max(),
        duration=2.5 / expected,
        sample_interval=0.1,
        timestep=0.01,
    )
    x = released["tip"].values[0, :, 0]
    crossing = np.flatnonzero(np.diff(np.sign(x)))
    time = released["time"].values[crossing] + 0.1 * x[crossing] / (
        x[crossing] - x[crossing + 1]
    )
    assert 0.5 / np.mean(np.diff(time)) == pytest.approx(expected, rel=1e-2)


def test_published_constants_ring_at_17_to_18_hertz():
    released = feeler.release(ANTENNA, duration=60.0)
    x, time = released["tip"].values[0, :, 0], released["time"].values
    crossing = time[np.flatnonzero(np.diff(np.sign(x)))]
    assert 1e3 * 0.5 / (crossing[1] - crossing[0]) == pytest.approx(17.5, abs=0.6)


def test_release_starts_where_it_was_held():
    released = feeler.release(ANTENNA, at=10.0, deflection=1.0, duration=1.0)
    hinges = ANTENNA.shape(released["angle"].values[0, :, 0])
    arc = ANTENNA.hinge_position
    assert np.interp(10.0, arc, hinges[:-1, 0]) == pytest.approx(1.0, abs=1e-6)


def test_the_cylinder_of_a_hit_touches_at_time_0():
    """Its centre is then its radius, and the antenna's, away from the antenna's line."""
    radius, location = 1.7, 0.6
    antenna = feeler.presets.cockroach()
    found = feeler.hit(antenna, location=location, radius=radius, duration=6.0)
    touched = int(np.searchsorted(found["time"].values, 0.0))
    place = antenna.shape()
    gap = np.linalg.norm(place - found["object"].values[touched], axis=1).min()
    thick = antenna.radius[round(location * antenna.n_segments) - 1]
    # as near as the next hinge, and as a sample's way of the cylinder
    np.testing.assert_allclose(gap, radius + thick, atol=antenna.segment_length.max())
    assert np.abs(found["force"].values[: touched - 1]).max() == 0.0


TRIAL_ENGINES = Trial(feature=Ball(radius=1.5), location=0.5, speed=0.3)


@pytest.mark.further
@pytest.mark.parametrize("engine", list(ENGINES))
def test_touch_runs_with_the_default_timestep_of_each_engine(engine):
    tensors = feeler.touch(ANTENNA, TRIAL_ENGINES, engine=engine, duration=30.0)
    assert tensors.attrs["timestep"] == choose_timestep(None, engine)
    assert 0.01 < float(abs(tensors["angle"]).max()) < 0.06


@pytest.mark.parametrize("engine", ["rod", "rod-inertia"])
def test_an_engine_that_went_is_refused_with_those_that_there_are(engine):
    with pytest.raises(
        InvalidInput, match=f"unknown engine '{engine}'; valid: chain-consistent"
    ):
        feeler.touch(ANTENNA, TRIAL_ENGINES, engine=engine, duration=5.0)


@pytest.mark.parametrize("engine", list(ENGINES))
def test_a_recorded_base_begins_where_its_path_does(engine):
    time = np.arange(5.0)
    pose = np.column_stack([0.01 * time + 1.0, 0.0 * time + 2.0, 0.0 * time + 0.3])
    simulation = Simulation(ANTENNA, base=BaseMotion(time=time, pose=pose), engine=engine)
    np.testing.assert_allclose(simulation.base, [1.0, 2.0, 0.3], atol=1e-9)
    np.testing.assert_allclose(simulation.shape()[0], [1.0, 2.0], atol=1e-9)
