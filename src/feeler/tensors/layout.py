"""Layout of a store: which variables of a Dataset go where, and how a trial's record is written and checked.

Variables with the dims (trial, …) are arrays of one chunk per trial; those with the one dim (trial,) are kept in each
trial's record until the store is closed; all others are the same for every trial and written once.
"""

import hashlib
import json
import math
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from feeler.errors import InvalidInput, StoreError
from feeler.provenance import make_plain, write_canonical
from feeler.tensors.limits import NAME, Limits, parse_json, read_bytes
from feeler.tensors.zarr3 import (
    NUMBERS,
    ArrayInfo,
    decode_chunk,
    describe_array,
    list_arrays,
    parse_array_metadata,
    read_array,
    read_chunk,
)

PROGRESS = "progress"  # a Zarr group, so that a Zarr reader takes no offence at the files in it
SCHEMA = "schema.json"
UNSTABLE = ("created", "date", "history")  # attributes that may differ between trials of one set
MAX_RECORD = 2**20
RESTORE = "Restore this file from a copy, or compute the set again in a new store."


@dataclass(frozen=True, kw_only=True, eq=False)
class Layout:
    """The variables of a store; made from the first trial, or read from disk."""

    chunked: dict[str, ArrayInfo]
    """Arrays of one chunk per trial."""
    fixed: dict[str, xr.Variable]
    """Variables that every trial shares."""
    recorded: dict[str, str]
    """One value per trial: name and type (``str`` or a NumPy type)."""
    coordinates: tuple[str, ...]
    attributes: dict[str, dict[str, Any]] = field(default_factory=dict)
    """Attributes of each variable; under "" those of the Dataset."""

    def to_json(self) -> dict[str, Any]:
        """What ``schema.json`` holds; shapes and types are in the arrays' own metadata."""
        return {
            "chunked": list(self.chunked),
            "fixed": list(self.fixed),
            "recorded": self.recorded,
            "coordinates": list(self.coordinates),
            "attributes": self.attributes,
        }


def write_schema(layout: Layout, files: dict[str, bytes]) -> bytes:
    """The text of ``schema.json``: the layout, and checksums of itself and of the files that all trials share."""
    return _seal(layout.to_json() | {"files": {name: compute_sum(raw) for name, raw in files.items()}})


def _seal(content: dict[str, Any]) -> bytes:
    """JSON that carries its own checksum."""
    content = make_plain(content)
    return json.dumps(content | {"checksum": _sum_content(content)}, ensure_ascii=False).encode()


def _is_sealed(content: dict[str, Any]) -> bool:
    rest = {key: value for key, value in content.items() if key != "checksum"}
    try:
        return content.get("checksum") == _sum_content(rest)
    except RecursionError:  # nested as no content of ours is
        return False


def _sum_content(content: dict[str, Any]) -> str:
    return compute_sum(write_canonical(content).encode("utf-8", "surrogatepass"))


def _check_sums(path: Path, schema: dict[str, Any], infos: dict[str, ArrayInfo], limits: Limits) -> None:
    """Raise where the schema or a file that all trials share is not what was written."""
    if not _is_sealed(schema):
        raise InvalidInput(f"{path / PROGRESS / SCHEMA} is damaged: its checksum does not fit. {RESTORE}")
    names = [f"{name}/zarr.json" for name in infos]
    whole = {name: infos[name] for name in schema["fixed"]}
    names += [f"{name}/{info.key((0,) * len(info.shape))}" for name, info in whole.items() if math.prod(info.shape)]
    for name in names:
        if schema["files"].get(name) != compute_sum(read_bytes(path / name, limits.max_bytes, follow=False)):
            raise InvalidInput(f"{path / name} is damaged: its checksum does not fit the schema. {RESTORE}")


