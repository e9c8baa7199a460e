"""Beside Fig. 5B, D: profiles compared over complete touches, since 380 ms cut all but the
exponential profile's short.
"""

from collections.abc import Mapping
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from feeler.analysis import INDICES, Dispersion, compute_dispersion
from feeler.decoding import NOISES, Sweep, compute_sweep
from feeler.decoding.classifiers import make_lda
from feeler.decoding.sweeps import Plan
from feeler.experiments.tactile import DURATION
from feeler.plotting.results import plot_sweep
from feeler.plotting.style import PALETTE, PROFILE_COLOURS
from feeler.report import Section, make_spread
from feeler.tensors import rectify
from paper.context import Context
from paper.data import COMPLETE, list_profiles, load_complete
from paper.fig5_data import load, spread_accuracy
from paper.window import (
    SAME,
    WINDOWS,
    complete_arrays,
    complete_tensors,
    measure_window,
)


def compute(
    tensors: Mapping[str, xr.Dataset], plan: Plan, *, random_state: int = 0
) -> SimpleNamespace:
    """Everything of whole slow touches, by profile.

    tensors : Datasets by profile with ``angle`` and ``force``, recorded until no touch begins
    again.

    Returns
    -------
    SimpleNamespace
        ``windows`` by profile, ``dispersion`` of complete touches, ``sweeps[noise][profile]`` of
        accuracy on tensors, and ``peaks`` by profile, the greatest angle [rad]: common noise is a
        share of the greatest of them.
    """
    arrays, labels = complete_arrays(tensors)
    options: dict[str, Any] = {
        "ratios": plan.ratios,
        "n_copies": plan.n_copies,
        "n_repeats": plan.n_repeats,
        "estimator": make_lda(),
        "random_state": random_state,
    }
    sweeps = {
        noise: {
            name: compute_sweep(array, labels, noise=NOISES[noise](), **options)
            for name, array in arrays.items()
        }
        for noise in ("relative", "common")
    }
    return SimpleNamespace(
        windows={name: measure_window(data) for name, data in tensors.items()},
        dispersion=compute_dispersion(arrays, random_state=random_state),
        sweeps=sweeps,
        peaks={
            name: float(rectify(complete_tensors(data)["angle"].values).max())
            for name, data in tensors.items()
        },
    )


def plot(data: SimpleNamespace, cut: Mapping[str, Mapping[str, Sweep]], figure: Figure) -> None:
    """Accuracy on tensors by profile: the paper's window on the left, complete touches on the
    right; a row per noise.
    """
    axes = figure.subplots(2, 2, sharex=True, sharey=True)
    for row, noise in zip(axes, data.sweeps, strict=True):
        for ax, sweeps in zip(row, (cut[noise], data.sweeps[noise]), strict=True):
            for k, (name, sweep) in enumerate(sweeps.items()):
                plot_sweep(
                    sweep,
                    ax,
                    color=PROFILE_COLOURS.get(name, PALETTE[k % len(PALETTE)]),
                    label=name,
                )
            ax.axhline(100 * sweep.chance, color="#888888", ls=":", lw=0.8)
            ax.set(xlim=(0, 32), ylim=(0, 103))
        row[0].set_ylabel(f"accuracy [%]\n{noise} noise")
    for ax, window in zip(axes[0], WINDOWS, strict=True):
        ax.set_title(window)
    for ax in axes[1]:
        ax.set_xlabel("noise [%]")
    axes[0, 0].legend(fontsize=7, frameon=False)


