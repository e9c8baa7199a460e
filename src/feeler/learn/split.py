"""Splits without twins: what belongs together lies on one side."""

import hashlib
from collections.abc import Mapping, Sequence
from typing import Annotated

import numpy as np
import xarray as xr

from feeler.errors import InvalidInput
from feeler.records.checked import checked

_SHARES = {"train": 0.8, "validate": 0.1, "test": 0.1}  # [C]
# what two touches share that differ in nothing but noise
_TWIN = (
    "feature",
    "size",
    "location",
    "speed",
    "approach",
    "side",
    "lead",
    "friction",
    "base",
    "antenna",
)
# [C] equal pieces into which the range of a number is cut: touches of one piece are on one side
_CUTS = 20


@checked
def split_trials(
    tensors: xr.Dataset,
    by: str | Sequence[str] = "twin",
    *,
    shares: Mapping[str, float] | None = None,
    seed: Annotated[int, "≥ 0"] = 0,
) -> np.ndarray:
    """The name of each trial's side (trial,): trials with the same ``by`` are on one side.

    Parameters
    ----------
    by
        A coordinate of trials, or several: ``"feature"`` for objects never touched in training,
        ``"location"`` for places (a number's range is cut into 20 equal pieces), ``"antenna"`` for
        antennas; ``"twin"`` keeps together what has equal parameters.
    shares
        Names of the sides and their shares; default 80 % ``train``, 10 % ``validate``, 10 %
        ``test``. Sides are whole groups, so that few groups meet the shares badly, but each side
        has one.

    Raises
    ------
    InvalidInput
        No such coordinate, shares that are no shares, or fewer groups than sides.
    """
    shares = dict(shares or _SHARES)
    if (
        not shares
        or not all(value > 0 for value in shares.values())
        or abs(sum(shares.values()) - 1) > 1e-6
    ):
        raise InvalidInput(f"shares must be > 0 and add up to 1, got {shares}.")
    keys = [_group(tensors, name) for name in _name_coordinates(tensors, by)]
    _, group = np.unique(np.stack(keys, axis=1), axis=0, return_inverse=True)
    group = group.reshape(-1)
    n = int(group.max()) + 1
    if n < len(shares):
        raise InvalidInput(
            f"{by!r} has {n} groups of trials, too few for {len(shares)} sides:"
            f" {', '.join(shares)}."
        )
    order = sorted(range(n), key=lambda k: hashlib.blake2b(f"{seed} {k}".encode()).digest())
    ends = np.round(np.cumsum([*shares.values()]) * n).astype(int)
    ends = np.maximum(ends, np.arange(1, len(shares) + 1))  # each side has a group
    ends = np.minimum(ends, n - np.arange(len(shares))[::-1])
    side = np.empty(n, dtype=int)
    side[order] = np.searchsorted(ends, np.arange(n), side="right")
    return np.array([*shares])[side[group]]


def _name_coordinates(tensors: xr.Dataset, by: str | Sequence[str]) -> list[str]:
    names = (
        [name for name in _TWIN if name in tensors.coords]
        if isinstance(by, str) and by == "twin"
        else [by]
        if isinstance(by, str)
        else [*by]
    )
    if not names:
        raise InvalidInput("by must name one coordinate of trials or more, got none.")
    for name in names:
        check_coordinate(tensors, name, "by")
    return names


def check_coordinate(tensors: xr.Dataset, name: str, what: str) -> None:
    """Refuse what is no coordinate of trials."""
    valid = sorted(
        str(key)
        for key, item in tensors.coords.items()
        if item.dims == ("trial",) and key != "trial"
    )
    if name not in valid:
        raise InvalidInput(
            f"{what}={name!r} is no coordinate of the trials; valid: {', '.join(valid)}."
        )


def _group(tensors: xr.Dataset, name: str) -> np.ndarray:
    """Numbers (trial,) of the groups that one coordinate makes."""
    values = tensors[name].values
    distinct, number = np.unique(values, return_inverse=True)
    if values.dtype.kind != "f" or distinct.size <= _CUTS:
        return number.reshape(-1)
    low, high = distinct[0], distinct[-1]
    return np.minimum((_CUTS * (values - low) / (high - low)).astype(int), _CUTS - 1)
