"""Tactile tensors and the antenna that felt them, as pictures and movies."""

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import xarray as xr
from annotated_types import Len
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.colors import FuncNorm, Normalize
from matplotlib.figure import Figure
from matplotlib.image import AxesImage
from matplotlib.patches import PathPatch, Rectangle
from matplotlib.text import Text
from matplotlib.ticker import MaxNLocator

from feeler.antenna.segments import Antenna
from feeler.objects import Trial, place
from feeler.plotting.antennas import (
    FPS,
    SLOWER,
    MovingAntenna,
    SpaceScene,
    add_space,
    choose_frames,
    make_patch,
    say_clock,
    write_movie,
)
from feeler.plotting.style import BOTH_COLOURS, TENSOR_COLOURS, style
from feeler.tensors.transforms import (
    compute_bend,
    find_right,
    get_bending,
    in_unit,
    measure_peak,
    reconstruct_posture,
    require_variables,
)
from feeler.validation import checked

# Draw tactile tensors: sensors from base (bottom) to tip (top) over time.

_GID = "tensor"
_LEVELS = 64  # of a colour scale that a page knows
_BOTH = 0.5  # of the peak; greater bending towards the object is drawn as well [C]
_REST = 0.05  # of the peak; a touch is shown until no sensor changes by more [C]
_WHOLE = 0.8  # of a record; one that changes for longer is shown to its end [C]


def choose_scale(*tensors: np.ndarray, both: bool = False) -> tuple[Normalize, str]:
    """Colour scale for bending away from an object (sensor, time), and the name of its colours:
    from 0 to the peak of all tensors; or, if ``both`` or where the antenna bends towards the object
    by more than half of that as well, from −peak to peak.

    Colours go by the square root, so that the many sensors that bend little are seen beside the few
    that bend most.
    """
    top = max(measure_peak(*tensors), 1e-9)
    low = min(float(np.nanmin(one, initial=0.0)) for one in tensors)
    functions = (lambda x: np.sign(x) * np.sqrt(np.abs(x)), lambda x: np.sign(x) * x**2)
    if both or low < -_BOTH * top:
        return FuncNorm(functions, -top, top), BOTH_COLOURS
    return FuncNorm(functions, 0.0, top), TENSOR_COLOURS


def name_scale(label: str, norm: Normalize) -> str:
    """What the colours of :func:`choose_scale` mean; ``label`` names the quantity."""
    return f"{label}\ncolours by square root{'' if norm.vmin else '; negative as 0'}"


def _find_end(tensor: np.ndarray, time: np.ndarray) -> float:
    """Until when [ms] a tensor (sensor, time) is shown: a tenth longer than any sensor is off its
    last value by more than 5 % of the peak.
    """
    off = np.abs(np.nan_to_num(tensor - tensor[:, -1:])) > _REST * measure_peak(tensor)
    last = int(1.1 * np.flatnonzero(off.any(axis=0)).max(initial=0))
    return float(time[last if 0 < last < _WHOLE * len(time) else -1])


