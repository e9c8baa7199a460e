"""What arguments and fields may be: annotations, checked once at public doors, and words for what
is wrong.
"""

import collections.abc
import functools
import inspect
import itertools
import math
import os
import types
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import is_dataclass
from pathlib import Path
from typing import Annotated, Any, Literal, TypeVar, Union, get_args, get_origin, get_type_hints

import numpy as np
from annotated_types import GroupedMetadata, Len, MaxLen, MinLen

from feeler.errors import InvalidInput, OutOfMemory

# What an annotation allows: for pydantic, which checks, and in words, for whoever gave another.
#
# The words of an annotation are made here from the annotation alone, whatever library checks
# it.

ALLOW_NAN = object()
"""Beside the annotation of a number or an array: inf and NaN may stand here."""
_WORDS = {
    float: ("a number", "numbers"),
    int: ("a whole number", "whole numbers"),
    bool: ("True or False", "values True or False"),
    str: ("text", "texts"),
    Path: ("a path", "paths"),
    type(None): ("None", "None"),
}
_SIGNS = {"gt": ">", "ge": "≥", "lt": "<", "le": "≤", "multiple_of": "a multiple of"}
_TESTS = {"gt": np.greater, "ge": np.greater_equal, "lt": np.less, "le": np.less_equal}
_OUTSIDE = ("greater_than", "less_than", "multiple_of", "finite_number")
_LONG = 8  # of a longer list, a message shows the item that is wrong


class Wrong(InvalidInput):
    """What is wrong with a value: a sentence that lacks its subject, the name of the field."""


class Unit(str):
    """The unit of a number, for messages: ``Annotated[float, Gt(0), Unit("mm")]``."""


class _Rule:
    """What stands beside an annotation and reads the values itself."""

    def read(self, value: Any) -> Any:
        """The value as the field holds it."""
        raise NotImplementedError

    def __get_pydantic_core_schema__(self, source: Any, handler: Any) -> Any:
        return make_schema(self.read)


class Of:
    """The type of an array's values where it is not float: ``Annotated[np.ndarray, Of(int)]``."""

    def __init__(self, dtype: type) -> None:
        self.dtype = dtype


class OneOf(_Rule):
    """One of some names: ``Annotated[str, OneOf(SHAPES)]``, also of a set that grows later."""

    def __init__(self, names: Collection[str]) -> None:
        self.names = names

    def read(self, value: Any) -> str:
        """The name, if it is one of them."""
        if not isinstance(value, str) or value not in self.names:
            raise Wrong(f"must be {self}, got {show(value)}")
        return value

    def __str__(self) -> str:
        return f"one of {', '.join(map(str, self.names))}"


class _Kind(_Rule):
    """Objects of a class that is no record: they are taken as they are."""

    def __init__(self, kind: type) -> None:
        told = getattr(kind, "_is_runtime_protocol", not getattr(kind, "_is_protocol", False))
        self.kind = kind if told else object

    def read(self, value: Any) -> Any:
        """The object itself."""
        if not isinstance(value, self.kind):
            raise Wrong(f"must be {name_class(self.kind)}, got {show(value)}")
        return value


class _Array(_Rule):
    """A read-only array, with what stands beside its annotation: dimensions, range, type."""

    def __init__(self, beside: list[Any]) -> None:
        self.dims = next((text.split() for text in beside if type(text) is str), None)
        self.dtype = next((item.dtype for item in beside if isinstance(item, Of)), float)
        self.bounds = [item for item in beside if type(item) is not str]
        self.finite = ALLOW_NAN not in beside

    def read(self, value: Any) -> np.ndarray:
        """A read-only copy of the values."""
        try:
            if value is None or isinstance(value, str | bytes | Mapping):
                raise TypeError
            if self.dtype is not str and np.asarray(value).dtype.kind in "US":
                raise TypeError  # NumPy would read "1" as a number
            array = freeze(value, self.dtype)
        except (TypeError, ValueError, OverflowError):
            kind = _WORDS.get(self.dtype, ("", "values"))[1]
            raise Wrong(f"must be an array of {kind}, got {show(value)}") from None
        if self.dims is not None and not self._fits(array.shape, self.dims):
            raise Wrong(f"must be an array ({', '.join(self.dims)}), got shape {array.shape}")
        if array.dtype.kind in "iuf":
            self._check_range(array)
        return array

    @staticmethod
    def _fits(shape: tuple[int, ...], dims: list[str]) -> bool:
        if "..." in dims:
            return len(shape) >= len(dims) - 1
        if all(dim.endswith("?") for dim in dims[: len(dims) - len(shape)]):
            dims = dims[max(len(dims) - len(shape), 0) :]
        return len(shape) == len(dims) and all(
            not dim.isdigit() or int(dim) == size for dim, size in zip(dims, shape, strict=True)
        )

    def _check_range(self, array: np.ndarray) -> None:
        allowed = np.isfinite(array) if self.finite else np.ones(array.shape, dtype=bool)
        for bound, key in itertools.product(self.bounds, _TESTS):
            if hasattr(bound, key):
                within = _TESTS[key](array, getattr(bound, key))
                allowed &= within | (np.isnan(array) & (not self.finite))
        if not allowed.all():
            first = np.unravel_index(int(np.argmin(allowed)), allowed.shape)
            words = _say_range(self.bounds, ["finite"] if self.finite else [])
            dims = [dim.rstrip("?") for dim in self.dims or ()][-array.ndim :]
            named = zip(dims, first, strict=False)
            place = "".join(f", {dim} {k + 1}" for dim, k in named if dim.isalpha())
            raise Wrong(f"must be {words}, got {array[first]}{place.replace(',', ' in', 1)}")


