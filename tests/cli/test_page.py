"""Help has what matters first, errors speak the language of the command line, and extras are asked
for before anything is computed.
"""

import html
import json
import re

import numpy as np
import pytest
import typer
from typer.testing import CliRunner

from feeler import errors
from feeler.antenna.files import load_antenna
from feeler.calibration import fit_traces, load_traces
from feeler.cli import app as door
from feeler.cli.app import app
from feeler.cli.options import list_options, say_in_shell
from feeler.errors import MissingDependencyError
from feeler.physics.contact import CONTACTS, describe_sink, get_contact, list_validity_warnings
from feeler.presets import PRESETS, cockroach
from tests.cli._command import run

GROUP = typer.main.get_command(door.app)


def list_verbs(group=GROUP, before=""):
    for name, verb in group.commands.items():
        if hasattr(verb, "commands"):
            yield from list_verbs(verb, f"{name} ")
        else:
            yield before + name, verb


@pytest.mark.parametrize(
    ("words", "message", "said"),
    [
        (["tracks"], "give frame_rate=.", "give --frame-rate."),
        (["tracks"], "(plane=)", "(--plane)"),
        (["tracks"], "give scale=1.5 or scale=", "give --scale 1.5 or --scale"),
        (["robot", "check"], "say gaps='bridge'.", "say --gaps bridge."),
        (["export"], "control=True is for strips", "--control is for strips"),
        (["robot", "check"], "give time_unit=.", "give --time-unit."),
        (["robot", "check"], "give n_channels=.", "feeler robot new --hinges N writes."),
        (["wall"], "Use its planar twin, antenna.flatten().", "Name an antenna in the plane."),
        (["info"], "give frame_rate=.", "give frame_rate=."),
        (["touch"], "Trial.location must be ≤ 1, got 2.", "--location must be ≤ 1, got 2."),
        (["touch"], "Ball.radius must be > 0 mm", "--size must be > 0 mm"),
        (["wall"], "Posture.inter_antennal_angle must be", "--angle must be"),
        (["tradeoff"], "Ball.radius must be > 0 mm", "Ball.radius must be > 0 mm"),
        (["touch"], "a.toml: Ball.radius must be", "a.toml: Ball.radius must be"),
        (["tracks"], "x --frame-rate=3 y_frame_rate=2", "x --frame-rate=3 y_frame_rate=2"),
    ],
)
def test_arguments_become_options_of_the_verb(words, message, said):
    assert say_in_shell(message, list_options(GROUP, words)).endswith(said)


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["touch", "--speed", "fast"], "'--speed': give a number, got 'fast'"),
        (["touch", "--speed=fast"], "'--speed': give a number, got 'fast'"),
        (
            ["tradeoff", "--out", "o", "--sets", "2.5"],
            "'--sets': give a whole number, got '2.5'",
        ),
        (["reproduce", "--seed", "-1"], "'--seed': give at least 0, got '-1'"),
    ],
    ids=lambda one: one[-1] if isinstance(one, list) else "",
)
def test_a_value_that_is_none_is_refused_with_what_was_got(words, said):
    assert said in CliRunner().invoke(door.app, words).output


@pytest.mark.parametrize(("words", "verb"), [*list_verbs()])
def test_every_verb_has_a_help_that_shows_all_of_its_options(words, verb):
    said = CliRunner().invoke(door.app, [*words.split(), "--help"], catch_exceptions=False)
    shown = [p.opts[-1] for p in verb.params if p.opts[0].startswith("-") and not p.hidden]
    assert said.exit_code == 0 and [name for name in shown if name not in said.output] == []


def test_extras_are_asked_for_before_anything_is_computed(monkeypatch, tmp_path):
    from feeler.design import search

    def refuse(*_, **__):
        pytest.fail("something was computed")

    monkeypatch.setattr(errors, "find_spec", lambda name: None)
    monkeypatch.setattr(search, "_check_task", refuse)
    plan = str(tmp_path / "p.toml")
    assert CliRunner().invoke(door.app, ["design", plan, "--new"]).exit_code == 0
    found = CliRunner().invoke(door.app, ["design", plan, "--out", str(tmp_path)])
    assert isinstance(found.exception, MissingDependencyError)
    assert "pip install 'feeler[design]'" in str(found.exception)
    monkeypatch.setattr("feeler.robot.make_decoder", refuse)
    found = CliRunner().invoke(door.app, ["robot", "stream", "/dev/none", "--serial"])
    assert "pip install 'feeler[robot]'" in str(found.exception)


