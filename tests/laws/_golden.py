"""Every public thing called as it should be and then with one argument that is another, and what
comes of it: results as digests, refusals in their words; and scenes in which nothing is even.

``make golden`` keeps a meant change anew and prints what has changed, for review.
"""

import inspect
import os
import re
import sys
import warnings
from collections.abc import Callable, Mapping
from itertools import chain
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from feeler.errors import FeelerError
from tests import golden

from ._calls import list_parameters, make_arguments, make_right
from ._engine_scenes import list_engine_scenes
from ._scenes import list_refusals, list_scenes
from ._told_scenes import list_told_scenes
from .test_arguments import PUBLIC

KEPT = Path(__file__).with_name("golden.txt")
OTHERS = (0, -1, 3, 0.37, 1e9, float("nan"), "x", None, [], [[1], [1, 2]], np.zeros((2, 3, 4)))
"""Arguments in the place of right ones; most of them are wrong in most places."""
TOLERANCES = {
    r"^response.fit_damped_cosine(\((frequency|damping_ratio)\) [\d.]+)?: ": (
        20,
        0,
        "a straight line fits no wave: another processor ends at another one",
    ),
    r"^information\.(compute|measure)_information": (1e-3, 1e-7, "millionths of a bit"),
}
"""Lines whose numbers may be off further: relative, absolute, and why. Found by a run with another
BLAS kernel and compiler target (OPENBLAS_CORETYPE=Nehalem NUMBA_CPU_NAME=generic)."""
ROOMS = (
    "feeler",
    "antenna",
    "stimulus",
    "tensors",
    "presets",
    "response",
    "dispersion",
    "encoding",
    "decoding",
    "information",
    "spikes",
)
"""Rooms whose public things are called; those of the others work for seconds, or serve."""
DIGEST = re.compile(r"\b[0-9a-f]{16}\b")
"""Of numbers, whose last digit is the processor's."""
SCENES = (list_scenes, list_refusals, list_engine_scenes, list_told_scenes)
LONGEST = 240
"""Characters of a line that are kept."""
DEEP = 3
MOST = 20
"""Of a longer list of things that are no numbers, the first are described."""


def describe(value: Any, depth: int = 0) -> list[str]:
    """What a result holds, line by line."""
    name = type(value).__name__
    if isinstance(value, xr.Dataset):
        arrays = sorted(value.variables.items())
        return [f"sizes {dict(value.sizes)}", *(f"{key} {_say(x)}" for key, x in arrays)]
    if isinstance(value, xr.DataArray):
        coords = [f"{key} {_say(x.variable)}" for key, x in sorted(value.coords.items())]
        return [_say(value.variable), *coords]
    if isinstance(value, Figure):
        return golden.describe(value)
    if isinstance(value, bool | int | float | str | bytes | Path) or value is None:
        said = DIGEST.sub("DIGEST", golden.write(value))
        return [f"{name} {said[:600]}"]
    numbers = _read_numbers(value)
    if numbers is not None:
        return [f"{name} {numbers.shape} {_digest(numbers)}"]
    if depth == DEEP:
        return [name]
    return [
        f"{key}: {line}" for key, inner in _open(value) for line in describe(inner, depth + 1)
    ]


def _say(x: xr.Variable) -> str:
    """Numbers before words: a long line is cut."""
    held = str(np.asarray(x).tolist())[:100]
    if x.dtype.kind in "fiub" and x.size:
        held = _digest(x)
    return f"{x.dims} {x.dtype} {held}, {x.attrs}"


def _digest(numbers: Any) -> str:
    """With the largest, as means of many hide one that is wrong."""
    size = np.abs(np.asarray(numbers, dtype=float))
    most = f", largest {np.nanmax(size):.6g}" if 4 < size.size != np.isnan(size).sum() else ""
    return f"{golden.digest(numbers)}{most}"


def _read_numbers(value: Any) -> np.ndarray | None:
    if not isinstance(value, np.ndarray | np.generic | list | tuple):
        return None
    try:
        numbers = np.asarray(value, dtype=float)
    except (TypeError, ValueError):
        return None
    return numbers if numbers.size else None


