"""Neurodata Without Borders: one TimeSeries per variable and trial; needs the extra ``nwb`` to write."""

import json
import os
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from feeler.errors import InvalidInput, MissingExtra
from feeler.tensors.csvfile import exact_numbers
from feeler.tensors.plain import complete, describe


def save_nwb(dataset: xr.Dataset, path: str | os.PathLike, *, session_start: datetime, identifier: str) -> None:
    """Write a Dataset as NWB: acquisition ``angle_000000`` … of shape (time, …), a table of trials, and the notes.

    Parameters
    ----------
    session_start
        When the recording began, with its time zone; NWB demands it and feeler will not make it up.
    identifier
        A name that no other NWB file of yours has.

    Raises
    ------
    MissingExtra
        pynwb is not installed.
    InvalidInput
        No time zone, or no variable over (trial, time).
    """
    try:
        from pynwb import NWBHDF5IO, NWBFile, TimeSeries
    except ImportError as error:
        raise MissingExtra("NWB files need pynwb: pip install 'feeler[nwb]'.") from error
    if session_start.tzinfo is None or not identifier:
        raise InvalidInput("session_start needs a time zone (datetime(..., tzinfo=UTC)) and identifier a text.")
    dataset = complete(dataset)
    series = [str(name) for name, item in dataset.variables.items() if {"trial", "time"} <= set(item.dims)]
    if not series or "time" not in dataset.coords:
        raise InvalidInput("NWB takes variables over (trial, time) with a coordinate time [ms]; there is none.")
    file = NWBFile(
        session_description=f"feeler: {', '.join(map(str, np.unique(dataset.get('source', xr.DataArray('unknown')))))}",
        identifier=identifier,
        session_start_time=session_start.astimezone(UTC),
        notes=_describe(dataset, series),
        keywords=["tactile", "antenna", "feeler"],
    )
    seconds = dataset.time.values * 1e-3
    for name in series:
        ordered = dataset[name].transpose("trial", "time", ...)
        for index in range(dataset.sizes["trial"]):
            unit = str(ordered.attrs.get("units", "unknown"))
            values, title = ordered.values[index], f"{name}_{index:06d}"
            file.add_acquisition(TimeSeries(name=title, data=values, unit=unit, timestamps=seconds))
    _add_trials(file, dataset, float(seconds[-1]))
    temporary = Path(path).with_name(f".{Path(path).name}.tmp.nwb")
    try:
        with NWBHDF5IO(str(temporary), "w") as io:
            io.write(file)
        os.replace(temporary, path)
    finally:
        temporary.unlink(missing_ok=True)


def _describe(dataset: xr.Dataset, series: list[str]) -> str:
    rest = dataset.drop_vars(series)
    kinds = {name: {"dims": list(dataset[name].dims), "attributes": dict(dataset[name].attrs)} for name in series}
    rest_text = json.loads(describe(rest))
    return json.dumps({"rest": rest_text, "numbers": exact_numbers(rest), "series": kinds}, default=str)


def _add_trials(file: Any, dataset: xr.Dataset, stop: float) -> None:
    labels = {str(name): item for name, item in dataset.variables.items() if item.dims == ("trial",)}
    for name, item in labels.items():
        file.add_trial_column(name=name, description=f"{name} [{item.attrs.get('units', 'as named')}]")
    for index in range(dataset.sizes["trial"]):
        values = {name: item.values[index] for name, item in labels.items()}
        plain = {name: str(value) if isinstance(value, str) else value for name, value in values.items()}
        file.add_trial(start_time=0.0, stop_time=stop, **plain)
