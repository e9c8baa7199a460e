"""What arguments and fields may be: annotations, checked once at public doors, and words for what
is wrong.
"""

import functools
import inspect
import itertools
import math
import os
import types
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence, Sized
from pathlib import Path
from typing import Annotated, Any, Literal, TypeVar, Union, get_args, get_origin, get_type_hints

import numpy as np
from annotated_types import Ge, GroupedMetadata, Gt, Lt, MaxLen, MinLen

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
    Path: ("a path that a file can have", "paths"),
    os.PathLike: ("a path that a file can have", "paths"),
    type(None): ("None", "None"),
}
_SIGNS = {"gt": ">", "ge": "≥", "lt": "<", "le": "≤", "multiple_of": "a multiple of"}
_TESTS = {"gt": np.greater, "ge": np.greater_equal, "lt": np.less, "le": np.less_equal}
_OUTSIDE = ("greater_than", "less_than", "multiple_of", "finite_number")
_LONG = 8  # of a longer list, a message shows the item that is wrong
_ITEMS = 1000  # of a long sequence among arguments, the first so many are read
_LONGEST = 255  # bytes of a file's name on all usual systems
F = TypeVar("F", bound=Callable)
Count = Annotated[int, Gt(0), Lt(2**63)]
"""A number of things."""
Seed = Annotated[int, Ge(0)]
"""A seed of random numbers."""


class FieldError(InvalidInput):
    """What is wrong with a value: a sentence that lacks its subject, the name of the field."""


class Unit(str):
    """The unit of a number, for messages: ``Annotated[float, Gt(0), Unit("mm")]``."""


class Choice:
    """One of some names: ``Annotated[str, Choice(SHAPES)]``, also of a set that grows later."""

    def __init__(self, names: Collection[str], *, joined: bool = False) -> None:
        self.names, self.joined = names, joined

    def __get_pydantic_core_schema__(self, source: Any, handler: Any) -> Any:
        return make_schema(self._read)

    def _read(self, value: Any) -> str:
        parts = value.split("+") if isinstance(value, str) and self.joined else [value]
        if not isinstance(value, str) or not all(part in self.names for part in parts):
            raise FieldError(f"must be {self}, got {show(value)}")
        return value

    def __str__(self) -> str:
        joined = " (joined by +)" if self.joined else ""
        return f"one of {', '.join(map(str, self.names))}{joined}"


def _make_kind_reader(kind: type) -> Callable[[Any], Any]:
    """What takes objects of a class, or with what a protocol asks for, as they are."""
    names: tuple[str, ...] = ()
    words = name_class(kind)
    if getattr(kind, "_is_protocol", False):
        named = {*vars(kind), *kind.__annotations__}
        names = tuple(sorted(name for name in named if not name.startswith("_")))
        words = f"something with {', '.join(names)}" if names else words

    def read(value: Any) -> Any:
        lacking = isinstance(value, type) or not all(hasattr(value, n) for n in names)
        if lacking if names else not isinstance(value, kind):
            raise FieldError(f"must be {words}, got {show(value)}")
        return value

    return read


def _read_path(value: Any) -> Path:
    """The path, if a file can have its name."""
    try:
        path = Path(value)
        if all(len(os.fsencode(p)) <= _LONGEST and "\0" not in p for p in path.parts):
            return path
    except (TypeError, ValueError):
        pass
    raise FieldError(f"must be {_WORDS[Path][0]}, got {show(value)}")


class _Items:
    """The items of a sequence or mapping among arguments, which is left as it is.

    Of a long one the first are read, and none of a generator, which reading would empty.
    """

    def __init__(self, hint: Any) -> None:
        from pydantic import ConfigDict, TypeAdapter

        origin, inner = get_origin(hint) or hint, get_args(hint)
        self.hint, self.mapping = hint, issubclass(origin, Mapping)
        self.fixed = origin is tuple and bool(inner) and Ellipsis not in inner
        kinds: Any = tuple(_prepare(item, True) for item in inner if item is not Ellipsis)
        holder: Any = dict if self.mapping else tuple if self.fixed else list
        made = holder[kinds] if kinds else holder
        config = ConfigDict(arbitrary_types_allowed=True, allow_inf_nan=False)
        self._validate = TypeAdapter(made, config=config).validator.validate_python
        self._numbers = not _mentions(hint, np.ndarray)

    def read(self, value: Any) -> Any:
        """The sequence or mapping itself."""
        from pydantic import ValidationError

        listed = isinstance(value, Iterable) and not isinstance(value, str | bytes | Mapping)
        if not (isinstance(value, Mapping) if self.mapping else listed):
            raise self._explain(value)
        if not isinstance(value, Sized):
            if self.fixed:
                raise self._explain(value)
            return value
        items: Any
        if isinstance(value, Mapping):
            items = dict(itertools.islice(value.items(), _ITEMS))
        else:
            given: Any = np.asarray(value) if hasattr(value, "__array__") else value
            if isinstance(given, np.ndarray) and given.ndim == 0:
                raise self._explain(value)
            items = list(itertools.islice(given, _ITEMS))
        try:
            self._validate(tuple(items) if self.fixed else items)
        except ValidationError:
            try:
                plain = _unwrap(items) if self._numbers else items
                self._validate(tuple(plain) if self.fixed else plain)
            except ValidationError as error:
                raise self._explain(value, items, error.errors()[0]["loc"]) from None
        return value

    def _explain(self, value: Any, items: Any = (), places: tuple = ()) -> FieldError:
        shown = show(value)
        if len(items) > _LONG and places and isinstance(items, list):
            shown = f"{show(items[places[0]])} in place {places[0] + 1}"
        return FieldError(f"must be {_say_rules(self.hint)}, got {shown}")


