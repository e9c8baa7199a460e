"""Neurodata Without Borders: one TimeSeries per variable and trial; needs the extra ``nwb`` to
write.
"""

import json
import os
from collections.abc import Callable
from datetime import UTC, datetime
from typing import Any
from uuid import uuid4

import numpy as np
import xarray as xr

from feeler.disk.files import writing
from feeler.errors import InvalidInput, MissingExtra
from feeler.tensors.plain import complete, describe_whole

PAUSE = 1.0  # [C] s between one trial and the next on the session's clock
_UNIDENTIFIED = (  # NCBI's taxon "unidentified": a model has no species
    "http://purl.obolibrary.org/obo/NCBITaxon_32644"
)
_SEXES = ("M", "F", "U", "O")


def save_nwb(
    dataset: xr.Dataset,
    path: str | os.PathLike,
    *,
    session_start: datetime | str | None = None,
    identifier: str = "",
    subject: str = "",
    species: str = "",
    sex: str = "U",
    age: str = "",
    experimenter: str = "",
    institution: str = "",
) -> None:
    """Write a Dataset as NWB: acquisition ``angle_000000`` … of shape (time, …), a table of trials,
    and the notes; trains of spikes become the table ``units``.

    All trials share the session's clock: trial k starts at k · (its length + 1 s), because a
    Dataset does not hold when it was recorded, and points at its series. nwbinspector finds nothing
    critical and no violation; what it suggests beside is given by the words below.

    Parameters
    ----------
    session_start
        When the recording began, with its time zone, as a datetime or as text
        (``2026-01-31T10:00:00+01:00``). A simulation has no such time: without one it gets the
        moment of writing; for recordings feeler will not make it up.
    identifier
        A name that no other NWB file of yours has; default of a simulation: a random one.
    subject, species, sex, age
        Who was recorded: an id, a Latin name such as ``Periplaneta americana``, M, F, U or O, and
        an age such as ``P90D``. Without them the subject is the antenna's name, of unknown sex and
        age (``P0D/``) and NCBI's taxon "unidentified": a model is no animal.
    experimenter, institution
        As ``Family, Given``, and a name; left out where empty.

    Raises
    ------
    MissingExtra
        pynwb is not installed.
    InvalidInput
        No time zone, or no variable over (trial, time).
    """
    require_pynwb()
    dataset = complete(dataset)
    series = [
        str(name)
        for name, item in dataset.variables.items()
        if {"trial", "time"} <= set(item.dims)
    ]
    if not series or "time" not in dataset.coords:
        raise InvalidInput(
            "NWB takes variables over (trial, time) with a coordinate time [ms]; there is none."
        )
    antennas = (
        np.unique(np.atleast_1d(dataset["antenna"].values)).tolist()
        if "antenna" in dataset.variables
        else []
    )
    if np.all(dataset.get("source", xr.DataArray("unknown")) == "simulation"):
        session_start = session_start or datetime.now(UTC)
        identifier = identifier or str(uuid4())
    file = make_nwb(
        identifier,
        session_start,
        words=(
            "feeler:"
            f" {', '.join(map(str, np.unique(dataset.get('source', xr.DataArray('unknown')))))}"
        ),
        about=(
            f"{dataset.sizes['trial']} touches of a tactile sensor; units and set-up are in the"
            " notes."
        ),
        subject=make_subject(
            subject, species, sex, age, device=", ".join(map(str, antennas)).replace("/", "_")
        ),
        notes=_describe(dataset, series),
        experimenter=experimenter or None,
        institution=institution or None,
    )
    _add_trials(file, dataset, _add_series(file, dataset, series))
    if "spike_time" in dataset:
        _add_units(file, dataset)
    write_nwb(file, path)


def require_pynwb() -> None:
    """MissingExtra where the extra ``nwb`` is not whole."""
    try:
        import ndx_pose  # noqa: F401
        import pynwb  # noqa: F401
    except ImportError as error:
        raise MissingExtra(
            "NWB files need pynwb and ndx-pose: pip install 'feeler[nwb]'."
        ) from error


def make_nwb(
    identifier: str,
    session_start: datetime | str | None,
    *,
    words: str,
    about: str,
    subject: Any,
    **more: str | None,
) -> Any:
    """An NWB file in memory, with what nwbinspector asks of every one."""
    from pynwb import NWBFile

    if isinstance(session_start, str):
        session_start = _parse_time(session_start)
    if session_start is None or session_start.tzinfo is None or not identifier:
        raise InvalidInput(
            "NWB files of recordings need session_start=, a time with its zone such as"
            " '2026-01-31T10:00:00+01:00', and identifier=, a text that no other file has; got"
            f" {session_start} and {identifier!r}."
        )
    return NWBFile(
        session_description=words,
        identifier=identifier,
        session_start_time=session_start.astimezone(UTC),
        experiment_description=about,
        subject=subject,
        **more,
    )


