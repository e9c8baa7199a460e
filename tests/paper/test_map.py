"""Planted bases and codes: when and where they act, and which contacts drive them."""

from itertools import product
from types import SimpleNamespace

import numpy as np
import pytest
import xarray as xr
from matplotlib.colors import Normalize
from matplotlib.figure import Figure

from feeler.decoding.sweeps import Plan
from feeler.experiments.tactile import touch
from feeler.objects import Ball, Trial
from feeler.presets import cockroach
from feeler.report import Section
from feeler.tensors.schema import label_units
from feeler.tensors.transforms import compute_bend, reconstruct_posture
from paper import fig5
from paper.data import (
    complete_arrays,
    cut_to_contact,
    cut_to_motion,
    cut_window,
    keep_whole,
    measure_window,
    resample,
)
from paper.fig1 import draw_moment
from paper.fig4 import compute_map as compute
from paper.fig4 import list_values, measure_margin, span, tabulate_bases

LAGS = (2, 11, 29)
PLACES = (0.5, 0.6, 0.7, 0.9)
DRIVEN = {0.5: 0, 0.6: 1, 0.7: 1, 0.9: 2}


class PlantedEncoder:
    """Bases that act at one sensor and one lag each; a trial's code is the basis it is told."""

    def __init__(self, driven):
        bases = np.zeros((3, 5, 40))
        for k, lag in enumerate(LAGS):
            bases[k, 2 * k, lag] = 1.0
        self.restart_components_ = np.stack([bases, np.roll(bases, 1, axis=2)])
        self.driven = driven

    def transform(self, data, code):
        assert code == "ridge"
        codes = np.zeros((len(self.driven), 3, 6))
        codes[np.arange(len(self.driven)), self.driven, 1] = 1.0
        return codes


def measure(locations, driven):
    return compute(PlantedEncoder(driven), np.zeros((len(driven), 5, 60)), np.array(locations))


def test_every_start_says_when_and_where_its_bases_act():
    locations = np.repeat(PLACES, 3)
    found = measure(locations, [DRIVEN[place] for place in locations])
    np.testing.assert_allclose(found.lag, [LAGS, np.add(LAGS, 1)])
    np.testing.assert_allclose(found.place, [[0.0, 0.5, 1.0]] * 2)
    np.testing.assert_allclose(found.margin, 1.0)
    assert max(one.p_information for one in found.mappings) < 0.01


def test_the_table_of_bases_is_the_best_start_s_which_comes_first():
    one = SimpleNamespace(share=np.array([[0.7, 0.3], [0.2, 0.8]]), locations=(0.5, 0.9))
    mappings = [SimpleNamespace(**vars(one), p_information=p) for p in (0.01, 0.2)]
    starts = {"lag": [[1.0, 2.0], [3.0, 5.0]], "place": [[0.1, 0.4], [0.6, 0.9]]}
    arrays = {name: np.array(values) for name, values in starts.items()}
    found = SimpleNamespace(
        **arrays, span=np.ones((2, 2)), margin=np.ones(2), mappings=mappings
    )
    tabulate_bases(section := Section(name="some", title="Some", folder=None), found)
    assert section.blocks[-1]["rows"] == [
        ["1", "1", "0.1", "0.7", "0.2"],
        ["2", "2", "0.4", "0.3", "0.8"],
    ]


@pytest.mark.parametrize("basis", [0, 1, 2])
def test_a_basis_that_every_contact_drives_knows_no_place(basis):
    assert (measure(np.repeat(PLACES, 3), [basis] * 12).margin <= 0).all()


@pytest.mark.parametrize(
    ("share", "margin"),
    [
        ([[0.7, 0.2, 0.1], [0.1, 0.3, 0.6]], 0.3),
        ([[0.5, 0.1, 0.4], [0.4, 0.0, 0.6]], 0.1),  # its own share at the other end counts too
        ([[0.2, 0.7, 0.1], [0.1, 0.3, 0.6]], -0.5),
        ([[0.1, 0.3, 0.6], [0.7, 0.2, 0.1]], -0.6),  # the mirror image: 0.1 − 0.7
    ],
)
def test_the_margin_is_the_least_of_four(share, margin):
    assert measure_margin(np.array(share)) == pytest.approx(margin)


