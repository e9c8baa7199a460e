"""Pages with planted numbers: every table, picture and caption says them, in the unit that stands
beside them.
"""

import json
import re
from types import SimpleNamespace

import numpy as np
import pytest
from calibration._fits import make_fit
from matplotlib.colors import to_hex
from matplotlib.figure import Figure

from feeler import calibration, tradeoff
from feeler.active import contests
from feeler.antenna.files import load_antenna
from feeler.calibration.hinges import Band
from feeler.cli import calibrate, robot_pages, tracks
from feeler.cli.app import app
from feeler.cli.design import _report, _Watcher
from feeler.cli.wall import _save as save_wall
from feeler.design import page as design_page
from feeler.physics.engine import get_engine
from feeler.plotting.movie import SLOWER
from feeler.plotting.results import Shapes, plot_shapes
from feeler.presets import cockroach
from feeler.report import Section
from feeler.robot import Recording
from feeler.robot.classify import Answer

from .test_printed import read, run


@pytest.fixture
def figures(monkeypatch):
    """What a page would draw, by the figure's name."""
    drawn = {}

    def draw(_, name, caption, draw, **__):
        draw(figure := Figure())
        drawn[name] = (caption, figure.axes)

    monkeypatch.setattr(Section, "figure", draw)
    return drawn


def read_words(path):
    body = re.sub(
        "<(style|script).*?</(style|script)>",
        " ",
        path.read_text(encoding="utf-8"),
        flags=re.DOTALL,
    )
    return " ".join(re.sub("<[^>]+>", " ", body).split())


def make_recording(n=2, samples=30):
    angle = np.random.default_rng(n).normal(0, 0.1, (n, samples))
    return Recording(
        time=2.0 * np.arange(samples), values=angle, source="robot", history=("resampled",)
    )


def test_recordings_are_listed_with_channels_and_milliseconds(figures, tmp_path):
    one, other = make_recording(2), make_recording(3, 50)
    robot_pages.write_recordings(tmp_path, ["a.csv", "b.csv"], [one, other])
    words = read_words(tmp_path / "robot.html")
    assert (
        "file channels duration [ms] source found and mended a.csv 2 58 robot resampled b.csv 3 98"
        " robot" in words
    )
    _, axes = figures["robot"]
    first, second, *bars = axes
    assert second.get_xlabel() == "time [ms]" and first.get_ylabel() == "angle [°]"
    assert [bar.get_ylabel() for bar in bars] == ["channel", "channel"]
    for ax, recording in zip((first, second), (one, other), strict=True):
        for line, values in zip(ax.lines, recording.values, strict=True):
            np.testing.assert_allclose(line.get_data(), [recording.time, 180 / np.pi * values])


def test_answers_are_shown_with_their_probability_and_their_runner_up(figures, tmp_path):
    fields = {
        "known": True,
        "probability": 0.8125,
        "runner_up": ("box", 0.6, 0.135),
        "runner_up_probability": 0.13,
    }
    answer = Answer(label=("ball", 0.9, 0.27), truth={"feature": "box"}, **fields)
    aligned = np.random.default_rng(0).normal(0, 0.2, (1, 4, 20))
    robot_pages.write_answers(tmp_path, [{"file": "a.csv"}], [answer], aligned)
    words = read_words(tmp_path / "robot.html")
    assert re.search(
        r"a\.csv ball at 0\.9 .* 0\.27 m/s 0\.8125 box at 0\.6 .* 0\.135 m/s \(13%\) the notes say"
        r" feature box wrong: feature",
        words,
    )
    _, (panel, bar) = figures["robot"]
    np.testing.assert_allclose(panel.images[0].get_array(), np.degrees(aligned[0]))
    assert bar.get_ylabel() == "angle [°]"
    top = np.degrees(np.abs(aligned).max())
    assert panel.images[0].get_clim() == pytest.approx((-top, top))
    assert panel.images[0].get_extent() == [-0.5, 19.5, 0.5, 4.5]  # channels count from 1


def test_a_touch_like_none_that_was_learned_is_called_so_on_the_page_too(figures, tmp_path):
    fields = {
        "known": True,
        "probability": 0.8,
        "runner_up": None,
        "runner_up_probability": 0.0,
    }
    answer = Answer(label=("ball", 0.9, 0.27), truth={}, strangeness=7.877, **fields)
    robot_pages.write_answers(tmp_path, [{"file": "a.csv"}], [answer], np.ones((1, 2, 5)))
    words = read_words(tmp_path / "robot.html")
    assert "a.csv unlike any touch known (7.88 × the limit); nearest: ball at 0.9" in words
    assert "1 recording." in words


