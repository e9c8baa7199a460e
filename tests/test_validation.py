"""``@checked``: what fits passes as it is, what does not is named before anything runs."""

import sys
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import numpy as np
import pytest

from feeler import Antenna, presets
from feeler.errors import InvalidInput, OutOfMemory
from feeler.records import Choice
from feeler.validation import Count, checked


@checked
def measure(
    antenna: Antenna,
    values: np.ndarray,
    *,
    share: float = 0.5,
    count: int | None = None,
    pair: tuple[float, float] = (0.0, 1.0),
    names: Sequence[str] = (),
    table: Mapping[str, float] | None = None,
    path: Path | str = "",
    call: Callable[[int], int] | None = None,
    deep: bool = False,
):
    return "ran"


GOOD = [
    {"share": 1},
    {"share": np.float32(0.5)},
    {"share": np.int64(2)},
    {"count": None},
    {"count": np.int32(3)},
    {"pair": [0, 1]},
    {"pair": np.zeros(2)},
    {"names": ["a", "b"]},
    {"names": np.array(["a"])},
    {"table": {}},
    {"path": Path("a")},
    {"call": abs},
    {"deep": np.True_},
    {"values": [[1, 2], [3, 4]]},
    {"values": 3.0},
]
BAD = [
    ({"share": "x"}, "measure: share must be a number, got 'x'"),
    ({"share": True}, "share must be a number"),
    ({"share": None}, "share must be a number, got None"),
    ({"count": 1.5}, "count must be a whole number, got 1.5"),
    ({"pair": (0.0,)}, r"pair must be 2 numbers, got \(0.0,\)"),
    ({"pair": 1.0}, "pair must be 2 numbers, got 1.0"),
    ({"names": "abc"}, "names must be a list of texts"),
    ({"names": [1]}, "names must be a list of texts"),
    ({"table": [1]}, "table must be"),
    ({"path": 3}, "path must be"),
    ({"call": 3}, "call must be something to call, got 3"),
    ({"deep": 1}, "deep must be True or False"),
    ({"values": None}, "values must be an array"),
    ({"values": "x"}, "values must be an array"),
    ({"values": [[1], [1, 2]]}, "values must be an array"),
    ({"values": object()}, "values must be an array"),
    (
        {"antenna": "cockroach"},
        "antenna must be an Antenna, got 'cockroach'",
    ),
]


def call(**changes):
    arguments = {"antenna": presets.cockroach(), "values": np.zeros(3)} | changes
    return measure(arguments.pop("antenna"), arguments.pop("values"), **arguments)


@pytest.mark.parametrize("changes", GOOD, ids=str)
def test_what_fits_passes(changes):
    assert call(**changes) == "ran"


@pytest.mark.parametrize(("changes", "match"), BAD, ids=lambda x: str(x)[:30])
def test_what_does_not_fit_is_named(changes, match):
    with pytest.raises(InvalidInput, match=match):
        call(**changes)


def test_a_checked_class_checks_what_it_is_made_of():
    @checked
    @dataclass(frozen=True, kw_only=True)
    class Thing:
        size: float
        rng: np.random.Generator | None = None

    assert Thing(size=1).size == 1
    with pytest.raises(InvalidInput, match="Thing: size must be a number, got '1'"):
        Thing(size="1")
    with pytest.raises(InvalidInput, match="rng must be a Generator, got 3"):
        Thing(size=1, rng=3)


def test_a_name_that_only_type_checkers_import_is_not_judged():
    @checked
    def later(value: "Unknown", size: float):  # noqa: F821
        return size

    assert later(object(), 1.0) == 1.0


def test_checking_takes_few_calls():
    """Of some 0.1 µs each; a count, since the time depends on what else runs."""
    antenna, values, calls = presets.cockroach(), np.zeros(3), []
    options = {"share": 0.5, "pair": (0.0, 1.0), "names": ("a", "b"), "deep": True}
    measure(antenna, values, **options)
    sys.setprofile(lambda frame, event, arg: calls.append(event == "call"))
    try:
        measure(antenna, values, **options)
    finally:
        sys.setprofile(None)
    assert sum(calls) < 60


