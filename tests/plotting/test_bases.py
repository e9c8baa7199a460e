"""Bases as one picture: each on its own scale, shorter ones beside longer ones."""

import numpy as np
from matplotlib.figure import Figure

from feeler.plotting.results import plot_bases
from feeler.plotting.style import set_decades, style


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
