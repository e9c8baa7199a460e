"""Fig. 2C–E and Fig. S3: the antenna, what touches it, and the tactile tensors."""

import numpy as np
import xarray as xr
from matplotlib.colors import Normalize
from matplotlib.figure import Figure

from feeler.antenna.antenna import Antenna
from feeler.paper.trials import LOCATIONS, make_features
from feeler.plotting.posture import make_patch, plot_posture, plot_profiles
from feeler.plotting.tensor import plot_tensor_grid


def plot_antenna(antenna: Antenna, figure: Figure) -> None:
    """The antenna lying, its sensors on it, and its profiles (Fig. 2A, C)."""
    grid = figure.add_gridspec(2, 4, height_ratios=(1, 2))
    ax = figure.add_subplot(grid[0, :])
    points = antenna.shape()[:, ::-1]
    ax.fill_between(points[:-1, 0], -antenna.radius, antenna.radius, color="#d9b48f", linewidth=0)
    plot_posture(points, ax, linewidth=1)
    ax.plot(points[antenna.sensors - 1, 0], points[antenna.sensors - 1, 1], ".", color="#D55E00", markersize=3)
    ax.set(xlabel="arc length from the base [mm]", yticks=[], aspect="equal")
    ax.set_title(
        f"{antenna.name}: {antenna.n_segments} segments, {antenna.sensors.size} sensors (dots), {antenna.length:.3g} mm"
    )
    ax.spines.left.set_visible(False)
    plot_profiles(antenna, np.array([figure.add_subplot(grid[1, i]) for i in range(4)]))


def plot_stimuli(antenna: Antenna, figure: Figure) -> None:
    """The six features and the five locations (Fig. 2D)."""
    left, right = figure.subplots(1, 2, width_ratios=(1, 2))
    plot_posture(antenna.shape(), left, linewidth=2)
    left.plot(np.zeros(len(LOCATIONS)), np.array(LOCATIONS) * antenna.length, "o", color="#CC0000", markersize=4)
    left.set(xlabel="x [mm]", ylabel="y [mm]", xlim=(-8, 8), aspect="equal", title="contact locations")
    for i, feature in enumerate(make_features()):
        right.add_patch(make_patch(feature, np.array([8.0 * i, 0.0]), np.array([1.0, 0.0])))
        right.text(8.0 * i - feature.size, -5.5, f"{feature.kind}\n{feature.size:g} mm", ha="center", fontsize=6)
    right.annotate("motion", (46, 5), (38, 5), arrowprops={"arrowstyle": "->"}, va="center", fontsize=7)
    right.set(
        xlabel="x [mm]", ylabel="y [mm]", xlim=(-8, 48), ylim=(-9, 8), aspect="equal", title="features (half-size)"
    )


def select(tensors: xr.Dataset, speed: float) -> list[list[xr.DataArray]]:
    """Curvature [1/mm] of one speed as rows of locations (middle to tip) and columns of features."""
    at_speed = tensors["curvature"].sel(trial=np.isclose(tensors["speed"], speed))
    columns = sorted(
        {(str(f), float(s)) for f, s in zip(at_speed["feature"].values, at_speed["size"].values, strict=True)}
    )
    rows = sorted(set(at_speed["location"].values.tolist()))
    return [
        [
            at_speed.isel(
                trial=int(
                    np.flatnonzero(
                        np.isclose(at_speed["location"], row)
                        & (at_speed["feature"].values == feature)
                        & np.isclose(at_speed["size"], size)
                    )[0]
                )
            )
            for feature, size in columns
        ]
        for row in rows
    ]


def plot_tensors(tensors: xr.Dataset, speed: float, figure: Figure, limit: float | None = None) -> None:
    """All tensors of one speed: rows locations, columns features, one colour scale (Fig. 2E, Fig. S3)."""
    grid = select(tensors, speed)
    values = [[tensor.values for tensor in row] for row in grid]
    limit = limit or max(float(np.max(value)) for row in values for value in row)
    ax = figure.subplots()
    rows = [f"{row[0]['location'].item():g} L" for row in grid]
    columns = [f"{tensor['feature'].item()} {tensor['size'].item():g} mm" for tensor in grid[0]]
    image = plot_tensor_grid(values, tensors["time"].values, ax, Normalize(0.0, limit), rows, columns)
    ax.set(xlabel="time [ms]", ylabel="hinge (base → tip upwards) at each location of contact")
    figure.colorbar(image, ax=ax, label="curvature [1/mm] (negative drawn as 0)", shrink=0.6, pad=0.01)
