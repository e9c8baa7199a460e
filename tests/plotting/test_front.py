"""Points of a front that show their antenna: where they stand and how high they go."""

import numpy as np
from matplotlib.figure import Figure

from feeler.files import read_shipped
from feeler.plotting.antennas import HEIGHT, WIDTH, plot_profile_points
from feeler.presets import cockroach
from studies.design import front
from studies.design.section import _plot_fronts


def test_a_profile_stands_at_its_place_and_ten_times_as_stiff_is_its_height():
    ax = Figure().subplots()
    plot_profile_points(
        ax, [(2.0, 3.0), (4.0, 5.0)], [np.ones(3), np.array([1.0, 10.0, 100.0])], color="red"
    )
    level, rising = ax.collections[0].get_segments()
    np.testing.assert_allclose(level, [(-WIDTH / 2, 0), (0, 0), (WIDTH / 2, 0)])
    np.testing.assert_allclose(rising[:, 1], [0, HEIGHT, 2 * HEIGHT])
    np.testing.assert_allclose(ax.collections[0].get_offsets(), [(2, 3), (4, 5)])
    np.testing.assert_allclose(ax.lines[0].get_xydata(), [(2, 3), (4, 5)])


def test_the_stored_front_holds_no_beaten_design_and_the_picture_shows_it():
    stored = read_shipped("studies.design", "results.json")
    reference, figure = cockroach(), Figure()
    costs = np.array(stored["front"]["costs"])
    assert (
        len(front.find_front(costs))
        == len(costs)
        == len(stored["front"]["profiles"])
        == len(stored["front"]["x"])
    )
    _plot_fronts(stored, reference, figure)
    left, middle, right = figure.axes
    np.testing.assert_allclose(left.lines[0].get_xydata(), costs[:, 1::-1])
    np.testing.assert_allclose(middle.lines[0].get_xdata(), stored["front"]["force"])
    told = np.log2(18) - right.lines[0].get_ydata()
    np.testing.assert_allclose(told, stored["sensors"]["exponential"]["d-optimal"]["bits"])
    assert "settling time [ms]" in left.get_xlabel() and "[mN]" in middle.get_xlabel()