def test_a_released_tip_is_drawn_in_millimetres_over_milliseconds(figures, tmp_path):
    ring = SimpleNamespace(frequency=0.0044, damping_ratio=0.024, r_squared=0.991)
    factors = {
        "stiffness_factor": 1.2,
        "damping_factor": 2.1,
        "error": 0.003,
        "n_evaluations": 9,
    }
    tips = np.random.default_rng(0).normal(size=(2, 30))
    robot_pages.write_fit(
        tmp_path, make_recording(), SimpleNamespace(target=ring, reached=ring, **factors), tips
    )
    _, (ax,) = figures["robot"]
    assert (ax.get_xlabel(), ax.get_ylabel()) == (
        "time since the release [ms]",
        "tip off its rest [mm]",
    )
    for line, tip in zip(ax.lines, tips, strict=True):
        np.testing.assert_array_equal(line.get_data(), [2.0 * np.arange(30), tip])
    assert "recording 4.400 0.0240 99.1%" in read_words(tmp_path / "robot.html")


def test_a_stream_ends_with_its_answer_in_per_cent(figures, tmp_path):
    classes = [("ball", 0.9, 0.27), ("box", 0.6, 0.27)]
    beliefs = np.array([[0.5, 0.5], [0.3, 0.7], [0.1, 0.9]])
    kept = [
        (
            4.0 * k,
            np.array([0.1, -0.2]) * k,
            SimpleNamespace(posterior=b, state="known", label=classes[1], probability=b[1]),
        )
        for k, b in enumerate(beliefs)
    ]
    robot_pages.write_stream(tmp_path, classes, kept)
    assert re.search(
        r"At the end: box at 0\.6 .*, 90%, known", read_words(tmp_path / "robot.html")
    )
    _, (above, below, _) = figures["robot"]
    np.testing.assert_allclose(
        above.lines[1].get_data(), [[0, 4, 8], np.degrees([0, -0.2, -0.4])]
    )
    assert below.get_xlabel() == "time [ms]"
    np.testing.assert_array_equal(
        below.lines[0].get_data(), [[0, 4, 8], beliefs[:, 1]]
    )  # the most probable first


def test_fitted_traces_and_profiles_are_drawn_over_milliseconds_and_in_their_units():
    traces = calibration.load_traces("synthetic_step")
    result = SimpleNamespace(simulated=traces.displacement / traces.displacement[:, :1] * 0.5)
    calibrate._plot(figure := Figure(), traces, result)
    (ax,) = figure.axes
    assert (ax.get_xlabel(), ax.get_ylabel()) == (
        "time since release [ms]",
        "share of the first displacement",
    )
    for recorded, fitted, row in zip(
        ax.lines[::2], ax.lines[1::2], traces.displacement, strict=True
    ):
        np.testing.assert_allclose(recorded.get_data(), [traces.time, row / row[0]])
        np.testing.assert_allclose(fitted.get_data(), [traces.time, row / row[0] / 2])
    middle = np.array([[1.0, 2.0], [30.0, 40.0]])
    band = Band(place=np.array([0.2, 0.8]), low=middle / 2, middle=middle, high=3 * middle)
    calibrate._plot_band(
        figure := Figure(),
        band,
        SimpleNamespace(stiffness=middle[0] + 5, damping=middle[1] + 5),
    )
    labels = ["stiffness [N·mm/rad]", "damping [N·mm·ms/rad]"]
    assert [ax.get_ylabel() for ax in figure.axes] == labels
    for ax, row in zip(figure.axes, middle, strict=True):
        np.testing.assert_array_equal([line.get_ydata() for line in ax.lines], [row, row + 5])
        heights = ax.collections[0].get_paths()[0].vertices[:, 1]
        assert (heights.min(), heights.max()) == (row[0] / 2, 3 * row[1])


def test_a_fit_is_kept_as_the_antenna_of_its_means_and_each_number_stands_in_its_column(
    monkeypatch, figures, tmp_path
):
    traces = calibration.load_traces("synthetic_step")
    found = make_fit(simulated=traces.displacement / traces.displacement[:, :1])
    monkeypatch.setattr(calibration, "fit_traces", lambda *_, **__: found)
    run("calibrate", "--data", "synthetic_step", "--out", tmp_path)
    antenna, plain = load_antenna(tmp_path / "antenna.toml"), cockroach()
    np.testing.assert_allclose(antenna.stiffness, 1.2 * plain.stiffness)
    np.testing.assert_allclose(antenna.damping, 0.8 * plain.damping)
    words, (unit,) = (
        read_words(tmp_path / "calibration.html"),
        {*calibration.make_hinges("scale", plain).units},
    )
    assert (
        f"parameter unit value from to p1 {unit} 1.2 1.05 1.35 p2 {unit} 0.8 0.65 0.95" in words
    )
    assert "animal p1 p2 residual one 1.1 0.9 0.02 two 1.3 0.7 0.04" in words
    kept = json.loads((tmp_path / "calibration.json").read_text())
    for name in ("each", "p", "low", "high", "residual"):
        np.testing.assert_array_equal(kept[name], getattr(found, name))