def test_the_values_span_the_starts_and_say_how_many_there_are():
    locations = np.repeat(PLACES, 3)
    values = list_values(measure(locations, [DRIVEN[place] for place in locations]))
    # of 29 and 30: Student's t for one degree of freedom is 12.706 at 95 %
    half = 12.7062 * np.sqrt(0.5) / np.sqrt(2)
    expected = {"value": 29.5, "low": 29.5 - half, "high": 29.5 + half, "n": 2}
    assert values["encoding.lag.3"] == pytest.approx(expected, rel=1e-5)
    assert values["encoding.location_p"]["n"] == 2
    assert span(np.array([1.0])) == {"value": 1.0, "n": 1}
    assert "undefined" in span(np.array([1.0, np.nan]))


@pytest.fixture(scope="module")
def touched():
    """An antenna, a touch of it and what its sensors recorded."""
    trial = Trial(feature=Ball(radius=1.5), location=0.5, speed=0.6)
    return cockroach(), trial, touch(cockroach(), trial, duration=40.0)


def test_the_antenna_stands_where_the_touch_has_bent_it(touched):
    antenna, trial, tensors = touched
    ax, now = Figure().subplots(), 25
    drawn = draw_moment(antenna, trial, tensors, now, ax, Normalize(0, 1))
    points = np.array(drawn.colours.get_segments())
    truth = reconstruct_posture(tensors, antenna).values[0, now]
    np.testing.assert_allclose(points[:, 0], truth[:-1])
    np.testing.assert_allclose(drawn.colours.get_array(), compute_bend(tensors, antenna)[now])
    place = ax.patches[0].get_path().vertices.mean(axis=0)
    assert abs(place[1] - 0.5 * antenna.length) < 0.5  # mm, it flies on at this height


TIME = np.arange(800.0)


def make_touches(spans, angle=None):
    """One touch for each list of (begin, end) of its contacts [ms]."""
    force = np.zeros((len(spans), TIME.size, 2))
    for trial, contacts in enumerate(spans):
        for begin, end in contacts:
            force[trial, begin:end, 0] = 1.0
    angle = force[:, None, :, 0] if angle is None else angle
    n = len(spans)
    dataset = xr.Dataset(
        {
            "force": (("trial", "time", "axis"), force),
            "angle": (("trial", "sensor", "time"), angle),
        },
        coords={
            "time": TIME,
            "feature": ("trial", ["ball"] * n),
            "size": ("trial", [1.5] * n),
            "location": ("trial", np.linspace(0.5, 0.9, n)),
        },
    )
    return label_units(dataset)


def test_a_touch_that_begins_again_is_cut_although_it_is_out_of_contact_when_the_window_closes():
    found = measure_window(make_touches([[(10, 300)], [(10, 300), (500, 600)], [(10, 450)]]))
    assert (found.cut, found.again, found.end) == (2, 1, 600.0)


def test_touches_that_differ_only_after_the_window_are_one_in_it():
    found = measure_window(make_touches([[(10, 500)], [(10, 600)], [(10, 200)]]))
    assert found.pairs == 1 and found.ceiling == pytest.approx(2 / 3)


def test_a_window_ends_before_its_last_moment_and_samples_may_be_longer():
    """Contact at 380 ms itself is after a window of 380 ms; with a sample every 2 ms the end is 2
    ms after the last.
    """
    found = measure_window(make_touches([[(379, 380)], [(379, 381)], [(10, 20)]]))
    assert (found.cut, found.again, found.end) == (1, 0, 381.0)
    tensors = make_touches([[(10, 301)], [(20, 40)]]).isel(time=slice(None, None, 2))
    assert measure_window(tensors).end == 302.0
    shorter = measure_window(tensors, duration=100.0)
    assert (shorter.cut, shorter.pairs, shorter.ceiling) == (1, 0, 1.0)


def test_a_recording_that_begins_later_ends_later():
    tensors = make_touches([[(10, 301)], [(20, 40)]]).assign_coords(
        time=("time", TIME + 5.0, {"units": "ms"})
    )
    assert measure_window(tensors).end == 306.0


