"""Stored trials as a Dataset that reads its numbers when they are used."""

import json
import os
from collections.abc import Callable
from functools import partial
from itertools import groupby
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
from xarray.backends import BackendArray
from xarray.core import indexing

from feeler.errors import InvalidInput
from feeler.tensors.quantities import QUANTITIES, derive_curvature
from feeler.tensors.records import Label, check_shards, find_groups, read_label, read_record
from feeler.tensors.shards import find_key, open_array

MAX_LISTED = 1000  # trials, above which what each was made with stays in the records
MANY = 64  # groups, above which the labels come from their arrays instead of the records
_WIDEST = 1000  # [C] characters; labels with longer texts are read when the store is opened
_TEXT = np.dtypes.StringDType()


class _Later(BackendArray):
    """An array that ``read(key)`` reads when it is used."""

    def __init__(
        self, shape: tuple[int, ...], dtype: np.dtype, read: Callable[[tuple], np.ndarray]
    ) -> None:
        self.shape, self.dtype, self._read = shape, dtype, read

    def __getitem__(self, key: Any) -> Any:
        outer = indexing.IndexingSupport.OUTER
        return indexing.explicit_indexing_adapter(key, self.shape, outer, self._read)


def _read_numbers(array: Any, path: Path, length: np.ndarray | None, key: tuple) -> np.ndarray:
    """Trials of one array of a store; divided by ``length`` (sensor,) where curvature is derived
    from angle.
    """
    try:
        values = np.asarray(array.oindex[key])
    except Exception as error:  # whatever zarr says of a damaged shard is news about the shard
        raise InvalidInput(
            f"{path}: {array.name or 'a variable'} is damaged ({str(error)[:150]})."
            " feeler validate names the trials, and the command that made the store computes"
            " them again."
        ) from error
    if length is None:
        return values
    length = np.broadcast_to(length[:, None], array.shape)
    for axis in reversed(range(len(key))):
        length = length[(slice(None),) * axis + (key[axis],)]
    return derive_curvature(values, length).astype(array.dtype)


def _read_texts(path: Path, name: str, label: Label, width: int, key: tuple) -> np.ndarray:
    """A label of all trials, from its array, or from the records where that is damaged."""
    try:
        texts = np.asarray(_open_copies(path)[name].oindex[key]).astype(_TEXT)
    except Exception:  # a copy, and the records have it all
        texts = np.full(label.n_trials, "", _TEXT)
        for group in find_groups(path):
            record = read_record(path, group, label)
            texts[record.trials] = record.labels[name]
        texts = texts[key]
    if np.strings.str_len(texts).max(initial=0) > width:
        raise InvalidInput(
            f"{path} is damaged: '{name}' has longer texts than the store says. The"
            " command that made the store mends it."
        )
    return texts.astype(f"U{width}")


def read_store(path: str | os.PathLike, *, first: int | None = None) -> xr.Dataset:
    """The finished trials of a store, in trial order, lazily and without locking it.

    Numbers are read when they are used, and so are the texts of a store of many whole groups; all
    other labels are in memory. Curvature is derived from angle where it is not stored.

    Parameters
    ----------
    first
        Only so many groups are read.

    Raises
    ------
    InvalidInput
        No store, no finished trial, or damaged.
    """
    path = Path(path)
    label = read_label(path)
    groups = find_groups(path)[:first] if label.layout is not None else []
    if not groups:
        raise InvalidInput(
            f"the store {path} holds no finished trial yet. Let the simulation go on."
        )
    _check_files(path, label, groups)
    try:
        return _assemble(path, label, *_read_labels(path, label, groups))
    except (KeyError, TypeError, ValueError, AttributeError, OverflowError) as error:
        if isinstance(error, InvalidInput):
            raise
        raise InvalidInput(f"{path} is damaged: {str(error)[:200]}.") from error


def _check_files(path: Path, label: Label, groups: list[int]) -> None:
    """Raise where a shard is missing, which Zarr would read as NaN, or is a link, which may lead
    anywhere.
    """
    for name, item in label.layout.variables.items():  # type: ignore[union-attr]
        try:
            found = {entry.name: entry.is_symlink() for entry in os.scandir(path / name)}
        except OSError as error:
            raise InvalidInput(f"{path / name} cannot be read: {error.strerror}.") from error
        for group in groups:
            if found.get(key := find_key(group, item), True):
                raise InvalidInput(
                    f"{path / name / key} is {'a link' if key in found else 'missing'}. The command"
                    " that made the store computes its trials again."
                )


def _read_labels(
    path: Path, label: Label, groups: list[int]
) -> tuple[np.ndarray, dict[str, xr.Variable], list]:
    """Finished trials, their labels, and what they were made with where they are few.

    To read a million texts takes a second: where all groups are whole it waits until they are used.
    """
    whole, copies = _read_copies(path, label) if len(groups) > MANY else (set(), {})
    if copies and whole.issuperset(groups):
        rows = _list_rows(groups, label)
        return (
            rows,
            {name: values.isel(trial=_pick(rows)) for name, values in copies.items()},
            [],
        )
    kinds = label.layout.labels  # type: ignore[union-attr]
    trials: list[np.ndarray] = []
    made: list[Any] = []
    parts: dict[str, list[np.ndarray]] = {name: [] for name in kinds}
    found: list[tuple[np.ndarray, Any]]
    for is_whole, run in groupby(groups, key=whole.__contains__):
        if is_whole:
            rows = _list_rows([*run], label)
            found = [
                (
                    rows,
                    {
                        name: values.isel(trial=_pick(rows)).values
                        for name, values in copies.items()
                    },
                )
            ]
        else:
            records = [read_record(path, group, label) for group in run]
            made += [one for record in records for one in record.made]
            found = [(np.array(record.trials), record.labels) for record in records]
        for rows, values in found:
            trials.append(rows)
            for name, kind in kinds.items():
                parts[name].append(to_array(values[name], kind))
    labels = {name: xr.Variable("trial", np.concatenate(part)) for name, part in parts.items()}
    return np.concatenate(trials), labels, made


