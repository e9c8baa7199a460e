"""A colour that nothing names is found, and a legend on what is drawn."""

import pytest
from matplotlib.figure import Figure

from tests.figures import find_covered, find_unnamed, list_named


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
            lambda figure, ax: (
                ax.plot([], [], "s", color="#0072b2", label="fast"),
                ax.legend(),
            ),
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
    ids=[
        "one colour",
        "no legend",
        "left out",
        "in the legend",
        "words of its colour",
        "a map",
    ],
)
def test_colours_without_a_name_are_found(how, found):
    assert draw(how) == found


def test_a_colour_of_a_thing_is_named_where_it_stands():
    """Orange is a box: squares around what was classified correctly do not borrow it."""
    figure = Figure()
    left, right = figure.subfigures(1, 2)
    (ax := left.subplots()).plot([0, 1], [0, 1], color="#e69f00", label="box")
    ax.legend()
    (other := right.subplots()).plot([0, 1], [0, 1], "s", mec="#e69f00", mfc="none")
    other.set_title("classified correctly", loc="left")
    assert find_unnamed(figure) == {"classified correctly": ["#e69f00"]}
    other.text(0, 1, "box", color="#e69f00")
    assert find_unnamed(figure) == {}


@pytest.mark.parametrize(
    "how",
    [
        lambda ax: ax.errorbar([0.5], [0.1], [0.8], color="#0072b2", label="few sets"),
        lambda ax: ax.plot([0, 1], [0, 1], color="#0072b2", label="few sets"),
        lambda ax: ax.plot([0.5], [0.5], "o", color="#0072b2", label="few sets"),
        lambda ax: ax.scatter([0.5], [0.5], color="#0072b2", label="few sets"),
        lambda ax: ax.bar([0.5], [1.0], color="#0072b2", label="few sets"),
        lambda ax: ax.fill_between([0, 1], [0, 0], [1, 1], color="#0072b2", label="few sets"),
    ],
    ids=["bars", "line", "mark", "point", "bar", "band"],
)
def test_a_legend_that_lies_on_what_is_drawn_is_found(how):
    ax = (figure := Figure()).subplots()
    how(ax)
    ax.set(xlim=(0, 1), ylim=(0, 1))
    ax.axhline(0.5, color="#888888")  # a guide may pass below it
    ax.legend(loc="center")
    assert find_covered(figure) == ["few sets"]
    assert list_named(figure) == {"few sets": ["#0072b2"]}
    ax.legend(loc="lower center", bbox_to_anchor=(0.5, 1.05))
    assert find_covered(figure) == []
