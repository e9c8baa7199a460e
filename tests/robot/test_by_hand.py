"""The robot's electronics and their repair, written out: scikit-learn, SciPy and small cases by
hand.
"""

import numpy as np
import pytest
from scipy.stats import linregress
from sklearn.linear_model import LinearRegression
from sklearn.model_selection import LeaveOneGroupOut, cross_val_predict

from feeler.robot import Gap, make_robot
from feeler.robot.description import ROBOT_FACTS
from feeler.robot.recordings import Recording
from feeler.robot.sensors import fit_sensors
from feeler.robot.surrogate import (
    _add_mount,
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
