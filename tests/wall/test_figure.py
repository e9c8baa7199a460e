"""Fig. 3 and its table from one small run."""

import numpy as np
from matplotlib.figure import Figure

from feeler.paper import fig3
from feeler.paper.fig3_cases import tabulate
from feeler.paper.fig3_shapes import Shapes, plot_shapes
from feeler.presets import cockroach
from feeler.scale import SCALES
from feeler.wall import DISTANCES, Posture, approach, compare


def test_figure_3_draws_what_was_computed():
    data = fig3.compute({"exponential": cockroach()}, effort=SCALES["smoke"], timestep=0.1)
    figure = Figure(figsize=(7, 8))
    fig3.plot(data, figure)
    assert data.slides.make_dataset()["distance"].values.tolist() == sorted(fig3.SLIDE_DISTANCES, reverse=True)
    assert np.array_equal(data.maps["exponential"].used, data.sweeps["exponential"].inverted)
    assert len(figure.axes) == 6 and data.cases == []


def test_every_distance_is_drawn_with_its_wall():
    sweep = approach(cockroach(), Posture(side="left"))
    shapes = Shapes.of_sweep(sweep)
    ax = Figure().subplots()
    plot_shapes({"exponential": shapes, "again": shapes}, ax)
    walls, lines = ax.collections
    assert len(lines.get_segments()) == len(walls.get_segments()) == 2 * len(DISTANCES)
    for k, (line, wall) in enumerate(zip(lines.get_segments(), walls.get_segments(), strict=True)):
        gap = line[:, 0].min() - wall[0, 0]  # the wall is on the left: no node behind it, and one on it in contact
        assert gap > 0 and (gap < 0.4) == sweep.contact[k % len(DISTANCES)]
    assert [label.get_text() for label in ax.get_yticklabels()] == ["exponential", "again"]


def test_table_rows_say_undefined_and_never_zero():
    posture = Posture(prebend="none", friction=0.0)
    cases = compare({"constant": cockroach("constant")}, [posture], distances=(12.0, 9.0, 6.0))
    rows = tabulate(cases)
    assert len(rows) == 3
    for row in rows:
        assert (row["r2"] is None) == bool(row["undefined"])
    assert any(row["r2"] is None for row in rows)
