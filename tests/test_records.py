"""Laws of a record: its fields are what their annotations say, and it never changes."""

import copy
import dataclasses
import pickle
from collections.abc import Callable
from typing import Annotated, ClassVar, Literal

import numpy as np
import pytest

from feeler.errors import InvalidInput
from feeler.provenance import to_jsonable
from feeler.records import ALLOW_NAN, Choice, Ge, Gt, Le, Len, Lt, Record, Unit
from feeler.validation import checked

SHAPES = {"ball": 1, "box": 2}


class Contact(Record):
    """Of a number of every kind."""

    stiffness: Annotated[float, Gt(0), Unit("N/mm")]
    friction: Annotated[float, Ge(0)] = 0.4
    angle: Annotated[float, Gt(0), Lt(180), Unit("degrees"), "90 is perpendicular"] = 90
    count: Annotated[int, Ge(1), Le(9)] = 3
    side: Literal["left", "right"] = "left"
    shape: Annotated[str, Choice(SHAPES)] = "ball"
    name: Annotated[str, Len(0, 5)] = ""
    deep: bool = False
    open: Annotated[float, ALLOW_NAN] = 0.0
    kind: ClassVar[str] = "contact"


class Task(Record):
    """Of records, rows and arrays."""

    contact: Contact = dataclasses.field(default_factory=lambda: Contact(stiffness=1.0))
    others: tuple[Contact, ...] = ()
    pair: tuple[float, float] | None = None
    speeds: Annotated[tuple[Annotated[float, Gt(0)], ...], Len(1)] = (0.3,)
    factors: dict[str, float] = dataclasses.field(default_factory=dict)
    path: Annotated[np.ndarray, "point 2", Gt(0), Unit("mm")] | None = None
    mass: Annotated[np.ndarray, "segment?"] = 1.0
    hinges: Annotated[np.ndarray, "sensor", int] = (1, 2)
    gaps: Annotated[np.ndarray, ALLOW_NAN] = (np.nan,)
    other: complex | None = None
    call: Callable | None = None


class Range(Record, kw_only=False):
    """Two fields that must agree."""

    low: float
    high: float = 2.0

    def _check(self) -> None:
        if self.low > self.high:
            raise InvalidInput(f"Range needs low ≤ high, got {self.low} and {self.high}.")


