"""Sensitivity: how a touch's tensor changes with its place, its size and its speed."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Annotated, Any

import numpy as np
import xarray as xr

from feeler.antenna.antenna import Antenna
from feeler.errors import InvalidInput
from feeler.records.checked import checked
from feeler.records.registry import Registry
from feeler.stimulus.trial import Trial
from feeler.tensors.unit import need


@dataclass(frozen=True, kw_only=True)
class Parameter:
    """One continuous property of a touch.

    Attributes
    ----------
    step : float
        Default step of the difference, in ``unit``; it is halved once as a check.
    move : Callable[[Antenna, Trial, float], Trial]
        ``move(antenna, trial, by)``: the trial with the property changed by ``by``.
    """

    unit: str
    step: float
    move: Callable[[Antenna, Trial, float], Trial]


def _move_location(antenna: Antenna, trial: Trial, by: float) -> Trial:
    return replace(trial, location=trial.location + by / antenna.length)


def _move_size(antenna: Antenna, trial: Trial, by: float) -> Trial:
    if not np.isfinite(trial.feature.size):
        raise InvalidInput(
            f"the size of {trial.label} cannot change; leave the parameter 'size' out."
        )
    return replace(trial, feature=trial.feature.scale(1 + by / trial.feature.size))


def _move_speed(antenna: Antenna, trial: Trial, by: float) -> Trial:
    return replace(trial, speed=trial.speed * (1 + by / 100))


PARAMETERS: Registry[Parameter] = Registry("parameter of a touch")
"""Properties by name; ``PARAMETERS.register(name, Parameter(...))`` adds one."""
PARAMETERS.register("location", Parameter(unit="mm", step=0.02, move=_move_location))
PARAMETERS.register("size", Parameter(unit="mm", step=0.02, move=_move_size))
PARAMETERS.register("speed", Parameter(unit="%", step=0.1, move=_move_speed))


@checked
def differentiate_touches(
    antenna: Antenna,
    trials: Sequence[Trial] | Trial,
    parameters: Sequence[str] = ("location", "size", "speed"),
    *,
    step: Annotated[float, "> 0"] = 1.0,
    quantity: str = "angle",
    **options: Any,
) -> xr.Dataset:
    """∂x/∂θ of each touch by central differences of simulated tensors, with a check.

    Every difference is taken twice, with the parameter's own step h and with h/2; the latter is
    given back. The smooth contact (the default) is what makes the limit exist: with ``hard``
    contact it does not.

    Parameters
    ----------
    parameters
        Names of :data:`PARAMETERS`: ``location`` [mm along the antenna], ``size`` [mm, half-width],
        ``speed`` [%].
    step
        Multiplies every parameter's step.
    options
        What :func:`feeler.touch` takes beside: duration, engine, timestep, contact, workers …

    Returns
    -------
    xarray.Dataset
        ``derivative`` (parameter, trial, sensor, time); ``change`` (parameter, trial), ‖D(h) −
        D(h/2)‖ / ‖D(h/2)‖, which for a converged central difference is about 3/4 of the error of
        D(h), itself four times that of what is given; and ``unit`` of each parameter.
    """
    from feeler.experiment.touch import touch  # who only reads tensors needs no engine

    trials = [trials] if isinstance(trials, Trial) else list(trials)
    known = [PARAMETERS[name] for name in parameters]
    steps = np.array([[step * p.step * share for share in (1.0, 0.5)] for p in known])
    moved = [
        p.move(antenna, trial, sign * h)
        for p, hs in zip(known, steps, strict=True)
        for h in hs
        for sign in (1.0, -1.0)
        for trial in trials
    ]
    tensors = touch(antenna, moved, **options)
    need(tensors, quantity)
    values = tensors[quantity].values
    up, down = np.moveaxis(
        values.reshape(len(known), 2, 2, len(trials), *values.shape[1:]), 2, 0
    )
    wide, close = np.moveaxis((up - down) / (2 * steps[:, :, None, None, None]), 1, 0)
    size = np.linalg.norm(close, axis=(2, 3))
    with np.errstate(invalid="ignore", divide="ignore"):
        change = np.linalg.norm(wide - close, axis=(2, 3)) / size
    return xr.Dataset(
        {
            "derivative": (("parameter", "trial", "sensor", "time"), close),
            "change": (("parameter", "trial"), change),
        },
        {
            "parameter": list(parameters),
            "unit": ("parameter", [p.unit for p in known]),
            "time": tensors["time"].values,
        },
    )


@checked
def scale_derivatives(
    derivatives: Annotated[np.ndarray, "parameter trial ..."],
    tensors: Annotated[np.ndarray, "trial ..."],
) -> np.ndarray:
    """Derivatives of x/p from those of x, where p is each tensor's peak: (∂x − x ∂p/p) / p.

    What :func:`feeler.information.scale_peaks` is to tensors. The peak is taken to stay where it
    is.

    Raises
    ------
    InvalidInput
        Shapes that do not go together, or a tensor that is zero everywhere.
    """
    moves, values = np.asarray(derivatives, dtype=float), np.asarray(tensors, dtype=float)
    if (
        moves.shape[1:] != values.shape
        or not np.abs(values).reshape(len(values), -1).max(axis=1).all()
    ):
        raise InvalidInput(
            f"derivatives {moves.shape} need tensors {moves.shape[1:]} with a peak, got"
            f" {values.shape}."
        )
    flat, along = values.reshape(len(values), -1), moves.reshape(*moves.shape[:2], -1)
    top = np.abs(flat).argmax(axis=1)
    peak = np.take_along_axis(flat, top[:, None], 1)  # with its sign, which cancels
    change = np.take_along_axis(
        along, np.broadcast_to(top[None, :, None], (*moves.shape[:2], 1)), 2
    )
    return ((along - flat * (change / peak)) / np.abs(peak)).reshape(moves.shape)
