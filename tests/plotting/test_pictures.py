"""What stands in the picture of a result: each line, bar, word and axis is of the thing that its
own name says. Numbers differ in everything, so that no two can stand for one another.
"""

import sys
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
import xarray as xr
from awkward_touches import make_antenna, make_set
from matplotlib.colors import to_hex
from matplotlib.figure import Figure
from PIL import Image

from feeler.errors import InvalidInput
from feeler.objects import Ball, Box, Outline, Trial, Wall
from feeler.plotting import antennas, results
from feeler.plotting import tensors as touch
from feeler.plotting.antennas import make_patch, plot_profiles
from feeler.plotting.results import (
    plot_approach,
    plot_maps,
)
from feeler.plotting.style import (
    pick_shades,
)
from feeler.presets import make_preset
from feeler.wall.distance import fit_distance
from plotting.test_results import make_optimum, make_sweep


def read(line):
    return np.column_stack(line.get_data())


def name(ax):
    return ax.get_xlabel(), ax.get_ylabel(), ax.get_title()


def list_legend(ax):
    return [text.get_text() for text in ax.get_legend().get_texts()]


def find_spans(bars):
    """Lower and upper end of each bar of an errorbar container."""
    return [segment[:, 1].tolist() for segment in bars.lines[2][0].get_segments()]


def test_accuracy_has_a_mean_and_a_spread_at_each_ratio_of_copies_and_of_originals():
    sweep = replace(
        make_sweep(),
        confusion=np.array([[[9, 1], [0, 10]], [[8, 2], [3, 7]], [[1, 9], [2, 8]]]),
    )
    curve, counts, bar = sweep.plot().axes
    assert name(curve) == ("noise ratio", "accuracy [%]", "")
    for bars, values in zip(curve.containers, (sweep.noisy, sweep.clean), strict=True):
        mean, sd = 100 * values.mean(axis=1), 100 * values.std(axis=1)
        np.testing.assert_allclose(read(bars.lines[0]), np.column_stack([sweep.ratios, mean]))
        np.testing.assert_allclose(find_spans(bars), np.column_stack([mean - sd, mean + sd]))
    assert list_legend(curve) == ["chance", "noisy copies", "clean originals"]
    (chance,) = (line for line in curve.lines if line.get_label() == "chance")
    assert {*chance.get_ydata()} == {50.0}
    np.testing.assert_allclose(counts.images[0].get_array(), [[10, 90], [20, 80]])
    assert (
        counts.get_title() == "at noise 0.3" and bar.get_ylabel() == "share of the touches [%]"
    )


def test_a_design_s_hinges_are_counted_from_1_and_its_cost_holds_until_it_falls():
    end = make_optimum()
    profile, way = results.draw_optimum(end).axes
    antenna = end.design.antenna
    wanted = {
        "stiffness [N·mm/rad]": antenna.stiffness,
        "damping [N·mm·ms/rad]": antenna.damping,
    }
    assert list_legend(profile) == [*wanted]
    for line, values in zip(profile.lines, wanted.values(), strict=True):
        hinge = 1 + np.arange(antenna.n_segments)
        np.testing.assert_array_equal(read(line), np.column_stack([hinge, values]))
    assert name(profile)[0] == "hinge, base to tip"
    assert name(way) == ("antennas simulated", "what is missing (cost)", "the search")
    (steps,) = way.lines
    assert steps.get_drawstyle() == "steps-post"  # found after 4 antennas, and not before
    np.testing.assert_array_equal(read(steps), end.history)


def test_a_picture_shows_its_own_trial_and_variable_with_their_unit_and_negative_values():
    tensors = make_set()
    for trial, variable, unit in ((0, "curvature", "1/mm"), (2, "angle", "rad")):
        how = {"trial": trial, "variable": variable} if trial else {}
        ax = results.plot_trial(tensors, **how)
        (image,), bar = ax.get_images(), ax.get_figure().axes[1]
        values = tensors[variable].values[trial]
        np.testing.assert_array_equal(image.get_array(), values)
        assert bar.get_ylabel() == f"{variable} [{unit}]"
        assert (image.norm.vmin, image.norm.vmax) == (values.min(), np.abs(values).max())
        left, right = image.get_extent()[:2]
        assert (left, right) == pytest.approx((-0.15, 30 * 0.3 + 0.15))  # ms
    given = Figure().subplots()
    assert results.plot_trial(tensors, ax=given) is given


