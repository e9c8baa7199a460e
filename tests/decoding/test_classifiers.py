"""Every registered classifier answers the same questions, of a whole touch or by a deadline."""

import warnings

import numpy as np
import pytest
import xarray as xr
from scipy.stats import norm
from sklearn.base import clone

from feeler.analysis import compute_information
from feeler.decoding import (
    CLASSIFIERS,
    Classifier,
    Common,
    IdealObserver,
    Noise,
    Relative,
    TemplateClassifier,
    compute_sweep,
    make_lda,
    measure_classifier,
)
from feeler.decoding.classifiers import count_until
from feeler.decoding.observers import StudentTClassifier
from feeler.decoding.streams import StreamDecoder
from feeler.decoding.transfer import TransferClassifier
from feeler.errors import InvalidInput

START = 10  # samples at rest before contact


class Loud(Noise):
    """Noise that grows with what is felt."""

    def sd(self, tensors):
        return 0.02 + self.size * np.abs(tensors)


def make_touches(seed=0, n_each=4):
    """Three classes of ramps; until sample 40 the last two are the same."""
    rng, time = np.random.default_rng(seed), np.maximum(np.arange(80.0) - START, 0)
    late = np.maximum(time - 30, 0)
    shapes = [(1.0, 0.5, 0.0), (0.2, 1.0, 0.0), (0.2, 1.0, 0.8)]
    means = [np.outer([a, b], time) + np.outer([c, -c], late) for a, b, c in shapes]
    tensors = np.repeat(means, n_each, axis=0) / 50
    drawn = tensors * (1 + 0.02 * rng.standard_normal((len(tensors), 1, 1)))
    return drawn, np.repeat(list("abc"), n_each)


def label(tensors):
    coords = {"time": ("time", np.arange(80.0)), "lead": ("trial", np.full(len(tensors), 10.0))}
    return xr.DataArray(tensors, dims=("trial", "sensor", "time"), coords=coords, name="angle")


def list_classifiers():
    yield "lda", make_lda(3)
    yield "svm", CLASSIFIERS["svm"](3)
    yield "templates", TemplateClassifier(noise=Common(0.05))
    yield "stream", StreamDecoder(window=70, max_lag=3)
    yield "ideal", IdealObserver(noise=Common(0.05))
    yield "transfer", TransferClassifier(2, 0.01)


ALL = dict(list_classifiers())


@pytest.mark.parametrize("name", ALL)
def test_every_classifier_learns_and_gives_probabilities_whole_and_by_a_deadline(name):
    classifier = ALL[name].fit(*make_touches())
    tensors, labels = make_touches(seed=1)
    whole, early = (classifier.predict_proba(label(tensors), until) for until in (None, 30.0))
    for found in (whole, early):
        assert found.dims == ("trial", "class") and found["class"].values.tolist() == list(
            "abc"
        )
        np.testing.assert_allclose(found.sum("class"), 1, rtol=1e-6)
    assert classifier.score(tensors, labels) == 1
    assert list(classifier.predict(label(tensors), 30.0).values[:4]) == ["a"] * 4
    (right, bits), (_, less) = (
        measure_classifier(classifier, label(tensors), labels, until) for until in (None, 30.0)
    )
    assert right == 1 and less < bits  # nobody can tell b from c by then


@pytest.mark.parametrize("name", ALL)
def test_what_comes_after_the_deadline_changes_no_answer(name):
    classifier = (
        ALL[name].fit(*(label(make_touches()[0]), make_touches()[1]))
        if name != "stream"
        else ALL[name].fit(*make_touches())
    )
    tensors, _ = make_touches(seed=1)
    other = tensors.copy()
    other[:, :, 45:] = 7.0
    first, second = (classifier.predict_proba(label(x), 30.0) for x in (tensors, other))
    np.testing.assert_array_equal(first, second)


MORE = {
    **ALL,
    "clouds": StudentTClassifier(5),
    "ideal, relative": IdealObserver(),
    "templates, relative": TemplateClassifier(),
}


@pytest.mark.parametrize("name", ["ideal", "templates"])
def test_a_known_touch_without_noise_of_its_own_is_refused(name):
    tensors, labels = make_touches()
    tensors[labels == "b"] = 0.0
    with pytest.raises(InvalidInput, match=r"relative:0\.1 is 0 in tensor \d.*zero everywhere"):
        clone(MORE[f"{name}, relative"]).fit(tensors, labels)
    clone(ALL[name]).fit(tensors, labels)  # a floor goes on


@pytest.mark.parametrize("factor", [1e-20, 1e20])
def test_lda_of_touches_without_noise_is_refused(factor):
    tensors, labels = make_touches(n_each=1)
    with pytest.raises(
        InvalidInput, match="of each class are all the same: give some with noise"
    ):
        ALL["lda"].fit(np.repeat(np.sign(tensors) * factor, 4, axis=0), np.repeat(labels, 4))