class Rules:
    """Annotations by name, those of a record's fields for example; ``name`` is whose they are."""

    def __init__(self, name: str, hints: dict[str, Any]) -> None:
        # Loaded here, at the first record that is made: it takes 60 ms, and many a program makes
        # none.
        from pydantic import ConfigDict, TypeAdapter
        from typing_extensions import TypedDict

        self.name, self.hints = name, hints
        make_table: Any = TypedDict
        table = make_table(name, {key: _prepare(hint) for key, hint in hints.items()})
        table.__pydantic_config__ = ConfigDict(
            arbitrary_types_allowed=True, allow_inf_nan=False
        )
        self._validate = TypeAdapter(table).validator.validate_python
        self._arrays = {key for key, hint in hints.items() if _mentions(hint, np.ndarray)}

    def read(self, given: dict[str, Any]) -> dict[str, Any]:
        """The values as their annotations say.

        Raises
        ------
        InvalidInput
            One is not what its annotation says.
        """
        from pydantic import ValidationError

        plain = {key: v if key in self._arrays else _unwrap(v) for key, v in given.items()}
        try:
            return self._validate(plain)
        except ValidationError as error:
            raise self._explain(error.errors(), plain) from None

    def _explain(self, errors: list[Any], given: dict[str, Any]) -> InvalidInput:
        """What is wrong with the first value that is."""
        for error in errors:
            inner = error.get("ctx", {}).get("error")
            if isinstance(inner, InvalidInput) and not isinstance(inner, Wrong):
                places = (part for part in error["loc"] if isinstance(part, int))
                inner.tables = (error["loc"][0], *(k + 1 for k in places), *inner.tables)
                return inner
        found = InvalidInput(self._say_wrong(errors, given))
        found.subject = self.name
        return found

    def _say_wrong(self, errors: list[Any], given: dict[str, Any]) -> str:
        field = errors[0]["loc"][0]
        errors = [error for error in errors if error["loc"][0] == field]
        subject = f"{self.name}.{field}"
        said = errors[0].get("ctx", {}).get("error")
        if said is not None and (len(errors) == 1 or not isinstance(said, Wrong)):
            return f"{subject} {said}." if isinstance(said, Wrong) else f"{subject}: {said}."
        hint, value = _drop_none(self.hints[field]), given[field]
        base, bounds = _split(hint)
        lone = base in (int, float) or isinstance(value, float)
        if lone and errors[0]["type"].startswith(_OUTSIDE):
            finite = ["finite"] if errors[0]["type"] == "finite_number" else []
            return f"{subject} must be {_say_range(bounds, finite)}, got {show(value)}."
        shown = show(value)
        places = [part for part in errors[0]["loc"][1:] if isinstance(part, int)]
        if places and isinstance(value, Sequence) and len(value) > _LONG:
            shown = f"{show(value[places[0]])} in place {places[0] + 1}"
        return f"{subject} must be {_say_rules(hint)}, got {shown}."


def make_schema(read: Callable[[Any], Any]) -> Any:
    """What pydantic calls to have a value read by ``read``."""
    from pydantic_core import core_schema

    return core_schema.no_info_plain_validator_function(read)


