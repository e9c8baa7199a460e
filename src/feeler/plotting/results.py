"""What notebooks show: a figure that shows itself, pictures of results, and one trial of a Dataset
as picture and movie.
"""

import io
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.colors import Normalize
from matplotlib.figure import Figure

from feeler.antenna import Antenna
from feeler.errors import InvalidInput
from feeler.plotting.bases import plot_bases
from feeler.plotting.tensor import plot_tensor
from feeler.plotting.touch import write_touch_movie
from feeler.records.checked import checked
from feeler.tensors.quantities import IN_SPACE
from feeler.tensors.sides import get_bending, measure_peak
from feeler.tensors.unit import in_unit

_DPI = 110
_QUANTITIES = ("stiffness [N·mm/rad]", "damping [N·mm·ms/rad]")


class Picture(Figure):
    """A matplotlib Figure that is shown where it is the last line of a notebook's cell."""

    def _repr_png_(self) -> bytes:
        kept = io.BytesIO()
        self.savefig(kept, format="png", dpi=_DPI)
        return kept.getvalue()


def _open(width: float, height: float = 2.8) -> Picture:
    return Picture(figsize=(width, height), layout="constrained")


def draw_sweep(sweep: Any) -> Picture:
    """Accuracy against noise with its spread, and what is taken for what at the last ratio."""
    figure = _open(7.0)
    curve, counts = figure.subplots(1, 2)
    for name, values in (("noisy copies", sweep.noisy), ("clean originals", sweep.clean)):
        mean, spread = 100 * values.mean(axis=1), 100 * values.std(axis=1)
        curve.errorbar(sweep.ratios, mean, spread, marker="o", ms=3, capsize=2, label=name)
    curve.axhline(100 * sweep.chance, color="0.6", ls=":", label="chance")
    curve.set(xlabel="noise ratio", ylabel="named right [%]", ylim=(0, 102))
    curve.legend(fontsize=7)
    total = sweep.confusion[-1].sum(axis=1, keepdims=True)
    image = counts.imshow(100 * sweep.confusion[-1] / np.maximum(total, 1), vmin=0, vmax=100)
    places = range(len(sweep.classes))
    counts.set_xticks(places, map(str, sweep.classes), rotation=45, ha="right")
    counts.set_yticks(places, map(str, sweep.classes))
    title = f"at noise {sweep.ratios[-1]:g}"
    counts.set(xlabel="taken for", ylabel="was", title=title)
    figure.colorbar(image, ax=counts, label="share of the touches [%]")
    return figure


def draw_traces(fitted: Any) -> Picture:
    """The fitted displacement of every trace, and the hinges along the antenna."""
    figure = _open(7.0)
    trace, profile = figure.subplots(1, 2)
    for name, values in zip(fitted.animals, fitted.simulated, strict=False):
        trace.plot(values, label=name)
    trace.set(xlabel="sample", ylabel="displacement [1 at the release]", title="as fitted")
    trace.legend(fontsize=7)
    if fitted.band is None:
        profile.errorbar(
            range(len(fitted.p)),
            fitted.p,
            [fitted.p - fitted.low, fitted.high - fitted.p],
            fmt="o",
        )
        profile.set_xticks(range(len(fitted.p)), fitted.names, rotation=30, ha="right")
        profile.set_ylabel("parameter and its interval")
        return figure
    band = fitted.band
    for values, low, high, name in zip(
        band.middle, band.low, band.high, _QUANTITIES, strict=True
    ):
        (line,) = profile.semilogy(band.place, values, label=name)
        profile.fill_between(band.place, low, high, color=line.get_color(), alpha=0.25)
    profile.set(xlabel="place (base 0, tip 1)", title="hinges with their intervals")
    profile.legend(fontsize=7)
    return figure


def draw_optimum(end: Any) -> Picture:
    """Stiffness and damping of a design along the antenna, and how the search came to it."""
    figure = _open(7.0)
    profile, way = figure.subplots(1, 2)
    antenna = end.design.antenna
    hinge = np.arange(1, antenna.n_segments + 1)
    profile.semilogy(hinge, antenna.stiffness.ravel(), "o-", ms=3, label="stiffness [N·mm/rad]")
    profile.semilogy(hinge, antenna.damping.ravel(), "s--", ms=3, label="damping [N·mm·ms/rad]")
    profile.set(xlabel="hinge, base to tip", title="the best found")
    profile.legend(fontsize=7)
    way.step(*np.array(end.history).T, where="post")
    way.set(xlabel="antennas simulated", ylabel="what is missing (cost)", title="the search")
    return figure


def draw_outcome(outcome: Any) -> Picture:
    """The best end of a plan that was carried out."""
    return draw_optimum(outcome.ends[0])


def draw_encoder(encoder: Any) -> Picture:
    """The bases that an encoder has learned."""
    bases = encoder.components_
    figure = _open(1.6 + 1.5 * len(bases))
    plot_bases({"bases": bases}, 1.0, figure.subplots())
    return figure


@checked
def plot_trial(
    tensors: xr.Dataset, trial: int = 0, variable: str = "curvature", ax: Axes | None = None
) -> Axes:
    """One trial's (sensor, time) as an image with its colour bar: bending away from the object is
    positive, and negative values are drawn too.
    """
    taken = _take(tensors, trial, variable)
    taken = get_bending(taken) if variable in IN_SPACE else taken  # all that bends
    values = taken.transpose("sensor", "time").values
    ax = Picture(figsize=(4.5, 3.0), layout="constrained").subplots() if ax is None else ax
    largest = max(measure_peak(values), 1e-12)
    unit = str(tensors[variable].attrs.get("units", ""))
    image = plot_tensor(
        values,
        in_unit(tensors["time"], "ms").values,
        ax,
        Normalize(min(0.0, float(np.nanmin(values))), largest),
        unit=unit,
    )
    ax.figure.colorbar(image, ax=ax, label=f"{variable} [{unit}]")
    return ax


@checked
def write_trial_movie(
    tensors: xr.Dataset, antenna: Antenna, path: Path, trial: int = 0, **how: Any
) -> Path:
    """The antenna as the sensors tell it beside the tensor as it grows; ``how`` as for
    ``write_touch_movie``.
    """
    return write_touch_movie(
        antenna, None, tensors.isel(trial=[_check_trial(tensors, trial)]), path, **how
    )


def _take(tensors: xr.Dataset, trial: int, variable: str) -> xr.DataArray:
    if variable not in tensors.data_vars or not {"trial", "sensor", "time"} <= set(
        tensors[variable].dims
    ):
        valid = [
            name
            for name, item in tensors.data_vars.items()
            if {"trial", "sensor", "time"} <= set(item.dims)
        ]
        raise InvalidInput(
            f"no tensor {variable!r} in this Dataset; valid:"
            f" {', '.join(map(str, valid)) or 'none'}."
        )
    return tensors[variable].isel(trial=_check_trial(tensors, trial))


def _check_trial(tensors: xr.Dataset, trial: int) -> int:
    if not 0 <= trial < tensors.sizes["trial"]:
        raise InvalidInput(
            f"trial must be from 0 to {tensors.sizes['trial'] - 1}, got {trial}."
        )
    return trial
