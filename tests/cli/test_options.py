"""What is said on the command line reaches the functions that do the work, each option its own."""

import importlib
import re

import numpy as np
import pytest
from awkward_touches import make_set
from typer.main import get_command
from typer.testing import CliRunner

import feeler
from feeler.cli.app import app
from feeler.comparison import EFFORTS
from feeler.errors import InvalidInput

HEARD = "this is as far as it goes"
SHAPE = ("--feature", "box", "--size", 2.2, "--location", 0.83, "--speed", 0.37)
TRIAL = {"location": 0.83, "speed": 0.37}
NEAR = ("--approach", 81, "--side", "right", "--friction", 0.4)
RUN = ("--duration", 33, "--timestep", 0.05, "--engine", "chain", "--contact", "hard")
WORK = {"duration": 33.0, "timestep": 0.05, "engine": "chain", "contact": "hard"}
FILM = ("--frame-rate", 123, "--origin", "bottom-left", "--min-likelihood", 0.3)
FILMED = {"frame_rate": 123.0, "origin": "bottom-left", "min_likelihood": 0.3}
HOW = ("--length", 33, "--cutoff", 4.5, "--max-gap", 7, "--tips", "a,b", "--body", "c,d")
MEASURED = {"length": 33.0, "cutoff": pytest.approx(0.0045), "max_gap": 7}
NWB = ("--session-start", "2026-05-01T09:00:00+02:00", "--subject", "c 17")


def hear(monkeypatch, place, *words):
    """What a function is told by a command line that ends there: its arguments by position and by
    name.
    """
    module, name = place.rsplit(".", 1)
    told = {}

    def listen(*given, **named):
        told.update(enumerate(given), **named)
        raise InvalidInput(HEARD)

    monkeypatch.setattr(importlib.import_module(module), name, listen)
    result = CliRunner().invoke(app, [str(word) for word in words])
    assert HEARD in str(result.exception), result.output
    return told


@pytest.mark.parametrize("way", ["shown", "stored"])
def test_a_touch_is_the_one_that_was_asked_for(monkeypatch, tmp_path, way):
    store = ("--store", tmp_path / "a.zarr", "--seed", 7) if way == "stored" else ()
    words = (
        "touch",
        "--antenna",
        "linear",
        *SHAPE,
        *NEAR,
        *RUN,
        "--out",
        tmp_path / "o",
        *store,
    )
    told = hear(monkeypatch, "feeler.experiments.tactile.touch", *words)
    trial = told[1] if way == "shown" else told[1][0]
    expected = {**TRIAL, "approach": 81.0, "side": "right", "friction": 0.4}
    assert {name: getattr(trial, name) for name in expected} == expected
    assert trial.feature == feeler.Box(half_width=2.2, half_height=2.2)
    assert told[0] == feeler.presets.make_preset("linear")
    kept = {"seed": 7, "store": tmp_path / "a.zarr"} if store else {}
    assert {name: told[name] for name in (*WORK, *kept)} == {**WORK, **kept}


def test_an_outline_is_touched_where_its_file_is_named(monkeypatch, tmp_path):
    drawn = tmp_path / "square.csv"
    drawn.write_text("x_mm,y_mm\n-2,-2\n2,-2\n2,2\n-2,2\n")
    place, words = "feeler.experiments.tactile.touch", ("touch", "--out", tmp_path / "out")
    for more in ((), ("--feature", "outline"), ("--object", "outline")):
        told = hear(monkeypatch, place, *words, "--outline", drawn, *more)
        assert told[1].feature.kind == "outline"
    refused = CliRunner().invoke(
        app, [*map(str, words), "--outline", str(drawn), "--feature", "box"]
    )
    assert refused.exit_code and "needs --feature outline, got --feature box" in str(
        refused.exception or refused.output
    )


def test_the_touch_of_spikes_is_the_one_that_was_asked_for(monkeypatch, tmp_path):
    words = ("spikes", "--antenna", "linear", *SHAPE, "--out", tmp_path / "o")
    told = hear(monkeypatch, "feeler.experiments.tactile.touch", *words)
    assert {name: getattr(told[1], name) for name in TRIAL} == TRIAL
    assert told[0] == feeler.presets.make_preset("linear")
    assert told[1].feature == feeler.Box(half_width=2.2, half_height=2.2)


def test_an_exported_scene_is_the_one_that_was_asked_for(monkeypatch, tmp_path):
    words = ("export", tmp_path / "a.xml", "--antenna", "linear", *SHAPE, "--control")
    told = hear(monkeypatch, "feeler.physics.spec.write_mjcf", *words)
    assert {name: getattr(told[1], name) for name in TRIAL} == TRIAL
    assert (told[0], told["control"]) == (feeler.presets.make_preset("linear"), True)
    assert told[1].feature == feeler.Box(half_width=2.2, half_height=2.2)