def _prepare(hint: Any) -> Any:
    """An annotation for pydantic, in which a text that looks like a number is none."""
    from pydantic import AllowInfNan, Strict

    base, beside = _split(hint)
    if base is np.ndarray:
        return Annotated[np.ndarray, _Array(beside)]
    if beside:
        rules = [AllowInfNan(True) if item is ALLOW_NAN else item for item in beside]
        return Annotated[_prepare(base), *(item for item in rules if not isinstance(item, str))]
    if hint in (float, int, bool, str):
        return Annotated[hint, Strict()]
    origin, inner = get_origin(hint), get_args(hint)
    if origin in (Union, types.UnionType):
        return Union[tuple(_prepare(option) for option in inner)]  # noqa: UP007
    if isinstance(origin, type) and origin is not type and issubclass(origin, Collection):
        return origin[tuple(item if item is Ellipsis else _prepare(item) for item in inner)]  # type: ignore[index]
    if isinstance(hint, type) and not hasattr(hint, "__get_pydantic_core_schema__"):
        known = issubclass(hint, Path | types.NoneType | Collection) or hint is Any
        return hint if known else Annotated[hint, _Kind(hint)]
    return hint


def _split(hint: Any) -> tuple[Any, list[Any]]:
    """An annotation without what stands beside it, and that."""
    if get_origin(hint) is not Annotated:
        return hint, []
    base, *beside = get_args(hint)
    flat: list[Any] = []
    for item in beside:
        flat += item if isinstance(item, GroupedMetadata) else [item]
    return base, flat


def _drop_none(hint: Any) -> Any:
    if get_origin(hint) in (Union, types.UnionType):
        return Union[tuple(option for option in get_args(hint) if option is not type(None))]  # noqa: UP007
    return hint


def _mentions(hint: Any, kind: type) -> bool:
    return hint is kind or any(_mentions(item, kind) for item in get_args(hint))


def _unwrap(value: Any) -> Any:
    """NumPy's numbers and rows as Python's, also within lists and tuples."""
    if isinstance(value, np.generic | np.ndarray):
        return value.tolist()
    nested = np.generic | np.ndarray | list | tuple
    if type(value) in (list, tuple) and any(isinstance(item, nested) for item in value):
        return type(value)(_unwrap(item) for item in value)
    return value


def freeze(values: object, dtype: type = float) -> np.ndarray:
    """A read-only copy of ``values``.

    Raises
    ------
    InvalidInput
        They are no array of this type.
    """
    try:
        array: np.ndarray = np.array(values, dtype=dtype)
    except (TypeError, ValueError, OverflowError) as error:
        kind = _WORDS.get(dtype, ("", "values"))[1]
        raise InvalidInput(f"an array of {kind} is needed, got {show(values)}.") from error
    array.setflags(write=False)
    return array


def _say_rules(hint: Any, many: bool = False) -> str:
    """An annotation in words."""
    base, beside = _split(hint)
    origin, inner = get_origin(base), get_args(base)
    if found := next((item for item in beside if isinstance(item, OneOf)), None):
        return str(found)
    if origin is Literal:
        return f"one of {', '.join(map(str, inner))}"
    if origin in (Union, types.UnionType):
        return " or ".join(dict.fromkeys(_say_rules(option, many) for option in inner))
    length, limits = _say_length(beside), _say_range(beside, [])
    if base is str and length:
        return f"text of {length} characters"
    if base in _WORDS:
        return f"{_WORDS[base][many]} {limits}".strip()
    if origin is tuple and Ellipsis not in inner:
        kinds = dict.fromkeys(_say_rules(item, many=True) for item in inner)
        said = f"{len(inner)} {' and '.join(kinds)} {limits}".strip()
        return f"rows of {said}" if many else said
    if isinstance(origin, type) and issubclass(origin, Mapping):
        return f"a table of {_say_rules(inner[1], many=True)}"
    if isinstance(origin, type) and issubclass(origin, Collection):
        return f"{length or 'a list of'} {_say_rules(inner[0], many=True)} {limits}".strip()
    if base is np.ndarray:
        return "an array"
    if many and isinstance(base, type):
        return f"{base.__name__} objects"
    return name_class(base if isinstance(base, type) else Callable)


def _say_range(beside: list[Any], words: list[str]) -> str:
    """Limits, unit and remark: "finite and > 0 mm"."""
    limits = {
        key: getattr(item, key) for item in beside for key in _SIGNS if hasattr(item, key)
    }
    if limits.keys() >= {"ge", "le"}:
        words = [*words, f"from {limits.pop('ge'):g} to {limits.pop('le'):g}"]
    words = [*words, *(f"{_SIGNS[key]} {limit:g}" for key, limit in limits.items())]
    units = [item for item in beside if isinstance(item, Unit)]
    remarks = [f"({item})" for item in beside if type(item) is str]
    return " ".join([" and ".join(words), *units, *remarks]).strip()


