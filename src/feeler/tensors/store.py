"""The store: finished trials on disk as they come, safe against whatever ends the process.

A store is one Zarr v3 group with an array (trial, …) for each variable of the whole set, and
``finished`` (trial,), whose flags are written once the numbers have reached the disk: killed at any
moment, a store holds each finished trial whole, and every other one is computed again. Trials are
computed and written in groups, each of which is one shard of every array, so that workers that see
the folder write side by side. Labels of the trials are written by the process that opened it.
"""

import asyncio
import json
import os
import threading
import warnings
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import AbstractContextManager, contextmanager
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

from feeler.files import FULL, TEMPORARY, Lock, explain, parse_json, read_bytes, write_atomic  # noqa: E402
from feeler.provenance import to_jsonable, write_plain  # noqa: E402
from feeler.sandbox import MAX_TEXT  # noqa: E402
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
_UNSTABLE = ("versions", "created", "date", "history")  # attributes that may differ in a set


class _DurableFolder(LocalStore):
    """A folder of Zarr files, each whole or absent, and on the disk when it has been written."""

    async def set(self, key: str, value: Buffer) -> None:
        path = self.root / key
        path.parent.mkdir(parents=True, exist_ok=True)
        await asyncio.to_thread(write_atomic, path, value.to_bytes())


