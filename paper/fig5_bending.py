"""Beside Fig. 5: where along the antenna slow touches bend each profile, and how many sensors share
it (Results 5 on the cantilever; no figure of the paper).
"""

from types import SimpleNamespace

import numpy as np
import xarray as xr

from feeler.analysis import Interval
from feeler.analysis.dispersion import bootstrap_mean
from feeler.antenna.segments import Antenna
from feeler.encoding import hoyer_sparseness
from feeler.experiments.tactile import DURATION
from feeler.report import Section, make_spread
from feeler.tensors import in_unit, rectify
from paper.context import Context
from paper.data import list_profiles, load_complete
from paper.window import WINDOWS, find_end

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
    for window, end in zip(WINDOWS, (DURATION, find_end(tensors)), strict=True):
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


def show(context: Context, section: Section) -> None:
    """Where every profile bends, and how distributed its bending is."""
    names = list_profiles(context)
    if len(names) < 2:
        return
    antennas = {name: context.profiles[name] for name in names}
    sets = {name: load_complete(context, name) for name in names}
    data = {name: compute(tensors, antennas[name]) for name, tensors in sets.items()}
    section.heading("Where the antenna bends")
    rows = []
    for name, windows in data.items():
        for window, found in windows.items():
            section.values[f"bending.{window}.base.{name}"] = {
                "value": float(np.mean(found.top < _PROXIMAL)),
                "n": len(found.top),
            }
            means = measure_recruitment(found.share)
            for shared, mean in means.items():
                section.values[f"bending.{window}, {shared}.{name}"] = make_spread(
                    mean.estimate, mean.low, mean.high, n=len(found.share)
                )
            at_base = float(np.mean(found.top < _PROXIMAL))
            rows.append([name, window, at_base, *(mean.estimate for mean in means.values())])
    section.table(
        ["profile", "window", "bends most in its proximal tenth", *_SHARED],
        rows,
        "Share of slow touches that bend the antenna most near its base, and Hoyer sparseness of"
        " the"
        " sensors' bending (curvature summed over the touch; less: more sensors share it).",
    )
