"""What a relation is: a world, a change of it, and a producer of which the answer is then known.

A cell of the table says ``make(apply(world)) == expect(make(world))``, or names the refusal. Worlds
are in worlds.py; an answer is a dict of labelled arrays, numbers and words.
"""

import json
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import xarray as xr

from feeler.errors import InvalidInput

Answer = dict[str, Any]


def same(answer: Answer) -> Answer:
    """The answer as it is."""
    return answer


@dataclass(frozen=True, eq=False)
class Change:
    """One transformation of the worlds of a kind.

    ``expect`` is what becomes of the answer that the world had before, ``look`` takes what is
    compared from the new one, as where something was added, and ``part`` what is compared of both.
    ``tolerance`` of numbers is a share of the greatest. ``refusal`` is what the message says where
    the change is not to be answered, ``or_refusal`` where it may be refused in words.
    """

    name: str
    of: str
    apply: Callable[[Any], Any]
    expect: Callable[[Answer], Answer] = same
    look: Callable[[Answer], Answer] = same
    part: Callable[[Answer], Answer] = same
    tolerance: float = 1e-9
    refusal: str = ""
    or_refusal: str = ""


@dataclass(frozen=True, eq=False)
class Producer:
    """One thing that users get numbers from; ``make`` gives its answer about a world, to a
    ``tolerance`` where it computes in single precision.
    """

    name: str
    of: str
    make: Callable[[Any], Answer]
    tolerance: float = 0.0


def on_arrays(
    change: Callable[[str, xr.DataArray], xr.DataArray],
) -> Callable[[Answer], Answer]:
    """What changes each labelled array of an answer, by its name, and nothing else."""
    return lambda answer: {
        name: change(name, item) if isinstance(item, xr.DataArray) else item
        for name, item in answer.items()
    }


def pick(rows: Any, *dims: str) -> Callable[[Answer], Answer]:
    """What takes rows along each of these dims."""
    return on_arrays(lambda _, item: item.isel({d: rows for d in dims if d in item.dims}))


def flatten(found: Any, name: str = "") -> Answer:
    """All numbers and words of JSON, by where they are; no file's name is among them."""
    if isinstance(found, dict):
        items = [(f"{name}.{key}" if name else key, item) for key, item in found.items()]
    elif isinstance(found, list):
        items = [(f"{name}[{k}]", item) for k, item in enumerate(found)]
    else:
        words = isinstance(found, str) and ("/" in found or "." in found)
        return {} if words and "units" not in name else {name: found}
    return {key: item for place, inner in items for key, item in flatten(inner, place).items()}


def assert_same(found: Answer, wanted: Answer, tolerance: float) -> None:
    """Two answers agree: the same names, words, gaps and, within the tolerance, numbers."""
    faults = [f"{name}: only on one side" for name in found.keys() ^ wanted.keys()]
    for name in wanted.keys() & found.keys():
        got, want = np.asarray(found[name]), np.asarray(wanted[name])
        if got.shape != want.shape:
            faults.append(f"{name}: {got.shape}, not {want.shape}")
        elif want.dtype.kind not in "fc":
            faults += [] if np.array_equal(got, want) else [f"{name}: {got}, not {want}"]
        elif not np.array_equal(np.isfinite(got), known := np.isfinite(want)):
            faults.append(f"{name}: other gaps, {got} for {want}")
        else:
            scale = max(float(np.abs(want[known]).max(initial=0.0)), 1e-12)
            off = float(np.abs(got - want)[known].max(initial=0.0)) / scale
            faults += [f"{name}: off by {off:.2g} of {scale:.3g}"] if off > tolerance else []
    assert not faults, "; ".join(sorted(faults))[:600]


def read_json(result: Any) -> Answer:
    """What a command said in JSON, whole or line by line; its refusal as the library's."""
    if result.returncode:
        raise InvalidInput(result.stderr)
    try:
        return flatten(json.loads(result.stdout))
    except json.JSONDecodeError:
        return flatten([json.loads(line) for line in result.stdout.splitlines()])
