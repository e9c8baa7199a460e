"""What stands on an axis is the number that was computed, in the unit that the axis names."""

from itertools import combinations

import matplotlib as mpl
import numpy as np
import pytest
import xarray as xr
from matplotlib.colors import Normalize, to_hex, to_rgb
from matplotlib.figure import Figure

import feeler
from feeler import records as shown
from feeler.antenna.files import save_antenna
from feeler.cli.choose import name_antennas
from feeler.objects import Box
from feeler.plotting import tensors as touch_movie
from feeler.plotting.antennas import OBJECT_COLOUR, MovingAntenna, plot_profiles
from feeler.plotting.results import (
    plot_bases,
    plot_touch_spikes,
)
from feeler.plotting.style import (
    ANTENNA_COLOURS,
    BASIS_COLOURS,
    FEATURE_COLOURS,
    NOISE_COLOURS,
    PALETTE,
    PROFILE_COLOURS,
    pick_colours,
    set_decades,
    style,
    unjoin,
)
from feeler.plotting.tensors import list_tensors, plot_tensor, plot_tensor_grid, plot_touch
from feeler.presets import cockroach
from feeler.tensors.schema import label_units
from tests.tensors._touches import antenna


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
    values = np.array(place["values"])  # of the scale's colours: evenly spread over 0 to 11
    np.testing.assert_allclose(values, 11 * (np.arange(64) + 0.5) / 64, rtol=1e-3)
    assert place["unit"] == "/mm" and len(place["colours"]) == 3 * len(values)


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
    assert bar.get_ylabel().startswith("curvature [1/mm]\n") and "negative" in bar.get_ylabel()


@pytest.mark.parametrize(("last", "shown"), [(20, 20.9), (99, 99.0)])
def test_a_touch_is_shown_until_it_rests_and_a_quarter_of_its_peak_has_half_the_colour(
    last, shown
):
    values = np.zeros((1, 3, 100))
    values[0, 1, 5:last] = np.linspace(0.02, 0.4, last - 5)
    variables = {"curvature": (("trial", "sensor", "time"), values)}
    tensors = label_units(xr.Dataset(variables, {"time": np.arange(100.0)}))
    plot_touch(tensors, figure := Figure())
    ax = figure.axes[0]
    assert ax.get_xlim()[1] == pytest.approx(shown, abs=1.0)
    assert ("99 ms" in ax.get_xlabel()) == (shown < 99)
    np.testing.assert_allclose(ax.images[0].norm([0.0, 0.1, 0.4]), [0, 0.5, 1])


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
    assert [bar.get_ylabel().partition("\n")[0] for bar in figure.axes[4:]] == named


def test_what_is_felt_stands_above_its_spikes_and_the_mean_of_their_rates():
    time, rng = 3.0 + 0.5 * np.arange(6), np.random.default_rng(0)
    tensor, rate = rng.normal(size=(2, 6)), rng.uniform(5, 90, size=(4, 6))
    times = np.array([[3.5], [np.nan], [4.5], [5.0]])
    plot_touch_spikes(tensor, times, rate, time, np.array([1, 1, -1, -1]), figure := Figure())
    felt, _, mean, bar = figure.axes
    np.testing.assert_array_equal(felt.images[0].get_array(), tensor)
    # a sample's middle stands at its time, as in every other picture of a tensor
    assert felt.images[0].get_extent() == pytest.approx([2.75, 5.75, 0.5, 2.5])
    assert felt.images[0].get_clim() == (-np.abs(tensor).max(), np.abs(tensor).max())
    np.testing.assert_allclose(
        read(mean.lines[0]), np.column_stack([time, rate.sum(axis=0) / 4])
    )
    assert mean.get_ylabel() == "mean rate [Hz]" and bar.get_ylabel().startswith("angle [°]")


def test_each_basis_fills_its_place_up_to_its_own_greatest_value_and_no_more():
    ax = Figure().subplots()
    short, long = np.full((1, 2, 3), 0.5), np.arange(1.0, 25.0).reshape(2, 2, 6)
    plot_bases({"short": short, "long": long}, 1.0, ax)
    (image,) = ax.get_images()
    mosaic = np.ma.filled(image.get_array(), np.nan)
    upper, lower = mosaic[:2], mosaic[3:]  # a gap of one row and column between bases
    assert (
        np.nansum(upper) == 6 and np.isnan(upper[:, 3:]).all()
    )  # 2 sensors × 3 lags of 1; no second basis
    assert np.nanmax(lower[:, :6]) == np.nanmax(lower[:, 7:]) == 1
    np.testing.assert_array_equal(lower[:, :6], long[0][::-1] / long[0].max())  # tip upwards
    assert [label.get_text() for label in ax.get_yticklabels()] == ["short", "long"]


def test_decades_have_plain_numbers_and_nothing_between():
    with style():
        figure = Figure()
        ax = figure.subplots()
        ax.plot([0, 1], [1e-3, 1e2])
        set_decades(ax)
        figure.draw_without_rendering()
    assert {"0.001", "0.1", "10"} <= {label.get_text() for label in ax.get_yticklabels()}
    assert not ax.yaxis.get_minorticklocs().size


@pytest.mark.parametrize(("n_points", "joined"), [(2, False), (4, False), (5, True)])
def test_a_line_joins_five_points_and_more(n_points, joined):
    figure = Figure()
    ax = figure.subplots()
    (marked,) = ax.plot(np.arange(n_points), "o-", label="measured")
    (fitted,) = ax.plot([0, 1], [0, 1], "--")
    ax.bar([0, 1], [1, 2], yerr=[0.1, 0.1])
    ax.errorbar([0, 1], [1, 2], yerr=0.1, fmt="none")
    legend = ax.legend()
    unjoin(figure)
    assert (marked.get_linestyle() == "-") is joined
    assert (legend.get_lines()[0].get_linestyle() == "-") is joined
    assert fitted.get_linestyle() == "--"


