"""Writers: a Dataset as NetCDF, MATLAB, CSV, Parquet or NWB."""

import errno
import io
import json
import math
import os
import re
import shutil
from collections.abc import Iterable
from datetime import UTC, datetime
from typing import Any
from uuid import uuid4

import numpy as np
import pandas as pd
import xarray as xr

from feeler.errors import InvalidInput, escape, require_extra
from feeler.files import NAME, write_text, writing
from feeler.provenance import to_jsonable
from feeler.tensors.readers import DESCRIPTION

# A Dataset as plain arrays and one JSON text: what every format stores, so that each restores
# the same Dataset.

_TYPE = re.compile(r"[<>|=]?(b1|[iu][1248]|f[48])")
REQUIRED = {
    "configuration": "{}",
    "versions": "{}",
    "units": "g, mm, ms, rad",
    "licence": "not stated",
}
"""Attributes that every file carries, with what stands where the producer said nothing."""
_RESERVED = ("coordinates", "feeler_store", DESCRIPTION, "_FillValue")
_UNHELD = re.compile("[\0\ud800-\udfff]")


def complete(dataset: xr.Dataset) -> xr.Dataset:
    """The Dataset with every required attribute, and its texts in memory, as writers need them."""
    texts = {
        name: variable.compute()
        for name, variable in dataset.variables.items()
        if variable.dtype.kind == "O" and variable.chunks
    }
    return dataset.assign(texts).assign_attrs({**REQUIRED, **dataset.attrs})


def describe(dataset: xr.Dataset) -> str:
    """JSON: dims, type, attributes and role of each variable, texts themselves, and the Dataset's
    attributes.
    """
    variables = {}
    for name, variable in dataset.variables.items():
        check_variable(name, variable)
        entry = {
            "dims": list(variable.dims),
            "shape": list(variable.shape),
            "type": variable.dtype.str,
        }
        entry |= {
            "attributes": to_jsonable(dict(variable.attrs)),
            "coordinate": name in dataset.coords,
        }
        if variable.dtype.kind in "UOT":
            entry |= {"type": "str", "texts": [str(text) for text in variable.values.ravel()]}
        variables[name] = entry
    content = {
        "format": 1,
        "variables": variables,
        "attributes": to_jsonable(dict(dataset.attrs)),
    }
    return json.dumps(content, ensure_ascii=True)


def _describe_whole(dataset: xr.Dataset) -> dict[str, Any]:
    """A small Dataset with all its numbers, as plain data."""
    numbers = {
        str(name): to_jsonable(item.values.ravel())
        for name, item in dataset.variables.items()
        if item.dtype.kind not in "UOT"
    }
    return {"rest": json.loads(describe(dataset)), "numbers": numbers}


def check_savable(dataset: xr.Dataset) -> None:
    """Raise where a Dataset holds what would not come back from a file as it is."""
    for name, variable in dataset.variables.items():
        check_variable(name, variable)
    for owner, attributes in [("the Dataset", dataset.attrs)] + [
        (repr(name), item.attrs) for name, item in dataset.variables.items()
    ]:
        for name, value in attributes.items():
            if not isinstance(name, str) or name in _RESERVED or "\0" in name:
                raise InvalidInput(
                    f"{owner} has an attribute {name!r}; names of attributes are texts, other than"
                    f" {', '.join(_RESERVED)}, which files use themselves."
                )
            try:
                text = json.dumps(
                    value, allow_nan=False, ensure_ascii=False, default=_make_plain
                )
                if "\\u0000" in text:
                    raise ValueError("a character NUL")
                text.encode()
            except ValueError as error:
                raise InvalidInput(
                    f"{owner} has an attribute {name!r} that files cannot hold"
                    f" ({str(error)[:80]}); they hold texts, finite numbers, lists and tables."
                ) from error


def _make_plain(value: Any) -> Any:
    """Arrays and NumPy's numbers as Python's, NaN among them; all else as in a configuration."""
    return value.tolist() if hasattr(value, "tolist") else to_jsonable(value)


