"""Tables of other programs, each turned into names, positions and times: long tables, Motive,
FicTrac, TRex, idtracker.ai, AnimalTA, Bonsai.
"""

import io
import re
from collections.abc import Sequence
from typing import Any

import numpy as np
import pandas as pd

from feeler.errors import InvalidInput
from feeler.tensors.table import Table, is_numeral, split_line

# Columns of landmarks: NAME and axis, in the ways in which programs write them.

_UNIT = r"(?:\s*\((?P<unit>[^)]*)\))?"
_PATTERNS = (
    re.compile(r"(?P<name>.{1,200}?)[_. :/](?P<axis>[xyz])", re.IGNORECASE),  # head_x, head/X
    re.compile(
        rf"(?P<axis>[xyz])#(?P<name>.{{1,200}}?){_UNIT}", re.IGNORECASE
    ),  # TRex's centroids
    re.compile(r"pose(?P<axis>[XY])(?P<name>\d+)"),  # and its points
    re.compile(r"(?P<axis>[xy])(?P<name>\d+)"),  # idtracker.ai
    re.compile(r"(?P<axis>[XY])_(?P<name>.{1,200})"),  # AnimalTA
    re.compile(rf"(?P<name>)(?P<axis>[xyz]){_UNIT}", re.IGNORECASE),  # one place alone
)
_ALONE = "body"
LENGTHS = {"mm": 1.0, "cm": 10.0, "m": 1e3}


def _find_landmarks(columns: Sequence[str]) -> tuple[dict[tuple[str, str], int], str]:
    """Index of the column of each (landmark, axis), by the first way of writing them that fits at
    least one landmark with x and y, and the unit that it states; without one, what NAME_x fits.

    A centroid of TRex and its points are told by different ways; the points, if any, are taken.
    """
    first: dict[tuple[str, str], int] = {}
    for pattern in (_PATTERNS[0], *_PATTERNS[2:4], _PATTERNS[1], *_PATTERNS[4:]):
        found: dict[tuple[str, str], int] = {}
        unit = ""
        for index, column in enumerate(columns):
            if column.startswith("/"):  # a ROS topic
                continue
            if match := pattern.fullmatch(column):
                found.setdefault((match["name"] or _ALONE, match["axis"].upper()), index)
                unit = unit or (match.groupdict().get("unit") or "")
        names = {name for name, _ in found}
        if any({(name, "X"), (name, "Y")} <= found.keys() for name in names):
            return found, unit
        first = found if pattern is _PATTERNS[0] else first
    return first, ""


def _find_boxes(table: Table) -> tuple[Table, dict[str, str]]:
    """The table with the middles of Bonsai's rectangles (X, Y, Width, Height) in the place of their
    corners, and a note of it.
    """
    columns = list(table.columns)
    values, boxes = table.values.copy(), []
    for index, column in enumerate(columns):
        stem = column[:-2]
        if column.endswith(".X") and {f"{stem}.{one}" for one in ("Y", "Width", "Height")} <= {
            *columns
        }:
            boxes.append(stem)
            for axis, size in (("X", "Width"), ("Y", "Height")):
                place, extent = columns.index(f"{stem}.{axis}"), columns.index(f"{stem}.{size}")
                values[:, place] = values[:, place] + values[:, extent] / 2
            assert columns[index] == column
    if not boxes:
        return table, {}
    found = Table(**vars(table) | {"values": values})
    return found, {"rectangles": f"the middles of {', '.join(boxes)} are taken"}


def _is_export(start: str) -> bool:
    """Whether a text begins as FicTrac's, Motive's or a long table of landmarks does."""
    cells = split_line(start.split("\n", 1)[0], ",")
    if _FICTRAC[0] <= len(cells) <= _FICTRAC[1] and all(map(is_numeral, cells)):
        return True
    words = {cell.lower() for cell in re.split("[,;\t]", start.split("\n", 1)[0])}
    long = {"x", "y"} <= words and bool(words & {*_LONG["landmark"]})
    return start.startswith("Format Version") or long


# Repeated names, and tables without a heading.


def _name_twice(text: str) -> str:
    """The same table whose heading names no column twice, as pandas does it: name, name.1, …"""
    head, _, rest = text.partition("\n")
    delimiter = max(",;\t", key=head.count)
    cells = split_line(head, delimiter)
    plain = not head.lstrip().startswith(("#", "%")) and "" not in cells
    if len(set(cells)) == len(cells) or not plain or any(map(is_numeral, cells)):
        return text
    seen: dict[str, int] = {}
    names = []
    for cell in cells:
        names.append(f"{cell}.{seen[cell]}" if cell in seen else cell)
        seen[cell] = seen.get(cell, 0) + 1
    return f"{delimiter.join(names)}\n{rest}"


_FICTRAC = (23, 26)  # numbers in a line of FicTrac's, whose names stand in its documentation


