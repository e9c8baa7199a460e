"""Calls of public things with one or two arguments that are wrong, drawn from a seed.

The other arguments are right: made from the annotations, records from those of their fields. A call
ends *accepted*, *refused* (an error of feeler) or *raw* (any other error).
"""

import collections.abc
import datetime
import inspect
import os
import signal
import types
import warnings
from collections import Counter
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from typing import Annotated, Any, Literal, Union, get_args, get_origin, get_type_hints

import numpy as np
import xarray as xr

import feeler
from feeler import calibration
from feeler.errors import FeelerError
from feeler.validation import OneOf
from tests.fuzz._files import make_decoder, make_set

PATIENCE = 2.0  # s of processor time; what still computes then has accepted its arguments
SIZES = {
    "trial": 2,
    "sensor": 3,
    "segment": 3,
    "time": 8,
    "component": 2,
    "lag": 3,
    "corner": 4,
}
SIZES |= {"hinge": 3, "axis": 2, "plane": 2, "2": 2, "unit": 3, "sample": 8, "step": 8}
BY_NAME = {
    "tensors": lambda: np.abs(np.random.default_rng(0).normal(size=(4, 3, 12))),
    "X": lambda: np.abs(np.random.default_rng(0).normal(size=(4, 3, 12))),
    "labels": lambda: ["ball", "box", "ball", "box"],
    "time": lambda: np.arange(8.0),
    "trials": lambda: [feeler.Trial(feature=feeler.Ball(radius=1.0), location=0.5, speed=0.3)],
    "encoder": lambda: make_encoder(),
}
"""Arguments whose annotation leaves open what they are."""


MADE = {
    "ActiveTask": lambda: feeler.active.TouchTask(),
    "Feature": lambda: feeler.Ball(radius=1.0),
    "Shape": lambda: feeler.Ball(radius=1.0),
    "Hinges": lambda: calibration.make_hinges("scale", feeler.presets.cockroach()),
    "Targets": lambda: calibration.make_targets(frequency=(0.02, 0.001)),
}
"""What cannot be made from its annotations alone."""


@cache
def make_encoder() -> Any:
    """A small encoder that has learned."""
    encoder = feeler.ConvolutiveNMF(n_components=2, n_lags=3, max_iter=3, random_state=0)
    return encoder.fit(np.random.default_rng(0).random((4, 3, 12)))


class Odd:
    """Something that no function can know."""


def list_wrong() -> list[Any]:
    """Values of which most are wrong in most places."""
    nan, inf = float("nan"), float("inf")
    numbers = [0, -1, 1, 2**31, 2**63, 10**400, -(10**400), nan, inf, -inf, 1e308, 1e-308, -0.0]
    numbers += [True, 1j, np.float32(nan), np.int8(-1), np.datetime64("NaT"), np.bool_(False)]
    texts = ["", "x", "nan", "a" * 5000, "\0", "\ud800", "../x", "1e999", b"x", b"", "a/b.toml"]
    texts += ["none.toml", "empty.toml", "noise.toml", "noise.nc", "folder", "noise.csv"]
    arrays = [
        np.zeros(shape) for shape in ((), (0,), (3,), (2, 3), (2, 3, 4), (0, 3, 8), (1,) * 5)
    ]
    arrays += [np.full((2, 3, 8), value) for value in (nan, inf, -1.0, 1e308)]
    arrays += [np.array(["a", "b"]), np.array([None, 1]), np.array([1j, 2]), np.zeros(3, bool)]
    arrays += [np.array([1, 2, 3]), np.array([3.0, 2.0, 1.0]), np.array(["2026"], "M8[D]")]
    lists = [[], [[]], [[1], [1, 2]], [None], ["a", 1], [nan], [10**400], (), (1,), (1, 2, 3)]
    lists += [{}, {"a": 1}, {1: None}, {"a"}, [{}], [Odd()], range(3), ["a"] * 3]
    others = [
        None,
        Odd(),
        Odd,
        len,
        lambda *_: None,
        Path("none"),
        Path("folder"),
        xr.Dataset(),
    ]
    others += [xr.DataArray(np.zeros((2, 3))), make_set(), datetime.datetime(2026, 1, 1)]
    others += [np.random.default_rng(0), feeler.presets.cockroach(), feeler.Ball(radius=1.0)]
    others += [make_encoder(), make_decoder()]
    return numbers + texts + arrays + lists + others


def make_right(annotation: Any, name: str = "", depth: int = 0) -> Any:
    """A value of the annotated type; None where that is not known."""
    origin, inner = get_origin(annotation), get_args(annotation)
    if annotation in (Any, inspect.Parameter.empty) or isinstance(annotation, str):
        return BY_NAME.get(name, lambda: None)()
    if annotation is np.ndarray:
        return BY_NAME.get(name, lambda: np.linspace(0.1, 0.8, 8))()
    if origin is Annotated:
        return _make_annotated(inner, name, depth)
    if origin in (Union, types.UnionType):
        return make_right(inner[0], name, depth)
    if origin is Literal:
        return inner[0]
    if origin is collections.abc.Callable or annotation is collections.abc.Callable:
        return lambda *_: 0.0
    if origin is tuple and Ellipsis not in inner:
        return tuple(make_right(item, name, depth + 1) for item in inner)
    if origin in (dict, collections.abc.Mapping):
        return {make_right(inner[0], name, depth + 1): make_right(inner[1], name, depth + 1)}
    if origin is not None:
        items = [make_right(inner[0], name, depth + 1)] * 2
        return tuple(items) if origin is tuple else items
    return _make_plain(annotation, depth)