def check_variable(name: Any, variable: xr.Variable) -> None:
    """Raise where a variable cannot be written to every format."""
    if not (isinstance(name, str) and NAME.fullmatch(name)):
        raise InvalidInput(
            f"a variable's name is letters, digits and _, from a letter, at most 64; got {name!r}."
        )
    if variable.dtype.kind in "UOT":
        for text in variable.values.flat:  # a list would take many times the memory
            if not isinstance(text, str) or _UNHELD.search(text):
                raise InvalidInput(
                    f"variable {name!r} holds {text!r}; files hold numbers or texts, without the"
                    " character NUL and halves of characters."
                )
    if variable.dtype.kind not in "biufUOT" or (
        variable.dtype.kind == "f" and variable.dtype.itemsize not in (4, 8)
    ):
        raise InvalidInput(
            f"variable {name!r} has the type {variable.dtype}; files hold numbers and texts."
        )


def restore(content: dict[str, Any], arrays: dict[str, np.ndarray], source: str) -> xr.Dataset:
    """The Dataset that :func:`describe` described, with its numbers from ``arrays`` (any shape of
    the right size).
    """
    try:
        variables: dict[str, Any] = {}
        coordinates: dict[str, Any] = {}
        for name, entry in content["variables"].items():
            values = _values(name, entry, arrays, source)
            attributes, dims = dict(entry.get("attributes") or {}), entry["dims"]
            good = (
                isinstance(dims, list | tuple)
                and all(isinstance(dim, str) for dim in dims)
                and len(set(dims)) == len(dims)
            )
            if not good:
                raise InvalidInput(
                    f"variable {name!r} has the dims {str(dims)[:80]}; dims are names, each given"
                    " once."
                )
            variable = xr.Variable(tuple(dims), values, attributes)
            (coordinates if entry.get("coordinate") else variables)[name] = variable
        return xr.Dataset(
            variables, coords=coordinates, attrs=dict(content.get("attributes") or {})
        )
    except InvalidInput:
        raise
    except (KeyError, TypeError, ValueError, AttributeError, OverflowError) as error:
        raise InvalidInput(
            f"{source} is damaged: its description does not fit ({str(error)[:150]})."
        ) from error


def _values(
    name: str, entry: dict[str, Any], arrays: dict[str, np.ndarray], source: str
) -> np.ndarray:
    shape = tuple(entry["shape"])
    if entry["type"] == "str":
        return np.array([str(text) for text in entry["texts"]], dtype=str).reshape(shape)
    if not (
        isinstance(entry["type"], str) and _TYPE.fullmatch(entry["type"])
    ):  # np.dtype parses all kinds of texts
        raise InvalidInput(
            f"{source}: variable {name!r} has the type {str(entry['type'])[:40]!r}."
        )
    kind = np.dtype(entry["type"])
    if name not in arrays:
        raise InvalidInput(f"{source} is damaged: variable {name!r} is missing.")
    values = arrays[name]
    if values.size != math.prod(shape):
        raise InvalidInput(
            f"{source} is damaged: variable {name!r} has {values.size} values for the shape"
            f" {shape}."
        )
    with np.errstate(
        invalid="ignore"
    ):  # a damaged file may hold a NaN where whole numbers belong; validation says so
        return values.reshape(shape).astype(kind)


# NetCDF-4 files, as xarray, MATLAB's ncread and Panoply open them.


def save_netcdf(dataset: xr.Dataset, path: str | os.PathLike) -> None:
    """Write a Dataset as NetCDF-4; its attribute ``feeler_description`` restores it exactly."""
    import h5py

    dataset = complete(dataset)
    description = describe(dataset)
    plain = dataset.copy(deep=False)
    plain.attrs = {
        **_attributes(dataset.attrs),
        DESCRIPTION: description,
        "Conventions": "CF-1.8",
    }
    encoding: dict[str, dict[str, Any]] = {}
    for name, variable in plain.variables.items():
        variable.attrs = _attributes(variable.attrs)
        variable.encoding = {}
        encoding[str(name)] = {"_FillValue": None} if variable.dtype.kind == "f" else {}
    with writing(path) as part:
        # HDF5 may crash the process where the room ends while it writes
        if shutil.disk_usage(part.parent).free < dataset.nbytes:
            raise OSError(errno.ENOSPC, "")
        plain.to_netcdf(part, engine="h5netcdf", encoding=encoding)
        with h5py.File(part, "r+") as file:
            for variable in file.values():
                _fix_length(variable)


def _fix_length(variable: Any) -> None:
    """Texts of a variable's attributes as characters of a fixed length, which Octave reads too."""
    import h5py

    for name, value in [pair for pair in variable.attrs.items() if isinstance(pair[1], str)]:
        text = value.encode()
        length = max(len(text), 2)  # one character alone comes back as bytes
        variable.attrs.create(name, text, dtype=h5py.string_dtype("utf-8", length))


