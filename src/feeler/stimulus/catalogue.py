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

import os
from pathlib import Path
from typing import Any

from feeler.disk.toml import read_toml
from feeler.errors import InvalidInput
from feeler.records.checked import checked
from feeler.stimulus.feature import SHAPES, Feature, make_feature

_MAX_OBJECTS = 1000  # [C]


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
    if [*content] != ["object"] or not isinstance(entries, list) or len(entries) > _MAX_OBJECTS:
        raise InvalidInput(
            f"{source.name} must hold 1 to {_MAX_OBJECTS} tables [[object]] and nothing else; it"
            f" has {', '.join(map(str, list(content)[:5])) or 'nothing'}."
        )
    objects: list[Feature] = []
    for number, entry in enumerate(entries, 1):
        try:
            made = _make(entry, source.parent)
        except InvalidInput as error:
            raise InvalidInput(f"{source.name}, object {number}: {error}") from error
        if made.name in [one.name for one in objects]:
            raise InvalidInput(
                f"{source.name}: two objects are called {made.name!r}. Give each its own name."
            )
        objects.append(made)
    return objects


def _make(entry: Any, folder: Path) -> Feature:
    if not isinstance(entry, dict) or "shape" not in entry:
        raise InvalidInput(f"needs a shape; valid: {', '.join(SHAPES)}.")
    values = {name: value for name, value in entry.items() if name != "shape"}
    if "file" in values:
        values["file"] = str(folder / str(values["file"]))
    return make_feature(entry["shape"], **values)
