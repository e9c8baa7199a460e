"""Open sets: things that have names, to which anyone may add one, also from outside the package."""

from collections.abc import Callable, Iterator, Mapping
from pkgutil import resolve_name
from typing import Any, Generic, TypeVar, overload

from feeler.errors import InvalidInput

T = TypeVar("T")
E = TypeVar("E")


class Registry(Mapping[str, T], Generic[T]):
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
        self._entries: dict[str, T | str] = dict(homes or {})
        self._waiting = set(self._entries)

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
        if name in self._entries:
            raise InvalidInput(f"there already is a {self.noun} {name!r}; choose another name.")
        self._entries[name] = entry
        return entry

    def unregister(self, name: str) -> None:
        """Take an entry out again."""
        self[name]
        del self._entries[name]

    def __getitem__(self, name: str) -> T:
        """The entry called ``name``; the error lists the valid names."""
        if not isinstance(name, str) or name not in self._entries:
            raise InvalidInput(
                f"unknown {self.noun} {name!r}; valid: {', '.join(self._entries)}."
            )
        if name in self._waiting:
            self._entries[name] = resolve_name(self._entries[name])  # type: ignore[arg-type]
            self._waiting.discard(name)
        return self._entries[name]  # type: ignore[return-value]

    def get(self, name: str, default: T | None = None) -> T | None:  # type: ignore[override]
        """The entry called ``name``, or ``default`` where there is none."""
        if name in self:
            return self[name]
        return default

    def __contains__(self, name: object) -> bool:
        return name in self._entries

    def __iter__(self) -> Iterator[str]:
        return iter(self._entries)

    def __len__(self) -> int:
        return len(self._entries)
