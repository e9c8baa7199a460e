"""What a store holds: its label, its records, and the finished trials they vouch for."""

import os
import re
from pathlib import Path
from typing import Any

import xarray as xr

from feeler.errors import InvalidInput
from feeler.tensors.layout import PROGRESS, Layout, assemble, read_layout, read_record, read_trial, record_path
from feeler.tensors.limits import Limits, find_limits, list_folder, parse_json, read_bytes

FORMAT = 2
_RECORD = re.compile(r"\d{6,}\.json")


def read_store(path: str | os.PathLike, limits: Limits | None = None) -> xr.Dataset:
    """The finished trials of a store, in trial order, without locking it.

    Raises
    ------
    InvalidInput
        No store, no finished trial, over the limits, or damaged (the message names the trial and the file).
    """
    path, limits = Path(path), find_limits(limits)
    read_label(path, limits)
    list_folder(path)
    layout = read_layout(path, limits)
    indices = find_records(path) if layout is not None else []
    if not indices:
        raise InvalidInput(f"the store {path} holds no finished trial yet. Let the simulation go on.")
    return assemble(path, layout, indices, limits)


def read_label(path: Path, limits: Limits) -> dict[str, Any]:
    """What a store says of itself: format, n_trials, digest, configuration."""
    root = parse_json(read_bytes(path / "zarr.json", limits.max_text, follow=False), f"{path}/zarr.json")
    attributes = root.get("attributes")
    label = attributes.get("feeler_store") if isinstance(attributes, dict) else None
    if not isinstance(label, dict) or not isinstance(label.get("n_trials"), int):
        raise InvalidInput(f"{path} is a Zarr group, but no store of feeler.")
    if label.get("format") != FORMAT:
        advice = "Make it again" if label.get("format") == 1 else "Update feeler"
        raise InvalidInput(
            f"{path} is a store of format {label.get('format')!r}; this feeler reads {FORMAT}. {advice}."
        )
    return label


def find_records(path: Path) -> list[int]:
    """Numbers of the trials that have a record, rising."""
    folder = path / PROGRESS
    return sorted(int(entry.name[:-5]) for entry in list_folder(folder) if _RECORD.fullmatch(entry.name))


def find_damage(path: Path, layout: Layout, n_trials: int) -> dict[int, str]:
    """Finished trials that cannot be read, each with the reason."""
    damage = {}
    for index in find_records(path):
        try:
            if index >= n_trials:
                raise InvalidInput(f"trial {index} lies outside the {n_trials} trials of the store.")
            read_trial(path, index, layout, read_record(record_path(path, index), index, layout))
        except InvalidInput as error:
            damage[index] = str(error)
    return damage
