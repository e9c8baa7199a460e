"""What arguments and fields may be: annotations, checked once at public doors, and words for what
is wrong.
"""

import functools
import inspect
import itertools
import math
import os
import sys
import types
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence, Sized
from pathlib import Path
from typing import Annotated, Any, Literal, TypeVar, Union, get_args, get_origin, get_type_hints

import numpy as np
from annotated_types import Ge, GroupedMetadata, Gt, Lt, MaxLen, MinLen

from feeler.errors import InvalidInput, OutOfMemory

# What an annotation allows: a function that reads values so, and its words for an error.

ALLOW_NAN = object()
"""Beside the annotation of a number or an array: inf and NaN may stand here."""
_WORDS = {
    float: ("a number", "numbers"),
    int: ("a whole number", "whole numbers"),
    bool: ("True or False", "values True or False"),
    str: ("text", "texts"),
    Path: ("a path that a file can have", "paths"),
    os.PathLike: ("a path that a file can have", "paths"),
    type(None): ("None", "None"),
}
_SIGNS = {"gt": ">", "ge": "≥", "lt": "<", "le": "≤"}
_TESTS = {"gt": np.greater, "ge": np.greater_equal, "lt": np.less, "le": np.less_equal}
_TYPES: dict[Any, tuple[type, ...]] = {
    float: (int, float),
    int: (int,),
    bool: (bool,),
    str: (str,),
}
_UNLISTED = (str, bytes, bytearray, memoryview, Mapping)  # no lists, though one can go through
_LONG = 8  # of a longer list, a message shows the item that is wrong
_ITEMS = 1000  # of a long sequence among arguments, the first so many are read
_GREATEST = sys.float_info.max
_LONGEST = 255  # bytes of a file's name on all usual systems
F = TypeVar("F", bound=Callable)
Count = Annotated[int, Gt(0), Lt(2**63)]
"""A number of things."""
Seed = Annotated[int, Ge(0)]
"""A seed of random numbers."""


class FieldError(InvalidInput):
    """What is wrong with a value: a sentence that lacks its subject, the name of the field; empty
    where the annotation says it all, of a value or of ``shown`` in its place.
    """

    shown = ""
    final = False
    """Whether it says all of an item, too, and no list around it has better words."""


class Unit(str):
    """The unit of a number, for messages: ``Annotated[float, Gt(0), Unit("mm")]``."""


class Choice:
    """One of some names: ``Annotated[str, Choice(SHAPES)]``, also of a set that grows later."""

    def __init__(self, names: Collection[str], *, joined: bool = False) -> None:
        self.names, self.joined = names, joined

    def allows(self, value: Any) -> bool:
        """Whether a value is such a name."""
        parts = value.split("+") if isinstance(value, str) and self.joined else [value]
        return isinstance(value, str) and all(part in self.names for part in parts)

    def __str__(self) -> str:
        joined = " (joined by +)" if self.joined else ""
        return f"one of {', '.join(map(str, self.names))}{joined}"


def _read_path(value: Any) -> Path:
    """The path, if a file can have its name."""
    try:
        path = Path(value)
        if all(len(os.fsencode(p)) <= _LONGEST and "\0" not in p for p in path.parts):
            return path
    except (TypeError, ValueError):
        pass
    raise FieldError


class _Plain:
    """A number, True or False, or a text, with what stands beside its annotation."""

    def __init__(self, kind: type, beside: list[Any], given: bool) -> None:
        self.kind, self.beside = kind, beside
        self.finite = ALLOW_NAN not in beside and not (given and not beside)
        self.tests = [
            (test, getattr(item, key))
            for item in beside
            for key, test in _TESTS.items()
            if hasattr(item, key)
        ]
        self.sizes = _find_sizes(beside)

    def read(self, value: Any) -> Any:
        """The value as Python's own."""
        scalar = isinstance(value, np.generic | np.ndarray) and value.ndim == 0
        plain: Any = value.item() if scalar else value
        known = isinstance(plain, _TYPES[self.kind])
        if not known or isinstance(plain, bool) != (self.kind is bool):
            raise FieldError
        if self.kind is str and not self.sizes[0] <= len(plain) <= self.sizes[1]:
            raise FieldError
        if self.kind in (int, float):
            infinite = self.finite and not abs(plain) <= _GREATEST
            if infinite or not all(test(plain, limit) for test, limit in self.tests):
                words = _say_range(self.beside, ["finite"] if infinite else [])
                raise FieldError(f"must be {words}, got {show(plain)}")
        return self.kind(plain)


