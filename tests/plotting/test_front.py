"""Points of a front that show their antenna: where they stand and how high they go."""

import numpy as np
from matplotlib.figure import Figure

from feeler.plotting.antennas import HEIGHT, WIDTH, plot_profile_points


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
