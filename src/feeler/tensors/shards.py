"""Shards: the numbers of one group of trials in one file each variable, encoded and decoded by the
zarr library.

A shard holds inner chunks of a few trials, so that a few can be read without the others; each chunk
is compressed and has a checksum of its own.
"""

import warnings
from collections.abc import Mapping
from dataclasses import field
from pathlib import Path
from typing import Any

import numpy as np
import zarr
from zarr.codecs import Crc32cCodec, ZstdCodec
from zarr.storage import LocalStore, MemoryStore, StorePath

from feeler.records.record import Record

# [C] trials in one chunk: 0.7 MB of 56 sensors and 100 samples; 8 take twice the time to read and
# write
INNER = 32
# [C] trials in one chunk of a label, so that the file need not change its shape as a store grows
_LABELS = 65_536
_LEVEL = 1  # [C] of zstd: higher ones take 3 times the time for 1 % less


class Variable(Record):
    """What all trials of one variable share.

    Attributes
    ----------
    shape : tuple[int, ...]
        Without the trials.
    """

    dims: tuple[str, ...]
    shape: tuple[int, ...]
    dtype: str
    attributes: dict[str, Any] = field(default_factory=dict)


def make_array(
    files: dict[str, Any], name: str, item: Variable, n_trials: int, group: int
) -> zarr.Array:
    """An array (trial, …) in memory, one shard a group; its files come to lie in ``files``."""
    return _create(
        files,
        name,
        (n_trials, *item.shape),
        item,
        (find_inner(group), *item.shape),
        (group, *item.shape),
    )


def find_inner(group: int) -> int:
    """Trials in one chunk: as many as INNER at most, and a whole part of the group."""
    return max(size for size in range(1, min(INNER, group) + 1) if group % size == 0)


def label_trials(
    files: dict[str, Any], name: str, values: np.ndarray, dims: tuple[str, ...], attrs: dict
) -> None:
    """A small array in memory, whole: a label of the trials, or what all trials share."""
    text = values.dtype.kind not in "biuf"
    item = Variable(
        dims=dims, shape=(), dtype="str" if text else values.dtype.str, attributes=attrs
    )
    chunk = (_LABELS,) if dims == ("trial",) else values.shape
    _create(files, name, values.shape, item, chunk, None)[...] = values


def _create(
    files: dict, name: str, shape: tuple, item: Variable, chunk: tuple, shard: tuple | None
) -> zarr.Array:
    return zarr.create_array(
        MemoryStore(store_dict=files),
        name=name,
        shape=shape,
        dtype=str if item.dtype == "str" else item.dtype,
        chunks=tuple(max(n, 1) for n in chunk),
        shards=shard and tuple(max(n, 1) for n in shard),
        filters=None,
        compressors=[ZstdCodec(level=_LEVEL), Crc32cCodec()],
        fill_value=_find_fill(item.dtype),
        dimension_names=item.dims,
        chunk_key_encoding={"name": "default", "separator": "."},
        attributes=item.attributes,
        config=(
            None if shard is None else {"write_empty_chunks": True}
        ),  # so that a shard always is a file
    )


def _find_fill(dtype: str) -> Any:
    return (
        ""
        if dtype == "str"
        else np.nan
        if np.dtype(dtype).kind == "f"
        else np.zeros((), dtype).item()
    )


def encode_shard(item: Variable, values: np.ndarray, group: int) -> bytes:
    """The bytes of one shard with the trials of ``values`` (group, …)."""
    files: dict[str, Any] = {}
    array = make_array(files, "shard", item, group, group)
    array[...] = values
    return files["shard/" + find_key(0, item)].to_bytes()


def find_key(group: int, item: Variable) -> str:
    """The name of a group's shard in the folder of its variable."""
    return ".".join(["c", str(group), *("0" for _ in item.shape)])


def open_array(path: Path, name: str, item: Variable, n_trials: int, group: int) -> zarr.Array:
    """The array (trial, …) of a variable in a store, to be read; its metadata are ours, not those
    on disk.
    """
    metadata = make_array({}, name, item, n_trials, group).metadata
    place = StorePath(LocalStore(path, read_only=True), name)
    return zarr.Array(zarr.AsyncArray(metadata=metadata, store_path=place))


def empty(item: Variable, n_trials: int) -> np.ndarray:
    """As many trials without values."""
    return np.full((n_trials, *item.shape), _find_fill(item.dtype), dtype=item.dtype)


def make_group(
    files: dict[str, Any], attributes: Mapping[str, Any], *folders: str
) -> dict[str, bytes]:
    """All files in memory as one consolidated Zarr group with empty groups in it; its own file
    comes last.
    """
    store = MemoryStore(store_dict=files)
    root = zarr.open_group(store, mode="a", zarr_format=3)
    root.attrs.update(attributes)
    for folder in folders:
        root.require_group(folder)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # consolidated metadata are not in the standard yet
        zarr.consolidate_metadata(store, zarr_format=3)
    return {
        name: files[name].to_bytes()
        for name in sorted(files, key=lambda name: name == "zarr.json")
    }
