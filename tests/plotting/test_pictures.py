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
from matplotlib.colors import Normalize, to_hex
from matplotlib.figure import Figure
from PIL import Image

from feeler.calibration.hinges import Band
from feeler.errors import InvalidInput
from feeler.objects import Ball, Box, Outline, Peg, Trial, Wall, place
from feeler.objects.meshes import list_solids
from feeler.plotting import movie, results
from feeler.plotting import tensors as touch
from feeler.plotting.antennas import _SpaceScene, make_patch, plot_profiles
from feeler.plotting.results import (
    Shapes,
    plot_approach,
    plot_curves,
    plot_maps,
    plot_raster,
    plot_shapes,
)
from feeler.plotting.style import (
    pick_colours,
    pick_shades,
)
from feeler.presets import make_preset
from feeler.wall.distance import _fit_distance
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


def test_a_profile_s_band_reaches_from_its_own_low_to_its_own_high_in_its_own_colour():
    middle = np.array([[3.0, 2.0, 1.0], [0.6, 0.5, 0.2]])
    low, high = middle * [[0.9], [0.5]], middle * [[1.2], [3.0]]
    place = np.array([0.0, 0.3, 0.8])
    animals = SimpleNamespace(
        animals=("one", "two"),
        simulated=np.array([[1.0, 0.3, -0.1], [1.0, 0.2, 0.1]]),
        band=Band(place=place, middle=middle, low=low, high=high),
    )
    trace, profile = results.draw_traces(animals).axes
    drawn = {line.get_label(): line.get_ydata().tolist() for line in trace.lines}
    assert drawn == dict(zip(animals.animals, animals.simulated.tolist(), strict=True))
    assert name(trace) == ("sample", "displacement [1 at the release]", "as fitted")
    words = ["stiffness [N·mm/rad]", "damping [N·mm·ms/rad]"]
    assert [line.get_label() for line in profile.lines] == list_legend(profile) == words
    for k, (line, area) in enumerate(zip(profile.lines, profile.collections, strict=True)):
        np.testing.assert_array_equal(read(line), np.column_stack([place, middle[k]]))
        corners = {(x, y) for x, y in area.get_paths()[0].vertices.tolist()}
        rims = {*zip(place, low[k], strict=True), *zip(place, high[k], strict=True)}
        assert rims <= corners <= rims
        assert to_hex(area.get_facecolor()[0]) == to_hex(line.get_color())
    assert profile.get_xlabel() == "place (base 0, tip 1)" and profile.get_yscale() == "log"


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
    return Shapes(points=points, wall=np.array(wall), peak=points[:, 1] - 0.3, **states)


def test_a_hook_a_contact_and_none_have_the_colours_that_the_legend_says():
    shapes = make_shapes([9.0, 7.0, 5.0], [False, True, True], [False, False, True])
    ax = Figure().subplots()
    plot_shapes({"a": shapes}, ax)
    legend = ax.get_figure().legends[0]
    said = {
        text.get_text(): to_hex(mark.get_color())
        for text, mark in zip(legend.get_texts(), legend.legend_handles, strict=True)
    }
    walls, lines = ax.collections
    words = ["no contact", "in contact, no J", "inverted J in contact"]
    assert [to_hex(colour) for colour in lines.get_colors()] == [said[one] for one in words]
    assert {to_hex(colour) for colour in walls.get_colors()} == {said["wall"]}
    assert to_hex(ax.lines[0].get_color()) == said["greatest bend"]


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
        "linear": _fit_distance(distance, position, used, none, resolution=0.1),
        "uniform": _fit_distance(distance, 0 * position, used, none, resolution=0.1),
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


def test_of_a_scene_in_space_only_the_object_of_this_moment_is_drawn():
    """A peg has two sheets and more, of which none may stay where the peg was."""
    antenna = make_preset("rat-whisker")
    ax = Figure(figsize=(30.0, 25.0)).add_subplot(projection="3d")
    scene = _SpaceScene(antenna, ax, Normalize(0.0, 1.0))
    box, axes = Box(half_width=1.0, half_height=2.0), np.eye(3)
    counts = []
    several = Outline(vertices=np.array([[0, 2], [0, -2], [-1, -2], [-0.4, 0], [-1, 2]], float))
    assert len(list_solids(several)) == 3
    for feature in (Peg(radius=0.5, half_length=4.0), several, box, Wall(), Ball(radius=1.0)):
        for x in (0.0, 5.0):
            scene.place(feature, np.array([x, 1.0, 2.0]), axes)
        counts.append(len(ax.collections) - 1)  # beside the antenna's own line
    assert counts == [1, 3, 1, 1, 1]
    wide = 0.6 * 72 * min(ax.bbox.width, ax.bbox.height) / ax.figure.dpi / antenna.length
    wanted = np.maximum(2 * antenna.radius * wide, 2.0)
    assert wanted.max() > 2.0
    np.testing.assert_allclose(ax.collections[0].get_linewidth(), wanted)


def test_contact_is_marked_when_it_was_and_rows_are_as_many_as_the_larger_side_has():
    ax = Figure().subplots()
    times = np.array([[1.0], [2.0], [3.0], [4.0], [5.0]])
    plot_raster(times, ax, np.array([1, -1, 1, 1, -1]), lead=2.7)
    (mark,) = (line for line in ax.lines if line.get_linestyle() == "-")
    assert {*mark.get_xdata()} == {2.7} and ax.get_ylim() == (0.5, 3.5)
    with pytest.raises(InvalidInput, match=r"times must be \(unit, event\), got shape \(5,\)"):
        plot_raster(times[:, 0], ax)