def test_one_of_some_names():
    @checked
    def turn(side: Annotated[str, Choice(("left", "right"))] = "left") -> str:
        return side

    assert turn("right") == "right"
    for wrong in ("up", 1, ["left"]):
        with pytest.raises(InvalidInput, match="turn: side must be one of left, right, got"):
            turn(wrong)


@checked
def match(
    first: Annotated[np.ndarray, "trial sensor"],
    second: Annotated[np.ndarray, "sensor lag"],
    table: Annotated[np.ndarray, "class class"] = np.eye(5),
    loose: Annotated[np.ndarray, "... sensor"] = np.ones(7),
):
    return "ran"


def test_a_dimension_that_two_arguments_name_has_one_size():
    assert match(np.ones((2, 3)), np.ones((3, 4)), loose=np.ones((8, 9))) == "ran"
    with pytest.raises(InvalidInput, match=r"first and second .* one sensor size, got 3 and 4"):
        match(np.ones((2, 3)), np.ones((4, 3)))
    with pytest.raises(InvalidInput, match=r"table must have two class axes .* got 2 and 3"):
        match(np.ones((2, 3)), np.ones((3, 4)), table=np.ones((2, 3)))


def test_a_name_beside_a_path_is_held_to_what_a_path_may_be():
    match = "path must be a path that a file can have"
    for name in ("a\0b", "\ud800", 256 * "a"):
        with pytest.raises(InvalidInput, match=match):
            measure(presets.cockroach(), 0.0, path=name)
    assert measure(presets.cockroach(), 0.0, path="a") == "ran"


def test_a_dimension_that_is_a_number_is_a_size():
    @checked
    def draw(corners: Annotated[np.ndarray, "corner 2"]):
        return "ran"

    assert draw(np.zeros((5, 2))) == "ran"
    for wrong in (np.zeros((5, 3)), np.zeros((1, 0)), [[]], np.zeros(2)):
        with pytest.raises(InvalidInput, match=r"corners must be an array \(corner, 2\)"):
            draw(wrong)


def test_a_count_is_no_number_that_nothing_can_count_to():
    @checked
    def copy(n: Count):
        return "ran"

    assert copy(2**63 - 1) == "ran"
    for wrong in (0, 2**63, -1, np.int8(-1)):
        with pytest.raises(InvalidInput, match=r"n must be > 0 and < 9\.22337e\+18"):
            copy(wrong)


def test_too_little_memory_is_said_once_by_whoever_asked_for_it():
    @checked
    def fill():
        return np.ones(2**52)

    @checked
    def outer():
        return fill()

    with pytest.raises(
        OutOfMemory, match=r"fill: not enough memory \(Unable to .*ask for less"
    ):
        outer()


@pytest.mark.parametrize(
    "make", [tuple, set, np.array, lambda items: dict.fromkeys(items).keys()]
)
def test_the_wrong_item_of_a_long_sequence_is_named(make):
    @checked
    def add(values: Collection[float]):
        return "ran"

    assert add(make([float(k) for k in range(20)])) == "ran"
    with pytest.raises(
        InvalidInput, match=r"add: values must be a list of numbers, got '.' in"
    ):
        add(make([chr(65 + k) for k in range(20)]))


def test_a_generator_is_not_emptied_and_a_long_sequence_is_not_read_to_its_end():
    class Endless(Sequence):
        def __len__(self):
            return 10**9

        def __getitem__(self, place):
            assert place <= 1000
            return 1.0

    @checked
    def first(values: Sequence[float]):
        return next(iter(values))

    assert first(value for value in (1.0, 2.0)) == 1.0
    assert first(Endless()) == 1.0
    with pytest.raises(InvalidInput, match="values must be a list of numbers, got 'ab'"):
        first("ab")


def test_a_mapping_is_no_object():
    with pytest.raises(InvalidInput, match=r"antenna must be an Antenna, got \{"):
        measure({"name": "a"}, 0.0)
