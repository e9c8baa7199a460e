"""Curves of few points are points; bars by themselves and unmarked lines are left as they are."""

import numpy as np
import pytest
from matplotlib.figure import Figure

from feeler.plotting.style import unjoin


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
