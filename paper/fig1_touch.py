"""Fig. 1B, E as a drawing: how one touch of the run becomes a tactile tensor."""

from collections.abc import Sequence

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.colors import Normalize
from matplotlib.figure import Figure

from feeler.antenna.segments import Antenna
from feeler.objects import Trial, place
from feeler.objects.trials import SPEEDS
from feeler.plotting.antennas import MovingAntenna, make_patch
from feeler.plotting.style import mark_panels
from feeler.plotting.tensors import plot_tensor, take_curvature
from feeler.report.page import Section
from feeler.tensors.transforms import compute_bend, in_unit, reconstruct_posture
from paper.context import Context
from paper.data import list_profiles, list_touches, load_tensors

_CORNER = (6, 8)  # sensors and samples that are drawn large


def choose_moments(tensor: np.ndarray, count: int = 4) -> list[int]:
    """Samples at even distances from the first to the last in which a tensor (sensor, time) has a
    tenth of its greatest value.
    """
    felt = np.flatnonzero(tensor.max(axis=0) >= 0.1 * tensor.max())
    return [int(k) for k in np.linspace(felt[0], felt[-1], count).round()]


def plot(antenna: Antenna, trial: Trial, tensors: xr.Dataset, figure: Figure) -> None:
    """Four moments with what the sensors feel then, and the tensor that these columns make."""
    tensor, time = take_curvature(tensors)[0], in_unit(tensors["time"], "ms").values
    norm = Normalize(0.0, max(float(tensor.max()), 1e-9))
    grid = figure.add_gridspec(2, 8, height_ratios=(1, 1), width_ratios=(1, 0.08) * 4)
    moments = choose_moments(tensor)
    for k, now in enumerate(moments):
        ax = figure.add_subplot(grid[0, 2 * k])
        draw_moment(antenna, trial, tensors, now, ax, norm)
        ax.set_title(f"{k + 1}: {time[now]:.0f} ms")
        _draw_column(tensor[:, now], figure.add_subplot(grid[0, 2 * k + 1]), norm)
    whole = figure.add_subplot(grid[1, :6])
    mark_panels((figure.axes[0], whole), "be")
    image = plot_tensor(tensor, time, whole, norm)
    whole.set_xticks(time[moments], [f"{k + 1}" for k in range(len(moments))])
    whole.set(
        xlabel="time; the four moments above", title="the tensor: a column for each moment"
    )
    corner = figure.add_subplot(grid[1, 6:])
    _draw_corner(tensor, time, antenna, corner, norm)
    figure.colorbar(image, ax=corner, label="curvature [1/mm]")


def _draw_column(values: np.ndarray, ax: Axes, norm: Normalize) -> None:
    """What all sensors feel at one moment, base at the bottom."""
    ax.imshow(
        values[:, None], origin="lower", aspect="auto", norm=norm, interpolation="nearest"
    )
    ax.set(xticks=[], yticks=[])
    ax.spines[:].set_visible(True)


def _draw_corner(
    tensor: np.ndarray, time: np.ndarray, antenna: Antenna, ax: Axes, norm: Normalize
) -> None:
    """A few sensors and samples around the greatest value, so large that each is seen."""
    sensor, sample = np.unravel_index(tensor.argmax(), tensor.shape)
    first = [
        int(np.clip(at - size // 2, 0, whole - size))
        for at, size, whole in zip((sensor, sample), _CORNER, tensor.shape, strict=True)
    ]
    part = tensor[first[0] :, first[1] :][: _CORNER[0], : _CORNER[1]]
    ax.imshow(part, origin="lower", aspect="auto", norm=norm, interpolation="nearest")
    ax.set_xticks(np.arange(part.shape[1] + 1) - 0.5, [])
    ax.set_yticks(np.arange(part.shape[0] + 1) - 0.5, [])
    ax.tick_params(length=0)
    ax.grid(color="#888888", lw=0.4)
    spacing = antenna.length / antenna.sensors.size
    ax.set(
        xlabel=f"Δt = {time[1] - time[0]:g} ms",
        ylabel=f"Δx ≈ {spacing:.2g} mm",
        title="its greatest value",
    )


def show(context: Context, section: Section) -> None:
    """A slow touch of the first profile."""
    name = list_profiles(context)[0]
    touches = list_touches(context, name)
    number = find_touch(touches, SPEEDS["slow"])
    tensors = load_tensors(context, name).isel(trial=[number])
    section.figure(
        "fig1_touch",
        f"A {touches[number].label} and its tensor. Above: the antenna at four moments, coloured by"
        " its curvature, with what its sensors feel then as a column beside it, base at the bottom."
        " Below: all columns one after another; on the right a part of it enlarged, in which Δx is"
        " the mean distance of neighbouring sensors and Δt the time between samples. (Fig. 1B, E)",
        lambda figure: plot(context.profiles[name], touches[number], tensors, figure),
        height=4.0,
        numbers={"curvature": take_curvature(tensors)[0]},
    )


# A touch of the run as a drawing: the antenna and the object at one moment, to scale.


def find_touch(touches: Sequence[Trial], speed: float) -> int:
    """The number of a touch that shows most: of the first kind of object the greater one, at the
    place nearest the base.
    """
    asked = [k for k, one in enumerate(touches) if one.speed == speed]
    kind = touches[asked[0]].feature.kind
    same = [k for k in asked if touches[k].feature.kind == kind]
    return min(same, key=lambda k: (touches[k].location, -touches[k].feature.size))


def draw_moment(
    antenna: Antenna,
    trial: Trial,
    tensors: xr.Dataset,
    now: int,
    ax: Axes,
    norm: Normalize,
) -> MovingAntenna:
    """Antenna and object at sample ``now`` of a touch, coloured by its curvature, without frame;
    ``tensors`` holds this one touch.
    """
    reach = antenna.length
    left = max(0.16 * reach, 2.2 * trial.feature.size)
    ax.set(xlim=(-left, 0.86 * reach), ylim=(-0.03 * reach, 1.08 * reach), aspect="equal")
    ax.axis("off")
    placed, time = place(antenna, trial), in_unit(tensors["time"], "ms").values[now]
    ax.add_patch(
        make_patch(trial.shape, placed.origin + placed.velocity * time, placed.forward)
    )
    drawn = MovingAntenna(antenna, ax, norm)
    posture = reconstruct_posture(tensors, antenna).values[0, now]
    drawn.move(posture, compute_bend(tensors, antenna)[now])
    return drawn
