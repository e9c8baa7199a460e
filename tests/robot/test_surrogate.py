"""The surrogate robot: its faults do what they say, it is labelled everywhere, and no gap means no
difference.
"""

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import linregress
from sklearn.linear_model import LinearRegression
from sklearn.model_selection import LeaveOneGroupOut, cross_val_predict

from feeler.errors import InvalidInput
from feeler.robot import Gap, make_dataset, make_robot, make_surrogate, simulate_touches
from feeler.robot.description import ROBOT_FACTS, make_touches
from feeler.robot.recordings import load_recording, save_recording
from feeler.robot.sensors import fit_sensors
from feeler.robot.surrogate import (
    _add_mount,
    _draw_sensing,
    _Sensing,
    draw_antenna,
    draw_trial,
    make_tip_touches,
    play,
    subtract_rest,
)

FAST = [trial for trial in make_tip_touches() if trial.speed == 0.27]


def test_the_grid_is_the_papers():
    trials = make_touches()
    assert len(trials) == 30
    assert {trial.speed for trial in trials} == {0.270, 0.135, 0.027}
    assert {trial.feature.kind for trial in trials} == {"ball", "box"}
    assert len({trial.location for trial in trials}) == 5
    assert len(make_tip_touches(3)) == 18
    assert {trial.location for trial in make_tip_touches()} == {
        max(trial.location for trial in trials)
    }


def test_without_a_gap_the_surrogate_is_the_model():
    surrogate = make_surrogate(np.random.default_rng(0), gap=Gap().scaled(0))
    simulated = simulate_touches(make_robot(), FAST)
    for recording, motion in zip(surrogate.touch(FAST), simulated, strict=True):
        np.testing.assert_allclose(surrogate.read_angles(recording).values, motion, atol=1e-9)


def test_everything_it_makes_is_labelled(tmp_path):
    surrogate = make_surrogate(np.random.default_rng(0), name="S1")
    raw = surrogate.touch(FAST)[0]
    assert (raw.source, raw.quantity, raw.robot) == ("surrogate", "capacitance", "S1")
    assert raw.labels == {"feature": "ball", "size": 4.0, "location": 0.9, "speed": 0.27}
    save_recording(raw, tmp_path / "r.csv")
    again = load_recording(tmp_path / "r.csv")
    assert (again.source, again.labels) == ("surrogate", raw.labels)
    angles = surrogate.read_angles(again)
    assert angles.source == "surrogate" and angles.history[0] == "read from r.csv"
    assert make_dataset([angles])["source"].values.tolist() == ["surrogate"]


def test_same_seed_same_robot_same_recording():
    first, second = (
        make_surrogate(np.random.default_rng(7)).touch(FAST[:1])[0] for _ in range(2)
    )
    np.testing.assert_array_equal(first.values, second.values)
    np.testing.assert_array_equal(first.time, second.time)


def test_recordings_have_jitter_and_lost_samples():
    raw = make_surrogate(np.random.default_rng(1), gap=Gap(dropped=0.1)).touch(FAST[:1])[0]
    step = np.diff(raw.time)
    assert np.all(step > 0) and 0.05 < np.mean(step > 1.5) < 0.2
    assert 0.03 < step[step < 1.5].std() < 0.15


def test_its_own_calibration_reads_within_the_papers_resolution():
    surrogate = make_surrogate(np.random.default_rng(2))
    assert np.all(np.rad2deg(surrogate.calibration.resolution) < 1)
    assert np.all(surrogate.calibration.r_squared > 0.99)
    assert surrogate.calibration.robot == surrogate.name


def test_a_location_is_counted_from_hinge_1_also_on_a_compliant_mount():
    surrogate = make_surrogate(
        np.random.default_rng(3), gap=Gap(**{**vars(Gap().scaled(0)), "play": 0.1})
    )
    for location in (0.1, 0.5, 1.0):
        _, trial = surrogate.carry_out([replace(FAST[0], location=location)])[0]
        free = surrogate.antenna.segment_length[1:].sum()
        assert trial.location * surrogate.antenna.length == pytest.approx(
            surrogate.mount + location * free
        )


