"""A trial of a Dataset, as a picture and as a movie: what ``dataset.feeler`` offers."""

from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.colors import Normalize

from feeler.antenna import Antenna
from feeler.checked import checked
from feeler.errors import InvalidInput
from feeler.plotting.picture import Picture
from feeler.plotting.tensor import plot_tensor
from feeler.plotting.touch import write_touch_movie
from feeler.tensors.unit import in_unit


@checked
def plot_trial(
    tensors: xr.Dataset, trial: int = 0, variable: str = "curvature", ax: Axes | None = None
) -> Axes:
    """One trial's (sensor, time) as an image with its colour bar; negative values are drawn too."""
    values = _take(tensors, trial, variable).transpose("sensor", "time").values
    ax = Picture(figsize=(4.5, 3.0), layout="constrained").subplots() if ax is None else ax
    largest = max(float(np.nanmax(np.abs(values))), 1e-12)
    unit = str(tensors[variable].attrs.get("units", ""))
    image = plot_tensor(
        values,
        in_unit(tensors["time"], "ms").values,
        ax,
        Normalize(min(0.0, float(np.nanmin(values))), largest),
        unit=unit,
    )
    ax.figure.colorbar(image, ax=ax, label=f"{variable} [{unit}]")
    return ax


@checked
def write_trial_movie(
    tensors: xr.Dataset, antenna: Antenna, path: Path, trial: int = 0, **how: Any
) -> Path:
    """The antenna as the sensors tell it beside the tensor as it grows; ``how`` as for
    ``write_touch_movie``.
    """
    return write_touch_movie(
        antenna, None, tensors.isel(trial=[_check_trial(tensors, trial)]), path, **how
    )


def _take(tensors: xr.Dataset, trial: int, variable: str) -> xr.DataArray:
    if variable not in tensors.data_vars or not {"trial", "sensor", "time"} <= set(
        tensors[variable].dims
    ):
        valid = [
            name
            for name, item in tensors.data_vars.items()
            if {"trial", "sensor", "time"} <= set(item.dims)
        ]
        raise InvalidInput(
            f"no tensor {variable!r} in this Dataset; valid:"
            f" {', '.join(map(str, valid)) or 'none'}."
        )
    return tensors[variable].isel(trial=_check_trial(tensors, trial))


def _check_trial(tensors: xr.Dataset, trial: int) -> int:
    if not 0 <= trial < tensors.sizes["trial"]:
        raise InvalidInput(f"trial must be from 0 to {tensors.sizes['trial'] - 1}, got {trial}.")
    return trial
