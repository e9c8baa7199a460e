"""Beside Fig. 5: where along the antenna slow touches bend each profile, and how many sensors share
it (Results 5 on the cantilever; no figure of the paper).
"""

from collections.abc import Mapping
from types import SimpleNamespace

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from feeler.analysis import Interval
from feeler.analysis.dispersion import bootstrap_mean
from feeler.antenna.segments import Antenna
from feeler.encoding import hoyer_sparseness
from feeler.experiments.tactile import DURATION
from feeler.plotting.results import plot_groups
from feeler.plotting.style import PALETTE, PROFILE_COLOURS
from feeler.report import Section, make_spread
from feeler.tensors import in_unit, rectify
from paper.context import Context
from paper.data import list_profiles, load_complete
from paper.window import WINDOWS, measure_window

_PROXIMAL = 0.1  # [C] share of the length that counts as the base
_SHARED = ("in a touch", "over all touches")
_N_RESAMPLES = 2000


def compute(tensors: xr.Dataset, antenna: Antenna) -> dict[str, SimpleNamespace]:
    """Where the antenna bends, in either window.

    Bending of a sensor is its curvature, negative values set to 0, summed over a touch.

    Returns
    -------
    dict[str, SimpleNamespace]
        By window: ``share`` of each sensor in a touch's bending (trial, sensor), and ``top``, the
        place that bends most, as a share of the length (trial,).
    """
    time = in_unit(tensors["time"], "ms").values
    curvature = in_unit(tensors["curvature"], "1/mm").transpose("trial", "sensor", "time")
    found = {}
    for window, end in zip(WINDOWS, (DURATION, measure_window(tensors).end), strict=True):
        bending = rectify(curvature.values[:, :, time < end]).sum(axis=2)
        share = bending / bending.sum(axis=1, keepdims=True)
        found[window] = SimpleNamespace(
            share=share, top=place_sensors(antenna)[share.argmax(axis=1)]
        )
    return found


def place_sensors(antenna: Antenna) -> np.ndarray:
    """Place of every sensor (sensor,), as a share of the length."""
    return antenna.hinge_position[antenna.sensors - 1] / antenna.length


def measure_recruitment(share: np.ndarray) -> dict[str, Interval]:
    """Hoyer sparseness of the sensors' bending, with its interval over touches: of each touch, and
    of the mean of all.
    """
    rng = np.random.default_rng(0)
    picks = rng.integers(len(share), size=(_N_RESAMPLES, len(share)))
    drawn = hoyer_sparseness(share[picks].mean(axis=1))
    low, high = np.quantile(drawn, [0.025, 0.975])
    value = float(hoyer_sparseness(share.mean(axis=0)))
    return {
        _SHARED[0]: bootstrap_mean(hoyer_sparseness(share), rng),
        _SHARED[1]: Interval(estimate=value, low=float(low), high=float(high)),
    }


def plot(
    data: Mapping[str, Mapping[str, SimpleNamespace]],
    antennas: Mapping[str, Antenna],
    location: np.ndarray,
    figure: Figure,
) -> None:
    """Bending along each antenna, where each touch bends it most, and how many sensors share it."""
    left, middle, right = figure.subplots(1, 3, width_ratios=(1.2, 1, 1.2))
    for k, (name, windows) in enumerate(data.items()):
        whole = windows[WINDOWS[1]]
        colour = PROFILE_COLOURS.get(name, PALETTE[k % len(PALETTE)])
        place = 100 * place_sensors(antennas[name])
        left.plot(place, 100 * whole.share.mean(axis=0), color=colour, label=name)
        shift = 0.8 * (k - (len(data) - 1) / 2)  # so that equal points do not cover each other
        middle.plot(
            100 * location + shift, 100 * whole.top, ".", ms=4, color=colour, label=name
        )
    for span in (left.axvspan, middle.axhspan):
        span(0, 100 * _PROXIMAL, color="#DDDDDD", lw=0, label="base: a tenth of the length")
    middle.plot([0, 100], [0, 100], ":", lw=0.8, color="#59636e", label="at the contact")
    left.set(xlabel="place [% of the length]", ylabel="share of a touch's bending [%]")
    left.set_title("A  bending along the antenna", loc="left")
    middle.set(xlabel="contact [% of the length]", ylabel="bends most at [% of the length]")
    middle.set(xlim=(40, 100), ylim=(-3, 103))
    middle.set_title("B  where a touch bends it most", loc="left")
    _plot_sharing(data, right)
    figure.legend(*_join(left, middle), loc="outside lower center", ncols=6, fontsize=7)


def _join(*axes: Axes) -> tuple[list, list]:
    """Handles and labels of all axes, each label once."""
    found = {
        label: handle
        for ax in axes
        for handle, label in zip(*ax.get_legend_handles_labels(), strict=True)
    }
    return [*found.values()], [*found]


def _plot_sharing(data: Mapping[str, Mapping[str, SimpleNamespace]], ax: Axes) -> None:
    sets = [
        {
            name: (
                hoyer_sparseness(windows[WINDOWS[1]].share)
                if shared == _SHARED[0]
                else np.array([]),
                measure_recruitment(windows[WINDOWS[1]].share)[shared],
            )
            for name, windows in data.items()
        }
        for shared in _SHARED
    ]
    plot_groups(sets, ax)
    ax.set_xticks(np.arange(2) * (len(data) + 1) + (len(data) - 1) / 2, _SHARED)
    ax.set(ylabel="Hoyer sparseness of the bending", ylim=(0, None))
    ax.set_title("C  less: more sensors share it", loc="left")


def show(context: Context, section: Section) -> None:
    """Where every profile bends, and how distributed its bending is."""
    names = list_profiles(context)
    if len(names) < 2:
        return
    antennas = {name: context.profiles[name] for name in names}
    sets = {name: load_complete(context, name) for name in names}
    data = {name: compute(tensors, antennas[name]) for name, tensors in sets.items()}
    section.heading("Where the antenna bends")
    section.figure(
        "fig5_bending",
        "Complete slow touches. A: share of the sensors in a touch's bending (curvature summed over"
        " the touch), mean of all touches. B: place of the greatest bending of every touch against"
        " the place of contact. C: Hoyer sparseness of the sensors' bending, of every touch (dots)"
        " and of the mean over all touches.",
        lambda figure: plot(data, antennas, sets[names[0]]["location"].values, figure),
        height=2.9,
        numbers={
            name: {window: vars(found) for window, found in windows.items()}
            for name, windows in data.items()
        },
    )
    for name, windows in data.items():
        for window, found in windows.items():
            section.values[f"bending.{window}.base.{name}"] = {
                "value": float(np.mean(found.top < _PROXIMAL)),
                "n": len(found.top),
            }
            for shared, mean in measure_recruitment(found.share).items():
                section.values[f"bending.{window}, {shared}.{name}"] = make_spread(
                    mean.estimate, mean.low, mean.high, n=len(found.share)
                )
