"""The scored task: what it counts, and that a stranger's file of twenty lines enters it."""

import re
import runpy
from pathlib import Path

import numpy as np
import pytest
from scripts import load_script

ROOT = Path(__file__).parents[2]
task = load_script("benchmarks", "score")


class Says:
    """Answers what it is told to, whatever it is asked."""

    def __init__(self, answers):
        self.answers = answers

    def fit(self, tensors, labels):
        return self

    def predict(self, tensors):
        return self.answers


@pytest.mark.parametrize("wrong", [0, 1, 7, 12])
def test_the_score_is_the_share_of_tensors_named_right(wrong):
    labels = np.repeat(["a", "b", "c"], 8)
    answers = labels.copy()
    answers[:wrong] = "none"
    share, low, high = task.score(
        lambda: Says(answers), (None, None, None), (None, labels, None)
    )
    assert share == pytest.approx(1 - wrong / 24)
    assert low <= share <= high and (high - low > 0) == (wrong > 0)


def test_the_page_holds_a_method_that_enters(tmp_path):
    page = (ROOT / "docs" / "challenge.md").read_text()
    code = re.search(r"```python\n(.*?)```", page, re.DOTALL)[1]
    assert len(code.strip().splitlines()) <= 20
    (tmp_path / "mine.py").write_text(code)
    make = runpy.run_path(str(tmp_path / "mine.py"))["make"]
    rng = np.random.default_rng(0)
    means = np.array([1.0, -2.0, 4.0])[:, None, None] * np.ones((3, 5, 7))
    labels = np.tile(["a", "b", "c"], 4)
    tensors = means[np.tile([0, 1, 2], 4)] + 0.1 * rng.standard_normal((12, 5, 7))
    np.testing.assert_array_equal(make().fit(tensors, labels).predict(tensors), labels)
    assert f"version {task.VERSION} of the task" in page.lower()
    assert f"{task.NOISE.size:g} rad" in page and f"{task.EACH} touches of each class" in page
