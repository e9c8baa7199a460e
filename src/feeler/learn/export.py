"""Training sets as files that others read: Parquet and RO-Crate."""

import json
import os
import secrets
import shutil
from collections.abc import Iterator
from datetime import UTC, datetime
from glob import escape
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from feeler.errors import InvalidInput, MissingExtra
from feeler.files import TEMPORARY_DAYS, parse_json, read_bytes, sweep_old, write_atomic
from feeler.learn.dataset import check_coordinate
from feeler.provenance import LICENCE, find_version
from feeler.tensors.formats import load
from feeler.tensors.transforms import in_unit
from feeler.validation import checked

# Parquet in the layout of LeRobot 3.0 and Hugging Face: one row a sample, one episode a touch,
# and a data card.

_BLOCK = 256  # trials read at once
EPISODES = 2048  # [C] touches in one file: 45 MB of 56 sensors and 100 samples
_DATA = "data/chunk-{chunk_index:03d}/file-{file_index:03d}.parquet"
_META = "meta/episodes/chunk-{chunk_index:03d}/file-{file_index:03d}.parquet"
_CHUNK = 1000  # files in one folder, as LeRobot has them
_SIZES = (
    (1_000, "n<1K"),
    (10_000, "1K<n<10K"),
    (100_000, "10K<n<100K"),
    (1_000_000, "100K<n<1M"),
)


@checked
def export_parquet(
    store: str | os.PathLike | xr.Dataset,
    folder: str | os.PathLike,
    *,
    task: str = "feature",
    variable: str = "angle",
    name: str = "",
) -> Path:
    """Write touches as a data set that Hugging Face ``datasets`` and LeRobot read; a folder that is
    new or empty.

    Each row is one sample: ``observation.state`` (sensor,) [unit of the variable], ``timestamp``
    [s], ``frame_index``, ``episode_index`` (the touch), ``index``, ``task_index``. ``meta/`` holds
    features, sums over the set, tasks, and for each episode all labels of its trial; ``README.md``
    is the data card. The folder appears when it is whole; after a failure there is none.

    Parameters
    ----------
    task
        The label of trials that becomes LeRobot's task.

    Raises
    ------
    MissingExtra
        pyarrow is not installed.
    InvalidInput
        No such label or variable, or a folder that holds something.
    """
    try:
        import pyarrow.parquet
    except ImportError:
        raise MissingExtra("Parquet needs pyarrow: pip install 'feeler[parquet]'.") from None
    tensors = store if isinstance(store, xr.Dataset) else load(store)
    check_coordinate(tensors, task, "task")
    if variable not in tensors or tensors[variable].dims != ("trial", "sensor", "time"):
        raise InvalidInput(
            f"there is no variable {variable!r} (trial, sensor, time) to export; angle is one."
        )
    folder = Path(folder)
    if folder.exists() and (not folder.is_dir() or any(folder.iterdir())):
        raise InvalidInput(f"{folder} holds something. Choose a new folder.")
    # whatever a Dataset may lack is found out before anything is written
    info = _describe_features(tensors, variable, task)
    card = _write_card(tensors, variable, task, name or folder.name)
    sweep_old(folder.parent, f".{escape(folder.name)}.*.tmp", days=TEMPORARY_DAYS)
    partial = folder.with_name(f".{folder.name}.{secrets.token_hex(4)}.tmp")
    try:
        stats = _write_tables(pyarrow, partial, tensors, variable, task)
        for file, content in (("info", info), ("stats", stats)):
            (partial / f"meta/{file}.json").write_text(json.dumps(content, indent=2))
        (partial / "README.md").write_text(card, encoding="utf-8")
        if folder.exists():
            folder.rmdir()
        partial.rename(folder)
    except BaseException:
        shutil.rmtree(partial, ignore_errors=True)
        raise
    return folder