def test_noisy_copies_are_no_touches_that_an_ideal_observer_knows():
    tensors, labels = make_touches(n_each=1)
    copies = Common(0.05).add(tensors, np.random.default_rng(0), 10)
    with pytest.warns(UserWarning, match="IdealObserver got several tensors of one label"):
        IdealObserver(Common(0.05)).fit(copies, np.tile(labels, 10))
    with pytest.warns(UserWarning, match="look like noisy copies.*fit it on the clean tensors"):
        IdealObserver(Common(0.05)).fit(
            np.concatenate([make_touches()[0], copies]),
            np.r_[make_touches()[1], np.tile(labels, 10)],
        )
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        IdealObserver(Common(0.05)).fit(*make_touches())  # several touches of one label, smooth
        IdealObserver(Common(0.05)).fit(np.repeat(tensors, 3, axis=0), np.repeat(labels, 3))
        rng = np.random.default_rng(1)  # codes of few pulses are as rough, and mostly silent
        pulses = rng.random((12, 3, 80)) * (rng.random((12, 3, 80)) < 0.1)
        IdealObserver(Common(0.05)).fit(pulses, make_touches()[1])


@pytest.mark.parametrize("classifier", ["lda", "svm", "ideal", "templates"])
def test_a_sweep_of_codes_of_no_size_says_so(classifier):
    tensors, labels = make_touches()
    how = {"estimator": classifier, "ratios": (0.1,), "n_copies": 4, "n_repeats": 1}
    with pytest.raises(InvalidInput, match="all codes are 0: nothing to classify"):
        compute_sweep(0 * tensors, labels, **how)
    for factor in (1e-300, 1e-200, 1e200, 1e300):
        with pytest.raises(
            InvalidInput, match=r"magnitude of the codes is .*squares are numbers"
        ):
            compute_sweep(factor * tensors, labels, **how)
        with pytest.raises(
            InvalidInput, match=r"magnitude of the codes is .*squares are numbers"
        ):
            compute_sweep(tensors, labels, held_out=(factor * tensors, labels), **how)


def test_a_deadline_counts_from_contact():
    tensors = make_touches()[0]
    assert count_until(label(tensors), 30.0) == 41
    assert count_until(tensors, 30.0) == 30
    assert count_until(tensors, 1e6) == 80
    with pytest.raises(InvalidInput, match="no sample lies within"):
        count_until(tensors, 0.0)
    mixed = label(tensors).assign_coords(lead=("trial", np.arange(12.0)))
    with pytest.raises(InvalidInput, match="trials of one lead"):
        count_until(mixed, 30.0)


@pytest.mark.parametrize("noise", [Common(0.2), Loud(0.3)], ids=["white", "with the signal"])
def test_the_ideal_classifier_is_bayes_rule(noise):
    """The log of the normal density, entry by entry, touch by touch."""
    known, labels = make_touches()
    classifier = IdealObserver(noise=noise).fit(known, labels)
    rng = np.random.default_rng(3)
    met = known + noise.sd(known) * rng.standard_normal(known.shape)
    sd = np.broadcast_to(noise.sd(known), known.shape)
    density = norm.logpdf(met[:, None], known[None], sd[None]).sum(axis=(2, 3))
    weight = np.exp(density - density.max(axis=1, keepdims=True))
    chance = weight.reshape(12, 3, 4).sum(axis=2) / weight.sum(axis=1, keepdims=True)
    np.testing.assert_allclose(classifier.predict_proba(met), chance, rtol=1e-7, atol=1e-12)
    early = norm.logpdf(met[:, None, :, :30], known[None, ..., :30], sd[None, ..., :30])
    weight = np.exp(early.sum(axis=(2, 3)) - early.sum(axis=(2, 3)).max(axis=1, keepdims=True))
    chance = weight.reshape(12, 3, 4).sum(axis=2) / weight.sum(axis=1, keepdims=True)
    np.testing.assert_allclose(classifier.predict_proba(met, 30), chance, rtol=1e-7, atol=1e-12)


@pytest.mark.parametrize("level", [0.3, 0.8])
@pytest.mark.parametrize("each", [False, True], ids=["one sd", "an sd for each touch"])
def test_the_ideal_classifier_agrees_with_the_exact_route_over_energies(level, each):
    known, _ = make_touches(n_each=2)
    own = level * (np.linspace(0.8, 1.2, 6) if each else np.ones(6))

    class Own(Noise):
        def sd(self, tensors):
            return own[:, None, None]

    classifier = IdealObserver(noise=Own()).fit(known, np.arange(6))
    rng, copies = np.random.default_rng(5), 1500
    drawn = rng.standard_normal((copies, *known.shape))
    met = (known + own[:, None, None] * drawn).reshape(-1, *known.shape[1:])
    accuracy, bits = measure_classifier(classifier, met, np.tile(np.arange(6), copies))
    exact = compute_information(known, own, n_draws=1500)
    assert accuracy == pytest.approx(exact.accuracy, abs=0.02)
    assert bits == pytest.approx(exact.bits, abs=0.04)