def write_group(path: Path, indices: Sequence[int], trials: xr.Dataset) -> int:
    """Write the numbers of trials into a store, without counting them as finished; any worker may
    do so that sees the folder, if no other writes trials of the same group.

    Returns
    -------
    int
        Bytes that the shards of the group take.

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
    files = set()
    with explain(path, state):
        arrays = _open_arrays(path)
        for name, item in trials.variables.items():
            if item.dims[:1] == ("trial",) and item.ndim > 1:
                array = arrays[str(name)]
                _write(array, indices, item.values)
                files |= {*_find_chunks(path, array, indices)}
    return sum(file.stat().st_size for file in files)


_opening = threading.Lock()


def _open_arrays(path: Path, consolidated: bool = True) -> dict[str, Any]:
    """The arrays of trials, to be written: a file for each chunk, so that what lacks one is
    damaged.
    """
    # zarr's configuration is one for all threads: what one restores must not reach into another's
    with _opening, zarr.config.set({"array.write_empty_chunks": True}):
        root = zarr.open_group(_DurableFolder(path), mode="r+", use_consolidated=consolidated)
        return {name: array for name, array in root.arrays() if _is_of_trials(array)}


def _write(array: Any, indices: Sequence[int], values: np.ndarray) -> None:
    """Write rows in rising order, run by run: Zarr cannot write scattered rows of a shard."""
    ends = np.flatnonzero(np.diff(indices) != 1) + 1
    for run in np.split(np.arange(len(indices)), ends):
        array[indices[run[0]] : indices[run[-1]] + 1] = values[run]


def _find_chunks(path: Path, array: Any, rows: Any) -> list[Path]:
    """The files that hold some trials of an array."""
    size, rest = (array.shards or array.chunks)[0], ".0" * (array.ndim - 1)
    folder = path / array.basename
    return [folder / f"c.{number}{rest}" for number in np.unique(np.asarray(rows) // size)]


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
        self._like: xr.Dataset | None = None
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
        about, n_trials = _read_about(self.path), len(self.finished)
        differences = _find_differences(about["configuration"], self._configuration)
        arrays = _open_arrays(self.path, consolidated=False)
        n_stored = arrays[_FLAGS].shape[0]
        if n_stored > n_trials:
            differences.insert(0, f"number of trials: {n_stored} → {n_trials}")
        self._refuse(differences)
        self.group_size = about["group"]
        damage = list(_find_damaged_chunks(self.path, arrays))
        for first, last, file, _ in damage:
            text = (
                "trials of the store will be computed again, as files are missing or damaged."
            )
            named = f"These are trials {first} to {last}, in {file}."
            warnings.warn(DetailedWarning(text, named), stacklevel=6)
            file.unlink(missing_ok=True)  # of a damaged chunk no part can be written
        self.finished[:n_stored] = arrays[_FLAGS][:]
        for first, last, *_ in damage:
            self.finished[first : last + 1] = False
            arrays[_FLAGS][first : last + 1] = False
        if _PARAMETERS in arrays and self._made:
            self._check_made(arrays[_PARAMETERS], self._made)
        if any(array.shape[0] != n_trials for array in arrays.values()):
            for array in arrays.values():
                array.resize((n_trials, *array.shape[1:]))
            _consolidate(_DurableFolder(self.path))
        self._like = (
            _open(self.path).drop_vars(_OWN, errors="ignore").isel(trial=slice(0)).load()
        )

    def _refuse(self, differences: list[str]) -> None:
        if differences:
            raise StoreError(
                f"the store {self.path} was made by another configuration (stored → asked):"
                f" {'; '.join(differences)}. Use a new store, or the stored configuration."
            )

    def _check_made(self, parameters: Any, made: Callable[[int], Any]) -> None:
        """Raise where a finished trial was made with other parameters than are asked for now."""
        for start in range(0, parameters.shape[0], _LABELS):
            stored = parameters[start : start + _LABELS]
            done = np.flatnonzero(self.finished[start : start + _LABELS]).tolist()
            for row in done:
                asked = write_plain(to_jsonable(made(start + row)))
                if (text := str(stored[row])) not in ("", asked):
                    old, new = json.loads(text), json.loads(asked)
                    self._refuse(_find_differences(old, new, f"trial {start + row}"))

    def create(self, like: xr.Dataset) -> None:
        """Make the arrays for trials like these, which workers can then write; nothing where there
        are some.
        """
        if self._like is None:
            with explain(self.path):
                self._write_arrays(like)
            self._like = like.isel(trial=slice(0))

    def _write_arrays(self, like: xr.Dataset) -> None:
        files: dict[str, Any] = {}
        memory = MemoryStore(store_dict=files)
        about = {
            "format": FORMAT,
            "group": self.group_size,
            "configuration": self._configuration,
        }
        coordinates = " ".join(sorted(map(str, like.coords)))
        zarr.create_group(
            memory,
            attributes={
                _ABOUT: about,
                "coordinates": coordinates,
                **to_jsonable(dict(like.attrs)),
            },
        )
        added = {_FLAGS: xr.Variable("trial", np.zeros(0, bool))}
        added |= {_PARAMETERS: xr.Variable("trial", np.zeros(0, "U1"))} if self._made else {}
        for name, item in [*like.variables.items(), *added.items()]:
            _create_array(memory, name, item, len(self.finished), self.group_size)
        _consolidate(memory)
        # the group's own file comes last: with it the folder is a store
        for name in sorted(files, key=lambda name: name == "zarr.json"):
            (self.path / name).parent.mkdir(exist_ok=True)
            write_atomic(self.path / name, files[name].to_bytes())

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
        n_trials = len(self.finished)
        outside = [index for index in wanted if not 0 <= index < n_trials]
        if outside or trials.sizes.get("trial") != len(wanted) or len({*wanted}) < len(wanted):
            raise InvalidInput(
                f"append takes one trial for each of its indices within 0 to {n_trials - 1}, got"
                f" the indices {str(wanted)[:60]} and the sizes {dict(trials.sizes)}."
            )
        if stored := [index for index in wanted if self.finished[index]]:
            raise StoreError(
                f"trial {min(stored)} is already stored in {self.path}; compute only those that"
                " are not `finished`."
            )
        _check_trials(trials)
        self.create(trials)
        _check_same(self._like, trials)
        order = np.argsort(wanted)
        wanted, trials = [wanted[k] for k in order], trials.isel(trial=order)
        write_group(self.path, wanted, trials)
        self.admit(wanted, trials)

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
            arrays = self._arrays = self._arrays or _open_arrays(self.path)
            for name, item in trials.variables.items():
                if item.dims == ("trial",):
                    _write(arrays[str(name)], indices, item.values)
            if self._made:
                texts = [write_plain(to_jsonable(self._made(index))) for index in indices]
                _write(arrays[_PARAMETERS], indices, np.array(texts))
            _write(arrays[_FLAGS], indices, np.ones(len(indices), bool))
        self.finished[[*indices]] = True

    def close(self) -> None:
        """Let go of the lock."""
        self._lock.release()

    def __exit__(self, *_: object) -> None:
        self.close()


def _make_folder(path: Path) -> None:
    """Make a store's folder; refuse one that holds something else."""
    if path.exists() and not path.is_dir():
        raise StoreError(f"{path} is a file; a store is a folder. Choose another name.")
    if is_old_store(path):
        raise StoreError(
            f"{path} is a store of feeler 0.3, which is read but not continued. Use a new store, or"
            f" keep its touches by: feeler convert {path} new.zarr"
        )
    ours = (path / _FLAGS / "lock").exists() or is_store(path)
    if foreign := [] if ours or not path.exists() else sorted(os.listdir(path)):
        raise StoreError(
            f"{path} exists and is no store (it holds {foreign[0]!r}). Choose an empty or new"
            " folder."
        )
    (path / _FLAGS).mkdir(parents=True, exist_ok=True)


