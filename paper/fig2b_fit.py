"""Beside Fig. 2B: what four targets determine: directions, error profiles, and the hinges that fit
the animals.
"""

from types import SimpleNamespace

import numpy as np
import xarray as xr
from matplotlib.figure import Figure, SubFigure

from feeler.calibration import EigenParameters, Measured
from feeler.calibration.problem import FAILED
from feeler.plotting.style import PALETTE, set_decades
from feeler.report.page import Section
from paper.cache import keep
from paper.calibration_report import PAPER_ERROR, PAPER_P, compute
from paper.context import Context

_LEVEL = 95.0  # % of the draws
_N_HINGES = 140  # [P] the family's rates are per hinge of a cockroach
_SCALE = {"frequency": 1e3}  # kHz → Hz
_UNITS = dict(
    zip(
        ("p1", "p2", "p3", "p4"), ("N·mm/rad", "N·mm·ms/rad", "1/joint", "1/joint"), strict=True
    )
)


def plot(found: SimpleNamespace, figure: Figure | SubFigure) -> None:
    """Directions (left two) and the hinges that bootstrapped fits give (right two)."""
    axes = figure.subplots(1, 4)
    _plot_sensitivity(found.directions, axes[0])
    _plot_directions(found.directions, axes[1])
    for ax, base, rate, unit in zip(
        axes[2:], (0, 1), (2, 3), ("N·mm/rad", "N·mm·ms/rad"), strict=True
    ):
        _plot_band(found.draws[:, base], found.draws[:, rate], ax)
        ax.plot(_draw_out(PAPER_P[base], PAPER_P[rate]), color=PALETTE[1], label="published")
        ax.set(ylabel=f"{('stiffness', 'damping')[base]} [{unit}]", xlabel="hinge")
    figure.legend(*axes[2].get_legend_handles_labels(), loc="outside lower right", ncols=3)


def _plot_sensitivity(directions: EigenParameters, ax) -> None:
    """How much the error changes along each direction."""
    number = np.arange(1, len(directions.sensitivity) + 1)
    ax.plot(number, directions.sensitivity, "o-", color=PALETTE[0])
    set_decades(ax)
    ax.set(xlabel="direction", ylabel="change of the error along it", xticks=number)


def _plot_directions(directions: EigenParameters, ax) -> None:
    """What each direction is made of."""
    ax.imshow(directions.direction, cmap="RdBu_r", vmin=-1, vmax=1, aspect="auto")
    for (row, column), share in np.ndenumerate(directions.direction):
        colour = "w" if abs(share) > 0.6 else "k"
        ax.text(column, row, f"{share:.2f}", ha="center", va="center", fontsize=7, color=colour)
    n = len(directions.names)
    ax.set(
        xticks=range(n),
        xticklabels=directions.names,
        yticks=range(n),
        yticklabels=range(1, n + 1),
    )
    ax.set(ylabel="direction", title="what moves together")


def _plot_band(base: np.ndarray, rate: np.ndarray, ax) -> None:
    """Median and ``_LEVEL`` % band of exponential profiles, one per draw."""
    hinge = np.arange(_N_HINGES)
    low, middle, high = np.percentile(
        _draw_out(base[:, None], rate[:, None]), [2.5, 50.0, 97.5], axis=0
    )
    ax.fill_between(
        hinge,
        low,
        high,
        color=PALETTE[0],
        alpha=0.25,
        linewidth=0,
        label=f"draws: {_LEVEL:g} %",
    )
    ax.plot(hinge, middle, color=PALETTE[0], label="draws: median")
    set_decades(ax)


def _draw_out(base: float | np.ndarray, rate: float | np.ndarray) -> np.ndarray:
    """``base`` · exp(``rate`` (n − 1)) at every hinge n."""
    return base * np.exp(rate * np.arange(_N_HINGES))


def _plot_profiles(profiles: xr.Dataset, figure: Figure | SubFigure) -> None:
    """Error of the best fit with one parameter held; a gap where no antenna could be measured."""
    names = profiles["parameter"].values
    axes = figure.subplots(1, len(names), sharey=True, squeeze=False)[0]
    for ax, name, value, error in zip(
        axes, names, profiles["value"].values, profiles["error"].values, strict=True
    ):
        ax.plot(value, np.where(error < FAILED, error, np.nan), "o-", ms=3, color=PALETTE[0])
        ax.axhline(
            PAPER_ERROR, color="#888888", ls="--", lw=0.8, label="the paper's least error"
        )
        ax.set(xlabel=f"{name} [{_UNITS[name]}]", yscale="log")
    axes[0].set_ylabel("error, the others refitted")
    figure.legend(*axes[0].get_legend_handles_labels(), loc="outside lower center")


