"""The robot's electronics and their repair, written out: scikit-learn, SciPy and small cases by
hand.
"""

import re

import numpy as np
import pytest
from scipy.stats import linregress, norm
from sklearn.linear_model import LinearRegression
from sklearn.model_selection import LeaveOneGroupOut, cross_val_predict

from feeler.errors import InvalidInput
from feeler.robot import Gap, draw_robots, make_robot, make_touches
from feeler.robot.description import ROBOT_FACTS
from feeler.robot.recordings import Recording
from feeler.robot.repair import _find_bad_channels, repair
from feeler.robot.sensors import fit_sensors
from feeler.robot.surrogate import (
    _add_mount,
    _draw_antenna,
    _draw_sensing,
    _draw_trial,
    _Sensing,
    subtract_rest,
)

NONE = Gap().scaled(0)


def make_gap(**sizes):
    return Gap(**{**vars(NONE), **sizes})


def make_sensing(gap, gain=(1.1, 0.9, 1.0)):
    return _Sensing(
        base=np.array([5.0, 4.0, 6.0]),
        sensitivity=np.array([1.2, 1.0, 1.5]),
        gain=np.array(gain),
        gap=gap,
    )


@pytest.fixture
def readings():
    rng = np.random.default_rng(3)
    hinge = np.repeat([1, 2], 15)
    level = np.tile(np.repeat(np.radians([-20.0, -5.0, 0.0, 10.0, 25.0]), 3), 2)
    return (
        hinge,
        level,
        5 + 3 * level * hinge + 0.1 * rng.standard_normal(30),
        rng.permutation(30) * 7e3,
    )


def test_one_reality_gap_is_as_large_as_it_was_declared():
    """Before the first surrogate was judged [C]; another size would change how often a robot is
    classified correctly.
    """
    shares = {
        "stiffness": 0.1,
        "stiffness_each": 0.08,
        "damping": 0.25,
        "mass": 0.08,
        "length": 0.01,
        "play": 0.1,
    }
    touch = {
        "location": 0.01,
        "speed": 0.02,
        "size": 0.03,
        "approach": 2.0,
        "friction": 0.3,
    }  # degrees; logarithm
    angles = {
        "rest_angle": 0.015,
        "noise": 0.004,
        "quantum": 0.002,
        "drift": 0.01,
        "hysteresis": 0.006,
    }  # rad
    signal = {
        "gain": 0.03,
        "crosstalk": 0.02,
        "bend": 0.03,
        "jitter": 0.05,
        "dropped": 0.01,
    }  # jitter in ms
    assert vars(Gap()) == shares | touch | angles | signal


def test_what_is_refused_or_mended_is_told_with_its_numbers():
    time = 2.0 * np.arange(60)
    values = np.random.default_rng(0).normal(0, 0.1, (3, 60))
    assert (
        repair(Recording(time=time, values=values))
        .history[-1]
        .startswith("recorded every 2 ms (jitter sd 0 ms), none")
    )
    values[1] = 0.125
    assert _find_bad_channels(Recording(time=time, values=values)) == {2: "dead (always 0.125)"}
    fit = fit_sensors(
        np.ones(3, int), np.array([0.0, 0.1, 0.2]), np.array([4.0, 5.0, 6.0]), unit="pF"
    )
    with pytest.raises(
        InvalidInput, match=r"3\.25 to 7\.5 pF, calibrated 4 to 6\. Calibrate a wider range"
    ):
        fit.apply(np.array([[3.25, 5.0, 7.5]]))
    names = [robot.name for robot in draw_robots(0.5, 2, seed=0)]
    assert names == ["surrogate-0.5-0", "surrogate-0.5-1"]


def test_an_antenna_is_drawn_share_by_share():
    """Log-normal shares: stiffness together and each, damping together, each mass, each length;
    then rest angles.
    """
    robot, gap, rng = make_robot(), Gap(), np.random.default_rng(5)
    drawn = _draw_antenna(robot, gap, np.random.default_rng(5))
    together, each = rng.standard_normal(), rng.standard_normal(8)
    np.testing.assert_allclose(
        drawn.stiffness, robot.stiffness * np.exp(0.1 * together + 0.08 * each)
    )
    np.testing.assert_allclose(
        drawn.damping, robot.damping * np.exp(0.25 * rng.standard_normal())
    )
    np.testing.assert_allclose(
        drawn.segment_mass, robot.segment_mass * np.exp(0.08 * rng.standard_normal(8))
    )
    np.testing.assert_allclose(
        drawn.segment_length, robot.segment_length * np.exp(0.01 * rng.standard_normal(8))
    )
    np.testing.assert_allclose(
        drawn.rest_angle, robot.rest_angle + 0.015 * rng.standard_normal(8)
    )