def test_an_interrupted_search_says_its_best_error(capsys, tmp_path):
    calibrate._report_interrupt(0.0125, tmp_path / "kept")
    assert (
        f"interrupted at a best error of 0.0125; every simulated antenna is in {tmp_path / 'kept'}"
        in capsys.readouterr().err
    )


def test_a_table_of_tracks_counts_its_frames():
    row = {
        "file": "a.csv",
        "mean_peak": [81.25, None],
        "n_peaks": [7, 0],
        "bridged": [12, 13],
        "missing": [34, 35],
        "n_frames": 500,
        "frame_rate": 100.0,
        "cutoff": [12.0, 13.0],
        "unmeasured": [0, 0],
        "left_out": {"tip jumps": 6},
        "notes": {},
        "remarks": ["the film is slow"],
    }
    row |= {"doubted": {"tip": 5}, "error": [1.5, None]}
    settings = {"tips": ("a", "b"), "cutoff": "auto", "max_gap": 5, "min_likelihood": 0.6}
    found = {
        "trials": [row],
        "mean": 81.25,
        "length": 50.0,
        "lateral_speed": 0.0709,
        "source": "tracked",
        "settings": settings,
    }
    words = tracks._write_words(found)
    assert re.search(r"a\.csv +81\.25 \( +7\) +none \( +0\) +12, 13 +34, 35\n", words)
    assert (
        "likelihood is too low (below 0.6): tip 5" in words
        and "standard error: left 1.5, right none °/s" in words
    )
    assert "81.25 °/s; with an antenna of 50 mm that is 7.09 cm/s sideways." in words
    assert "100 frames/s; low-pass: left 12 Hz, right 13 Hz (from the spectrum)" in words
    assert "tip jumps (6)" in words and "note: the film is slow" in words
    lost = found | {"mean": None, "lateral_speed": None}
    assert "No mean over trials and sides: 7% of the right" in tracks._write_words(lost)
    assert tracks._list_cells(row) == ["a.csv", "81.2 ± 1.5 (7)", "none", "12, 13", "34, 35"]


def test_maps_of_a_wall_are_listed_in_millimetres(figures, tmp_path, monkeypatch):
    from feeler.plotting import results as wall

    monkeypatch.setattr(wall.Shapes, "of_sweep", lambda sweep: sweep)
    monkeypatch.setattr(wall, "plot_shapes", lambda shapes, ax: None)
    monkeypatch.setattr(wall, "plot_maps", lambda maps, ax: None)
    numbers = {
        "r2": 0.98765,
        "slope": -1.234,
        "intercept": 34.567,
        "error": 0.4321,
        "undefined": "",
    }
    found = SimpleNamespace(
        distance=np.array([9.0, 8.0]), position=np.array([1.0, 2.0]), **numbers
    )
    save_wall(tmp_path, {"a": None}, {"a": found})
    words = read_words(tmp_path / "wall.html")
    assert (
        "antenna R² slope intercept [mm] error [mm] R² is a 0.9877 -1.234 34.57 0.4321 defined"
        in words
    )
    assert json.loads((tmp_path / "a.json").read_text()) == {
        "distance": [9, 8],
        "position": [1, 2],
        "r2": 0.98765,
    }


def test_shapes_beside_a_wall_have_the_colours_that_the_legend_names():
    """One antenna in an inverted J, one in contact without, one that touches nothing."""
    state = {"contact": np.array([1, 1, 0], bool), "inverted": np.array([1, 0, 0], bool)}
    points = np.arange(24.0).reshape(3, 4, 2)
    shapes = Shapes(points=points, wall=np.array([9.0, 8, 7]), peak=points[:, 1], **state)
    plot_shapes({"a": shapes}, (figure := Figure()).subplots())
    (legend,) = figure.legends
    named = {
        text.get_text(): to_hex(line.get_color())
        for text, line in zip(legend.get_texts(), legend.get_lines(), strict=True)
    }
    walls, lines = figure.axes[0].collections
    drawn = [to_hex(colour) for colour in lines.get_colors()]
    words = ("inverted J in contact", "in contact, no J", "no contact")
    assert drawn == [named[word] for word in words]
    assert named["wall"] == to_hex(walls.get_colors()[0])
    assert named["greatest bend"] == to_hex(figure.axes[0].lines[0].get_color())


