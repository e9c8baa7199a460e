"""One tensor as CSV: notes above, then time and one column per sensor; every number to its last
digit.
"""

import csv
import io
import json
import os
from pathlib import Path

import numpy as np
import xarray as xr

from feeler.errors import InvalidInput
from feeler.limits import MAX_TEXT, Limits, find_limits
from feeler.provenance import make_plain
from feeler.tensors.disk import write_atomic
from feeler.tensors.plain import complete, describe, restore
from feeler.tensors.reading import parse_json, read_bytes

MAGIC = "# feeler tensor"
DESCRIPTION = "# description: "
MAX_CELLS = 4_000_000  # [C] a tensor of 56 sensors and a minute
COLUMN_UNITS = {"rad": "rad", "1/mm": "per_mm"}


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
            str(name) for name, item in dataset.items() if item.dims == ("trial", "sensor", "time")
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
    text.write(f"{MAGIC}\n# variable: {variable}\n# unit: {one[variable].attrs.get('units', '')}\n")
    for name, label in one.coords.items():
        if label.dims == ("trial",):
            text.write(f"# {name}: {str(label.values[0])[:200]!s}\n".replace("\r", " "))
    rest = one.drop_vars([variable, "time"])
    roles = {"variable": variable, "attributes": make_plain(dict(one[variable].attrs))}
    content = {
        "rest": json.loads(describe(rest)),
        "numbers": exact_numbers(rest),
        "time": make_plain(dict(one.time.attrs)),
        **roles,
    }
    text.write(f"{DESCRIPTION}{json.dumps(content, ensure_ascii=True)}\n")
    unit = COLUMN_UNITS.get(str(one[variable].attrs.get("units")), "value")
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(["time_ms", *(f"sensor{n + 1}_{unit}" for n in range(one.sizes["sensor"]))])
    for time, row in zip(one.time.values, one[variable].values[0].T, strict=True):
        writer.writerow([repr(float(time)), *(repr(float(value)) for value in row)])
    write_atomic(Path(path), text.getvalue().encode())


def exact_numbers(dataset: xr.Dataset) -> dict[str, list]:
    """Every number of a Dataset's variables in JSON's types, flat; see :func:`restore_numbers`."""
    numbers = {
        str(name): item for name, item in dataset.variables.items() if item.dtype.kind not in "UOT"
    }
    return {name: make_plain(item.values.ravel()) for name, item in numbers.items()}


def load_csv(path: str | os.PathLike, limits: Limits | None = None) -> xr.Dataset:
    """The Dataset of one trial in a file that :func:`save_csv` wrote; a recording is read by
    feeler.robot instead.
    """
    limits = find_limits(limits)
    return parse_csv(read_bytes(path, MAX_TEXT), Path(path).name, limits)


def parse_csv(raw: bytes, source: str, limits: Limits) -> xr.Dataset:
    """As :func:`load_csv`, from bytes."""
    if (
        raw.count(b",") + raw.count(b"\n") > MAX_CELLS
    ):  # before anything is split: each piece costs ten times its bytes
        raise InvalidInput(
            f"{source} has more than {MAX_CELLS:,} cells. Keep large sets as NetCDF."
        )
    try:
        lines = raw.decode("utf-8-sig").replace("\r\n", "\n").split("\n")
    except UnicodeDecodeError as error:
        raise InvalidInput(f"{source} is not UTF-8 text (byte {error.start}).") from error
    if lines[0].strip() != MAGIC:
        raise InvalidInput(
            f"{source} is no tensor of feeler (line 1 is not {MAGIC!r}). Read recordings with"
            " load_recording."
        )
    notes = [line for line in lines if line.startswith(DESCRIPTION)]
    rows = [
        (number, line)
        for number, line in enumerate(lines, 1)
        if line.strip() and not line.startswith("#")
    ]
    if len(notes) != 1 or len(rows) < 2:
        raise InvalidInput(
            f"{source} is damaged: it needs one line {DESCRIPTION.strip()!r}, a header and samples."
        )
    content = parse_json(
        notes[0][len(DESCRIPTION) :].encode("utf-8", "replace"), f"the description in {source}"
    )
    values = _numbers(rows, source, limits)
    try:
        return _assemble(content, values, source)
    except InvalidInput:
        raise
    except (KeyError, TypeError, ValueError, AttributeError, OverflowError) as error:
        raise InvalidInput(
            f"{source} is damaged: its description does not fit ({str(error)[:100]})."
        ) from error


def _numbers(rows: list[tuple[int, str]], source: str, limits: Limits) -> np.ndarray:
    """(sample, column) numbers below the header."""
    width = rows[0][1].count(",") + 1
    limits.check_bytes(len(rows) * width * 8, source)
    values = np.empty((len(rows) - 1, width))
    for row, (number, line) in enumerate(rows[1:]):
        cells = line.split(",")
        if len(cells) != width:
            raise InvalidInput(
                f"{source} line {number}: {len(cells)} cells where the header has {width}."
            )
        try:
            values[row] = [float(cell) for cell in cells]
        except ValueError as error:
            raise InvalidInput(f"{source} line {number}: {str(error)[:80]}.") from error
    return values


def restore_numbers(numbers: dict[str, list]) -> dict[str, np.ndarray]:
    """Arrays from what :func:`exact_numbers` gave; whole numbers stay whole, since above 2^53 no
    float is exact.
    """
    whole = {name: all(isinstance(x, int) for x in item) for name, item in numbers.items()}
    return {
        name: np.array(item if whole[name] else [float(x) for x in item])
        for name, item in numbers.items()
    }


def _assemble(content: dict, values: np.ndarray, source: str) -> xr.Dataset:
    rest = restore(content["rest"], restore_numbers(content["numbers"]), source)
    tensor = xr.Variable(
        ("trial", "sensor", "time"), values[:, 1:].T[None], dict(content["attributes"])
    )
    time = xr.Variable("time", values[:, 0], dict(content["time"]))
    return rest.assign({str(content["variable"]): tensor}).assign_coords(time=time)
