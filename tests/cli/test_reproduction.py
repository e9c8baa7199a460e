"""Where the reproduction of the paper is found, and what is said where there is none."""

import subprocess
import sys
from pathlib import Path

import pytest

import feeler

ROOT = Path(__file__).parents[2]
ASKED = ("reproduce", "--scale", "huge")
REFUSED = "valid: smoke, quick, published, paper"


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
