"""What stands on an axis is the number that was computed, in the unit that the axis names."""

from types import SimpleNamespace

import numpy as np
import pytest
import xarray as xr
from matplotlib.colors import Normalize
from matplotlib.figure import Figure

from feeler.analysis import Interval
from feeler.decoding.sweeps import Sweep
from feeler.plotting.antennas import MovingAntenna, plot_profiles
from feeler.plotting.results import (
    Shapes,
    plot_approach,
    plot_bases,
    plot_index,
    plot_raster,
    plot_sweep,
    plot_touch_spikes,
)
from feeler.plotting.tensors import list_tensors, plot_tensor, plot_tensor_grid, plot_touch
from feeler.presets import cockroach
from feeler.tensors.schema import label_units
from feeler.wall import Posture, WallTouch
from feeler.wall.distance import _fit_distance
from paper import fig3, fig6, figS1


@pytest.fixture
def ax():
    return Figure().subplots()


def name(ax):
    return ax.get_xlabel(), ax.get_ylabel()


def read(line):
    return np.column_stack(line.get_data())


@pytest.mark.parametrize("step", [1.0, 0.25])
def test_a_tensor_lies_over_its_milliseconds_and_its_sensors(ax, step):
    tensor, time = np.arange(12.0).reshape(3, 4), 10.0 + step * np.arange(4)
    image = plot_tensor(tensor, time, ax, Normalize(0, 11))
    assert image.get_extent() == pytest.approx((10 - step / 2, 10 + 3.5 * step, 0.5, 3.5))
    np.testing.assert_array_equal(image.get_array(), tensor)
    assert image.origin == "lower" and name(ax) == ("time [ms]", "sensor (base → tip)")
    (place,) = list_tensors(ax.figure)
    assert (place["low"], place["high"], place["unit"]) == (0, 11, "/mm")


def test_small_multiples_keep_their_tensors_and_mark_first_and_last_time(ax):
    tensors = [[np.full((20, 30), 10.0 * i + j) for j in range(3)] for i in range(2)]
    for row in tensors:
        for tensor in row:
            tensor[0] += 0.5  # the base
    image = plot_tensor_grid(
        tensors, 5.0 + 0.5 * np.arange(30), ax, Normalize(0, 13), ["a", "b"], ["x", "y", "z"]
    )
    mosaic = np.ma.filled(image.get_array(), np.nan)
    for i in range(2):
        for j in range(3):
            part = mosaic[21 * i : 21 * i + 20, 31 * j : 31 * j + 30]
            np.testing.assert_array_equal(part[::-1], tensors[i][j])
    assert np.isnan(mosaic[20]).all() and np.isnan(mosaic[:, 30]).all()
    assert [label.get_text() for label in ax.get_xticklabels()] == [
        "5",
        "20",
    ] * 3  # ms, of 19.5 the nearest even
    assert [label.get_text() for label in ax.get_yticklabels()] == ["a", "b"]
    grid = list_tensors(ax.figure)[0]["grid"]
    assert (grid["start"], grid["step"], grid["sensors"]) == (5.0, 0.5, 20)


def test_a_touch_is_drawn_as_curvature_per_millimetre():
    values = np.linspace(-0.1, 0.3, 12).reshape(1, 3, 4)
    figure = Figure()
    variables = {"curvature": (("trial", "sensor", "time"), values)}
    plot_touch(label_units(xr.Dataset(variables, {"time": np.arange(4.0)})), figure)
    ax, bar = figure.axes
    (image,) = ax.get_images()
    np.testing.assert_array_equal(image.get_array(), values[0])
    assert (image.norm.vmin, image.norm.vmax) == (0.0, pytest.approx(0.3))
    assert " ".join(bar.get_ylabel().split()) == "curvature [1/mm] (negative drawn as 0)"


