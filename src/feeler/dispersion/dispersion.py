"""Dispersion of groups of tensors: closest matches, their average and its interval."""

from collections.abc import Hashable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Annotated, Any

import numpy as np
import xarray as xr

from feeler.dispersion.closest import Closest, search_closest
from feeler.dispersion.index import BLOCK_SIZE, INDICES, check_tensors
from feeler.dispersion.interval import Interval, bootstrap_mean
from feeler.errors import InvalidInput
from feeler.records.checked import checked
from feeler.tensors.scaling import fold_planes


@dataclass(frozen=True, kw_only=True, eq=False)
class Dispersion:
    """The indices of each group: closest match per tensor, group average, interval.

    Attributes
    ----------
    groups : tuple[Hashable, ...]
        Group names, in order of appearance.
    closest : dict[str, dict[Hashable, Closest]]
        ``closest[index][group]``; trials counted within the group.
    average : dict[str, dict[Hashable, Interval]]
        ``average[index][group]``: mean of the group's closest matches, with its interval.
    """

    groups: tuple[Hashable, ...]
    closest: dict[str, dict[Hashable, Closest]] = field(repr=False)
    average: dict[str, dict[Hashable, Interval]]

    def values(self, index: str, group: Hashable) -> Any:
        """Each tensor's index with its closest match in the group (trial,)."""
        return self.closest[index][group].value


@checked
def compute_dispersion(
    tensors: Any,
    groups: Sequence[Hashable] | np.ndarray | None = None,
    *,
    indices: Sequence[str] | None = None,
    options: dict[str, dict[str, Any]] | None = None,
    scale: bool = True,
    random_state: Annotated[int, "≥ 0"] = 0,
    block: int = BLOCK_SIZE,
) -> Dispersion:
    """How alike each tensor is to its closest match within its group, averaged over the group.

    Lower Pearson, SSIM and NMI and higher MSE mean a more dispersed group.

    Parameters
    ----------
    tensors
        (trial, sensor, time), or activations (trial, component, time); or one such array per group
        by its name, which may differ in sensors and samples: matches are sought within groups only.
    groups
        One name per trial, for instance its speed; None takes the whole set as one group.
    indices
        Names of registered indices; all by default: pearson, ssim, mse, nmi.
    options
        Options per index, e.g. ``{"nmi": {"n_bins": 64}}``.
    scale
        Divide the whole set by one common factor first (``scale_common``). NMI bins span the whole
        set either way.
    random_state
        Seed of the bootstrap.

    Raises
    ------
    InvalidInput
        A group with fewer than two tensors, groups of another length, or tensors an index cannot
        take.

    Notes
    -----
    Paper, "Dataset dispersion evaluation".
    """
    sets = _split(tensors, groups)
    least, greatest = (
        min(array.min() for array in sets.values()),
        max(array.max() for array in sets.values()),
    )
    if scale:
        largest = max(-least, greatest)
        if largest == 0:
            raise InvalidInput(
                "every tensor is zero: there is nothing to scale. Did any contact take place?"
            )
        sets = {name: array / largest for name, array in sets.items()}
        least, greatest = least / largest, greatest / largest
    closest: dict[str, dict[Hashable, Closest]] = {}
    for index in INDICES if indices is None else indices:
        given = (
            {"data_range": (float(least), float(greatest))}
            if INDICES[index].needs_range
            else {}
        )
        given |= (options or {}).get(index, {})
        closest[index] = {
            name: search_closest(array, index, block=block, **given)
            for name, array in sets.items()
        }
    average = {  # the same draws for every group, so that equal groups have equal intervals
        i: {
            n: bootstrap_mean(c.value, np.random.default_rng(random_state))
            for n, c in by_group.items()
        }
        for i, by_group in closest.items()
    }
    return Dispersion(groups=tuple(sets), closest=closest, average=average)


def _split(tensors: Any, groups: Any) -> dict[Hashable, Any]:
    """The tensors of each group, at least two."""
    if isinstance(tensors, Mapping) and not hasattr(tensors, "dims"):
        sets = {name: _check(array) for name, array in tensors.items()}
    else:
        array = _check(tensors)
        given = getattr(groups, "values", groups)
        if groups is not None and not np.ndim(given):
            raise InvalidInput(f"groups must be one label per tensor, got {groups!r}.")
        labels = [""] * len(array) if groups is None else list(given)
        if len(labels) != len(array):
            raise InvalidInput(
                f"{len(labels)} group names for {len(array)} tensors; give one per tensor."
            )
        sets = {
            name: array[[label == name for label in labels]] for name in dict.fromkeys(labels)
        }
    for name, array in sets.items():
        if len(array) < 2:
            raise InvalidInput(
                f"group {name!r} has one tensor; a closest match needs at least two."
            )
    return sets


def _check(tensors: Any) -> Any:
    """Tensors (trial, vector, time) of finite numbers, with their labels if they have any."""
    tensors = fold_planes(tensors)
    array = np.ascontiguousarray(check_tensors(tensors, least=1))
    if not isinstance(tensors, xr.DataArray):
        return array
    return (
        tensors.transpose("trial", ..., "time").copy(data=array)
        if {"trial", "time"} <= {*tensors.dims}
        else array
    )
