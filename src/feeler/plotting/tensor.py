"""Draw tactile tensors: sensors from base (bottom) to tip (top) over time."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import Normalize
from matplotlib.image import AxesImage


def plot_tensor(tensor: np.ndarray, time: np.ndarray, ax: Axes, norm: Normalize, labels: bool = True) -> AxesImage:
    """One tensor (sensor, time) as an image; ``time`` in ms, colours by ``norm``."""
    step = time[1] - time[0] if len(time) > 1 else 1.0
    extent = (time[0] - step / 2, time[-1] + step / 2, 0.5, tensor.shape[0] + 0.5)
    image = ax.imshow(tensor, origin="lower", aspect="auto", extent=extent, norm=norm, interpolation="nearest")
    if labels:
        ax.set_xlabel("time [ms]")
        ax.set_ylabel("sensor (base → tip)")
    return image


def plot_tensor_grid(tensors: list[list[np.ndarray]], time: np.ndarray, axes: np.ndarray, norm: Normalize) -> AxesImage:
    """Small multiples (row, column) of tensors on one colour scale; only outer axes carry numbers."""
    for i, row in enumerate(tensors):
        for j, tensor in enumerate(row):
            image = plot_tensor(tensor, time, axes[i, j], norm, labels=False)
            axes[i, j].tick_params(labelleft=j == 0, labelbottom=i == len(tensors) - 1, length=2)
    return image
