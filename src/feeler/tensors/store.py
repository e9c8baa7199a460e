"""The store being written: finished trials on disk as they come, safe against whatever ends the
process.
"""

import json
import os
import warnings
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from feeler.errors import FeelerError, InvalidInput, StoreError
from feeler.files import TEMPORARY, Lock, explain, sync_folder, write_atomic
from feeler.provenance import make_plain
from feeler.tensors.stored import (
    FORMAT,
    LABEL,
    PROGRESS,
    GroupRecord,
    Label,
    Layout,
    check_same,
    check_shards,
    compute_sum,
    empty,
    encode_shard,
    find_groups,
    find_key,
    find_shard,
    label_trials,
    make_array,
    make_group,
    make_layout,
    merge,
    open_array,
    read_label,
    read_record,
    read_store,
    record_path,
    seal,
    to_array,
)

# One group of trials on its way into a store; its shards may be written by any worker that sees
# the folder.


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


# The folder of a store: made, swept of what a killed process left, and looked through for what
# is whole and fits.

_MAX_DIFFERENCES = 5
_ORIGIN = (
    "versions",
    "code",
)  # entries of a configuration that say which program made the numbers


def find_intact(path: Path, label: Label) -> dict[int, GroupRecord]:
    """Records of groups that can be read; a damaged group is announced and its record removed: it
    is computed again.
    """
    records = {}
    for group in find_groups(path):
        try:
            records[group] = read_record(path, group, label)
            check_shards(path, records[group], label)
        except InvalidInput as error:
            records.pop(group, None)
            first, last = (
                group * label.group,
                min((group + 1) * label.group, label.n_trials) - 1,
            )
            warnings.warn(
                f"trials {first} to {last} will be computed again: {error}", stacklevel=6
            )
            record_path(path, group).unlink()
    return records


def make_folder(path: Path) -> None:
    """Make a store's folder; refuse one that holds something else."""
    if path.exists() and not path.is_dir():
        raise StoreError(f"{path} is a file; a store is a folder. Choose another name.")
    if path.exists() and not (path / PROGRESS).is_dir():
        foreign = [entry.name for entry in _list_folder(path) if not _is_temporary(entry.name)]
        if foreign:
            raise StoreError(
                f"{path} exists and is no store (it holds {foreign[0]!r}). Choose an empty or new"
                " folder."
            )
    (path / PROGRESS).mkdir(parents=True, exist_ok=True)
    sync_folder(path)
    sync_folder(path.absolute().parent)


def sweep(path: Path) -> None:
    """Refuse links anywhere in the store, and remove what a killed process left half written."""
    for folder in (path, *(Path(entry.path) for entry in _list_folder(path) if entry.is_dir())):
        for entry in _list_folder(folder):
            if _is_temporary(entry.name) and entry.is_file():
                os.unlink(entry.path)


def _is_temporary(name: str) -> bool:
    return name.startswith(".") and name.endswith(TEMPORARY)


def check_configuration(path: Path, stored: Label, asked: Label) -> None:
    """Raise where a store was begun with another configuration, or by other code."""
    differences = find_differences(stored.configuration, asked.configuration)
    if stored.n_trials > asked.n_trials:
        differences.insert(0, f"number of trials: {stored.n_trials} → {asked.n_trials}")
    if differences and all(words.startswith(_ORIGIN) for words in differences):
        raise StoreError(
            f"the store {path} was made by other code (stored → now): {'; '.join(differences)}. Old"
            " and new trials might not fit together. Finish it with the code that began it, or use"
            " a new store; feeler.load reads it."
        )
    if differences:
        raise differ(path, differences)


def differ(path: Path, differences: list[str]) -> StoreError:
    """The error that names what differs."""
    return StoreError(
        f"the store {path} was made by another configuration (stored → asked):"
        f" {'; '.join(differences)}. Use a new store, or the stored configuration."
    )


def find_differences(stored: Any, asked: Any, name: str = "") -> list[str]:
    """Up to five places where two configurations differ, as ``name: stored → asked``."""
    if isinstance(stored, dict) and isinstance(asked, dict):
        pairs = [
            (_join(name, key), stored.get(key), asked.get(key))
            for key in sorted({*stored, *asked})
        ]
    elif isinstance(stored, list) and isinstance(asked, list) and len(stored) == len(asked):
        pairs = [
            (f"{name}[{n}]", a, b) for n, (a, b) in enumerate(zip(stored, asked, strict=True))
        ]
    else:
        return [] if stored == asked else [f"{name}: {_show(stored)} → {_show(asked)}"]
    found: list[str] = []
    for place, a, b in pairs:
        if len(found) < _MAX_DIFFERENCES and a != b:
            found += find_differences(a, b, place)
    return found[:_MAX_DIFFERENCES]


