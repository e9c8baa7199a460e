"""Every example runs as it stands in the gallery, says something and leaves a picture."""

import runpy
from pathlib import Path

import pytest
from matplotlib.image import imread

EXAMPLES = sorted((Path(__file__).parents[2] / "examples").glob("*.py"))


def test_there_are_examples():
    assert len(EXAMPLES) >= 6


@pytest.mark.parametrize("path", EXAMPLES, ids=lambda path: path.stem)
def test_example_runs(path, tmp_path, capsys):
    runpy.run_path(str(path))["main"](tmp_path)
    picture = imread(tmp_path / f"{path.stem}.png")
    assert picture.std() > 0.02  # not an empty canvas
    assert capsys.readouterr().out.strip()