def _attributes(attributes: dict[str, Any]) -> dict[str, Any]:
    """NetCDF has texts, numbers and lists of numbers; anything else becomes JSON."""
    found = {}
    for name, value in attributes.items():
        simple = isinstance(value, str | int | float | np.number) and not isinstance(
            value, bool
        )
        simple = simple and not (isinstance(value, int) and value.bit_length() > 63)
        found[name] = value if simple else json.dumps(to_jsonable(value), ensure_ascii=False)
    return found


# MATLAB files, version 5, by SciPy.
#
# In MATLAB each variable has its Dataset's name; ``angle`` is (trial, sensor, time), vectors
# are rows, texts are char matrices with one row per entry, and ``feeler_description`` is JSON
# with dims, units, types and all attributes.

_MAX_VARIABLE = 2**31 - 1  # bytes; the format's own limit


def save_mat(dataset: xr.Dataset, path: str | os.PathLike) -> None:
    """Write a Dataset as a MATLAB version 5 file; its struct ``units`` has each variable's unit."""
    from scipy.io import savemat  # slow to load

    dataset = complete(dataset)
    if taken := {"units", DESCRIPTION} & {*dataset.variables}:
        raise InvalidInput(
            f"a MATLAB file has a {min(map(str, taken))!r} of its own; rename that variable."
        )
    content: dict[str, object] = {}
    for name, variable in dataset.variables.items():
        if variable.nbytes > _MAX_VARIABLE:
            raise InvalidInput(
                f"{name} takes {variable.nbytes:,} bytes; a version 5 file holds 2 GiB. Use NetCDF."
            )
        text = variable.dtype.kind in "UOT"
        content[str(name)] = variable.values.astype(str).ravel() if text else variable.values
    units = {str(name): item.attrs.get("units") for name, item in dataset.variables.items()}
    content |= {"units": {k: v for k, v in units.items() if v}, DESCRIPTION: describe(dataset)}
    buffer = io.BytesIO()
    savemat(buffer, content, format="5", long_field_names=True, oned_as="row")
    with writing(path) as part:
        part.write_bytes(buffer.getvalue())


# One tensor as CSV: notes above, then time and one column per sensor; every number to its last
# digit.

MAGIC = "# feeler tensor"
_COLUMN_UNITS = {"rad": "rad", "1/mm": "per_mm"}


def save_csv(
    dataset: xr.Dataset, path: str | os.PathLike, *, variable: str = "angle", trial: int = 0
) -> None:
    """Write one variable (trial, sensor, time) of one trial.

    Line 1 says what the file is; the notes below it are the trial's labels, one ``# name: value``
    each; then a header row ``time_ms, sensor1_rad, …`` and one row per sample.
    """
    if variable not in dataset or dataset[variable].dims != ("trial", "sensor", "time"):
        valid = [
            str(name)
            for name, item in dataset.items()
            if item.dims == ("trial", "sensor", "time")
        ]
        raise InvalidInput(
            f"no tensor {variable!r} of dims (trial, sensor, time); valid:"
            f" {', '.join(valid) or 'none'}."
        )
    if not 0 <= trial < dataset.sizes["trial"]:
        raise InvalidInput(f"trial must lie in 0 … {dataset.sizes['trial'] - 1}, got {trial}.")
    one = complete(dataset)[[variable]].isel(trial=[trial])
    if "time" not in one.coords:
        raise InvalidInput("the Dataset has no coordinate time [ms].")
    text = io.StringIO()
    text.write(
        f"{MAGIC}\n# variable: {variable}\n# unit: {one[variable].attrs.get('units', '')}\n"
    )
    for name, label in one.coords.items():
        if label.dims == ("trial",):
            words = escape(str(label.values[0])[:200])  # of one line
            text.write(f"# {name}: {words}\n")
    unit = _COLUMN_UNITS.get(str(one[variable].attrs.get("units")), "value")
    columns = [f"sensor{n + 1}_{unit}" for n in range(one.sizes["sensor"])]
    table = pd.DataFrame(one[variable].values[0].T, one.time.values.astype(float), columns)
    text.write(table.to_csv(index_label="time_ms", na_rep="nan", lineterminator="\n"))
    write_text(path, text.getvalue())


# Parquet: one labelled touch a row, as pandas, polars and Hugging Face ``datasets`` read it; needs
# the extra ``parquet``.

_TOUCHES_AT_ONCE = 256  # touches in one group of rows


