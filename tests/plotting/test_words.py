"""What cannot be read in a figure is found."""

import numpy as np
import pytest
from matplotlib.figure import Figure

from tests.figures import measure_words


@pytest.mark.parametrize(("width", "least"), [(180 / 25.4, 7.0), (2 * 180 / 25.4, 3.5)])
def test_letters_are_measured_at_the_width_of_a_page(width, least):
    figure = Figure(figsize=(width, 3.0))
    figure.text(0.2, 0.5, "seven", fontsize=7.0)
    figure.text(0.7, 0.5, "nine", fontsize=9.0)
    assert measure_words(figure) == {"least": least, "over": []}


@pytest.mark.parametrize(
    ("x", "y", "shown", "over"),
    [
        (0.31, 0.5, True, [["here", "there"]]),
        (0.31, 0.5, False, []),
        (0.8, 0.5, True, []),
        (0.31, 0.9, True, []),
    ],
)
def test_a_text_on_another_is_found_while_it_is_shown(x, y, shown, over):
    figure = Figure(figsize=(7.0, 3.0))
    figure.text(0.3, 0.5, "here")
    figure.text(x, y, "there", visible=shown)
    assert measure_words(figure)["over"] == over


def test_labels_of_ticks_beyond_the_axes_are_no_words():
    figure = Figure(figsize=(7.0, 3.0))
    left, right = figure.subplots(1, 2, gridspec_kw={"wspace": 0.0})
    left.set(xticks=[0.0, 0.5, 1.0], xticklabels=["none", "half", "whole"])
    left.set_xlim(0.0, 0.95)
    right.set(xlim=(0.0, 1.0), xticks=[0.05], xticklabels=["little"], yticks=[])
    assert measure_words(figure)["over"] == []
    left.set_xlim(0.0, 1.0)
    assert measure_words(figure)["over"] == [["whole", "little"]]


@pytest.mark.parametrize(("numbers", "crowded"), [(3, 0), (14, 13), (40, 39)])
def test_numbers_that_read_as_one_are_found(numbers, crowded):
    figure = Figure(figsize=(4.0, 2.0))
    ax = figure.add_axes((0.1, 0.3, 0.8, 0.6))
    places = np.linspace(0.0, 1.0, numbers)
    ax.set(xlim=(0, 1), xticks=places, xticklabels=["0.00"] * numbers, yticks=[])
    assert len({*map(str, measure_words(figure)["over"])}) == (crowded > 0)