@pytest.mark.parametrize(
    ("how", "match"),
    [
        ({"trial": 3}, "trial must be from 0 to 2, got 3"),
        ({"trial": -1}, "trial must be from 0 to 2, got -1"),
        ({"variable": "tip"}, "no tensor 'tip' in this Dataset; valid: .*angle.*curvature"),
        ({"variable": "x"}, "no tensor 'x' in this Dataset; valid: "),
    ],
)
def test_a_trial_or_a_tensor_that_is_not_there_is_refused(how, match):
    with pytest.raises(InvalidInput, match=match):
        results.plot_trial(make_set(), **how)


def make_shapes(wall, contact, inverted):
    """Of three distances, each antenna with a place of its own."""
    points = np.arange(12.0).reshape(3, 2, 2) ** 1.1
    states = {"contact": np.array(contact), "inverted": np.array(inverted)}
    return SimpleNamespace(
        points=points, wall=np.array(wall), peak=points[:, 1] - 0.3, **states
    )


def test_the_wall_of_each_colour_is_the_distance_of_which_the_legend_speaks():
    """Farther walls are darker, and the same distance has one colour in every panel."""
    rows = {
        name: make_shapes(sign * np.array([11.0, 7.5, 4.0]), [True] * 3, [True] * 3)
        for name, sign in (("near", 1), ("far", -1))
    }
    axes = Figure().subplots(1, 2)
    plot_approach(rows, axes, every=1)
    shades = [to_hex(colour) for colour in pick_shades("wall distance", 3)]
    for ax, (title, shapes) in zip(axes, rows.items(), strict=True):
        assert (ax.get_title(), ax.get_xlabel()) == (title, "x [mm]")
        drawn = [line for line in ax.lines if line.get_linestyle() == "--"]
        assert [line.get_xdata()[0] for line in drawn] == shapes.wall.tolist()
        assert [to_hex(line.get_color()) for line in drawn] == shades
        dots = [line for line in ax.lines if line.get_marker() == "o"]
        np.testing.assert_allclose([read(dot)[0] for dot in dots], shapes.peak)
        assert [to_hex(dot.get_color()) for dot in dots] == shades
    legend = axes[0].get_figure().legends[0]
    assert [text.get_text() for text in legend.get_texts()] == [
        "11",
        "7.5",
        "4",
        "greatest bend",
    ]
    marks = [to_hex(mark.get_color()) for mark in legend.legend_handles[:3]]
    assert (marks, legend.get_title().get_text()) == (shades, "wall distance [mm]")
    assert axes[0].get_ylabel() == "y [mm]"


def test_a_map_that_has_no_line_says_so_and_draws_none():
    distance, position = np.array([20.0, 14.0, 9.0]), np.array([3.0, 17.0, 31.0])
    used, none = np.ones(3, dtype=bool), np.zeros(3, dtype=bool)
    maps = {
        "linear": fit_distance(distance, position, used, none, resolution=0.1),
        "uniform": fit_distance(distance, 0 * position, used, none, resolution=0.1),
    }
    assert maps["uniform"].undefined
    ax = Figure().subplots()
    plot_maps(maps, ax)
    lines = [line for line in ax.lines if line.get_linestyle() == "--"]
    assert len(lines) == 1
    line = np.polynomial.Polynomial.fit(position, distance, 1)
    np.testing.assert_allclose(read(lines[0]), [(x, line(x)) for x in (3.0, 31.0)])
    assert list_legend(ax)[0].startswith("linear: R² 0.9")
    assert list_legend(ax)[1:] == ["uniform: R² undefined", "open: not fitted"]


UNEVEN = Outline(vertices=np.array([[0.0, 1.9], [0.0, -0.7], [-2.3, -0.4], [-1.1, 1.5]]))


@pytest.mark.parametrize("angle", [0.0, 35.0, -110.0])
def test_an_object_is_drawn_as_it_faces_with_its_left_on_its_left(angle):
    """A box is not as wide as it is high, and the other has no two sides that are alike."""
    forward = np.array([np.sin(np.deg2rad(angle)), np.cos(np.deg2rad(angle))])
    left = np.array([-forward[1], forward[0]])
    origin = np.array([3.0, -7.0])
    for feature in (Box(half_width=2.0, half_height=0.7), UNEVEN):
        corners = make_patch(feature, origin, forward).get_path().vertices - origin
        own = np.column_stack([corners @ forward, corners @ left]).round(9) + 0.0
        rim = np.concatenate(feature.parts).round(9) + 0.0
        assert {*map(tuple, own)} == {*map(tuple, rim)}
    wall = make_patch(Wall(), origin, forward, reach=20.0).get_path().vertices - origin
    assert (wall @ forward).max() == pytest.approx(0.0, abs=1e-12)  # it lies behind its front
    assert np.ptp(wall @ left) == pytest.approx(40.0)
    assert (wall @ forward).min() == pytest.approx(-20.0)