def _create_array(
    store: MemoryStore, name: Any, item: xr.Variable, n_trials: int, group_size: int
) -> None:
    """An array for a variable of all trials, or for one that they share, with its values."""
    check_variable(name, item)
    text = item.dtype.kind in "UOT"
    of_trials = item.dims[:1] == ("trial",)
    shape = (n_trials, *item.shape[1:]) if of_trials else item.shape
    chunk, shard = shape, None
    if of_trials and item.ndim > 1:
        parts = range(1, min(INNER, group_size) + 1)  # a whole part of the group
        inner = max(n for n in parts if group_size % n == 0)
        chunk, shard = (inner, *shape[1:]), (group_size, *shape[1:])
    elif of_trials:
        chunk = (_LABELS,)
    array = zarr.create_array(
        store,
        name=name,
        shape=shape,
        dtype=str if text else item.dtype,
        chunks=tuple(max(n, 1) for n in chunk),
        shards=shard and tuple(max(n, 1) for n in shard),
        filters=None,
        compressors=[ZstdCodec(level=_LEVEL), Crc32cCodec()],
        fill_value="" if text else np.nan if item.dtype.kind == "f" else 0,
        dimension_names=tuple(map(str, item.dims)),
        chunk_key_encoding={"name": "default", "separator": "."},
        attributes=to_jsonable(dict(item.attrs)),
    )
    if not of_trials:
        array[...] = item.values


def _consolidate(store: Any) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # consolidated metadata are not in the standard yet
        zarr.consolidate_metadata(store, zarr_format=3)


def _check_trials(trials: xr.Dataset) -> None:
    """Raise where a Dataset cannot be kept in a store."""
    for name, item in trials.variables.items():
        check_variable(name, item)
        over = "trial" in item.dims
        if over and (item.dims[0] != "trial" or (item.ndim > 1 and item.dtype.kind in "UOT")):
            raise InvalidInput(
                f"variable {name!r} {item.dims} must hold numbers, and trial must come first."
            )
    if taken := sorted(_OWN & {*map(str, trials.variables)}):
        raise InvalidInput(
            f"a store keeps {taken[0]!r} itself; leave it out: dataset.drop_vars({taken[0]!r})."
        )