def _open(value: Any) -> list[tuple[str, Any]]:
    """What a thing is made of, by name."""
    name = type(value).__name__
    if isinstance(value, Mapping):
        return [(f"{key}", inner) for key, inner in list(value.items())[:MOST]]
    if isinstance(value, list) and all(isinstance(line, str) for line in value):
        return [(f"{k}", line) for k, line in enumerate(value)]
    if isinstance(value, list | tuple) and not hasattr(value, "_fields"):
        return [(f"{k}", inner) for k, inner in enumerate(value[:MOST])]
    if not type(value).__module__.startswith("feeler"):
        return [(name, None)]
    return [(f"{name}.{key}", inner) for key, inner in _list_public(value)]


def _list_public(value: Any) -> list[tuple[str, Any]]:
    found = []
    for key in sorted(dir(value)):
        if key.startswith("_"):
            continue
        try:
            inner = getattr(value, key)
        except Exception as error:
            inner = f"{type(error).__name__}: {error}"
        if not callable(inner):
            found.append((key, inner))
    return found


def list_calls() -> list[tuple[str, Any]]:
    """Public things of the rooms, each with its class for a method, by name."""
    calls: list[tuple[str, Any]] = []
    for name, thing in sorted(PUBLIC.items()):
        if name.partition(".")[0] not in ROOMS or _is_no_call(thing):
            continue
        calls.append((name, thing))
        if inspect.isclass(thing):
            calls += [(f"{name}.{key}", (thing, key)) for key in _list_methods(thing)]
    return calls


def _is_no_call(thing: Any) -> bool:
    return inspect.isclass(thing) and (
        issubclass(thing, Exception) or inspect.isabstract(thing)
    )


def _list_methods(kind: type) -> list[str]:
    public = [key for key in sorted(dir(kind)) if not key.startswith("_")]
    return [key for key in public if inspect.isfunction(inspect.getattr_static(kind, key))]


def say_calls(name: str, thing: Any) -> list[str]:
    """One thing, called as it should be, and then with each argument another."""
    own = None
    if isinstance(thing, tuple):
        kind, method = thing
        own = make_right(kind)
        if own is None:
            return []
        thing = getattr(own, method)
    right = make_arguments(thing)
    lines = [f"{name}: {line}" for line in _say_call(thing, right)]
    if own is not None:
        return lines
    for key in list_parameters(thing):
        told: dict[str, str] = {}
        for other in OTHERS:
            said = _say_call(thing, right | {key: other})
            if not said:
                continue
            words = " ".join(said) if len(said) < 3 else f"{len(said)} lines of {_weigh(said)}"
            told.setdefault(words.partition(", got ")[0], f"{_shorten(other)}: {words[:600]}")
        lines += [f"{name}({key}) {line}" for line in told.values()]
    return lines


def _weigh(lines: list[str]) -> str:
    numbers = [golden.parse(x) for line in lines for x in golden.NUMBER.findall(line)]
    return golden.digest(numbers)


def _shorten(other: Any) -> str:
    return f"array {other.shape}" if isinstance(other, np.ndarray) else repr(other)


def say_scene(make: Callable[[], Any]) -> list[str]:
    """What comes of a scene, which takes the time that it takes."""
    try:
        return describe(make())
    except FeelerError as error:
        return [f"{type(error).__name__}: {' '.join(str(error).split())}"]


def _say_call(thing: Any, arguments: dict[str, Any]) -> list[str]:
    try:
        return describe(thing(**arguments))
    except FeelerError as error:
        return [f"{type(error).__name__}: {' '.join(str(error).split())}"]
    except Exception:  # no word of ours
        return []


def write_golden() -> list[str]:
    """The lines of all scenes, refusals and calls, in a folder of their own."""
    lines = []
    home = Path.cwd()
    with TemporaryDirectory() as folder, warnings.catch_warnings():
        warnings.simplefilter("ignore")
        os.chdir(folder)
        try:
            for name, make in chain(*(each() for each in SCENES)):
                lines += [f"{name}: {line}" for line in say_scene(make)]
            for name, thing in list_calls():
                lines += say_calls(name, thing)
        finally:
            os.chdir(home)
    told = [" ".join(line.replace(folder, "FOLDER").split()) for line in lines]
    return [line[:LONGEST] for line in told]


def main() -> None:
    """Call everything; keep and print what has changed."""
    golden.keep(KEPT, write_golden(), TOLERANCES)


if __name__ == "__main__":
    sys.exit(main())
