"""Model files: what an encoder or a classifier has learned, as arrays and JSON with a kind and a version; no pickle."""

import json
import os
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from feeler.errors import InvalidInput
from feeler.provenance import make_plain
from feeler.tensors.arrays import load_arrays, save_arrays
from feeler.tensors.limits import NAME, Limits, parse_json

FORMAT = "feeler.model/1"


@dataclass(frozen=True, kw_only=True)
class Model:
    """The content of a model file."""

    kind: str
    """What it is, for example ``cnmf`` or ``lda``."""
    version: int
    """Version of this kind's content, raised whenever older files would be misread."""
    arrays: dict[str, np.ndarray] = field(default_factory=dict)
    settings: dict[str, Any] = field(default_factory=dict)
    """Parameters, class names and the like, in JSON's types."""


def save_model(model: Model, path: str | os.PathLike) -> None:
    """Write a model as a safetensors file whose notes hold format, kind, version, settings."""
    if not NAME.fullmatch(model.kind) or isinstance(model.version, bool) or not isinstance(model.version, int):
        raise InvalidInput(f"a model has a kind (a name) and a whole version, got {model.kind!r}, {model.version!r}.")
    settings = json.dumps(make_plain(model.settings), ensure_ascii=False)
    notes = {"format": FORMAT, "kind": model.kind, "version": str(model.version), "settings": settings}
    save_arrays(path, model.arrays, notes)


def load_model(path: str | os.PathLike, *, kind: str, version: int, limits: Limits | None = None) -> Model:
    """The model in a file, which must be of this kind and version.

    Raises
    ------
    InvalidInput
        No model file, damaged, or of another kind or version (the message says which it is and what to do).
    """
    model = read_model(path, limits)
    if model.kind != kind:
        raise InvalidInput(
            f"{path} holds a model of kind {model.kind!r}, not {kind!r}. Load it with the reader of its kind."
        )
    if model.version != version:
        advice = "Update feeler" if model.version > version else "Fit it again, or use the older feeler"
        raise InvalidInput(f"{path} holds version {model.version} of {kind!r}; this feeler reads {version}. {advice}.")
    return model


def read_model(path: str | os.PathLike, limits: Limits | None = None) -> Model:
    """The model in a file, of whatever kind and version."""
    arrays, notes = load_arrays(path, limits)
    name = Path(path).name
    if notes.get("format") != FORMAT:
        raise InvalidInput(
            f"{name} is no model of feeler (format {notes.get('format', 'none')[:40]!r}, not {FORMAT!r})."
        )
    version, kind = notes.get("version", ""), notes.get("kind", "")
    if not (version.isascii() and version.isdigit() and len(version) < 10 and NAME.fullmatch(kind)):
        raise InvalidInput(f"{name} is damaged: its kind is {kind[:40]!r}, its version {version[:40]!r}.")
    settings = parse_json(notes.get("settings", "{}").encode("utf-8", "replace"), f"the settings in {name}")
    return Model(kind=kind, version=int(version), arrays=arrays, settings=settings)
