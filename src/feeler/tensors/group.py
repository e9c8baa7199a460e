"""One group of trials on its way into a store; its shards may be written by any worker that sees
the folder.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from feeler.disk.provenance import make_plain
from feeler.errors import StoreError
from feeler.tensors.disk import explain, write_atomic
from feeler.tensors.records import PROGRESS, GroupRecord, Layout, compute_sum, make_layout
from feeler.tensors.shards import empty, encode_shard, find_key


@dataclass(frozen=True, kw_only=True)
class StoredGroup:
    """A group whose shards are on disk; its trials are finished when the store has written its
    record.

    Attributes
    ----------
    n_bytes : int
        What its shards take on disk.
    """

    layout: Layout
    record: GroupRecord
    n_bytes: int


def write_group(
    path: Path, size: int, indices: Sequence[int], trials: xr.Dataset, made: Sequence[Any]
) -> StoredGroup:
    """Write the shards of a group that the store does not hold yet.

    Raises
    ------
    StoreError
        The disk is full, or this machine does not see the store.
    """
    if not (path / PROGRESS).is_dir():
        raise StoreError(
            f"this worker sees no store at {path}. The folder must be shared by all workers, under"
            " one name."
        )
    layout = make_layout(trials)
    with explain(
        path,
        f"trials {min(indices)} to {max(indices)} are not stored; the finished ones are safe",
    ):
        for name in layout.variables:
            (path / name).mkdir(exist_ok=True)
        shards = {
            name: encode_rows(layout, name, size, indices, trials) for name in layout.variables
        }
        record = make_group_record(layout, size, indices, trials, made, shards)
        for name, raw in shards.items():
            write_atomic(path / name / find_key(record.group, layout.variables[name]), raw)
    return StoredGroup(layout=layout, record=record, n_bytes=sum(map(len, shards.values())))


def make_group_record(
    layout: Layout,
    size: int,
    indices: Sequence[int],
    trials: xr.Dataset,
    made: Sequence[Any],
    shards: dict[str, bytes],
) -> GroupRecord:
    """The record of trials of one group, whose shards are these."""
    order = np.argsort(indices)
    return GroupRecord(
        group=indices[0] // size,
        trials=sorted(indices),
        labels={
            name: make_plain(trials.variables[name].values[order]) for name in layout.labels
        },
        shards={name: [compute_sum(raw)] for name, raw in shards.items()},
        made=[make_plain(made[place]) for place in order] if made else [],
    )


def encode_rows(
    layout: Layout,
    name: str,
    size: int,
    indices: Sequence[int],
    trials: xr.Dataset,
    held: tuple[Sequence[int], np.ndarray] | None = None,
) -> bytes:
    """The bytes of a group's shard: these trials, and those it holds already (their rows and
    values).
    """
    item = layout.variables[name]
    values = empty(item, size)
    if held is not None:
        values[held[0]] = held[1]
    values[[index % size for index in indices]] = trials.variables[name].values
    return encode_shard(item, values, size)
