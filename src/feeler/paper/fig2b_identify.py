"""What four targets determine: directions, error profiles, and the band of hinges that fit the animals."""

import numpy as np
from matplotlib.figure import Figure, SubFigure

from feeler.calibration import Directions, Profiles
from feeler.calibration.problem import FAILED
from feeler.paper.calibration_report import PAPER_ERROR, PAPER_P, Calibration
from feeler.plotting.style import PALETTE, set_decades

LEVEL = 95.0  # % of the draws


def plot(found: Calibration, figure: Figure | SubFigure) -> None:
    """Directions (left two) and the hinges that bootstrapped fits give (right two)."""
    axes = figure.subplots(1, 4)
    plot_sensitivity(found.directions, axes[0])
    plot_directions(found.directions, axes[1])
    n_hinges = 140  # [P] the family's rates are per hinge of a cockroach
    for ax, base, rate, unit in zip(axes[2:], (0, 1), (2, 3), ("N·mm/rad", "N·mm·ms/rad"), strict=True):
        plot_band(found.draws[:, base], found.draws[:, rate], n_hinges, ax)
        ax.plot(_draw_out(PAPER_P[base], PAPER_P[rate], n_hinges), color=PALETTE[1], label="published")
        ax.set(ylabel=f"{('stiffness', 'damping')[base]} [{unit}]", xlabel="hinge")
    axes[2].legend(loc="lower left")


def plot_sensitivity(directions: Directions, ax) -> None:
    """How much the error changes along each direction."""
    number = np.arange(1, len(directions.sensitivity) + 1)
    ax.plot(number, directions.sensitivity, "o-", color=PALETTE[0])
    set_decades(ax)
    ax.set(xlabel="direction", ylabel="change of the error per step", xticks=number)


def plot_directions(directions: Directions, ax) -> None:
    """What each direction is made of."""
    ax.imshow(directions.direction, cmap="RdBu_r", vmin=-1, vmax=1, aspect="auto")
    for (row, column), share in np.ndenumerate(directions.direction):
        colour = "w" if abs(share) > 0.6 else "k"
        ax.text(column, row, f"{share:.2f}", ha="center", va="center", fontsize=6, color=colour)
    n = len(directions.names)
    ax.set(xticks=range(n), xticklabels=directions.names, yticks=range(n), yticklabels=range(1, n + 1))
    ax.set(ylabel="direction", title="what moves together")


def plot_band(base: np.ndarray, rate: np.ndarray, n_hinges: int, ax) -> None:
    """Median and ``LEVEL`` % band of exponential profiles ``base`` · exp(``rate`` (n − 1)), one per draw."""
    hinge = np.arange(n_hinges)
    low, middle, high = np.percentile(_draw_out(base[:, None], rate[:, None], n_hinges), [2.5, 50.0, 97.5], axis=0)
    ax.fill_between(hinge, low, high, color=PALETTE[5], alpha=0.5, linewidth=0, label=f"{LEVEL:g} % of draws")
    ax.plot(hinge, middle, color=PALETTE[0], label="median")
    set_decades(ax)


def _draw_out(base: float | np.ndarray, rate: float | np.ndarray, n_hinges: int) -> np.ndarray:
    return base * np.exp(rate * np.arange(n_hinges))


def plot_profiles(profiles: Profiles, figure: Figure | SubFigure) -> None:
    """Error of the best fit with one parameter held; a gap where no antenna could be measured."""
    axes = figure.subplots(1, len(profiles.names), sharey=True, squeeze=False)[0]
    for ax, name, value, error in zip(axes, profiles.names, profiles.value, profiles.error, strict=True):
        ax.plot(value, np.where(error < FAILED, error, np.nan), "o-", ms=3, color=PALETTE[0])
        ax.axhline(PAPER_ERROR, color="#888888", ls="--", lw=0.8)
        ax.set(xlabel=name, yscale="log")
    axes[0].set_ylabel("error, the others refitted")