class _Array:
    """An array, with what stands beside its annotation: dimensions, range, type.

    Fields become read-only copies. An argument (``given``) is left as it is: its values are read
    only if a range stands beside it.
    """

    def __init__(self, beside: list[Any], given: bool = False) -> None:
        self.given = given
        self.dims = next((text.split() for text in beside if type(text) is str), None)
        self.dtype = next((item for item in beside if isinstance(item, type)), float)
        self.bounds = [item for item in beside if type(item) is not str]
        self.finite = ALLOW_NAN not in beside

    def read(self, value: Any) -> np.ndarray:
        """A read-only copy of the values, or the argument itself."""
        kind = "numbers" if self.given else _WORDS.get(self.dtype, ("", "values"))[1]
        array = value
        try:
            if value is None or isinstance(value, str | bytes | Mapping):
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
        # Loaded here, at the first record that is made: it takes 60 ms, and many a program makes
        # none.
        from pydantic import ConfigDict, TypeAdapter
        from typing_extensions import TypedDict

        self.name, self.hints, self.given = name, hints, given
        make_table: Any = TypedDict
        prepared = {key: _prepare(hint, given) for key, hint in hints.items()}
        table = make_table(name, prepared, total=not given)
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
            raise self._explain(error.errors(), given if self.given else plain) from None

    def check(self, given: dict[str, Any]) -> None:
        """Raise what ``read`` raises; in most calls nothing needs to be unwrapped for that."""
        from pydantic_core import ValidationError

        try:
            self._validate(given)
        except ValidationError:
            self.read(given)

    def _explain(self, errors: list[Any], given: dict[str, Any]) -> InvalidInput:
        """What is wrong with the first value that is."""
        for error in errors:
            inner = error.get("ctx", {}).get("error")
            if isinstance(inner, InvalidInput) and not isinstance(inner, FieldError):
                places = (part for part in error["loc"] if isinstance(part, int))
                inner.tables = (error["loc"][0], *(k + 1 for k in places), *inner.tables)
                return inner
        found = InvalidInput(self._say_wrong(errors, given))
        found.subject = self.name
        return found

    def _say_wrong(self, errors: list[Any], given: dict[str, Any]) -> str:
        field = errors[0]["loc"][0]
        errors = [error for error in errors if error["loc"][0] == field]
        subject = f"{self.name}{': ' if self.given else '.'}{field}"
        said = errors[0].get("ctx", {}).get("error")
        if said is not None and (len(errors) == 1 or not isinstance(said, FieldError)):
            return (
                f"{subject} {said}." if isinstance(said, FieldError) else f"{subject}: {said}."
            )
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


def _prepare(hint: Any, given: bool = False) -> Any:
    """An annotation for pydantic, in which a text that looks like a number is none."""
    from pydantic import AllowInfNan, PlainValidator, Strict

    base, beside = _split(hint)
    if base is np.ndarray:
        return Annotated[np.ndarray, PlainValidator(_Array(beside, given).read)]
    if beside:
        rules = [AllowInfNan(True) if item is ALLOW_NAN else item for item in beside]
        inside = Annotated[base, Strict()] if base is float else _prepare(base, given)
        return Annotated[inside, *(item for item in rules if not isinstance(item, str))]
    if hint is float and given:
        return Annotated[float, Strict(), AllowInfNan(True)]
    if hint is int:
        return Annotated[int, Strict(), Lt(2**128)]  # seeds of NumPy have as many bits
    if hint in (float, bool, str):
        return Annotated[hint, Strict()]
    if hint in (Path, os.PathLike):
        return Annotated[Any, PlainValidator(_read_path)]
    origin, inner = get_origin(hint), get_args(hint)
    if origin in (Union, types.UnionType):
        if {*inner} & {os.PathLike, Path}:  # a text beside them is a path, too
            inner = tuple(option for option in inner if option is not str)
        return Union[tuple(_prepare(option, given) for option in inner)]  # noqa: UP007
    if given and isinstance(hint, TypeVar):
        return Any
    kind = origin or hint
    if (
        given
        and isinstance(kind, type)
        and (issubclass(kind, Iterable) and (origin or kind in (list, tuple, dict)))
    ):
        return Annotated[Any, PlainValidator(_Items(hint).read)]
    if isinstance(origin, type) and origin is not type and issubclass(origin, Collection):
        return origin[tuple(item if item is Ellipsis else _prepare(item) for item in inner)]  # type: ignore[index]
    if given and isinstance(hint, type) and hint not in (types.NoneType, Any, Callable):
        return Annotated[hint, PlainValidator(_make_kind_reader(hint))]
    if isinstance(hint, type) and not hasattr(hint, "__get_pydantic_core_schema__"):
        known = issubclass(hint, types.NoneType | Collection) or hint is Any
        return hint if known else Annotated[hint, PlainValidator(_make_kind_reader(hint))]
    return hint


def _split(hint: Any) -> tuple[Any, list[Any]]:
    """``Annotated[T, …]`` as T and its metadata."""
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
        rules.check(given)
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
