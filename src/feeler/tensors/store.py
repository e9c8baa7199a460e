"""The store: finished trials on disk as they come, safe against whatever ends the process.

A store is one Zarr v3 group with an array (trial, …) for each variable of the whole set, and
``finished`` (trial,), whose flags are written once the numbers have reached the disk: killed at any
moment, a store holds each finished trial whole, and every other one is computed again. Trials are
computed and written in groups, each of which is one shard of every array, so that workers that see
the folder write side by side. Labels of the trials are written by the process that opened it.
"""

import asyncio
import json
import math
import os
import secrets
import shutil
import threading
import warnings
from collections.abc import Callable, Iterator, Sequence
from contextlib import AbstractContextManager, contextmanager
from glob import escape
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import xarray as xr
from annotated_types import Ge, Le
from xarray.backends import BackendArray
from xarray.core import indexing

from feeler.errors import DetailedWarning, InvalidInput, StoreError, require_extra

require_extra("zarr", "store", "a store of touches")
import zarr  # noqa: E402
from zarr.codecs import Crc32cCodec, ZstdCodec  # noqa: E402
from zarr.core.buffer import Buffer  # noqa: E402
from zarr.storage import LocalStore, MemoryStore  # noqa: E402

from feeler.files import (  # noqa: E402
    FULL,
    TEMPORARY,
    TEMPORARY_DAYS,
    Lock,
    explain,
    sweep_old,
    write_atomic,
)
from feeler.provenance import to_jsonable, write_canonical  # noqa: E402
from feeler.tensors.formats import is_old_store, is_store  # noqa: E402
from feeler.tensors.schema import MAX_LISTED, QUANTITIES, derive_curvature  # noqa: E402
from feeler.tensors.writers import check_variable  # noqa: E402
from feeler.validation import checked  # noqa: E402

FORMAT = 4
_ABOUT = "feeler_store"  # attribute of the group: format, group size, configuration
_FLAGS = "finished"
_PARAMETERS = "parameters"  # what each trial was made with, as JSON
_OWN = {_FLAGS, _PARAMETERS}
_MAX_TRIALS = 100_000_000  # [C]
# [C] trials in a group: the lanes of the engine; a million touches in 4,000 shards
_SMALL, _GREAT = 8, 256
# [C] trials that are read together: 0.7 MB of 56 sensors and 100 samples; 8 take twice the time
INNER = 32
_LABELS = 4096  # [C] trials in one chunk of a label
_LEVEL = 1  # [C] of zstd: higher ones take 3 times the time for 1 % less
GLANCE = 512  # trials that `feeler info` looks at
_EAGER = 65_536  # [C] trials, above which labels are read when they are used
_MAX_DIFFERENCES = 5


class _Folder(LocalStore):
    """A folder of Zarr files, each whole or absent, and on the disk when it has been written.

    Opened for reading, a link, which may lead anywhere, is refused, and so is a missing chunk,
    which Zarr would read as NaN; only of flags those may be missing that were never set.
    """

    n_bytes = 0  # that were written

    async def get(self, key: str, *args: Any, **options: Any) -> Buffer | None:
        link = (self.root / key).is_symlink()
        found = None if link else await super().get(key, *args, **options)
        owner, _, name = key.rpartition("/")  # whatever a damaged description calls chunks
        chunk = name != "zarr.json" and not name.startswith(".") and owner != _FLAGS
        if link or (found is None and chunk and self.read_only):
            raise FileNotFoundError(f"{self.root / key} is a link, or missing")
        return found

    async def set(self, key: str, value: Buffer) -> None:
        path = self.root / key
        path.parent.mkdir(parents=True, exist_ok=True)
        await asyncio.to_thread(write_atomic, path, value.to_bytes())
        self.n_bytes += len(value)


_opening = threading.Lock()