class _Items:
    """The items of a sequence or mapping: read for a field; among arguments it is left as it is.

    Of a long argument the first are read, and none of a generator, which reading would empty.
    """

    def __init__(self, kind: Any, inner: tuple, beside: list[Any], given: bool) -> None:
        self.given, self.mapping = given, issubclass(kind, Mapping)
        self.unlike = (*_UNLISTED, *((set, frozenset) if issubclass(kind, Sequence) else ()))
        own = dict if self.mapping else tuple
        self.kind = own if inspect.isabstract(kind) else kind
        self.fixed = kind is tuple and bool(inner) and Ellipsis not in inner
        self.readers = [make_reader(item, given) for item in inner if item is not Ellipsis]
        self.sizes = (len(inner), len(inner)) if self.fixed else _find_sizes(beside)

    def read(self, value: Any) -> Any:
        """The items in a collection of the annotated kind; the argument itself."""
        listed = isinstance(value, Iterable) and not isinstance(value, self.unlike)
        own = self.given or bool(self.readers) or isinstance(value, self.kind | np.ndarray)
        if not (own and (isinstance(value, Mapping) if self.mapping else listed)):
            raise FieldError
        if self.given and not self.fixed and not isinstance(value, Sized):
            return value
        found = value.items() if self.mapping else value
        if hasattr(value, "__array__"):
            found = np.asarray(value)
            if found.ndim == 0 or np.ma.is_masked(value):
                raise FieldError
        items = [*(itertools.islice(found, _ITEMS) if self.given else found)]
        if not self.sizes[0] <= len(items) <= self.sizes[1]:
            raise FieldError
        read = [self._read_item(k, item) for k, item in enumerate(items)]
        return value if self.given else self.kind(read)

    def _read_item(self, k: int, item: Any) -> Any:
        try:
            if self.mapping and self.readers:
                return tuple(read(part) for read, part in zip(self.readers, item, strict=True))
            return self.readers[k * self.fixed](item) if self.readers else _unwrap(item)
        except FieldError as error:
            if error.final:
                raise
            found = FieldError()
            found.shown = "" if self.mapping else f"{show(_unwrap(item))} in place {k + 1}"
            raise found from None
        except InvalidInput as error:
            error.tables = (item[0] if self.mapping else k + 1, *error.tables)
            raise


