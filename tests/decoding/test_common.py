"""What scikit-learn and its users expect of every estimator: one file for all of them."""

import pickle

import numpy as np
import pandas as pd
import pytest
from sklearn.base import clone, is_classifier
from sklearn.calibration import CalibratedClassifierCV
from sklearn.ensemble import StackingClassifier, VotingClassifier
from sklearn.exceptions import NotFittedError
from sklearn.model_selection import GridSearchCV, cross_val_predict, cross_val_score
from sklearn.pipeline import make_pipeline
from sklearn.utils import estimator_checks as checks
from sklearn.utils import get_tags
from sklearn.utils.estimator_checks import parametrize_with_checks
from sklearn.utils.parallel import Parallel, delayed

from feeler.decoding import CLASSIFIERS, PrincipalComponents, StreamDecoder, make_lda
from feeler.decoding.classifiers import make_svm
from feeler.decoding.network import TouchNetwork
from feeler.decoding.observers import StudentTClassifier
from feeler.decoding.transfer import TransferClassifier
from feeler.encoding import ConvolutiveNMF, Flatten

FLAT = [PrincipalComponents(2), make_lda(None), make_svm(None), make_lda(2)]
ESTIMATORS = {
    "lda": make_lda(),
    "svm": make_svm(),
    "cnn": TouchNetwork((12, 30), max_epochs=2),
    "templates": CLASSIFIERS["templates"](noise="common:0.1"),
    "ideal": CLASSIFIERS["ideal"](noise=0.1),  # rad, as "common:0.1"
    "stream": StreamDecoder(window=8, max_lag=2),
    "transfer": TransferClassifier(2, 0.01),
    "student": StudentTClassifier(step=5),
}
ENCODER = ConvolutiveNMF(2, 5, n_restarts=2, max_iter=6, random_state=0, warn=False)
ALL = ESTIMATORS | {"encoder": ENCODER, "flatten": Flatten()}

# of scikit-learn's checks those that need no table; all others fit an array (sample, feature)
WITHOUT_DATA = (
    checks.check_no_attributes_set_in_init,
    checks.check_estimator_cloneable,
    checks.check_estimator_repr,
    checks.check_estimator_tags_renamed,
    checks.check_get_params_invariance,
    checks.check_mixin_order,
    checks.check_parameters_default_constructible,
    checks.check_set_params,
    checks.check_valid_tag_types,
)


def list_known(estimator):
    """What scikit-learn says of its own Pipeline (PER_ESTIMATOR_XFAIL_CHECKS)."""
    words = "a pipeline fits the steps it was given"
    names = ("dont_overwrite_parameters", "estimators_overwrite_params")
    return {f"check_{check}": words for check in names} if hasattr(estimator, "steps") else {}


@parametrize_with_checks(FLAT, expected_failed_checks=list_known)
def test_tables_pass_all_checks_of_scikit_learn(estimator, check):
    check(estimator)


@pytest.mark.parametrize("check", WITHOUT_DATA, ids=lambda check: check.__name__)
@pytest.mark.parametrize("name", [n for n in ALL if n not in ("lda", "svm")])
def test_tensors_pass_the_checks_that_need_no_table(name, check):
    check(name, clone(ALL[name]))


@pytest.fixture(scope="module")
def data():
    """Bumps at three places of twelve sensors, from rest, in noise: tensors ≥ 0 and labels."""
    rng, time = np.random.default_rng(0), np.arange(30.0)
    place = np.tile([1.5, 5.5, 9.5], 8)
    bump = np.exp(-0.5 * (np.arange(12)[None, :, None] - place[:, None, None]) ** 2)
    X = bump * np.clip((time - 8) / 5, 0, 1) * rng.uniform(0.8, 1.2, (24, 1, 1))
    return X + 1e-3 * rng.random((24, 12, 30)), np.tile(["a", "b", "c"], 8)


def answer(estimator, X):
    return estimator.predict(X) if is_classifier(estimator) else estimator.transform(X)


@pytest.mark.parametrize("name", ALL)
def test_a_fit_has_the_state_that_users_rely_on(name, data):
    X, y = data
    estimator, kept = clone(ALL[name]), X.copy()
    tags = get_tags(estimator)
    assert tags.input_tags.three_d_array
    assert tags.input_tags.two_d_array == (name in ("lda", "svm"))
    assert not hasattr(estimator, "n_features_in_")
    for ask in ("predict", "predict_proba") if is_classifier(estimator) else ("transform",):
        with pytest.raises(NotFittedError, match="fitted"):
            getattr(estimator, ask)(X)
    assert estimator.fit(X, y) is estimator
    np.testing.assert_array_equal(X, kept)
    assert estimator.get_params() == clone(ALL[name]).get_params() or name in ("lda", "svm")
    assert estimator.n_features_in_ == 12
    first = answer(estimator, X)
    assert isinstance(first, np.ndarray)
    assert len(first) == 24
    np.testing.assert_array_equal(answer(pickle.loads(pickle.dumps(estimator)), X), first)
    np.testing.assert_array_equal(answer(estimator, X[::-2]), first[::-2])
    if name != "cnn":  # a few epochs from a seed of its own
        np.testing.assert_array_equal(answer(clone(estimator).fit(X, y), X), first)
    with pytest.raises(ValueError, match=r"[Ss]ensors|shape|\(row, time\)"):
        answer(estimator, X[:, :9])