def make_curves(kind):
    """Two groups, each with a null and a baseline of its own."""

    def shift(by):
        return replace(make_sweep(), noisy=make_sweep().noisy - by)

    groups = {"fast": shift(0.0), "slow": shift(0.1)}
    nulls = {"fast": shift(0.2), "slow": shift(0.3)}
    asked = []

    def find_null(kind, noise, group=None):
        asked.append((kind, noise, group))
        return nulls.get(group, nulls["slow"])

    curves = SimpleNamespace(
        find=lambda *of: groups,
        find_null=find_null,
        baselines={"fast": shift(0.25), "slow": shift(0.35)},
    )
    return curves, groups, nulls, asked


@pytest.mark.parametrize("kind", ["joint", "fixed"])
def test_curve_null_and_baseline_of_a_group_have_its_colour_and_each_its_own_numbers(kind):
    curves, groups, nulls, asked = make_curves(kind)
    ax = Figure().subplots()
    plot_curves(curves, kind, "relative", ax)
    of = ["fast", "slow"] if kind == "joint" else [None]
    assert asked == [(kind, "relative", name) for name in of]
    picked = pick_colours(groups)
    colours = [picked[group] for group in groups]
    full = [line for line in ax.lines if np.isfinite(line.get_ydata()).all()]

    def find(style):
        return [line for line in full if line.get_linestyle() == style]

    def mean(sweep):
        return np.column_stack([100 * sweep.ratios, 100 * sweep.noisy.mean(axis=1)])

    def check(lines, sweeps):
        for line, sweep in zip(lines, sweeps, strict=True):
            np.testing.assert_allclose(read(line), mean(sweep))

    check(find("-"), groups.values())
    check(find("-."), curves.baselines.values())
    for style in ("-", "-."):
        assert [line.get_color() for line in find(style)] == colours
    check(find("--"), nulls.values() if kind == "joint" else [nulls["slow"]])
    black = ["#000000"]
    assert [line.get_color() for line in find("--")] == (colours if kind == "joint" else black)
    (chance,) = find(":")
    assert {*chance.get_ydata()} == {50.0}
    words = [text for line in ax.lines if (text := line.get_label())[0] != "_"]
    named = ["null: one tensor repeated", "peak place and time only", "chance"]
    assert sorted(words) == sorted([*groups, *named])


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
    assert bar.get_ylabel() == "curvature of both planes [1/mm]"


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
        _, figure, draw, count, fps = films.pop()
        assert (count, fps) == (round(30 * 0.3 * 100 * 20 / 1000), 20)
        draw(count - 1)
        assert figure.get_suptitle() == "9 ms, 100× slower than life"
        greatest = max(float(abs(one["curvature"]).max()) for one in (first, second))
        for ax in figure.axes[2:4]:
            assert ax.images[0].get_clim()[1] == pytest.approx(greatest)


def make_space(monkeypatch, module):
    """A touch in space of 250 samples 0.4 ms apart, whose greatest bend is not at its end."""
    antenna = make_preset("rat-whisker")
    trial = Trial(feature=Ball(radius=1.0), location=0.6, speed=0.3, azimuth=35.0)
    n, time = antenna.n_segments, 0.4 * np.arange(250)
    points = np.random.default_rng(3).normal(size=(1, 250, n + 1, 3))
    bend = np.sin(np.pi * time / 80)[:, None] ** 2 * np.linspace(0.01, 0.05, n)
    coords = {"time": ("time", time, {"units": "ms"}), "segment": np.arange(1, n + 1)}
    monkeypatch.setattr(
        module, "reconstruct_posture", lambda *_: SimpleNamespace(values=points)
    )
    monkeypatch.setattr(module, "compute_bend", lambda *_: bend)
    return antenna, trial, xr.Dataset(coords=coords), points[0], bend


def test_in_space_the_object_goes_where_it_goes_while_the_antenna_bends(monkeypatch):
    antenna, trial, tensors, points, bend = make_space(monkeypatch, touch)
    monkeypatch.setattr(
        touch, "take_curvature", lambda *_: np.ones((1, antenna.n_segments, 250))
    )
    flat, below = Figure().subplots(1, 2)
    axes = touch._add_space(flat.figure, flat), below
    view = touch._View(antenna, trial, tensors, (Normalize(0, 1), "magma"), axes)
    seen = {"place": [], "move": []}
    for called, calls in seen.items():
        monkeypatch.setattr(view.space, called, lambda *given, calls=calls: calls.append(given))
    placed = place(antenna, trial)
    for now, sample in ((0.0, 0), (30.1, 76), (1e9, 249)):
        assert view.move(now) == []
        feature, origin, turned = seen["place"][-1]
        np.testing.assert_allclose(origin, placed.origin + 0.4 * sample * placed.velocity)
        assert feature is trial.feature
        np.testing.assert_array_equal(turned, placed.axes)
        for given, wanted in zip(seen["move"][-1], (points[sample], bend[sample]), strict=True):
            np.testing.assert_array_equal(given, wanted)


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
    path = movie.write_movie(
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
