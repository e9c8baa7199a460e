"""Draw tactile tensors: sensors from base (bottom) to tip (top) over time."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import Normalize
from matplotlib.image import AxesImage

from feeler.checked import checked


@checked
def plot_tensor(tensor: np.ndarray, time: np.ndarray, ax: Axes, norm: Normalize, labels: bool = True) -> AxesImage:
    """One tensor (sensor, time) as an image; ``time`` in ms, colours by ``norm``."""
    step = time[1] - time[0] if len(time) > 1 else 1.0
    extent = (time[0] - step / 2, time[-1] + step / 2, 0.5, tensor.shape[0] + 0.5)
    image = ax.imshow(tensor, origin="lower", aspect="auto", extent=extent, norm=norm, interpolation="nearest")
    if labels:
        ax.set_xlabel("time [ms]")
        ax.set_ylabel("sensor (base → tip)")
    return image


@checked
def plot_tensor_grid(
    tensors: list[list[np.ndarray]], time: np.ndarray, ax: Axes, norm: Normalize, rows: list[str], columns: list[str]
) -> AxesImage:
    """Small multiples (row, column) of tensors as one picture on one colour scale; time [ms] under every column.

    One image in one axes is drawn many times faster than an axes for each tensor.
    """
    n_sensors, n_samples = tensors[0][0].shape
    gaps = max(1, n_sensors // 16), max(1, n_samples // 20)
    high, wide = n_sensors + gaps[0], n_samples + gaps[1]
    mosaic = np.full((high * len(tensors) - gaps[0], wide * len(tensors[0]) - gaps[1]), np.nan)
    for i, row in enumerate(tensors):
        for j, tensor in enumerate(row):
            mosaic[high * i :, wide * j :][:n_sensors, :n_samples] = tensor[::-1]  # tip upwards
    image = ax.imshow(mosaic, aspect="auto", norm=norm, interpolation="nearest")
    ax.set_yticks([high * i + n_sensors / 2 for i in range(len(rows))], rows)
    middle = n_samples // 2
    ax.set_xticks(
        [wide * j + sample for j in range(len(columns)) for sample in (0, middle)],
        [f"{time[sample]:.0f}" for _ in columns for sample in (0, middle)],
    )
    top = ax.secondary_xaxis("top")
    top.set_xticks([wide * j + n_samples / 2 for j in range(len(columns))], columns)
    for axis in (ax, top):
        axis.tick_params(length=2)
        axis.spines[:].set_visible(False)
    return image