def test_a_touch_is_drawn_number_by_number():
    """Log-normal size, speed and friction; normal place and direction, kept within what can be
    touched.
    """
    trial, rng = make_touches(locations=(0.7,))[0], np.random.default_rng(6)
    drawn = _draw_trial(trial, Gap(), np.random.default_rng(6))
    location, size, approach, friction, speed = norm.ppf(rng.random(5))
    assert drawn.location == pytest.approx(0.7 + 0.01 * location)
    assert drawn.feature.size == pytest.approx(trial.feature.size * np.exp(0.03 * size))
    assert drawn.approach == pytest.approx(90 + 2.0 * approach)
    assert drawn.friction == pytest.approx(trial.friction * np.exp(0.3 * friction))
    assert drawn.speed == pytest.approx(trial.speed * np.exp(0.02 * speed))
    wild = [_draw_trial(trial, make_gap(location=9.0, approach=900.0), rng) for _ in range(40)]
    ends = [
        (min(values), max(values))
        for values in zip(*((one.location, one.approach) for one in wild), strict=True)
    ]
    assert ends == [(0.05, 1.0), (30.0, 150.0)]


def test_a_calibration_is_that_of_the_libraries(readings):
    hinge, angle, capacitance, time = readings
    fit = fit_sensors(hinge, angle, capacitance, time=time, robot="A")
    for k in (0, 1):
        a, c, t = (values[hinge == k + 1] for values in (angle, capacitance, time))
        line = linregress(c, a)
        residual = a - line.slope * c - line.intercept
        left = cross_val_predict(
            LinearRegression(), c[:, None], a, groups=a, cv=LeaveOneGroupOut()
        )
        pooled = np.sqrt(np.mean([c[a == level].var(ddof=1) for level in np.unique(a)]))
        assert fit.slope[k] == pytest.approx(line.slope) and fit.offset[k] == pytest.approx(
            line.intercept
        )
        assert fit.r_squared[k] == pytest.approx(line.rvalue**2)
        assert fit.residual[k] == pytest.approx(np.sqrt(np.mean(residual**2)))
        assert fit.cross_validated[k] == pytest.approx(np.sqrt(np.mean((a - left) ** 2)))
        assert fit.resolution[k] == pytest.approx(abs(line.slope) * pooled)
        assert fit.drift[k] == pytest.approx(linregress(t, residual).slope)
        assert (fit.low[k], fit.high[k]) == (c.min(), c.max())


def test_the_report_prints_degrees_and_degrees_a_minute(readings):
    hinge, angle, capacitance, time = readings
    fit = fit_sensors(hinge, angle, capacitance, time=time)
    head, *rows = fit.report().splitlines()
    assert re.split(r"\s{2,}", head) == [
        "hinge",
        "°/pF",
        "R²",
        "residual °",
        "cross-validated °",
        "resolution °",
        "drift °/min",
    ]
    for k, row in enumerate(rows):
        number, slope, r2, residual, crossed, resolution, drift = map(float, row.split())
        assert (number, r2) == (k + 1, pytest.approx(fit.r_squared[k], abs=6e-5))
        assert slope == pytest.approx(180 / np.pi * fit.slope[k], rel=6e-3)
        shown = (residual, crossed, resolution)
        own = (fit.residual[k], fit.cross_validated[k], fit.resolution[k])
        assert shown == pytest.approx([180 / np.pi * value for value in own], abs=6e-4)
        assert drift == pytest.approx(180 / np.pi * fit.drift[k] * 60_000, rel=6e-3)


@pytest.mark.parametrize("on_bench", [False, True])
def test_faults_act_in_their_order(on_bench):
    """Hysteresis, neighbours, the bent characteristic, then the gain that a bench lacks."""
    gap = make_gap(hysteresis=0.01, crosstalk=0.05, bend=0.2)
    angle = np.array([[0.0, 0.1, 0.3, 0.2], [0.0, 0.0, -0.1, 0.1], [0.2, 0.1, 0.1, 0.1]])
    felt = np.array([[0.0, 0.09, 0.29, 0.21], [0.0, 0.0, -0.09, 0.09], [0.2, 0.11, 0.11, 0.11]])
    mixed = felt + 0.05 * np.array([felt[1], felt[0] + felt[2], felt[1]])
    bent = mixed * (1 + 0.2 * mixed / 0.35)
    sensing = make_sensing(gap)
    seen = bent if on_bench else bent * sensing.gain[:, None]
    found = sensing.read(angle, np.random.default_rng(0), on_bench=on_bench)
    np.testing.assert_allclose(
        found, sensing.base[:, None] + sensing.sensitivity[:, None] * seen, rtol=1e-12
    )


