"""Beside Fig. 5: how sparse tactile tensors are, by contact speed and by stiffness profile (the
abstract's claim; no figure of the paper).
"""

from collections.abc import Mapping

import numpy as np
import xarray as xr

from feeler.analysis import Interval
from feeler.analysis.dispersion import bootstrap_mean
from feeler.encoding import hoyer_sparseness
from feeler.objects.trials import SPEEDS
from feeler.report import Section, make_spread
from paper.context import Context
from paper.data import (
    list_profiles,
    list_speeds,
    load_complete,
    load_tensors,
    select_speed,
)
from paper.declared import CLAIMED
from paper.window import (
    WINDOWS,
    cut_to_contact,
    cut_to_motion,
    cut_window,
    keep_whole,
)

SPANS = (*WINDOWS, "within each touch", "while it moves")
_Groups = Mapping[str, np.ndarray]
"""A number per touch (trial,), by speed or by profile."""


def compute(tensors: xr.Dataset) -> dict[str, np.ndarray]:
    """Hoyer sparseness of every touch (trial,) in every reading; each tensor of rectified angles is
    one vector. NaN for a touch that never meets the antenna.
    """
    return {
        WINDOWS[0]: _measure(cut_window(tensors)),
        WINDOWS[1]: _measure(keep_whole(tensors)),
        SPANS[2]: _measure_each(cut_to_contact(tensors)),
        SPANS[3]: _measure_each(cut_to_motion(tensors)),
    }


def _measure(tensors: np.ndarray) -> np.ndarray:
    return hoyer_sparseness(tensors.reshape(len(tensors), -1))


def _measure_each(tensors: list[np.ndarray]) -> np.ndarray:
    return np.concatenate([_measure(one[None]) for one in tensors])


def _average(values: np.ndarray) -> Interval:
    return bootstrap_mean(values[np.isfinite(values)], np.random.default_rng(0))


def _list_groups(context: Context) -> dict[str, dict[str, xr.Dataset]]:
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


def show(context: Context, section: Section) -> None:
    """Sparseness of tensors, which the abstract says slow touch and the gradient raise."""
    groups = {
        name: members for name, members in _list_groups(context).items() if len(members) > 1
    }
    if not groups:
        return
    measured = {
        comparison: {name: compute(data) for name, data in members.items()}
        for comparison, members in groups.items()
    }
    found = {
        comparison: {
            reading: {name: values[reading] for name, values in members.items()}
            for reading in SPANS
        }
        for comparison, members in measured.items()
    }
    section.heading("How sparse the tensors are")
    section.text(
        "The paper says that slow touch and the exponential gradient make tactile data sparser,"
        " and gives no number. Here sparseness is Hoyer's, by which the paper constrains its"
        " activations, whose own sparseness is therefore an input and not judged. A window that"
        " goes on after a touch adds zeros: so the window's sparseness stands beside that of whole"
        " touches, of the samples between a touch's first and last contact, and of those in which"
        " anything moves, which hold the swing after the touch."
    )
    for comparison, readings in found.items():
        for reading, members in readings.items():
            section.values |= _list_values(reading, members)
        section.table(
            [f"by {comparison}", *next(iter(readings.values()))],
            [[reading, *map(_say, members.values())] for reading, members in readings.items()],
            "Hoyer sparseness of tensors, mean and 95 % bootstrap interval over touches: in the"
            " paper's"
            " window, over each group's own shortest window that holds its touches whole, from a"
            " touch's first to its last contact, and while any sensor passes a hundredth of the"
            " tensor's peak.",
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
