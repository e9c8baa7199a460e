"""Movies say their time, run as slowly as they say, and show at each moment what was felt until
then.
"""

import re
from types import SimpleNamespace

import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

import feeler
from feeler.plotting import tensors as touch_movie
from feeler.plotting.antennas import FPS, SLOWER, choose_frames, say_clock
from feeler.plotting.results import plot_shapes
from feeler.plotting.style import mark_places


@pytest.mark.parametrize(
    ("span", "slower", "fps"), [(100.0, 30.0, 15), (40.0, 10.0, 25), (3.0, 1.0, 15)]
)
def test_frames_are_evenly_spaced_as_slow_as_said_from_first_to_last(span, slower, fps):
    time = 5.0 + np.arange(0.0, span + 0.05, 0.1)
    shown = time[choose_frames(time, slower=slower, fps=fps)]
    assert (shown[0], shown[-1]) == (time[0], time[-1])
    seconds = shown.size / fps
    assert seconds == pytest.approx(max(span * slower / 1000, 2 / fps), abs=0.6 / fps)
    assert np.ptp(np.diff(shown)) <= 0.1 + 1e-9


def test_the_clock_says_milliseconds_and_how_slow_it_runs():
    assert say_clock(41.6) == f"42 ms, {SLOWER:g}× slower than life" and SLOWER == 30.0
    assert say_clock(7.0, 12.5) == "7 ms, 12.5× slower than life"


def test_what_is_to_come_is_not_seen_in_the_picture_itself():
    figure = Figure()
    canvas, ax = FigureCanvasAgg(figure), figure.subplots()
    time = 3.0 + 2.0 * np.arange(10)
    image = ax.imshow(np.ones((4, 10)), extent=(2, 22, 0.5, 4.5), aspect="auto", cmap="gray_r")
    image.set_clim(0, 1)
    hide_rest = touch_movie._cover(image)
    for now in (0, 6, 9):
        hide_rest(now)
        canvas.draw()
        x, y = ax.transData.transform(np.column_stack([time, np.full(10, 2.0)])).T.round()
        dark = np.asarray(canvas.buffer_rgba())[int(figure.bbox.ymax) - y.astype(int) - 1]
        assert (dark[np.arange(10), x.astype(int), 0] < 128).tolist() == [
            k <= now for k in range(10)
        ]


@pytest.fixture
def written(monkeypatch):
    """What would be filmed: figure, what draws a frame, and how many there are."""
    films = []
    monkeypatch.setattr(
        touch_movie,
        "write_movie",
        lambda path, figure, draw, n, fps, still: films.append((figure, draw, n, fps)),
    )
    return films


def test_a_touch_is_filmed_in_millimetres_up_to_now(written):
    antenna = feeler.presets.cockroach()
    trial = feeler.Trial(feature=feeler.Ball(radius=1.5), location=0.7, speed=0.3)
    tensors = feeler.touch(antenna, trial, duration=30.0, all_hinges=True)
    touch_movie.write_touch_movie(antenna, trial, tensors, "film.mp4", slower=20.0)
    figure, draw, count, fps = written[0]
    left, right, bar = figure.axes
    assert (left.get_xlabel(), left.get_ylabel()) == (
        "x [mm]",
        "y [mm]",
    ) and left.get_title() == trial.label
    assert "away from the object [1/mm]" in bar.get_ylabel()
    assert (count, fps) == (round(29 * 20 * FPS / 1000), FPS)
    values, time = tensors["curvature"].values[0][antenna.sensors - 1], tensors["time"].values
    for k in (0, count // 2, count - 1):
        draw(k)
        now = float(re.match(r"(\d+) ms, 20× slower", right.get_title())[1])
        assert now == pytest.approx(29 * k / (count - 1), abs=1.0)
        (image,) = right.get_images()
        np.testing.assert_array_equal(image.get_array(), values)
        (cover,) = right.patches  # what is still to come lies under it, and nothing else does
        covered = (time > cover.get_x()) & (time < cover.get_x() + cover.get_width())
        np.testing.assert_array_equal(covered, time > now)
        assert (cover.get_y(), cover.get_height()) == (0.5, len(values))


def test_touches_side_by_side_share_a_clock_and_millimetres(written):
    antenna = feeler.presets.cockroach()
    trials = [
        feeler.Trial(feature=feeler.Ball(radius=1.5), location=0.7, speed=speed)
        for speed in (0.3, 0.6)
    ]
    sets = [feeler.touch(antenna, trial, duration=20.0, all_hinges=True) for trial in trials]
    pairs = dict(zip(("slow", "fast"), zip(trials, sets, strict=True), strict=True))
    touch_movie.write_touches_movie(antenna, pairs, "film.mp4")
    figure, draw, count, _ = written[0]
    assert [ax.get_title() for ax in figure.axes[:2]] == ["slow", "fast"]
    assert (
        figure.axes[0].get_ylabel() == "y [mm]"
        and "away from the object [1/mm]" in figure.axes[-1].get_xlabel()
    )
    draw(count - 1)
    assert figure.get_suptitle() == say_clock(19.0)


def test_shapes_stand_at_their_distance_in_millimetres():
    points = np.array([[[0.0, 0.0], [3.0, 10.0]], [[0.0, 0.0], [2.0, 12.0]]])
    states = {"contact": np.array([True, False]), "inverted": np.array([True, False])}
    shapes = SimpleNamespace(
        points=points,
        wall=np.array([-8.0, -6.5]),
        peak=np.array([[1.0, 5.0], [np.nan, np.nan]]),
        **states,
    )
    ax = Figure().subplots()
    plot_shapes({"a": shapes, "b": shapes}, ax, cell=(30.0, 60.0))
    walls, lines = ax.collections
    assert ax.get_xlabel() == "wall distance [mm]"
    assert [tick.get_text() for tick in ax.get_xticklabels()] == ["8", "6.5"]
    assert [tick.get_text() for tick in ax.get_yticklabels()] == ["a", "b"]
    shifts = np.array([[0, 0], [30, 0], [0, -60], [30, -60]])
    np.testing.assert_allclose(
        lines.get_segments(), [points[k % 2] + shift for k, shift in enumerate(shifts)]
    )
    np.testing.assert_allclose(
        [wall[:, 0].mean() for wall in walls.get_segments()], [-8, 23.5, -8, 23.5]
    )
    np.testing.assert_allclose(ax.lines[0].get_xydata()[::2], [[1, 5], [1, -55]])


def test_marked_places_are_named_by_themselves():
    ax = Figure().subplots()
    ax.set_xscale("log")
    mark_places(ax.xaxis, (0.03, 0.6, 1.2))
    assert [tick.get_text() for tick in ax.get_xticklabels()] == ["0.03", "0.6", "1.2"]
    np.testing.assert_allclose(ax.get_xticks(), [0.03, 0.6, 1.2])