def show(context: Context, section: Section) -> None:
    """What the window cuts, and the profiles compared without it."""
    names = list_profiles(context)
    if len(names) < 2:
        return
    data = compute(
        {name: load_complete(context, name) for name in names},
        context.effort.plan,
        random_state=context.seed,
    )
    cut = {noise: load(context).curves["profile"].find("raw", noise) for noise in data.sweeps}
    section.heading("Complete touches")
    section.text(
        f"The paper's window of {DURATION:g} ms holds the exponential profile's touches whole and"
        " cuts the others'. So the profiles are compared again over complete touches: each over its"
        f" own shortest full window, all with {DURATION:g} samples. Whether a touch begins again"
        f" was looked for up to {COMPLETE:g} ms."
    )
    _tabulate(section, data)
    section.figure(
        "fig5_complete",
        "Accuracy of LDA on slow tensors by profile, in the paper's window and over complete"
        " touches, with noise relative to each tensor's peak and with one noise floor for all;"
        " mean ± 1 SD over repeats, chance dotted.",
        lambda figure: plot(data, cut, figure),
        height=4.6,
        numbers={
            WINDOWS[1]: _list_noisy(data.sweeps),
            WINDOWS[0]: _list_noisy(cut),
            "windows": {name: vars(window) for name, window in data.windows.items()},
        },
    )
    _keep_values(section, data, cut)


def _list_noisy(found: Mapping[str, Mapping[str, Sweep]]) -> dict[str, dict[str, np.ndarray]]:
    return {
        noise: {name: sweep.noisy for name, sweep in sweeps.items()}
        for noise, sweeps in found.items()
    }


def _tabulate(section: Section, data: SimpleNamespace) -> None:
    header = [
        "profile",
        "lets go at the latest [ms]",
        "cut by the window",
        "of these, out of contact at its end",
    ]
    section.table(
        [*header, "identical pairs", "ceiling"],
        [[name, w.end, w.cut, w.again, w.pairs, w.ceiling] for name, w in data.windows.items()],
        f"Slow touches, {WINDOWS[1]} (of"
        f" {next(iter(data.sweeps['relative'].values())).classes.size}). Identical pairs: touches"
        f" whose tensors differ by less than {SAME:g} rad inside the paper's window; no"
        " classifier can be right more often than the ceiling says.",
    )
    for name, window in data.windows.items():
        section.values |= {
            f"window.{part}.{name}": value for part, value in vars(window).items()
        }


def keep_dispersion(
    section: Section, whole: Dispersion, names: Mapping[Any, str] | None = None
) -> list[list[str]]:
    """Values of the four indices by group in the paper's window, which are known, and over complete
    touches; the rows of a table. ``names``: what the section calls the groups, where it differs.
    """
    rows, cells = [], cast(dict[str, Any], section.values)
    for index in INDICES:
        row = [INDICES[index].label]
        for group, found in whole.average[index].items():
            name = (names or {}).get(group, group)
            n, cut = whole.values(index, group).size, cells[f"dispersion.tensor.{index}.{name}"]
            spread = make_spread(found.estimate, found.low, found.high, n=n)
            cells[f"dispersion.{WINDOWS[0]}.{index}.{name}"] = cut
            cells[f"dispersion.{WINDOWS[1]}.{index}.{name}"] = spread
            row.append(f"{cut['value']:.3g} → {found.estimate:.3g}")
        rows.append(row)
    return rows


def _keep_values(
    section: Section, data: SimpleNamespace, cut: Mapping[str, Mapping[str, Sweep]]
) -> None:
    """Values of both windows, and a table of the four indices."""
    loudest = max(data.peaks, key=data.peaks.__getitem__)
    section.text(
        "Common noise is a share of the greatest angle of all antennas,"
        f" {data.peaks[loudest]:.3g} rad ({loudest}). The greatest angle of each, in rad: "
        + ", ".join(f"{name} {peak:.3g}" for name, peak in data.peaks.items())
        + "."
    )
    rows = keep_dispersion(section, data.dispersion)
    section.table(
        ["index", *data.windows],
        rows,
        f"Closest match of the tensors: {WINDOWS[0]} → {WINDOWS[1]}.",
    )
    for name, peak in data.peaks.items():
        section.values[f"complete.peak.{name}"] = peak
    for noise, sweeps in data.sweeps.items():
        for name, sweep in sweeps.items():
            section.values[f"complete.{noise}.{name}"] = spread_accuracy(sweep)
            section.values[f"cut.{noise}.{name}"] = spread_accuracy(cut[noise][name])