class _Array:
    """An array, with what stands beside its annotation: dimensions, range, type.

    Fields become read-only copies. An argument (``given``) is left as it is: its values are read
    only if a range stands beside it.
    """

    def __init__(self, beside: list[Any], given: bool = False) -> None:
        self.given = given
        self.dims = next((text.split() for text in beside if type(text) is str), None)
        self.dtype = next((item for item in beside if isinstance(item, type)), float)
        lengths = [item for item in beside if isinstance(item, MinLen | MaxLen)]
        self.bounds = [item for item in beside if type(item) is not str and item not in lengths]
        self.finite = ALLOW_NAN not in beside
        self.sizes, self.length = _find_sizes(lengths), _say_length(lengths)

    def read(self, value: Any) -> np.ndarray:
        """A read-only copy of the values, or the argument itself."""
        kind = "numbers" if self.given else _WORDS.get(self.dtype, ("", "values"))[1]
        array = value
        try:
            if value is None or isinstance(value, _UNLISTED) or np.ma.is_masked(value):
                raise TypeError
            if not self.given:
                array = freeze(value, self.dtype)
            elif not is_array(value):
                raise TypeError
        except (TypeError, ValueError, OverflowError):
            raise FieldError(f"must be an array of {kind}, got {show(value)}") from None
        shape = np.shape(array)
        named = [str(dim) for dim in getattr(value, "dims", ())]  # of a DataArray
        places = enumerate(itertools.takewhile("...".__ne__, self.dims or ()))
        if any(dim in named[:k] + named[k + 1 :] for k, dim in places):
            raise FieldError(
                f"must have the dims ({', '.join(self.dims or ())}) in this order, got"
                f" ({', '.join(named)}); transpose it"
            )
        if self.dims is not None and not self._fits(shape, self.dims):
            raise FieldError(f"must be an array ({', '.join(self.dims)}), got shape {shape}")
        if not self.sizes[0] <= (shape or (1,))[0] <= self.sizes[1]:
            raise FieldError(f"must be an array of {self.length} {kind}, got shape {shape}")
        if self.bounds if self.given else array.dtype.kind in "iuf":
            self._check_range(np.asarray(array))
        return array

    @staticmethod
    def _fits(shape: tuple[int, ...], dims: list[str]) -> bool:
        if "..." in dims:
            if len(shape) < len(dims) - 1:
                return False
            dims = dims[: dims.index("...")]
            shape = shape[: len(dims)]
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
            raise FieldError(
                f"must be {words}, got {array[first]}{place.replace(',', ' in', 1)}"
            )


class Rules:
    """Annotations by name: those of a record's fields, or of a function's arguments (``given``);
    ``name`` is whose they are.
    """

    def __init__(self, name: str, hints: dict[str, Any], given: bool = False) -> None:
        self.hints, self._name = hints, name
        self._sign = ": " if given else "."
        self._readers = {
            key: make_reader(hint, given) for key, hint in hints.items() if hint is not Any
        }

    def read(self, given: dict[str, Any]) -> dict[str, Any]:
        """The values as their annotations say.

        Raises
        ------
        InvalidInput
            One is not what its annotation says.
        """
        found = {}
        for key, read in self._readers.items():
            if key in given:
                try:
                    found[key] = read(given[key])
                except FieldError as error:
                    listed = error.shown and isinstance(given[key], Sized)
                    long = listed and len(given[key]) > _LONG
                    shown = error.shown if long else show(_unwrap(given[key]))
                    words = f"{error}" or f"must be {_say_rules(self.hints[key])}, got {shown}"
                    said = InvalidInput(f"{self._name}{self._sign}{key} {words}.")
                    said.subject = self._name
                    raise said from None
                except InvalidInput as error:
                    error.tables = (key, *error.tables)
                    raise
        return found


def make_reader(hint: Any, given: bool = False) -> Callable[[Any], Any]:
    """What reads a value as its annotation says, or raises a FieldError. Arguments (``given``) are
    only checked.
    """
    base, beside = _split(hint)
    origin, inner = get_origin(base), get_args(base)
    kind = origin or base
    if choice := next((item for item in beside if isinstance(item, Choice)), None):
        return _make_test(choice.allows, choice)
    if base is np.ndarray:
        return _Array(beside, given).read
    if base in _TYPES:
        return _Plain(base, beside, given).read
    if base in (Path, os.PathLike):
        return _read_path
    if base is Any or isinstance(base, TypeVar):
        return lambda value: value
    if origin is Literal:
        plain = str | int | float | None
        return _make_test(lambda value: isinstance(value, plain) and value in inner)
    if origin in (Union, types.UnionType):
        return _make_union_reader(inner, given)
    listed = isinstance(kind, type) and issubclass(kind, Iterable)
    if listed and (origin or kind in (list, tuple, dict)):
        return _Items(kind, inner, beside, given).read
    if not given and hasattr(kind, "from_plain"):
        return kind.from_plain
    if names := _list_members(kind):
        return _make_test(
            lambda value: not isinstance(value, type) and all(hasattr(value, n) for n in names)
        )
    return _make_test(lambda value: isinstance(value, kind))