def test_of_an_antenna_in_space_the_plane_towards_z_is_dashed_and_wide_spans_are_decades():
    antenna = make_preset("rat-whisker")
    antenna = antenna.replace(stiffness=antenna.stiffness * [[1.0], [1.7]])
    axes = Figure().subplots(1, 4)
    plot_profiles(antenna, axes)
    for ax, values in zip(axes[2:], (antenna.stiffness, antenna.damping), strict=True):
        assert [line.get_linestyle() for line in ax.lines] == ["-", "--"]
        np.testing.assert_array_equal([line.get_ydata() for line in ax.lines], values)
    for factor, scale in ((29.0, "linear"), (31.0, "log")):
        span = np.geomspace(1.0, factor, 11)
        plot_profiles(make_antenna().replace(stiffness=span), drawn := Figure().subplots(1, 4))
        assert drawn[2].get_yscale() == scale
    with pytest.raises(InvalidInput, match="four Axes are needed, got 3"):
        plot_profiles(antenna, axes[:3])


def make_planes():
    """Curvature of two touches in both planes, and what is twisted."""
    values = np.random.default_rng(2).normal(size=(2, 3, 4, 6))
    variables = {"curvature": (("trial", "plane", "sensor", "time"), values, {"units": "1/mm"})}
    time = ("time", 2.0 * np.arange(6.0), {"units": "ms"})
    return values, xr.Dataset(variables, {"time": time})


def test_of_a_touch_in_space_the_length_of_its_curvature_is_drawn_of_the_first():
    values, tensors = make_planes()
    touch.plot_touch(tensors, figure := Figure())
    ax, bar = figure.axes
    whole = np.hypot(values[0, 0], values[0, 1])
    np.testing.assert_allclose(ax.images[0].get_array(), whole)
    assert ax.images[0].get_clim() == (0.0, pytest.approx(whole.max()))
    assert bar.get_ylabel().startswith("curvature of both planes [1/mm]")


@pytest.fixture
def films(monkeypatch):
    """What would be filmed."""
    films = []
    monkeypatch.setattr(touch, "write_movie", lambda *given: films.append(given))
    return films


def test_touches_side_by_side_have_one_scale_and_last_as_long_as_the_longest(films):
    whole, antenna = make_set(), make_antenna()
    first, second = (whole.isel(trial=[k]) for k in (0, 1))
    second = second.assign(curvature=3.0 * second["curvature"]).isel(time=slice(17))
    second["curvature"].attrs = whole["curvature"].attrs
    trial = Trial(feature=Ball(radius=0.9), location=0.6, speed=0.3)
    for names in ("ab", "ba"):
        sets = {"a": (trial, second), "b": (trial, first)}
        pairs = {name: sets[name] for name in names}
        touch.write_touches_movie(antenna, pairs, "a.mp4", slower=100.0, fps=20)
        _, figure, draw, count, fps, _ = films.pop()
        assert (count, fps) == (round(30 * 0.3 * 100 * 20 / 1000), 20)
        draw(count - 1)
        assert figure.get_suptitle() == "9 ms, 100× slower than life"
        greatest = max(float(abs(one["curvature"]).max()) for one in (first, second))
        for ax in figure.axes[2:4]:
            assert ax.images[0].get_clim()[1] == pytest.approx(greatest)


@pytest.mark.parametrize(("n", "still"), [(10, 6), (3, 1), (100, 66)])
def test_a_movie_is_sent_frame_by_frame_and_its_still_is_that_of_two_thirds(
    monkeypatch, tmp_path, n, still
):
    """To what would write it: sides are even, and every frame has a grey of its own."""
    told, sent, closed = [], [], []

    class Writer:
        def send(self, frame):
            if frame is not None:
                sent.append(int(frame[5, 5, 0]))

        def close(self):
            closed.append(len(sent))

    def write_frames(path, size, **how):
        told.append((size, how["fps"]))
        open(path, "wb").close()
        return Writer()

    monkeypatch.setitem(
        sys.modules,
        "imageio_ffmpeg",
        SimpleNamespace(write_frames=write_frames, __spec__="there"),
    )
    figure = Figure(figsize=(4.0, 1.31))
    path = antennas.write_movie(
        tmp_path / "a.mp4", figure, lambda k: figure.set_facecolor(str(k / n)), n, fps=9
    )
    greys = [255 * k / n for k in range(n)]
    np.testing.assert_allclose(sent, greys, atol=1.0)
    assert closed == [n]
    ((size, fps),) = told
    assert fps == 9 and size[0] == 1080 and size[1] % 2 == 0
    with Image.open(path.with_suffix(".jpg")) as picture:
        assert picture.size == size
        assert picture.getpixel((5, 5))[0] == pytest.approx(sent[still], abs=2)
