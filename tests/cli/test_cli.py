"""The command line: one clear message and exit code 2, never a traceback."""

import io
import re
import subprocess
import sys
from pathlib import Path

import pytest

import feeler
from feeler.cli.app import main
from feeler.progress import ProgressBar

from ._command import run


@pytest.mark.further
@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("touch", "--location", "1.5"), "fraction of the length"),
        (("touch", "--feature", "cube"), "valid: ball, box, triangle"),
        (("touch", "--antenna", "spider"), "unknown antenna 'spider'"),
        (("touch", "--contact", "soft"), "valid: smooth, even, hard"),
        (("touch", "--engine", "ode"), "valid: chain-consistent, chain, mujoco"),
        (("reproduce", "--scale", "huge"), "smoke, quick, published, paper"),
        (("reproduce", "--set", "colour=2"), "stiffness, damping"),
        (("reproduce", "--timestep", "5"), "--timestep 1"),
        (("reproduce", "--timestep", "0.5"), "use at most 0.1 ms"),
        (("reproduce", "--timestep", "0"), "timestep must be finite and > 0"),
        (("reproduce", "--seed", "-1"), "give at least 0, got"),
        (("calibrate", "--seed", "-1"), "give at least 0, got"),
        (("touch", "--out", "/proc/nowhere"), "check the path"),
        (("touch", "--timestep", "0"), "timestep must be finite and > 0"),
        (
            ("compare", "linear", "uniform", "--scale", "foo"),
            "unknown scale 'foo'; valid: smoke, quick, published, paper",
        ),
        (("compare", "linear", "uniform", "--out", "/proc/x.html"), "check the path"),
        (("compare", "linear"), "at least two different antennas"),
        (("calibrate", "releases.csv"), "Options say what it is: --data, "),
        (["convert", "absent.nc", "out.nwb"], "cannot read absent.nc: no such file."),
        (["design", "absent.toml"], "feeler: cannot read absent.toml: no such file"),
        (
            ["touch", "--speed", "x"],
            "feeler: Invalid value for '--speed': give a number, got 'x'",
        ),
        (["touch", "--weight", "2"], "feeler: No such option: --weight"),
        (["robot", "dance"], "feeler: No such command 'dance'"),
    ],
)
def test_bad_input_is_one_message(tmp_path, arguments, message):
    result = run(*arguments, cwd=tmp_path)
    assert result.returncode == 2
    assert message in result.stderr
    assert result.stdout == ""  # nothing was begun
    assert "Traceback" not in result.stderr and "Error:" not in result.stderr
    assert not list(tmp_path.rglob("*.nc"))


@pytest.mark.long
def test_a_warning_speaks_of_options_that_the_verb_has(tmp_path):
    small = ("--size", "0.3", "--location", "0.97", "--speed", "2.5", "--duration", "40")
    said = run("touch", *small, "--no-movie", cwd=tmp_path)
    advice = re.search(r"--contact (smooth:[\d.e-]+)", said.stderr)
    assert said.returncode == 0 and advice and "contact=" not in said.stderr
    soft = feeler.load(tmp_path / "out" / "touch" / "tensor.nc")
    said = run("touch", *small, "--no-movie", "--contact", advice[1], cwd=tmp_path)
    assert "--contact" not in said.stderr
    hard = feeler.load(tmp_path / "out" / "touch" / "tensor.nc")
    assert said.returncode == 0 and float(hard["sink"].max()) < float(soft["sink"].max())


@pytest.mark.long
@pytest.mark.parametrize(
    ("asked", "more"),
    [
        ((), set()),
        (("--movie", "--vector"), {"tensor.svg", "tensor.pdf", "movie.mp4", "movie.jpg"}),
    ],
)
def test_touch_writes_what_it_is_asked_for(tmp_path, asked, more):
    result = run("touch", "--duration", "30", "--timestep", "0.05", *asked, cwd=tmp_path)
    assert result.returncode == 0, result.stderr
    names = {path.name for path in (tmp_path / "out/touch").iterdir()}
    assert names == {"touch.html", "tensor.nc", "tensor.png", *more}
    assert {f"tensor{end}" in result.stdout for end in (".svg", ".pdf")} == {bool(more)}


def test_ctrl_c_in_a_verb_that_keeps_nothing_is_answered_in_words(monkeypatch, capsys):
    def interrupt(*_args, **_options):
        raise KeyboardInterrupt

    monkeypatch.setattr("feeler.wall.approach", interrupt)
    monkeypatch.setattr("feeler.cli.app._leave", lambda: None)  # which would end the tests too
    monkeypatch.setattr("sys.argv", ["feeler", "wall", "exponential"])
    with pytest.raises(SystemExit, match="130"):
        main()
    assert "feeler: interrupted; whatever was finished" in capsys.readouterr().err


class Terminal(io.StringIO):
    def isatty(self):
        return True


def test_a_bar_appears_once_patience_is_over_and_one_at_a_time():
    now = iter([0.0, 1.0, 1.0, 4.9, 4.9, 6.0, 6.0, 9.0, 9.0])
    screen, other = Terminal(), Terminal()
    with ProgressBar("touches", patience=5.0, stream=screen, clock=lambda: next(now)) as bar:
        bar(1, 4)
        bar(2, 4)
        assert screen.getvalue() == ""
        bar(3, 4)
        with ProgressBar("within", stream=other) as second:
            second(1, 2)
        bar(4, 4)
    assert "touches" in screen.getvalue() and "4/4" in screen.getvalue()
    assert other.getvalue() == ""
    with ProgressBar("after", stream=other) as third:
        third(2, 2)
    assert "after" in other.getvalue()


ROOT = Path(__file__).parents[2]
ASKED = ("reproduce", "--scale", "huge")
REFUSED = "valid: smoke, quick, published, paper"


@pytest.mark.long
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
    with pytest.warns(
        DeprecationWarning, match="write `from feeler.presets import paper_trials`"
    ):
        touches = feeler.paper.trials(speeds=(0.3,))
    assert touches == feeler.presets.paper_trials(speeds=(0.3,))
