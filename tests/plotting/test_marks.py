"""A colour that nothing names is found."""

import pytest
from matplotlib.figure import Figure

from feeler.plotting.words import find_unnamed


def draw(how):
    figure = Figure()
    ax = figure.subplots()
    ax.set_title("panel")
    ax.plot([0, 1, 2], [1, 0, 2], color="#d55e00", label="slow")
    ax.plot([0, 1, 2], [1, 1, 1], color="#888888")
    how(figure, ax)
    return find_unnamed(figure)


@pytest.mark.parametrize(
    ("how", "found"),
    [
        (lambda figure, ax: None, {}),
        (
            lambda figure, ax: ax.bar([0, 1], [1, 2], color="#0072b2"),
            {"panel": ["#0072b2", "#d55e00"]},
        ),
        (
            lambda figure, ax: (ax.scatter([0], [1], color="#0072b2"), ax.legend()),
            {"panel": ["#0072b2"]},
        ),
        (
            lambda figure, ax: (ax.plot([], [], "s", color="#0072b2", label="fast"), ax.legend()),
            {},
        ),
        (
            lambda figure, ax: (
                ax.plot([1], [2], "s", color="#0072b2"),
                ax.text(1, 2, "fast", color="#0072b2"),
                figure.legend(*ax.get_legend_handles_labels()),
            ),
            {},
        ),
        (lambda figure, ax: ax.scatter([0, 1, 3], [1, 2, 0], c=[0.1, 0.5, 0.9]), {}),
    ],
    ids=["one colour", "no legend", "left out", "in the legend", "words of its colour", "a map"],
)
def test_colours_without_a_name_are_found(how, found):
    assert draw(how) == found