def _open(folder: _Folder) -> tuple[dict[str, Any], dict[str, Any]]:
    """A store's attributes and its arrays: a file for each chunk, so that what lacks one is
    damaged.
    """
    # zarr's configuration is one for all threads: what one restores must not reach into another's
    with _opening, zarr.config.set({"array.write_empty_chunks": True}):
        root: Any = zarr.open_group(folder, mode="r" if folder.read_only else "r+")
        arrays = dict(root.arrays())
    attributes = dict(root.attrs)
    if attributes[_ABOUT]["format"] != FORMAT and not is_old_store(Path(folder.root)):
        raise InvalidInput(
            f"{folder.root} is a store of another format; this feeler reads {FORMAT}. Update"
            " feeler."
        )
    return attributes, arrays


def _is_of_trials(array: Any) -> bool:
    return (array.metadata.dimension_names or ("",))[:1] == ("trial",)


def _write(array: Any, indices: Sequence[int], values: np.ndarray) -> None:
    """Write rows in rising order, run by run: Zarr cannot write scattered rows of a shard."""
    ends = np.flatnonzero(np.diff(indices) != 1) + 1
    for run in np.split(np.arange(len(indices)), ends):
        array[indices[run[0]] : indices[run[-1]] + 1] = values[run]


def write_group(path: Path, indices: Sequence[int], trials: xr.Dataset) -> int:
    """Write the numbers of trials into a store, without counting them as finished; any worker may
    do so that sees the folder, if no other writes trials of the same group.

    Returns
    -------
    int
        Bytes that were written.

    Raises
    ------
    StoreError
        The disk is full, or this machine does not see the store.
    """
    if not is_store(path):
        raise StoreError(
            f"this worker sees no store at {path}. The folder must be shared by all workers, under"
            " one name."
        )
    state = (
        f"trials {min(indices)} to {max(indices)} are not stored; the finished ones are safe"
    )
    folder = _Folder(path)
    with explain(path, state):
        for name, array in _open(folder)[1].items():
            if array.ndim > 1 and _is_of_trials(array):
                _write(array, indices, trials[name].values)
    return folder.n_bytes