def test_touches_without_any_contact_end_at_once():
    found = measure_window(make_touches([[], []]))
    assert (found.cut, found.again, found.end, found.pairs, found.ceiling) == (
        0,
        0,
        1.0,
        1,
        0.5,
    )


def test_a_straight_line_stays_one_at_any_number_of_samples():
    angle = np.broadcast_to(TIME / 800, (1, 2, 800))
    found = resample(make_touches([[(0, 500)]], angle), end=600.0, n_samples=380)
    array = found["angle"].values
    assert array.shape == (1, 2, 380)
    np.testing.assert_allclose(array[0, 0], np.arange(380) * (600 / 380) / 800)


def test_every_profile_has_its_own_window_and_the_same_samples():
    arrays, labels = complete_arrays(
        {"a": make_touches([[(0, 300)]] * 2), "b": make_touches([[(0, 700)]] * 2)}
    )
    assert {array.shape for array in arrays.values()} == {(2, 1, 380)} and labels.shape == (2,)
    assert max(array.max() for array in arrays.values()) == 1
    np.testing.assert_array_equal(
        arrays["a"] > 0.5, arrays["b"] > 0.5
    )  # both are in contact to the end of their window


def test_a_touch_is_cut_to_its_window_to_all_touches_to_its_contact_and_to_its_motion():
    angle = np.zeros((3, 1, TIME.size))
    angle[0, 0, 100:200], angle[0, 0, 200:260] = 1.0, 0.02  # contact, then the swing after it
    angle[0, 0, 260:] = 0.005  # too little to be motion
    angle[1, 0, 90:500] = -1.0  # bends the other way only
    touches = make_touches([[(100, 200)], [(90, 120), (300, 500)], []], angle)
    assert cut_window(touches).shape == (3, 1, 380) and keep_whole(touches).shape == (3, 1, 500)
    assert cut_window(touches).min() == 0.0
    assert [part.shape for part in cut_to_contact(touches)] == [(1, 100), (1, 410), (1, 1)]
    assert [part.shape for part in cut_to_motion(touches)] == [(1, 160), (1, 1), (1, 1)]


PLAN = Plan(ratios=(0.01,), n_repeats=1, n_copies=4, probe=0.01)
TRIALS = list(product(("ball", "box"), (1.5, 3.0), (0.5, 0.6, 0.7)))


def make_tensors(blind):
    """A blip for every trial, in a place of its own for each value of each attribute but the
    ``blind`` one.
    """
    angle = np.zeros((len(TRIALS), 3, 12))
    for trial, (feature, size, location) in enumerate(TRIALS):
        values = (feature == "box", size == 3.0, round(10 * location - 5))
        for sensor, (name, value) in enumerate(
            zip(("feature", "size", "location"), values, strict=True)
        ):
            angle[trial, sensor, 0 if name == blind else 4 * int(value) + 2] = 1.0
    features, sizes, locations = zip(*TRIALS, strict=True)
    trial = {"feature": list(features), "size": list(sizes), "location": list(locations)}
    return xr.Dataset(
        {"angle": (("trial", "sensor", "time"), angle)},
        coords={k: ("trial", v) for k, v in trial.items()},
    )


@pytest.mark.parametrize(("blind", "split"), [("size", "size"), ("location", "place")])
def test_a_new_value_of_what_is_not_felt_costs_nothing(blind, split):
    found = fig5.classify_new(make_tensors(blind), PLAN)
    assert found.accuracy[split] == 1.0 and found.change[blind] == 0.0
    assert list(found.parts[split].values()) == pytest.approx([1.0, 1.0])


def test_a_change_is_a_share_of_the_norm_and_neighbouring_places_only_are_compared():
    change = fig5.classify_new(make_tensors(None), PLAN).change
    assert all(
        value == pytest.approx(np.sqrt(2 / 3)) for value in change.values()
    )  # one of three blips moves
    assert fig5.classify_new(make_tensors(None), PLAN).chance == {
        "size": pytest.approx(1 / 6),
        "place": pytest.approx(1 / 4),
    }
