"""Recorded free responses: tip displacement of several animals over time, from a CSV file."""

import csv
from dataclasses import dataclass
from importlib.resources import files
from pathlib import Path

import numpy as np

from feeler.errors import InvalidInput
from feeler.response import check_trace

TIME_UNITS = {"time_ms": 1.0, "time_s": 1000.0}
EXAMPLE = "synthetic_step"


@dataclass(frozen=True, kw_only=True, eq=False)
class Traces:
    """Free responses sampled together: ``time`` (sample,) [ms] from release, ``displacement`` (animal, sample)."""

    time: np.ndarray
    displacement: np.ndarray
    names: tuple[str, ...]
    source: str = "recorded"

    def __post_init__(self) -> None:
        for name, row in zip(self.names, self.displacement, strict=True):
            check_trace(self.time, row, f"trace {name!r}")


def load_traces(path: str | Path) -> Traces:
    """Traces from a CSV table: a column ``time_ms`` or ``time_s``, and a named column of tip displacement per animal.

    The first sample is the release; displacement is from rest, in any unit (only its shape is used). Lines
    that begin with ``#`` are comments. ``synthetic_step`` names the example that ships with feeler: simulated, noisy.

    Raises
    ------
    InvalidInput
        A missing time column, text among the numbers, no trace, or a trace that cannot be measured (gaps, uneven time).
    """
    if path == EXAMPLE:
        text = (files("feeler.calibration") / "data" / f"{EXAMPLE}.csv").read_text(encoding="utf-8")
    elif Path(path).is_file():
        text = Path(path).read_text(encoding="utf-8-sig")
    else:
        raise InvalidInput(f"no such file: {path}. Give a CSV file, or {EXAMPLE!r} for the example.")
    lines = [line for line in text.splitlines() if line.strip() and not line.startswith("#")]
    rows = list(csv.reader(lines))
    header = [cell.strip() for cell in rows[0]] if rows else []
    unit = next((name for name in header if name in TIME_UNITS), None)
    if unit is None or len(header) < 2:
        raise InvalidInput(
            f"{path} needs a column {' or '.join(TIME_UNITS)} and one named column per animal; its header is {header}."
        )
    table = _read_numbers(path, header, rows[1:])
    column = header.index(unit)
    time = table[:, column] * TIME_UNITS[unit]
    names = tuple(name for name in header if name != unit)
    source = "synthetic" if "synthetic" in str(path) or "synthetic" in text[:200].lower() else "recorded"
    displacement = np.delete(table, column, axis=1).T
    return Traces(time=time - time[0] if len(time) else time, displacement=displacement, names=names, source=source)


def _read_numbers(path: object, header: list[str], rows: list[list[str]]) -> np.ndarray:
    table = np.full((len(rows), len(header)), np.nan)
    for i, row in enumerate(rows):
        if len(row) != len(header):
            raise InvalidInput(f"{path}: row {i + 1} has {len(row)} cells, the header {len(header)}.")
        for j, cell in enumerate(row):
            if cell.strip():
                try:
                    table[i, j] = float(cell)
                except ValueError:
                    raise InvalidInput(f"{path}: {cell!r} in row {i + 1}, column {header[j]!r} is no number.") from None
    return table


def save_traces(traces: Traces, path: Path) -> None:
    """Write traces as ``load_traces`` reads them."""
    with Path(path).open("w", encoding="utf-8", newline="") as file:
        if traces.source == "synthetic":
            file.write("# synthetic: simulated free responses with noise, not animal data\n")
        writer = csv.writer(file)
        writer.writerow(["time_ms", *traces.names])
        for time, values in zip(traces.time, traces.displacement.T, strict=True):
            writer.writerow([f"{time:.6g}", *(f"{value:.6g}" for value in values)])
