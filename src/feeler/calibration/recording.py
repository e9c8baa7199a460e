"""Recorded free responses: tip displacement of several animals over time, from a CSV file."""

from importlib.resources import files
from pathlib import Path
from typing import Annotated

import numpy as np

from feeler.calibration.trace import find_release, find_rest
from feeler.errors import InvalidInput
from feeler.records.checked import checked
from feeler.records.record import ALLOW_NAN, OneOf, Record
from feeler.response import check_trace
from feeler.tensors.table import Table, parse_table, read_table

_TIME_UNITS = {"time_ms": 1.0, "time_s": 1000.0}
_EXAMPLE = "synthetic_step"


class Traces(Record):
    """Free responses that were sampled together.

    A trace's name is its animal's, for the tip; ``animal@0.5`` is another point, at that fraction
    of the length.

    Attributes
    ----------
    time : np.ndarray
        (sample,) since the release [ms].
    displacement : np.ndarray
        (trace, sample), in any unit.
    found : bool
        Whether the release was found in the traces, and is thus known to a few samples only.
    """

    time: Annotated[np.ndarray, "sample", ALLOW_NAN]
    displacement: Annotated[np.ndarray, "trace sample", ALLOW_NAN]
    names: tuple[str, ...]
    source: str = "recorded"
    found: bool = False

    def _check(self) -> None:
        if self.displacement.shape != (len(self.names), self.time.size):
            raise InvalidInput(
                "Traces need one name per animal and one displacement per sample: got"
                f" {len(self.names)} names, {self.time.size} samples and displacement of shape"
                f" {self.displacement.shape}."
            )
        if len(set(self.names)) < len(self.names):
            raise InvalidInput(f"Traces need names that differ, got {', '.join(self.names)}.")
        for name, row in zip(self.names, self.displacement, strict=True):
            check_trace(self.time, row, f"trace {name!r}")
            get_place(name)

    @property
    def animals(self) -> tuple[str, ...]:
        """Who was recorded, in order."""
        return tuple(dict.fromkeys(name.partition("@")[0] for name in self.names))

    def take(self, animal: str) -> tuple[np.ndarray, np.ndarray]:
        """Places (point,), rising, and displacements (point, sample) of one animal."""
        rows = [k for k, name in enumerate(self.names) if name.partition("@")[0] == animal]
        places = np.array([get_place(self.names[k]) for k in rows])
        order = np.argsort(places)
        return places[order], self.displacement[rows][order]


def get_place(name: str) -> float:
    """The fraction of the length that a trace's name says; 1, the tip, where it says none."""
    _, at, text = name.partition("@")
    try:
        place = float(text) if at else 1.0
    except ValueError:
        place = float("nan")
    if not 0 < place <= 1:
        raise InvalidInput(
            f"trace {name!r}: what follows @ is a fraction of the length, > 0 and ≤ 1, as in a@0.5."
        )
    return place


@checked
def load_traces(
    path: str | Path,
    *,
    frame_rate: Annotated[float, "> 0"] | None = None,
    release: Annotated[str, OneOf(("first", "found"))] = "first",
) -> Traces:
    """Traces from a CSV table: a column of time or frames, and a named column per animal.

    Time is ``time_ms``, ``time_s`` or ``frame``; the other columns are displacements.

    A column is the tip's, or ``animal@0.5`` a point's at half of the length; any unit serves, as
    only shapes are used. Lines that begin with ``#`` are comments. ``synthetic_step`` names the
    example that ships with feeler: simulated, noisy.

    Parameters
    ----------
    frame_rate
        Frames per second, for a column ``frame``.
    release
        ``first``: the first sample is the release and displacement is from rest. ``found``: traces
        begin while held and end at rest; release and rest are found in each animal's outermost
        point (:func:`find_release`).

    Raises
    ------
    InvalidInput
        A missing time column, text among the numbers, no trace, a trace that cannot be measured
        (gaps, uneven time), or no release where one is to be found.
    """
    if path == _EXAMPLE:
        text = (files("feeler.calibration") / "data" / f"{_EXAMPLE}.csv").read_text(
            encoding="utf-8"
        )
        table = parse_table(text, source=_EXAMPLE)
    elif Path(path).is_file():
        table = read_table(path)
    else:
        raise InvalidInput(
            f"no such file: {path}. Give a CSV file, or {_EXAMPLE!r} for the example."
        )
    time, column = _read_time(table, frame_rate)
    names = tuple(name for name in table.columns if name != column)
    displacement = np.delete(table.values, table.columns.index(column), axis=1).T
    words = " ".join((str(path), *table.notes.keys(), *table.notes.values())).lower()
    traces = Traces(
        time=time - time[0] if len(time) else time,
        displacement=displacement,
        names=names,
        source="synthetic" if "synthetic" in words else "recorded",
    )
    return traces if release == "first" else _cut_at_release(traces)


def _read_time(table: Table, frame_rate: float | None) -> tuple[np.ndarray, str]:
    """Time [ms] of each row, and the column it came from."""
    known = (*_TIME_UNITS, "frame")
    column = next((name for name in table.columns if name in known), None)
    if column is None or len(table.columns) < 2:
        raise InvalidInput(
            f"{table.source} needs a column {' or '.join(known)} and one named column per animal;"
            f" its header is {', '.join(table.columns[:12])}."
        )
    if (column == "frame") != (frame_rate is not None):
        raise InvalidInput(
            f"{table.source} counts frames: say how many per second (frame_rate=)."
            if column == "frame"
            else (
                f"{table.source} holds times ({column}); a frame rate is for a column called frame."
            )
        )
    if frame_rate is None:
        return table.column(column) * _TIME_UNITS[column], column
    return table.column(column) * (1000.0 / frame_rate), column


@checked
def _cut_at_release(traces: Traces) -> Traces:
    """Traces from rest, each animal's cut at its own release (:func:`find_release`).

    All are as long as the shortest.
    """
    parts: dict[str, np.ndarray] = {}
    for animal in traces.animals:
        points = [name for name in traces.names if name.partition("@")[0] == animal]
        rows = {name: traces.displacement[traces.names.index(name)] for name in points}
        outermost = max(points, key=get_place)
        first, _ = find_release(rows[outermost], f"trace {outermost!r}")
        parts |= {name: row[first:] - find_rest(row) for name, row in rows.items()}
    count = min(map(len, parts.values()))
    together = np.array([parts[name][:count] for name in traces.names])
    return traces.replace(time=traces.time[:count], displacement=together, found=True)
