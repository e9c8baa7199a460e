"""Touches in batches for PyTorch, and splits that keep related touches together."""

import hashlib
import os
from collections.abc import Callable, Iterator, Mapping, Sequence
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
    rank = np.arange(len(shares))
    ends = np.maximum.accumulate(np.maximum(ends, 1) - rank) + rank  # each side has a group
    ends = np.minimum(ends, n - rank[::-1])
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
        _check_coordinate(tensors, name, "by")
    return names


def _check_coordinate(tensors: xr.Dataset, name: str, what: str) -> None:
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
    """Numbers (trial,) of the groups that one coordinate makes; trials without a value are one."""
    values = tensors[name].values
    if values.dtype.kind == "f":
        # to the digits of class labels, so that rounding parts no twins
        values = np.array([float(f"{value:g}") for value in values])
    distinct, number = np.unique(values, return_inverse=True)
    if values.dtype.kind != "f" or distinct.size <= _CUTS:
        return number.reshape(-1)
    low, high = np.nanmin(distinct), np.nanmax(distinct)
    piece = np.minimum(_CUTS * (values - low) / (high - low), _CUTS - 1)
    return np.nan_to_num(piece, nan=_CUTS).astype(int)


# Touches for PyTorch: one by one from anywhere (map style), or batches in the order of reading.

torch: Any = import_torch()

_BLOCK = 256  # trials read at once: a shard of a large store
_MIX = 4  # [C] blocks whose trials are shuffled among each other
_CACHE = 2**30  # [C] bytes of blocks that are kept for touches asked for one by one


