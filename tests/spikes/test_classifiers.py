"""Classifiers of spikes: the ideal observer against brute force, codes, deadlines."""

import warnings
from itertools import product

import numpy as np
import pytest
import xarray as xr
from scipy.stats import poisson
from sklearn.base import clone

from feeler.decoding import measure_classifier
from feeler.errors import InvalidInput
from feeler.spikes import SPIKE_CODES, PoissonObserver, SpikeClassifier


def make_rates(seed=0):
    """Four touches of three classes (touch, unit, time) [Hz]; one unit is silent in some."""
    rates = np.random.default_rng(seed).gamma(1.0, 300.0, (4, 2, 3))
    rates[0, 1] = rates[2, 0] = 0.0
    return rates, ["b", "a", "c", "a"]


def test_the_ideal_observer_is_bayes_rule():
    rates, labels = make_rates()
    classifier = PoissonObserver(step=2.0).fit(rates, labels)
    counts = np.random.default_rng(1).poisson(rates[[0, 1, 2, 3, 3]] * 2e-3)
    chance = np.stack(
        [poisson.pmf(counts, one * 2e-3).prod(axis=(1, 2)) for one in rates], axis=1
    )
    by_class = np.stack([chance[:, [1, 3]].sum(axis=1), chance[:, 0], chance[:, 2]], axis=1)
    np.testing.assert_allclose(
        classifier.predict_proba(counts),
        by_class / by_class.sum(axis=1, keepdims=True),
        rtol=1e-10,
    )


def test_silence_speaks_for_the_touch_of_fewer_spikes():
    """Of p(no spike | c) = exp(−Σ r_c Δt), by hand."""
    rates = np.array([[[100.0, 300.0]], [[20.0, 30.0]]])
    found = (
        PoissonObserver(step=2.0).fit(rates, ["many", "few"]).predict_proba(np.zeros((1, 1, 2)))
    )
    expected = np.exp([-0.1, -0.8])  # sorted by label: few, many
    np.testing.assert_allclose(np.asarray(found)[0], expected / expected.sum(), rtol=1e-12)


