"""Touches in batches for PyTorch, and splits that keep related touches together."""

import hashlib
import os
from collections.abc import Callable, Iterator, Mapping, Sequence
from itertools import pairwise
from typing import Any

import numpy as np
import xarray as xr

from feeler.decoding.network import import_torch
from feeler.errors import InvalidInput
from feeler.objects.noise import Noise, parse_noise
from feeler.tensors.formats import load
from feeler.validation import Seed, checked

# Splits without twins: what belongs together lies on one side.

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
    seed: Seed = 0,
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


# Touches in batches, read shard by shard while a network learns.

torch: Any = import_torch()

_BLOCK = 256  # trials read at once: a shard of a large store
_MIX = 4  # [C] blocks whose trials are shuffled among each other


@checked
class TouchDataset(torch.utils.data.IterableDataset):
    """Touches of a store as (tensor, target), for a PyTorch ``DataLoader`` with any number of
    workers.

    Blocks of 256 trials are read in random order, whole and once an epoch, four at a time and
    shuffled among each other; each worker reads blocks of its own, so that no trial comes twice.
    The order follows ``torch.manual_seed``.

    Parameters
    ----------
    store
        Path of a store (or another file of touches), or its Dataset.
    target
        A coordinate of trials: texts become class numbers (``classes``), numbers stay; a list of
        them gives (batch, target) if all are numbers, and classes of all that occurs together
        otherwise. None gives no target.
    noise
        Standard deviation of Gaussian noise, fresh every time, in the variable's unit; or a
        :class:`feeler.objects.Noise` or its text, such as ``"relative:0.1"``; or a function
        ``noise(tensors, rng)``.
    split, by, shares, split_seed
        The side to be read and what keeps trials together, as in :func:`feeler.learn.split_trials`;
        None reads all.
    variable
        What is read, ``angle`` or another over (trial, sensor, time).
    batch_size
        Trials that come at once, for ``DataLoader(dataset, batch_size=None)``, which is the
        fastest; None: one by one, and the DataLoader collects them.
    shuffle
        False reads in the order of the store.

    Attributes
    ----------
    rows
        Numbers of the trials read (position in the Dataset).
    classes
        Names of the classes, or None.
    targets
        Target of each of ``rows``.

    Raises
    ------
    InvalidInput
        A target, variable or split that the store does not have.
    """

    def __init__(
        self,
        store: str | os.PathLike | xr.Dataset,
        target: str | Sequence[str] | None = None,
        *,
        noise: float | str | Noise | Callable[..., np.ndarray] = 0.0,
        split: str | None = None,
        by: str | Sequence[str] = "twin",
        shares: Mapping[str, float] | None = None,
        split_seed: int = 0,
        variable: str = "angle",
        batch_size: int | None = None,
        shuffle: bool = True,
    ) -> None:
        self._source = store
        self._opened: tuple[int, xr.Dataset] | None = None
        tensors = self._open()
        if variable not in tensors or tensors[variable].dims[:1] != ("trial",):
            valid = [
                str(name)
                for name, item in tensors.data_vars.items()
                if item.dims[:1] == ("trial",)
            ]
            raise InvalidInput(
                f"there is no variable {variable!r} of trials; valid: {', '.join(valid)}."
            )
        if isinstance(noise, str | Noise):
            noise = parse_noise(noise).add
        if not callable(noise) and not 0 <= noise < np.inf:
            raise InvalidInput(
                f"noise must be a standard deviation ≥ 0 or a function, got {noise!r}."
            )
        if batch_size is not None and batch_size < 1:
            raise InvalidInput(f"batch_size must be ≥ 1 or None, got {batch_size!r}.")
        self.variable, self.noise, self.batch_size, self.shuffle = (
            variable,
            noise,
            batch_size,
            shuffle,
        )
        self.rows = _find_rows(tensors, split, by, shares, split_seed)
        self.classes, targets = _make_targets(tensors, target)
        self.targets = None if targets is None else torch.from_numpy(targets[self.rows])
        self.shape: tuple[int, ...] = tensors[variable].shape[1:]

    def __len__(self) -> int:
        return (
            len(self.rows) if self.batch_size is None else -(-len(self.rows) // self.batch_size)
        )

    def __repr__(self) -> str:
        classes = (
            "no classes"
            if self.classes is None
            else f"classes {', '.join(map(str, self.classes))}"
        )
        size = " × ".join(map(str, self.shape))
        return f"TouchDataset of {len(self.rows)} touches: {self.variable} {size}, {classes}"

    def read(self, places: Sequence[int] | np.ndarray | slice) -> Any:
        """(tensors, targets) of some of ``rows``, without noise."""
        rows = self.rows[places]
        low, high = int(rows.min()), int(rows.max()) + 1
        item = self._open()[self.variable]
        near = high - low <= _MIX * _BLOCK  # read whole and picked from: zarr picks far slower
        values = item[low:high].values if near else item[rows].values
        if near and high - low > len(rows):
            values = values[rows - low]
        found = torch.from_numpy(np.ascontiguousarray(values, dtype=np.float32))
        return found if self.targets is None else (found, self.targets[places])

    def __iter__(self) -> Iterator[Any]:
        info = torch.utils.data.get_worker_info()
        number, count = (info.id, info.num_workers) if info else (0, 1)
        root = (
            info.seed - info.id
            if info
            else int(torch.empty((), dtype=torch.int64).random_().item())
        )
        blocks = self._make_blocks(np.random.default_rng([root, 0]))[number::count]
        rng = np.random.default_rng([root, 1, number])
        source = torch.Generator().manual_seed(
            int(rng.integers(2**63))
        )  # of noise; three times as fast as NumPy's
        for first in range(0, len(blocks), _MIX):
            yield from self._read_mix(blocks[first : first + _MIX], rng, source)

    def _make_blocks(self, rng: np.random.Generator) -> list[slice]:
        """Places in ``rows`` of each block, in the order of reading: the same in every worker."""
        ends = np.searchsorted(self.rows, np.arange(0, self.rows[-1] + _BLOCK + 1, _BLOCK))
        blocks = [slice(int(a), int(b)) for a, b in pairwise(ends) if a < b]
        return [blocks[k] for k in rng.permutation(len(blocks))] if self.shuffle else blocks

    def _read_mix(
        self, blocks: list[slice], rng: np.random.Generator, source: Any
    ) -> Iterator[Any]:
        read = [self.read(block) for block in blocks]
        pairs = [(x, None) for x in read] if self.targets is None else read
        values = torch.cat([x for x, _ in pairs])
        targets = None if self.targets is None else torch.cat([y for _, y in pairs])
        values = self._add_noise(values, rng, source)
        order = (
            torch.from_numpy(rng.permutation(len(values)))
            if self.shuffle
            else torch.arange(len(values))
        )
        for part in order if self.batch_size is None else order.split(self.batch_size):
            yield values[part] if targets is None else (values[part], targets[part])

    def _add_noise(self, values: Any, rng: np.random.Generator, source: Any) -> Any:
        if callable(self.noise):
            return torch.from_numpy(
                np.asarray(self.noise(values.numpy(), rng), dtype=np.float32)
            )
        if self.noise == 0:
            return values
        return values.add_(torch.empty_like(values).normal_(generator=source), alpha=self.noise)

    def _open(self) -> xr.Dataset:
        """The Dataset; opened anew in each process, as what reads files does not outlive a fork."""
        if isinstance(self._source, xr.Dataset):
            return self._source
        if self._opened is None or self._opened[0] != os.getpid():
            self._opened = os.getpid(), load(self._source)
        return self._opened[1]

    def __getstate__(self) -> dict[str, Any]:
        return self.__dict__ | {"_opened": None}


def _find_rows(
    tensors: xr.Dataset, split: str | None, by: Any, shares: Any, seed: int
) -> np.ndarray:
    if split is None:
        return np.arange(tensors.sizes["trial"])
    sides = split_trials(tensors, by, shares=shares, seed=seed)
    rows = np.flatnonzero(sides == split)
    if not rows.size:
        raise InvalidInput(
            f"split={split!r} is no side; valid: {', '.join(sorted({*sides.tolist()}))}."
        )
    return rows


def _make_targets(
    tensors: xr.Dataset, target: str | Sequence[str] | None
) -> tuple[list | None, np.ndarray | None]:
    """Classes, if the target has any, and the target of each trial."""
    if target is None:
        return None, None
    names = [target] if isinstance(target, str) else [*target]
    for name in names:
        check_coordinate(tensors, name, "target")
    columns = [tensors[name].values for name in names]
    if all(values.dtype.kind in "fiu" for values in columns):
        numbers = np.stack(columns, axis=1).astype(np.float32)
        return None, numbers[:, 0] if isinstance(target, str) else numbers
    parts = [np.unique(values, return_inverse=True) for values in columns]
    found, codes = np.unique(
        np.stack([code.reshape(-1) for _, code in parts], axis=1), axis=0, return_inverse=True
    )
    labels = [
        tuple(kinds[k].item() for (kinds, _), k in zip(parts, row, strict=True))
        for row in found
    ]
    return [row[0] for row in labels] if isinstance(target, str) else labels, codes.reshape(
        -1
    ).astype(np.int64)