class _Touches:
    """What both kinds of dataset read: rows of a store, their targets, noise and a transform."""

    def __init__(
        self,
        store: str | os.PathLike | xr.Dataset,
        target: str | Sequence[str] | None = None,
        *,
        noise: float | str | Noise | Callable[..., np.ndarray] = 0.0,
        transform: Callable[[Any], Any] | None = None,
        split: str | None = None,
        by: str | Sequence[str] = "twin",
        shares: Mapping[str, float] | None = None,
        split_seed: int = 0,
        variable: str = "angle",
    ) -> None:
        self._source = store
        self._opened: tuple[int, xr.Dataset] | None = None
        self._blocks: dict[int, Any] = {}
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
        self.variable, self.noise, self.transform = variable, noise, transform
        self.rows = np.arange(tensors.sizes["trial"])
        if split is not None:
            sides = split_trials(tensors, by, shares=shares, seed=split_seed)
            self.rows = np.flatnonzero(sides == split)
            if not self.rows.size:
                raise InvalidInput(
                    f"split={split!r} is no side; valid: {', '.join(sorted({*sides.tolist()}))}."
                )
        self.classes, targets = _make_targets(tensors, target)
        self.targets = None if targets is None else torch.from_numpy(targets[self.rows])
        self.shape: tuple[int, ...] = tensors[variable].shape[1:]

    def read(self, places: Sequence[int] | np.ndarray | slice) -> Any:
        """(tensors, targets) of some of ``rows``, without noise."""
        rows = self.rows[places]
        found = torch.empty((len(rows), *self.shape))
        for k in np.unique(rows // _BLOCK).tolist():
            own = np.flatnonzero(rows // _BLOCK == k)
            found[own] = self._read_block(k)[rows[own] - k * _BLOCK]
        return found if self.targets is None else (found, self.targets[places])

    def _read_block(self, k: int) -> Any:
        """256 trials, whole; the last ones read stay."""
        if k not in self._blocks:
            item = self._open()[self.variable][k * _BLOCK : (k + 1) * _BLOCK]
            block = torch.from_numpy(np.ascontiguousarray(item.values, dtype=np.float32))
            most = max(2 * _MIX, _CACHE // max(block.nbytes, 1))
            while len(self._blocks) >= most:
                self._blocks.pop(next(iter(self._blocks)))
            self._blocks[k] = block
        return self._blocks[k]

    def _prepare(self, values: Any, seed: Sequence[int]) -> Any:
        """Noise and the transform, on tensors of its own."""
        if callable(self.noise):
            noisy = self.noise(values.numpy(), np.random.default_rng(seed))
            values = torch.from_numpy(np.asarray(noisy, dtype=np.float32))
        elif self.noise:
            number = int(np.random.default_rng(seed).integers(2**63))
            source = torch.Generator().manual_seed(number)  # three times as fast as NumPy's
            values.add_(torch.empty_like(values).normal_(generator=source), alpha=self.noise)
        return values

    def _open(self) -> xr.Dataset:
        """The Dataset; opened anew in each process, as what reads files does not outlive a fork."""
        if isinstance(self._source, xr.Dataset):
            return self._source
        if self._opened is None or self._opened[0] != os.getpid():
            self._opened = os.getpid(), load(self._source)
        return self._opened[1]

    def __getstate__(self) -> dict[str, Any]:
        return self.__dict__ | {"_opened": None, "_blocks": {}}


def _draw_seed() -> int:
    return int(torch.empty((), dtype=torch.int64).random_().item())


@checked
class TouchDataset(_Touches, torch.utils.data.Dataset):
    """Touches of a store as (tensor, target), for a PyTorch ``DataLoader`` with any options:
    ``shuffle=True``, samplers, ``random_split``, ``Subset``, workers and ranks.

    ``len(dataset)`` is the number of touches. Up to 1 GiB of what was read stays in memory; of sets
    that are larger, :class:`TouchBatches` reads each touch once an epoch.

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
    transform
        Applied to each tensor (sensor, time) after the noise.
    split, by, shares, split_seed
        The side to be read and what keeps trials together, as in :func:`feeler.learn.split_trials`;
        None reads all.
    variable
        What is read, ``angle`` or another over (trial, sensor, time).

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

    def __len__(self) -> int:
        return len(self.rows)

    def __getitem__(self, place: int) -> Any:
        if not -len(self) <= place < len(self):
            raise IndexError(f"touch {place} of {len(self)}.")
        return self.__getitems__([place])[0]

    def __getitems__(self, places: list[int]) -> list:
        """Several at once, which is what a DataLoader asks for."""
        found = self.read(np.asarray(places, dtype=int))
        values = found if self.targets is None else found[0]
        values = self._prepare(values, [_draw_seed()])
        values = values if self.transform is None else [self.transform(one) for one in values]
        return [*values] if self.targets is None else [*zip(values, found[1], strict=True)]


@checked
class TouchBatches(_Touches, torch.utils.data.IterableDataset):
    """Batches of touches as (tensors, targets), for ``DataLoader(batches, batch_size=None)``: each
    touch once an epoch, read block by block.

    Blocks of 256 trials come in random order, four at a time and shuffled among each other.
    ``len(batches)`` is the number of batches that come, whatever the workers: all but the last have
    ``batch_size`` touches. Among several ranks each gets equally many; where batches do not divide,
    some come twice, or with ``drop_last`` not at all, as with PyTorch's ``DistributedSampler``.

    Parameters
    ----------
    store, target, noise, split, by, shares, split_seed, variable
        As for :class:`TouchDataset`.
    transform
        Applied to each batch (touch, sensor, time) after the noise.
    batch_size
        Touches in a batch.
    shuffle
        False reads in the order of the store.
    drop_last
        Whether a last batch of fewer touches is left out.
    rank, world_size
        Which share of the batches is read, of how many; None: those of ``torch.distributed``, if it
        has been set up. Ranks shuffle by ``split_seed`` and the epoch: call ``set_epoch`` before
        each. A single process follows ``torch.manual_seed``.

    Raises
    ------
    InvalidInput
        As for :class:`TouchDataset`; fewer batches than ranks.
    """

    def __init__(
        self,
        store: str | os.PathLike | xr.Dataset,
        target: str | Sequence[str] | None = None,
        *,
        batch_size: int = 32,
        shuffle: bool = True,
        drop_last: bool = False,
        rank: int | None = None,
        world_size: int | None = None,
        noise: float | str | Noise | Callable[..., np.ndarray] = 0.0,
        transform: Callable[[Any], Any] | None = None,
        split: str | None = None,
        by: str | Sequence[str] = "twin",
        shares: Mapping[str, float] | None = None,
        split_seed: int = 0,
        variable: str = "angle",
    ) -> None:
        if batch_size < 1:
            raise InvalidInput(f"batch_size must be ≥ 1, got {batch_size!r}.")
        super().__init__(
            store,
            target,
            noise=noise,
            transform=transform,
            split=split,
            by=by,
            shares=shares,
            split_seed=split_seed,
            variable=variable,
        )
        joined = torch.distributed.is_available() and torch.distributed.is_initialized()
        if world_size is None:
            world_size = torch.distributed.get_world_size() if joined else 1
        if rank is None:
            rank = torch.distributed.get_rank() if joined else 0
        if not 0 <= rank < world_size:
            raise InvalidInput(
                f"rank must lie in 0 … world_size − 1, got {rank} of {world_size}."
            )
        self.batch_size, self.shuffle, self.drop_last = batch_size, shuffle, drop_last
        self.rank, self.world_size, self.seed, self.epoch = rank, world_size, split_seed, 0
        if self._count_all() < world_size:
            raise InvalidInput(
                f"{len(self.rows)} touches are {self._count_all()} batches of {batch_size}, fewer"
                f" than the {world_size} ranks; choose a smaller batch_size."
            )

    def set_epoch(self, epoch: int) -> None:
        """The number by which ranks shuffle alike."""
        self.epoch = epoch

    def _count_all(self) -> int:
        """Batches of all ranks."""
        n, size = len(self.rows), self.batch_size
        return n // size if self.drop_last else -(-n // size)

    def __len__(self) -> int:
        count = self._count_all()
        return count // self.world_size if self.drop_last else -(-count // self.world_size)

    def __iter__(self) -> Iterator[Any]:
        info = torch.utils.data.get_worker_info()
        number, count = (info.id, info.num_workers) if info else (0, 1)
        alone = info.seed - info.id if info else _draw_seed()
        root = [alone] if self.world_size == 1 else [self.seed, self.epoch]
        order = self._make_order(np.random.default_rng([*root, 0]))
        own = (self.rank * len(self) + np.arange(len(self))) % self._count_all()
        for k in np.array_split(own, count)[number].tolist():
            found = self.read(order[k * self.batch_size : (k + 1) * self.batch_size])
            values = found if self.targets is None else found[0]
            values = self._prepare(values, [*root, 1, k])
            values = values if self.transform is None else self.transform(values)
            yield values if self.targets is None else (values, found[1])

    def _make_order(self, rng: np.random.Generator) -> np.ndarray:
        """Places in ``rows`` in the order of reading: the same in every worker and rank."""
        places = np.arange(len(self.rows))
        if not self.shuffle:
            return places
        blocks = np.split(places, np.flatnonzero(np.diff(self.rows // _BLOCK)) + 1)
        blocks = [blocks[k] for k in rng.permutation(len(blocks))]
        mixes = [blocks[k : k + _MIX] for k in range(0, len(blocks), _MIX)]
        return np.concatenate([rng.permutation(np.concatenate(mix)) for mix in mixes])


def _make_targets(
    tensors: xr.Dataset, target: str | Sequence[str] | None
) -> tuple[list | None, np.ndarray | None]:
    """Classes, if the target has any, and the target of each trial."""
    if target is None:
        return None, None
    names = [target] if isinstance(target, str) else [*target]
    for name in names:
        _check_coordinate(tensors, name, "target")
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
