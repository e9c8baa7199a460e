"""Object files: the things that are to be told apart, as TOML.

[[object]]
name = "bolt"
shape = "ball"              # ball, box, triangle, outline, or any shape that was registered
radius = 3.0                # mm, and so on: the shape's own fields

[[object]]
name = "leaf"
shape = "outline"
file = "leaf.svg"           # beside this file; or vertices = [[0, -2], [0, 2], [-3, 0]] in mm
width = 8.0
"""

import inspect
import os
from pathlib import Path
from typing import Any

from feeler.checked import checked
from feeler.errors import InvalidInput
from feeler.stimulus.feature import SHAPES, Feature, make_feature
from feeler.toml import read_toml

MAX_OBJECTS = 1000  # [C]


@checked
def load_objects(path: str | os.PathLike) -> list[Feature]:
    """The features in a TOML file, each under a name of its own.

    Raises
    ------
    InvalidInput
        No such file, not TOML, no object, an unknown shape or field, or two objects of one name.
    """
    source = Path(path)
    content = read_toml(path)
    entries = content.get("object")
    if (
        set(content) != {"object"}
        or not isinstance(entries, list)
        or not 1 <= len(entries) <= MAX_OBJECTS
    ):
        raise InvalidInput(
            f"{source.name} must hold 1 to {MAX_OBJECTS} tables [[object]] and nothing else; it has"
            f" {', '.join(map(str, list(content)[:5])) or 'nothing'}."
        )
    objects = [_make(entry, number, source) for number, entry in enumerate(entries, 1)]
    names = [feature.name for feature in objects]
    if double := sorted({name for name in names if names.count(name) > 1}):
        raise InvalidInput(
            f"{source.name}: two objects are called {double[0]!r}. Give each its own name."
        )
    return objects


def _make(entry: Any, number: int, source: Path) -> Feature:
    where = f"{source.name}, object {number}"
    if not isinstance(entry, dict) or "shape" not in entry:
        raise InvalidInput(f"{where}: needs a shape; valid: {', '.join(SHAPES)}.")
    values = {name: value for name, value in entry.items() if name != "shape"}
    try:
        if "file" not in values:
            return make_feature(entry["shape"], **values)
        return _read_drawing(entry["shape"], values, source.parent)
    except InvalidInput as error:
        raise InvalidInput(f"{where}: {error}") from error


def _read_drawing(shape: str, values: dict[str, Any], folder: Path) -> Feature:
    reader = getattr(SHAPES[shape], "from_file", None)
    if reader is None:
        raise InvalidInput(
            f"a {shape} is not read from a drawing; leave out file, or make it an outline."
        )
    known = set(inspect.signature(reader).parameters) - {"path"}
    if unknown := sorted(values.keys() - {"file", *known}):
        raise InvalidInput(
            f"a drawing has no {unknown[0]!r}; valid: file, {', '.join(sorted(known))}."
        )
    return reader(folder / str(values.pop("file")), **values)