def test_an_antenna_is_exported_alone_as_asked(tmp_path):
    words = ["export", str(tmp_path / "a.xml"), "--antenna", "robot", "--servo"]
    done = CliRunner().invoke(app, [*words, "--body", "--units", "si"], catch_exceptions=False)
    assert done.exit_code == 0 and "base_turn" in (tmp_path / "a.xml").read_text()
    own, default = re.findall(r"([\d.e-]+) rad with", done.output)[:2]
    assert float(own) < 1e-5 < float(default)
    with pytest.raises(InvalidInput, match="--servo goes with --body"):
        CliRunner().invoke(app, words, catch_exceptions=False)


def test_tracks_are_read_and_measured_as_asked(monkeypatch, tmp_path):
    (tmp_path / "a.csv").write_text("a_x,a_y\n1,2\n")
    words = ("tracks", tmp_path / "a.csv", *FILM, *HOW)
    told = hear(monkeypatch, "feeler.tracking.load_tracks", *words)
    assert {name: told[name] for name in FILMED} == FILMED
    names = dict.fromkeys("abcd", (0.0, 1.0))
    places = np.array([[(k, k**2) for k, _ in enumerate(names)]] * 5, dtype=float)
    tracks = feeler.tracking.Tracks(position=places, landmarks=tuple(names), interval=8.0)
    monkeypatch.setattr("feeler.tracking.load_tracks", lambda *_, **__: tracks)
    told = hear(monkeypatch, "feeler.tracking.measure_exploration", *words)
    assert {name: told[name] for name in MEASURED} == MEASURED
    asked = {"tips": ("a", "b"), "bases": ("c", "c"), "head": "c", "abdomen": "d"}
    assert told["landmarks"] == asked
    told = hear(
        monkeypatch, "feeler.tracking.save_poses", *words, "--out", tmp_path / "o", *NWB
    )
    assert (told["subject"], told["session_start"]) == ("c 17", NWB[1])
    assert told["edges"] == [("c", "a"), ("c", "b"), ("c", "d")]


@pytest.mark.further
@pytest.mark.parametrize(
    ("verb", "place", "at"),
    [("info", "tensors.formats.describe_file", 1), ("convert", "tensors.formats.load", 1)],
)
def test_as_much_is_read_as_was_allowed(monkeypatch, tmp_path, verb, place, at):
    make_set().to_netcdf(tmp_path / "a.nc", engine="h5netcdf")
    target = [tmp_path / "b.mat"] if verb == "convert" else []
    words = (verb, tmp_path / "a.nc", *target, "--max-gib", 0.25)
    module, name = f"feeler.{place}".rsplit(".", 1)
    told = {}

    def listen(*given, **_):
        told.update(enumerate(given))
        raise InvalidInput(HEARD)

    monkeypatch.setattr(importlib.import_module(module), name, listen)
    CliRunner().invoke(app, [str(word) for word in words])
    assert told[at].max_bytes == 2**28


@pytest.mark.parametrize("name", ["scene.stl", "scene"])
def test_a_scene_is_written_as_xml_and_not_under_another_name(name, tmp_path):
    result = CliRunner().invoke(app, ["export", str(tmp_path / name)])
    assert isinstance(result.exception, InvalidInput)
    assert "Name it scene.xml" in str(result.exception) and not (tmp_path / name).exists()


def test_antennae_are_compared_as_asked(monkeypatch, tmp_path):
    """Each option where it works: the touches, the encoder, who reads and by which seed."""
    touched = []

    def touch(antenna, trials, *, seed):
        touched.append(({trial.speed for trial in trials}, seed))
        return antenna, 33.0

    monkeypatch.setattr("feeler.comparison.touch_whole", touch)
    words = (
        "compare",
        "linear",
        "uniform",
        "--speed",
        0.37,
        "--seed",
        7,
        "--classifier",
        "svm",
    )
    place = "feeler.comparison.compare_antennas"
    told = hear(monkeypatch, place, *words, "--scale", "smoke", "--out", tmp_path / "a.html")
    assert touched == [({0.37}, 7)] * 2
    assert [*told[0]] == ["linear", "uniform"] and told[1].random_state == 7
    assert (told["classifier"], told["random_state"]) == ("svm", 7)
    assert told["plan"] == EFFORTS["smoke"].plan


def test_the_turn_of_a_wall_goes_the_way_that_its_help_says(monkeypatch):
    """Positive towards the body, which stands to the left of a wall that is run along."""
    told = hear(monkeypatch, "feeler.wall.follow", "follow", "--turn", 20, "--oracle")
    before, after = np.diff(told[1].corners, axis=0)
    body = feeler.wall.Course(lengths=(50.0,), turns=()).measure(np.array([[-1.0, 20.0]]))
    assert body[0] == pytest.approx(1.0) and before[0] == 0.0
    (option,) = [p for p in get_command(app).commands["follow"].params if p.name == "turn"]
    ways = {"towards the body": after[0] < 0, "away from the body": after[0] > 0}
    (way,) = [way for way in ways if f"positive {way}" in option.help]
    assert ways[way]
