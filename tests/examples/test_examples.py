"""Every example runs as it stands in the gallery, says something and leaves a picture."""

import runpy
from pathlib import Path

import pytest
from matplotlib.image import imread

EXAMPLES = sorted((Path(__file__).parents[2] / "examples").glob("*.py"))
# the others take seconds each
QUICK = ("touch_a_ball",)

LEAST = {
    "train_a_network": 0.5
}  # right answers of 120; chance is a third, with a standard error of 0.04


def check_whiskers(found):
    """Hartmann et al. 2003 for the modes; beam theory for modes and moments."""
    assert 27 <= found["slowest"] < found["fastest"] <= 260  # Hz
    assert max(abs(found["cylinder"]), abs(found["cone"])) <= 0.1  # %
    assert found["moment"] <= 1  # %
    assert found["slip_cone"] < 0.5 * found["slip_cylinder"]
    assert found["slip_off"] <= 12  # %


def check_place(found):
    """The moment at the base names the place of a peg within its radius of 0.1 mm."""
    assert found["error"] <= 0.1  # mm


CHECKS = {"rat_whiskers": check_whiskers, "where_was_i_touched": check_place}


def test_there_are_examples():
    assert len(EXAMPLES) >= 6


@pytest.mark.parametrize(
    "path",
    [
        pytest.param(path, id=path.stem, marks=() if path.stem in QUICK else pytest.mark.long)
        for path in EXAMPLES
    ],
)
def test_example_runs(path, tmp_path, capsys):
    found = runpy.run_path(str(path))["main"](tmp_path)
    assert path.stem not in LEAST or found > LEAST[path.stem]
    CHECKS.get(path.stem, lambda found: None)(found)
    picture = imread(tmp_path / f"{path.stem}.png")
    assert picture.std() > 0.02  # not an empty canvas
    assert capsys.readouterr().out.strip()