def _check_same(stored: Any, trials: xr.Dataset) -> None:
    """Raise StoreError where trials do not fit the stored ones: other variables, shapes, shared
    values or attributes.
    """
    found = [f"variable {name!r}" for name in {*stored.variables} ^ {*trials.variables}]
    for name in {*stored.variables} & {*trials.variables}:
        old, new = stored.variables[name], trials.variables[name]
        kinds = [f"{_name_type(one)}{one.shape[1:]}" for one in (old, new)]
        if "trial" not in old.dims and not old.equals(new):
            found.append(f"the values of {name}")
        elif "trial" in old.dims and kinds[0] != kinds[1]:
            found.append(f"{name}: {kinds[0]} → {kinds[1]}")
    before, after = stored.attrs, to_jsonable(dict(trials.attrs))
    found += [
        f"attribute {key}: {str(before.get(key))[:80]} → {str(after.get(key))[:80]}"
        for key in {*before, *after} - {*_UNSTABLE}
        if before.get(key) != after.get(key)
    ]
    if found:
        raise StoreError(
            f"the trials do not fit the store: {'; '.join(sorted(found)[:5])}. Use a new store for"
            " them."
        )


def _name_type(item: xr.Variable) -> str:
    """A variable's type; of labels, which are cast, only whether they are texts."""
    if item.dtype.kind in "UOT":
        return "text"
    return "numbers" if item.ndim == 1 else item.dtype.str