def save_parquet(dataset: xr.Dataset, path: str | os.PathLike) -> None:
    """Write one touch a row: each variable over trials is a column, ``angle`` a list of sensors of
    lists of samples; labels stand beside it, a coordinate ``split`` (trial,) among them.

    A column ``label`` numbers the objects' names; ``datasets`` reads it as a ``ClassLabel``.
    What has no trials (time, sensors) and all attributes are JSON in the file's metadata.

    Raises
    ------
    MissingDependencyError
        pyarrow is not installed.
    InvalidInput
        The Dataset has no trials.
    """
    require_extra("pyarrow", "parquet", "a Parquet file")
    import pyarrow as pa
    from pyarrow.parquet import ParquetWriter

    if "trial" not in dataset.dims:
        raise InvalidInput("Parquet holds one touch a row; this Dataset has no dim trial.")
    _refuse_empty(dataset, "Parquet", {*dataset.dims} - {"trial"})
    dataset = complete(dataset).transpose("trial", ...)
    names = [name for name, item in dataset.variables.items() if "trial" in item.dims]
    described = json.loads(describe(dataset.isel(trial=slice(0))))["variables"]
    content = _describe_whole(dataset.drop_vars(names))
    content["columns"] = {name: described[name] for name in names}
    own = {DESCRIPTION: json.dumps(content, ensure_ascii=True)}
    notes = {"PANDAS_ATTRS": json.dumps(own)}
    labels: dict[str, np.ndarray] = {}
    if "feature" in names and "label" not in dataset.variables:
        classes, labels["label"] = np.unique(dataset["feature"].values, return_inverse=True)
        feature = {"_type": "ClassLabel", "names": [*map(str, classes)]}
        notes["huggingface"] = json.dumps({"info": {"features": {"label": feature}}})

    def make_rows(start: int) -> Any:
        at = slice(start, start + _TOUCHES_AT_ONCE)
        part = dataset.variables
        found = {name: part[name][at].values for name in names}
        found |= {name: values[at].astype(np.int64) for name, values in labels.items()}
        return pa.table({name: _make_column(values) for name, values in found.items()})

    first = make_rows(0)
    schema = first.schema.with_metadata(notes)
    with writing(path) as file, ParquetWriter(file, schema, compression="zstd") as writer:
        writer.write_table(first)
        for start in range(_TOUCHES_AT_ONCE, dataset.sizes["trial"], _TOUCHES_AT_ONCE):
            writer.write_table(make_rows(start))


def _refuse_empty(dataset: xr.Dataset, form: str, dims: Iterable[Any]) -> None:
    """Raise where one of these dims has no entry, which a format cannot say."""
    if empty := [dim for dim in dims if not dataset.sizes[dim]]:
        raise InvalidInput(
            f"{form} holds no set without any {empty[0]}. Write it as NetCDF (.nc)."
        )


def _make_column(values: np.ndarray) -> Any:
    """Rows of nested lists of one length each."""
    import pyarrow as pa

    if values.dtype.kind in "UOT":
        column = pa.array([str(text) for text in values.ravel()], pa.string())
    else:
        column = pa.array(values.ravel().astype(values.dtype.newbyteorder("=")))
    for size in reversed(values.shape[1:]):
        column = pa.FixedSizeListArray.from_arrays(column, size)
    return column


# Neurodata Without Borders: one TimeSeries per variable on the session's clock; needs the extra
# ``nwb`` to write.