def test_profiles_stand_over_the_hinges_in_their_units():
    antenna, axes = cockroach(), Figure().subplots(1, 4)
    plot_profiles(antenna, axes)
    place = antenna.hinge_position / antenna.length
    expected = {
        "segment length [mm]": antenna.segment_length,
        "segment mass [µg]": 1e6 * antenna.segment_mass,  # g
        "stiffness [N·mm/rad]": antenna.stiffness,
        "damping [N·mm·ms/rad]": antenna.damping,
    }
    for ax, (label, values) in zip(axes, expected.items(), strict=True):
        assert name(ax) == ("position (base 0, tip 1)", label)
        np.testing.assert_allclose(read(ax.lines[0]), np.column_stack([place, values]))


def test_a_moving_antenna_has_its_dots_on_the_hinges_that_are_sensed_and_its_colours_on_theirs():
    antenna = cockroach().replace(sensors=(1, 2, 40, 139))
    points = np.random.default_rng(0).normal(0, 10, (antenna.n_segments + 1, 2))
    values, norm = np.linspace(0, 1, antenna.n_segments), Normalize(-1.0, 2.0)
    ax = Figure().subplots()
    ax.set(xlim=(-20, 20), ylim=(-20, 20))
    skin, line, dots = MovingAntenna(antenna, ax, norm).move(points, values)
    np.testing.assert_array_equal(read(dots), points[[0, 1, 39, 138]])
    for lines in (skin, line):
        np.testing.assert_array_equal(
            lines.get_segments(), np.stack([points[:-1], points[1:]], 1)
        )
    np.testing.assert_array_equal(line.get_array(), values)
    assert (line.norm.vmin, line.norm.vmax) == (-1.0, 2.0)
    wide = 2 * antenna.radius * ax.bbox.width / 40 * 72 / ax.get_figure().dpi
    np.testing.assert_allclose(line.get_linewidth(), np.maximum(wide, 2.4))


@pytest.mark.parametrize("points", [2, 5], ids=["bars", "a band"])
def test_accuracy_and_noise_are_in_per_cent(ax, points):
    noisy = np.array([[0.9, 1.0], *[[0.4, 0.6]] * (points - 1)])
    empty = dict.fromkeys(("hits", "confusion", "kept_noisy", "kept_clean"), noisy)
    plot_sweep(
        Sweep(
            ratios=np.linspace(0.05, 0.3, points), classes=np.arange(4), noisy=noisy, **empty
        ),
        ax,
    )
    np.testing.assert_allclose(read(ax.lines[0])[[0, -1]], [[5, 95], [30, 50]])
    spread = ax.collections[0].get_paths()
    assert len(spread) == (
        2 if points == 2 else 1
    )  # two points are not joined, by a band neither
    ends = np.concatenate([path.vertices for path in spread])[:, 1]
    assert (ends.min(), ends.max()) == pytest.approx((40, 100))  # mean ± 1 sd


def test_units_of_either_side_are_named_after_the_bending_that_they_answer(ax):
    times = np.array([[1.0, np.nan], [2.0, 3.0], [4.0, np.nan], [5.0, 6.0]])
    plot_raster(times, ax, np.array([1, 1, -1, -1]), lead=7.0)
    drawn = {line.get_label(): read(line).tolist() for line in ax.lines[:2]}
    assert drawn == {
        "bent towards +x": [[1, 1], [2, 2], [3, 2]],
        "bent towards −x": [[4, 1], [5, 2], [6, 2]],
    }
    assert name(ax) == ("time [ms]", "unit (base → tip)")


def test_units_around_an_antenna_in_space_are_named_after_their_side(ax):
    times = np.arange(6.0)[:, None]
    around = np.array([0, 0, 90, 90, 30, 30])
    plot_raster(times, ax, np.array([1, -1, 1, -1, 1, -1]), around=around)
    drawn = {line.get_label(): read(line).tolist() for line in ax.lines[:6]}
    names = ("+x", "−x", "+z", "−z", "30°", "210°")
    assert drawn == {f"bent towards {name}": [[k, 1]] for k, name in enumerate(names)}


