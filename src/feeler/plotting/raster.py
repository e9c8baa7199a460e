"""Draw spikes: a raster of units over time, and how often all of them fire."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from feeler.checked import checked
from feeler.errors import InvalidInput
from feeler.plotting.look import PALETTE


@checked
def plot_raster(
    times: np.ndarray, ax: Axes, side: np.ndarray | None = None, lead: float = 0.0
) -> None:
    """Spikes of one trial (unit, event) [ms], a row for each unit, from base to tip.

    Parameters
    ----------
    times
        NaN beyond a unit's last spike.
    side
        (unit,) 1 or −1; units of the two sides share rows and differ in colour.
    lead
        Time of contact [ms], marked.
    """
    times = np.asarray(times)
    if times.ndim != 2:
        raise InvalidInput(f"times must be (unit, event), got shape {times.shape}.")
    sides = np.ones(len(times), dtype=int) if side is None else np.asarray(side)
    for colour, one in zip(PALETTE, (1, -1), strict=False):
        rows = times[sides == one]
        unit, event = np.nonzero(np.isfinite(rows))
        name = "+x" if one == 1 else "−x"
        where, words = rows[unit, event], f"bent towards {name}"
        ax.plot(where, unit + 1, "|", color=colour, ms=2.5, mew=0.6, label=words)
    ax.axvline(lead, color="0.6", lw=0.6)
    ax.set(xlabel="time [ms]", ylabel="unit (base → tip)")
    ax.set_ylim(0.5, max(np.sum(sides == one) for one in (1, -1)) + 0.5)


@checked
def plot_touch_spikes(
    tensor: np.ndarray,
    times: np.ndarray,
    rate: np.ndarray,
    time: np.ndarray,
    side: np.ndarray,
    figure: Figure,
    lead: float = 0.0,
) -> None:
    """One touch: what is felt (sensor, time) [degrees], spikes (unit, event) [ms] below it, and the
    mean rate of all units (unit, time) [Hz].
    """
    axes = figure.subplots(3, 1, sharex=True, height_ratios=(2, 2, 1))
    edges = (*(time[0], time[-1]), 0.5, len(tensor) + 0.5)
    largest = np.abs(tensor).max()
    image = axes[0].imshow(
        tensor, aspect="auto", origin="lower", extent=edges, cmap="RdBu_r", interpolation="nearest"
    )
    image.set_clim(-largest, largest)
    figure.colorbar(image, ax=axes[0], label="angle [°]")
    axes[0].set_ylabel("sensor (base → tip)")
    plot_raster(times, axes[1], side, lead)
    axes[1].set_xlabel("")
    axes[1].legend(loc="upper right", markerscale=3)
    axes[2].plot(time, rate.mean(axis=0), color="black", lw=0.8)
    axes[2].set(xlabel="time [ms]", ylabel="mean rate [Hz]", xlim=(time[0], time[-1]))
    figure.align_ylabels(axes)
