"""Transfer to surrogate robots: perfect without a gap, worse with one; nothing leaks from test to
training.
"""

import numpy as np
import pytest

from feeler.analysis import compute_dispersion
from feeler.decoding import Relative, compute_sweep
from feeler.decoding.transfer import TransferClassifier
from feeler.errors import InvalidInput
from feeler.robot import (
    Gap,
    Recording,
    add_robots,
    align_recordings,
    draw_robots,
    make_robot,
    make_touches,
    make_training,
    measure_transfer,
    sweep_shots,
    touch_robots,
)
from feeler.robot.reality import _choose_before
from paper import fig6_data
from paper.fig6_data import (
    _PROFILES,
    compute_comparison,
)


@pytest.fixture(scope="module")
def training():
    return make_training()


@pytest.fixture(scope="module")
def classifier(training):
    return TransferClassifier().fit(training.values, training.labels)


def test_the_training_set_is_30_classes_and_every_touch_has_a_peak(training):
    assert len(set(training.labels)) == len(training.labels) == 30
    assert training.touched.all()
    tip = np.einsum(
        "n,knt->kt", training.antenna.segment_length, np.sin(np.cumsum(training.values, axis=1))
    )
    peak = tip[:, 1500]
    assert np.all(peak >= tip[:, 1499]) and np.all(peak >= tip[:, 1501])
    assert training.before == 1500


@pytest.mark.parametrize(
    ("speed", "length", "before"),
    [(0.027, 1, 1500), (0.27, 1, 1500), (0.02, 1, 2025), (0.27, 20, 3000)],
)
def test_the_window_is_longer_for_slower_touches_and_longer_antennae(speed, length, before):
    robot = make_robot()
    long = robot.replace(segment_length=length * robot.segment_length)
    trials = make_touches(speeds=(0.27, speed), locations=(0.9,))
    assert _choose_before(long, trials) == before


def test_without_a_gap_transfer_is_perfect_and_a_gap_costs(classifier):
    none = measure_transfer(classifier, touch_robots(draw_robots(0.0, 1, seed=0)))
    assert none.correct == {"all": 6, "feature": 6, "location": 6, "speed": 6, "top2": 6}
    wide = measure_transfer(classifier, touch_robots(draw_robots(4.0, 3, seed=0)))
    assert wide.share()[0] < 0.8


def _fast():
    return make_touches(speeds=(0.27,))


def test_variants_keep_labels_and_differ():
    touches = _fast()[-2:]
    training = make_training(trials=touches, n_variants=2, rng=np.random.default_rng(0))
    assert training.labels == training.labels[:2] * 3
    np.testing.assert_array_equal(training.motions[0], make_training(trials=touches).motions[0])
    assert np.abs(training.values[2] - training.values[0]).max() > 1e-3
    with pytest.raises(InvalidInput, match="needs rng="):
        make_training(trials=touches, n_variants=1)


def test_whole_robots_join_the_training_with_their_faults():
    touches = _fast()[-2:]
    training = make_training(trials=touches)
    joined = add_robots(training, draw_robots(1.0, 2, seed=9), touches)
    assert joined.labels == training.labels * 3
    np.testing.assert_array_equal(joined.values[:2], training.values)
    assert (
        np.ptp(training.motions[0][:, :15]) == 0 < np.ptp(joined.motions[2][:, :15])
    )  # a sensor never rests exactly


def test_one_own_touch_suffices_where_touches_repeat_exactly(training):
    repeatable = Gap(
        **{
            **vars(Gap().scaled(0)),
            "stiffness_each": 0.4,
            "mass": 0.4,
            "length": 0.1,
            "gain": 0.6,
        }
    )
    robots = draw_robots(1.0, 1, seed=5, gap=repeatable)
    zero, one = sweep_shots(training, (0, 1), robots)
    assert zero.total == one.total == 6
    assert zero.correct["all"] < one.correct["all"] == 6


def test_a_recording_without_contact_says_so(classifier):
    rng = np.random.default_rng(0)
    still = Recording(time=np.arange(800.0), values=rng.normal(0, 0.002, (8, 800)))
    assert classifier.predict(align_recordings([still]))[0][0] == "no contact"


def test_each_speed_and_each_profile_is_measured_by_itself(monkeypatch):
    """Random tensors in the place of touches: those of the linear profile and the slow speed are
    the robot's own.
    """
    planted = {}

    def touch(antenna, speed, engine):
        assert engine == "mujoco"
        rng = np.random.default_rng(len(planted))
        alike = 5 + 0.8 * rng.random((10, 8, 30))  # so that noise hides some
        planted[antenna.name, speed] = alike * (1 + len(planted))
        return planted[antenna.name, speed]

    monkeypatch.setattr(fig6_data, "touch_robot", touch)
    found = compute_comparison(engine="mujoco", n_repeats=2, random_state=3)
    groups = {f"{v:g} m/s": planted["robot linear", v] for v in (0.27, 0.135, 0.027)}
    slow = {name: planted[f"robot {name}", 0.027] for name in _PROFILES}
    assert len(planted) == 5
    classes = [f"{trial.name} {trial.location:g}" for trial in make_touches()[:10]]
    for measured, expected in ((found["speed"], groups), (found["profile"], slow)):
        assert list(measured) == list(expected)
        names = np.repeat(list(expected), 10)
        dispersion = compute_dispersion(np.concatenate(list(expected.values())), list(names))
        for name, tensors in expected.items():
            noise = Relative(each="tensor")
            sweep = compute_sweep(
                tensors, classes, ratios=(0.2,), n_repeats=2, noise=noise, random_state=3
            )
            assert measured[name]["accuracy"] == pytest.approx(sweep.noisy.mean())
            assert (
                sweep.noisy.mean() < sweep.clean.mean() - 0.1
            )  # that of noisy copies, no other
            for index in ("pearson", "ssim", "mse", "nmi"):
                assert measured[name][index] == dispersion.average[index][name]
