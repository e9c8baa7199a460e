"""The store being read: records, shards, and stored trials as a lazy Dataset."""

import hashlib
import json
import os
import re
import warnings
from collections.abc import Callable, Mapping
from dataclasses import field
from functools import partial
from itertools import groupby
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
import xarray as xr
import zarr
from xarray.backends import BackendArray
from xarray.core import indexing
from zarr.codecs import Crc32cCodec, ZstdCodec
from zarr.storage import LocalStore, MemoryStore, StorePath

from feeler.errors import InvalidInput, StoreError
from feeler.files import parse_json, read_bytes
from feeler.provenance import make_plain, write_plain
from feeler.records import Record
from feeler.sandbox import MAX_TEXT
from feeler.tensors.schema import QUANTITIES, derive_curvature
from feeler.tensors.writers import check_variable, describe_whole, restore_whole

# Shards: the numbers of one group of trials in one file each variable, encoded and decoded by
# the zarr library.
#
# A shard holds inner chunks of a few trials, so that a few can be read without the others; each
# chunk is compressed and has a checksum of its own.

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


# Records: what a store says of itself, and which trials of each group are finished; JSON with
# its own checksum.
#
# They are the truth. Everything else that makes a store a Zarr group is a copy for other
# readers.

FORMAT = 3
PROGRESS = "progress"  # a Zarr group, so that a Zarr reader takes no offence at the files in it
LABEL = "store.json"
_UNSTABLE = (
    "versions",  # those that began the store; a patch release goes on with it
    "created",
    "date",
    "history",
)  # attributes that may differ between trials of one set
_RECORD = re.compile(r"\d{6,}\.json")
_Kind = TypeVar("_Kind", bound=Record)


class Layout(Record):
    """The variables of a store, made from its first trials.

    Attributes
    ----------
    variables : dict[str, Variable]
        Those over (trial, …).
    labels : dict[str, str]
        Those over (trial,): name and type (``str`` or a NumPy type).
    shared : str
        JSON of the Dataset of all others, which every trial shares, and of the attributes.
    attributes : dict[str, dict[str, Any]]
        Of each label.
    """

    variables: dict[str, Variable]
    labels: dict[str, str]
    shared: str
    coordinates: tuple[str, ...]
    attributes: dict[str, dict[str, Any]]

    def make_shared(self) -> xr.Dataset:
        """What every trial shares."""
        return restore_whole(json.loads(self.shared), LABEL)


class Label(Record):
    """What a store says of itself.

    Attributes
    ----------
    group : int
        Trials in one group.
    """

    n_trials: int
    group: int
    configuration: dict[str, Any]
    layout: Layout | None = None


class GroupRecord(Record):
    """One group: its finished trials, their labels, and the digests that each of its shards may
    have.

    Attributes
    ----------
    shards : dict[str, list[str]]
        While a shard is being replaced, the old and the new one: the trials named here are in both.
    made : list[Any]
        What each trial was made with.
    """

    group: int
    trials: list[int]
    labels: dict[str, list[Any]]
    shards: dict[str, list[str]]
    made: list[Any] = field(default_factory=list)


def make_layout(dataset: xr.Dataset) -> Layout:
    """The layout for trials like these."""
    variables, labels, attributes = {}, {}, {}
    for name, item in dataset.variables.items():
        check_variable(name, item)
        text = item.dtype.kind in "UOT"
        if item.dims == ("trial",):
            labels[name] = "str" if text else item.dtype.str
            attributes[name] = make_plain(dict(item.attrs))
        elif "trial" in item.dims:
            if item.dims[0] != "trial" or text:
                raise InvalidInput(
                    f"variable {name!r} {item.dims} must hold numbers, and trial must come first."
                )
            variables[name] = Variable(
                dims=tuple(map(str, item.dims)),
                shape=item.shape[1:],
                dtype=item.dtype.str,
                attributes=make_plain(dict(item.attrs)),
            )
    rest = dataset.drop_vars([*variables, *labels])
    return Layout(
        variables={str(name): item for name, item in variables.items()},
        labels={str(name): item for name, item in labels.items()},
        shared=json.dumps(describe_whole(rest), sort_keys=True),
        coordinates=tuple(map(str, dataset.coords)),
        attributes={str(name): item for name, item in attributes.items()},
    )


def check_same(layout: Layout, other: Layout) -> None:
    """Raise StoreError where trials do not fit the layout: other variables, shapes, shared values
    or attributes.
    """
    if layout == other:
        return
    found = [
        f"variable {name!r}"
        for name in {*layout.variables, *layout.labels} ^ {*other.variables, *other.labels}
    ]
    found += [
        f"{name}: {item.dtype}{item.shape} →"
        f" {other.variables[name].dtype}{other.variables[name].shape}"
        for name, item in layout.variables.items()
        if name in other.variables
        and (item.dtype, item.shape)
        != (other.variables[name].dtype, other.variables[name].shape)
    ]
    found += [
        f"{name}: {kind} → {other.labels[name]}"
        for name, kind in layout.labels.items()
        if name in other.labels and (kind == "str") != (other.labels[name] == "str")
    ]
    old, new = layout.make_shared(), other.make_shared()
    found += [f"variable {name!r}" for name in {*old.variables} ^ {*new.variables}]
    found += [
        f"the values of {name}"
        for name in old.variables
        if name in new.variables and not old[name].equals(new[name])
    ]
    found += [
        f"attribute {key}: {str(old.attrs.get(key))[:80]} → {str(new.attrs.get(key))[:80]}"
        for key in sorted({*old.attrs, *new.attrs} - {*_UNSTABLE})
        if old.attrs.get(key) != new.attrs.get(key)
    ]
    if found:
        raise StoreError(
            f"the trials do not fit the store: {'; '.join(sorted(found)[:5])}. Use a new store for"
            " them."
        )


