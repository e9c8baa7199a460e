"""Classifiers and indices of mirror images, all signs changed, give the same answers."""

import numpy as np
import xarray as xr

from feeler.decoding import PeakEncoder


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
