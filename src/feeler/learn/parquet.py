"""Parquet in the layout of LeRobot 3.0 and Hugging Face: one row a sample, one episode a touch, and
a data card.
"""

import json
import os
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from feeler.checked import checked
from feeler.errors import InvalidInput, MissingExtra
from feeler.learn.split import check_coordinate
from feeler.tensors.disk import write_atomic
from feeler.tensors.formats import load

BLOCK = 256  # trials read at once
EPISODES = 2048  # [C] touches in one file: 45 MB of 56 sensors and 100 samples
DATA = "data/chunk-{chunk_index:03d}/file-{file_index:03d}.parquet"
META = "meta/episodes/chunk-{chunk_index:03d}/file-{file_index:03d}.parquet"
CHUNK = 1000  # files in one folder, as LeRobot has them


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
    is the data card.

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
    pa, pq = _import_pyarrow()
    tensors = store if isinstance(store, xr.Dataset) else load(store)
    check_coordinate(tensors, task, "task")
    if variable not in tensors or tensors[variable].dims != ("trial", "sensor", "time"):
        raise InvalidInput(
            f"there is no variable {variable!r} (trial, sensor, time) to export; angle is one."
        )
    folder = Path(folder)
    if folder.exists() and any(folder.iterdir()):
        raise InvalidInput(f"{folder} holds something. Choose a new folder.")
    tasks, codes = np.unique(tensors[task].values.astype(str), return_inverse=True)
    sums = _Sums(tensors.sizes["sensor"])
    for number, first in enumerate(range(0, tensors.sizes["trial"], EPISODES)):
        rows = range(first, min(first + EPISODES, tensors.sizes["trial"]))
        place = {"chunk_index": number // CHUNK, "file_index": number % CHUNK}
        _write(
            pq, folder / DATA.format(**place), _make_rows(pa, tensors, variable, rows, codes, sums)
        )
        _write(
            pq,
            folder / META.format(**place),
            iter([_make_episodes(pa, tensors, rows, tasks[codes], place)]),
        )
    _write(
        pq,
        folder / "meta/tasks.parquet",
        iter([pa.table({"task_index": range(len(tasks)), "task": tasks.tolist()})]),
    )
    for file, content in (
        ("info", describe_features(tensors, variable, len(tasks))),
        ("stats", sums.summarise()),
    ):
        write_atomic(folder / f"meta/{file}.json", json.dumps(content, indent=2).encode())
    write_atomic(
        folder / "README.md", write_card(tensors, variable, task, name or folder.name).encode()
    )
    return folder


def _import_pyarrow() -> tuple[Any, Any]:
    try:
        import pyarrow
        import pyarrow.parquet
    except ImportError:
        raise MissingExtra(
            "Parquet needs pyarrow. Install it with: pip install 'feeler[parquet]'"
        ) from None
    return pyarrow, pyarrow.parquet


def _write(pq: Any, path: Path, tables: Iterator[Any]) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    first = next(tables)
    with pq.ParquetWriter(path, first.schema, compression="zstd") as writer:
        writer.write_table(first)
        for table in tables:
            writer.write_table(table)


class _Sums:
    """Least, greatest, mean and sd of each sensor, over all that is written."""

    def __init__(self, n_sensors: int) -> None:
        self.low, self.high = np.full(n_sensors, np.inf), np.full(n_sensors, -np.inf)
        self.sum, self.squares, self.count = np.zeros(n_sensors), np.zeros(n_sensors), 0

    def add(self, rows: np.ndarray) -> None:
        """Rows (sample, sensor)."""
        self.low, self.high = (
            np.minimum(self.low, rows.min(axis=0)),
            np.maximum(self.high, rows.max(axis=0)),
        )
        self.sum, self.squares = (
            self.sum + rows.sum(axis=0),
            self.squares + (rows.astype(float) ** 2).sum(axis=0),
        )
        self.count += len(rows)

    def summarise(self) -> dict[str, Any]:
        """As LeRobot's stats.json."""
        mean = self.sum / self.count
        sd = np.sqrt(np.maximum(self.squares / self.count - mean**2, 0))
        numbers = {"min": self.low, "max": self.high, "mean": mean, "std": sd}
        return {
            "observation.state": (
                {k: v.tolist() for k, v in numbers.items()} | {"count": [self.count]}
            )
        }


def _make_rows(
    pa: Any, tensors: xr.Dataset, variable: str, rows: range, codes: np.ndarray, sums: _Sums
) -> Iterator[Any]:
    n_sensors, n_samples, time = (
        tensors.sizes["sensor"],
        tensors.sizes["time"],
        tensors["time"].values / 1000.0,
    )
    for start in range(rows.start, rows.stop, BLOCK):
        trials = np.arange(start, min(start + BLOCK, rows.stop))
        values = tensors[variable][start : trials[-1] + 1].values.astype(np.float32)
        state = np.ascontiguousarray(values.transpose(0, 2, 1)).reshape(-1, n_sensors)
        sums.add(state)
        yield pa.table(
            {
                "observation.state": pa.FixedSizeListArray.from_arrays(
                    pa.array(state.ravel()), n_sensors
                ),
                "timestamp": np.tile(time, trials.size).astype(np.float32),
                "frame_index": np.tile(np.arange(n_samples), trials.size),
                "episode_index": np.repeat(trials, n_samples),
                "index": np.arange(start * n_samples, (trials[-1] + 1) * n_samples),
                "task_index": np.repeat(codes.reshape(-1)[trials], n_samples),
            }
        )


def _make_episodes(
    pa: Any, tensors: xr.Dataset, rows: range, tasks: np.ndarray, place: dict[str, int]
) -> Any:
    n, n_samples = len(rows), tensors.sizes["time"]
    labels = {
        str(k): v.values[rows.start : rows.stop]
        for k, v in tensors.coords.items()
        if v.dims == ("trial",)
    }
    labels.pop("trial", None)
    return pa.table(
        {
            "episode_index": np.arange(rows.start, rows.stop),
            "tasks": [[task] for task in tasks[rows.start : rows.stop].tolist()],
            "length": np.full(n, n_samples),
            "dataset_from_index": np.arange(rows.start, rows.stop) * n_samples,
            "dataset_to_index": np.arange(rows.start + 1, rows.stop + 1) * n_samples,
            **{f"data/{key}": np.full(n, value) for key, value in place.items()},
            **{
                f"label/{key}": v.tolist() if v.dtype.kind in "UOT" else v
                for key, v in labels.items()
            },
        }
    )


def describe_features(tensors: xr.Dataset, variable: str, n_tasks: int) -> dict[str, Any]:
    """As LeRobot's info.json."""
    n, n_samples, n_sensors = tensors.sizes["trial"], tensors.sizes["time"], tensors.sizes["sensor"]
    interval = float(np.diff(tensors["time"].values[:2])[0]) if n_samples > 1 else 1.0
    whole = {"dtype": "int64", "shape": [1], "names": None}
    names = [f"{variable}_{number}" for number in tensors["segment"].values.tolist()]
    return {
        "codebase_version": "v3.0",
        "robot_type": "antenna",
        "total_episodes": n,
        "total_frames": n * n_samples,
        "total_tasks": n_tasks,
        "chunks_size": CHUNK,
        "fps": 1000.0 / interval,
        "splits": {"train": f"0:{n}"},
        "data_path": DATA,
        "video_path": None,
        "features": {
            "observation.state": {"dtype": "float32", "shape": [n_sensors], "names": names},
            "timestamp": {"dtype": "float32", "shape": [1], "names": None},
            **dict.fromkeys(("frame_index", "episode_index", "index", "task_index"), whole),
        },
        "units": {"observation.state": tensors[variable].attrs.get("units", ""), "timestamp": "s"},
    }


def write_card(tensors: xr.Dataset, variable: str, task: str, name: str) -> str:
    """The data card, as Hugging Face reads it."""
    n = tensors.sizes["trial"]
    size = next((words for most, words in SIZES if n < most), "n>1M")
    rows = "".join(
        _describe_label(str(key), item)
        for key, item in tensors.coords.items()
        if item.dims == ("trial",)
    )
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

{n:,} touches of an insect-like antenna, {tensors.sizes["sensor"]} sensors and {tensors.sizes["time"]} samples each, simulated by
feeler (engine {tensors.attrs.get("engine", "unknown")}). One episode is one touch; `observation.state` is the {variable}
[{tensors[variable].attrs.get("units", "")}] of the sensors from base to tip; the task is the label `{task}`.

Simulated, not measured: what the physics leaves out is listed in feeler's documentation. Touches that differ in nothing but noise
lie on one side of a split only if the split is made by their labels.

| label | values | unit |
|---|---|---|
{rows}
Made with: `{str(tensors.attrs.get("versions", ""))[:400]}`
"""


SIZES = ((1_000, "n<1K"), (10_000, "1K<n<10K"), (100_000, "10K<n<100K"), (1_000_000, "100K<n<1M"))


def _describe_label(name: str, item: xr.DataArray) -> str:
    distinct = np.unique(item.values)
    some = (
        ", ".join(map(str, distinct[:4]))
        if distinct.size <= 4 or distinct.dtype.kind in "UOT"
        else ""
    )
    words = some or f"{distinct[0]:.4g} … {distinct[-1]:.4g}"
    return (
        f"| {name} | {words}{' …' if some and distinct.size > 4 else ''} |"
        f" {item.attrs.get('units', '')} |\n"
    )