def _join(name: str, key: str) -> str:
    return f"{name}.{key}" if name else key


def _show(value: Any) -> str:
    text = "nothing" if value is None else json.dumps(value, ensure_ascii=False)
    return text if len(text) <= 60 else text[:57] + "…"


def _list_folder(folder: Path) -> list[os.DirEntry]:
    """Entries of a folder, by name; a symbolic link among them is refused, since it may lead
    anywhere.
    """
    try:
        entries = sorted(os.scandir(folder), key=lambda entry: entry.name)
    except OSError as error:
        raise InvalidInput(f"cannot read the folder {folder}: {error.strerror}.") from error
    for entry in entries:
        if entry.is_symlink():
            raise InvalidInput(
                f"{entry.path} is a symbolic link; inside a store they are refused. Copy the"
                " data in."
            )
    return entries


# The store: finished trials on disk as they come, safe against whatever ends the process.
#
# Trials are kept in groups: one shard for each variable and one record. A trial is finished
# when the record ``progress/000012.json`` of its group names it. The record is renamed into
# place only after the disk has the group's shards, and it holds their digests: killed at any
# moment, a store holds each finished trial whole, and every other one is computed again. For
# other readers a store is one consolidated Zarr v3 group.

_MAX_TRIALS = 100_000_000  # [C]
_SMALL, _GREAT = (
    8,
    256,
)  # [C] trials in a group: the lanes of the engine; a million touches in 4,000 shards
# [C] labels are copied for other readers whenever there are so many times more of them
_GROWTH = 1.25


