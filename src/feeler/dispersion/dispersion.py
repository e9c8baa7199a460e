"""Dispersion of groups of tensors: closest matches, their average and its interval, by index and group."""

from collections.abc import Hashable, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from feeler.dispersion.blocks import BLOCK, as_tensors
from feeler.dispersion.closest import INDICES, Closest, search_closest
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


def scale_common(tensors: Any) -> np.ndarray:
    """The set divided by its greatest absolute entry: one factor for all tensors, so that they stay comparable.

    Non-negative input comes out in [0, 1], as SSIM with range 1 needs it. To compare sets (speeds, antennas), scale
    them together, then split them.
    """
    array = as_tensors(tensors, least=1)
    largest = np.abs(array).max()
    if largest == 0:
        raise InvalidInput("every tensor is zero: there is nothing to scale. Did any contact take place?")
    return array / largest


def compute_dispersion(
    tensors: Any,
    groups: Sequence[Hashable] | None = None,
    *,
    indices: Sequence[str] = tuple(INDICES),
    options: dict[str, dict[str, Any]] | None = None,
    scale: bool = True,
    random_state: int = 0,
    block: int = BLOCK,
) -> Dispersion:
    """How alike each tensor is to its closest match within its group, averaged over the group.

    Lower Pearson, SSIM and NMI and higher MSE mean a more dispersed group.

    Parameters
    ----------
    tensors
        (trial, sensor, time), or activations (trial, component, time).
    groups
        One name per trial, for instance its speed; None takes the whole set as one group.
    indices
        Any of pearson, ssim, mse, nmi.
    options
        Options per index, e.g. ``{"nmi": {"n_bins": 64}}``.
    scale
        Divide the whole set by one common factor first (``scale_common``). NMI bins span the whole set either way.
    random_state
        Seed of the bootstrap.

    Raises
    ------
    InvalidInput
        A group with fewer than two tensors, groups of another length, or tensors an index cannot take.

    Notes
    -----
    Paper, "Dataset dispersion evaluation".
    """
    array = scale_common(tensors) if scale else as_tensors(tensors)
    labels = [""] * len(array) if groups is None else list(getattr(groups, "values", groups))
    names = tuple(dict.fromkeys(labels))
    members = _find_members(labels, names, len(array))
    options = {"nmi": {"data_range": (float(array.min()), float(array.max()))}} | (options or {})
    rng = np.random.default_rng(random_state)
    closest = {
        index: {
            name: search_closest(array[members[name]], index, block=block, **options.get(index, {})) for name in names
        }
        for index in indices
    }
    average = {i: {n: bootstrap_mean(c.value, rng) for n, c in by_group.items()} for i, by_group in closest.items()}
    return Dispersion(groups=names, closest=closest, average=average)


def _find_members(labels: list[Hashable], names: tuple[Hashable, ...], n: int) -> dict[Hashable, np.ndarray]:
    if len(labels) != n:
        raise InvalidInput(f"{len(labels)} group names for {n} tensors; give one per tensor.")
    members = {name: np.array([k for k, label in enumerate(labels) if label == name]) for name in names}
    for name, trials in members.items():
        if trials.size < 2:
            raise InvalidInput(f"group {name!r} has one tensor; a closest match needs at least two.")
    return members