def _read_fictrac(text: str) -> dict[str, Any] | None:
    """FicTrac's output: the body's path on the ball as a landmark ``body``, and one of a ball's
    radius ahead of it, ``ahead``; None where a text is no such.
    """
    first = split_line(text.split("\n", 1)[0], ",")
    if not (_FICTRAC[0] <= len(first) <= _FICTRAC[1] and all(map(is_numeral, first))):
        return None
    try:
        rows = np.loadtxt(io.StringIO(text), delimiter=",", ndmin=2)
    except ValueError as error:
        raise InvalidInput(f"it begins as FicTrac's output, but {error}.") from None
    heading = rows[:, 16]
    body = rows[:, 14:16]
    ahead = body + np.stack([np.cos(heading), np.sin(heading)], axis=1)
    time = rows[:, 21]
    return {
        "names": ("body", "ahead"),
        "position": np.stack([body, ahead], axis=1),
        "frame": rows[:, 0],
        "time": time if time.size > 1 and np.all(np.diff(time) > 0) else None,
    }


# Long tables: a row for each landmark in each frame.

_LONG = {
    "landmark": ("keypoint", "keypoints", "bodypart", "bodyparts", "node", "landmark", "part"),
    "animal": ("individual", "individuals", "track", "animal", "id"),
    "clock": ("frame", "frame_idx", "time", "time_s", "time_ms"),
    "likelihood": ("confidence", "likelihood", "score"),
}


def _spread_long(text: str, individual: str | None) -> tuple[str, list[str]] | None:
    """A long table as one with a row per frame and columns NAME_x, NAME_y, NAME_likelihood, of one
    animal, and the names of all; None where a text is no long table.

    Raises
    ------
    InvalidInput
        A landmark twice in a frame of one animal.
    """
    head = text.split("\n", 1)[0].lstrip("\ufeff")
    delimiter = max(",;\t", key=head.count)
    cells = split_line(head, delimiter)
    lower = [cell.lower() for cell in cells]
    named = {
        what: cells[lower.index(word)]
        for what, words in _LONG.items()
        if (word := next((one for one in words if one in lower), None))
    }
    if not {"landmark", "clock"} <= named.keys() or not {"x", "y"} <= {*lower}:
        return None
    decimal = "," if delimiter == ";" and re.search(r"\d,\d", text[:4000]) else "."
    table = pd.read_csv(io.StringIO(text), sep=delimiter, decimal=decimal, comment="#")
    table.columns = [str(name).lstrip("\ufeff").strip() for name in table.columns]
    animals = [""]
    if "animal" in named:
        table[named["animal"]] = table[named["animal"]].astype(str)
        animals = list(dict.fromkeys(table[named["animal"]]))
        table = table[table[named["animal"]] == (individual or animals[0])]
    axes = [cells[lower.index(axis)] for axis in "xyz" if axis in lower]
    wanted = axes + ([named["likelihood"]] if "likelihood" in named else [])
    keys = [named["clock"], named["landmark"]]
    twice = table.duplicated(keys)
    if twice.any():
        clock, landmark = table.loc[twice.idxmax(), keys]
        raise InvalidInput(
            f"{landmark} is there twice at {named['clock']} {clock}. Are these several animals?"
            " Give them a column individual."
        )
    order = list(dict.fromkeys(table[named["landmark"]].astype(str)))
    wide = table.pivot(index=named["clock"], columns=named["landmark"], values=wanted)
    ends = {name: axis for name, axis in zip(axes, "xyz", strict=False)}
    ends |= {named["likelihood"]: "likelihood"} if "likelihood" in named else {}
    flat = pd.DataFrame(
        {f"{name}_{ends[one]}": wide[one][name] for name in order for one in wanted}
    )
    return flat.to_csv(index_label=named["clock"]), animals


# Motive.


def _read_motive(text: str) -> dict[str, Any] | None:
    """Motive's CSV of rigid bodies and markers (``Format Version`` in its first cell): places [mm],
    names and frame rate; None where a text is no such.
    """
    if not text.lstrip("\ufeff").startswith("Format Version"):
        return None
    lines = text.lstrip("\ufeff").split("\n")
    first = [cell.strip() for cell in lines[0].split(",")]
    about = dict(zip(first[::2], first[1::2], strict=False))
    start = next((k for k, line in enumerate(lines[:20]) if line.startswith("Frame,")), None)
    if start is None:
        raise InvalidInput("it begins as Motive's export, but has no line Frame,Time.")
    rows = [[cell.strip().strip('"') for cell in line.split(",")] for line in lines[1:start]]
    axes = [cell.strip() for cell in lines[start].split(",")]
    names = next((row for row in rows if "Name" in row[:2]), None)
    kinds = rows[-1] if rows else None
    if names is None or kinds is None or "Position" not in kinds:
        raise InvalidInput("it is Motive's export without a line Name and a column Position.")
    found = {
        (name, axis): k
        for k, (name, kind, axis) in enumerate(zip(names, kinds, axes, strict=False))
        if kind == "Position" and axis in "XYZ" and axis
    }
    marks = list(dict.fromkeys(name for name, _ in found))
    values = pd.read_csv(
        io.StringIO("\n".join(lines[start + 1 :])), header=None, names=range(len(axes))
    ).to_numpy(dtype=float)
    scale = {"Meters": 1e3, "Centimeters": 10.0}.get(about.get("Length Units", "Meters"), 1.0)
    columns = [[found[name, axis] for axis in "XYZ"] for name in marks]
    return {
        "names": tuple(marks),
        "position": scale * values[:, columns],
        "frame": values[:, 0],
        "rate": float(about["Capture Frame Rate"]) if "Capture Frame Rate" in about else None,
    }
