"""One tensor as CSV: notes above, then time and one column per sensor; every number to its last
digit.
"""

import csv
import io
import json
import os
from pathlib import Path

import xarray as xr

from feeler.disk.files import parse_json, read_text
from feeler.disk.guard import MAX_TEXT, Limits, find_limits
from feeler.disk.provenance import make_plain
from feeler.errors import InvalidInput
from feeler.tensors.disk import write_atomic
from feeler.tensors.plain import complete, describe_whole, restore_whole
from feeler.tensors.table import parse_table

MAGIC = "# feeler tensor"
_DESCRIPTION = "# description: "
_MAX_CELLS = 4_000_000  # [C] a tensor of 56 sensors and a minute
_COLUMN_UNITS = {"rad": "rad", "1/mm": "per_mm"}


def save_csv(
    dataset: xr.Dataset, path: str | os.PathLike, *, variable: str = "angle", trial: int = 0
) -> None:
    """Write one variable (trial, sensor, time) of one trial.

    Line 1 says what the file is; the notes below it are the trial's labels, one ``# name: value``
    each, and one line of JSON that restores the Dataset; then a header row ``time_ms, sensor1_rad,
    …`` and one row per sample.
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
            text.write(f"# {name}: {str(label.values[0])[:200]!s}\n".replace("\r", " "))
    rest = one.drop_vars([variable, "time"])
    roles = {"variable": variable, "attributes": make_plain(dict(one[variable].attrs))}
    content = describe_whole(rest) | {"time": make_plain(dict(one.time.attrs)), **roles}
    text.write(f"{_DESCRIPTION}{json.dumps(content, ensure_ascii=True)}\n")
    unit = _COLUMN_UNITS.get(str(one[variable].attrs.get("units")), "value")
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(["time_ms", *(f"sensor{n + 1}_{unit}" for n in range(one.sizes["sensor"]))])
    for time, row in zip(one.time.values, one[variable].values[0].T, strict=True):
        writer.writerow([repr(float(time)), *(repr(float(value)) for value in row)])
    write_atomic(Path(path), text.getvalue().encode())


def load_csv(path: str | os.PathLike, limits: Limits | None = None) -> xr.Dataset:
    """The Dataset of one trial in a file that :func:`save_csv` wrote; a recording is read by
    feeler.robot instead.
    """
    text, source = read_text(path, MAX_TEXT), Path(path).name
    # before anything is split: each piece costs ten times its bytes
    if text.count(",") + text.count("\n") > _MAX_CELLS:
        raise InvalidInput(
            f"{source} has more than {_MAX_CELLS:,} cells. Keep large sets as NetCDF."
        )
    find_limits(limits).check_bytes(text.count(",") * 8, source)
    start, _, rest = text.partition("\n")
    if start.strip() != MAGIC:
        raise InvalidInput(
            f"{source} is no tensor of feeler (line 1 is not {MAGIC!r}). Read recordings with"
            " load_recording."
        )
    notes = [line for line in rest.split("\n") if line.startswith(_DESCRIPTION)]
    if len(notes) != 1:
        raise InvalidInput(f"{source} is damaged: it needs one line {_DESCRIPTION.strip()!r}.")
    content = parse_json(
        notes[0][len(_DESCRIPTION) :].encode("utf-8", "replace"), f"the description in {source}"
    )
    values = parse_table(text, source=source, max_cells=_MAX_CELLS).values
    if not len(values):
        raise InvalidInput(f"{source} is damaged: it holds no samples.")
    try:
        tensor = (
            ("trial", "sensor", "time"),
            values[:, 1:].T[None],
            dict(content["attributes"]),
        )
        time = xr.Variable("time", values[:, 0], dict(content["time"]))
        whole = restore_whole(content, source)
        return whole.assign({str(content["variable"]): tensor}).assign_coords(time=time)
    except InvalidInput:
        raise
    except (KeyError, TypeError, ValueError, AttributeError, OverflowError) as error:
        raise InvalidInput(
            f"{source} is damaged: its description does not fit ({str(error)[:100]})."
        ) from error
