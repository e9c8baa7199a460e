"""Model files: what an encoder, a decoder or a network has learned, as safetensors with a JSON
header; never pickle.
"""

import json
import os
from dataclasses import dataclass, field
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np

from feeler.errors import InvalidInput, require_extra
from feeler.files import NAME, parse_json, write_atomic
from feeler.provenance import to_jsonable
from feeler.sandbox import Limits, open_guarded

_FORMAT = "feeler.model/1"


@dataclass(frozen=True, kw_only=True)
class Model:
    """The content of a model file.

    Attributes
    ----------
    kind : str
        The class, for example ``ConvolutiveNMF``.
    version : int
        Version of this kind's content, raised whenever older files would be misread.
    arrays : dict[str, np.ndarray]
        Everything that is a number and may be NaN belongs here.
    settings : dict[str, Any]
        Parameters, class names and the like, in JSON's types.
    versions : dict[str, str]
        What wrote it.
    """

    kind: str
    version: int
    arrays: dict[str, np.ndarray] = field(default_factory=dict)
    settings: dict[str, Any] = field(default_factory=dict)
    versions: dict[str, str] = field(
        default_factory=lambda: {name: version(name) for name in ("feeler", "numpy")}
    )


def save_model(model: Model, path: str | os.PathLike) -> None:
    """Write a model, whole or not at all; the file's notes hold format, kind, version, settings,
    versions.
    """
    require_extra("safetensors", "models", "a model's file")
    from safetensors.numpy import save

    if (
        not NAME.fullmatch(model.kind)
        or isinstance(model.version, bool)
        or not isinstance(model.version, int)
    ):
        raise InvalidInput(
            f"a model has a kind (a name) and a whole version, got {model.kind!r},"
            f" {model.version!r}."
        )
    notes = {"format": _FORMAT, "kind": model.kind, "version": str(model.version)}
    notes |= {
        name: json.dumps(to_jsonable(getattr(model, name))) for name in ("settings", "versions")
    }
    arrays = {name: np.asarray(values, order="C") for name, values in model.arrays.items()}
    for name, values in arrays.items():
        if values.dtype.kind not in "biuf":
            raise InvalidInput(
                f"array {name!r} has the type {values.dtype}; a model's arrays hold numbers."
            )
    try:
        write_atomic(Path(path), save(arrays, metadata=notes))
    except OSError as error:
        raise InvalidInput(
            f"cannot write {path}: {error.strerror}. Check the folder and the room left."
        ) from error


def load_model(
    path: str | os.PathLike, *, kind: str, version: int, trusted: bool = False
) -> Model:
    """The model in a file, which must be of this kind and version.

    Raises
    ------
    InvalidInput
        No model file, damaged, or of another kind or version (the message says which it is and what
        to do).
    """
    model = _read_model(path, trusted=trusted)
    if model.kind != kind:
        raise InvalidInput(
            f"{path} holds a model of kind {model.kind!r}, not {kind!r}. Load it with the reader of"
            " its kind."
        )
    if model.version != version:
        advice = (
            "Update feeler"
            if model.version > version
            else "Fit it again, or use the older feeler"
        )
        raise InvalidInput(
            f"{path} holds version {model.version} of {kind!r}; this feeler reads {version}."
            f" {advice}."
        )
    return model


def _read_model(
    path: str | os.PathLike, limits: Limits | None = None, *, trusted: bool = False
) -> Model:
    """The model in a file, of whatever kind and version; ``trusted=True`` skips the guard."""
    if not Path(path).is_file():
        raise InvalidInput(
            f"cannot read {path}: no such file, or not a regular one. Check the path."
        )
    require_extra("safetensors", "models", f"reading {Path(path).name}")
    notes, arrays = open_guarded(
        "feeler.tensors.readers:read_safetensors", path, limits, trusted=trusted
    )
    name = Path(path).name
    if notes.get("format") != _FORMAT:
        raise InvalidInput(
            f"{name} is no model of feeler (format {str(notes.get('format'))[:40]!r}, not"
            f" {_FORMAT!r})."
        )
    number, kind = notes.get("version", ""), notes.get("kind", "")
    if not (
        number.isascii() and number.isdigit() and len(number) < 10 and NAME.fullmatch(kind)
    ):
        raise InvalidInput(
            f"{name} is damaged: its kind is {kind[:40]!r}, its version {number[:40]!r}."
        )
    settings, versions = (
        parse_json(notes.get(key, "{}").encode("utf-8", "replace"), f"the {key} in {name}")
        for key in ("settings", "versions")
    )
    return Model(
        kind=kind, version=int(number), arrays=arrays, settings=settings, versions=versions
    )
