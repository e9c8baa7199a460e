"""A classifier of the user's own, from a file, wherever a classifier is named."""

import json

import numpy as np
import pytest
from sklearn.base import BaseEstimator
from sklearn.ensemble import VotingClassifier
from sklearn.model_selection import GridSearchCV
from sklearn.neighbors import KNeighborsClassifier
from sklearn.pipeline import make_pipeline
from sklearn.preprocessing import FunctionTransformer
from typer.testing import CliRunner

from feeler.cli.app import app
from feeler.cli.choose import name_classifier
from feeler.decoding import CLASSIFIERS, compute_sweep
from feeler.decoding.classifiers import adopt, describe_classifier
from feeler.errors import InvalidInput
from tests.cli._command import run

CODE = """
from feeler.decoding import make_lda

def make():
    return make_lda({n})
"""


@pytest.fixture
def own(tmp_path):
    file = tmp_path / "mine.py"
    file.write_text(CODE.format(n=3))
    yield file
    for name in [name for name in CLASSIFIERS if str(tmp_path) in name]:
        CLASSIFIERS.unregister(name)


def test_a_function_of_a_file_gives_a_classifier_and_its_text_is_its_identity(own):
    text = f"{own}:make"
    assert CLASSIFIERS[name_classifier(text)]()[0].n_components == 3
    assert name_classifier(text) == text  # again
    before = describe_classifier(text)
    own.write_text(CODE.format(n=4))
    assert describe_classifier(text) != before
    with pytest.raises(InvalidInput, match="has no function 'other'"):
        name_classifier(f"{own}:other")
    with pytest.raises(
        InvalidInput, match=r"no file .*a classifier of your own is file.py:func"
    ):
        name_classifier(f"{own}x.py:make")
    with pytest.raises(InvalidInput, match="unknown classifier 'nobody'"):
        name_classifier("nobody")


NEAREST = """
import numpy as np
from sklearn.naive_bayes import GaussianNB
from sklearn.neighbors import KNeighborsClassifier

class Nearest:
    def fit(self, tensors, labels):
        self.known, self.labels = tensors, labels

    def predict(self, tensors):
        gaps = [np.square(tensors - one).sum(axis=(1, 2)) for one in self.known]
        return self.labels[np.argmin(gaps, axis=0)]

def make():
    return Nearest()

def table():
    return KNeighborsClassifier(1)

def bayes():
    return GaussianNB()

def number():
    return 3
"""


def test_anything_with_fit_and_predict_answers_as_scikit_learn_s_own_of_tables(own):
    own.write_text(NEAREST)
    rng = np.random.default_rng(0)
    tensors = rng.random((12, 5, 20)) + np.repeat([0, 0.1, 0.2], 4)[:, None, None]
    labels = np.repeat(["a", "b", "c"], 4)
    expected = KNeighborsClassifier(1).fit(tensors.reshape(12, -1), labels)
    for name in ("make", "table"):
        make = CLASSIFIERS[name_classifier(f"{own}:{name}")]
        found = make().fit(tensors, labels)
        other = rng.random((40, 5, 20))
        np.testing.assert_array_equal(
            found.predict(other), expected.predict(other.reshape(40, -1))
        )
        chance = found.predict_proba(other)
        np.testing.assert_array_equal(
            found.classes_[chance.argmax(axis=1)], found.predict(other)
        )
        np.testing.assert_allclose(chance.sum(axis=1), 1)
        known = {"ratios": (0.3, 1.0), "n_repeats": 2, "noise": "common:1"}
        one = compute_sweep(tensors, labels, estimator=make(), **known)
        two = compute_sweep(tensors, labels, estimator=KNeighborsClassifier(1), **known)
        np.testing.assert_array_equal(one.noisy, two.noisy)
    with pytest.raises(
        InvalidInput, match=r"py:number must give something with fit.* predict.*, got 3"
    ):
        CLASSIFIERS[name_classifier(f"{own}:number")]()


class Picky(BaseEstimator):
    """A method of tensors that refuses what it cannot use, and is told so by its tags or not."""

    def __init__(self, three=False):
        self.three = three

    def __sklearn_tags__(self):
        tags = super().__sklearn_tags__()
        tags.input_tags.three_d_array = self.three
        return tags

    def fit(self, X, y):
        self.seen_ = X.shape
        raise ValueError("needs five touches of each class")

    def predict(self, X):
        raise AssertionError


def test_an_own_method_s_own_error_comes_at_once_and_tags_say_what_it_gets():
    tensors, labels = np.random.default_rng(0).random((6, 3, 4)), [0, 1] * 3
    plain = type("Plain", (), {"fit": Picky.fit, "predict": Picky.predict})
    shaped = FunctionTransformer(lambda X: X.reshape(len(X), -1))
    for method, shape in (
        (Picky(), (6, 12)),
        (Picky(three=True), (6, 3, 4)),
        (plain(), (6, 3, 4)),
    ):
        found = adopt(method, "mine")
        with pytest.raises(ValueError, match="needs five touches of each class") as error:
            found.fit(tensors, labels)
        assert found.method_.seen_ == shape
        notes = getattr(error.value, "__notes__", [])
        assert len(notes) == (len(shape) == 2) and all("three_d_array" in n for n in notes)
    for method in (make_pipeline(shaped, KNeighborsClassifier(1)), KNeighborsClassifier(1)):
        for wrapped in (method, VotingClassifier([("a", method)]), GridSearchCV(method, {})):
            known = adopt(wrapped, "mine").fit(np.concatenate([tensors] * 5), labels * 5)
            np.testing.assert_array_equal(known.predict(tensors), labels)


@pytest.mark.long
def test_tradeoff_asks_it(own, tmp_path):
    own.write_text(NEAREST)
    words = ["tradeoff", "--sets", 1, "--speed", 1.2, "--classifier", f"{own}:bayes", "--json"]
    words += ["--out", tmp_path / "out", "--objects", "ball:radius=1.5"]
    done = CliRunner().invoke(app, [str(word) for word in words])
    assert done.exit_code == 0, done.output
    assert f"{own}:bayes" in done.stdout
    assert json.loads(done.stdout[done.stdout.index("{") :])


OBJECT = """[[object]]
name = "bolt"
shape = "ball"
radius = 3.0
"""


@pytest.mark.long
def test_equal_antennas_have_equal_numbers_and_others_their_own(tmp_path):
    (tmp_path / "objects.toml").write_text(OBJECT)
    run("antenna", "twin.toml", "--preset", "robot", cwd=tmp_path)
    asked = (
        "--scale",
        "smoke",
        "--objects",
        "objects.toml",
        "--speed",
        "0.3",
        "--out",
        "c.html",
        "--json",
    )
    done = run("compare", "robot", "twin.toml", "cricket", *asked, cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    found = json.loads(done.stdout)
    assert (
        found["antennas"] == ["robot", "twin", "cricket"]
        and "over all classes" in (tmp_path / "c.html").read_text()
    )
    measures = [
        by_antenna
        for by_antenna in found.values()
        if isinstance(by_antenna, dict) and "twin" in by_antenna
    ]
    assert len(measures) == 11
    assert all(m["robot"] == m["twin"] for m in measures) and all(
        m["robot"] != m["cricket"] for m in measures[:7]
    )