def _say_length(beside: list[Any]) -> str:
    low = max((item.min_length for item in beside if isinstance(item, MinLen)), default=0)
    high = min((item.max_length for item in beside if isinstance(item, MaxLen)), default=None)
    if high is None:
        return f"{low} or more" if low else ""
    if low == 0:
        return f"at most {high}"
    return f"{low}" if low == high else f"{low} to {high}"


def name_class(kind: Any) -> str:
    """A class in words: "a Trial", "an Antenna"."""
    if kind is Callable:
        return "something to call"
    name = kind.__name__.lstrip("_")
    return f"{'an' if name[0] in 'AEIOU' else 'a'} {name}"


def show(value: Any) -> str:
    """A value as a message shows it."""
    if isinstance(value, np.ndarray):
        return f"an array of {value.dtype} and shape {value.shape}"
    if isinstance(value, float) and not math.isfinite(value):
        return str(value)
    text = repr(value).replace("\n", " ")
    return text if len(text) <= 80 else f"{text[:77]}…"


# ``@checked``: arguments of public functions are what their annotations say, or the caller
# reads which one is not.
#
# One rule for all: a number may be Python's or NumPy's, an array anything that NumPy makes real
# numbers of, a path text or ``os.PathLike``, a sequence any list, tuple or array of what it
# says. ``Annotated[np.ndarray, "trial sensor time"]`` is an array of three dimensions, "...
# segment" one of at least one, "corner 2" one whose rows have two numbers; a dimension that two
# arguments name has one size in both. ``Annotated[int, "≥ 0"]`` or ``"> 0"`` is a number in
# that range, and ``Annotated[str, OneOf(("a", "b"))]`` one of these names. Other values (files
# that must be there) are checked by the functions themselves.

_Test = Callable[[Any], bool]
F = TypeVar("F", bound=Callable)
_ITEMS = 1000  # of a long sequence, the first so many are looked at
_LONGEST = 255  # bytes of a file's name on all usual systems
_MAX_BITS = 128  # of a whole number: seeds of NumPy have as many
_PLAIN = {
    float: ("a number", (int, float, np.integer, np.floating)),
    int: ("a whole number", (int, np.integer)),
    bool: ("True or False", (bool, np.bool_)),
    str: ("text", (str,)),
}
_LISTS = (
    list,
    tuple,
    set,
    frozenset,
    collections.abc.Sequence,
    collections.abc.Iterable,
    collections.abc.Collection,
)


def checked(target: F) -> F:
    """A function whose arguments are checked at each call, or a class whose ``__init__`` does so.

    Raises
    ------
    InvalidInput
        When called: an argument is not of its annotated type; names function, parameter, what was
        got and what is right.
    """
    if isinstance(target, type):
        target.__init__ = _wrap(target.__init__, target.__qualname__)  # type: ignore[misc]
        return target
    return _wrap(target, target.__qualname__)


def _wrap(function: F, name: str) -> F:
    parameters = list(inspect.signature(function).parameters.values())
    positional = [
        p.name for p in parameters if p.kind in (p.POSITIONAL_ONLY, p.POSITIONAL_OR_KEYWORD)
    ]

    @functools.cache
    def find_tests() -> dict[str, tuple[_Test, str]]:
        """Resolved at the first call, when the modules that annotations name are there."""
        hints = _resolve(function)
        named = {
            p.name: hints[p.name]
            for p in parameters
            if p.name in hints and p.kind not in (p.VAR_KEYWORD, p.VAR_POSITIONAL)
        }
        optional = {p.name for p in parameters if p.default is None}
        return {
            key: _make_test(hint | None if key in optional else hint)
            for key, hint in named.items()
        }

    @functools.cache
    def find_dims() -> dict[str, list[str]]:
        found = {key: _list_dims(hint) for key, hint in _resolve(function).items()}
        return {key: dims for key, dims in found.items() if dims}

    @functools.wraps(function)
    def call(*args: Any, **kwargs: Any) -> Any:
        tests, given = find_tests(), dict(zip(positional, args, strict=False)) | kwargs
        for key, value in given.items():
            found = tests.get(key)
            if found is not None and not found[0](value):
                raise InvalidInput(f"{name}: {key} must be {found[1]}, got {_shorten(value)}.")
        if dims := find_dims():
            _check_sizes(name, {key: d for key, d in dims.items() if key in given}, given)
        try:
            return function(*args, **kwargs)
        except OutOfMemory:
            raise
        except MemoryError as error:
            words = f"{name}: not enough memory ({error or 'no more to be had'}); ask for less."
            raise OutOfMemory(words) from error

    call.find_tests = find_tests  # type: ignore[attr-defined]
    return call  # type: ignore[return-value]


