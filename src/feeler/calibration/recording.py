"""Recorded free responses: tip displacement of several animals over time, from a CSV file."""

import csv
from dataclasses import dataclass
from importlib.resources import files
from pathlib import Path
from typing import Annotated

import numpy as np

from feeler.checked import checked
from feeler.errors import InvalidInput
from feeler.response import check_trace
from feeler.tensors.table import parse_table, read_table

TIME_UNITS = {"time_ms": 1.0, "time_s": 1000.0}
EXAMPLE = "synthetic_step"


@checked
@dataclass(frozen=True, kw_only=True, eq=False)
class Traces:
    """Free responses sampled together: ``time`` (sample,) [ms] from release, ``displacement`` (animal, sample)."""

    time: Annotated[np.ndarray, "sample"]
    displacement: Annotated[np.ndarray, "animal sample"]
    names: tuple[str, ...]
    source: str = "recorded"

    def __post_init__(self) -> None:
        for field in ("time", "displacement"):
            object.__setattr__(self, field, np.asarray(getattr(self, field), dtype=float))
        if self.displacement.shape != (len(self.names), self.time.size):
            raise InvalidInput(
                f"Traces need one name per animal and one displacement per sample: got {len(self.names)} names, "
                f"{self.time.size} samples and displacement of shape {self.displacement.shape}."
            )
        for name, row in zip(self.names, self.displacement, strict=True):
            check_trace(self.time, row, f"trace {name!r}")


@checked
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
        table = parse_table(text, source=EXAMPLE)
    elif Path(path).is_file():
        table = read_table(path)
    else:
        raise InvalidInput(f"no such file: {path}. Give a CSV file, or {EXAMPLE!r} for the example.")
    unit = next((name for name in table.columns if name in TIME_UNITS), None)
    if unit is None or len(table.columns) < 2:
        raise InvalidInput(
            f"{path} needs a column {' or '.join(TIME_UNITS)} and one named column per animal; its header is "
            f"{', '.join(table.columns[:12])}."
        )
    time = table.column(unit) * TIME_UNITS[unit]
    names = tuple(name for name in table.columns if name != unit)
    displacement = np.delete(table.values, table.columns.index(unit), axis=1).T
    words = " ".join((str(path), *table.notes.keys(), *table.notes.values())).lower()
    source = "synthetic" if "synthetic" in words else "recorded"
    return Traces(time=time - time[0] if len(time) else time, displacement=displacement, names=names, source=source)


@checked
def save_traces(traces: Traces, path: Path) -> None:
    """Write traces as ``load_traces`` reads them."""
    with Path(path).open("w", encoding="utf-8", newline="") as file:
        if traces.source == "synthetic":
            file.write("# synthetic: simulated free responses with noise, not animal data\n")
        writer = csv.writer(file)
        writer.writerow(["time_ms", *traces.names])
        for time, values in zip(traces.time, traces.displacement.T, strict=True):
            writer.writerow([f"{time:.6g}", *(f"{value:.6g}" for value in values)])
