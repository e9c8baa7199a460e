"""The store: finished trials on disk as they come, safe against whatever ends the process.

A trial is finished when its record ``progress/000012.json`` exists. The record is renamed into place only after the
disk has the trial's chunks, and it holds their checksums: killed at any moment, a store holds each finished trial
whole, and every other trial is computed again. The arrays are plain Zarr v3, one chunk per trial.
"""

import errno
import os
import shutil
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from feeler.errors import FeelerError, InvalidInput, StoreError
from feeler.provenance import compute_digest, make_plain
from feeler.tensors.configuration import find_differences
from feeler.tensors.disk import TEMPORARY, sync_folder, write_atomic, write_synced
from feeler.tensors.finished import FORMAT, find_damage, find_records, read_label
from feeler.tensors.layout import (
    PROGRESS,
    SCHEMA,
    Layout,
    assemble,
    check_same,
    make_layout,
    make_record,
    read_layout,
    read_record,
    record_path,
    write_schema,
)
from feeler.tensors.limits import Limits, find_limits, list_folder
from feeler.tensors.lock import Lock
from feeler.tensors.zarr3 import ArrayInfo, describe_array, encode_chunk, write_array_metadata, write_group_metadata

MAX_TRIALS = 1_000_000  # [C] one record each
ORIGIN = ("versions", "code")  # entries of a configuration that say which program made the numbers


def open_store(
    path: str | os.PathLike, configuration: dict[str, Any], n_trials: int, limits: Limits | None = None
) -> "Store":
    """Open a store for writing: a new one, or one that the same configuration began.

    Parameters
    ----------
    path
        Folder, made if absent; by habit it ends in ``.zarr``.
    configuration
        Everything that the numbers depend on; numbers, texts, lists, dictionaries and arrays.
    n_trials
        How many trials the full set has.

    Returns
    -------
    Store
        A context manager; ``finished`` holds the numbers of the trials that need not be computed again.

    Raises
    ------
    StoreError
        Another process writes it, another configuration made it (the message names what differs), the disk is full, or
        the folder holds something else.
    """
    if isinstance(n_trials, bool) or not isinstance(n_trials, int | np.integer) or not 1 <= n_trials <= MAX_TRIALS:
        raise InvalidInput(f"n_trials must be a whole number from 1 to {MAX_TRIALS:,}, got {n_trials!r}.")
    return Store(Path(path), configuration, int(n_trials), find_limits(limits))