def compute_sum(raw: bytes) -> str:
    """A digest of a file; no CRC-32C, which is one number for all that ends in its own."""
    return hashlib.blake2b(raw, digest_size=16).hexdigest()


def seal(content: Record, **fields: Any) -> bytes:
    """A record as JSON that carries its own checksum."""
    plain = make_plain({**content.to_plain(), **fields})
    return json.dumps(
        plain | {"checksum": compute_sum(_text(plain))}, ensure_ascii=False
    ).encode("utf-8", "replace")


def _text(plain: dict[str, Any]) -> bytes:
    return write_plain(plain).encode("utf-8", "replace")


def _unseal(path: Path, limit: int) -> dict[str, Any]:
    content = parse_json(read_bytes(path, limit, follow=False), str(path))
    sum_ = content.pop("checksum", None)
    try:
        good = sum_ == compute_sum(_text(content))
    except RecursionError:  # nested as no content of ours is
        good = False
    if not good:
        raise InvalidInput(f"{path} is damaged: its checksum does not fit its content.")
    return content


def is_store(path: Path) -> bool:
    """Whether a folder is a store."""
    return (path / PROGRESS / LABEL).is_file() or (path / PROGRESS / "schema.json").is_file()


def read_label(path: Path) -> Label:
    """What a store says of itself.

    Raises
    ------
    InvalidInput
        No store, of another format, or damaged.
    """
    if not (path / PROGRESS / LABEL).exists():
        if (path / PROGRESS / "schema.json").exists():
            raise InvalidInput(
                f"{path} is a store of format 2, of feeler 0.1; this feeler reads {FORMAT}. Make it"
                " again."
            )
        raise InvalidInput(f"{path} is no store of feeler.")
    content = _unseal(path / PROGRESS / LABEL, MAX_TEXT)
    if content.pop("format", None) != FORMAT:
        raise InvalidInput(
            f"{path} is a store of another format; this feeler reads {FORMAT}. Update feeler."
        )
    return _make(Label, content, path / PROGRESS / LABEL)


def _make(kind: type[_Kind], content: dict[str, Any], file: Path) -> _Kind:
    """A record of a store from what its file holds."""
    try:
        return kind(**content)
    except (InvalidInput, TypeError) as error:
        raise InvalidInput(f"{file} is damaged: {str(error)[:150]}") from error


def find_groups(path: Path) -> list[int]:
    """Numbers of the groups that have a record, rising."""
    folder = path / PROGRESS
    return sorted(
        int(name.name[:-5]) for name in folder.iterdir() if _RECORD.fullmatch(name.name)
    )


def record_path(path: Path, group: int) -> Path:
    """Where the record of a group lies."""
    return path / PROGRESS / f"{group:06d}.json"


def read_record(path: Path, group: int, label: Label) -> GroupRecord:
    """A group's record, checked."""
    file, layout = record_path(path, group), label.layout
    record = _make(GroupRecord, _unseal(file, MAX_TEXT), file)
    rows = range(group * label.group, min((group + 1) * label.group, label.n_trials))
    counts = {name: len(values) for name, values in record.labels.items()}
    good = (
        layout is not None
        and record.group == group
        and {*record.trials} <= {*rows}
        and record.trials == sorted({*record.trials})
        and record.shards.keys() == layout.variables.keys()
        and counts == dict.fromkeys(layout.labels, len(record.trials))
    )
    if not good:
        raise InvalidInput(f"{file} is damaged: it is no record of trials of group {group}.")
    return record


def find_shard(path: Path, name: str, record: GroupRecord, label: Label) -> Path:
    """Where a group's shard of a variable lies."""
    return path / name / find_key(record.group, label.layout.variables[name])  # type: ignore[union-attr]


def check_shards(path: Path, record: GroupRecord, label: Label) -> None:
    """Raise InvalidInput where a shard of the group is missing or not what was written."""
    for name, sums in record.shards.items():
        file = find_shard(path, name, record, label)
        if (
            not file.is_file()
            or file.is_symlink()
            or compute_sum(file.read_bytes()) not in sums
        ):
            first, last = record.trials[0], record.trials[-1]
            raise InvalidInput(
                f"{file} (trials {first} to {last}) is missing or damaged: its digest is not in"
                " their record."
            )


def merge(old: GroupRecord, new: GroupRecord) -> GroupRecord:
    """Both records' trials, in order."""
    trials = old.trials + new.trials
    order = np.argsort(trials)
    labels = {
        name: [(old.labels[name] + new.labels[name])[k] for k in order] for name in new.labels
    }
    made = old.made + new.made
    return new.replace(
        trials=sorted(trials), labels=labels, made=[made[k] for k in order] if made else []
    )


# Stored trials as a Dataset that reads its numbers when they are used.

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
