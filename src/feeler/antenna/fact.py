"""Facts: numbers that carry their unit, their source tag and their reference."""

from typing import Annotated, Any

from feeler.records.record import Record
from feeler.records.rules import OneOf, Wrong, show

SOURCE_TAGS = {
    "P": "stated in the paper",
    "A": "read off the first author's public poster and video",
    "D": "derived by inverse simulation or digitising; not stated by the authors",
    "B": "another public source, named",
    "C": "not stated anywhere that could be read: our choice",
}
PAPER = "Meng, McDonnell, Jayaram, Mongeau 2025, doi:10.1101/2025.10.20.683587"


class _Tags(OneOf):
    """Tags joined by +, of numbers that rest on several sources."""

    def read(self, value: Any) -> str:
        """The tags, if each is known."""
        if not isinstance(value, str) or not set(value.split("+")) <= set(self.names):
            raise Wrong(f"must be {self} (joined by +), got {show(value)}")
        return value


SourceTag = Annotated[str, _Tags(SOURCE_TAGS)]


class Fact(Record):
    """A number (or short tuple) of a model: value, unit, source tag, reference, what it means."""

    value: float | tuple[float, ...]
    unit: str
    tag: SourceTag
    reference: str = PAPER
    note: str = ""

    @property
    def number(self) -> float:
        """The value of a fact that is one number."""
        if isinstance(self.value, tuple):
            raise TypeError(f"this fact holds {len(self.value)} numbers, not one: {self.value}")
        return float(self.value)

    @property
    def numbers(self) -> tuple[float, ...]:
        """All numbers of the fact."""
        return self.value if isinstance(self.value, tuple) else (self.value,)