GOOD = [
    (Contact, {"stiffness": np.float32(2), "count": np.int64(4), "deep": np.True_}),
    (Contact, {"stiffness": np.array([1, 2])[0], "open": np.nan, "shape": "box"}),
    (Task, {"pair": [1, 2]}),
    (Task, {"pair": np.array([1, 2]), "speeds": [np.float64(1)], "path": [[1, 2]], "mass": 3}),
    (
        Task,
        {"contact": {"stiffness": 3}, "others": [{"stiffness": 1}], "other": 1j, "call": abs},
    ),
]
BAD = [
    (Contact, "stiffness", -1, "must be > 0 N/mm, got -1."),
    (Contact, "stiffness", "1", "must be a number > 0 N/mm, got '1'."),
    (Contact, "stiffness", True, "must be a number > 0 N/mm, got True."),
    (Contact, "stiffness", np.nan, "must be finite and > 0 N/mm, got nan."),
    (Contact, "angle", 200, "must be > 0 and < 180 degrees (90 is perpendicular), got 200."),
    (Contact, "count", 10, "must be from 1 to 9, got 10."),
    (Contact, "count", 2.5, "must be a whole number from 1 to 9, got 2.5."),
    (Contact, "side", "up", "must be one of left, right, got 'up'."),
    (Contact, "shape", "egg", "must be one of ball, box, got 'egg'."),
    (Contact, "shape", ["egg"], "must be one of ball, box, got ['egg']."),
    (Contact, "name", "too long", "must be text of at most 5 characters, got 'too long'."),
    (Contact, "deep", 1, "must be True or False, got 1."),
    (Task, "pair", (1,), "must be 2 numbers, got (1,)."),
    (Task, "pair", (1, "a"), "must be 2 numbers, got (1, 'a')."),
    (Task, "pair", {1.0, 2.0}, "must be 2 numbers, got {1.0, 2.0}."),
    (Task, "pair", bytearray(b"ab"), "must be 2 numbers, got bytearray(b'ab')."),
    (Task, "pair", np.ma.array([1.0, 2.0], mask=[0, 1]), "must be 2 numbers, got [1.0, None]."),
    (
        Task,
        "path",
        np.ma.array([[1.0, 2.0]], mask=[[0, 1]]),
        "must be an array of numbers, got"
        " an array with 1 masked entries; leave those out, or fill them.",
    ),
    (Task, "speeds", np.array(3.0), "must be 1 or more numbers > 0, got 3.0."),
    (Task, "speeds", [], "must be 1 or more numbers > 0, got []."),
    (Task, "speeds", [1] * 20 + [-1], "must be 1 or more numbers > 0, got -1 in place 21."),
    (Task, "factors", {"a": "b"}, "must be a table of numbers, got {'a': 'b'}."),
    (Task, "contact", 3, "must be a Contact, got 3."),
    (Task, "path", [1, 2], "must be an array (point, 2), got shape (2,)."),
    (Task, "path", [[1, 2, 3]], "must be an array (point, 2), got shape (1, 3)."),
    (Task, "path", [[1, 2], [1, -1]], "must be finite and > 0 mm, got -1.0 in point 2."),
    (Task, "path", "ab", "must be an array of numbers, got 'ab'."),
    (Task, "mass", [[1]], "must be an array (segment?), got shape (1, 1)."),
    (Task, "mass", np.nan, "must be finite, got nan."),
    (Task, "other", "a", "must be a complex, got 'a'."),
    (Task, "call", 3, "must be something to call, got 3."),
]
WHOLE = [
    (Contact, {}, "Contact needs stiffness."),
    (Range, {}, "Range needs low."),
    (Range, {"low": 1, "top": 2}, "Range has no 'top'; valid: low, high."),
    (Range, {"low": 3}, "Range needs low ≤ high, got 3.0 and 2.0."),
    (Task, {"contact": {"stiffness": -1}}, "Contact.stiffness must be > 0 N/mm, got -1."),
    (Task, {"contact": {"size": 1}}, "Contact has no 'size'; valid: stiffness, friction"),
    (Task, {"others": [{"stiffness": -2}]}, "Contact.stiffness must be > 0 N/mm, got -2."),
]
WHOLE += [
    (kind, {"stiffness": 1} | {name: value} if kind is Contact else {name: value},
     f"{kind.__name__}.{name} {words}")
    for kind, name, value, words in BAD
]  # fmt: skip


@pytest.mark.parametrize(("kind", "fields"), GOOD)
def test_what_fits_is_taken(kind, fields):
    assert isinstance(kind(**fields), kind)


@pytest.mark.parametrize(("kind", "fields", "words"), WHOLE)
def test_what_does_not_fit_is_said_in_a_sentence(kind, fields, words):
    with pytest.raises(InvalidInput) as caught:
        kind(**fields)
    assert str(caught.value).startswith(words)


def test_numbers_are_python_s_own_and_floats_where_floats_are_asked_for():
    contact = Contact(stiffness=np.float32(2), count=np.int64(4))
    assert [type(v) for v in (contact.stiffness, contact.count)] == [float, int]
    assert type(Contact(stiffness=2).stiffness) is float
    assert Task(pair=np.array([1, 2])).pair == (1.0, 2.0)


def test_arrays_are_read_only_copies():
    given = np.ones((3, 2))
    task = Task(path=given)
    given[:] = 5.0
    np.testing.assert_array_equal(task.path, 1.0)
    assert task.hinges.dtype == int
    with pytest.raises(ValueError, match="read-only"):
        task.path[0] = 2.0


def test_fields_cannot_be_set():
    with pytest.raises(dataclasses.FrozenInstanceError):
        Range(1.0).low = 0.0


def test_fields_are_given_by_name_unless_the_class_says_otherwise():
    assert Range(1.0, 3.0) == Range(low=1.0, high=3.0)
    with pytest.raises(
        InvalidInput, match="Contact takes its fields by name: stiffness, friction"
    ):
        Contact(1.0)
    with pytest.raises(InvalidInput, match="Range takes its fields by name: low, high"):
        Range(1.0, 2.0, 3.0)