def make_layout(dataset: xr.Dataset, n_trials: int) -> Layout:
    """The layout for ``n_trials`` trials like this one."""
    chunked, fixed, recorded = {}, {}, {}
    for name, variable in dataset.variables.items():
        if not (isinstance(name, str) and NAME.fullmatch(name)):
            raise InvalidInput(f"a variable's name is letters, digits and _, from a letter; got {name!r}.")
        if variable.dims == ("trial",):
            recorded[name] = describe_array(name, variable.values, variable.dims).kind.replace("string", "str")
        elif "trial" not in variable.dims:
            fixed[name] = variable
            describe_array(name, variable.values, variable.dims)
        elif variable.dims[0] != "trial":
            raise InvalidInput(f"variable {name!r} has the dims {variable.dims}; trial must come first.")
        else:
            chunked[name] = describe_array(
                name,
                variable.values,
                variable.dims,
                shape=(n_trials, *variable.shape[1:]),
                chunk=(1, *(max(n, 1) for n in variable.shape[1:])),
                attributes=make_plain(dict(variable.attrs)),
            )
    attributes = {name: make_plain(dict(variable.attrs)) for name, variable in dataset.variables.items()}
    return Layout(
        chunked=chunked,
        fixed=fixed,
        recorded=recorded,
        coordinates=tuple(map(str, dataset.coords)),
        attributes={**attributes, "": make_plain(dict(dataset.attrs))},
    )


def check_same(layout: Layout, dataset: xr.Dataset, n_trials: int, what: str) -> None:
    """Raise StoreError where a trial does not fit the layout: other variables, shapes, shared values or attributes."""
    other = make_layout(dataset, n_trials)
    found = [f"variable {name!r}" for name in {*layout.chunked, *layout.fixed, *layout.recorded} ^ {*dataset.variables}]
    for name, info in layout.chunked.items():
        new = other.chunked.get(name)
        if new is not None and (new.shape, new.kind, new.dims) != (info.shape, info.kind, info.dims):
            found.append(f"{name}: {info.kind}{info.shape[1:]} → {new.kind}{new.shape[1:]}")
    for name, variable in layout.fixed.items():
        new = other.fixed.get(name)
        if new is not None and not variable.equals(new):
            found.append(f"the values of {name}")
    found += [
        f"{name}: {a} → {other.recorded.get(name)}"
        for name, a in layout.recorded.items()
        if other.recorded.get(name) != a
    ]
    old, new = layout.attributes[""], other.attributes[""]
    found += [
        f"attribute {key}: {str(old.get(key))[:80]} → {str(new.get(key))[:80]}"
        for key in sorted({*old, *new} - {*UNSTABLE})
        if old.get(key) != new.get(key)
    ]
    if found:
        raise StoreError(f"{what} does not fit the store: {'; '.join(sorted(found)[:5])}. Use a new store for it.")


def compute_sum(raw: bytes) -> str:
    """A digest of a chunk with its own CRC-32C; no second CRC-32C, which would be the same number for every chunk."""
    return hashlib.blake2b(raw, digest_size=16).hexdigest()


def make_record(layout: Layout, dataset: xr.Dataset, index: int, chunks: dict[str, bytes]) -> bytes:
    """The text that marks a trial as finished: its labels, and the checksum of each of its chunks."""
    values = {name: make_plain(dataset.variables[name].values[0]) for name in layout.recorded}
    sums = {name: compute_sum(raw) for name, raw in chunks.items()}
    return _seal({"trial": index, "values": values, "chunks": sums})


def read_record(path: Path, index: int, layout: Layout) -> dict[str, Any]:
    """A trial's record, checked; values in their types."""
    record = parse_json(read_bytes(path, MAX_RECORD, follow=False), str(path))
    values, chunks = record.get("values"), record.get("chunks")
    good = _is_sealed(record) and isinstance(values, dict) and isinstance(chunks, dict)
    good = good and record.get("trial") == index
    if not (good and values.keys() == layout.recorded.keys() and chunks.keys() == layout.chunked.keys()):
        raise InvalidInput(f"{path} is damaged: it is no record of trial {index}.")
    try:
        record["values"] = {name: _restore(value, layout.recorded[name]) for name, value in values.items()}
    except (TypeError, ValueError, OverflowError) as error:
        raise InvalidInput(f"{path} is damaged: {str(error)[:100]}.") from error
    return record


def _restore(value: Any, kind: str) -> Any:
    if kind == "str":
        return str(value)
    if isinstance(value, list | dict):
        raise ValueError("a label is one number or text")
    return np.dtype(kind).type(float(value) if isinstance(value, str) else value)


def read_trial(path: Path, index: int, layout: Layout, record: dict[str, Any]) -> dict[str, np.ndarray]:
    """The trial's arrays, each (1, …); InvalidInput names the chunk that is missing or damaged."""
    arrays = {}
    for name, info in layout.chunked.items():
        place = path / name / info.key((index, *(0 for _ in info.shape[1:])))
        raw = read_chunk(place, info)
        if compute_sum(raw) != record["chunks"][name]:
            raise InvalidInput(
                f"{place} (trial {index}, {name}) is damaged: its checksum does not fit the trial's record."
            )
        arrays[name] = decode_chunk(raw, info, str(place))[tuple(slice(0, n) for n in (1, *info.shape[1:]))]
    return arrays


