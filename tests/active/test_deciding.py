"""Decoders that know speeds vary: they beat chance, their probabilities mean something, and they
refuse what they don't know.
"""

import numpy as np
import pytest

import feeler
from feeler.active import (
    RecurrentDecoder,
    TouchTask,
    TravelDecoder,
    decide,
    make_noticer,
    measure_calibration,
    record_episodes,
)
from feeler.decoding.onset import OnsetFinder
from feeler.errors import InvalidInput

OBJECTS = [feeler.Ball(radius=1.0), feeler.Box(half_width=4.0, half_height=4.0)]


@pytest.fixture(scope="module")
def task():
    return TouchTask(
        features=OBJECTS,
        pool=256,
        gap=(2.0, 3.0),
        locations=(0.65, 0.75),
        duration=40.0,
        noise=0.01,
    )


@pytest.fixture(scope="module")
def learnt_from(task):
    return record_episodes(task, 256, seed=1)


@pytest.fixture(scope="module")
def met(task):
    return record_episodes(task, 128, seed=2)


def test_episodes_are_drawn_by_their_seed(task, met):
    again = record_episodes(task, 64, seed=2)
    np.testing.assert_array_equal(again.angle[:8], met.angle[:8])
    assert len(np.unique(met.base[:, -1, 2])) > 3  # speeds vary
    assert np.all(met.angle[~met.touching & (met.base[..., 0] == 0)] == 0)


def test_noticing_raises_few_false_alarms_and_works_where_a_single_sensor_cannot(learnt_from, met):
    noise, rng = 0.03, np.random.default_rng(0)
    noticer = make_noticer(learnt_from, noise, false_alarms=0.05)
    nothing = noise * rng.standard_normal((400, 40, 56))
    false = (noticer.notice(nothing) < 40).mean()
    assert false <= 0.05
    finders = [OnsetFinder(0.025, 2, 56) for _ in range(50)]  # the limit of the streaming decoder
    alarms = [
        any([finder.see(s) for s in one]) for finder, one in zip(finders, nothing, strict=False)
    ]
    assert np.mean(alarms) > 0.9
    touched = met.onset < 20
    late = noticer.notice(met.add_noise(noise, rng))[touched] - met.onset[touched]
    assert np.mean(late < 20) > 0.8
    assert np.median(late) <= 15


@pytest.mark.parametrize(
    "make", [TravelDecoder, lambda task, rec: RecurrentDecoder(task, hidden=32).fit(rec, passes=20)]
)
def test_a_decoder_tells_objects_apart_at_speeds_it_never_met(task, learnt_from, met, make):
    decoder = make(task, learnt_from)
    belief = decoder.decode(met.add_noise(task.noise, np.random.default_rng(3)), met.base)
    assert belief.shape == (128, 40, 2)
    np.testing.assert_allclose(belief.sum(axis=2), 1.0, rtol=1e-5)
    far = met.onset < 15
    right = (belief[:, -1].argmax(axis=1) == met.target)[far].mean()
    share = max(np.bincount(met.target[far].astype(int))) / far.sum()
    assert right > share + 0.1


def test_a_recurrent_decoder_goes_on_from_where_it_was(task, met):
    decoder = RecurrentDecoder(task, hidden=8)
    whole, _ = decoder.score(met.angle, met.base)
    first, state = decoder.score(met.angle[:, :15], met.base[:, :15])
    rest, _ = decoder.score(met.angle[:, 15:], met.base[:, 15:], state)
    np.testing.assert_allclose(np.concatenate([first, rest], axis=1), whole, atol=1e-6)


def test_a_recurrent_decoder_comes_back_from_its_file(task, met, tmp_path):
    decoder = RecurrentDecoder(task, hidden=8)
    decoder.save(tmp_path / "decoder.safetensors")
    again = RecurrentDecoder.load(tmp_path / "decoder.safetensors", task)
    np.testing.assert_array_equal(
        again.decode(met.angle, met.base), decoder.decode(met.angle, met.base)
    )


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"noise": 0.05}, "trained for another noise: 0.01, the task has 0.05"),
        ({"antenna": feeler.presets.cockroach("linear")}, "trained for another antenna"),
        (
            {"features": [*OBJECTS, feeler.Ball(radius=3.0)]},
            "trained for another objects: 2, the task has 3",
        ),
    ],
)
def test_a_decoder_of_another_antenna_or_noise_is_refused(task, changes, said, tmp_path):
    path = tmp_path / "decoder.safetensors"
    RecurrentDecoder(task, hidden=4).save(path)
    with pytest.raises(InvalidInput, match=said):
        RecurrentDecoder.load(path, task.replace(**changes))


def test_sensors_that_do_not_fit_are_named(task):
    with pytest.raises(InvalidInput, match="a decoder of 56 sensors needs felt"):
        RecurrentDecoder(task, hidden=4).decode(np.zeros((2, 3, 8)), np.zeros((2, 3, 4)))


def test_who_is_sure_stops():
    belief = np.array(
        [[[0.5, 0.5], [0.2, 0.8], [0.05, 0.95]], [[0.6, 0.4], [0.6, 0.4], [0.7, 0.3]]]
    )
    when, answer = decide(belief, 0.8)
    assert when.tolist() == [1, 2]
    assert answer.tolist() == [1, 0]
    with pytest.raises(InvalidInput, match="threshold must be a probability"):
        decide(belief, 1.5)


def test_probabilities_that_hold_are_calibrated_and_others_are_not():
    rng = np.random.default_rng(0)
    p = rng.uniform(0.5, 1.0, 20_000)
    belief, target = np.stack([p, 1 - p], axis=1), (rng.random(20_000) > p).astype(int)
    found = measure_calibration(belief, target)
    assert found.attrs["error"] < 0.02
    assert int(found["count"].sum()) == 20_000
    boastful = np.stack([p**0.1, 1 - p**0.1], axis=1)
    assert measure_calibration(boastful, target).attrs["error"] > 0.15
    with pytest.raises(InvalidInput, match="as many targets"):
        measure_calibration(belief, target[:5])
