"""Registries: names, laziness, errors that list what is valid."""

import pytest

from feeler.errors import InvalidInput
from feeler.records import Registry


def test_entries_keep_their_order_and_are_found_by_name():
    shapes = Registry("shape")
    shapes.register("ball", 1)
    shapes.register("box", 2)
    assert list(shapes) == ["ball", "box"]
    assert shapes["box"] == 2
    assert "ball" in shapes
    assert len(shapes) == 2


def test_a_decorator_registers_and_gives_its_function_back():
    noises = Registry("noise model")

    @noises.register("white")
    def white():
        return "white"

    assert noises["white"] is white


def test_what_has_a_home_is_imported_when_asked_for():
    found = Registry("function", {"sqrt": "math:sqrt"})
    assert list(found) == ["sqrt"]
    assert found["sqrt"](9.0) == 3.0


@pytest.mark.parametrize("name", ["disc", None, 3, ["ball"]])
def test_an_unknown_name_lists_the_valid_ones(name):
    shapes = Registry("shape", {"ball": "math:pi", "box": "math:e"})
    with pytest.raises(InvalidInput, match=r"unknown shape .*; valid: ball, box"):
        shapes[name]


def test_a_name_is_given_once_and_can_be_taken_back():
    shapes = Registry("shape")
    shapes.register("ball", 1)
    with pytest.raises(InvalidInput, match="there already is a shape 'ball'"):
        shapes.register("ball", 2)
    with pytest.raises(InvalidInput, match="must be text"):
        shapes.register("", 2)
    shapes.unregister("ball")
    assert not shapes
    with pytest.raises(InvalidInput, match="unknown shape"):
        shapes.unregister("ball")
