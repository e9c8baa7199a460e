"""Draw tactile tensors: sensors from base (bottom) to tip (top) over time."""

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from matplotlib.image import AxesImage
from matplotlib.ticker import MaxNLocator

from feeler.plotting.look import BOTH_COLOURS, TENSOR_COLOURS
from feeler.records.checked import checked
from feeler.tensors.sides import measure_peak

_GID = "tensor"
_LEVELS = 64  # of a colour scale that a page knows
_BOTH = 0.5  # of the peak; greater bending towards the object is drawn as well [C]


def choose_scale(*tensors: np.ndarray) -> tuple[Normalize, str]:
    """Colour scale for bending away from an object (sensor, time), and the name of its colours:
    from 0 to the peak of all tensors; or, where the antenna bends towards the object by more than
    half of that as well, from −peak to peak.
    """
    top = max(measure_peak(*tensors), 1e-9)
    low = min(float(np.nanmin(one, initial=0.0)) for one in tensors)
    if low < -_BOTH * top:
        return Normalize(-top, top), BOTH_COLOURS
    return Normalize(0.0, top), TENSOR_COLOURS


@checked
def plot_tensor(
    tensor: np.ndarray,
    time: np.ndarray,
    ax: Axes,
    norm: Normalize,
    labels: bool = True,
    unit: str = "/mm",
    colours: str | None = None,
) -> AxesImage:
    """One tensor (sensor, time) as an image; ``time`` in ms, colours by ``norm``, whose values are
    in ``unit``, on the scale ``colours`` or the style's own.
    """
    step = time[1] - time[0] if len(time) > 1 else 1.0
    extent = (time[0] - step / 2, time[-1] + step / 2, 0.5, tensor.shape[0] + 0.5)
    image = ax.imshow(
        tensor,
        origin="lower",
        aspect="auto",
        extent=extent,
        norm=norm,
        cmap=colours,
        interpolation="nearest",
    )
    _remember(image, unit)
    ax.yaxis.set_major_locator(MaxNLocator(integer=True, min_n_ticks=1))
    if labels:
        ax.set_xlabel("time [ms]")
        ax.set_ylabel("sensor (base → tip)")
    return image


@checked
def plot_tensor_grid(
    tensors: list[list[np.ndarray]],
    time: np.ndarray,
    ax: Axes,
    norm: Normalize,
    rows: list[str],
    columns: list[str],
    unit: str = "/mm",
) -> AxesImage:
    """Small multiples (row, column) of tensors as one picture on one colour scale; time [ms] under
    every column.

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
    step = float(time[1] - time[0]) if len(time) > 1 else 1.0
    grid = {
        "rows": rows,
        "columns": columns,
        "wide": wide,
        "high": high,
        "sensors": n_sensors,
        "start": float(time[0]),
    }
    _remember(image, unit, grid | {"step": step})
    last_row = high * (len(rows) - 1)  # numbers beside every row would meet in a low picture
    levels = [(last_row + n_sensors - end, str(end)) for end in (1, n_sensors)]
    ax.set_yticks([high * i + n_sensors / 2 for i in range(len(rows))], rows)
    ax.set_yticks([place for place, _ in levels], [words for _, words in levels], minor=True)
    last = n_samples - 1
    marks = [
        (wide * j + sample, f"{time[sample]:.0f}")
        for j in range(len(columns))
        for sample in (0, last)
    ]
    ax.set_xticks([place for place, _ in marks], [words for _, words in marks])
    for label, at_end in zip(ax.get_xticklabels(), [False, True] * len(columns), strict=True):
        label.set_horizontalalignment("right" if at_end else "left")
    ax.tick_params(axis="y", which="major", pad=16)
    ax.tick_params(axis="y", which="minor", labelsize=7)
    top = ax.secondary_xaxis("top")
    top.set_xticks([wide * j + n_samples / 2 for j in range(len(columns))], columns)
    for axis in (ax, top):
        axis.tick_params(length=2, which="both")
        axis.spines[:].set_visible(False)
    return image


def _remember(image: AxesImage, unit: str, grid: dict[str, Any] | None = None) -> None:
    image.set_gid(_GID)
    image.tensor = {"unit": unit, "grid": grid}  # type: ignore[attr-defined]


def list_tensors(figure: Figure) -> list[dict[str, Any]]:
    """Where each tensor stands in a figure that is laid out, and what its colours mean: so a page
    can tell values.
    """
    found = []
    for ax in figure.axes:
        for image in ax.images:
            if image.get_gid() == _GID:
                low, high = image.norm.vmin, image.norm.vmax
                colours = (
                    np.round(255 * image.get_cmap()(np.linspace(0, 1, _LEVELS))[:, :3])
                    .astype(int)
                    .ravel()
                    .tolist()
                )
                place = {
                    "box": [round(v, 5) for v in ax.get_position().bounds],
                    "x": ax.get_xlim(),
                    "y": ax.get_ylim(),
                }
                known: dict[str, Any] = image.tensor  # type: ignore[attr-defined]
                found.append(place | {"low": low, "high": high, "colours": colours} | known)
    return found
