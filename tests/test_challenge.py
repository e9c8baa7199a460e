"""The public task: what it counts, that no object is in two parts, and a stranger's entry."""

import re
import runpy
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import xarray as xr
from sklearn.neighbors import KNeighborsClassifier

import feeler
from feeler import challenge
from feeler.errors import InvalidInput

ROOT = Path(__file__).parents[1]


@pytest.fixture(scope="module")
def task():
    """Three touches of every object whose tensor says its family: a step of its number."""
    names = [item.name for item in challenge.make_objects() for _ in range(3)]
    family = [challenge.FAMILIES.index(name.partition("-")[0]) for name in names]
    tensors = np.ones((5, 8), np.float32) * (1.0 + np.array(family))[:, None, None]
    return challenge.Task(
        xr.Dataset(
            {"angle": (("trial", "sensor", "time"), tensors)},
            {"feature": ("trial", np.array(names))},
        )
    )


class Says:
    """Answers what it is told to, and keeps what it learned from."""

    def __init__(self, answers):
        self.answers = answers

    def fit(self, tensors, labels):
        self.learned = tensors

    def predict(self, tensors):
        return self.answers


def test_no_object_is_in_two_parts_and_each_part_has_every_family(task):
    table = pd.DataFrame({"object": task.objects, "family": task.labels, "part": task.split})
    assert (table.groupby("object")["part"].nunique() == 1).all()
    assert (table.groupby("part")["family"].nunique() == len(challenge.FAMILIES)).all()
    assert table["object"].nunique() == 200


@pytest.mark.parametrize("wrong", [0, 1, 40, 120])
def test_the_score_is_the_share_answered_correctly(task, wrong):
    _, labels = task.read("test")
    answers = labels.copy()
    answers[:wrong] = "none"
    found = task.score(lambda: Says(answers), "absolute")
    assert found["accuracy"] == pytest.approx(1 - wrong / len(labels))
    assert found["low"] <= found["accuracy"] <= found["high"]


def test_noise_is_the_same_for_everybody_and_another_in_each_part(task):
    clean, _ = task.read("train")
    first, again = (task.read("train", "absolute")[0] for _ in range(2))
    np.testing.assert_array_equal(first, again)
    assert np.std(first - clean) == pytest.approx(0.03, rel=0.02)
    n = len(task.read("test")[0])
    other = task.read("test", "absolute")[0] - task.read("test")[0]
    assert abs(np.corrcoef(other.ravel(), (first - clean)[:n].ravel())[0, 1]) < 0.02
    share = (task.read("test", "relative")[0] - task.read("test")[0]) / task.read("test")[0]
    assert np.std(share) == pytest.approx(0.1, rel=0.03)


def test_the_ceiling_is_not_passed(task):
    """Of tensors that differ by their family alone, both observers and a fair method find it."""
    found = task.score_known("absolute")
    assert (
        found["ceiling"]["accuracy"]
        == found["observer of the training touches"]["accuracy"]
        == 1
    )
    for make in (feeler.decoding.make_lda, KNeighborsClassifier):  # the latter of tables
        assert task.score(make, "absolute")["accuracy"] == 1


def test_touches_fit_the_antenna_and_the_first_are_the_same_for_any_number():
    few, many = challenge.make_trials(7), challenge.make_trials(60)
    assert [few[k] for k in range(7)] == [many[k] for k in range(7)]
    feeler.touch(feeler.presets.cockroach(), few[:2], duration=20.0)


def test_the_page_holds_a_method_that_enters(task, tmp_path):
    code = re.search(
        r"```python\n(.*?)```", (ROOT / "docs" / "challenge.md").read_text(), re.S
    )[1]
    assert len(code.strip().splitlines()) <= 20
    (tmp_path / "mine.py").write_text(code)
    make = runpy.run_path(str(tmp_path / "mine.py"))["make"]
    assert task.score(make, "weber")["accuracy"] > 0.9


def test_results_of_others_stay_and_a_method_replaces_its_own(tmp_path):
    path = tmp_path / "results.csv"
    row = {
        "noise": "absolute",
        "accuracy": 0.5,
        "low": 0.4,
        "high": 0.6,
        "version": 2,
        "by": "A",
    }
    challenge.write_results(path, [{"method": "a", **row}, {"method": "b, c", **row}])
    challenge.write_results(path, [{"method": "a", **row, "accuracy": 0.7}])
    table = pd.read_csv(path).set_index("method")
    assert table["accuracy"].to_dict() == {"b, c": 0.5, "a": 0.7}
    challenge.write_results(path, [{"method": "a", **row, "by": "B"}])
    assert pd.read_csv(path)["by"].tolist() == ["A", "A", "B"]
    path.write_text("x,y\n1,2\n")
    with pytest.raises(InvalidInput, match=r"has other columns than a results file: x, y\."):
        challenge.write_results(path, [{"method": "a", **row}])
    assert path.read_text() == "x,y\n1,2\n"


def test_other_touches_and_answers_of_other_lengths_are_refused(task):
    other = xr.Dataset({"angle": (("trial", "sensor", "time"), np.zeros((1, 2, 3)))})
    with pytest.raises(InvalidInput, match="not the task's touches; make them"):
        challenge.Task(other)
    few = xr.Dataset(
        {"angle": (("trial", "sensor", "time"), np.zeros((2, 2, 3)))},
        {"feature": ("trial", ["round-00", "flat-01"])},
    )
    with pytest.raises(
        InvalidInput, match=r"10,000 touches of 200 objects, got 2 touches of 2"
    ):
        challenge.Task(few)
    with pytest.raises(
        InvalidInput, match=r"a label for each of \d+ tensors, got shape \(3,\)"
    ):
        task.score(lambda: Says(np.array(["flat"] * 3)), "absolute")
    with pytest.raises(InvalidInput, match="noise must be one of absolute, relative, weber"):
        task.read("test", "loud")