@checked
def open_store(
    path: str | os.PathLike,
    configuration: dict[str, Any],
    n_trials: Annotated[int, Ge(1), Le(_MAX_TRIALS)],
    *,
    made: Callable[[int], Any] | None = None,
    group_size: Annotated[int, Ge(1), Le(4096)] | None = None,
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
        ``made(k)`` is what else trial k depends on; kept with it, and compared when the store is
        opened again.
    group_size
        Trials in one shard, 1 to 4096; default 8 in small sets to 256 in those of 10,240 and more.

    Returns
    -------
    Store
        A context manager; ``finished`` (trial,) says which trials need not be computed again.

    Raises
    ------
    StoreError
        Another process writes it, another configuration made it (the message names what differs),
        the disk is full, or the folder holds something else.
    """
    size = group_size or int(np.clip(2 ** int(np.log2(max(n_trials // 40, 1))), _SMALL, _GREAT))
    return Store(Path(path), to_jsonable(configuration), int(n_trials), made, int(size))


class Store(AbstractContextManager):
    """A store that is open for writing; use :func:`open_store`, and ``feeler.load`` to read one.

    Attributes
    ----------
    finished : np.ndarray
        (trial,), whether each trial is on the disk.
    group_size : int
        Trials in one group.
    """

    def __init__(
        self,
        path: Path,
        configuration: dict[str, Any],
        n_trials: int,
        made: Callable[[int], Any] | None,
        group_size: int,
    ) -> None:
        self.path, self.group_size, self._made = path, group_size, made
        self.finished = np.zeros(n_trials, bool)
        self._configuration = configuration
        self._arrays: dict[str, Any] = {}
        with explain(path):
            _make_folder(path)
            self._lock = Lock(path / _FLAGS / "lock", f"the store {path}")
            try:
                for part in path.rglob(f".*{TEMPORARY}"):  # of a process that was killed
                    part.unlink(missing_ok=True)
                if (path / "zarr.json").exists():
                    with _reading(path):
                        self._resume()
            except BaseException:
                self._lock.release()
                raise

    def _resume(self) -> None:
        finished, damage = _survey(self.path)
        attributes, arrays = _open(_Folder(self.path))
        about, n_stored, n_trials = attributes[_ABOUT], len(finished), len(self.finished)
        stored = {"number of trials": n_stored} | about["configuration"]
        asked = {"number of trials": min(n_stored, n_trials)} | self._configuration
        self._compare(stored, asked)
        self.group_size, self.finished[:n_stored] = about["group"], finished
        text = "trials of the store will be computed again, as files are missing or damaged."
        for first, last, file, _ in damage:
            named = f"These are trials {first} to {last}, in {file}."
            warnings.warn(DetailedWarning(text, named), stacklevel=6)
            file.unlink(missing_ok=True)  # of a damaged chunk no part can be written
        if damage:
            arrays[_FLAGS][:] = finished
        if _PARAMETERS in arrays and self._made:
            rows = np.flatnonzero(finished).tolist()
            for trial, known in zip(rows, arrays[_PARAMETERS].oindex[rows], strict=True):
                made = write_canonical(self._made(trial))
                if str(known) != made:
                    old, new = json.loads(str(known)), json.loads(made)
                    self._compare({f"trial {trial}": old}, {f"trial {trial}": new})
        if n_stored < n_trials:
            self._grow()

    def _grow(self) -> None:
        """Make room for more trials; killed before its end, it is done again."""
        group = json.loads((self.path / "zarr.json").read_bytes())
        for name, one in group["consolidated_metadata"]["metadata"].items():
            if one["dimension_names"][:1] == ["trial"]:
                one["shape"][0] = len(self.finished)
            write_atomic(self.path / name / "zarr.json", json.dumps(one).encode())
        write_atomic(self.path / "zarr.json", json.dumps(group).encode())

    def _compare(self, stored: dict[str, Any], asked: dict[str, Any]) -> None:
        """Raise where they differ, with up to five of the places."""
        if places := [*_list_differences(stored, asked)]:
            raise StoreError(
                f"the store {self.path} was made by another configuration (stored → asked):"
                f" {'; '.join(places[:_MAX_DIFFERENCES])}. Use a new store, or the stored"
                " configuration."
            )

    def create(self, like: xr.Dataset) -> None:
        """Make the arrays for trials like these, which workers can then write; nothing where there
        are some.
        """
        if is_store(self.path):
            return
        files: dict[str, Any] = {}
        memory = MemoryStore(store_dict=files)
        made_by = {"group": self.group_size, "configuration": self._configuration}
        coordinates = " ".join(sorted(map(str, like.coords)))
        attributes = {_ABOUT: {"format": FORMAT} | made_by, "coordinates": coordinates}
        zarr.create_group(memory, attributes=attributes | to_jsonable(dict(like.attrs)))
        own = {_FLAGS: xr.Variable("trial", np.zeros(0, bool))}
        own |= {_PARAMETERS: xr.Variable("trial", np.zeros(0, "U1"))} if self._made else {}
        for name, item in (dict(like.variables) | own).items():
            _create_array(memory, name, item, len(self.finished), self.group_size)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # consolidated metadata are not in the standard yet
            zarr.consolidate_metadata(memory, zarr_format=3)
        with explain(self.path):
            # the group's own file comes last: with it the folder is a store
            for name in sorted(files, key="zarr.json".__eq__):
                (self.path / name).parent.mkdir(exist_ok=True)
                write_atomic(self.path / name, files[name].to_bytes())

    def append(self, indices: Sequence[int], trials: xr.Dataset) -> None:
        """Store trials, a Dataset in the rising order of ``indices`` (from 0); when this returns
        they survive a power cut.
        """
        self.create(trials)
        write_group(self.path, indices, trials)
        self.admit(indices, trials)

    def admit(self, indices: Sequence[int], trials: xr.Dataset) -> None:
        """Write the labels of trials whose numbers are there, and count them as finished; when this
        returns they survive a power cut.

        Raises
        ------
        StoreError
            The disk is full (finished trials are safe).
        """
        state = (
            f"trials {min(indices)} to {max(indices)} are not stored; the"
            f" {self.finished.sum()} finished ones are safe"
        )
        with explain(self.path, state):
            arrays = self._arrays = self._arrays or _open(_Folder(self.path))[1]
            for name, item in trials.variables.items():
                if item.dims == ("trial",):
                    _write(arrays[str(name)], indices, item.values)
            if self._made:
                texts = [write_canonical(self._made(index)) for index in indices]
                _write(arrays[_PARAMETERS], indices, np.array(texts))
            _write(arrays[_FLAGS], indices, np.ones(len(indices), bool))
        self.finished[[*indices]] = True

    def close(self) -> None:
        """Let go of the lock."""
        self._lock.release()

    def __exit__(self, *_: object) -> None:
        self.close()


def _make_folder(path: Path) -> None:
    """Make a store's folder; refuse what holds something else."""
    if is_old_store(path):
        raise StoreError(
            f"{path} is a store of feeler 0.3, which is read but not continued. Use a new store, or"
            f" keep its touches by: feeler convert {path} new.zarr"
        )
    ours = is_store(path) or (path / _FLAGS / "lock").exists()
    if path.exists() and not ours and (path.is_file() or os.listdir(path)):
        raise StoreError(f"{path} exists and is no store. Choose an empty or new folder.")
    (path / _FLAGS).mkdir(parents=True, exist_ok=True)


def _create_array(
    store: MemoryStore, name: Any, item: xr.Variable, n_trials: int, group_size: int
) -> None:
    """An array for a variable of all trials, or for one that they share, with its values."""
    check_variable(name, item)
    text = item.dtype.kind in "UOT"
    of_trials = item.dims[:1] == ("trial",)
    rows, one_file = item.shape[:1], None  # of a chunk, of a shard
    if of_trials:
        rows = (math.gcd(INNER, group_size) if item.ndim > 1 else _LABELS,)
    if of_trials and item.ndim > 1:
        one_file = (group_size, *item.shape[1:])
    array = zarr.create_array(
        store,
        name=name,
        shape=(n_trials, *item.shape[1:]) if of_trials else item.shape,
        dtype=str if text else item.dtype,
        chunks=tuple(max(n, 1) for n in (*rows, *item.shape[1:])),
        shards=one_file and tuple(max(n, 1) for n in one_file),
        filters=None,
        compressors=[ZstdCodec(level=_LEVEL), Crc32cCodec()],
        fill_value="" if text else np.nan if item.dtype.kind == "f" else 0,
        dimension_names=tuple(map(str, item.dims)),
        chunk_key_encoding={"name": "default", "separator": "."},
        attributes=to_jsonable(dict(item.attrs)),
    )
    if not of_trials:
        array[...] = item.values


def _list_differences(old: Any, new: Any, place: str = "") -> Iterator[str]:
    """Where plain data differ, and what stands there."""
    if isinstance(old, dict) and isinstance(new, dict):
        for key in old | new:
            yield from _list_differences(
                old.get(key), new.get(key), f"{place}.{key}".lstrip(".")
            )
    elif isinstance(old, list) and isinstance(new, list) and len(old) == len(new):
        for k, pair in enumerate(zip(old, new, strict=True)):
            yield from _list_differences(*pair, f"{place}[{k}]")
    elif old != new:
        yield f"{place}: {_show(old)} → {_show(new)}"


def _show(value: Any) -> str:
    text = "nothing" if value is None else json.dumps(value, ensure_ascii=False)
    return text if len(text) <= 60 else text[:57] + "…"


def _save_store(
    dataset: xr.Dataset, path: str | os.PathLike, *, group_size: int | None = None
) -> None:
    """Write a Dataset as a store, group by group; the folder must be new or empty."""
    path, n_trials = Path(path), dataset.sizes.get("trial", 0)
    if n_trials < 1:
        raise InvalidInput(
            f"a store holds trials; the Dataset has the sizes {dict(dataset.sizes)}."
        )
    configuration = {"configuration": dataset.attrs.get("configuration", "")}
    for name, item in dataset.variables.items():
        listed = item.dtype.kind in "UOT" and item.ndim > 1 and "trial" in item.dims
        if name in _OWN or listed or "trial" in item.dims[1:]:
            raise InvalidInput(
                f"a store cannot hold {name!r} {item.dims}: of a trial it keeps numbers with"
                f" trial as first dim, and labels called other than {', '.join(sorted(_OWN))}."
            )
    if os.path.lexists(path) and not (path.is_dir() and not os.listdir(path)):
        raise InvalidInput(f"{path} already holds something. Choose a new folder.")
    # under another name until it is whole: a part would look like a set of fewer trials
    part = path.with_name(f".{path.name}.{secrets.token_hex(4)}")
    sweep_old(path.parent, f".{escape(path.name)}.*", days=TEMPORARY_DAYS)  # of killed ones
    try:
        with open_store(part, configuration, n_trials, group_size=group_size) as store:
            for start in range(0, n_trials, store.group_size):
                some = dataset.isel(trial=slice(start, start + store.group_size))
                store.append(range(start, start + some.sizes["trial"]), some)
        part.replace(path)
    except OSError as error:
        cause: Any = error.__cause__ or error
        reason = cause.strerror or error
        raise StoreError(
            f"cannot write {path}: {reason}. Nothing of it is kept; name a folder that you may"
            " write to, with enough room."
        ) from error
    finally:
        shutil.rmtree(part, ignore_errors=True)


# Reading: stored trials as a Dataset that reads its numbers when they are used.


@contextmanager
def _reading(path: Path, what: str = "it") -> Iterator[None]:
    """Turn what libraries say of a damaged store into InvalidInput."""
    try:
        yield
    except (InvalidInput, StoreError):
        raise
    except Exception as error:
        if getattr(error, "errno", None) in FULL:
            raise
        raise InvalidInput(
            f"{path}: {what} is damaged ({str(error)[:150]}). feeler validate names the trials,"
            " and the command that made the store computes them again."
        ) from error


class _Numbers(BackendArray):
    """Numbers of trials that are read when they are used; curvature is angle over ``length``."""

    def __init__(self, path: Path, array: Any, length: np.ndarray | None = None) -> None:
        self.path, self.array, self.length, self.shape = path, array, length, array.shape
        self.dtype = np.dtype(object) if array.dtype.kind == "T" else array.dtype

    def __getitem__(self, key: Any) -> Any:
        outer = indexing.IndexingSupport.OUTER
        return indexing.explicit_indexing_adapter(key, self.shape, outer, self._read)

    def _read(self, key: tuple) -> np.ndarray:
        with _reading(self.path, self.array.basename):
            values = np.asarray(self.array.oindex[key])
        if self.length is None:
            return values.astype(self.dtype, copy=False)
        length = self.length[key[-2]]  # (…, sensor, time)
        length = length if isinstance(key[-1], int | np.integer) else length[..., None]
        return derive_curvature(values, length).astype(self.dtype)


def read_store(path: str | os.PathLike) -> xr.Dataset:
    """The finished trials of a store, in trial order, lazily and without locking it.

    Numbers are read when they are used, and so are the labels of more than 65,536 trials. Curvature
    is derived from angle where it is not stored.

    Raises
    ------
    InvalidInput
        No store, no finished trial, or damaged.
    """
    path = Path(path)
    empty = f"the store {path} holds no finished trial yet. Let the simulation go on."
    if not is_store(path):
        begun = (path / _FLAGS / "lock").exists()
        raise InvalidInput(empty if begun else f"{path} is no store of feeler.")
    with _reading(path):
        attributes, arrays = _open(_Folder(path, read_only=True))
        finished, listed = arrays.pop(_FLAGS), arrays.pop(_PARAMETERS, None)
        old = _read_records(path) if is_old_store(path) else None
        rows, labels, made = old or (np.flatnonzero(finished[:]), {}, [])
        if not rows.size:
            raise InvalidInput(empty)
        some: Any = slice(rows[0], rows[-1] + 1) if np.all(np.diff(rows) == 1) else rows
        found: dict[str, xr.Variable] = {}
        for name, array in arrays.items():
            of_trials, text = _is_of_trials(array), array.dtype.kind in "UOT"
            lazy = of_trials and (array.ndim > 1 or rows.size > _EAGER)
            if name in labels or lazy:
                values: Any = labels.get(
                    name, indexing.LazilyIndexedArray(_Numbers(path, array))
                )
            else:
                values = np.asarray(array.oindex[some] if of_trials else array[...])
                values = np.array(values.tolist(), str) if text else values
            kept = {"chunks": array.chunks, "shards": array.shards}
            kept |= {"dtype": np.dtypes.StringDType()} if text else {}  # of Zarr v3
            item = xr.Variable(array.metadata.dimension_names, values, dict(array.attrs), kept)
            found[name] = item.isel(trial=some) if lazy and name not in labels else item
        if "angle" in found and "curvature" not in found and "segment_length" in found:
            quantity, length = QUANTITIES["curvature"], found["segment_length"].values
            attrs = {"units": quantity.unit, "long_name": quantity.meaning}
            values = indexing.LazilyIndexedArray(_Numbers(path, arrays["angle"], length))
            item = xr.Variable(found["angle"].dims, values, attrs)
            found["curvature"] = item.isel(trial=some)
        del attributes[_ABOUT]
        coordinates = attributes.pop("coordinates").split()
        if listed is not None and rows.size <= MAX_LISTED:
            made = [json.loads(str(text)) for text in listed.oindex[rows]]
        if made and rows.size <= MAX_LISTED:
            attributes["trials"] = json.dumps(made, sort_keys=True)
        return xr.Dataset(found, attrs=attributes).set_coords(coordinates)


def _describe_store(path: Path) -> list[str]:
    """How much of a store is finished, without reading its numbers."""
    with _reading(path):
        finished = _open(_Folder(path, read_only=True))[1][_FLAGS][:]
    shown = f"; below: the first {GLANCE}" if finished.sum() > GLANCE else ""
    return [f"{finished.sum()} of {len(finished)} trials finished{shown}"]


def _find_damage(path: Path) -> list[str]:
    """What is wrong with the files of a store, one line for each."""
    if is_old_store(path):
        return []
    with _reading(path):
        return [words for *_, words in _survey(path)[1]]


def _survey(path: Path) -> tuple[np.ndarray, list[tuple[int, int, Path, str]]]:
    """Which trials are finished and undamaged; first and last trial, file, and what to say, of each
    file that cannot be read.
    """
    arrays = {
        k: a for k, a in _open(_Folder(path, read_only=True))[1].items() if _is_of_trials(a)
    }
    finished, damage = np.zeros(arrays[_FLAGS].shape, bool), []
    for name, array in sorted(arrays.items(), key=lambda pair: pair[0] != _FLAGS):
        size = (array.shards or array.chunks)[0]
        for start in range(0, len(finished), size):
            part = finished[start : start + size]
            try:
                if name == _FLAGS:
                    part[:] = array[start : start + size]
                elif part.any():
                    array[start : start + size]
            except Exception as error:  # whatever zarr says of a damaged chunk
                file = path / name / f"c.{start // size}{'.0' * (array.ndim - 1)}"
                last = start + len(part) - 1
                words = (
                    f"{file} (trials {start} to {last}) is missing or damaged ({str(error)[:100]})."
                    " The command that made the store computes them again."
                )
                damage.append((start, last, file, words))
                part[:] = False
    return finished, damage


# Stores of feeler 0.3, for one release: the records in their folder ``progress`` say which trials
# are finished, and hold their labels.


def _read_records(path: Path) -> tuple[np.ndarray, dict[str, np.ndarray], list[Any]]:
    """Numbers, labels and parameters of the finished trials of a store of feeler 0.3."""
    files = sorted((path / "progress").glob("[0-9]*.json"))
    records = [json.loads(file.read_text(encoding="utf-8")) for file in files]
    kinds = json.loads((path / "progress" / "store.json").read_text())["layout"]["labels"]
    labels = {
        name: np.array([value for one in records for value in one["labels"][name]], kind)
        for name, kind in kinds.items()
    }
    rows = np.array([trial for record in records for trial in record["trials"]], int)
    return rows, labels, [one for record in records for one in record["made"]]