def _write_tables(
    pa: Any, folder: Path, tensors: xr.Dataset, variable: str, task: str
) -> dict[str, Any]:
    """Write rows, episodes and tasks; the sums over all rows, as LeRobot's stats.json."""
    tasks, codes = np.unique(tensors[task].values.astype(str), return_inverse=True)
    codes = codes.reshape(-1)
    n = tensors.sizes["trial"]
    sums: list[np.ndarray] = []
    for number, first in enumerate(range(0, n, EPISODES)):
        rows = range(first, min(first + EPISODES, n))
        place = {"chunk_index": number // _CHUNK, "file_index": number % _CHUNK}
        blocks = _make_rows(pa, tensors, variable, rows, codes, sums)
        _write(pa, folder / _DATA.format(**place), blocks)
        episodes = _make_episodes(pa, tensors, rows, tasks[codes], place)
        _write(pa, folder / _META.format(**place), iter([episodes]))
    known = pa.table({"task_index": range(len(tasks)), "task": tasks.tolist()})
    _write(pa, folder / "meta/tasks.parquet", iter([known]))
    count = n * tensors.sizes["time"]
    low, high, total, squares = np.stack(sums, axis=1)
    mean = total.sum(axis=0) / count
    sd = np.sqrt(np.maximum(squares.sum(axis=0) / count - mean**2, 0))
    found = {"min": low.min(axis=0), "max": high.max(axis=0), "mean": mean, "std": sd}
    return {"observation.state": {k: v.tolist() for k, v in found.items()} | {"count": [count]}}


def _write(pa: Any, path: Path, tables: Iterator[Any]) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    first = next(tables)
    with pa.parquet.ParquetWriter(path, first.schema, compression="zstd") as writer:
        writer.write_table(first)
        for table in tables:
            writer.write_table(table)


def _make_rows(
    pa: Any,
    tensors: xr.Dataset,
    variable: str,
    rows: range,
    codes: np.ndarray,
    sums: list[np.ndarray],
) -> Iterator[Any]:
    """Tables of all samples; each block's least, greatest, sum and squares join ``sums``."""
    n_sensors, n_samples = tensors.sizes["sensor"], tensors.sizes["time"]
    time = in_unit(tensors["time"], "s").values
    for start in range(rows.start, rows.stop, _BLOCK):
        trials = np.arange(start, min(start + _BLOCK, rows.stop))
        values = tensors[variable][start : trials[-1] + 1].values.astype(np.float32)
        state = np.ascontiguousarray(values.transpose(0, 2, 1)).reshape(-1, n_sensors)
        exact = state.astype(float)
        sums.append(
            np.stack(
                [exact.min(axis=0), exact.max(axis=0), exact.sum(axis=0), (exact**2).sum(0)]
            )
        )
        yield pa.table(
            {
                "observation.state": pa.FixedSizeListArray.from_arrays(
                    pa.array(state.ravel()), n_sensors
                ),
                "timestamp": np.tile(time, trials.size).astype(np.float32),
                "frame_index": np.tile(np.arange(n_samples), trials.size),
                "episode_index": np.repeat(trials, n_samples),
                "index": np.arange(start * n_samples, (trials[-1] + 1) * n_samples),
                "task_index": np.repeat(codes[trials], n_samples),
            }
        )


def _make_episodes(
    pa: Any, tensors: xr.Dataset, rows: range, tasks: np.ndarray, place: dict[str, int]
) -> Any:
    n, n_samples = len(rows), tensors.sizes["time"]
    columns = {
        "episode_index": np.arange(rows.start, rows.stop),
        "tasks": [[task] for task in tasks[rows.start : rows.stop].tolist()],
        "length": np.full(n, n_samples),
        "dataset_from_index": np.arange(rows.start, rows.stop) * n_samples,
        "dataset_to_index": np.arange(rows.start + 1, rows.stop + 1) * n_samples,
    }
    for key, value in place.items():
        columns[f"data/{key}"] = np.full(n, value)
    for key, label in _list_labels(tensors).items():
        values = label.values[rows.start : rows.stop]
        columns[f"label/{key}"] = values.tolist() if values.dtype.kind in "UOT" else values
    return pa.table(columns)


def _list_labels(tensors: xr.Dataset) -> dict[str, xr.DataArray]:
    """Coordinates of trials, but for their numbers."""
    return {
        str(key): item
        for key, item in tensors.coords.items()
        if item.dims == ("trial",) and key != "trial"
    }


def _describe_features(tensors: xr.Dataset, variable: str, task: str) -> dict[str, Any]:
    """As LeRobot's info.json."""
    n, n_samples, n_sensors = (
        tensors.sizes["trial"],
        tensors.sizes["time"],
        tensors.sizes["sensor"],
    )
    time = in_unit(tensors["time"], "s").values
    whole = {"dtype": "int64", "shape": [1], "names": None}
    names = [f"{variable}_{number}" for number in tensors["segment"].values.tolist()]
    return {
        "codebase_version": "v3.0",
        "robot_type": "antenna",
        "total_episodes": n,
        "total_frames": n * n_samples,
        "total_tasks": np.unique(tensors[task].values).size,
        "chunks_size": _CHUNK,
        "fps": (n_samples - 1) / float(time[-1] - time[0]) if n_samples > 1 else 1000.0,
        "splits": {"train": f"0:{n}"},
        "data_path": _DATA,
        "video_path": None,
        "features": {
            "observation.state": {"dtype": "float32", "shape": [n_sensors], "names": names},
            "timestamp": {"dtype": "float32", "shape": [1], "names": None},
            **dict.fromkeys(("frame_index", "episode_index", "index", "task_index"), whole),
        },
        "units": {
            "observation.state": tensors[variable].attrs.get("units", ""),
            "timestamp": "s",
        },
    }


def _write_card(tensors: xr.Dataset, variable: str, task: str, name: str) -> str:
    """The data card, as Hugging Face reads it."""
    n = tensors.sizes["trial"]
    size = next((words for most, words in _SIZES if n < most), "n>1M")
    rows = "".join(_describe_label(key, item) for key, item in _list_labels(tensors).items())
    return f"""---
license: {str(tensors.attrs.get("licence", "cc0-1.0")).lower()}
pretty_name: {json.dumps(name)}
tags: [tactile, antenna, simulation, LeRobot]
size_categories: [{size}]
configs:
  - config_name: default
    data_files: data/*/*.parquet
---

# {name}

{n:,} touches of an insect-like antenna, {tensors.sizes["sensor"]} sensors and
{tensors.sizes["time"]} samples each, simulated by feeler (engine
{tensors.attrs.get("engine", "unknown")}). One episode is one touch; `observation.state` is the
{variable} [{tensors[variable].attrs.get("units", "")}] of the sensors from base to tip; the task is
the label `{task}`.

Simulated, not measured: what the physics leaves out is listed in feeler's documentation. Touches
that differ in nothing but noise lie on one side of a split only if the split is made by their
labels.

| label | values | unit |
|---|---|---|
{rows}
Made with: `{str(tensors.attrs.get("versions", ""))[:400]}`
"""


def _describe_label(name: str, item: xr.DataArray) -> str:
    distinct = np.unique(item.values)
    text = distinct.dtype.kind in "UOT"
    if text or distinct.size <= 4:
        words = ", ".join(map(str, distinct[:4])) + (" …" if distinct.size > 4 else "")
    else:
        words = f"{distinct[0]:.4g} … {distinct[-1]:.4g}"
    return f"| {name} | {words} | {item.attrs.get('units', '')} |\n"


# RO-Crate: a file beside a store by which archives and search engines know what it holds.

_MAX_BYTES = 16 * 2**20  # [C]
_PAPER = "https://doi.org/10.1101/2025.10.20.683587"
_LICENCES = {
    "CC0-1.0": "https://creativecommons.org/publicdomain/zero/1.0/",
    "CC-BY-4.0": "https://creativecommons.org/licenses/by/4.0/",
}


@checked
def write_crate(
    store: str | os.PathLike, *, name: str = "", description: str = "", author: str = ""
) -> Path:
    """Write ``ro-crate-metadata.json`` into the folder that holds a store, and give back where it
    is.

    Follows RO-Crate 1.1 (https://w3id.org/ro/crate/1.1): the data set with its licence and the
    software that made it, and each variable and label with its unit.

    Raises
    ------
    InvalidInput
        No store, or the folder already has a crate that describes something else.
    """
    path = Path(store)
    tensors, place = load(path), path.absolute().parent / "ro-crate-metadata.json"
    if place.exists() and not _is_ours(place, path.name):
        raise InvalidInput(
            f"{place} describes something else. Put the store into a folder of its own."
        )
    write_atomic(
        place,
        json.dumps(
            _make_crate(tensors, path.name, name, description, author), indent=2
        ).encode(),
    )
    return place


def _is_ours(place: Path, store: str) -> bool:
    try:
        graph = parse_json(read_bytes(place, _MAX_BYTES), str(place))["@graph"]
        return any(item.get("@id") == f"{store}/" for item in graph)
    except (ValueError, KeyError, TypeError, AttributeError):
        return False


def _make_crate(
    tensors: xr.Dataset, store: str, name: str = "", description: str = "", author: str = ""
) -> dict[str, Any]:
    """The content of a crate for a store of this name."""
    sizes = ", ".join(
        f"{size} {dim}s" for dim, size in tensors.sizes.items() if dim in ("trial", "sensor")
    )
    licence = str(tensors.attrs.get("licence", LICENCE))
    words = (
        description
        or f"Simulated touches of insect-like antennae: {sizes},"
        f" {tensors.sizes.get('time', 0)} samples each."
    )
    variables = [_describe(str(key), item) for key, item in tensors.variables.items()]
    root: dict[str, Any] = {
        "@id": "./",
        "@type": "Dataset",
        "name": name or store,
        "description": words,
        "datePublished": datetime.now(UTC).date().isoformat(),
        "license": {"@id": _LICENCES.get(licence, licence)},
        "hasPart": [{"@id": f"{store}/"}],
        "citation": {"@id": _PAPER},
    }
    people = [{"@id": "#author", "@type": "Person", "name": author}] if author else []
    root |= {"author": {"@id": "#author"}} if author else {}
    return {
        "@context": "https://w3id.org/ro/crate/1.1/context",
        "@graph": [
            {
                "@id": "ro-crate-metadata.json",
                "@type": "CreativeWork",
                "conformsTo": {"@id": "https://w3id.org/ro/crate/1.1"},
                "about": {"@id": "./"},
            },
            root,
            {
                "@id": f"{store}/",
                "@type": "Dataset",
                "name": store,
                "description": (
                    "Zarr version 3 group; open it with xarray.open_zarr or feeler.load."
                ),
                "variableMeasured": [{"@id": item["@id"]} for item in variables],
            },
            *variables,
            *_make_origin(store, str(tensors.attrs.get("versions", ""))),
            {
                "@id": _PAPER,
                "@type": "ScholarlyArticle",
                "url": _PAPER,
                "name": "The paper that feeler follows",
            },
            {"@id": _LICENCES.get(licence, licence), "@type": "CreativeWork", "name": licence},
            *people,
        ],
    }


def _make_origin(store: str, versions: str) -> list[dict[str, Any]]:
    """The run that made a store, and the program that ran."""
    software = "#feeler"
    return [
        {
            "@id": "#made",
            "@type": "CreateAction",
            "name": "simulation",
            "instrument": {"@id": software},
            "result": {"@id": f"{store}/"},
            "description": versions,
        },
        {
            "@id": software,
            "@type": "SoftwareApplication",
            "name": "feeler",
            "version": find_version("feeler"),
            "citation": {"@id": _PAPER},
        },
    ]


def _describe(name: str, item: xr.Variable) -> dict[str, Any]:
    about = {
        "@id": f"#{name}",
        "@type": "PropertyValue",
        "name": name,
        "description": str(item.attrs.get("long_name", name)),
    }
    return about | ({"unitText": str(item.attrs["units"])} if "units" in item.attrs else {})