MEANINGS = {
    "profiles": {*PROFILE_COLOURS.values()},
    "features": {*FEATURE_COLOURS.values()},
    "bases": {*BASIS_COLOURS},
    "noise": {*NOISE_COLOURS.values()},
    "others": {*PALETTE},
    "speeds": {to_hex(shade) for shade in mpl.colormaps["viridis"](np.linspace(0, 0.85, 3))},
    "what is touched": {OBJECT_COLOUR},
    "the antenna": {*ANTENNA_COLOURS},
}


@pytest.mark.parametrize(("one", "other"), [*combinations(MEANINGS, 2)])
def test_no_colour_has_two_meanings(one, other):
    assert not {*map(to_hex, MEANINGS[one])} & {*map(to_hex, MEANINGS[other])}


@pytest.mark.parametrize("names", [("uniform", "linear"), ("linear", "exponential", "uniform")])
def test_a_profile_keeps_its_colour_in_any_company(names):
    assert pick_colours(names) == {name: PROFILE_COLOURS[name] for name in names}


def test_the_slower_the_darker_in_any_order():
    found = pick_colours(["0.6 m/s", "0.06 m/s", "0.3 m/s"])
    light = [sum(to_rgb(found[name])) for name in ("0.06 m/s", "0.3 m/s", "0.6 m/s")]
    assert light == sorted(light) and len({*light}) == 3
    words = pick_colours(["fast", "slow", "medium"])
    assert [words[name] for name in ("slow", "medium", "fast")] == [
        found[name] for name in ("0.06 m/s", "0.3 m/s", "0.6 m/s")
    ]


def test_what_has_no_colour_of_its_own_takes_one_in_turn():
    names = ["a", "linear", "b", "exponential", "c", "d", "e"]
    found = pick_colours(names)
    assert list(found) == names and len({*found.values()}) == len(names)
    assert found["linear"] == PROFILE_COLOURS["linear"]
    assert pick_colours(names + names[::-1]) == found  # who is asked for twice has one colour
    assert pick_colours([]) == {}


def test_what_is_touched_has_one_colour_in_pictures_and_in_notebooks():
    assert shown.OBJECT == OBJECT_COLOUR and ANTENNA_COLOURS[0] == shown.INK


@pytest.mark.parametrize("name", [*PROFILE_COLOURS, *FEATURE_COLOURS, "slow", "mine"])
def test_an_antenna_of_one_s_own_takes_no_colour_that_means_something_else(name, tmp_path):
    """Not even where its file is called as something that has one."""
    save_antenna(cockroach(), path := tmp_path / f"{name}.toml")
    chosen = name_antennas(["exponential", str(path)])
    assert [*chosen] == ["exponential", name if name == "mine" else f"{name}.toml"]
    assert pick_colours(chosen)[[*chosen][1]] in PALETTE


TRIALS = [
    feeler.Trial(
        feature=Box(half_width=1.0, half_height=1.0),
        location=0.7,
        speed=0.4,
        lead=2.0,
        side=side,
    )
    for side in ("left", "right")
]


@pytest.fixture(scope="module")
def touches():
    options = {"duration": 40.0, "timestep": 0.02, "all_hinges": True}
    return [feeler.touch(antenna, trial, **options) for trial in TRIALS]


def draw(tensors):
    """The image and the label of its colours."""
    figure = Figure()
    plot_touch(tensors, figure)
    return figure.axes[0].images[0], figure.axes[1].get_ylabel()


def test_an_antenna_touched_on_both_sides_is_drawn_on_both(touches):
    """One touch from each side, one after the other, in a record that says no side."""
    left, right = (one.drop_vars("side") for one in touches)
    both = left.copy()
    both["curvature"] = left["curvature"] + right["curvature"].values[:, ::-1]
    image, label = draw(both)
    values = both["curvature"].values[0]
    top = np.abs(values).max()
    np.testing.assert_array_equal(image.get_array(), values)
    assert image.get_clim() == (-top, top) and "negative" not in label
    assert image.get_cmap().name != draw(left)[0].get_cmap().name


def test_a_record_without_a_side_hides_nothing(touches):
    """Of a touch from the right that does not say so, all is negative."""
    image, _ = draw(touches[1].drop_vars("side"))
    assert image.get_clim()[0] == -image.get_clim()[1] < 0


def test_a_film_of_a_touch_from_the_right_is_the_other_turned_over(touches, monkeypatch):
    films = []
    monkeypatch.setattr(touch_movie, "write_movie", lambda *given: films.append(given))
    for trial, tensors in zip(TRIALS, touches, strict=True):
        touch_movie.write_touch_movie(antenna, trial, tensors, "film.mp4", slower=10.0)
    seen = []
    for _, figure, move, count, *_ in films:
        move(count // 2)
        ax, tensor, _ = figure.axes
        line = ax.collections[1]
        places = np.array(line.get_segments())
        seen.append(
            (ax.get_xlim(), places, line.get_array(), line.get_clim(), tensor.images[0])
        )
    (wide, points, bend, scale, image), (other, mirrored, same, scale_too, image_too) = seen
    assert other == (-wide[1], -wide[0])
    np.testing.assert_allclose(mirrored, points * [-1, 1], atol=1e-9)
    np.testing.assert_allclose(same, bend, atol=1e-9)
    np.testing.assert_allclose(scale_too, scale, atol=1e-9)
    np.testing.assert_allclose(image_too.get_array(), image.get_array(), atol=1e-9)
    assert np.abs(points[..., 0]).max() > 1.0
