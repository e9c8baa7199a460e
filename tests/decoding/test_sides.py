"""Classifiers and indices of mirror images, all signs changed, give the same answers."""

import numpy as np
import pytest
import xarray as xr

from feeler.analysis import INDICES, compute_dispersion, compute_information
from feeler.decoding import READERS, PeakEncoder

CLASSES = np.repeat(["ball", "box", "peg"], 12)


def make_touches(seed=0):
    """Three classes of lumps with bending both ways, in noise (trial, sensor, time)."""
    rng = np.random.default_rng(seed)
    time, place = np.arange(20.0), np.arange(6.0)[:, None]
    lumps = [
        np.exp(-((place - 1.0 - k) ** 2) - ((time - 6.0 - k) / 3.0) ** 2)
        - 0.4 * np.exp(-((place - 3.0) ** 2) - ((time - 13.0) / 3.0) ** 2)
        for k in range(3)
    ]
    return np.repeat(lumps, 12, axis=0) + 0.3 * rng.normal(size=(36, 6, 20))


@pytest.mark.parametrize("name", ["lda", "svm", "templates", "stream", "ideal"])
def test_a_classifier_of_mirror_images_gives_the_answers_of_the_originals(name):
    learned, asked = make_touches(), make_touches(1)
    answers = [
        READERS[name]().fit(sign * learned, CLASSES).predict(sign * asked) for sign in (1, -1)
    ]
    np.testing.assert_array_equal(*answers)
    assert len({*map(str, answers[0])}) == 3


@pytest.mark.parametrize("index", list(INDICES))
def test_an_index_of_mirror_images_is_that_of_the_originals(index):
    touches = make_touches() / 2
    found, other = (
        compute_dispersion(sign * touches, indices=[index]).average[index][""].estimate
        for sign in (1, -1)
    )
    assert other == pytest.approx(found, rel=1e-9)


def test_mirror_images_convey_as_much():
    bits = [compute_information(sign * make_touches()[::12], 0.5).bits for sign in (1, -1)]
    assert bits[0] == pytest.approx(bits[1], rel=1e-9) and bits[0] > 0


def test_a_peak_is_where_a_touch_bends_most_from_whichever_side():
    """Of labelled touches, one alone or among others."""
    touches = make_touches()[:4]
    sides = ["left", "right", "right", "left"]
    sign = np.array([1, -1, -1, 1])[:, None, None]
    given = xr.DataArray(
        sign * touches, {"side": ("trial", sides)}, ("trial", "sensor", "time")
    )
    np.testing.assert_array_equal(PeakEncoder(0)(given), PeakEncoder(0)(touches))
    np.testing.assert_array_equal(PeakEncoder(0)(given[:1]), PeakEncoder(0)(touches[:1]))