def _resolve(function: Callable) -> dict[str, Any]:
    try:
        hints = get_type_hints(function, include_extras=True)
    except NameError:  # a name that only type checkers import
        hints = {
            key: hint
            for key, hint in function.__annotations__.items()
            if not isinstance(hint, str)
        }
    return {key: hint for key, hint in hints.items() if key != "return"}


def _make_test(hint: Any) -> tuple[_Test, str]:
    """Whether a value fits an annotation, and its words; what is not understood fits."""
    origin, inner = get_origin(hint), get_args(hint)
    if origin in (Union, types.UnionType):
        paths = {*inner} & {os.PathLike, Path}  # a text beside them is a path, too
        tests = [_make_test(option) for option in inner if not (paths and option is str)]
        return (lambda value: any(test(value) for test, _ in tests)), " or ".join(
            dict.fromkeys(words for _, words in tests)
        )
    if hint in (None, type(None)):
        return (lambda value: value is None), "None"
    if hint in (os.PathLike, Path):
        return _is_path, "a path that a file can have"
    if hint in _PLAIN:
        words, kinds = _PLAIN[hint]
        return (
            lambda value: (
                isinstance(value, kinds)
                and (hint is bool or not isinstance(value, bool))
                and not (isinstance(value, int) and value.bit_length() > _MAX_BITS)
            )
        ), words
    if hint is np.ndarray:
        return is_array, "an array of real numbers"
    if origin is Annotated and isinstance(inner[1], OneOf):
        names = inner[1].names
        return (lambda value: isinstance(value, str) and value in names), str(inner[1])
    if origin is Annotated and isinstance(inner[1], str):
        return _make_closer_test(inner[0], inner[1])
    if origin is Annotated and isinstance(inner[1], Len):
        test, words = _make_test(inner[0])
        least = inner[1].min_length
        return (lambda value: test(value) and len(value) >= least), f"{words}, {least} or more"
    if origin is Literal:
        return (lambda value: isinstance(value, str) and value in inner), str(OneOf(inner))
    if (origin or hint) in _LISTS:
        return _make_list_test(origin, inner)
    if origin is collections.abc.Callable or hint is Callable:
        return callable, "something to call"
    kind = origin or hint
    if not isinstance(kind, type) or kind in (object, Any):
        return (lambda value: True), "anything"
    if getattr(kind, "_is_protocol", False):
        return _make_protocol_test(kind)
    if issubclass(kind, collections.abc.Mapping) and inner:
        return _make_mapping_test(kind, inner)
    return (lambda value: isinstance(value, kind)), _say(kind)


def _make_protocol_test(kind: type) -> tuple[_Test, str]:
    """Something that has what a protocol asks for; a class has it not yet."""
    named = {name for name in {*vars(kind), *kind.__annotations__} if not name.startswith("_")}
    words = f"something with {', '.join(sorted(named))}" if named else "anything"
    return (
        lambda value: (
            not (isinstance(value, type) and named)
            and all(hasattr(value, name) for name in named)
        )
    ), words


def _make_mapping_test(kind: type, inner: tuple) -> tuple[_Test, str]:
    """A mapping whose keys and values are what it says."""
    (fits_key, key), (fits_value, value) = map(_make_test, inner)

    def test(given: Any) -> bool:
        return isinstance(given, collections.abc.Mapping) and all(
            fits_key(name) and fits_value(item)
            for name, item in itertools.islice(given.items(), _ITEMS)
        )

    return test, f"a mapping of {key} to {value}"


def _make_closer_test(hint: Any, more: str) -> tuple[_Test, str]:
    """An array of named dimensions, or a finite number in a range."""
    if hint is np.ndarray:
        dims = more.split()
        return (
            lambda value: is_array(value) and _has_shape(np.shape(value), dims)
        ), f"an array ({', '.join(dims)})"
    test, words = _make_test(hint)
    if hint is int and more == "> 0":  # a count, no seed
        return (lambda value: test(value) and 0 < value < 2**63), f"{words} > 0, below 2⁶³"
    reaches = {
        "≥ 0": lambda value: 0 <= value < np.inf,
        "> 0": lambda value: 0 < value < np.inf,
    }[more]
    return (lambda value: test(value) and bool(reaches(value))), f"{words} {more}"