def test_play_operator_laws():
    rng = np.random.default_rng(4)
    signal = rng.normal(size=(3, 500)).cumsum(axis=1)
    np.testing.assert_array_equal(play(signal, 0.0), signal)
    moved = play(signal, 0.7)
    assert np.all(np.abs(moved - signal) <= 0.7 + 1e-12)
    up = np.arange(10.0)[None]
    np.testing.assert_allclose(
        play(up, 2.0)[0, 3:], up[0, 3:] - 2.0
    )  # lags by the half-width, on the way up
    wiggle = np.array([[5.0, 4.5, 5.2, 4.9]])
    np.testing.assert_array_equal(
        play(wiggle, 1.0), np.full((1, 4), 5.0)
    )  # moves inside the gap are not seen


def test_draws_have_the_stated_spread():
    rng, robot, gap = np.random.default_rng(8), make_robot(), Gap()
    drawn = [draw_antenna(robot, gap, rng) for _ in range(400)]
    common = np.log([a.stiffness.mean() / robot.stiffness.mean() for a in drawn])
    assert common.std() == pytest.approx(
        np.hypot(gap.stiffness, gap.stiffness_each / np.sqrt(8)), rel=0.15
    )
    assert np.std([a.rest_angle for a in drawn]) == pytest.approx(gap.rest_angle, rel=0.1)
    trials = [draw_trial(FAST[0], gap, rng) for _ in range(400)]
    assert np.std([t.location for t in trials]) == pytest.approx(gap.location, rel=0.15)
    assert np.std([t.speed for t in trials]) == pytest.approx(gap.speed * 0.27, rel=0.15)


def test_resting_level_is_subtracted_and_said():
    surrogate = make_surrogate(np.random.default_rng(9), gap=Gap(rest_angle=0.05))
    angles = surrogate.read_angles(surrogate.touch(FAST[:1])[0])
    np.testing.assert_allclose(angles.values[:, :15].mean(axis=1), 0, atol=1e-12)
    assert "mean of the first 15 ms subtracted" in angles.history[-1]
    with pytest.raises(InvalidInput, match="no resting level"):
        subtract_rest(angles, before=-1.0)


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
    assert np.isnan(fit_sensors(hinge, angle, capacitance).drift).all()
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


def test_readings_are_whole_numbers_of_quanta_and_gaps_that_cannot_be_are_refused():
    """A quantum is told as an angle; it is the same step of capacitance in every sensor."""
    angle, step = np.linspace(-0.1, 0.1, 300).reshape(3, 100), 0.03 * 1.2
    exact, found = (
        make_sensing(make_gap(quantum=q)).read(angle, np.random.default_rng(6))
        for q in (0, 0.03)
    )
    assert 0.4 * step < np.abs(found - exact).max() <= step / 2 + 1e-12
    np.testing.assert_allclose(found / step, np.round(found / step), atol=1e-9)
    for make, message in (
        (lambda: Gap(noise=-1), "Gap.noise must be ≥ 0"),
        (lambda: Gap(dropped=0.6), "Gap.dropped must be .*< 0.5"),
        (lambda: NONE.scaled(float("nan")), "size of a gap"),
    ):
        with pytest.raises(InvalidInput, match=message):
            make()


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


@pytest.mark.parametrize(
    ("gap", "check"),
    [
        (Gap().scaled(0), lambda seen: np.allclose(seen[1], 0) and np.allclose(seen[0], 0.1)),
        (
            Gap(**{**vars(Gap().scaled(0)), "crosstalk": 0.05}),
            lambda seen: np.allclose(seen[1], 0.005),
        ),
        (
            Gap(**{**vars(Gap().scaled(0)), "bend": 0.35}),
            lambda seen: np.allclose(seen[0], 0.11),
        ),
        (
            Gap(**{**vars(Gap().scaled(0)), "noise": 0.01}),
            lambda seen: 0.009 < seen[1].std() < 0.011,
        ),
        (
            Gap(**{**vars(Gap().scaled(0)), "quantum": 0.03}),
            lambda seen: np.unique(seen[0]).size == 1,
        ),
        (
            Gap(**{**vars(Gap().scaled(0)), "drift": 0.02}),
            lambda seen: 0.002 < seen[1].std() < 0.06,
        ),
    ],
)
def test_each_fault_of_the_sensing_by_itself(gap, check):
    sensing = _draw_sensing(gap, 3, np.random.default_rng(5))
    angle = np.zeros((3, 1000))
    angle[0] = 0.1
    read = sensing.read(angle, np.random.default_rng(6))
    assert check((read - sensing.base[:, None]) / sensing.sensitivity[:, None])
