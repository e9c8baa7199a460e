"""Tables of numbers that no verb reads as they are: what is in them, and what verbs ask for."""

from pathlib import Path

import numpy as np

from feeler.guard import Limits
from feeler.tensors.formats import Format
from feeler.tensors.heading import find_heading
from feeler.tensors.table import Table, read_table

_MOST = 12  # columns that are listed
_ADVICE = (
    "a robot's recording needs time_ms and hinge1_deg, hinge2_deg …: feeler robot check",
    "tracks need head_x, head_y, left_tip_x, left_tip_y …: feeler tracks",
    "a trace to calibrate with needs time_ms and displacements: feeler calibrate --data",
)


def _is_table(path: Path, start: bytes) -> bool:
    try:
        lines = start.decode("utf-8-sig", "ignore").split("\n")
    except ValueError:
        return False
    heading = None if b"\0" in start else find_heading(enumerate(lines, 1))
    return heading is not None and len(heading.names) > 1 and path.suffix.lower() in _ENDINGS


_ENDINGS = (".csv", ".tsv", ".txt", ".dat", ".asc", ".log", "")


def _load(path: Path, limits: Limits, trusted: bool) -> Table:
    return read_table(path, words=True)


def _describe(table: Table) -> list[str]:
    lines = [f"rows        {len(table.values)}"]
    for name, values in list(zip(table.columns, table.values.T, strict=True))[:_MOST]:
        seen = values[~np.isnan(values)]
        span = f"{seen.min():.4g} … {seen.max():.4g}" if seen.size else "empty"
        if name in table.words:
            span = f"text ({table.words[name][:40]!r} …)"
        lines.append(f"column      {name}: {span}")
    if len(table.columns) > _MOST:
        lines.append(f"            … {len(table.columns)} columns in all")
    return lines + [f"next        {words}" for words in _ADVICE]


PLAIN_TABLES = {
    "table": Format(
        words="a table that no verb of feeler reads as it is",
        kind="table",
        detect=_is_table,
        load=_load,
        tell=_describe,
    ),
}