@pytest.mark.parametrize("name", ESTIMATORS)
def test_a_classifier_refuses_tensors_with_gaps_and_is_scored_by_ranks(name, data):
    X, y = data
    with pytest.raises(ValueError, match="NaN"):
        clone(ESTIMATORS[name]).fit(np.where(X > 1, np.nan, X), y)
    if name != "cnn":
        two = cross_val_score(ESTIMATORS[name], X, y == "a", scoring="roc_auc", cv=3)
        assert (two > 0.9).all()
        calibrated = CalibratedClassifierCV(ESTIMATORS[name], cv=3).fit(X, y)
        assert calibrated.score(X, y) == 1


@pytest.mark.parametrize("name", CLASSIFIERS)
def test_a_classifier_works_in_scikit_learn_s_own_tools(name, data):
    X, y = data
    classifier = clone(ESTIMATORS[name]).fit(X, y)
    assert (classifier.classes_ == ["a", "b", "c"]).all()
    assert classifier.predict(X).shape == y.shape
    assert name == "cnn" or (classifier.predict(X) == y).mean() > 0.9
    chance = classifier.predict_proba(X)
    assert chance.shape == (24, 3)
    np.testing.assert_allclose(chance.sum(axis=1), 1, rtol=1e-5)
    weights = np.arange(24.0)
    expected = np.average(classifier.predict(X) == y, weights=weights)
    assert classifier.score(X, y, sample_weight=weights) == pytest.approx(expected)
    found = cross_val_predict(clone(classifier), X, y, cv=2, method="predict_proba")
    assert found.shape == (24, 3)
    if name == "cnn":
        return
    assert cross_val_score(clone(classifier), X, y, cv=3, error_score="raise").min() > 0.9
    numbers = clone(classifier).fit(X, np.tile([4, 7, 9], 8))
    assert numbers.predict(X).dtype.kind == "i"
    with pytest.raises(ValueError, match=r"class|label|clouds"):
        clone(classifier).fit(X, np.repeat("a", 24))
    with pytest.raises(ValueError, match=r"label|inconsistent|samples"):
        clone(classifier).fit(X, y[:5])


def test_classifiers_vote_and_stack(data):
    X, y = data
    several = [(name, clone(ESTIMATORS[name])) for name in ("lda", "templates", "student")]
    vote = VotingClassifier(several, voting="soft").fit(X, y)
    assert vote.score(X, y) > 0.9
    stack = StackingClassifier(several[:2], make_lda(None), cv=2).fit(X, y)
    assert stack.score(X, y) > 0.9


def test_an_encoder_in_a_pipeline_gives_tables_with_names(data):
    X, y = data
    codes = make_pipeline(clone(ENCODER), Flatten()).set_output(transform="pandas")
    table = codes.fit_transform(X, y)
    assert isinstance(table, pd.DataFrame)
    assert [*table.columns[[0, 29, 30]]] == ["component0_0", "component0_29", "component1_0"]
    assert [*codes.get_feature_names_out()] == [*table.columns]
    plain = clone(ENCODER).fit(X).transform(X)
    np.testing.assert_array_equal(table.values.reshape(plain.shape), plain)
    np.testing.assert_array_equal(codes[-1].inverse_transform(table), plain)
    whole = make_pipeline(clone(ENCODER), Flatten(), make_lda(None))
    search = GridSearchCV(
        whole, {"convolutivenmf__n_components": [1, 2]}, cv=2, error_score="raise", n_jobs=1
    ).fit(X, y)
    assert search.best_score_ > 0.9


def test_single_precision_stays_single(data):
    X, _ = data
    encoder = clone(ENCODER).fit(X.astype(np.float32))
    code = encoder.transform(X.astype(np.float32))
    assert code.dtype == np.float32
    assert encoder.inverse_transform(code).dtype == np.float32
    assert Flatten().fit_transform(code).dtype == np.float32
    double = clone(ENCODER).fit(X)
    # the extrapolated steps amplify rounding (1e-7 after two of them, 4e-4 after four)
    np.testing.assert_allclose(encoder.components_, double.components_, atol=2e-3)
    np.testing.assert_allclose(
        encoder.reconstruction_err_, double.reconstruction_err_, rtol=1e-3
    )


@pytest.mark.long
def test_n_jobs_counts_as_scikit_learn_s_and_changes_no_number(data):
    X, _ = data
    one = clone(ENCODER).fit(X)
    for n_jobs in (1, 2, -1):
        other = clone(ENCODER).set_params(n_jobs=n_jobs).fit(X)
        np.testing.assert_array_equal(other.components_, one.components_)
    within = Parallel(n_jobs=2)(delayed(clone(ENCODER).fit)(X) for _ in range(2))
    np.testing.assert_array_equal(within[1].components_, one.components_)


@pytest.mark.parametrize("make", [make_lda, make_svm])
def test_a_small_set_gets_as_many_components_as_it_can_give(make, data):
    X, y = data
    classifier = make(30).fit(X[:9], y[:9])
    assert len(classifier[0].components_) <= 8
    assert classifier.score(X, y) > 0.9