def _make_test(
    test: Callable[[Any], bool], names: Choice | None = None
) -> Callable[[Any], Any]:
    def read(value: Any) -> Any:
        if not test(value):
            error = FieldError("" if names is None else f"must be {names}, got {show(value)}")
            error.final = names is not None
            raise error
        return value

    return read


def _list_members(kind: Any) -> list[str]:
    """What a protocol asks for."""
    named = {*vars(kind), *kind.__annotations__} if getattr(kind, "_is_protocol", False) else ()
    return sorted(name for name in named if not name.startswith("_"))


def _make_union_reader(options: tuple, given: bool) -> Callable[[Any], Any]:
    """What takes the first of several kinds that fits, those of the value's own type before
    others; a record's own complaint goes before that of the annotation.
    """
    if {*options} & {os.PathLike, Path}:  # a text beside them is a path, too
        options = tuple(one for one in options if one is not str)
    readers = [make_reader(one, given) for one in options]
    kinds = [get_origin(one) or one for one in options]
    lone = sum(one is not types.NoneType for one in options) == 1

    def read(value: Any) -> Any:
        own = list if isinstance(value, np.ndarray) else type(value)
        errors: list[InvalidInput] = []
        first = kinds.index(own) if own in kinds else 0
        for option in (*readers[first:], *readers[:first]):
            try:
                return option(value)
            except InvalidInput as error:
                errors.append(error)
        own_words = lone or isinstance(value, float)
        named = [e for e in errors if not isinstance(e, FieldError) or (own_words and str(e))]
        raise named[0] if named else FieldError()

    return read


def _split(hint: Any) -> tuple[Any, list[Any]]:
    """``Annotated[T, …]`` as T and its metadata."""
    if get_origin(hint) is not Annotated:
        return hint, []
    base, *beside = get_args(hint)
    flat: list[Any] = []
    for item in beside:
        flat += item if isinstance(item, GroupedMetadata) else [item]
    return base, flat


def _unwrap(value: Any) -> Any:
    """NumPy's numbers and rows as Python's."""
    return value.tolist() if isinstance(value, np.generic | np.ndarray) else value


def freeze(values: object, dtype: type = float) -> np.ndarray:
    """A read-only copy of ``values``.

    Raises
    ------
    InvalidInput
        They are no array of this type.
    """
    try:
        if dtype is not str and np.asarray(values).dtype.kind in "US":
            raise TypeError("text")  # NumPy would read "1" as a number
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
    if found := next((item for item in beside if isinstance(item, Choice)), None):
        return str(found)
    if origin is Literal:
        return f"one of {', '.join(map(str, inner))}"
    if origin in (Union, types.UnionType):
        options = (option for option in inner if option is not types.NoneType)
        return " or ".join(dict.fromkeys(_say_rules(option, many) for option in options))
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


def _find_sizes(beside: list[Any]) -> tuple[float, float]:
    """Least and greatest number of items or characters."""
    low = max((item.min_length for item in beside if isinstance(item, MinLen)), default=0)
    return low, min((i.max_length for i in beside if isinstance(i, MaxLen)), default=math.inf)


def _say_length(beside: list[Any]) -> str:
    low, high = _find_sizes(beside)
    if high == math.inf:
        return f"{low} or more" if low else ""
    if low == 0:
        return f"at most {high}"
    return f"{low}" if low == high else f"{low} to {high}"


def name_class(kind: Any) -> str:
    """A class in words: "a Trial", "an Antenna"."""
    if kind is Callable:
        return "something to call"
    if names := _list_members(kind):
        return f"something with {', '.join(names)}"
    name = kind.__name__.lstrip("_")
    return f"{'an' if name[0] in 'AEIOU' else 'a'} {name}"


def show(value: Any) -> str:
    """A value as a message shows it."""
    if np.ma.is_masked(value):
        count = np.ma.count_masked(value)
        return f"an array with {count} masked entries; leave those out, or fill them"
    if isinstance(value, np.ndarray):
        return f"an array of {value.dtype} and shape {value.shape}"
    if isinstance(value, float) and not math.isfinite(value):
        return str(value)
    text = repr(value).replace("\n", " ")
    return text if len(text) <= 80 else f"{text[:77]}…"


