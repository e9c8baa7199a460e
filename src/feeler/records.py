"""Records: frozen dataclasses whose fields are checked, how notebooks show them, and registries of
named entries.
"""

import base64
import dataclasses
import functools
from collections import UserDict
from collections.abc import Callable, ItemsView, Iterator, Mapping, Sequence
from dataclasses import fields
from html import escape
from pkgutil import resolve_name
from typing import (
    Any,
    ClassVar,
    Self,
    TypeVar,
    dataclass_transform,
    overload,
)

import numpy as np
from annotated_types import Ge, Gt, Le, Len, Lt

from feeler.errors import InvalidInput, suggest
from feeler.validation import (
    ALLOW_NAN,
    Choice,
    FieldError,
    Rules,
    Unit,
    freeze,
    name_class,
    resolve_hints,
    show,
)

# Open sets: things that have names, to which anyone may add one, also from outside the package.

T = TypeVar("T")
E = TypeVar("E")


class _Home(str):
    """Where an entry is that has not been asked for yet: ``"package.module:attribute"``."""


class Registry(UserDict[str, T]):
    """What is known under a name, in the order of registration.

    Parameters
    ----------
    noun
        What one entry is called in messages, e.g. ``"engine"``.
    homes
        Entries that are imported when first asked for: name → ``"package.module:attribute"``.
    """

    def __init__(self, noun: str, homes: Mapping[str, str] | None = None) -> None:
        self.noun = noun
        self.data: dict[str, Any] = {name: _Home(home) for name, home in (homes or {}).items()}

    @overload
    def register(self, name: str) -> Callable[[E], E]: ...

    @overload
    def register(self, name: str, entry: T) -> T: ...

    def register(self, name: str, entry: Any = None) -> Any:
        """Add ``entry`` under ``name``; without an entry, a decorator that does.

        Raises
        ------
        InvalidInput
            The name is taken or is no text.
        """
        if entry is None:
            return lambda found: self.register(name, found)
        if not isinstance(name, str) or not name:
            raise InvalidInput(f"the name of a new {self.noun} must be text, got {name!r}.")
        if name in self.data:
            raise InvalidInput(f"there already is a {self.noun} {name!r}; choose another name.")
        self.data[name] = entry
        return entry

    def unregister(self, name: str) -> None:
        """Take an entry out again."""
        self[name]
        del self.data[name]

    def __getitem__(self, name: str) -> T:
        """The entry called ``name``; the error lists the valid names."""
        if not isinstance(name, str) or name not in self.data:
            raise InvalidInput(
                f"unknown {self.noun} {name!r}; valid: {', '.join(self.data)}."
                + suggest(name, self.data)
            )
        if isinstance(self.data[name], _Home):
            self.data[name] = resolve_name(self.data[name])
        return self.data[name]

    def items(self) -> ItemsView[str, T]:
        """Names with their entries, all imported."""
        for name in [name for name, entry in self.data.items() if isinstance(entry, _Home)]:
            self[name]
        return self.data.items()

    def get(self, name: str, default: T | None = None) -> T | None:  # type: ignore[override]
        """The entry called ``name``, or ``default`` where there is none."""
        return self[name] if name in self.data else default


# What notebooks show of a result: a picture above a table of its fields, made when it is shown.

_MAX_LISTED = 8  # numbers that are written out
_PICTURES = "feeler.plotting.results"  # named, not imported: avoids importing matplotlib
INK, OBJECT = "#5b3a1e", "#8C9196"
_SIZE = 160  # pixels


class Shown:
    """A result that shows itself in a notebook; ``plot`` draws it anywhere.

    ``DRAWN`` is the function that draws it, ``draw(result)`` gives a figure; empty for no picture.
    Beside it stand the lines of ``describe()``, where a result has them, or its attributes.
    """

    DRAWN: ClassVar[str] = ""

    def plot(self) -> Any:
        """A picture of the result: a matplotlib Figure, which notebooks show."""
        return resolve_name(f"{_PICTURES}:{self.DRAWN}")(self)

    def _repr_html_(self) -> str:
        rows = (
            [("", line) for line in self.describe()]
            if hasattr(self, "describe")
            else [(one.name, getattr(self, one.name)) for one in fields(self)]  # type: ignore[arg-type]
        )
        return show_html(type(self).__name__, rows, self.plot() if self.DRAWN else None)


def show_html(title: str, rows: list[tuple[str, Any]], figure: Any = None) -> str:
    """HTML: a title, a picture, and a table of names and values."""
    cells = "".join(
        f"<tr><td><b>{escape(name)}</b></td><td>{escape(_tell_value(value))}</td></tr>"
        for name, value in rows
    )
    picture = ""
    if figure is not None:
        data = base64.b64encode(figure._repr_png_()).decode()
        picture = f'<img alt="{escape(title)}" src="data:image/png;base64,{data}"/>'
    return f"<div><b>{escape(title)}</b><br/>{picture}<table>{cells}</table></div>"