TASK = Task(path=[[1, 2]], contact={"stiffness": 2}, others=[{"stiffness": 3}], pair=(1, 2))
COPIES = [
    copy.copy,
    copy.deepcopy,
    lambda task: pickle.loads(pickle.dumps(task)),
    lambda task: task.replace(),
    dataclasses.replace,
    lambda task: Task.from_plain(task.to_plain() | {"gaps": [np.nan]}),
]


@pytest.mark.parametrize("make", COPIES)
def test_copies_are_equal_and_frozen(make):
    task = TASK.replace(gaps=[1.0])
    twin = make(task).replace(gaps=[1.0])
    assert twin == task
    assert not make(task).path.flags.writeable


def test_records_without_dictionaries_go_into_sets():
    assert len({Contact(stiffness=1), Contact(stiffness=1.0), Contact(stiffness=2)}) == 2
    assert Contact(stiffness=1) != Range(1.0)


def test_a_changed_record_is_checked_again():
    assert Range(1.0).replace(high=5).high == 5.0
    with pytest.raises(InvalidInput, match="low ≤ high"):
        Range(1.0).replace(high=0)
    with pytest.raises(InvalidInput, match="has no 'top'"):
        Range(1.0).replace(top=0)


def test_dataclasses_and_provenance_understand_records():
    assert [field.name for field in dataclasses.fields(Range)] == ["low", "high"]
    assert to_jsonable(TASK)["path"] == [[1.0, 2.0]]
    assert to_jsonable(TASK)["contact"]["stiffness"] == 2.0
    assert repr(Range(1)) == "Range(low=1.0, high=2.0)"


def test_a_record_may_be_grown_by_a_record_or_by_a_plain_dataclass():
    class Longer(Range):
        step: Annotated[float, Gt(0)] = 0.1

    @dataclasses.dataclass(frozen=True, kw_only=True, eq=False)
    class Outside(Contact):
        extra: float = 0.0

    assert Longer(low=1.0, step=1).step == 1.0
    with pytest.raises(InvalidInput, match=r"Longer.step must be > 0, got 0\."):
        Longer(low=1.0, step=0)
    with pytest.raises(InvalidInput, match=r"Outside.extra must be a number"):
        Outside(stiffness=1, extra="a")


@pytest.mark.parametrize("values", [["1", 2.0], ["1", "2"], np.array(["1", "2"])])
def test_an_array_of_texts_is_no_array_of_numbers(values):
    class Row(Record):
        values: np.ndarray

    with pytest.raises(InvalidInput, match=r"values must be an array of numbers, got"):
        Row(values=values)


def read_state(changes, lacking=()):
    """A contact from what another version had pickled."""
    state = Contact(stiffness=2.0, friction=0.1).__getstate__() | changes
    contact = Contact.__new__(Contact)
    contact.__setstate__({key: value for key, value in state.items() if key not in lacking})
    return contact


@pytest.mark.parametrize(("changes", "lacking"), [({}, ("stiffness",)), ({"width": 1.0}, ())])
def test_what_another_version_pickled_is_refused(changes, lacking):
    with pytest.raises(InvalidInput, match="another version of feeler pickled this Contact"):
        read_state(changes, lacking)


class Row(Record):
    values: Annotated[np.ndarray, "place", Len(2, 3)]


@checked
def _take(values: Annotated[np.ndarray, Len(2)]) -> int:
    return len(values)


@pytest.mark.parametrize("n", [0, 1, 4])
def test_a_length_beside_an_array_holds(n):
    with pytest.raises(InvalidInput, match=r"array of 2 to 3 numbers, got shape \(\d,\)"):
        Row(values=np.zeros(n))
    if n < 2:
        with pytest.raises(InvalidInput, match="array of 2 or more numbers"):
            _take(np.zeros(n))


def test_an_array_of_a_right_length_is_taken():
    assert Row(values=[1.0, 2.0]).values.size == 2 and _take(np.zeros((5, 0))) == 5
    assert _take(np.full(2, np.nan)) == 2  # a length is no range