def test_of_a_touch_in_space_both_planes_of_bending_stand_above_its_spikes():
    tensor = np.random.default_rng(0).normal(size=(3, 2, 6))
    times, rate = np.array([[3.5], [4.0]]), np.ones((2, 6))
    sides, around = np.array([1, 1]), np.array([0, 90])
    plot_touch_spikes(
        tensor, times, rate, np.arange(6.0), sides, figure := Figure(), around=around
    )
    for ax, plane in zip(figure.axes[:2], tensor[:2], strict=True):
        np.testing.assert_array_equal(ax.images[0].get_array(), plane)
        assert ax.images[0].get_clim()[1] == np.abs(tensor[:2]).max()
    named = ["angle towards x [°]", "angle towards z [°]"]
    assert [bar.get_ylabel() for bar in figure.axes[4:]] == named


def test_what_is_felt_stands_above_its_spikes_and_the_mean_of_their_rates():
    time, rng = 3.0 + 0.5 * np.arange(6), np.random.default_rng(0)
    tensor, rate = rng.normal(size=(2, 6)), rng.uniform(5, 90, size=(4, 6))
    times = np.array([[3.5], [np.nan], [4.5], [5.0]])
    plot_touch_spikes(tensor, times, rate, time, np.array([1, 1, -1, -1]), figure := Figure())
    felt, _, mean, bar = figure.axes
    np.testing.assert_array_equal(felt.images[0].get_array(), tensor)
    assert felt.images[0].get_extent() == [3.0, 5.5, 0.5, 2.5]
    assert felt.images[0].get_clim() == (-np.abs(tensor).max(), np.abs(tensor).max())
    np.testing.assert_allclose(
        read(mean.lines[0]), np.column_stack([time, rate.sum(axis=0) / 4])
    )
    assert (bar.get_ylabel(), mean.get_ylabel()) == ("angle [°]", "mean rate [Hz]")


@pytest.mark.parametrize("side", ["right", "left"])
def test_a_wall_that_slid_has_left_the_antenna_as_it_is_in_the_end(side):
    """Two motions of three samples: the last ones, and no place of a bend without contact."""
    antenna, rng = cockroach(), np.random.default_rng(1)
    angles = rng.uniform(-0.02, 0.03, (2, 3, antenna.n_segments))
    motions = tuple(SimpleNamespace(angle=angle) for angle in angles)
    distance = np.array([[9.0, 8.0, 7.0], [6.0, 5.0, 4.0]])
    posture = Posture(side=side, prebend="none")
    touch = WallTouch(
        antenna=antenna, posture=posture, motions=motions, distance=distance, speed=0.3
    )
    shapes = Shapes.of_slides(touch)
    np.testing.assert_array_equal(shapes.points, touch.points[:, -1])
    np.testing.assert_array_equal(shapes.wall, posture.sign * distance[:, -1])
    np.testing.assert_array_equal(shapes.contact, touch.contact[:, -1])
    np.testing.assert_array_equal(np.isfinite(shapes.peak).all(axis=1), touch.contact[:, -1])


@pytest.mark.parametrize("side", [1, -1], ids=["right", "left"])
def test_a_wall_that_comes_nearer_is_drawn_where_it_stands(ax, side):
    walls, points = side * np.array([9.0, 7.0, 5.0]), np.arange(18.0).reshape(3, 3, 2)
    met = np.ones(3, dtype=bool)
    shapes = Shapes(points=points, wall=walls, peak=points[:, 1], contact=met, inverted=met)
    plot_approach({"a": shapes}, [ax], every=2)
    drawn = [line for line in ax.lines if line.get_linestyle() == "--"]
    assert [line.get_xdata()[0] for line in drawn] == walls[::2].tolist()
    assert [text.get_text() for text in ax.figure.legends[0].get_texts()] == [
        *("9", "5"),
        "greatest bend",
    ]


def make_dispersion(values):
    average = {
        group: Interval(estimate=v.mean(), low=v.min(), high=v.mean() + 0.01)
        for group, v in values.items()
    }
    return SimpleNamespace(
        groups=tuple(values),
        values=lambda index, group: values[group],
        average={"nmi": average},
    )