def read_layout(path: Path, limits: Limits) -> Layout | None:
    """The layout that a store on disk has, or None before its first trial."""
    file = path / PROGRESS / SCHEMA
    if not file.exists():
        return None
    schema = parse_json(read_bytes(file, limits.max_text, follow=False), str(file))
    try:
        infos, _ = list_arrays(path, limits, [*schema["chunked"], *schema["fixed"]])
        _check_sums(path, schema, infos, limits)
        chunked = {name: infos[name] for name in schema["chunked"]}
        fixed = {
            name: xr.Variable(infos[name].dims, _text(read_array(path, infos[name])), schema["attributes"].get(name))
            for name in schema["fixed"]
        }
        for kind in schema["recorded"].values():
            if kind != "str" and kind not in NUMBERS:
                raise InvalidInput(f"{file}: unknown type {kind!r}.")
        attributes = {str(name): dict(attrs) for name, attrs in schema["attributes"].items()}
        attributes.setdefault("", {})
        coordinates = tuple(map(str, schema["coordinates"]))
        recorded = {str(name): str(kind) for name, kind in schema["recorded"].items()}
    except (KeyError, TypeError, ValueError, AttributeError) as error:
        if isinstance(error, InvalidInput):
            raise
        raise InvalidInput(f"{file} is damaged: {str(error)[:100]}.") from error
    _check_names(file, chunked, recorded, fixed)
    return Layout(chunked=chunked, fixed=fixed, recorded=recorded, coordinates=coordinates, attributes=attributes)


def _check_names(file: Path, chunked: dict, recorded: dict, fixed: dict) -> None:
    names = [*chunked, *recorded, *fixed]
    if len(set(names)) < len(names) or not all(NAME.fullmatch(name) for name in names):
        raise InvalidInput(f"{file} is damaged: its names are {str(names)[:100]}.")
    for name, info in chunked.items():
        if (
            not info.shape
            or info.chunk[0] != 1
            or any(c < n for c, n in zip(info.chunk[1:], info.shape[1:], strict=True))
        ):
            raise InvalidInput(f"{file}: array {name!r} is not chunked by trial.")


def _text(values: np.ndarray) -> np.ndarray:
    return values.astype(str) if values.dtype == object else values


def assemble(path: Path, layout: Layout, indices: list[int], limits: Limits) -> xr.Dataset:
    """The Dataset of the trials given, in their order; InvalidInput names what is damaged."""
    n_bytes = sum(math.prod(info.shape[1:]) * info.item_size for info in layout.chunked.values()) * len(indices)
    limits.check_bytes(n_bytes, str(path))
    arrays = {name: np.empty((len(indices), *info.shape[1:]), info.dtype) for name, info in layout.chunked.items()}
    labels: dict[str, list[Any]] = {name: [] for name in layout.recorded}
    for row, index in enumerate(indices):
        record = read_record(record_path(path, index), index, layout)
        for name, part in read_trial(path, index, layout, record).items():
            arrays[name][row] = part[0]
        for name, value in record["values"].items():
            labels[name].append(value)
    variables = dict(layout.fixed)
    variables |= {name: xr.Variable(layout.chunked[name].dims, values) for name, values in arrays.items()}
    variables |= {
        name: xr.Variable("trial", _label_array(labels[name], kind)) for name, kind in layout.recorded.items()
    }
    for name, variable in variables.items():
        variable.attrs = dict(layout.attributes.get(name, {}))
    coordinates = {name: variables.pop(name) for name in layout.coordinates if name in variables}
    try:
        return xr.Dataset(variables, coords=coordinates, attrs=dict(layout.attributes[""]))
    except ValueError as error:
        raise InvalidInput(f"{path} is damaged: {str(error)[:200]}.") from error


def _label_array(values: list[Any], kind: str) -> np.ndarray:
    return np.array(values, dtype=str if kind == "str" else kind)


def record_path(path: Path, index: int) -> Path:
    """Where the record of a trial lies."""
    return path / PROGRESS / f"{index:06d}.json"


__all__ = [
    "Layout",
    "assemble",
    "check_same",
    "make_layout",
    "make_record",
    "parse_array_metadata",
    "read_layout",
    "write_schema",
]
