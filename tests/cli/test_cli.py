"""The command line: one clear message and exit code 2, never a traceback."""

import re

import pytest

import feeler
from feeler.cli.app import main

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
        (["convert", "absent.nc", "out.nwb"], "cannot read absent.nc: no such file."),
        (["design", "absent.toml"], "feeler: cannot read absent.toml: no such file"),
    ],
)
def test_bad_input_is_one_message(tmp_path, arguments, message):
    result = run(*arguments, cwd=tmp_path)
    assert result.returncode == 2
    assert message in result.stderr
    assert result.stdout == ""  # nothing was begun
    assert "Traceback" not in result.stderr
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


def test_export_opens_in_mujoco(tmp_path):
    import mujoco

    result = run("export", "scene.xml", "--feature", "triangle", "--size", "2", cwd=tmp_path)
    assert result.returncode == 0, result.stderr
    model = mujoco.MjModel.from_xml_path(str(tmp_path / "scene.xml"))
    assert model.nq == 140 + 3  # hinges; two directions and the turn of the object
    assert "g, mm, ms" in (tmp_path / "scene.xml").read_text()


def test_ctrl_c_in_a_verb_that_keeps_nothing_is_answered_in_words(monkeypatch, capsys):
    def interrupt(*_args, **_options):
        raise KeyboardInterrupt

    monkeypatch.setattr("feeler.wall.approach", interrupt)
    monkeypatch.setattr("feeler.cli.app._leave", lambda: None)  # which would end the tests too
    monkeypatch.setattr("sys.argv", ["feeler", "wall", "exponential"])
    with pytest.raises(SystemExit, match="130"):
        main()
    assert "feeler: interrupted; whatever was finished" in capsys.readouterr().err
