"""Dispersion of groups of tensors: closest matches, their average and its interval, by index and group."""

from collections.abc import Hashable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from feeler.checked import checked
from feeler.dispersion.blocks import BLOCK, check_tensors
from feeler.dispersion.closest import Closest, search_closest
from feeler.dispersion.index import INDICES
from feeler.dispersion.interval import Interval, bootstrap_mean
from feeler.errors import InvalidInput


@dataclass(frozen=True, kw_only=True, eq=False)
class Dispersion:
    """The indices of each group: closest match per tensor, group average, interval."""

    groups: tuple[Hashable, ...]
    """Group names, in order of appearance."""
    closest: dict[str, dict[Hashable, Closest]] = field(repr=False)
    """``closest[index][group]``; trials counted within the group."""
    average: dict[str, dict[Hashable, Interval]]
    """``average[index][group]``: mean over the group's closest matches, with its bootstrap interval."""

    def values(self, index: str, group: Hashable) -> np.ndarray:
        """Each tensor's index with its closest match (trial of the group,)."""
        return self.closest[index][group].value


@checked
