"""A trial of a Dataset, as a picture and as a movie: what ``dataset.feeler`` offers."""

from pathlib import Path

import numpy as np
import xarray as xr
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.colors import Normalize
from matplotlib.figure import Figure

from feeler.antenna import Antenna
from feeler.checked import checked
from feeler.errors import InvalidInput
from feeler.plotting.look import style
from feeler.plotting.movie import FPS, SLOWER, choose_frames, say_clock, write_movie
from feeler.plotting.posture import MovingAntenna
from feeler.plotting.tensor import plot_tensor
from feeler.tensors.posture import reconstruct_posture, spread_angles


@checked
def plot_trial(tensors: xr.Dataset, trial: int = 0, variable: str = "curvature", ax: Axes | None = None) -> Axes:
    """One trial's (sensor, time) as an image with its colour bar; negative values are drawn too."""
    values = _take(tensors, trial, variable).transpose("sensor", "time").values
    ax = Figure(figsize=(4.5, 3.0), layout="constrained").subplots() if ax is None else ax
    largest = max(float(np.nanmax(np.abs(values))), 1e-12)
    unit = str(tensors[variable].attrs.get("units", ""))
    image = plot_tensor(
        values, tensors["time"].values, ax, Normalize(min(0.0, float(np.nanmin(values))), largest), unit=unit
    )
    ax.figure.colorbar(image, ax=ax, label=f"{variable} [{unit}]")
    return ax


@checked
def write_trial_movie(
    tensors: xr.Dataset, antenna: Antenna, path: Path, trial: int = 0, *, slower: float = SLOWER, fps: int = FPS
) -> Path:
    """The antenna as the sensors tell it, coloured by curvature, beside the tensor as it grows."""
    one = tensors.isel(trial=[_check_trial(tensors, trial)])
    points, time = reconstruct_posture(one, antenna).values[0], one["time"].values
    angle = one["angle"].transpose("trial", "time", "sensor").values[0]
    bend = spread_angles(angle, antenna, one["segment"].values.astype(int) - 1) / antenna.segment_length
    curvature = _take(tensors, trial, "curvature").transpose("sensor", "time").values
    with style():
        figure = Figure(figsize=(7.2, 3.6), layout="constrained")
        left, right = figure.subplots(1, 2, width_ratios=(1, 1.3))
        norm, reach = Normalize(0.0, max(float(curvature.max()), 1e-9)), antenna.length
        left.set(xlim=(-0.5 * reach, 0.7 * reach), ylim=(-0.06 * reach, 1.1 * reach), aspect="equal")
        left.set(xlabel="x [mm]", ylabel="y [mm]")
        moving, image = MovingAntenna(antenna, left, norm), plot_tensor(curvature, time, right, norm)
        figure.colorbar(image, ax=right, label="curvature [1/mm]")
        shown = choose_frames(time, slower=slower, fps=fps)
        clock = right.set_title(say_clock(float(time[-1]), slower))

        def draw(k: int) -> list[Artist]:
            now = int(shown[k])
            clock.set_text(say_clock(float(time[now]), slower))
            image.set_data(np.where(time <= time[now], curvature, np.nan))
            return [clock, image, *moving.move(points[now], bend[now])]

        return write_movie(path, figure, draw, len(shown), fps)


def _take(tensors: xr.Dataset, trial: int, variable: str) -> xr.DataArray:
    if variable not in tensors.data_vars or not {"trial", "sensor", "time"} <= set(tensors[variable].dims):
        valid = [name for name, item in tensors.data_vars.items() if {"trial", "sensor", "time"} <= set(item.dims)]
        raise InvalidInput(f"no tensor {variable!r} in this Dataset; valid: {', '.join(map(str, valid)) or 'none'}.")
    return tensors[variable].isel(trial=_check_trial(tensors, trial))


def _check_trial(tensors: xr.Dataset, trial: int) -> int:
    if not 0 <= trial < tensors.sizes["trial"]:
        raise InvalidInput(f"trial must be from 0 to {tensors.sizes['trial'] - 1}, got {trial}.")
    return trial
