"""Where the reproduction of the paper is found, and what is said where there is none."""

import subprocess
import sys
from pathlib import Path

import pytest

import feeler
from feeler.cli.reproduce import reproduce
from feeler.errors import MissingDependencyError

ROOT = Path(__file__).parents[2]
ASKED = ("reproduce", "--scale", "huge")
REFUSED = "valid: smoke, quick, published, paper"


def test_an_installed_feeler_says_where_the_reproduction_is(monkeypatch, tmp_path):
    monkeypatch.setattr(feeler, "__file__", str(tmp_path / "site" / "feeler" / "__init__.py"))
    (tmp_path / "paper").mkdir()  # a folder of this name that is somebody else's
    monkeypatch.chdir(tmp_path)
    with pytest.raises(
        MissingDependencyError, match="not installed with feeler: clone its repository"
    ):
        reproduce()


@pytest.mark.parametrize(
    ("command", "inside"),
    [(("feeler", *ASKED), True), (("feeler", *ASKED), False), (("paper", *ASKED[1:]), True)],
)
def test_it_is_found_from_the_checkout_and_from_elsewhere(command, inside, tmp_path):
    done = subprocess.run(
        [sys.executable, "-m", *command, "--out", str(tmp_path / "out")],
        cwd=ROOT if inside else tmp_path,
        env={"PYTHONPATH": str(ROOT / "src"), "PATH": "", "HOME": str(tmp_path)},
        capture_output=True,
        text=True,
    )
    assert done.returncode == 2 and REFUSED in done.stderr


def test_the_old_name_of_the_touches_of_the_paper_still_works_and_says_so():
    with pytest.warns(DeprecationWarning, match=r"now feeler\.presets\.paper_trials\(\)"):
        touches = feeler.paper.trials(speeds=(0.3,))
    assert touches == feeler.presets.paper_trials(speeds=(0.3,))
