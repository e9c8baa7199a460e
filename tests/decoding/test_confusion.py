"""Confusion split by attribute; labels; codes."""

import numpy as np
import pytest

from feeler.decoding import encode_with, explain_confusion, make_codes, make_labels
from feeler.errors import InvalidInput

ATTRIBUTES = {"feature": ["ball", "ball", "box", "box"], "size": [1.5, 3.0, 1.5, 3.0]}


def test_planted_confusions_are_named():
    counts = np.zeros((4, 4))
    counts[0, 0], counts[0, 1], counts[1, 3], counts[2, 1] = 4, 3, 2, 1
    confused = explain_confusion(counts, ATTRIBUTES)
    assert confused.correct == pytest.approx(0.4)
    assert confused.wrong == pytest.approx(
        {("feature",): 0.2, ("size",): 0.3, ("feature", "size"): 0.1}
    )
    assert confused.accuracy == pytest.approx({"feature": 0.7, "size": 0.6})


def test_what_is_never_wrong_has_no_share():
    confused = explain_confusion(np.eye(4) + np.eye(4)[[1, 0, 3, 2]], ATTRIBUTES)
    assert {name: share for name, share in confused.wrong.items() if share} == {("size",): 0.5}
    assert explain_confusion(np.eye(4), ATTRIBUTES).correct == 1
    once = np.zeros((4, 4))
    once[0, 0] = 1  # a single trial
    assert explain_confusion(once, ATTRIBUTES).correct == 1


def test_labels_are_readable():
    labels = make_labels(ATTRIBUTES, by=("feature", "size"))
    np.testing.assert_array_equal(labels, ["ball 1.5", "ball 3", "box 1.5", "box 3"])


class MeanEncoder:
    """Stands in for the convolutive NMF: the joint activations are means, the codes of fixed bases
    maxima.
    """

    def fit(self, X):
        self.activations_ = X.mean(axis=1, keepdims=True)
        return self

    def transform(self, X, *, code):
        return X.max(axis=1, keepdims=True) * {"sparse": 2.0, "ridge": 1.0}[code]


def test_each_kind_of_code_comes_from_its_own_call():
    tensors = np.random.default_rng(0).random((4, 5, 6))
    codes = make_codes(tensors, MeanEncoder())
    assert list(codes) == ["joint", "sparse", "ridge", "raw"]
    np.testing.assert_array_equal(codes["joint"], tensors.mean(axis=1, keepdims=True))
    np.testing.assert_array_equal(codes["sparse"], 2 * codes["ridge"])
    np.testing.assert_array_equal(codes["raw"], tensors)


def test_raw_needs_no_encoder():
    tensors = np.ones((2, 3, 4))
    np.testing.assert_array_equal(make_codes(tensors, None, ["raw"])["raw"], tensors)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: explain_confusion(np.zeros((4, 4)), ATTRIBUTES), "at least one trial"),
        (lambda: explain_confusion(np.ones((3, 3)), ATTRIBUTES), "4 values for 3 classes"),
        (lambda: make_labels(ATTRIBUTES, by=("location",)), "no coordinate 'location'"),
        (lambda: make_codes(np.ones((2, 2, 2)), None, ["pca"]), "joint, sparse, ridge, raw"),
        (
            lambda: encode_with(np.ones((2, 2, 2)), None, "joint"),
            "only for the tensors of the fit",
        ),
    ],
)
def test_bad_input_is_refused(call, message):
    with pytest.raises(InvalidInput, match=message):
        call()