def _make_annotated(inner: tuple, name: str, depth: int) -> Any:
    for rule in inner[1:]:
        if isinstance(rule, OneOf):
            return next(iter(rule.names))
        if inner[0] is np.ndarray and isinstance(rule, str):
            words = rule.replace("?", "").split()
            shape = [SIZES.get(word, 4) for word in words if word != "..."]
            return np.abs(np.random.default_rng(0).normal(size=shape)) + 0.1
    return make_right(inner[0], name, depth)


def _make_plain(kind: Any, depth: int) -> Any:
    plain = {
        float: 0.5,
        int: 2,
        str: "a",
        bool: True,
        Path: Path("out"),
        os.PathLike: Path("out"),
    }
    if kind in plain:
        return plain[kind]
    if kind is feeler.Antenna:
        return feeler.presets.cockroach()
    if kind is xr.Dataset:
        return make_set()
    if kind is np.random.Generator:
        return np.random.default_rng(0)
    if make := MADE.get(getattr(kind, "__name__", "")):
        return make()
    if not inspect.isclass(kind) or not kind.__module__.startswith("feeler") or depth > 4:
        return _make_foreign(kind)
    try:
        return kind(**make_arguments(kind, depth + 1))
    except Exception:
        return None


def _make_foreign(kind: Any) -> Any:
    from matplotlib.figure import Figure

    figure = Figure()
    axes = figure.subplots()
    values = {"Figure": figure, "Axes": axes, "Axis": axes.xaxis}
    return values.get(getattr(kind, "__name__", ""))


def make_arguments(thing: Any, depth: int = 0) -> dict[str, Any]:
    """Right values of all that is required; what has a default is left to it."""
    given = list_parameters(thing)
    return {
        key: make_right(hint, key, depth)
        for key, (hint, default) in given.items()
        if default is inspect.Parameter.empty
    }


@cache
def list_parameters(thing: Any) -> dict[str, tuple[Any, Any]]:
    """Annotation and default by name."""
    given = inspect.signature(thing).parameters.values()
    target = thing.__init__ if inspect.isclass(thing) else thing
    try:
        hints = get_type_hints(target, include_extras=True)
    except Exception:
        hints = {}
    kinds = (inspect.Parameter.VAR_KEYWORD, inspect.Parameter.VAR_POSITIONAL)
    return {
        p.name: (hints.get(p.name, p.annotation), p.default)
        for p in given
        if p.kind not in kinds
    }


@dataclass
class Calls:
    """What came of calls so far."""

    ends: Counter = field(default_factory=Counter)
    raw: Counter = field(default_factory=Counter)
    """How often by name, error and place."""
    seen: dict[tuple, str] = field(default_factory=dict)
    """One call of each."""

    @property
    def share(self) -> float:
        """Raw errors among all calls."""
        return self.ends["raw"] / max(1, sum(self.ends.values()))

    def __str__(self) -> str:
        n = sum(self.ends.values())
        lines = [f"{n} calls: " + ", ".join(f"{k} {v}" for k, v in self.ends.most_common())]
        lines += [f"raw {self.share:.2%}"]
        lines += [
            f"{k:4d} {' | '.join(key)} <- {self.seen[key]}" for key, k in self.raw.items()
        ]
        return "\n".join(lines)


def call(log: Calls, name: str, thing: Any, rng: np.random.Generator, wrong: list) -> None:
    """One wrong call."""
    given = make_arguments(thing)
    names = list(list_parameters(thing))
    if not names:
        return
    changed = {}
    for _ in range(1 + (rng.random() < 0.3)):
        changed[names[rng.integers(len(names))]] = wrong[rng.integers(len(wrong))]
    try:
        with patient():
            thing(**given | changed)
        end = "accepted"
    except FeelerError as error:
        end = "refused" if str(error) else "without words"
    except TooLong:
        end = "slow"
    except Exception as error:
        end, key = "raw", (name, *changed, type(error).__name__, _find_place(error))
        log.raw[key] += 1
        log.seen.setdefault(key, f"{_shorten(changed)}: {str(error)[:150]}")
    log.ends[end] += 1


class TooLong(BaseException):
    """A call that computes has accepted its arguments."""


@contextmanager
def patient():
    def ring(*_: Any) -> None:
        raise TooLong

    signal.signal(signal.SIGPROF, ring)
    signal.signal(signal.SIGALRM, ring)
    signal.setitimer(
        signal.ITIMER_PROF, PATIENCE, 0.5
    )  # again: a library may swallow the first
    signal.setitimer(signal.ITIMER_REAL, 5 * PATIENCE, 1.0)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            yield
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0)
        signal.setitimer(signal.ITIMER_REAL, 0)


def _find_place(error: BaseException) -> str:
    """The last line of ours that it came through."""
    place, trace = "", error.__traceback__
    while trace is not None:
        file = trace.tb_frame.f_code.co_filename
        if "/feeler/" in file:
            place = f"{file.rpartition('/feeler/')[2]}:{trace.tb_lineno}"
        trace = trace.tb_next
    return place


def _shorten(changed: dict[str, Any]) -> str:
    def say(value: Any) -> str:
        if isinstance(value, np.ndarray):
            return f"array {value.dtype} {value.shape}"
        try:
            return repr(value)[:40]
        except ValueError:
            return f"an integer of {value.bit_length()} bits"

    return ", ".join(f"{key}={say(value)}" for key, value in changed.items())