def _has_shape(shape: tuple[int, ...], dims: list[str]) -> bool:
    """Whether there are as many dimensions as names; a name that is a number is a size."""
    enough = len(shape) >= len(dims) - 1 if "..." in dims else len(shape) == len(dims)
    sized = dims[: dims.index("...")] if "..." in dims else dims
    return enough and all(
        int(dim) == size for dim, size in zip(sized, shape, strict=False) if dim.isdigit()
    )


def _list_dims(hint: Any) -> list[str]:
    """The named dimensions of an array's annotation; none where another number may follow."""
    if get_origin(hint) is Annotated and get_args(hint)[0] is np.ndarray:
        dims = get_args(hint)[1].split()
        return [] if dims[0] == "..." else dims[: dims.index("...") if "..." in dims else None]
    return []


def _check_sizes(name: str, dims: dict[str, list[str]], given: dict[str, Any]) -> None:
    """Raise where two arguments, or two axes of one, name one dimension and differ in its size."""
    first: dict[str, tuple[str, int]] = {}
    for key, names in dims.items():
        for dim, size in zip(names, np.shape(given[key]), strict=False):
            other, same = first.setdefault(dim, (key, size))
            if size != same:
                both = f"two {dim} axes of one size" if other == key else f"one {dim} size"
                who = key if other == key else f"{other} and {key}"
                raise InvalidInput(f"{name}: {who} must have {both}, got {same} and {size}.")


def _make_list_test(origin: Any, inner: tuple) -> tuple[_Test, str]:
    fixed = origin is tuple and Ellipsis not in inner and bool(inner)
    items = [_make_test(item) for item in inner if item is not Ellipsis]
    # of a library's or of our own class, which no array of numbers holds
    objects = bool(inner) and getattr(inner[0], "__module__", "").startswith(
        ("feeler", "matplot")
    )
    words = f"{len(items)} values ({', '.join(w for _, w in items)})" if fixed else "a sequence"
    if items and not fixed:
        words += f", each {items[0][1]}"

    def test(value: Any) -> bool:
        if isinstance(value, str | bytes | collections.abc.Mapping) or not isinstance(
            value, collections.abc.Iterable
        ):
            return False
        if not isinstance(value, collections.abc.Sized):
            return not fixed  # a generator, which looking would empty
        if hasattr(value, "__array__") and not isinstance(value, np.ndarray):
            value = np.asarray(value)  # xarray's, whose items are arrays again
        if isinstance(value, np.ndarray) and (value.ndim == 0 or not items):
            return value.ndim > 0
        if objects and isinstance(value, np.ndarray) and value.dtype != object:
            return False
        if fixed:
            return len(value) == len(items) and all(
                t(item) for (t, _), item in zip(items, value, strict=True)
            )
        return not items or all(
            items[0][0](item) for _, item in zip(range(_ITEMS), value, strict=False)
        )

    return test, words


def is_array(value: Any) -> bool:
    """Whether NumPy makes an array of real numbers of it, none of which it would unmask."""
    if np.ma.is_masked(value):
        return False
    if not isinstance(value, np.ndarray):
        if value is None or isinstance(value, str | bytes | collections.abc.Mapping):
            return False
        try:
            value = np.asarray(value)
        except (TypeError, ValueError):
            return False
    return value.dtype.kind in "biuf"


def _is_path(value: Any) -> bool:
    """Whether a system could have a file of this name."""
    if not isinstance(value, str | os.PathLike):
        return False
    try:
        parts = Path(value).parts
        return all(len(os.fsencode(part)) <= _LONGEST and "\0" not in part for part in parts)
    except (TypeError, ValueError):
        return False


def _say(kind: type) -> str:
    made = "an object" if is_dataclass(kind) else "a value"
    return f"{made} of {kind.__module__.split('.')[0]}'s {kind.__name__}"


def _shorten(value: Any) -> str:
    if np.ma.is_masked(value):
        count = np.ma.count_masked(value)
        return f"an array with {count} masked entries; leave those out, or fill them"
    if isinstance(value, np.ndarray):
        return f"an array of {value.dtype} and shape {value.shape}"
    text = f"{type(value).__name__} {value!r}".replace("\n", " ")
    return text if len(text) <= 80 else text[:77] + "…"
