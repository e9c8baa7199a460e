"""Fit of p1 and p2: planted factors come back; what does not ring is refused."""

import numpy as np
import pytest

from feeler.antenna import compute_modes
from feeler.errors import InvalidInput, ModelValidityWarning
from feeler.robot import (
    Recording,
    compare_tips,
    fit_factors,
    make_flexures,
    make_posture,
    make_robot,
    simulate_release,
)
from feeler.robot.fit import _measure_ringing

TIME = np.arange(2000.0)


def _cosine(frequency, zeta, offset=0.0):
    omega = 2 * np.pi * frequency
    decay = zeta * omega / np.sqrt(1 - zeta**2)
    return np.exp(-decay * TIME) * np.cos(omega * TIME) + offset


@pytest.mark.parametrize(
    ("frequency", "zeta"), [(0.0044, 0.024), (0.010, 0.1), (0.003, 0.25), (0.02, 0.37)]
)
def test_a_damped_cosine_is_measured_exactly(frequency, zeta):
    ringing = _measure_ringing(TIME, 12 * _cosine(frequency, zeta, offset=0.3))
    assert ringing.frequency == pytest.approx(frequency, rel=1e-4)
    assert ringing.damping_ratio == pytest.approx(zeta, rel=1e-3)
    assert ringing.r_squared > 0.9999


def test_r_squared_is_the_share_of_the_variance_that_is_not_noise():
    noisy = _cosine(0.005, 0.05) + np.random.default_rng(0).normal(0, 0.05, TIME.size)
    ringing = _measure_ringing(TIME, noisy)
    assert 1 - ringing.r_squared == pytest.approx(
        0.05**2 / noisy[50:].var(), rel=0.1
    )  # from the first crossing on


@pytest.mark.parametrize("sensed", [(1, 2, 4, 7), (2, 5)])
def test_factors_come_back_from_the_hinges_that_have_a_sensor(sensed):
    """A release under a force on the tip; channels that are there but empty are the same."""
    truth = make_robot(stiffness_factor=0.8, damping_factor=5.0)
    values = simulate_release(truth, make_posture(truth), 1500)
    theory = make_robot(stiffness_factor=1.0, damping_factor=1.0)
    few, rows = theory.replace(sensors=np.array(sensed)), np.array(sensed) - 1
    time = np.arange(values.shape[1], dtype=float)
    empty = np.full_like(values, np.nan)
    empty[rows] = values[rows]
    for felt, model in ((values[rows], few), (empty, theory)):
        fit = fit_factors(Recording(time=time, values=felt), theory=model)
        assert fit.stiffness_factor == pytest.approx(0.8, rel=0.01)
        assert fit.damping_factor == pytest.approx(5.0, rel=0.02)
    assert np.ptp(compare_tips(Recording(time=time, values=felt), fit.antenna)[0]) > 10


@pytest.mark.parametrize(
    ("tip", "message"),
    [
        (np.exp(-TIME / 100), "crosses rest"),
        (np.zeros(TIME.size), "is constant at 0"),
        (_cosine(0.0004, 0.02), "two cycles"),
        (np.where(TIME == 5, np.nan, TIME), "1 missing samples|is finite|must be"),
    ],
)
def test_what_does_not_ring_is_refused(tip, message):
    with pytest.raises(InvalidInput, match=message):
        _measure_ringing(TIME, tip)


def test_four_crossings_of_rest_are_two_cycles():
    ringing = _measure_ringing(TIME, _cosine(0.001, 0.1))
    assert (ringing.frequency, ringing.damping_ratio) == pytest.approx((0.001, 0.1), rel=1e-3)
    with pytest.raises(InvalidInput, match="crosses rest 3 times; at least 4"):
        _measure_ringing(TIME[:1600], _cosine(0.001, 0.1)[:1600])
    with pytest.raises(InvalidInput, match="not evenly sampled"):
        _measure_ringing(TIME**1.1, _cosine(0.005, 0.05))


@pytest.mark.parametrize("planted", [(0.7, 5.0)])
def test_planted_factors_come_back(planted):
    robot = make_robot(stiffness_factor=planted[0], damping_factor=planted[1])
    motion = simulate_release(robot, make_posture(robot), 1500.0)
    fit = fit_factors(Recording(time=np.arange(motion.shape[1]) * 1.0, values=motion))
    assert fit.stiffness_factor == pytest.approx(planted[0], rel=1e-3)
    assert fit.damping_factor == pytest.approx(planted[1], rel=1e-3)
    assert fit.error < 9e-4  # the paper's minimum error
    assert fit.target.frequency == pytest.approx(compute_modes(robot, 1).frequency[0], rel=0.01)


def test_tips_of_a_release_and_of_the_antenna_that_made_it_are_one():
    robot = make_robot()
    motion = simulate_release(robot, make_posture(robot), 1500.0)
    moved = Recording(
        time=100.0 + np.arange(motion.shape[1]), values=motion + 0.01
    )  # begun late, off zero
    recorded, model = compare_tips(moved, robot)
    assert recorded[0] == pytest.approx(15.0, abs=1.0)  # make_posture's deflection [mm]
    assert (
        np.abs(recorded - model).max() < 0.02 * 15.0
    )  # but for what still rings where rest is taken


