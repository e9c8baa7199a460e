"""``@checked``: arguments of public functions are what their annotations say, or the caller reads
which one is not.

One rule for all: a number may be Python's or NumPy's, an array anything that NumPy makes real
numbers of, a path text or ``os.PathLike``, a sequence any list, tuple or array of what it says.
``Annotated[np.ndarray, "trial sensor time"]`` is an array of three dimensions, "... segment" one of
at least one, "corner 2" one whose rows have two numbers; a dimension that two arguments name has
one size in both.
``Annotated[int, "≥ 0"]`` or ``"> 0"`` is a number in that range, and
``Annotated[str, OneOf(("a", "b"))]`` one of these names. Other values
(files that must be there) are checked by the functions themselves.
"""

import collections.abc
import functools
import inspect
import itertools
import os
import types
from collections.abc import Callable
from dataclasses import is_dataclass
from pathlib import Path
from typing import Annotated, Any, Literal, TypeVar, Union, get_args, get_origin, get_type_hints

import numpy as np
from annotated_types import Len

from feeler.errors import InvalidInput, OutOfMemory
from feeler.records.rules import OneOf

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