def open_store(
    path: str | os.PathLike,
    configuration: dict[str, Any],
    n_trials: int,
    *,
    made: Sequence[Any] = (),
    group_size: int | None = None,
) -> "Store":
    """Open a store for writing: a new one, or one that the same configuration began.

    Parameters
    ----------
    path
        Folder, made if absent; by habit it ends in ``.zarr``.
    configuration
        Everything that the numbers of all trials depend on; numbers, texts, lists, dictionaries and
        arrays.
    n_trials
        How many trials the full set has; a store of fewer grows.
    made
        What else each trial depends on, one entry a trial; kept with it, and compared when the
        store is opened again.
    group_size
        Trials in one shard and record, 1 to 4096; default 8 in small sets to 256 in those of 10,240
        and more.

    Returns
    -------
    Store
        A context manager; ``finished`` holds the numbers of the trials that need not be computed
        again.

    Raises
    ------
    StoreError
        Another process writes it, another configuration made it (the message names what differs),
        the disk is full, or the folder holds something else.
    """
    for name, value, most in (
        ("n_trials", n_trials, _MAX_TRIALS),
        ("group_size", group_size, 4096),
    ):
        if value is not None and (
            isinstance(value, bool)
            or not isinstance(value, int | np.integer)
            or not 1 <= value <= most
        ):
            raise InvalidInput(
                f"{name} must be a whole number from 1 to {most:,}, got {value!r}."
            )
    if made and len(made) != n_trials:
        raise InvalidInput(
            f"made must hold one entry for each of the {n_trials} trials, got {len(made)}."
        )
    size = group_size or int(np.clip(2 ** int(np.log2(max(n_trials // 40, 1))), _SMALL, _GREAT))
    label = Label(
        n_trials=int(n_trials), group=int(size), configuration=make_plain(configuration)
    )
    return Store(Path(path), label, made)


class Store:
    """A store that is open for writing; use :func:`open_store`, and ``feeler.load`` to read one."""

    def __init__(self, path: Path, label: Label, made: Sequence[Any]) -> None:
        self.path, self.label, self._made = path, label, made
        self.finished: set[int] = set()
        self._copied = 0
        self._files: dict[str, bytes] = {}
        with explain(path):
            make_folder(path)
            self._lock = Lock(path / PROGRESS / "lock", f"the store {path}")
            try:
                self._begin()
            except BaseException:
                self._lock.release()
                raise

    def _begin(self) -> None:
        sweep(self.path)
        if (self.path / PROGRESS / LABEL).exists():
            stored = read_label(self.path)
            check_configuration(self.path, stored, self.label)
            self._records = find_intact(self.path, stored)
            self._check_made()
            grown = stored.replace(n_trials=self.label.n_trials)
            self.label = grown
            if grown != stored:
                self._write_label()
        else:
            self._records = {}
            self._write_label()
        self.finished = {trial for record in self._records.values() for trial in record.trials}
        if self.label.layout is not None:
            self._copy()

    def _write_label(self) -> None:
        write_atomic(self.path / PROGRESS / LABEL, seal(self.label, format=FORMAT))

    def _check_made(self) -> None:
        """Raise where a finished trial was made with other parameters than are asked for now."""
        for record in self._records.values() if self._made else ():
            for trial, made in zip(record.trials, record.made, strict=False):
                if made != (asked := make_plain(self._made[trial])):
                    raise differ(self.path, find_differences(made, asked, f"trial {trial}"))

    def holds(self, trial: int) -> bool:
        """Whether some trial of the group of this one is finished."""
        return trial // self.label.group in self._records

    def append(self, indices: int | Iterable[int], trials: xr.Dataset) -> None:
        """Store trials, a Dataset in the order of ``indices`` (from 0); when this returns they
        survive a power cut.

        Raises
        ------
        StoreError
            A trial is already stored or does not fit the others, or the disk is full (finished
            trials are safe).
        """
        wanted = [int(indices)] if np.ndim(indices) == 0 else [int(index) for index in indices]  # type: ignore[arg-type, union-attr]
        outside = [index for index in wanted if not 0 <= index < self.label.n_trials]
        if outside or trials.sizes.get("trial") != len(wanted) or len({*wanted}) < len(wanted):
            raise InvalidInput(
                "append takes one trial for each of its indices within 0 to"
                f" {self.label.n_trials - 1}, got the indices {str(wanted)[:60]} and the sizes"
                f" {dict(trials.sizes)}."
            )
        if stored := self.finished.intersection(wanted):
            raise StoreError(
                f"trial {min(stored)} is already stored in {self.path}; compute only those not in"
                " `finished`."
            )
        state = (
            f"trials {min(wanted)} to {max(wanted)} are not stored; the {len(self.finished)}"
            " finished ones are safe"
        )
        size = self.label.group
        if self.label.layout is not None:
            check_same(self.label.layout, make_layout(trials))
        with explain(self.path, state):
            for group in sorted({index // size for index in wanted}):
                rows = [row for row, index in enumerate(wanted) if index // size == group]
                indices, some = [wanted[row] for row in rows], trials.isel(trial=rows)
                made = [self._made[index] for index in indices] if self._made else []
                if group in self._records:
                    self._extend(self._records[group], indices, some, made)
                else:
                    self.admit(write_group(self.path, size, indices, some, made))

    def admit(self, group: StoredGroup) -> None:
        """Count a group's trials as finished; when this returns they survive a power cut.

        Raises
        ------
        StoreError
            They do not fit the others, or the disk is full (finished trials are safe).
        """
        with explain(self.path, f"the {len(self.finished)} finished trials are safe"):
            self._check_layout(group.layout)
            write_atomic(record_path(self.path, group.record.group), seal(group.record))
            self._enter(group.record)

    def _enter(self, record: GroupRecord) -> None:
        self._records[record.group] = record
        self.finished.update(record.trials)
        if len(self.finished) > _GROWTH * self._copied + _SMALL * self.label.group:
            self._copy()

    def _check_layout(self, layout: Layout) -> None:
        if self.label.layout is not None:
            check_same(self.label.layout, layout)
            return
        self.label = self.label.replace(layout=layout)
        sync_folder(self.path)
        self._write_label()
        self._copy()

    def _extend(
        self, old: GroupRecord, indices: list[int], trials: xr.Dataset, made: list[Any]
    ) -> None:
        """Add trials to a group that has some: until all is done each shard may be the old or the
        new one.
        """
        layout, size, group = self.label.layout, self.label.group, old.group
        assert layout is not None
        rows = [trial % size for trial in old.trials]
        shards = {}
        for name, item in layout.variables.items():
            kept = np.asarray(
                open_array(self.path, name, item, (group + 1) * size, size)[group * size :]
            )
            shards[name] = encode_rows(layout, name, size, indices, trials, (rows, kept[rows]))
        new = merge(old, make_group_record(layout, size, indices, trials, made, shards))
        both = {
            name: old.shards[name] + new.shards[name] for name in shards
        }  # the old trials are in both
        write_atomic(record_path(self.path, group), seal(old.replace(shards=both)))
        for name, raw in shards.items():
            write_atomic(find_shard(self.path, name, new, self.label), raw)
        write_atomic(record_path(self.path, group), seal(new))
        self._enter(new)

    def _copy(self) -> None:
        """Write what makes the store a Zarr group for other readers; it need not survive a power
        cut.
        """
        files: dict[str, Any] = {}
        layout, n = self.label.layout, self.label.n_trials
        assert layout is not None
        shared = layout.make_shared()
        for name, item in layout.variables.items():
            make_array(files, name, item, n, self.label.group)
        for key, variable in shared.variables.items():
            label_trials(
                files,
                str(key),
                variable.values,
                tuple(map(str, variable.dims)),
                dict(variable.attrs),
            )
        labels = self._collect_labels()
        for name, values in labels.items():
            label_trials(files, name, values, ("trial",), layout.attributes.get(name, {}))
        widths = {
            name: values.dtype.itemsize // 4
            for name, values in labels.items()
            if values.dtype.kind == "U"
        }
        attributes = {
            "feeler_store": {
                "format": FORMAT,
                "n_trials": n,
                "n_finished": len(self.finished),
                "widths": widths,
            },
            **shared.attrs,
        }
        attributes["coordinates"] = " ".join(sorted(layout.coordinates))
        for name, raw in make_group(files, attributes, PROGRESS).items():
            if self._files.get(name) != raw:
                (self.path / name).parent.mkdir(exist_ok=True)
                write_atomic(self.path / name, raw, durable=False)
                self._files[name] = raw
        self._copied = len(self.finished)

    def _collect_labels(self) -> dict[str, np.ndarray]:
        """Each label of all trials, and whether a trial is finished."""
        n = self.label.n_trials
        trials = [trial for record in self._records.values() for trial in record.trials]
        found = {"finished": np.zeros(n, bool)}
        found["finished"][trials] = True
        for name, kind in self.label.layout.labels.items():  # type: ignore[union-attr]
            values = to_array(
                [value for record in self._records.values() for value in record.labels[name]],
                kind,
            )
            blank = "" if kind == "str" else np.nan if values.dtype.kind == "f" else 0
            found[name] = np.full(
                n,
                blank,
                dtype=values.dtype
                if values.size
                else np.dtype("U1" if kind == "str" else kind),
            )
            found[name][trials] = values
        return found

    def read(self) -> xr.Dataset:
        """The finished trials in trial order, lazily."""
        if not self.finished:
            raise StoreError(f"the store {self.path} holds no finished trial yet.")
        return read_store(self.path)

    def close(self) -> None:
        """Copy the labels for other readers, and let go of the lock."""
        try:
            if len(self.finished) != self._copied:
                with explain(self.path, "labels are not written; the finished trials are safe"):
                    self._copy()
        finally:
            self._lock.release()

    def __enter__(self) -> "Store":
        return self

    def __exit__(self, kind: type | None, *_: object) -> None:
        try:
            self.close()
        except FeelerError:
            if kind is None:  # otherwise the error that is on its way says more
                raise


def save_store(
    dataset: xr.Dataset, path: str | os.PathLike, *, group_size: int | None = None
) -> None:
    """Write a Dataset as a store, group by group; the folder must be new or empty."""
    n_trials = dataset.sizes.get("trial", 0)
    if n_trials < 1:
        raise InvalidInput(
            f"a store holds trials; the Dataset has the sizes {dict(dataset.sizes)}."
        )
    configuration = {"configuration": dataset.attrs.get("configuration", "")}
    with open_store(path, configuration, n_trials, group_size=group_size) as store:
        if store.finished:
            raise InvalidInput(f"{path} already holds trials. Choose a new folder.")
        size = store.label.group
        for start in range(0, n_trials, size):
            part = dataset.isel(trial=slice(start, start + size))
            store.append(range(start, start + part.sizes["trial"]), part)