@pytest.mark.long
def test_a_movie_says_how_slow_it_is(monkeypatch, tmp_path):
    monkeypatch.setattr(
        "feeler.plotting.write_touch_movie", lambda *given: given[-1].write_bytes(b"film")
    )
    said = run("touch", "--duration", 20, "--timestep", 0.1, "--out", tmp_path)
    assert f": {SLOWER:g} times slower than life; colours: curvature." in read_words(
        tmp_path / "touch.html"
    )
    assert "movie.mp4" in said


def test_conditions_stand_at_the_foot_of_a_trade_off(monkeypatch, tmp_path):
    said = []
    monkeypatch.setattr(tradeoff.Study, "run", lambda *_, **__: None)
    monkeypatch.setattr(tradeoff, "split_measured", lambda _: {})
    monkeypatch.setattr(
        tradeoff, "write_tradeoff", lambda _, __, out, words: said.append(words) or out
    )
    run("tradeoff", "--sets", 3, "--out", tmp_path)
    timestep, sets, seed = read(
        r"^Engine chain-consistent, timestep # ms, # sets, seed #\. python", said[0]
    )
    assert (timestep, sets) == (
        get_engine("chain-consistent").timestep,
        3,
    ) and seed == tradeoff.load_declared().seed


def test_conditions_stand_at_the_foot_of_a_contest(monkeypatch, tmp_path):
    said, contest = [], contests.load_contest()
    monkeypatch.setattr(contests.Contest, "run", lambda *_, **__: None)
    monkeypatch.setattr(
        contests, "write_active", lambda *given: said.append(given[-1]) or given[2]
    )
    run("active", "--sets", 2, "--copies", 3, "--no-movie", "--out", tmp_path)
    expected = (
        f"2 sets of {contest.known} touches, each felt 3 times, noise {contest.noise}. python"
    )
    assert said[0].startswith(expected)


def test_conditions_stand_at_the_foot_of_a_design(monkeypatch, tmp_path):
    said = []
    monkeypatch.setattr(
        design_page, "write_design", lambda *_, conditions, **__: said.append(conditions)
    )
    task = SimpleNamespace(n_classes=12, speeds=(0.06, 0.6), deadline=40.0, noise="common:0.03")
    task.seeds, task.timestep = (("optimiser", 1), ("test", 2)), 0.1
    scores = {name: SimpleNamespace(errors=0.1) for name in ("final", "reference_final")}
    found = SimpleNamespace(
        plan=SimpleNamespace(task=task), compare=lambda: (0.2, 0.1), looks=1, **scores
    )
    _report(found, tmp_path, robot=False, movie=False, executor=None, as_json=False)
    words = (
        "12 classes at 0.06, 0.6 m/s, 40 ms, noise common:0.03; seeds of the draws"
        " {'optimiser': 1, 'test': 2}; timestep 0.1 ms. python"
    )
    assert said[0].startswith(words)


def test_a_search_shows_the_best_so_far(monkeypatch, tmp_path):
    titles = []
    monkeypatch.setattr(Figure, "savefig", lambda self, *_: titles.append(self.get_suptitle()))
    plan = SimpleNamespace(search={"evaluations": 9}, reference=cockroach())
    best = SimpleNamespace(bits=2.125, x=None)
    space = SimpleNamespace(build=lambda x: SimpleNamespace(antenna=cockroach("linear")))
    watch = _Watcher(plan, tmp_path)
    watch._draw(SimpleNamespace(best=best, space=space, evaluations=7))
    assert titles == ["best so far: 2.125 bits, 7 antennas"]


@pytest.mark.parametrize(
    ("verb", "units"),
    [
        (
            ("touch",),
            {"--size": "mm", "--speed": "m/s", "--duration": "ms", "--timestep": "ms"},
        ),
        (("robot", "classify"), {"--speeds": "m/s", "--timestep": "ms"}),
    ],
)
def test_help_says_the_units(verb, units):
    from typer.main import get_command

    command = get_command(app)
    for name in verb:
        command = command.commands[name]
    help_of = {
        option: parameter.help for parameter in command.params for option in parameter.opts
    }
    for option, unit in units.items():
        assert re.search(rf"\[{unit}\]|(?<![\w/]){unit}(?![\w/])", help_of[option]), option


def test_a_fit_warns_beyond_a_tenth_of_the_trace(monkeypatch):
    """_BAD is a share; what is printed is what is compared."""
    result = SimpleNamespace(residual=np.array([calibrate._BAD * 1.01]))
    monkeypatch.setattr(calibration, "load_traces", lambda *_, **__: None)
    monkeypatch.setattr(calibration, "fit_traces", lambda *_, **__: result)
    monkeypatch.setattr(calibrate, "_tell_fit", lambda *_: None)
    (bad,) = read("a residual above # of the trace", run("calibrate", "--data", "x.csv"))
    assert bad == calibrate._BAD
    result.residual = np.array([calibrate._BAD * 0.99])
    assert "residual above" not in run("calibrate", "--data", "x.csv")