def _list_rows(groups: list[int], label: Label) -> np.ndarray:
    """The trials of whole groups."""
    rows = (label.group * np.array(groups)[:, None] + np.arange(label.group)).ravel()
    return rows[rows < label.n_trials]


def _pick(rows: np.ndarray) -> slice | np.ndarray:
    """The same rows as a slice where they are a run."""
    return (
        slice(int(rows[0]), int(rows[-1]) + 1) if rows[-1] - rows[0] + 1 == rows.size else rows
    )


def to_array(values: Any, kind: str) -> np.ndarray:
    """Labels as an array; infinite and NaN ones are words in JSON."""
    if kind == "str" and isinstance(values, np.ndarray):
        texts = values.astype(_TEXT)
        return texts.astype(f"U{np.strings.str_len(texts).max(initial=1)}")
    if kind == "str":
        return np.array(values, dtype=str)
    if isinstance(values, np.ndarray):
        return values.astype(kind)
    return np.array(
        [float(value) if isinstance(value, str) else value for value in values]
    ).astype(kind)


def _read_copies(path: Path, label: Label) -> tuple[set[int], dict[str, xr.Variable]]:
    """Whole groups whose labels are in the labels' arrays, and these arrays; none where they cannot
    be read.
    """
    try:
        group = _open_copies(path)
        finished, widths = (
            np.asarray(group["finished"][...]),
            group.attrs["feeler_store"].get("widths", {}),
        )
        copies = {}
        for name, kind in label.layout.labels.items():  # type: ignore[union-attr]
            if kind == "str" and 0 < int(widths.get(name, 0)) <= _WIDEST:
                width = int(widths[name])
                read = partial(_read_texts, path, name, label, width)
                texts = _Later((label.n_trials,), np.dtype(f"U{width}"), read)
                cached = indexing.MemoryCachedArray(indexing.LazilyIndexedArray(texts))
                copies[name] = xr.Variable("trial", cached)
            else:
                copies[name] = xr.Variable(
                    "trial", to_array(np.asarray(group[name][...]), kind)
                )
    except Exception:  # they are copies, and the records have it all
        return set(), {}
    ends = range(0, min(finished.size, label.n_trials), label.group)
    return {
        start // label.group for start in ends if finished[start : start + label.group].all()
    }, copies


def _open_copies(path: Path) -> Any:
    import zarr

    return zarr.open_group(path, mode="r", zarr_format=3)


def _assemble(
    path: Path, label: Label, trials: np.ndarray, labels: dict[str, xr.Variable], made: list
) -> xr.Dataset:
    layout = label.layout
    dataset = layout.make_shared()  # type: ignore[union-attr]
    size = (int(trials[-1]) // label.group + 1) * label.group
    found: dict[str, xr.Variable] = {}
    for name, item in layout.variables.items():  # type: ignore[union-attr]
        found[name] = _open(path, name, item, size, label, trials)
        lacking = "curvature" not in layout.variables  # type: ignore[union-attr]
        if name == "angle" and lacking and "segment_length" in dataset:
            length = dataset["segment_length"].values
            quantity = QUANTITIES["curvature"]
            attrs = {"units": quantity.unit, "long_name": quantity.meaning}
            found["curvature"] = _open(path, name, item, size, label, trials, length, attrs)
    for name, values in labels.items():
        values.attrs = dict(layout.attributes.get(name) or {})  # type: ignore[union-attr]
        found[name] = values
    coordinates = {n: found.pop(n) for n in layout.coordinates if n in found}  # type: ignore[union-attr]
    if trials.size == len(made) <= MAX_LISTED:
        dataset.attrs["trials"] = json.dumps(made, sort_keys=True)
    return dataset.assign(found).assign_coords(coordinates)


def _open(path, name, item, size, label, trials, length=None, attrs=None) -> xr.Variable:
    array = open_array(path, name, item, size, label.group)
    later = _Later(array.shape, array.dtype, partial(_read_numbers, array, path, length))
    variable = xr.Variable(
        item.dims,
        indexing.LazilyIndexedArray(later),
        item.attributes if attrs is None else attrs,
    )
    return variable.isel(trial=_pick(trials))


def describe_store(path: Path) -> list[str]:
    """How much of a store is finished, without reading its numbers."""
    label = read_label(path)
    groups = find_groups(path)
    count = (
        sum(len(read_record(path, group, label).trials) for group in groups)
        if len(groups) <= MANY
        else None
    )
    words = (
        f"{count} of {label.n_trials} trials"
        if count is not None
        else f"{len(groups):,} groups of {label.group} trials"
    )
    part = "" if count is not None else f"; below: the first {MANY} groups"
    return [f"{words} finished{part}"]


def find_damage(path: Path) -> list[str]:
    """What is wrong with the shards and records of a store, one line for each group."""
    label, problems = read_label(path), []
    for group in find_groups(path):
        try:
            check_shards(path, read_record(path, group, label), label)
        except InvalidInput as error:
            problems.append(f"{error} The command that made the store computes them again.")
    return problems
