"""Planted touches: what a window cuts, which it makes the same, and complete touches at equal
sample counts.
"""

import numpy as np
import pytest
import xarray as xr

from feeler.tensors.schema import label_units
from paper.window import (
    complete_arrays,
    cut_to_contact,
    cut_to_motion,
    cut_window,
    keep_whole,
    measure_window,
    resample,
)

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
