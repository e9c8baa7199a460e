"""Every example runs, says something and leaves a picture; one is asked for less than what the gallery shows."""

import runpy
from pathlib import Path

import pytest
from matplotlib.image import imread

EXAMPLES = sorted((Path(__file__).parents[2] / "examples").glob("*.py"))


SHORT = {"train_a_network": (240, 15)}  # touches and epochs; as it stands it takes a minute
LEAST = {"train_a_network": 0.5}  # right answers of 48; chance is a third, with a standard error of 0.07


def test_there_are_examples():
    assert len(EXAMPLES) >= 6


@pytest.mark.parametrize("path", EXAMPLES, ids=lambda path: path.stem)
def test_example_runs(path, tmp_path, capsys):
    found = runpy.run_path(str(path))["main"](tmp_path, *SHORT.get(path.stem, ()))
    assert path.stem not in LEAST or found > LEAST[path.stem]
    picture = imread(tmp_path / f"{path.stem}.png")
    assert picture.std() > 0.02  # not an empty canvas
    assert capsys.readouterr().out.strip()