def test_wander_grows_as_a_random_walk_to_its_size_after_one_second_and_noise_is_white():
    walk = make_gap(drift=0.02)
    sensing = _Sensing(
        base=np.zeros(400), sensitivity=np.ones(400), gain=np.ones(400), gap=walk
    )
    found = sensing.read(np.zeros((400, 1000)), np.random.default_rng(1))
    assert found[:, -1].std() == pytest.approx(0.02, rel=0.12)
    assert found[:, 249].std() == pytest.approx(0.01, rel=0.12)
    assert not sensing.read(np.zeros((400, 9)), np.random.default_rng(1), on_bench=True).any()
    noisy = _Sensing(
        base=np.zeros(1), sensitivity=np.full(1, 2.0), gain=np.ones(1), gap=make_gap(noise=0.01)
    )
    white = noisy.read(np.zeros((1, 20_000)), np.random.default_rng(2))[0]
    assert white.std() == pytest.approx(0.02, rel=0.03)
    assert abs(np.corrcoef(white[1:], white[:-1])[0, 1]) < 0.03


def test_a_converter_rounds_to_its_step_of_the_usual_sensitivity():
    found = make_sensing(make_gap(quantum=0.05), gain=np.ones(3)).read(
        np.full((3, 1), 0.13), np.random.default_rng(0)
    )
    np.testing.assert_allclose(
        found[:, 0], 0.06 * np.round(np.array([5 + 0.156, 4.13, 6 + 0.195]) / 0.06), rtol=1e-12
    )


def test_a_bench_bends_one_hinge_at_a_time_up_and_down():
    table = make_sensing(make_gap(crosstalk=0.5)).bench(np.random.default_rng(0))
    assert table["hinge"].tolist() == [1] * 204 + [2] * 204 + [3] * 204
    level = np.radians(np.linspace(-40, 40, 17))
    np.testing.assert_allclose(table["angle"], np.tile([*level, *level[::-1]], 18))
    k = table["hinge"] - 1
    np.testing.assert_allclose(
        table["capacitance"],
        np.array([5.0, 4, 6])[k] + np.array([1.2, 1, 1.5])[k] * table["angle"],
    )
    np.testing.assert_allclose(np.diff(table["time"]), 500.0)


def test_channels_are_drawn_with_their_stated_spread():
    drawn = _draw_sensing(make_gap(gain=0.03), 4000, np.random.default_rng(0))
    for values, middle, spread in (
        (drawn.base, 5.0, 0.15),
        (drawn.sensitivity, 1.2, 0.15),
        (drawn.gain, 1.0, 0.03),
    ):
        assert np.log(values).mean() == pytest.approx(
            np.log(middle), abs=4 * spread / np.sqrt(4000)
        )
        assert np.log(values).std() == pytest.approx(spread, rel=0.05)


def test_the_resting_level_is_the_mean_of_what_was_before():
    values = np.array([[1.0, 3.0, 9.0, 9.0], [np.nan, 2.0, 5.0, 5.0]])
    found = subtract_rest(Recording(time=np.array([0.0, 1.0, 2.0, 3.0]), values=values), 2.0)
    np.testing.assert_allclose(found.values, [[-1.0, 1.0, 7.0, 7.0], [np.nan, 0.0, 3.0, 3.0]])
    assert found.history[-1] == "mean of the first 2 ms subtracted"


@pytest.mark.parametrize("play", [0.2, 3.0])
def test_a_mount_is_as_compliant_as_its_share_of_the_first_hinge_with_the_same_damping_time(
    play,
):
    robot = make_robot()
    found = _add_mount(robot, make_gap(play=play))
    assert 1 / found.stiffness[0] == pytest.approx(play / robot.stiffness[0])
    assert found.damping[0] / found.stiffness[0] == pytest.approx(
        robot.damping[0] / robot.stiffness[0]
    )
    assert found.segment_mass.sum() == pytest.approx(ROBOT_FACTS["mass"].number)
    for name in (
        "segment_length",
        "segment_mass",
        "radius",
        "stiffness",
        "damping",
        "rest_angle",
    ):
        np.testing.assert_array_equal(getattr(found, name)[1:], getattr(robot, name))
    np.testing.assert_array_equal(found.sensors, robot.sensors + 1)


def record(time, **fields):
    time = np.asarray(time, dtype=float)
    return Recording(time=time, values=np.stack([np.sin(time / 9), np.cos(time / 9)]), **fields)


def test_what_is_said_of_time_is_what_was_recorded():
    """0.9 and 1.1 ms in turn; three samples lost in two places."""
    time = np.cumsum([0.0] + [0.9, 1.1] * 30 + [3.0] + [0.9, 1.1] * 30 + [2.0] + [0.9, 1.1])
    said = repair(record(time)).history[-1]
    jitter = np.std([0.9, 1.1] * 61)
    assert said.startswith("recorded every ") and f"(jitter sd {jitter:.2g} ms)" in said
    assert "3 samples dropped" in said
    assert (
        repair(record(np.arange(50) * 1.01))
        .history[-1]
        .endswith("none dropped; time base evened")
    )
    assert (
        repair(record(np.arange(50) * 1.1))
        .history[-1]
        .endswith("none dropped; resampled to 1 ms")
    )
