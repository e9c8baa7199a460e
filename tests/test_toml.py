"""Laws of the TOML door: what is written is read again; what does not fit is named."""

import tomllib
from typing import Annotated

import numpy as np
import pytest

from feeler.errors import InvalidInput
from feeler.files import make_record, parse_toml, read_toml, save_toml, write_toml
from feeler.records import Gt, Record, Registry, Unit


class Ball(Record):
    """An object."""

    radius: Annotated[float, Gt(0), Unit("mm")]


class Task(Record):
    """What may be met."""

    ball: Ball
    others: tuple[Ball, ...] = ()
    speeds: tuple[float, ...] = (0.3,)
    note: str | None = None


class Plan(Record):
    """A file."""

    task: Task
    name: str = "plan"
    places: Annotated[np.ndarray, "place 2"] | None = None


PLAN = Plan(task={"ball": {"radius": 1 / 3}, "speeds": [0.1] * 12}, places=[[1, 2], [3, 4]])


def test_a_record_is_read_as_it_was_written(tmp_path):
    save_toml(PLAN.to_plain(), tmp_path / "plan.toml")
    assert make_record(Plan, read_toml(tmp_path / "plan.toml"), "plan.toml") == PLAN


@pytest.mark.parametrize(
    "content",
    [
        {},
        {"a": 1, "b": 2.5, "c": True, "d": 'say "é"\n\x7f', "e": [], "f": [1, 2]},
        {"a": 1e300, "b": [0.1 * k for k in range(30)], "c": [["x"], [1.0]]},
        {"a": {"b": {"c": 1}, "d": {}}, "e": {"f": -0.0}, "g": {"h": float("inf")}},
    ],
)
def test_plain_data_come_back(content):
    assert tomllib.loads(write_toml(content)) == content


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("name = 3", "a.toml needs task."),
        ("[task]", "a.toml: [task] needs ball."),
        ("[task]\nball = 3", "a.toml: [task] ball must be a Ball, got 3."),
        ("[task.ball]\nradius = -1", "a.toml: [task.ball] radius must be > 0 mm, got -1."),
        ("[task.ball]\nsize = 1", "a.toml: [task.ball] has no 'size'; valid: radius."),
        (
            "[task.ball]\nradius = 1\n[[task.others]]\nradius = 1\n[[task.others]]\nradius = -1",
            "a.toml: [task.others.2] radius must be > 0 mm, got -1.",
        ),
        ("colour = 1", "a.toml has no 'colour'; valid: task, name, places."),
        ("name = 3\n[task.ball]\nradius = 1", "a.toml: name must be text, got 3."),
        ("name = ", "a.toml is not valid TOML: Invalid value"),
        ("name = " + "[" * 100_000, "a.toml is not valid TOML"),
    ],
)
def test_what_does_not_fit_is_named_with_file_and_table(tmp_path, text, words):
    (tmp_path / "a.toml").write_text(text)
    with pytest.raises(InvalidInput) as caught:
        make_record(Plan, read_toml(tmp_path / "a.toml"), "a.toml")
    assert str(caught.value).startswith(words)


def test_a_schema_is_asked_for_and_left_out(tmp_path):
    (tmp_path / "a.toml").write_text('schema = "feeler.plan/1"\nname = "x"')
    assert read_toml(tmp_path / "a.toml", schema="feeler.plan/1") == {"name": "x"}
    with pytest.raises(
        InvalidInput, match=r"a.toml: schema must be 'feeler.robot/1', got 'feel"
    ):
        read_toml(tmp_path / "a.toml", schema="feeler.robot/1")


def test_a_file_that_cannot_be_written_stays_as_it_was(tmp_path):
    with pytest.raises(InvalidInput, match="cannot write"):
        save_toml({}, tmp_path / "absent" / "a.toml")
    with pytest.raises(InvalidInput, match="no valid Unicode"):
        save_toml({"a": "\ud800"}, tmp_path / "a.toml")
    assert [*tmp_path.iterdir()] == []


def test_a_text_of_any_length_is_parsed():
    assert parse_toml("a = [" + "1," * 20_000 + "]")["a"] == [1] * 20_000


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
