"""Every example runs as it stands in the gallery, says something and leaves a picture."""

import runpy
from pathlib import Path

import pytest
from matplotlib.image import imread

EXAMPLES = sorted((Path(__file__).parents[2] / "examples").glob("*.py"))


LEAST = {
    "train_a_network": 0.5
}  # right answers of 120; chance is a third, with a standard error of 0.04


def test_there_are_examples():
    assert len(EXAMPLES) >= 6


@pytest.mark.parametrize("path", EXAMPLES, ids=lambda path: path.stem)
def test_example_runs(path, tmp_path, capsys):
    found = runpy.run_path(str(path))["main"](tmp_path)
    assert path.stem not in LEAST or found > LEAST[path.stem]
    picture = imread(tmp_path / f"{path.stem}.png")
    assert picture.std() > 0.02  # not an empty canvas
    assert capsys.readouterr().out.strip()
