"""Facts: numbers that carry their unit, their source tag and their reference."""

from dataclasses import dataclass

SOURCE_TAGS = {
    "P": "stated in the paper",
    "A": "read off the first author's public poster and video",
    "D": "derived by inverse simulation or digitising; not stated by the authors",
    "B": "another public source, named",
    "C": "not stated anywhere that could be read: our choice",
}
PAPER = "Meng, McDonnell, Jayaram, Mongeau 2025, doi:10.1101/2025.10.20.683587"


@dataclass(frozen=True, kw_only=True)
class Fact:
    """One number (or short tuple) of a model: value, unit, source tag, reference, and what it
    means.
    """

    value: float | tuple[float, ...]
    unit: str
    tag: str
    reference: str = PAPER
    note: str = ""

    def __post_init__(self) -> None:
        if not set(self.tag.split("+")) <= SOURCE_TAGS.keys():
            raise ValueError(f"unknown source tag {self.tag!r}; valid: {', '.join(SOURCE_TAGS)}")

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