def _parse_time(text: str) -> datetime:
    """A moment from text by ISO 8601."""
    try:
        return datetime.fromisoformat(text)
    except ValueError:
        raise InvalidInput(
            "the start of a session must be a time such as 2026-01-31T10:00:00+01:00, got"
            f" {text!r}."
        ) from None


def write_nwb(file: Any, path: str | os.PathLike) -> None:
    """Write it whole or not at all."""
    from pynwb import NWBHDF5IO

    with writing(path) as part, NWBHDF5IO(str(part), "w") as io:
        io.write(file)


def _describe(dataset: xr.Dataset, series: list[str]) -> str:
    rest = dataset.drop_vars([*series, "spike_time"], errors="ignore")
    kinds = {
        name: {"dims": list(dataset[name].dims), "attributes": dict(dataset[name].attrs)}
        for name in series
    }
    return json.dumps(describe_whole(rest) | {"series": kinds}, default=str)


def make_subject(
    subject: str, species: str = "", sex: str = "U", age: str = "", device: str = ""
) -> Any:
    """Who or what was recorded: an animal where ``subject`` names one, else a model or device, if
    it has a name.
    """
    from pynwb.file import Subject

    if sex not in _SEXES:
        raise InvalidInput(f"sex must be one of {', '.join(_SEXES)}, got {sex!r}.")
    return Subject(
        subject_id=subject or device or "unknown",
        species=species or _UNIDENTIFIED,
        sex=sex,
        age=age or "P0D/",
        description=(
            "given by the user"
            if subject
            else "a model or a device named as the antenna; no animal is stated"
        ),
    )


def _make_clock(dataset: xr.Dataset) -> Callable[[int], dict[str, Any]]:
    """Trial → its place on the session's clock [s]: start and rate where samples are even."""
    seconds = dataset.time.values * 1e-3
    length = float(seconds[-1] - seconds[0]) + PAUSE
    step = np.diff(seconds)
    if seconds.size > 1 and np.ptp(step) <= 1e-6 * step.mean():
        rate = float(np.round(1 / step.mean(), 6))
        return lambda k: {"starting_time": float(seconds[0]) + k * length, "rate": rate}
    return lambda k: {"timestamps": seconds + k * length}


def _add_units(file: Any, dataset: xr.Dataset) -> None:
    """Each unit's spikes of all trials on the session's clock, and what its labels say of it."""
    ordered = dataset["spike_time"].transpose("trial", "unit", "event").values
    seconds = dataset.time.values * 1e-3
    starts = (float(seconds[-1] - seconds[0]) + PAUSE) * np.arange(len(ordered))
    labels = {
        str(name): item
        for name, item in dataset.coords.items()
        if item.dims == ("unit",) and name != "unit"
    }
    for name, item in labels.items():
        file.add_unit_column(name, f"{name} [{item.attrs.get('units', 'as named')}]")
    file.add_unit_column("unit_name", "what the unit is called")
    names = dataset["unit"].values if "unit" in dataset.coords else range(ordered.shape[1])
    last = float(starts[-1] + seconds[-1])
    for number, name in enumerate(names):
        own = ordered[:, number] * 1e-3 + starts[:, None]
        values = {key: item.values[number] for key, item in labels.items()}
        file.add_unit(
            spike_times=np.sort(own[np.isfinite(own)]),
            obs_intervals=[[float(seconds[0]), last]],
            unit_name=str(name),
            **values,
        )


def _add_series(file: Any, dataset: xr.Dataset, names: list[str]) -> list[list[Any]]:
    """Each variable of each trial as a series of its own; the series of each trial."""
    from pynwb import TimeSeries

    clock = _make_clock(dataset)
    held: list[list[Any]] = [[] for _ in range(dataset.sizes["trial"])]
    for name in names:
        ordered = dataset[name].transpose("trial", "time", ...)
        unit = str(ordered.attrs.get("units", "unknown"))
        for index, series in enumerate(held):
            values, title = ordered.values[index], f"{name}_{index:06d}"
            words = (
                f"{name} of trial {index}, {' × '.join(['time', *map(str, ordered.dims[2:])])}"
            )
            series.append(
                TimeSeries(
                    name=title, data=values, unit=unit, description=words, **clock(index)
                )
            )
            file.add_acquisition(series[-1])
    return held


def _add_trials(file: Any, dataset: xr.Dataset, held: list[list[Any]]) -> None:
    labels = {
        str(name): item for name, item in dataset.variables.items() if item.dims == ("trial",)
    }
    for name, item in labels.items():
        file.add_trial_column(
            name=name, description=f"{name} [{item.attrs.get('units', 'as named')}]"
        )
    for index in range(dataset.sizes["trial"]):
        values = {name: item.values[index] for name, item in labels.items()}
        plain = {
            name: str(value) if isinstance(value, str) else value
            for name, value in values.items()
        }
        series = held[index]
        start = series[0].starting_time if series[0].rate else float(series[0].timestamps[0])
        stop = start + float(dataset.time[-1] - dataset.time[0]) * 1e-3
        file.add_trial(start_time=start, stop_time=stop, timeseries=series, **plain)
