"""Dispersion indices: ways to say how alike two tensors are."""

from collections.abc import Callable
from dataclasses import dataclass

from feeler.dispersion.blocks import Block
from feeler.registry import Registry


@dataclass(frozen=True, kw_only=True)
class Index:
    """One way to say how alike two tensors are."""

    label: str
    """What figures and tables call it."""
    make: Callable[..., Block]
    """``make(tensors, **options)`` for a set (trial, sensor, time): a function of two slices of its
    trials that gives the index of each pair, (row, column)."""
    is_similarity: bool = True
    """Whether the closest match has the greatest value; False for a distance, which is least there.
    """
    needs_range: bool = False
    """Whether ``make`` takes ``data_range``, the least and the greatest entry of all sets."""

    @property
    def sign(self) -> float:
        """1 for similarities, −1 for distances: what makes the greatest the closest."""
        return 1.0 if self.is_similarity else -1.0


INDICES: Registry[Index] = Registry(
    "dispersion index",
    {
        name: f"feeler.dispersion.{name}:{name.upper()}"
        for name in ("pearson", "ssim", "mse", "nmi")
    },
)
"""Every known index by its name; ``INDICES.register(name, Index(...))`` adds one."""
