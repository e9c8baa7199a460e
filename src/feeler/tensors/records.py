"""Records: what a store says of itself, and which trials of each group are finished; JSON with its
own checksum.

They are the truth. Everything else that makes a store a Zarr group is a copy for other readers.
"""

import hashlib
import json
import re
from dataclasses import field
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
import xarray as xr

from feeler.disk.files import parse_json, read_bytes
from feeler.disk.guard import MAX_TEXT
from feeler.disk.provenance import make_plain, write_plain
from feeler.errors import InvalidInput, StoreError
from feeler.records.record import Record
from feeler.tensors.plain import check_variable, describe_whole, restore_whole
from feeler.tensors.shards import Variable, find_key

FORMAT = 3
PROGRESS = "progress"  # a Zarr group, so that a Zarr reader takes no offence at the files in it
LABEL = "store.json"
_UNSTABLE = (
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