def test_templates_are_normal_distributions_with_the_scatter_of_their_touches():
    known, labels = make_touches(n_each=5)
    classifier = TemplateClassifier(noise=Common(0.1)).fit(known, labels)
    met = make_touches(seed=2)[0][:, :, ::8]
    classifier = TemplateClassifier(noise=Common(0.1)).fit(known[:, :, ::8], labels)
    logits = classifier.decide(met)
    for k, own in enumerate(np.split(known[:, :, ::8].reshape(15, -1), 3)):
        covariance = np.cov(own.T) + 0.01 * np.eye(own.shape[1])
        far = met.reshape(len(met), -1) - own.mean(axis=0)
        expected = -0.5 * np.einsum("ti,ij,tj->t", far, np.linalg.inv(covariance), far)
        expected -= 0.5 * np.linalg.slogdet(covariance)[1]
        np.testing.assert_allclose(logits[:, k], expected, rtol=1e-6)


def test_bits_are_the_mean_logarithm_of_what_was_believed():
    class Sure:
        classes_ = ("a", "b")

        def predict_proba(self, tensors, until=None):
            return np.array([[0.8, 0.2], [0.5, 0.5], [np.nan, np.nan]])

    accuracy, bits = measure_classifier(Sure(), np.zeros((3, 2, 2)), ["a", "b", "b"])
    assert accuracy == pytest.approx(1 / 3)
    assert bits == pytest.approx(1 + np.log2([0.8, 0.5, 0.5]).mean())
    with pytest.raises(InvalidInput, match="never learned the class 'c'"):
        measure_classifier(Sure(), np.zeros((3, 2, 2)), ["a", "b", "c"])


def test_a_touch_without_contact_is_wrong_in_a_sweep():
    tensors, labels = make_touches()
    tensors[:2] = 0
    sweep = compute_sweep(
        tensors,
        labels,
        estimator=StreamDecoder(window=60, max_lag=3),
        ratios=(1e-3,),
        n_copies=2,
        n_repeats=1,
    )
    assert sweep.noisy[0, 0] == pytest.approx(10 / 12)
    assert sweep.confusion.sum() == 20


def test_a_classifier_that_is_told_the_noise_is_not_turned():
    with pytest.raises(InvalidInput, match="a classifier that is not told the noise"):
        compute_sweep(*make_touches(), estimator="ideal", noise=Relative(), rotate=True)


class Nearest(Classifier):
    """A classifier from outside: the class of the nearest touch."""

    def fit(self, X, y):
        self._keep(X, y)
        self.known_, self.labels_ = np.asarray(X), np.asarray(y)
        self.classes_ = np.unique(self.labels_)
        return self

    def _decide(self, X):
        far = ((np.asarray(X)[:, None] - self.known_) ** 2).sum(axis=(2, 3))
        nearest = self.labels_[far.argmin(axis=1)]
        return (nearest[:, None] == self.classes_).astype(float)


def test_a_classifier_from_outside_is_asked_by_its_name():
    CLASSIFIERS.register("nearest", Nearest)
    try:
        tensors, labels = make_touches()
        few = {"ratios": (0.05,), "n_copies": 2, "n_repeats": 1}
        assert compute_sweep(tensors, labels, estimator="nearest", **few).noisy.min() > 0.9
        classifier = CLASSIFIERS["nearest"]().fit(tensors, labels)
        assert measure_classifier(classifier, *make_touches(seed=1), until=60.0)[0] > 0.9
        with pytest.raises(InvalidInput, match="learned tensors of 2 sensors"):
            classifier.predict(tensors[:, :1])
    finally:
        CLASSIFIERS.unregister("nearest")


@pytest.mark.parametrize("name", [one for one in ALL if one != "cnn"])
def test_labels_are_of_one_kind_and_may_be_labelled_themselves(name):
    """A 1 beside texts would be learned as the text "1", which no answer equals."""
    tensors, labels = make_touches()
    expected = clone(ALL[name]).fit(tensors, labels).predict_proba(tensors)
    of_array = clone(ALL[name]).fit(tensors, xr.DataArray(labels, dims="trial"))
    np.testing.assert_array_equal(of_array.predict_proba(tensors), expected)
    for wrong in (["a", 1, 2.0], [None, "b", "c"], [np.nan, 1.0, 2.0]):
        with pytest.raises(InvalidInput, match="all of one kind and none missing"):
            clone(ALL[name]).fit(tensors, [wrong["abc".index(one)] for one in labels])
    with pytest.raises(InvalidInput, match="12 tensors but 2 labels"):
        of_array.score(tensors, ["a", "b"])