PAUSE = 1.0  # [C] s between one trial and the next on the session's clock
HALF = 0.5e3 * PAUSE  # ms
_OWN_COLUMNS = {"id", "start_time", "stop_time", "tags", "timeseries", "timeseries_index"}
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
    """Write a Dataset as NWB: a series per variable, such as acquisition ``angle`` (time, sensor),
    a table of trials, and the notes; trains of spikes become the table ``units``.

    All trials share the session's clock: trial k starts at k · (its length + 1 s), because a
    Dataset does not hold when it was recorded. A series holds the trials one after the other, each
    sample with its time, so that ``start_time`` and ``stop_time`` of the table cut them out. Where
    all trials together have fewer samples than a series has channels, rows of NaN after the last
    trial make time the longest dim, as NWB asks. nwbinspector finds nothing critical and no
    violation; what it suggests beside is given by the words below.

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
    MissingDependencyError
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
    _refuse_empty(dataset, "NWB", {*dataset.dims})
    labels = {str(name) for name, item in dataset.variables.items() if item.dims == ("trial",)}
    if taken := labels & _OWN_COLUMNS:
        raise InvalidInput(
            f"NWB's table of trials has a column {min(taken)!r} of its own; rename that coordinate."
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
    _add_series(file, dataset, series)
    _add_trials(file, dataset)
    if "spike_time" in dataset:
        _add_units(file, dataset)
    write_nwb(file, path)


def require_pynwb() -> None:
    """MissingDependencyError where the extra ``nwb`` is not whole."""
    for library in ("pynwb", "ndx_pose"):
        require_extra(library, "nwb", "an NWB file")


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
        session_start = parse_time(session_start)
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


def parse_time(text: str) -> datetime:
    """A moment from text by ISO 8601."""
    try:
        return datetime.fromisoformat(text)
    except ValueError:
        raise InvalidInput(
            "the start of an NWB session must be a time such as 2026-01-31T10:00:00+01:00, got"
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
    more = {"series": kinds, "events": dataset.sizes.get("event", 0)}
    return json.dumps(_describe_whole(rest) | more, default=str)


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


def _find_starts(dataset: xr.Dataset) -> np.ndarray:
    """When each trial's first sample is taken (trial,) [s], on the session's clock."""
    first, last = (float(dataset.time[k]) * 1e-3 for k in (0, -1))
    return first + (last - first + PAUSE) * np.arange(dataset.sizes["trial"])


def _add_units(file: Any, dataset: xr.Dataset) -> None:
    """Each unit's spikes of all trials on the session's clock, and what its labels say of it."""
    ordered = dataset["spike_time"].transpose("trial", "unit", "event").values
    seconds = dataset.time.values * 1e-3
    beyond = (ordered <= dataset.time.values[0] - HALF) | (
        ordered >= dataset.time.values[-1] + HALF
    )
    if beyond.any():
        raise InvalidInput(
            f"{beyond.sum()} spikes lie more than {HALF:g} ms outside the recorded time, as that of"
            f" trial {np.argwhere(beyond)[0][0]} at {ordered[beyond][0]:g} ms; on one clock for all"
            " trials they would count as another's. Leave them out (NaN)."
        )
    starts = _find_starts(dataset) - seconds[0]
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
    if file.units is not None:
        file.units.resolution = float(np.spacing(last))  # [s] times are not rounded to samples


def _add_series(file: Any, dataset: xr.Dataset, names: list[str]) -> None:
    """Each variable as one series: the trials one after the other, each sample with its time."""
    from pynwb import TimeSeries

    within = (dataset.time.values - float(dataset.time[0])) * 1e-3
    times = (_find_starts(dataset)[:, None] + within).ravel()
    for name in names:
        ordered = dataset[name].transpose("trial", "time", ...)
        values = ordered.values.reshape(times.size, *ordered.shape[2:])
        short = max((*values.shape[1:], times.size)) - times.size
        step = float(within[-1] / max(len(within) - 1, 1)) or 1e-3
        clock = np.r_[times, times[-1] + step * (1 + np.arange(short))]
        words = f"{name}, {' × '.join(['time', *map(str, ordered.dims[2:])])}; trials in a row"
        if short:
            words += f"; the last {short} samples are empty"
            values = np.concatenate([values, np.full((short, *values.shape[1:]), np.nan)])
        unit = str(ordered.attrs.get("units", "unknown"))
        kept: dict[str, Any] = {"timestamps": clock}
        steps = np.diff(clock)
        if steps.size and np.ptp(steps) <= 1e-6 * steps.mean():  # one trial
            kept = {"starting_time": clock[0], "rate": float(np.round(1 / steps.mean(), 6))}
        file.add_acquisition(
            TimeSeries(name=name, data=values, unit=unit, description=words, **kept)
        )


def _add_trials(file: Any, dataset: xr.Dataset) -> None:
    labels = {
        str(name): item for name, item in dataset.variables.items() if item.dims == ("trial",)
    }
    for name, item in labels.items():
        file.add_trial_column(
            name=name, description=f"{name} [{item.attrs.get('units', 'as named')}]"
        )
    length = float(dataset.time[-1] - dataset.time[0]) * 1e-3
    for index, start in enumerate(_find_starts(dataset)):
        values = {name: item.values[index] for name, item in labels.items()}
        plain = {
            name: str(value) if isinstance(value, str) else value
            for name, value in values.items()
        }
        file.add_trial(start_time=start, stop_time=start + length, **plain)