class Store:
    """A store that is open for writing; use :func:`open_store`, and ``read_store`` to read one."""

    def __init__(self, path: Path, configuration: dict[str, Any], n_trials: int, limits: Limits) -> None:
        self.path, self.n_trials, self._limits = path, n_trials, limits
        self._configuration = make_plain(configuration)
        self._layout: Layout | None = None
        self.finished: set[int] = set()
        with explain(path):
            _make_folder(path)
            self._lock = Lock(path / PROGRESS / "lock")
            try:
                self._begin()
            except BaseException:
                self._lock.release()
                raise

    def _begin(self) -> None:
        _sweep(self.path)
        if (self.path / "zarr.json").exists():
            _check_configuration(self.path, self._configuration, self.n_trials, self._limits)
        else:
            write_atomic(self.path / "zarr.json", write_group_metadata({"feeler_store": self._label()}))
        self._layout = read_layout(self.path, self._limits)
        if self._layout is not None:
            self.finished = _find_intact(self.path, self._layout, self.n_trials)

    def _label(self) -> dict[str, Any]:
        digest = compute_digest(self._configuration)
        return {"format": FORMAT, "n_trials": self.n_trials, "digest": digest, "configuration": self._configuration}

    def append(self, index: int, trial: xr.Dataset) -> None:
        """Store trial ``index`` (from 0), a Dataset of one trial; when this returns, the trial survives a power cut.

        Raises
        ------
        StoreError
            The trial is already stored or does not fit the others, or the disk is full (finished trials are safe).
        """
        if not 0 <= index < self.n_trials:
            raise InvalidInput(f"this store holds trials 0 to {self.n_trials - 1}, got trial {index}.")
        if index in self.finished:
            raise StoreError(f"trial {index} is already stored in {self.path}; compute only those not in `finished`.")
        if trial.sizes.get("trial") != 1:
            raise InvalidInput(f"append takes a Dataset of one trial, got the sizes {dict(trial.sizes)}.")
        with explain(self.path, f"trial {index} is not stored; the {len(self.finished)} finished ones are safe"):
            if self._layout is None:
                self._layout = self._write_layout(trial)
            check_same(self._layout, trial, self.n_trials, f"trial {index}")
            self._write_trial(index, trial)
        self.finished.add(int(index))

    def _write_layout(self, trial: xr.Dataset) -> Layout:
        """Write all that the trials share; the schema last, since its presence says that the rest is there."""
        layout = make_layout(trial, self.n_trials)
        shared = sum(variable.nbytes for variable in layout.fixed.values())
        self._limits.check_bytes(sum(info.n_bytes for info in layout.chunked.values()) + shared, "this set of trials")
        files: dict[str, bytes] = {}
        for info in layout.chunked.values():
            files |= _write_array(self.path, info, None)
        for name, variable in layout.fixed.items():
            attributes = layout.attributes[name]
            info = describe_array(name, variable.values, variable.dims, attributes=attributes)
            files |= _write_array(self.path, info, variable.values)
        sync_folder(self.path)
        write_atomic(self.path / PROGRESS / SCHEMA, write_schema(layout, files))
        return layout

    def _write_trial(self, index: int, trial: xr.Dataset) -> None:
        chunks = {}
        for name, info in self._layout.chunked.items():
            chunks[name] = encode_chunk(trial.variables[name].values)
            write_synced(self.path / name / info.key((index, *(0 for _ in info.shape[1:]))), chunks[name])
        for name in chunks:
            sync_folder(self.path / name)
        write_atomic(record_path(self.path, index), make_record(self._layout, trial, index, chunks))

    def read(self) -> xr.Dataset:
        """The finished trials in trial order."""
        if not self.finished:
            raise StoreError(f"the store {self.path} holds no finished trial yet.")
        return assemble(self.path, self._layout, sorted(self.finished), self._limits)

    def close(self) -> None:
        """Add the trials' labels as arrays, for readers that know Zarr but not the records, and let go of the lock.

        The labels are only a copy of what the records hold, so they need not survive a power cut.
        """
        try:
            if self.finished:
                with explain(self.path, "labels are not written; the finished trials are safe"):
                    self._write_labels()
        finally:
            self._lock.release()

    def _write_labels(self) -> None:
        layout = self._layout
        records = {
            index: read_record(record_path(self.path, index), index, layout)["values"] for index in self.finished
        }
        for name, kind in layout.recorded.items():
            empty = "" if kind == "str" else np.nan if np.dtype(kind).kind == "f" else 0
            values = [records[n][name] if n in records else empty for n in range(self.n_trials)]
            array = np.array(values, dtype=object if kind == "str" else kind)
            info = describe_array(name, array, ("trial",), attributes=layout.attributes[name])
            (self.path / name).mkdir(exist_ok=True)
            write_atomic(self.path / name / info.key((0,)), encode_chunk(array), durable=False)
            write_atomic(self.path / name / "zarr.json", write_array_metadata(info), durable=False)
        attributes = {**layout.attributes[""], "coordinates": " ".join(sorted(layout.coordinates))}
        attributes |= {"n_finished": len(self.finished), "feeler_store": self._label()}
        write_atomic(self.path / "zarr.json", write_group_metadata(attributes))

    def __enter__(self) -> "Store":
        return self

    def __exit__(self, kind: type | None, *_: object) -> None:
        try:
            self.close()
        except FeelerError:
            if kind is None:  # otherwise the error that is on its way says more
                raise


