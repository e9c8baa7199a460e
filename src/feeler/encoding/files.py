"""An encoder on disk: a model file, arrays beside a JSON header, no pickle."""

import os
from pathlib import Path

import numpy as np

from feeler.encoding.inputs import check_settings
from feeler.encoding.model import ConvolutiveNMF
from feeler.errors import FeelerError, InvalidInput, StoreError
from feeler.records.checked import checked
from feeler.tensors.models import Model, load_model, save_model

_KIND, _VERSION = "ConvolutiveNMF", 1
_ARRAYS = ("components_", "activations_", "loss_curve_", "restarts_", "restart_components_")
_SUMS = ("sum_seen", "sum_gram")
"""From which ``partial_fit`` goes on."""
_NUMBERS = (
    *("reconstruction_err_", "relative_residual_", "n_iter_", "n_sensors_in_"),
    *("stability_", "stability_in_place_"),
)


@checked
def save_encoder(encoder: ConvolutiveNMF, path: str | os.PathLike) -> Path:
    """Write a fitted encoder; the file appears whole or not at all.

    Raises
    ------
    StoreError
        The encoder is not fitted.
    """
    if not hasattr(encoder, "components_"):
        raise StoreError("The encoder has no bases yet: fit it before saving.")
    parameters = encoder.get_params()
    if not isinstance(parameters["random_state"], int | None):
        parameters["random_state"] = None  # a generator has no lasting name
    arrays = {
        name: np.asarray(getattr(encoder, name))
        for name in _ARRAYS + _NUMBERS
        if hasattr(encoder, name)
    } | dict(zip(_SUMS, getattr(encoder, "_sums", ()), strict=False))
    save_model(
        Model(kind=_KIND, version=_VERSION, arrays=arrays, settings={"parameters": parameters}),
        path,
    )
    return Path(path)


@checked
def load_encoder(path: str | os.PathLike, *, trusted: bool = False) -> ConvolutiveNMF:
    """Read an encoder that :func:`save_encoder` wrote.

    Parameters
    ----------
    path : str or os.PathLike
        The file.
    trusted : bool, default=False
        Skip the guard, for a file of your own.

    Raises
    ------
    StoreError
        No such file, another kind or version, or arrays that do not fit together.
    """
    if not Path(path).exists():
        raise StoreError(f"There is no file {path}.")
    try:
        model = load_model(path, kind=_KIND, version=_VERSION, trusted=trusted)
    except InvalidInput as error:
        raise StoreError(
            f"{path} is not an encoder of feeler, or is damaged ({error}). Save it again."
        ) from error
    return _rebuild(path, model)


def _rebuild(path: str | os.PathLike, model: Model) -> ConvolutiveNMF:
    """The estimator from a model, or a word on what does not fit."""
    try:
        encoder = ConvolutiveNMF(**model.settings["parameters"])
        check_settings(encoder)
        numbers = {name: model.arrays[name].item() for name in _NUMBERS if name in model.arrays}
        components = model.arrays["components_"]
        n_sensors = numbers["n_sensors_in_"]
    except (KeyError, TypeError, ValueError, AttributeError, FeelerError) as error:
        raise StoreError(
            f"{path} lacks parts of an encoder ({error}). Save it again."
        ) from error
    # n_components and n_lags may have been set to other numbers after the fit
    if (
        components.ndim != 3
        or components.shape[1] != n_sensors
        or not np.isfinite(components).all()
        or (components < 0).any()
    ):
        raise StoreError(
            f"The bases in {path} should be (component, {n_sensors}, lag), finite and non-negative;"
            f" got {components.shape}."
        )
    _check_beside(path, components.shape, model.arrays)
    for name, value in (
        {name: model.arrays[name] for name in _ARRAYS if name in model.arrays} | numbers
    ).items():
        setattr(encoder, name, value)
    if all(name in model.arrays for name in _SUMS):
        encoder._sums = model.arrays[_SUMS[0]], model.arrays[_SUMS[1]]
    return encoder


def _check_beside(path: str | os.PathLike, shape: tuple[int, ...], arrays: dict) -> None:
    """Refuse arrays that do not belong to bases of this shape (component, sensor, lag)."""
    n_components, _, n_lags = shape
    found = {name: np.shape(arrays[name]) for name in arrays}
    expected = {
        "activations_": (*found.get("activations_", ())[:1], n_components),
        "restart_components_": (*found.get("restart_components_", ())[:1], *shape),
        "sum_seen": shape,
        "sum_gram": (n_components, n_lags, n_components, n_lags),
    }
    for name, own in expected.items():
        if name in found and found[name][: len(own)] != own:
            raise StoreError(
                f"The array {name} in {path} has the shape {found[name]}, which does not go with"
                f" bases of {shape}. Save it again."
            )