@pytest.mark.long
@pytest.mark.parametrize(
    ("command", "page"), [("touch", "touch.html"), ("spikes", "spikes.html")]
)
def test_a_page_says_what_the_terminal_warns_of_and_the_advice_can_be_typed(
    command, page, tmp_path
):
    asked = [command, "--antenna", "cricket", "--out", "a"]
    quick = ["--no-movie"] if command == "touch" else []
    done = run(*asked, *quick, "--contact", "smooth:0.2", cwd=tmp_path)
    (warned,) = [line for line in done.stderr.splitlines() if "sank in by" in line]
    words = warned.removeprefix("feeler: warning: ")
    assert words in html.unescape((tmp_path / "a" / page).read_text())
    advised = re.search(r"Use (--contact \S+) ", words)[1].split()
    for how in (advised, []):
        done = run(*asked[:-1], "_".join(["b", *how]), *quick, *how, cwd=tmp_path)
        assert done.returncode == 0 and "sank in by" not in done.stderr
    assert "contact: time constant 0.0333 ms in place of 0.2 ms" in done.stdout
    shown = html.unescape((tmp_path / "b" / page).read_text())
    assert "Warning:" not in shown and "time constant 0.0333 ms in place of 0.2 ms" in shown


MUCH_TOO_FAST = "cricket", 30.0, 0.9
"""An antenna, and speed [mm/ms] and depth [radii] that bring every advice of a contact."""


@pytest.mark.parametrize(("name", "verb"), [*list_verbs()], ids=lambda one: str(one)[:20])
def test_advice_of_a_contact_names_options_that_there_are(name, verb):
    antenna, speed, sink = MUCH_TOO_FAST
    antenna = PRESETS[antenna]()
    contact = get_contact(None, antenna)
    said = [
        *list_validity_warnings(antenna, contact, speed, 0.05),
        describe_sink(sink, contact),
        describe_sink(sink, contact, fixed=True),
        describe_sink(sink, CONTACTS["smooth"]),
    ]
    options = list_options(GROUP, name.split())
    for words in said:
        shown = say_in_shell(words, options)
        assert not re.search(r"contact='|timestep=|Contact of", shown), shown
        assert "contact smooth:" in shown or "contact hard:" in shown, shown
        for option in re.findall(r"(feeler touch )?(--[a-z-]+)", shown):
            assert option[0] or option[1] in options.values(), (option, shown)


def run_pages(*words):
    found = CliRunner().invoke(app, [str(word) for word in words])
    assert found.exit_code == 0, found.output
    return found.output


def read_page(path):
    page = path.read_text(encoding="utf-8")
    assert page.startswith("<!doctype html>")
    asked = re.findall(r'(?:src|href)="(?!data:|#)([^"]+)"', page)
    assert all(link.startswith("https://doi.org/") for link in asked), asked
    assert "data:image/" in page
    return re.sub(r"data:[^\"]+", "", page)


@pytest.mark.long
def test_the_fitted_antenna_is_kept_and_its_numbers_stand_in_the_page(tmp_path):
    first = load_traces("synthetic_step")
    rows = [f"{t},{x}" for t, x in zip(first.time, first.displacement[0], strict=True)]
    (tmp_path / "trace.csv").write_text("\n".join(["time_ms,first", *rows]) + "\n")
    calibrated = tmp_path / "out"
    run_pages(
        "calibrate",
        "--data",
        tmp_path / "trace.csv",
        "--out",
        calibrated,
    )
    expected = fit_traces(load_traces(tmp_path / "trace.csv"), cockroach())
    antenna, plain = load_antenna(calibrated / "antenna.toml"), cockroach()
    np.testing.assert_allclose(antenna.stiffness / plain.stiffness, expected.p[0], rtol=1e-12)
    np.testing.assert_allclose(antenna.damping / plain.damping, expected.p[1], rtol=1e-12)
    page = read_page(calibrated / "calibration.html")
    for value in (*expected.p, *expected.low, *expected.high):
        assert f"{value:.4g}" in page
    kept = json.loads((calibrated / "calibration.json").read_text())
    np.testing.assert_allclose(kept["p"], expected.p)
