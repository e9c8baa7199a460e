"""Draw spikes: a raster of units over time, and how often all of them fire."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from feeler.errors import InvalidInput
from feeler.plotting.look import PALETTE
from feeler.records.checked import checked


@checked
def plot_raster(
    times: np.ndarray,
    ax: Axes,
    side: np.ndarray | None = None,
    lead: float = 0.0,
    around: np.ndarray | None = None,
) -> None:
    """Spikes of one trial (unit, event) [ms], a row for each unit, from base to tip.

    Parameters
    ----------
    times
        NaN beyond a unit's last spike.
    side
        (unit,) 1 or −1; units of different sides share rows and differ in colour.
    lead
        Time of contact [ms], marked.
    around
        (unit,) where side 1 lies around the antenna, from x towards z [degrees].
    """
    times = np.asarray(times)
    if times.ndim != 2:
        raise InvalidInput(f"times must be (unit, event), got shape {times.shape}.")
    sides = np.ones(len(times), dtype=int) if side is None else np.asarray(side)
    turns = np.zeros(len(times)) if around is None else np.asarray(around)
    drawn = [(turn, one) for turn in np.unique(turns) for one in (1, -1)]
    members = [(turns == turn) & (sides == one) for turn, one in drawn]
    for k, (turn, one) in enumerate(drawn):
        rows = times[members[k]]
        unit, event = np.nonzero(np.isfinite(rows))
        where, words = rows[unit, event], f"bent towards {_name_side(turn, one)}"
        colour = PALETTE[k % len(PALETTE)]
        ax.plot(where, unit + 1, "|", color=colour, ms=2.5, mew=0.6, label=words)
    ax.axvline(lead, color="0.6", lw=0.6)
    ax.set(xlabel="time [ms]", ylabel="unit (base → tip)")
    ax.set_ylim(0.5, max(map(np.sum, members)) + 0.5)


def _name_side(turn: float, side: int) -> str:
    """What a side is called: by its axis, or by its angle around the antenna."""
    angle = (turn + (0.0 if side == 1 else 180.0)) % 360.0
    return {0.0: "+x", 90.0: "+z", 180.0: "−x", 270.0: "−z"}.get(angle, f"{angle:g}°")


@checked
def plot_touch_spikes(
    tensor: np.ndarray,
    times: np.ndarray,
    rate: np.ndarray,
    time: np.ndarray,
    side: np.ndarray,
    figure: Figure,
    lead: float = 0.0,
    around: np.ndarray | None = None,
) -> None:
    """One touch: what is felt (sensor, time) [degrees], in space (plane, sensor, time) of which the
    bending towards x and z is drawn; spikes (unit, event) [ms] below it; and the mean rate of all
    units (unit, time) [Hz].
    """
    felt = tensor[:2] if tensor.ndim == 3 else tensor[None]
    axes = figure.subplots(
        len(felt) + 2, 1, sharex=True, height_ratios=(*[2] * len(felt), 2, 1)
    )
    names = ("angle [°]",) if len(felt) == 1 else ("angle towards x [°]", "angle towards z [°]")
    largest = np.abs(felt).max()
    for ax, plane, name in zip(axes, felt, names, strict=False):
        _draw_felt(plane, time, ax, name, largest)
    spikes, mean = axes[-2:]
    plot_raster(times, spikes, side, lead, around)
    spikes.set_xlabel("")
    spikes.legend(loc="upper right", markerscale=3)
    mean.plot(time, rate.mean(axis=0), color="black", lw=0.8)
    mean.set(xlabel="time [ms]", ylabel="mean rate [Hz]", xlim=(time[0], time[-1]))
    figure.align_ylabels(axes)


def _draw_felt(
    plane: np.ndarray, time: np.ndarray, ax: Axes, name: str, largest: float
) -> None:
    """The bending of every sensor (sensor, time) as colours."""
    edges = (*(time[0], time[-1]), 0.5, len(plane) + 0.5)
    image = ax.imshow(
        plane,
        aspect="auto",
        origin="lower",
        extent=edges,
        cmap="RdBu_r",
        interpolation="nearest",
    )
    image.set_clim(-largest, largest)
    ax.figure.colorbar(image, ax=ax, label=name)
    ax.set_ylabel("sensor (base → tip)")
