"""Fig. 1A as a drawing: which sensors a touch of the run activates, by the antenna's stiffness."""

from collections.abc import Mapping

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from feeler.antenna.segments import Antenna
from feeler.objects import Trial, place
from feeler.plotting.antennas import OBJECT_COLOUR, make_patch, plot_posture
from feeler.plotting.style import PALETTE
from feeler.report.page import Section
from feeler.tensors.transforms import in_unit, reconstruct_posture

_ACTIVE, _SILENT = PALETTE[1], "#BBBBBB"


def count_active(tensors: xr.Dataset, threshold: float) -> np.ndarray:
    """Sensors whose angle [rad] is beyond a threshold (time, sensor) in a Dataset of one touch."""
    return in_unit(tensors["angle"], "rad").transpose("trial", "time", "sensor").values[0] > (
        threshold
    )


def plot(
    antenna: Antenna,
    trial: Trial,
    touched: Mapping[float, xr.Dataset],
    threshold: float,
    figure: Figure,
) -> None:
    """The moment of most active sensors, a panel for each stiffness; ``touched`` by factor."""
    axes = figure.subplots(1, len(touched), sharex=True, sharey=True)
    for ax, (factor, tensors) in zip(axes, touched.items(), strict=True):
        active = count_active(tensors, threshold)
        now = int(active.sum(axis=1).argmax())
        _draw(antenna, trial, tensors, now, active[now], ax)
        words = "its own stiffness" if factor == 1 else f"{factor:g} × as stiff"
        ax.set_title(f"{words}\n{active[now].sum()} of {active.shape[1]} sensors active")
    marks = [
        Line2D([], [], color=colour, marker="o", ls="", ms=3, label=label)
        for colour, label in ((_ACTIVE, f"angle > {threshold:g} rad"), (_SILENT, "less"))
    ]
    met = Patch(color=OBJECT_COLOUR, label="object")
    figure.legend(handles=[*marks, met], loc="outside lower center", ncols=3)


def _draw(
    antenna: Antenna, trial: Trial, tensors: xr.Dataset, now: int, active: np.ndarray, ax: Axes
) -> None:
    points = reconstruct_posture(tensors, antenna).values[0, now]
    placed, time = place(antenna, trial), in_unit(tensors["time"], "ms").values[now]
    ax.add_patch(
        make_patch(trial.shape, placed.origin + placed.velocity * time, placed.forward)
    )
    plot_posture(points, ax, lw=1.5)
    sensors = points[antenna.sensors - 1]
    for chosen, colour in ((~active, _SILENT), (active, _ACTIVE)):
        ax.plot(*sensors[chosen].T, "o", ms=2.2, color=colour, zorder=4)
    ax.set(aspect="equal", xlim=(-0.25 * antenna.length, 0.75 * antenna.length))
    ax.axis("off")


def show(
    section: Section,
    antenna: Antenna,
    trial: Trial,
    touched: Mapping[float, xr.Dataset],
    threshold: float,
) -> None:
    """The drawing, and how many sensors are active over time."""
    section.figure(
        "fig1_compliance",
        f"One touch ({trial.label}) of an antenna with other stiffness, each at the moment at which"
        " most sensors are active. The object's path is the same for all. (Fig. 1A)",
        lambda figure: plot(antenna, trial, touched, threshold, figure),
        height=2.8,
        numbers={
            f"{factor:g}": count_active(tensors, threshold).sum(axis=1)
            for factor, tensors in touched.items()
        },
    )