def _say_rest(end: float, time: np.ndarray) -> str:
    """What is not shown, if anything."""
    if end == time[-1]:
        return ""
    return (
        f"recorded to {time[-1]:.0f} ms: after this, changes stay below {_REST:.0%} of the peak"
    )


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
    image = ax.imshow(
        tensor,
        origin="lower",
        aspect="auto",
        extent=(time[0] - step / 2, time[-1] + step / 2, 0.5, tensor.shape[0] + 0.5),
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
                shares = (np.arange(_LEVELS) + 0.5) / _LEVELS
                values = [float(f"{value:.4g}") for value in image.norm.inverse(shares)]  # type: ignore[attr-defined]
                colours = np.round(255 * image.get_cmap()(shares)[:, :3]).astype(int).ravel()
                place = {
                    "box": [round(v, 5) for v in ax.get_position().bounds],
                    "x": ax.get_xlim(),
                    "y": ax.get_ylim(),
                }
                known: dict[str, Any] = image.tensor  # type: ignore[attr-defined]
                found.append(place | {"values": values, "colours": colours.tolist()} | known)
    return found


# One touch, drawn: its tensor as a picture, and the antenna meeting the feature while its
# tensor grows as a movie.


@checked
def plot_touch(tensors: xr.Dataset, figure: Figure) -> None:
    """The curvature away from the object of a Dataset's first touch, (sensor, time)."""
    values, ax = take_curvature(tensors)[0], figure.subplots()
    time = in_unit(tensors["time"], "ms").values
    norm, colours = choose_scale(values)
    image = plot_tensor(values, time, ax, norm, colours=colours)
    end = _find_end(values, time)
    ax.set(xlim=(None, end), xlabel=f"time [ms]\n{_say_rest(end, time)}".strip())
    figure.colorbar(image, ax=ax, label=_name_curvature([tensors], norm))


def _name_curvature(sets: Sequence[xr.Dataset], norm: Normalize) -> str:
    """What the colours of some touches mean."""
    if any("plane" in one.dims for one in sets):
        return "curvature of both planes [1/mm]\ncolours by square root"
    known = all(find_right(one) is not None for one in sets)
    label = "curvature away from the object [1/mm]" if known else "curvature [1/mm]"
    return name_scale(label, norm)


def take_curvature(tensors: xr.Dataset) -> np.ndarray:
    """Curvature away from the object (trial, sensor, time) [1/mm]; in space the length of its
    vector of both planes.
    """
    require_variables(tensors, "curvature")
    found = get_bending(in_unit(tensors["curvature"], "1/mm"))
    return found.transpose("trial", "sensor", "time").values


class _View:
    """A touch as it goes on: the antenna meets the feature in one axes while its tensor grows in
    the other.
    """

    def __init__(
        self,
        antenna: Antenna,
        trial: Trial | None,
        tensors: xr.Dataset,
        scale: tuple[Normalize, str],
        axes: Sequence[Axes],
    ) -> None:
        self.points = reconstruct_posture(tensors, antenna).values[0]
        self.bend = compute_bend(tensors, antenna)
        self.time = in_unit(tensors["time"], "ms").values
        sensed = np.isin(tensors["segment"].values, antenna.sensors)
        self.tensor = take_curvature(tensors)[0][sensed]
        self.ax, below = axes
        norm, colours = scale
        self.space = SpaceScene(antenna, self.ax, norm) if antenna.spatial else None
        self.trial, self.placement = trial, None if trial is None else place(antenna, trial)
        self.image = plot_tensor(self.tensor, self.time, below, norm, colours=colours)
        self.end = _find_end(self.tensor, self.time)
        self.hide_rest = _cover(self.image)
        if self.space is not None:
            return
        reach = antenna.length
        left, right = _find_width(self.points[..., 0] / reach)
        self.ax.set(
            xlim=(left * reach, right * reach),
            ylim=(-0.06 * reach, 1.1 * reach),
            aspect="equal",
        )
        self.antenna = MovingAntenna(antenna, self.ax, norm, colours)
        self.patches: list[PathPatch] = []

    def move(self, time: float) -> list[Artist]:
        """Artists changed to a time [ms]."""
        now = min(int(np.searchsorted(self.time, time - 1e-9)), len(self.time) - 1)
        if self.trial is not None and self.placement is not None:
            origin = self.placement.origin + self.placement.velocity * self.time[now]
            if self.space is not None:
                self.space.place(self.trial.shape, origin, self.placement.axes)
        if self.space is not None:
            self.space.move(self.points[now], self.bend[now])
            self.hide_rest(now)
            return []
        if self.trial is not None and self.placement is not None:
            patch = make_patch(self.trial.shape, origin, self.placement.forward)
            if not self.patches:
                self.patches = [patch]
                self.ax.add_artist(patch)
            self.patches[0].set_path(patch.get_path())
        moved = self.antenna.move(self.points[now], self.bend[now])
        return [*self.hide_rest(now), *self.patches, *moved]


def _find_width(x: np.ndarray) -> tuple[float, float]:
    """Ends of what is shown across, given where the antenna goes, both over its length: more room
    on the side to which it bends farther, or as much on both.
    """
    wide, narrow, left, right = 0.72, 0.2, -float(x.min()), float(x.max())
    if min(left, right) > narrow:
        return -wide, wide
    return (-narrow, wide) if right >= left else (-wide, narrow)


def _cover(image: AxesImage) -> Callable[[int], list[Artist]]:
    """A function that hides what comes after a sample, and gives what it changed."""
    ax = image.axes
    assert ax is not None
    left, right, low, high = image.get_extent()
    cover = Rectangle((right, low), 0.0, high - low, fc=ax.get_facecolor(), lw=0)
    ax.add_artist(cover)
    edges = list(ax.spines.values())  # drawn again, since the cover hides half of them

    def start(now: int) -> list[Artist]:
        begin = left + (now + 1) * (right - left) / image.get_size()[1]
        cover.set(x=begin, width=right - begin)
        return [cover, *edges]

    return start


@checked
def write_touch_movie(
    antenna: Antenna,
    trial: Trial | None,
    tensors: xr.Dataset,
    path: Path,
    *,
    slower: float = SLOWER,
    fps: int = FPS,
) -> Path:
    """Shape and feature left, growing tensor right; ``tensors`` holds one touch.

    What was recorded at the sensors alone is interpolated between them (``reconstruct_posture``);
    without a ``trial``, as of a recording, no feature is drawn.
    """
    with style():
        figure = Figure(figsize=(7.2, 3.6), layout="constrained")
        left, right = figure.subplots(1, 2, width_ratios=(1, 1.3))
        scale = choose_scale(*take_curvature(tensors))
        left = add_space(figure, left) if antenna.spatial else left
        view = _View(antenna, trial, tensors, scale, (left, right))
        left.set(xlabel="x [mm]", ylabel="y [mm]")
        left.set_title("" if trial is None else trial.label, fontsize=7)
        figure.colorbar(view.image, ax=right, label=_name_curvature([tensors], scale[0]))
        return _write([view], path, figure, right.set_title("0 ms"), slower, fps)


@checked
def write_touches_movie(
    antenna: Antenna,
    touches: Annotated[Mapping[str, tuple[Trial, xr.Dataset]], Len(1)],
    path: Path,
    *,
    slower: float = SLOWER,
    fps: int = FPS,
) -> Path:
    """Touches side by side on one clock and one colour scale, each antenna above its growing
    tensor.

    ``touches`` by title; each Dataset holds one touch recorded at every hinge. Narrow, so that a
    phone shows it legibly.
    """
    with style():
        figure = Figure(figsize=(4.6, 5.0), layout="constrained")
        axes = figure.subplots(2, len(touches), squeeze=False, height_ratios=(1.25, 1))
        sets = [tensors for _, tensors in touches.values()]
        scale = choose_scale(*map(take_curvature, sets))
        views = []
        for (title, (trial, tensors)), column in zip(touches.items(), axes.T, strict=True):
            column[0] = add_space(figure, column[0]) if antenna.spatial else column[0]
            views.append(_View(antenna, trial, tensors, scale, column))
            column[0].set_title(title, fontsize=9)
        for ax in axes[:, 1:].flat if not antenna.spatial else axes[1, 1:]:
            ax.set(ylabel="", yticklabels=[])
        axes[0, 0].set_ylabel("y [mm]")
        bar = figure.colorbar(
            views[0].image,
            ax=axes,
            location="bottom",
            label=_name_curvature(sets, scale[0]),
            aspect=50,
            pad=0.02,
        )
        bar.ax.tick_params(labelsize=8)
        return _write(views, path, figure, figure.suptitle("0 ms", fontsize=10), slower, fps)


def _write(
    views: Sequence[_View], path: Path, figure: Figure, clock: Text, slower: float, fps: int
) -> Path:
    time = max((view.time for view in views), key=lambda times: float(times[-1]))
    end = max(view.end for view in views)
    for view in views:
        assert view.image.axes is not None
        view.image.axes.set_xlim(right=min(end, float(view.time[-1])))
    figure.supxlabel(_say_rest(end, time), fontsize=7)
    time = time[time <= end]
    shown = time[choose_frames(time, slower=slower, fps=fps)]
    peaks = [
        view.time[np.nan_to_num(view.tensor).max(axis=0).argmax()] for view in views
    ]  # a film's still shows where they bend most
    still = int(np.searchsorted(shown, np.mean(peaks)).clip(max=len(shown) - 1))
    clock.set_text(
        say_clock(float(shown[-1]), slower)
    )  # as long as it gets: the place that it is laid out for

    def draw(k: int) -> list[Artist]:
        clock.set_text(say_clock(float(shown[k]), slower))
        moved = [artist for view in views for artist in view.move(float(shown[k]))]
        return [*moved, clock] if moved else []  # in space all is drawn anew

    return write_movie(path, figure, draw, len(shown), fps, still)
