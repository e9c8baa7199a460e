"""Snapshots: a moment of simulations, and what it belongs to."""

from dataclasses import dataclass, fields
from typing import Any

import numpy as np

from feeler.physics.scene import Scene

BUILT = ("antenna", "objects", "contact", "gravity", "flow", "base")
"""The parts of a scene that an engine's tables are made of; commands do not change them."""
_PARTS = (*BUILT, "paths", "base_motion")


@dataclass(frozen=True, kw_only=True, eq=False)
class Snapshot:
    """A moment of some lanes, to which they can go back as often as one likes.

    Attributes
    ----------
    scene, began : tuple[Scene, ...]
        What each lane simulates, and the same before commands replaced a recorded path.
    engine, timestep
        Of the simulations [ms].
    owner : object
        The simulations themselves, whose lanes may have begun other scenes since.
    """

    lane: tuple[int, ...]
    step: tuple[int, ...]
    scene: tuple[Scene, ...]
    began: tuple[Scene, ...]
    failed: tuple[Exception | None, ...]
    saved: tuple[Any, ...]
    engine: str
    timestep: float
    owner: object


def is_built_alike(one: Scene, other: Scene) -> bool:
    """Whether an engine's tables of one scene are those of the other, but for its state."""
    return all(getattr(one, name) == getattr(other, name) for name in BUILT)


def list_differences(here: Scene, there: Scene) -> list[str]:
    """How the scene of a snapshot (``there``) differs from that of a simulation, in words."""
    return [
        _describe(name, getattr(here, name), getattr(there, name))
        for name in _PARTS
        if getattr(here, name) != getattr(there, name)
    ]


def _describe(name: str, here: Any, there: Any) -> str:
    if name == "antenna":
        return f"antenna {there.name!r} for {here.name!r} ({_list_fields(here, there)})"
    if name == "objects" and [o.name for o in here] == [o.name for o in there]:
        pairs = [(a, b) for a, b in zip(here, there, strict=True) if a != b]
        return ", ".join(f"object {a.name!r} ({_list_fields(a, b)})" for a, b in pairs)
    if name == "objects":
        names = [", ".join(o.name for o in some) or "none" for some in (there, here)]
        return f"objects {names[0]} for {names[1]}"
    if name in ("gravity", "base"):
        return f"{name} {there} for {here}"
    if name == "contact":
        return f"contact ({_list_fields(here, there)})"
    return {"base_motion": "base motion", "paths": "paths of objects"}.get(name, name)


def _list_fields(here: Any, there: Any) -> str:
    """Names of the fields in which two records of one class differ."""
    own = (field.name for field in fields(here))
    return ", ".join(
        name for name in own if _differs(getattr(here, name), getattr(there, name))
    )


def _differs(a: Any, b: Any) -> bool:
    arrays = isinstance(a, np.ndarray) or isinstance(b, np.ndarray)
    return not (np.array_equal(a, b) if arrays else a == b)
