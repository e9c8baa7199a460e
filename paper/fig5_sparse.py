"""Beside Fig. 5: how sparse tactile tensors are, and where the antenna bends."""

from collections.abc import Mapping
from types import SimpleNamespace

import numpy as np
import xarray as xr

from feeler.analysis.dispersion import Interval, bootstrap_mean
from feeler.antenna.segments import Antenna
from feeler.encoding import hoyer_sparseness
from feeler.experiments.tactile import DURATION
from feeler.objects.trials import SPEEDS
from feeler.report import Section, make_spread
from feeler.tensors import in_unit, rectify
from paper.context import Context
from paper.data import (
    CLAIMED,
    WINDOWS,
    cut_to_contact,
    cut_to_motion,
    cut_window,
    find_end,
    keep_whole,
    list_profiles,
    list_speeds,
    load_complete,
    load_tensors,
    select_speed,
)

# Beside Fig. 5: how sparse tactile tensors are, by contact speed and by stiffness profile
# (the abstract's claim; no figure of the paper).

SPANS = (*WINDOWS, "within each touch", "while it moves")
_Groups = Mapping[str, np.ndarray]
"""A number per touch (trial,), by speed or by profile."""


def measure(tensors: xr.Dataset) -> dict[str, np.ndarray]:
    """Hoyer sparseness of every touch (trial,) in every reading; each tensor of rectified angles is
    one vector. NaN for a touch that never meets the antenna.
    """
    return {
        span: np.concatenate([measure_hoyer(part) for part in parts])
        for span, parts in cut_spans(tensors).items()
    }


def cut_spans(tensors: xr.Dataset) -> dict[str, list[np.ndarray]]:
    """By span the rectified angles (trial, sensor, time), all touches together or one by one."""
    whole = [[cut_window(tensors)], [keep_whole(tensors)]]
    single = ([one[None] for one in cut(tensors)] for cut in (cut_to_contact, cut_to_motion))
    return dict(zip(SPANS, (*whole, *single), strict=True))


def measure_hoyer(tensors: np.ndarray) -> np.ndarray:
    """Hoyer sparseness of each tensor (trial,)."""
    return hoyer_sparseness(tensors.reshape(len(tensors), -1))


def _average(values: np.ndarray) -> Interval:
    return bootstrap_mean(values[np.isfinite(values)], np.random.default_rng(0))


def list_groups(context: Context) -> dict[str, dict[str, xr.Dataset]]:
    """Whole touches: of the first profile at every speed, and slow ones of every profile."""
    profiles = list_profiles(context)
    first = load_tensors(context, profiles[0])
    speeds = {
        name: load_complete(context, profiles[0])
        if speed == SPEEDS["slow"]
        else select_speed(first, speed)
        for name, speed in list_speeds(context, profiles[0]).items()
    }
    return {
        "speed": dict(reversed(speeds.items())),
        "profile": {name: load_complete(context, name) for name in profiles},
    }


def compute(context: Context) -> SimpleNamespace | None:
    """Sparseness of tensors, which the abstract says slow touch and the gradient raise: ``rows``,
    and a number per touch (trial,) by comparison, reading and group: ``found``.
    """
    measured = {
        comparison: {name: measure(data) for name, data in members.items()}
        for comparison, members in list_groups(context).items()
        if len(members) > 1
    }
    found = {
        comparison: {
            reading: {name: values[reading] for name, values in members.items()}
            for reading in SPANS
        }
        for comparison, members in measured.items()
    }
    rows: dict[str, object] = {}
    for reading, members in (one for readings in found.values() for one in readings.items()):
        rows |= _list_values(reading, members)
    return SimpleNamespace(rows=rows, found=found) if found else None


def show(data: SimpleNamespace, section: Section) -> None:
    """A table for each comparison."""
    section.heading("How sparse the tensors are")
    section.text(
        "The paper says that slow touch and the exponential gradient make tactile data sparser,"
        " and gives no number. Here sparseness is Hoyer's, by which the paper constrains its"
        " activations, whose own sparseness is therefore an input and not judged. A window that"
        " goes on after a touch adds zeros: so the window's sparseness stands beside that of whole"
        " touches, of the samples between a touch's first and last contact, and of those in which"
        " anything moves, which hold the swing after the touch."
    )
    for comparison, readings in data.found.items():
        section.table(
            [f"by {comparison}", *next(iter(readings.values()))],
            [[reading, *map(_say, members.values())] for reading, members in readings.items()],
            "Hoyer sparseness of tensors, mean and 95 % bootstrap interval over touches: in the"
            " paper's window, over each group's own shortest window that holds its touches whole,"
            " from a touch's first to its last contact, and while any sensor passes a hundredth of"
            " the tensor's peak.",
        )


def _say(values: np.ndarray) -> str:
    mean = _average(values)
    return f"{mean.estimate:.3f} ({mean.low:.3f} to {mean.high:.3f})"


def _list_values(reading: str, groups: _Groups) -> dict[str, object]:
    means = {name: _average(values) for name, values in groups.items()}
    others = {name: means[name].estimate for name in CLAIMED[1:] if name in means}
    if others:
        means["rival"] = means[max(others, key=others.__getitem__)]
    n = {name: int(np.isfinite(values).sum()) for name, values in groups.items()}
    return {
        f"sparsity.{reading}.{name}": make_spread(
            mean.estimate, mean.low, mean.high, n=n.get(name, min(n.values()))
        )
        for name, mean in means.items()
    }


# Beside Fig. 5: where along the antenna slow touches bend each profile, and how many sensors
# share it (Results 5 on the cantilever; no figure of the paper).

_PROXIMAL = 0.1  # [C] share of the length that counts as the base
_SHARED = ("in a touch", "over all touches")
_N_RESAMPLES = 2000


def measure_bending(tensors: xr.Dataset, antenna: Antenna) -> dict[str, SimpleNamespace]:
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
    low, high = np.quantile(hoyer_sparseness(share[picks].mean(axis=1)), [0.025, 0.975])
    value = float(hoyer_sparseness(share.mean(axis=0)))
    return {
        _SHARED[0]: bootstrap_mean(hoyer_sparseness(share), rng),
        _SHARED[1]: Interval(estimate=value, low=float(low), high=float(high)),
    }


def compute_bending(context: Context) -> SimpleNamespace | None:
    """Where every profile bends, and how distributed its bending is: ``rows``, and ``lines`` of a
    table.
    """
    names = list_profiles(context)
    if len(names) < 2:
        return None
    rows, lines = {}, []
    for name in names:
        windows = measure_bending(load_complete(context, name), context.profiles[name])
        for window, found in windows.items():
            n, base = len(found.top), float(np.mean(found.top < _PROXIMAL))
            means = measure_recruitment(found.share)
            rows[f"bending.{window}.base.{name}"] = {"value": base, "n": n}
            rows |= {
                f"bending.{window}, {shared}.{name}": make_spread(
                    mean.estimate, mean.low, mean.high, n=n
                )
                for shared, mean in means.items()
            }
            lines.append([name, window, base, *(mean.estimate for mean in means.values())])
    return SimpleNamespace(rows=rows, lines=lines)


def show_bending(data: SimpleNamespace, section: Section) -> None:
    """A table of where every profile bends."""
    section.heading("Where the antenna bends")
    section.table(
        ["profile", "window", "bends most in its proximal tenth", *_SHARED],
        data.lines,
        "Share of slow touches that bend the antenna most near its base, and Hoyer sparseness of"
        " the sensors' bending (curvature summed over the touch; less: more sensors share it).",
    )