def test_counts_in_place_of_rates_are_noticed():
    rates = np.repeat(300.0 * np.exp(-np.arange(60.0) / 20)[None, None], 2, axis=0)
    rates[1] = rates[1, :, ::-1]
    labels = np.repeat(["a", "b"], 8)
    drawn = np.random.default_rng(0).poisson(np.repeat(rates, 8, axis=0) * 1e-3) * 1e3
    with pytest.warns(UserWarning, match="PoissonObserver got several.*no ideal observer"):
        PoissonObserver().fit(drawn, labels)
    places = np.array([np.roll(rates[k // 8], 3 * (k % 8), axis=1) for k in range(16)])
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        PoissonObserver().fit(places, labels)
        PoissonObserver().fit(np.repeat(rates, 8, axis=0), labels)


def test_its_accuracy_and_bits_are_those_summed_over_all_trains():
    rates = np.array([[[150.0, 400.0]], [[300.0, 100.0]], [[0.0, 250.0]]])
    classifier = PoissonObserver(step=4.0).fit(rates, list("abc"))
    trains = np.array([*product(range(16), repeat=2)])[:, None, :]
    chance = np.stack([poisson.pmf(trains, one * 4e-3).prod(axis=(1, 2)) for one in rates])
    posterior = np.nan_to_num(np.asarray(classifier.predict_proba(trains)))
    accuracy = (chance.T * (posterior == posterior.max(axis=1, keepdims=True))).sum() / 3
    drawn = np.random.default_rng(2).poisson(np.repeat(rates, 20000, axis=0) * 4e-3)
    found, bits = measure_classifier(classifier, drawn, np.repeat(list("abc"), 20000))
    assert found == pytest.approx(accuracy, abs=0.01)
    true = (chance.T / 3 * np.log2(np.maximum(posterior, 1e-300))).sum() + np.log2(3)
    assert bits == pytest.approx(true, abs=0.02)


def test_a_train_that_no_known_touch_can_give_has_no_answer():
    rates, labels = make_rates()
    counts = np.zeros((1, 2, 3))
    counts[0, :, 0] = 1, 1
    rates[:, 1] = 0.0
    assert np.isnan(PoissonObserver().fit(rates, labels).predict_proba(counts)).all()
    assert np.isfinite(
        PoissonObserver(floor=1.0).fit(rates, labels).predict_proba(counts)
    ).all()


def test_a_floor_is_a_rate_that_all_known_touches_have_besides():
    rates, labels = make_rates()
    counts = np.random.default_rng(4).poisson(rates * 4e-3)
    lifted = PoissonObserver(step=4.0, floor=70.0).fit(rates, labels)
    by_hand = PoissonObserver(step=4.0).fit(rates + 70.0, labels)
    np.testing.assert_allclose(lifted.predict_proba(counts), by_hand.predict_proba(counts))


def make_rasters(seed, n_each=40):
    """Three classes: which of two units fires first, or both late; discriminated by their
    timing.
    """
    rng = np.random.default_rng(seed)
    rates = np.zeros((3, 4, 60))
    rates[0, 0, 12:], rates[0, 1, 30:] = 300.0, 300.0
    rates[1, 1, 12:], rates[1, 0, 30:] = 300.0, 300.0
    rates[2, 2:, 40:] = 300.0
    labels = np.repeat(list("abc"), n_each)
    coords = {"time": np.arange(60.0), "lead": ("trial", np.full(labels.size, 10.0))}
    counts = rng.poisson(np.repeat(rates, n_each, axis=0) * 1e-3)
    return xr.DataArray(counts, coords, ("trial", "unit", "time")), labels, rates


@pytest.mark.parametrize("code", ["counts", "first", "latency"])
def test_every_code_tells_by_a_deadline_and_sees_nothing_beyond(code):
    lessons, taught, rates = make_rasters(0)
    met, true, _ = make_rasters(1)
    classifier = SpikeClassifier(code, width=3 if code == "counts" else 1).fit(lessons, taught)
    ideal = PoissonObserver().fit(rates, list("abc"))
    assert classifier.score(met, true) > 0.85
    early = classifier.score(met, true, until=20.0)
    assert early < classifier.score(met, true)
    assert early <= ideal.score(met, true, until=20.0) + 0.05
    other = met.copy()
    other[:, :, 35:] = 3
    np.testing.assert_array_equal(
        *(classifier.predict_proba(x, 20.0).values for x in (met, other))
    )
    assert clone(classifier).get_params() == classifier.get_params()


@pytest.mark.parametrize(
    ("code", "width", "expected"),
    [
        ("counts", 2, [[2, 1, 1, 0, 0, 0], [0, 3, 0, 0, 1, 0]]),
        ("counts", 3, [[3, 1, 0, 0], [0, 3, 1, 0]]),
        ("first", 1, [[1, 5], [3, 2]]),
        ("first", 2, [[0, 2], [1, 1]]),
        ("latency", 1, [[0, 4], [1, 0]]),
        ("latency", 2, [[0, 2], [0, 0]]),
        ("latency", 3, [[0, 1], [0, 0]]),
        ("onset", 1, [[1], [2]]),
        ("onset", 2, [[0], [1]]),
    ],
)
def test_codes_are_what_they_say(code, width, expected):
    """Two touches: one unit of the first is silent; those of the second differ by one sample."""
    raster = np.array([[[0, 2, 1, 0, 1], [0, 0, 0, 0, 0]], [[0, 0, 0, 3, 0], [0, 0, 1, 0, 0]]])
    assert SPIKE_CODES[code](raster, width).tolist() == expected


def test_what_cannot_be_learned_is_refused():
    with pytest.raises(InvalidInput, match="same code 'counts', as where no unit fires"):
        SpikeClassifier().fit(np.zeros((6, 2, 30)), list("aabbcc"))
    alike = np.repeat(np.eye(30)[[3, 15, 27], None].repeat(2, axis=1), 2, axis=0)
    with pytest.raises(InvalidInput, match="of one label all have the same code 'counts'"):
        SpikeClassifier().fit(alike, list("aabbcc"))
    with pytest.raises(InvalidInput, match="must be ≥ 0"):
        PoissonObserver().fit(-make_rates()[0], list("abcd"))
    with pytest.raises(InvalidInput, match="unknown code of spikes 'phase'; valid: counts"):
        SpikeClassifier("phase").fit(*make_rasters(0)[:2])
    with pytest.raises(InvalidInput, match="4 tensors but 2 labels"):
        PoissonObserver().fit(make_rates()[0], list("ab"))
    with pytest.raises(InvalidInput, match="step must be > 0"):
        PoissonObserver(step=0).fit(*make_rates())


def test_the_ideal_observer_takes_step_and_unit_from_labelled_rates():
    """Expected counts are rate times step; samples 2 ms apart are none of 1 ms."""
    rates, labels = make_rates()
    coords = {"time": 2.0 * np.arange(1, 4)}
    named = xr.DataArray(rates, coords, ("trial", "unit", "time"), attrs={"units": "Hz"})
    counts = np.random.default_rng(1).poisson(rates * 2e-3)
    expected = PoissonObserver(2.0).fit(rates, labels).predict_proba(counts)
    for one in (named, (named / 1e3).assign_attrs(units="kHz")):
        found = PoissonObserver(2.0).fit(one, labels).predict_proba(counts)
        np.testing.assert_allclose(found, expected)
    with pytest.raises(InvalidInput, match=r"2 ms apart, but step is 1 ms; give .*step=2"):
        PoissonObserver().fit(named, labels)
    with pytest.raises(InvalidInput, match="is in Hz, which cannot be converted to 1"):
        PoissonObserver(2.0).fit(named, labels).predict(named)
