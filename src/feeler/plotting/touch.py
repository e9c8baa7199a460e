"""One touch, drawn: its tensor as a picture, and the antenna meeting the feature while its tensor grows as a movie."""

from pathlib import Path

import numpy as np
import xarray as xr
from matplotlib.colors import Normalize
from matplotlib.figure import Figure

from feeler.antenna.antenna import Antenna
from feeler.checked import checked
from feeler.plotting.look import style
from feeler.plotting.movie import write_movie
from feeler.plotting.posture import make_patch
from feeler.plotting.tensor import plot_tensor
from feeler.stimulus.placement import place
from feeler.stimulus.trial import Trial

FRAMES = 48


@checked
def plot_touch(tensors: xr.Dataset, figure: Figure) -> None:
    """The curvature of a Dataset's first touch, (sensor, time)."""
    values, ax = tensors["curvature"].values[0], figure.subplots()
    image = plot_tensor(values, tensors["time"].values, ax, Normalize(0.0, max(float(values.max()), 1e-9)))
    figure.colorbar(image, ax=ax, label="curvature [1/mm] (negative drawn as 0)")


@checked
def write_touch_movie(
    antenna: Antenna, trial: Trial, tensors: xr.Dataset, path: Path, n_frames: int = FRAMES, fps: int = 25
) -> Path:
    """Shape and feature left, growing tensor right; ``tensors`` holds one touch recorded at every hinge."""
    time, curvature = tensors["time"].values, tensors["curvature"].values[0]
    points, placement = antenna.shape(tensors["angle"].values[0].T), place(antenna, trial)
    frames = np.unique(np.linspace(0, len(time) - 1, min(n_frames, len(time))).astype(int))
    with style():
        figure = Figure(figsize=(7.2, 3.6), layout="constrained")
        left, right = figure.subplots(1, 2, width_ratios=(1, 1.3))
        (line,) = left.plot([], [], color="#5b3a1e", linewidth=2)
        reach = antenna.length
        left.set(xlim=(-0.35 * reach, 0.85 * reach), ylim=(-0.1 * reach, 1.1 * reach), aspect="equal")
        left.set(xlabel="x [mm]", ylabel="y [mm]")
        norm = Normalize(0.0, max(float(curvature.max()), 1e-9))
        image = plot_tensor(curvature, time, right, norm)
        right.set_ylabel("hinge (base → tip)")
        figure.colorbar(image, ax=right, label="curvature [1/mm]")
        left.set_title(trial.label, fontsize=7)
        clock = left.text(0.98, 0.98, "", transform=left.transAxes, ha="right", va="top", fontsize=8)
        patch = None

        def draw(k: int) -> list:
            nonlocal patch
            now = frames[k]
            line.set_data(points[now, :, 0], points[now, :, 1])
            if patch is not None:
                patch.remove()
            origin = placement.origin + placement.velocity * time[now]
            patch = left.add_patch(make_patch(trial.shape, origin, placement.forward))
            grown = np.where(time[None, :] <= time[now], curvature, np.nan)
            image.set_data(grown)
            clock.set_text(f"{time[now]:.0f} ms")
            return [image, patch, line, clock]

        return write_movie(path, figure, draw, len(frames), fps)