def test_closest_matches_stand_above_their_group_with_their_interval(ax):
    values = {"fast": np.array([0.2, 0.4]), "slow": np.array([0.5, 0.9])}
    plot_index(make_dispersion(values), "nmi", ax)
    assert [label.get_text() for label in ax.get_xticklabels()] == ["fast", "slow"]
    for place, (bars, (group, found)) in enumerate(
        zip(ax.containers, values.items(), strict=True)
    ):
        middle, _, (error,) = bars
        assert bars.get_label() == group
        np.testing.assert_allclose(read(middle), [[place + 0.28, found.mean()]])
        ends = error.get_segments()[0][:, 1]
        np.testing.assert_allclose(ends, [found.min(), found.mean() + 0.01])
    dots = [read(line) for line in ax.lines if line.get_marker() == "."]
    for place, (drawn, found) in enumerate(zip(dots, values.values(), strict=True)):
        np.testing.assert_array_equal(drawn[:, 1], found)
        assert np.all(np.abs(drawn[:, 0] - place) <= 0.15)


def test_bases_name_lags_in_milliseconds(ax):
    plot_bases({"M = 1": np.ones((1, 4, 8))}, 3.0, ax)
    assert name(ax) == ("lag [ms]", "sensor (base → tip upwards)")
    assert [label.get_text() for label in ax.get_xticklabels()] == [
        "0",
        "21",
    ]  # the last of 8 lags


def test_the_wall_s_map_shows_what_was_fitted_and_what_was_not(ax):
    distance, position = np.array([20.0, 15.0, 10.0, 5.0]), np.array([30.0, 20.0, 10.0, 1.0])
    used = np.array([True, True, True, False])
    found = _fit_distance(distance, position, used, ~used, resolution=0.1)
    fig3.plot_maps({"linear": found}, ax)
    fitted, rest, line, _ = ax.lines
    np.testing.assert_array_equal(read(fitted), np.column_stack([position, distance])[:3])
    np.testing.assert_array_equal(read(rest), [[1.0, 5.0]])
    np.testing.assert_allclose(read(line), [[10, 10], [30, 20]])
    assert name(ax) == ("point of greatest curvature [mm from base]", "wall distance [mm]")
    assert fitted.get_label() == "linear: R² 1.000"


def test_robot_s_tensors_are_in_degrees(ax):
    fig6.plot_tensor(np.deg2rad([[1.0, 2.0], [3.0, 4.0]]), ax, "", limit=5.0)
    (image,) = ax.get_images()
    np.testing.assert_allclose(image.get_array(), [[1, 2], [3, 4]])
    assert (image.norm.vmin, image.norm.vmax) == (-5, 5) and list_tensors(ax.figure)[0][
        "unit"
    ] == "°"


def test_lengths_are_in_per_cent_of_the_antenna():
    figure, data = Figure(), figS1.compute(seed=1)
    figS1.plot(data, figure)
    (ax,) = figure.axes
    lines = {line.get_label(): read(line) for line in ax.lines}
    np.testing.assert_allclose(lines["planted"][:, 1], 100 * cockroach().segment_length / 42.0)
    np.testing.assert_allclose(lines["mean"][:, 1], 100 * data.fit.share.mean(axis=0))
    np.testing.assert_allclose(lines["sigmoid"][:, 0], (np.arange(140) + 0.5) / 140)
    assert name(ax) == ("segment number / number of segments", "share of the length [%]")


@pytest.mark.parametrize("sensors", [1, 2, 3, 8])
def test_no_tick_of_a_tensor_lies_between_two_sensors(ax, sensors):
    plot_tensor(np.zeros((sensors, 4)), np.arange(4.0), ax, Normalize(0, 1))
    low, high = ax.get_ylim()
    ticks = [tick for tick in ax.get_yticks() if low <= tick <= high]
    assert ticks and set(ticks) <= set(range(1, sensors + 1))