def _tell_value(value: Any) -> str:
    """A value in one line: few numbers as they are, many as their shape and range."""
    if isinstance(value, float | np.floating):
        return f"{value:.4g}"
    if isinstance(value, np.ndarray) and value.dtype.kind in "fiu" and value.size:
        if value.ndim == 1 and value.size <= _MAX_LISTED:
            return ", ".join(f"{number:.4g}" for number in value)
        finite = value[np.isfinite(value)]
        span = f"{finite.min():.4g} … {finite.max():.4g}" if finite.size else "no finite number"
        return f"{' × '.join(map(str, value.shape))}, {span}"
    if isinstance(value, tuple | list):
        return ", ".join(map(_tell_value, value[:_MAX_LISTED])) + " …" * (
            len(value) > _MAX_LISTED
        )
    text = " ".join(str(value).split())
    return text if len(text) <= 120 else f"{text[:110]} …"


def make_picture(
    words: str, lines: Sequence[tuple[np.ndarray, float]], polygons: Sequence[np.ndarray] = ()
) -> str:
    """HTML: a line of words over a picture of lines (point, 2) with their widths, and of filled
    polygons [mm], y up.
    """
    points = np.concatenate([*(points for points, _ in lines), *polygons])
    low, high = points.min(axis=0), points.max(axis=0)
    size = max(*(high - low), 1e-9)
    low, high = low - 0.05 * size, high + 0.05 * size
    width, height = high - low
    inside = [
        f'<polygon points="{_write(rim, low, high)}" fill="{OBJECT}"/>' for rim in polygons
    ]
    for points, thick in lines:
        look = (
            f'fill="none" stroke="{INK}" stroke-linecap="round"'
            f' stroke-width="{max(thick, 0.01 * size):.4g}"'
        )
        inside.append(f'<polyline points="{_write(points, low, high)}" {look}/>')
    shown = (
        f'width="{_SIZE * width / max(width, height):.0f}"'
        f' height="{_SIZE * height / max(width, height):.0f}"'
    )
    box = f'viewBox="0 0 {width:.6g} {height:.6g}"'
    return (
        f'<div>{escape(words)}<br/><svg xmlns="http://www.w3.org/2000/svg" {shown}'
        f" {box}>{''.join(inside)}</svg></div>"
    )


def _write(points: np.ndarray, low: np.ndarray, high: np.ndarray) -> str:
    return " ".join(f"{x - low[0]:.5g},{high[1] - y:.5g}" for x, y in points)


# Records: frozen dataclasses whose fields are what their annotations say.
#
# ::
#
#     class Contact(Record):
#         friction: Annotated[float, Ge(0)] = 0.4
#         stiffness: Annotated[float, Gt(0), Unit("N/mm")]
#         side: Literal["left", "right"] = "left"
#
# ``Contact(stiffness=-1)`` raises ``InvalidInput("Contact.stiffness must be > 0 N/mm, got
# -1.")``; ``contact.replace(friction=0)`` is another record. What annotations
# say:
#
# - ``float``, ``int``, ``bool``, ``str``: a number may be Python's or NumPy's, True is no number,
#   and a number is finite unless ``ALLOW_NAN`` stands beside it. ``float`` fields hold floats
#   afterwards.
# - ``Gt, Ge, Lt, Le, Len`` are ranges, ``Unit`` is said in messages, ``Choice(names)``
#   takes a registry, a dictionary or a list of names, and a text beside them is a remark.
# - ``tuple[float, float]`` and the like take any list, tuple or row of an array; a record takes
#   another record or a table of its fields; any other class takes its own objects.
# - ``np.ndarray`` becomes a read-only copy, of floats unless ``int`` stands beside it;
#   ``Annotated[np.ndarray, "point 2", Gt(0)]`` names its dimensions (or their sizes) and its range,
#   ``"segment?"`` takes one number, too.
#
# Checks that need two fields stand in ``_check``, which is called when each field is right.

__all__ = [
    "ALLOW_NAN",
    "Choice",
    "Ge",
    "Gt",
    "Le",
    "Len",
    "Lt",
    "Record",
    "Unit",
    "freeze",
]


