"""The folder of a store: made, swept of what a killed process left, and looked through for what is
whole and fits.
"""

import json
import os
import warnings
from pathlib import Path
from typing import Any

from feeler.errors import InvalidInput, StoreError
from feeler.tensors.disk import TEMPORARY, sync_folder
from feeler.tensors.records import (
    PROGRESS,
    GroupRecord,
    Label,
    check_shards,
    find_groups,
    read_record,
    record_path,
)

_MAX_DIFFERENCES = 5
_ORIGIN = (
    "versions",
    "code",
)  # entries of a configuration that say which program made the numbers


def find_intact(path: Path, label: Label) -> dict[int, GroupRecord]:
    """Records of groups that can be read; a damaged group is announced and its record removed: it
    is computed again.
    """
    records = {}
    for group in find_groups(path):
        try:
            records[group] = read_record(path, group, label)
            check_shards(path, records[group], label)
        except InvalidInput as error:
            records.pop(group, None)
            first, last = (
                group * label.group,
                min((group + 1) * label.group, label.n_trials) - 1,
            )
            warnings.warn(
                f"trials {first} to {last} will be computed again: {error}", stacklevel=6
            )
            record_path(path, group).unlink()
    return records


def make_folder(path: Path) -> None:
    """Make a store's folder; refuse one that holds something else."""
    if path.exists() and not path.is_dir():
        raise StoreError(f"{path} is a file; a store is a folder. Choose another name.")
    if path.exists() and not (path / PROGRESS).is_dir():
        foreign = [entry.name for entry in _list_folder(path) if not _is_temporary(entry.name)]
        if foreign:
            raise StoreError(
                f"{path} exists and is no store (it holds {foreign[0]!r}). Choose an empty or new"
                " folder."
            )
    (path / PROGRESS).mkdir(parents=True, exist_ok=True)
    sync_folder(path)
    sync_folder(path.absolute().parent)


def sweep(path: Path) -> None:
    """Refuse links anywhere in the store, and remove what a killed process left half written."""
    for folder in (path, *(Path(entry.path) for entry in _list_folder(path) if entry.is_dir())):
        for entry in _list_folder(folder):
            if _is_temporary(entry.name) and entry.is_file():
                os.unlink(entry.path)


def _is_temporary(name: str) -> bool:
    return name.startswith(".") and name.endswith(TEMPORARY)


def check_configuration(path: Path, stored: Label, asked: Label) -> None:
    """Raise where a store was begun with another configuration, or by other code."""
    differences = find_differences(stored.configuration, asked.configuration)
    if stored.n_trials > asked.n_trials:
        differences.insert(0, f"number of trials: {stored.n_trials} → {asked.n_trials}")
    if differences and all(words.startswith(_ORIGIN) for words in differences):
        raise StoreError(
            f"the store {path} was made by other code (stored → now): {'; '.join(differences)}. Old"
            " and new trials might not fit together. Finish it with the code that began it, or use"
            " a new store; feeler.load reads it."
        )
    if differences:
        raise differ(path, differences)


def differ(path: Path, differences: list[str]) -> StoreError:
    """The error that names what differs."""
    return StoreError(
        f"the store {path} was made by another configuration (stored → asked):"
        f" {'; '.join(differences)}. Use a new store, or the stored configuration."
    )


def find_differences(stored: Any, asked: Any, name: str = "") -> list[str]:
    """Up to five places where two configurations differ, as ``name: stored → asked``."""
    if isinstance(stored, dict) and isinstance(asked, dict):
        pairs = [
            (_join(name, key), stored.get(key), asked.get(key))
            for key in sorted({*stored, *asked})
        ]
    elif isinstance(stored, list) and isinstance(asked, list) and len(stored) == len(asked):
        pairs = [
            (f"{name}[{n}]", a, b) for n, (a, b) in enumerate(zip(stored, asked, strict=True))
        ]
    else:
        return [] if stored == asked else [f"{name}: {_show(stored)} → {_show(asked)}"]
    found: list[str] = []
    for place, a, b in pairs:
        if len(found) < _MAX_DIFFERENCES and a != b:
            found += find_differences(a, b, place)
    return found[:_MAX_DIFFERENCES]


def _join(name: str, key: str) -> str:
    return f"{name}.{key}" if name else key


def _show(value: Any) -> str:
    text = "nothing" if value is None else json.dumps(value, ensure_ascii=False)
    return text if len(text) <= 60 else text[:57] + "…"


def _list_folder(folder: Path) -> list[os.DirEntry]:
    """Entries of a folder, by name; a symbolic link among them is refused, since it may lead
    anywhere.
    """
    try:
        entries = sorted(os.scandir(folder), key=lambda entry: entry.name)
    except OSError as error:
        raise InvalidInput(f"cannot read the folder {folder}: {error.strerror}.") from error
    for entry in entries:
        if entry.is_symlink():
            raise InvalidInput(
                f"{entry.path} is a symbolic link; inside a store they are refused. Copy the"
                " data in."
            )
    return entries