def _find_intact(path: Path, layout: Layout, n_trials: int) -> set[int]:
    """Finished trials that can be read; a damaged one is announced and its record removed, so it is computed again."""
    damage = find_damage(path, layout, n_trials)
    for index, reason in damage.items():
        warnings.warn(f"trial {index} will be computed again: {reason}", stacklevel=5)
        record_path(path, index).unlink()
    return set(find_records(path))


def _make_folder(path: Path) -> None:
    if path.exists() and not path.is_dir():
        raise StoreError(f"{path} is a file; a store is a folder. Choose another name.")
    if path.exists() and not (path / "zarr.json").exists():
        foreign = [
            entry.name for entry in list_folder(path) if entry.name != PROGRESS and not _is_temporary(entry.name)
        ]
        if foreign:
            raise StoreError(f"{path} exists and is no store (it holds {foreign[0]!r}). Choose an empty or new folder.")
    (path / PROGRESS).mkdir(parents=True, exist_ok=True)
    if not (path / PROGRESS / "zarr.json").exists():
        write_atomic(path / PROGRESS / "zarr.json", write_group_metadata({}))
    sync_folder(path)
    sync_folder(path.absolute().parent)


def _sweep(path: Path) -> None:
    """Refuse links anywhere in the store, and remove what a killed process left half written."""
    for folder in (path, *(Path(entry.path) for entry in list_folder(path) if entry.is_dir())):
        for entry in list_folder(folder):
            if _is_temporary(entry.name) and entry.is_file():
                os.unlink(entry.path)


def _is_temporary(name: str) -> bool:
    return name.startswith(".") and name.endswith(TEMPORARY)


def _check_configuration(path: Path, configuration: dict[str, Any], n_trials: int, limits: Limits) -> None:
    label = read_label(path, limits)
    differences = find_differences(label.get("configuration"), configuration)
    if label["n_trials"] != n_trials:
        differences.insert(0, f"number of trials: {label['n_trials']} → {n_trials}")
    if differences and all(words.startswith(ORIGIN) for words in differences):
        raise StoreError(
            f"the store {path} was made by other code (stored → now): {'; '.join(differences)}. Old and new trials "
            "might not fit together. Finish it with the code that began it, or use a new store; feeler.load reads it."
        )
    if differences or label.get("digest") != compute_digest(configuration):
        raise StoreError(
            f"the store {path} was made by another configuration (stored → asked): "
            f"{'; '.join(differences) or 'its digest differs'}. Use a new store, or the stored configuration."
        )


def _write_array(path: Path, info: ArrayInfo, values: np.ndarray | None) -> dict[str, bytes]:
    """An array's folder, before the schema makes it count: its metadata, and its one chunk if values are given.

    Returns what the files now hold.
    """
    (path / info.name).mkdir(exist_ok=True)
    files = {f"{info.name}/zarr.json": write_array_metadata(info)}
    if values is not None and values.size:
        files[f"{info.name}/{info.key((0,) * len(info.shape))}"] = encode_chunk(values)
    for name, raw in files.items():
        write_synced(path / name, raw)
    sync_folder(path / info.name)
    return files


@contextmanager
def explain(path: Path, state: str = "nothing is lost") -> Iterator[None]:
    """Turn the system's errors into a StoreError that says what is safe and what to do."""
    try:
        yield
    except FeelerError:
        raise
    except OSError as error:
        if error.errno in (errno.ENOSPC, errno.EDQUOT, errno.EFBIG):
            room = shutil.disk_usage(path if path.exists() else path.absolute().parent).free
            raise StoreError(
                f"no room left for the store {path} ({room / 2**20:.1f} MiB free): {state}. "
                "Free some space and run the same command again; it goes on where it stopped."
            ) from error
        raise StoreError(f"cannot write the store {path}: {error.strerror or error}; {state}.") from error
