"""Objects that stay as they were checked: copies and pickles too keep arrays read-only, and equal
ones compare equal.
"""

from dataclasses import dataclass, fields
from typing import Any

import numpy as np

from feeler.rules import freeze

__all__ = ["Frozen", "freeze"]


@dataclass(frozen=True, eq=False)
class Frozen:
    """Base of frozen dataclasses with arrays among their fields; declare those with ``eq=False``.

    Two are equal if they are of one class and all fields are, arrays value by value. What is copied
    or unpickled has read-only arrays again; values that were only kept for speed are left behind.
    """

    def __eq__(self, other: object) -> bool:
        if self is other:
            return True
        if type(self) is not type(other):
            return NotImplemented
        return all(
            _same(getattr(self, f.name), getattr(other, f.name)) for f in fields(self) if f.compare
        )

    def __hash__(self) -> int:
        found = self.__dict__.get("_hash")
        if found is None:
            found = hash(
                (type(self), *(_key(getattr(self, f.name)) for f in fields(self) if f.compare))
            )
            self.__dict__["_hash"] = found
        return found

    def to_plain(self) -> dict[str, Any]:
        """The fields as plain data: arrays as lists, frozen objects as dictionaries;
        ``type(self)(**plain)`` is equal.
        """
        return {f.name: _make_plain(getattr(self, f.name)) for f in fields(self)}

    def __getstate__(self) -> dict[str, Any]:
        return {f.name: getattr(self, f.name) for f in fields(self)}

    def __setstate__(self, state: dict[str, Any]) -> None:
        for value in state.values():
            if isinstance(value, np.ndarray):
                value.setflags(write=False)
        self.__dict__.update(state)


def _make_plain(value: object) -> object:
    if isinstance(value, Frozen):
        return value.to_plain()
    return value.tolist() if isinstance(value, np.ndarray) else value


def _same(a: Any, b: Any) -> bool:
    if isinstance(a, np.ndarray) or isinstance(b, np.ndarray):
        return np.array_equal(a, b)
    return a == b


def _key(value: object) -> object:
    if not isinstance(value, np.ndarray):
        return value
    return (value.shape, (value + 0).tobytes())  # −0 equals 0, so both must give one hash
