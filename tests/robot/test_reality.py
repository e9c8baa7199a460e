"""Transfer to surrogate robots: perfect without a gap, worse with one; nothing leaks from test to
training.
"""

import numpy as np
import pytest

from feeler.decoding.transfer import TransferClassifier
from feeler.errors import InvalidInput
from feeler.robot import (
    Gap,
    Recording,
    align_recordings,
    draw_robots,
    make_touches,
    make_training,
    measure_transfer,
    sweep_shots,
    touch_robots,
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


@pytest.mark.long
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
