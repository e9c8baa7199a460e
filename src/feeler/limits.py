"""Limits: what a file from outside may cost, stated once."""

import os
from dataclasses import dataclass

from feeler.errors import InvalidInput

MAX_TEXT = 64 * 2**20  # [C] bytes of JSON and other text in one file


@dataclass(frozen=True, kw_only=True)
class Limits:
    """What one file from outside may cost; [C], also by FEELER_MAX_GIB and FEELER_MAX_SECONDS."""

    max_bytes: int = 4 * 2**30
    """Bytes of numbers once unpacked; the process that reads may take 512 MiB more."""
    max_seconds: float = 10.0
    """Processor time [s], and 30 s more for each GiB that the file has on disk."""

    def __post_init__(self) -> None:
        for name, value in vars(self).items():
            if not value > 0:
                raise InvalidInput(f"Limits.{name} must be > 0, got {value!r}.")

    def check_bytes(self, n_bytes: int, what: str) -> None:
        """Raise where ``n_bytes`` exceeds ``max_bytes``."""
        if n_bytes > self.max_bytes:
            raise InvalidInput(
                f"{what} asks for {n_bytes / 2**30:.4g} GiB, over the limit of"
                f" {self.max_bytes / 2**30:.4g} GiB. If you trust the file, raise the limit:"
                " Limits(max_bytes=…), or FEELER_MAX_GIB in the environment."
            )


def find_limits(limits: Limits | None = None) -> Limits:
    """The limits given, or the defaults with what the environment says."""
    if limits is not None:
        return limits
    values: dict[str, float] = {}
    for name, field, factor in (
        ("FEELER_MAX_GIB", "max_bytes", 2**30),
        ("FEELER_MAX_SECONDS", "max_seconds", 1.0),
    ):
        if text := os.environ.get(name):
            try:
                values[field] = type(factor)(float(text) * factor)
            except (ValueError, OverflowError):
                raise InvalidInput(f"{name} must be a number > 0, got {text[:40]!r}.") from None
    return Limits(**values)  # type: ignore[arg-type]