@dataclass_transform(
    kw_only_default=True,
    frozen_default=True,
    eq_default=False,
    field_specifiers=(dataclasses.field,),
)
@dataclasses.dataclass(frozen=True, eq=False)
class Record:
    """Base of all records; ``class Pair(Record, kw_only=False)`` takes its fields by place too.

    Two are equal if they are of one class and all fields are, arrays value by value. What is copied
    or unpickled has read-only arrays again; values that were only kept for speed are left behind.
    """

    def __init_subclass__(cls, kw_only: bool = True, **others: Any) -> None:
        super().__init_subclass__(**others)
        made: Any = dataclasses.dataclass(frozen=True, kw_only=kw_only, eq=False)(cls)
        made.__init__ = _explain_arguments(made.__init__)
        # Record's own serve all; without them a plain frozen dataclass may derive from a record.
        del made.__setattr__, made.__delattr__

    def __post_init__(self) -> None:
        cls: Any = type(self)
        rules = _find_rules(cls)
        given = {name: getattr(self, name) for name in rules.hints}
        vars(self).update(rules.read(given))
        self._check()

    def _check(self) -> None:
        """What single fields cannot say; for subclasses."""

    @classmethod
    def from_plain(cls, value: Any) -> Self:
        """The record that stands in a file or in another record's field: itself, or a table.

        Raises
        ------
        InvalidInput
            Neither of them, or a table with unknown or wrong fields.
        """
        if isinstance(value, cls):
            return value
        if not isinstance(value, Mapping):
            raise FieldError(f"must be {name_class(cls)}, got {show(value)}")
        return cls(**{str(key): item for key, item in value.items()})

    def to_plain(self) -> dict[str, Any]:
        """The fields as plain data, from which ``from_plain`` makes an equal record."""
        return {
            f.name: one if type(one := getattr(self, f.name)) in _PLAIN else _make_plain(one)
            for f in dataclasses.fields(self)
        }

    def _repr_html_(self) -> str:
        rows = [(f.name, getattr(self, f.name)) for f in dataclasses.fields(self)]
        return show_html(type(self).__name__, rows)

    def replace(self, **changes: Any) -> Self:
        """The same record with some fields changed, checked again."""
        return dataclasses.replace(self, **changes)

    def __eq__(self, other: object) -> bool:
        if self is other:
            return True
        if type(self) is not type(other):
            return NotImplemented
        return all(_is_same(a, getattr(other, name)) for name, a in self._list_compared())

    def __hash__(self) -> int:
        found = vars(self).get("_hash")
        if found is None:
            values = (_make_hashable(value) for _, value in self._list_compared())
            found = vars(self)["_hash"] = hash((type(self), *values))
        return found

    def _list_compared(self) -> Iterator[tuple[str, Any]]:
        return ((f.name, getattr(self, f.name)) for f in dataclasses.fields(self) if f.compare)

    def __getstate__(self) -> dict[str, Any]:
        return {f.name: getattr(self, f.name) for f in dataclasses.fields(self)}

    def __setstate__(self, state: dict[str, Any]) -> None:
        if state.keys() != {f.name for f in dataclasses.fields(self)}:
            raise InvalidInput(
                f"another version of feeler pickled this {type(self).__name__}. Make it anew, or"
                " read it from a file."
            )
        for value in state.values():
            if isinstance(value, np.ndarray):
                value.setflags(write=False)
        vars(self).update(state)


def _refuse(self: Record, name: str, *_: Any) -> None:
    raise dataclasses.FrozenInstanceError(f"cannot change field {name!r}; use replace()")


Record.__setattr__ = Record.__delattr__ = _refuse  # type: ignore[method-assign,assignment]


def _is_same(a: Any, b: Any) -> bool:
    if isinstance(a, np.ndarray) or isinstance(b, np.ndarray):
        return np.array_equal(a, b)
    return a == b


def _make_hashable(value: object) -> object:
    if not isinstance(value, np.ndarray):
        return value
    return (value.shape, (value + 0).tobytes())  # −0 equals 0, so both must give one hash


_PLAIN = {float, int, str, bool, type(None)}


def _make_plain(value: Any) -> Any:
    if isinstance(value, Record):
        return value.to_plain()
    if isinstance(value, tuple | list):
        return [item if type(item) in _PLAIN else _make_plain(item) for item in value]
    return value.tolist() if isinstance(value, np.ndarray) else value


def _explain_arguments(init: Callable[..., None]) -> Callable[..., None]:
    """``init``, which says what a record's fields are where other arguments are given."""

    @functools.wraps(init)
    def __init__(self: Record, *args: Any, **kwargs: Any) -> None:
        try:
            init(self, *args, **kwargs)
        except TypeError:
            known = {f.name: f for f in dataclasses.fields(self) if f.init}
            by_place = [name for name, f in known.items() if not f.kw_only]
            given = {*kwargs, *by_place[: len(args)]}
            missing = [
                name
                for name, f in known.items()
                if name not in given and (f.default is f.default_factory is dataclasses.MISSING)
            ]
            if unknown := [name for name in kwargs if name not in known]:
                words = f"has no {unknown[0]!r}; valid: {', '.join(known)}"
            elif len(args) > len(by_place):
                words = f"takes its fields by name: {', '.join(known)}"
            elif missing:
                words = f"needs {', '.join(missing)}"
            else:
                raise
            found = InvalidInput(f"{type(self).__qualname__} {words}.")
            found.subject = type(self).__qualname__
            raise found from None

    return __init__


@functools.cache
def _find_rules(cls: type) -> Rules:
    hints = resolve_hints(cls)
    return Rules(
        cls.__qualname__,
        {
            f.name: hints[f.name] | None if f.default is None else hints[f.name]
            for f in dataclasses.fields(cls)
            if f.init
        },
    )