def show(context: Context, section: Section) -> None:
    """What the published constants score, what optimisers find, and what is determined."""
    found = keep(
        "calibration",
        compute,
        context.effort,
        antenna=context.antenna,
        seed=context.seed,
        engine=context.engine,
    )
    measured, error, accuracy = next(iter(found.scores.values()))
    section.heading("Targets, and what the published constants score")
    section.table(
        [
            "antenna",
            *(f"{name} [Hz]" if name in _SCALE else name for name in measured.names),
            "error",
            "median symmetric accuracy",
        ],
        [_row(name, *score) for name, score in found.scores.items()],
        "Reconstructed targets [D]: 17.5 Hz, 0.54, 0.22, 0.55. The paper reports a least error of"
        " 0.067 and 0.0035 against its own targets, which are lost.",
    )
    for name, value in zip(measured.names, measured.values, strict=True):
        section.values[f"calibration.{name}"] = float(value) * _SCALE.get(name, 1.0)
    section.values |= {
        "calibration.cost_published": error,
        "calibration.msa_published": accuracy,
        "calibration.widest_spread": _find_widest_spread(found),
    }
    whence = (
        "Precomputed (benchmarks/calibration.py); paper scale measures it anew."
        if found.kept
        else "Measured in this run."
    )
    section.table(
        [
            "optimiser",
            "start",
            "antennas simulated",
            "processor time [s]",
            "error",
            "median symmetric accuracy",
        ],
        [list(row.values()) for row in found.compared],
        f"Four parameters from perturbed starts, each optimiser to its own convergence. {whence}",
    )
    if found.ratios:
        _show_impactor(section, found.ratios)
    _show_directions(section, found)


def _row(name: str, measured: Measured, error: float, accuracy: float) -> list[object]:
    values = [
        "over-damped" if n in _SCALE and measured.overdamped else float(v) * _SCALE.get(n, 1.0)
        for n, v in zip(measured.names, measured.values, strict=True)
    ]
    return [name, *values, error, accuracy]


def _find_widest_spread(found: SimpleNamespace) -> float:
    """The largest factor by which a base parameter differs among fits as good as the paper's."""
    p, error = found.walked
    good = [PAPER_P, *p[error <= PAPER_ERROR]]
    if found.refits is not None:
        good += [m.p for m in found.refits.minima if m.error <= PAPER_ERROR]
    if found.profiles is not None:
        close = found.profiles["error"].values <= PAPER_ERROR
        good += list(found.profiles["others"].values[close])
    base = np.abs(np.array(good))
    return float((base.max(axis=0) / base.min(axis=0)).max())


def _show_impactor(section: Section, ratios: list) -> None:
    section.heading("The impactor")
    section.text(
        "Neither speed nor path of the impactor is published. The lever of Fig. 2B (20 mm, 0.45"
        " m/s) [C] was chosen after seeing how long the published trace lasts, so the length of"
        " that contact is no prediction; calibration uses a slow straight hit, chosen without the"
        " trace. What the choice does to the published constants' deflection ratios:"
    )
    rows = [
        ["straight" if lever is None else f"lever {lever:g} mm", speed, *r]
        for speed, lever, r in ratios
    ]
    section.table(["path", "speed [m/s]", "ratio_71", "ratio_86"], rows)


def _show_directions(section: Section, found: SimpleNamespace) -> None:
    section.heading("What the targets determine")
    directions, profiles = found.directions, found.profiles
    drawn = "by one linear step per draw" if found.kept else "refitted to each draw"
    section.figure(
        "fig2b_directions",
        "a: how much the error changes along four directions in the space of p1…p4 (per unit along"
        " them), most determined first; b: how much each parameter enters a direction. c, d:"
        " stiffness and damping along the antenna for targets drawn from the animals' spread,"
        f" {drawn}.",
        lambda figure: plot(found, figure),
        height=2.6,
        numbers={
            "names": directions.names,
            "sensitivity": directions.sensitivity,
            "direction": directions.direction,
            "draws": found.draws,
        },
    )
    section.text(_describe(found))
    if profiles is not None:
        section.figure(
            "fig2b_error_profiles",
            "Least error with one parameter held and the others refitted; dashed: the paper's"
            " error.",
            lambda figure: _plot_profiles(profiles, figure),
            height=2.6,
            numbers={
                "names": profiles["parameter"].values,
                "value": profiles["value"].values,
                "error": profiles["error"].values,
            },
        )
    low, high = np.percentile(found.draws, [2.5, 97.5], axis=0)
    section.table(
        ["parameter", "2.5 %", "97.5 %"],
        [
            [name, float(a), float(b)]
            for name, a, b in zip(directions.names, low, high, strict=True)
        ],
        f"Bootstrap of the mean of five animals from the targets' spread, {drawn}; an end at the"
        " search's bound (p2 0.25, 2500; p3, p4 −0.16, 0) means not determined.",
    )


def _describe(found: SimpleNamespace) -> str:
    """What the targets determine, and where along the antenna the animals' spread leaves it."""
    p, error = found.walked
    good = np.vstack([PAPER_P, p[error <= PAPER_ERROR]])
    pairs = zip(found.directions.names, good.min(axis=0), good.max(axis=0), strict=True)
    ranges = ", ".join(f"{name} {low:.3g} to {high:.3g}" for name, low, high in pairs)
    words = []
    for name, base, rate in (("stiffness", 0, 2), ("damping", 1, 3)):
        hinge, factor = _find_best_known(found.draws[:, base], found.draws[:, rate])
        words.append(
            f"the {name} of hinge {hinge} (95 % of the draws within a factor of {factor:.2g})"
        )
    return (
        f"{found.directions.describe()} Along that least determined line the model stays at or"
        f" below the paper's error of {PAPER_ERROR} over {ranges}. Between the animals, the targets"
        f" fix {' and '.join(words)} best; away from there they fix less."
    )


def _find_best_known(base: np.ndarray, rate: np.ndarray) -> tuple[int, float]:
    """The hinge (from 1) at which the draws agree best, and the factor between their 95 % ends."""
    logs = np.log(base)[:, None] + rate[:, None] * np.arange(_N_HINGES)
    low, high = np.percentile(logs, [2.5, 97.5], axis=0)
    best = int(np.argmin(high - low))
    return best + 1, float(np.exp(high - low)[best])
