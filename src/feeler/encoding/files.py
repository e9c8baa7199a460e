"""An encoder on disk: arrays and a JSON header in one .npz file, no pickle, with a version."""

import json
import os
from pathlib import Path

import numpy as np

from feeler.encoding.inputs import check_settings
from feeler.encoding.model import ConvolutiveNMF
from feeler.errors import FeelerError, InvalidInput, StoreError
from feeler.tensors.limits import parse_json
from feeler.tensors.npz import read_npz

FORMAT, VERSION = "feeler.ConvolutiveNMF", 1
_ARRAYS = ("components_", "activations_", "loss_curve_", "restarts_", "restart_components_")
_NUMBERS = ("reconstruction_err_", "relative_residual_", "n_iter_", "stability_", "n_sensors_in_")


def save_encoder(encoder: ConvolutiveNMF, path: str | os.PathLike) -> Path:
    """Write a fitted encoder; the file appears whole or not at all.

    Raises
    ------
    StoreError : the encoder is not fitted.
    """
    if not hasattr(encoder, "components_"):
        raise StoreError("The encoder has no bases yet: fit it before saving.")
    parameters = encoder.get_params()
    if not isinstance(parameters["random_state"], int | None):
        parameters["random_state"] = None  # a generator has no lasting name
    header = {
        "format": FORMAT,
        "version": VERSION,
        "parameters": {name: _plain(value) for name, value in parameters.items()},
        "numbers": {name: _plain(getattr(encoder, name)) for name in _NUMBERS if hasattr(encoder, name)},
    }
    arrays = {name: getattr(encoder, name) for name in _ARRAYS if hasattr(encoder, name)}
    path = Path(path)
    draft = path.with_name(f".{path.name}.{os.getpid()}.part")
    try:
        with draft.open("wb") as file:
            np.savez(file, header=np.frombuffer(json.dumps(header).encode(), dtype=np.uint8), **arrays)
        draft.replace(path)
    finally:
        draft.unlink(missing_ok=True)
    return path


def load_encoder(path: str | os.PathLike) -> ConvolutiveNMF:
    """Read an encoder that `save_encoder` wrote.

    Raises
    ------
    StoreError : no such file, another kind of file, another version, or arrays that do not fit together.
    """
    if not Path(path).exists():
        raise StoreError(f"There is no file {path}.")
    try:
        stored = read_npz(path)
        header = parse_json(stored["header"].tobytes(), "its header")
        arrays = {name: values for name, values in stored.items() if name in _ARRAYS}
    except (InvalidInput, KeyError, OSError, ValueError) as error:
        raise StoreError(f"{path} is not an encoder of feeler, or is damaged ({error}). Save it again.") from error
    if header.get("format") != FORMAT:
        raise StoreError(f"{path} holds something else than a {FORMAT}.")
    if header.get("version") != VERSION:
        raise StoreError(
            f"{path} is of format version {header.get('version')}, this feeler reads version {VERSION}. Use "
            "the feeler that wrote it, or fit and save again."
        )
    return _rebuild(path, header, arrays)


def _rebuild(path, header: dict, arrays: dict[str, np.ndarray]) -> ConvolutiveNMF:
    """The estimator from header and arrays, or a word on what does not fit."""
    try:
        encoder = ConvolutiveNMF(**header["parameters"])
        check_settings(encoder)
        components = arrays["components_"]
        shape = (encoder.n_components, header["numbers"]["n_sensors_in_"], encoder.n_lags)
    except (KeyError, TypeError, ValueError, AttributeError, FeelerError) as error:
        raise StoreError(f"{path} lacks parts of an encoder ({error}). Save it again.") from error
    if components.shape != shape or not np.isfinite(components).all() or (components < 0).any():
        raise StoreError(f"The bases in {path} should be {shape}, finite and non-negative; got {components.shape}.")
    for name, value in (arrays | header["numbers"]).items():
        if name in _ARRAYS + _NUMBERS:
            setattr(encoder, name, value)
    return encoder


def _plain(value):
    return value.item() if isinstance(value, np.generic) else value