def _find_differences(stored: Any, asked: Any, name: str = "") -> list[str]:
    """Up to five places where two configurations differ, as ``name: stored → asked``."""
    if isinstance(stored, dict) and isinstance(asked, dict):
        pairs = [
            (f"{name}.{key}" if name else key, stored.get(key), asked.get(key))
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
            found += _find_differences(a, b, place)
    return found[:_MAX_DIFFERENCES]


def _show(value: Any) -> str:
    text = "nothing" if value is None else json.dumps(value, ensure_ascii=False)
    return text if len(text) <= 60 else text[:57] + "…"


def _save_store(
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
        if store.finished.any():
            raise InvalidInput(f"{path} already holds trials. Choose a new folder.")
        for start in range(0, n_trials, store.group_size):
            part = dataset.isel(trial=slice(start, start + store.group_size))
            store.append(range(start, start + part.sizes["trial"]), part)


# Reading: stored trials as a Dataset that reads its numbers when they are used.


def _read_about(path: Path) -> dict[str, Any]:
    """Store metadata."""
    content = parse_json(
        read_bytes(path / "zarr.json", MAX_TEXT, follow=False), f"{path / 'zarr.json'}"
    )
    about = (content.get("attributes") or {}).get(_ABOUT)
    if not isinstance(about, dict) or about.get("format") != FORMAT:
        raise InvalidInput(
            f"{path} is a store of another format; this feeler reads {FORMAT}. Update feeler."
        )
    size = about.get("group")
    if not isinstance(size, int) or size < 1 or "configuration" not in about:
        raise InvalidInput(f"{path / 'zarr.json'} is damaged: it lacks group or configuration.")
    return about


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


def _is_of_trials(array: Any) -> bool:
    return tuple(array.metadata.dimension_names or ())[:1] == ("trial",)


def _open(path: Path) -> xr.Dataset:
    """All trials of a store, finished or not, lazily."""
    plain = xr.open_zarr(path, chunks=None, mask_and_scale=False, decode_times=False)
    del plain.attrs[_ABOUT]
    shared = {name: item for name, item in plain.variables.items() if "trial" not in item.dims}
    return plain.assign({name: _fix_width(item).load() for name, item in shared.items()})


def _fix_width(item: xr.Variable) -> xr.Variable:
    """The variable, with texts in NumPy's usual type."""
    if item.dtype.kind not in ("O", "T"):
        return item
    return item.copy(data=np.array(item.values.tolist(), str).reshape(item.shape))


class _Numbers(BackendArray):
    """Numbers of trials that are read when they are used; curvature is angle over ``length``."""

    def __init__(self, path: Path, array: Any, length: np.ndarray | None = None) -> None:
        self.path, self.array, self.length = path, array, length
        self.shape, self.dtype = array.shape, array.dtype

    def __getitem__(self, key: Any) -> Any:
        outer = indexing.IndexingSupport.OUTER
        return indexing.explicit_indexing_adapter(key, self.shape, outer, self._read)

    def _read(self, key: tuple) -> np.ndarray:
        with _reading(self.path, self.array.basename):
            values = np.asarray(self.array.oindex[key])
        if self.length is None:
            return values
        length = np.broadcast_to(self.length[:, None], self.shape)
        for axis in reversed(range(len(key))):
            length = length[(slice(None),) * axis + (key[axis],)]
        return derive_curvature(values, length).astype(self.dtype)


def read_store(path: str | os.PathLike, *, first: int | None = None) -> xr.Dataset:
    """The finished trials of a store, in trial order, lazily and without locking it.

    Numbers are read when they are used, and so are the labels of more than 65,536 trials. Curvature
    is derived from angle where it is not stored.

    Parameters
    ----------
    first
        Only so many trials are read.

    Raises
    ------
    InvalidInput
        No store, no finished trial, or damaged.
    """
    path = Path(path)
    if is_old_store(path):
        return _read_old(path)
    if not is_store(path) and not (path / _FLAGS / "lock").exists():
        raise InvalidInput(f"{path} is no store of feeler.")
    with _reading(path):
        if not (path / "zarr.json").exists():
            raise InvalidInput(_EMPTY.format(path))
        _read_about(path)
        root: Any = zarr.open_group(path, mode="r")
        rows = np.flatnonzero(root[_FLAGS][:])[:first]
        if not rows.size:
            raise InvalidInput(_EMPTY.format(path))
        for _, array in root.arrays():
            _check_files(path, array, rows)
        dataset = _open(path)
        made = []
        if _PARAMETERS in dataset and rows.size <= MAX_LISTED:
            made = [json.loads(text) for text in dataset[_PARAMETERS].values[rows]]
        dataset = _assemble(path, dataset.drop_vars(_OWN, errors="ignore"), root, rows)
        if rows.size <= _EAGER:
            labels = {n: v for n, v in dataset.variables.items() if v.dims == ("trial",)}
            dataset = dataset.assign({n: _fix_width(v).load() for n, v in labels.items()})
        dataset = dataset.drop_encoding()
        for name, item in dataset.variables.items():
            if item.dtype.kind in "UOT":
                item.encoding["dtype"] = np.dtypes.StringDType()  # what Zarr v3 defines
            elif item.ndim > 1 and name in root and item.dims[0] == "trial":
                item.encoding |= {key: getattr(root[name], key) for key in ("chunks", "shards")}
        return _list_made(dataset, made)


_EMPTY = "the store {} holds no finished trial yet. Let the simulation go on."


def _check_files(path: Path, array: Any, rows: np.ndarray) -> None:
    """Raise where a chunk is missing, which Zarr would read as NaN, or is a link, which may lead
    anywhere.
    """
    if not _is_of_trials(array):
        return
    here = {
        entry.name
        for entry in os.scandir(path / array.basename)
        if entry.is_file(follow_symlinks=False)
    }
    for file in _find_chunks(path, array, rows):
        if file.name not in here:
            raise InvalidInput(
                f"{file} is missing. The command that made the store computes its trials again."
            )


def _assemble(path: Path, dataset: xr.Dataset, root: Any, rows: np.ndarray) -> xr.Dataset:
    """These trials, with numbers that are read when they are used."""
    found = {}
    for name, item in dataset.variables.items():
        if item.dims[:1] == ("trial",) and item.ndim > 1:
            numbers = indexing.LazilyIndexedArray(_Numbers(path, root[name]))
            found[name] = xr.Variable(item.dims, numbers, item.attrs)
    if "angle" in found and "curvature" not in found and "segment_length" in dataset:
        length, quantity = dataset["segment_length"].values, QUANTITIES["curvature"]
        numbers = indexing.LazilyIndexedArray(_Numbers(path, root["angle"], length))
        attrs = {"units": quantity.unit, "long_name": quantity.meaning}
        found["curvature"] = xr.Variable(found["angle"].dims, numbers, attrs)
    # The same rows as a slice where they are a run.
    run = bool(rows.size) and bool((np.diff(rows) == 1).all())
    return dataset.assign(found).isel(
        trial=(slice(int(rows[0]), int(rows[-1]) + 1) if run else rows)
    )


def _list_made(dataset: xr.Dataset, made: list[Any]) -> xr.Dataset:
    """The Dataset with what its trials were made with, where they are few."""
    if 0 < len(made) == dataset.sizes["trial"] <= MAX_LISTED:
        dataset.attrs["trials"] = json.dumps(made, sort_keys=True)
    return dataset


def _describe_store(path: Path) -> list[str]:
    """How much of a store is finished, without reading its numbers."""
    with _reading(path):
        finished = zarr.open_group(path, mode="r")[_FLAGS][:]  # type: ignore[index]
    shown = f"; below: the first {GLANCE}" if finished.sum() > GLANCE else ""  # type: ignore[union-attr]
    return [f"{finished.sum()} of {len(finished)} trials finished{shown}"]  # type: ignore[union-attr, arg-type]


def _find_damage(path: Path) -> list[str]:
    """What is wrong with the files of a store, one line for each."""
    if is_old_store(path):
        return []
    _read_about(path)
    with _reading(path):
        arrays = dict(zarr.open_group(path, mode="r", use_consolidated=False).arrays())
        return [
            f"{file} (trials {first} to {last}) is missing or damaged{words}. The command that"
            " made the store computes them again."
            for first, last, file, words in _find_damaged_chunks(path, arrays)
        ]


def _find_damaged_chunks(path: Path, arrays: dict) -> Iterator[tuple[int, int, Path, str]]:
    """First and last trial, file, and what a library says, of each file that cannot be read."""
    flags = arrays[_FLAGS]
    finished = np.ones(flags.shape[0], bool)
    for name, array in sorted(arrays.items(), key=lambda pair: pair[0] != _FLAGS):
        size = (array.shards or array.chunks)[0] if _is_of_trials(array) else 0
        for start in range(0, len(finished), size) if size else ():
            stop, (file,) = min(start + size, len(finished)), _find_chunks(path, array, [start])
            if not finished[start:stop].any() or (name == _FLAGS and not file.exists()):
                finished[start:stop] &= name != _FLAGS
                continue
            try:
                if not file.is_file() or file.is_symlink():
                    raise FileNotFoundError("")
                values = array[start:stop]
            except Exception as error:  # whatever zarr says of a damaged chunk
                yield start, stop - 1, file, f" ({str(error)[:100]})" if str(error) else ""
                finished[start:stop] = False
            else:
                if name == _FLAGS:
                    finished[start:stop] = values


# Stores of feeler 0.3, for one release: the records in their folder ``progress`` say which trials
# are finished, and hold their labels.


def _read_old(path: Path) -> xr.Dataset:
    """The finished trials of a store of feeler 0.3."""
    with _reading(path):
        files = sorted((path / "progress").glob("[0-9]*.json"))
        records = [json.loads(file.read_text(encoding="utf-8")) for file in files]
        rows = np.array([trial for record in records for trial in record["trials"]], int)
        if not rows.size:
            raise InvalidInput(_EMPTY.format(path))
        kinds = json.loads((path / "progress" / "store.json").read_text())["layout"]["labels"]
        labels = {
            name: np.array([value for one in records for value in one["labels"][name]], kind)
            for name, kind in kinds.items()
        }
        dataset, root = _open(path).drop_vars(_FLAGS), zarr.open_group(path, mode="r")
        attributes = {name: dataset[name].attrs for name in labels}
        dataset = _assemble(path, dataset.drop_vars([*labels]), root, rows)
        named = {name: ("trial", labels[name], attributes[name]) for name in labels}
        coordinates = {name for name in named if name in _open(path).coords}
        dataset = dataset.assign(named).set_coords(coordinates)
        made = [one for record in records for one in record["made"]]
        return _list_made(dataset.drop_encoding(), made)