@pytest.mark.parametrize("sensed", [tuple(range(1, 9)), (1, 2, 4, 7)])
def test_a_hinge_of_the_opposite_sign_and_hinges_in_reversed_order_are_refused(sensed):
    truth = make_robot(stiffness_factor=0.8, damping_factor=5.0)
    motion = simulate_release(truth, make_posture(truth), 1500)
    values = motion + np.random.default_rng(0).normal(0, 0.002, motion.shape)
    theory = make_robot(stiffness_factor=1.0, damping_factor=1.0).replace(
        sensors=np.array(sensed)
    )

    def fit(channels):
        time = np.arange(values.shape[1], dtype=float)
        return fit_factors(Recording(time=time, values=channels), theory=theory)

    right = values[np.array(sensed) - 1]
    both = fit(right), fit(-right)  # all with the opposite sign: the mirror image
    assert [one.damping_factor for one in both] == pytest.approx([5.0, 5.0], rel=0.03)
    for hinge in sensed[:3]:
        sign = np.where(np.array(sensed) == hinge, -1.0, 1.0)[:, None]
        with pytest.raises(InvalidInput, match=f"^hinge {hinge} bends against the others"):
            fit(sign * right)
    with pytest.raises(InvalidInput, match="in reversed order"):
        fit(right[::-1])


def test_two_releases_and_times_in_another_unit_are_said():
    motion = simulate_release(make_robot(), make_posture(make_robot()), 1000)
    twice = np.concatenate([motion, motion], axis=1)
    time = np.arange(twice.shape[1], dtype=float)
    with pytest.warns(ModelValidityWarning, match="or a second release"):
        fit_factors(Recording(time=time, values=twice))
    with pytest.warns(ModelValidityWarning, match="are times and sizes right"):
        fit_factors(Recording(time=1e3 * time[: motion.shape[1]], values=motion))


def test_noise_alone_is_said_to_be_no_ringing():
    noise = np.random.default_rng(2).normal(0, 0.02, (8, 1500))
    with pytest.warns(ModelValidityWarning, match="cosine explains little"):
        fit_factors(Recording(time=np.arange(1500.0), values=noise))


@pytest.mark.parametrize(
    ("posture", "duration", "message"),
    [
        (np.zeros(7), 10.0, "one angle per hinge: 8, got"),
        (np.zeros(8), -1.0, "duration must be > 0, got -1"),
    ],
)
def test_what_cannot_be_released_is_refused(posture, duration, message):
    with pytest.raises(InvalidInput, match=message):
        simulate_release(make_robot(), posture, duration)


def test_a_hinge_without_stiffness_does_not_turn_in_a_held_posture():
    robot = make_robot()
    posture = make_posture(
        robot.replace(stiffness=np.where(np.arange(8) == 0, 0.0, robot.stiffness))
    )
    assert posture[0] == 0.0 and np.all(posture[1:] > 0)


def test_posture_is_the_linear_static_deflection():
    robot = make_robot().replace(damping=np.geomspace(0.01, 1.0, 8))  # which has no part in it
    posture = make_posture(robot, 0.1)
    np.testing.assert_allclose(
        make_posture(robot), 150 * posture
    )  # 15 mm unless another deflection is given
    assert robot.shape(posture)[-1, 0] == pytest.approx(0.1, rel=1e-4)
    arm = robot.length - robot.hinge_position
    force = robot.stiffness * posture / arm  # the same tip force explains every hinge
    np.testing.assert_allclose(force, force[0])


@pytest.mark.parametrize(
    ("recording", "message"),
    [
        (
            Recording(time=TIME, values=np.ones((8, 2000)), quantity="capacitance"),
            "needs hinge angles",
        ),
        (Recording(time=TIME, values=np.ones((7, 2000))), "7 channels, the model 8 hinges"),
        (Recording(time=TIME, values=np.zeros((8, 2000))), "no deflection worth measuring"),
    ],
)
def test_unsuitable_recordings(recording, message):
    with pytest.raises(InvalidInput, match=message):
        fit_factors(recording)


def test_stiffness_of_flexures_is_that_of_their_formula():
    """E w t³ / (12 ℓ) of each, times the two factors of the robot."""
    width = np.arange(12.0, 4.0, -1.0)
    flexures = make_flexures(width=width, thickness=0.07, length=0.6, modulus=2100.0)
    expected = 2100 * width * 0.07**3 / (12 * 0.6)
    np.testing.assert_allclose(flexures.stiffness, expected, rtol=1e-12)
    robot = make_robot(stiffness_factor=1.19, damping_factor=2.06)
    np.testing.assert_allclose(robot.stiffness, 1.19 * make_flexures().stiffness)
    np.testing.assert_allclose(robot.damping, 2.06 * make_flexures().stiffness)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: make_flexures(thickness=0.0), "Flexures.thickness must be finite and > 0 mm"),
        (
            lambda: make_flexures(width=[1.0, -1.0]),
            "width must be .* > 0 mm, got -1.0 in hinge 2",
        ),
        (lambda: make_flexures(width=[1.0, 2.0], length=[1.0, 2.0, 3.0]), "all of one length"),
        (lambda: make_flexures(depth=1.0), "Flexures has no 'depth'; valid: width"),
        (lambda: make_robot(stiffness_factor=-1.0), "stiffness_factor must be > 0, got -1"),
        (lambda: make_robot(mass=float("nan")), "mass must be finite and > 0, got nan"),
    ],
)
def test_bad_input(make, message):
    with pytest.raises(InvalidInput, match=message):
        make()