# ``@checked``: arguments of public functions are what their annotations say, by the same rules,
# except that they are passed on as they are: a number may be Python's or NumPy's, an array anything
# that NumPy makes real numbers of, a sequence any list, tuple or array. A dimension that two
# arguments name has one size in both; numbers without a range may be inf or NaN.


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
    placed = (inspect.Parameter.POSITIONAL_ONLY, inspect.Parameter.POSITIONAL_OR_KEYWORD)
    positional = [p.name for p in parameters if p.kind in placed]

    @functools.cache
    def find_rules() -> tuple[Rules, dict[str, list[str]]]:
        """Resolved at the first call, when the modules that annotations name are there."""
        rest = (inspect.Parameter.VAR_KEYWORD, inspect.Parameter.VAR_POSITIONAL)
        found = resolve_hints(function)
        hints = {
            p.name: found[p.name] | None if p.default is None else found[p.name]
            for p in parameters
            if p.name in found and p.kind not in rest
        }
        named = {key: dims for key, hint in found.items() if (dims := _list_dims(hint))}
        return Rules(name, hints, given=True), named if len(named) > 1 or any(
            len({*dims}) < len(dims) for dims in named.values()
        ) else {}

    @functools.wraps(function)
    def call(*args: Any, **kwargs: Any) -> Any:
        rules, dims = find_rules()
        given = dict(zip(positional, args, strict=False)) | kwargs
        rules.read(given)
        if dims:
            _check_sizes(name, dims, given)
        try:
            return function(*args, **kwargs)
        except OutOfMemory:
            raise
        except MemoryError as error:
            words = f"{name}: not enough memory ({error or 'no more to be had'}); ask for less."
            raise OutOfMemory(words) from error

    call.find_rules = lambda: find_rules()[0]  # type: ignore[attr-defined]
    return call  # type: ignore[return-value]


def resolve_hints(thing: Any) -> dict[str, Any]:
    """The annotations of a function or class; a name that only type checkers import is Any."""
    try:
        return get_type_hints(thing, include_extras=True)
    except NameError:
        found: dict[str, Any] = {}
        for kind in reversed(getattr(thing, "__mro__", (thing,))):
            found |= vars(kind).get("__annotations__", getattr(kind, "__annotations__", {}))
        return {name: Any if isinstance(hint, str) else hint for name, hint in found.items()}


def _list_dims(hint: Any) -> list[str]:
    """The named dimensions of an array's annotation; none where another number may follow."""
    base, beside = _split(hint)
    dims = next((text.split() for text in beside if type(text) is str), [])
    if base is not np.ndarray or not dims or dims[0] == "...":
        return []
    return dims[: dims.index("...") if "..." in dims else None]


def _check_sizes(name: str, dims: dict[str, list[str]], given: dict[str, Any]) -> None:
    """Raise where two arguments, or two axes of one, name one dimension and differ in its size."""
    first: dict[str, tuple[str, int]] = {}
    for key, names in dims.items():
        if key not in given:
            continue
        for dim, size in zip(names, np.shape(given[key]), strict=False):
            other, same = first.setdefault(dim, (key, size))
            if size != same:
                both = f"two {dim} axes of one size" if other == key else f"one {dim} size"
                who = key if other == key else f"{other} and {key}"
                raise InvalidInput(f"{name}: {who} must have {both}, got {same} and {size}.")


def is_array(value: Any) -> bool:
    """Whether NumPy makes an array of real numbers of it, none of which it would unmask."""
    if np.ma.is_masked(value):
        return False
    if not isinstance(value, np.ndarray):
        if value is None or isinstance(value, str | bytes | Mapping):
            return False
        try:
            value = np.asarray(value)
        except (TypeError, ValueError):
            return False
    return value.dtype.kind in "biuf"
