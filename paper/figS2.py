"""Fig. S2: the speed of active touch. Drawn from synthetic tracks: the paper's own were never
published.
"""

from types import SimpleNamespace
from typing import Any

import numpy as np
from matplotlib.figure import Figure, SubFigure

from feeler.plotting.style import PALETTE, mark_panels
from feeler.report import Section
from feeler.tracking import SIDES, make_synthetic_tracks, measure_exploration
from feeler.tracking.kinematics import CUTOFF, MAX_GAP
from paper.context import Context

_PAPER_MEAN = np.deg2rad(86.67e-3)  # [P] rad/ms, average over six trials
_SPREAD = np.deg2rad(
    12.0e-3
)  # [C] rad/ms, sd of the planted peak speed between trials and sides
_N_TRIALS = 6  # [P]


def compute(context: Context) -> SimpleNamespace:
    """Measure six synthetic trials whose mean is the paper's 86.67 °/s.

    They test the method (it must give back what was simulated); they say nothing about cockroaches.

    Returns
    -------
    SimpleNamespace
        ``rows``; ``trial``: the first trial's tracks; ``exploration``
        (:class:`~feeler.tracking.Exploration`): speeds of all trials; ``planted``: the peak speeds
        that were simulated (trial, side) [rad/ms].
    """
    rng = np.random.default_rng(context.seed)
    planted = rng.normal(0.0, _SPREAD, (_N_TRIALS, len(SIDES)))
    planted += _PAPER_MEAN - planted.mean()
    tracks = [
        make_synthetic_tracks(rng, peak_speed=tuple(row), gap_share=0.02) for row in planted
    ]
    found = measure_exploration(tracks, cutoff=CUTOFF, max_gap=MAX_GAP)
    rows = {
        "tracking.mean": float(_degrees(found.mean)),
        "tracking.lateral": float(_PAPER_MEAN * context.antenna.length * 100),
    }
    return SimpleNamespace(rows=rows, trial=tracks[0], exploration=found, planted=planted)


def plot(data: SimpleNamespace, figure: Figure | SubFigure) -> None:
    """Draw the tracks, the angles and speeds of one trial, and the box plot of all trials."""
    path, trace, box = figure.subplots(1, 3, width_ratios=(1.1, 1.6, 1.0))
    # Paths of the four landmarks
    tracks = data.trial
    for name, colour in zip(
        tracks.landmarks, (*PALETTE[:2], "#000000", "#888888"), strict=False
    ):
        path.plot(*tracks.of(name).T, lw=0.7, color=colour, label=name.replace("_", " "))
    path.set(xlabel="x [px]", ylabel="y [px]", aspect="equal")
    path.legend(fontsize=7, frameon=False, ncols=2, loc="lower left", bbox_to_anchor=(0.1, 1.0))
    _plot_trace(data, trace)
    # Average maximum angular speed per side, a dot per trial, the paper's mean as a line
    speeds = [column[np.isfinite(column)] for column in _degrees(data.exploration.mean_peak).T]
    box.boxplot(speeds, tick_labels=SIDES, medianprops={"color": "#CC0000"}, showfliers=False)
    for place, values in enumerate(speeds, 1):
        box.plot(np.full(values.size, place), values, "k.")
    box.axhline(
        _degrees(_PAPER_MEAN), color="#888888", ls="--", lw=0.8, label="paper: 86.67 °/s"
    )
    box.set(ylabel="mean of peak speeds [°/s]", ylim=(0, None))
    box.legend(fontsize=7, frameon=False)
    mark_panels((path, box))


def _plot_trace(data: SimpleNamespace, ax) -> None:
    """Angular speed of both antennae in the first trial, peaks marked."""
    for side, colour, sweeps in zip(
        SIDES, PALETTE[:2], data.exploration.sweeps[0], strict=True
    ):
        ax.plot(
            data.trial.time / 1e3,
            np.abs(_degrees(sweeps.speed)),
            lw=0.8,
            color=colour,
            label=side,
        )
        ax.plot(sweeps.peak_time / 1e3, _degrees(sweeps.peak_speed), ".", color=colour)
    ax.set(xlabel="time [s]", ylabel="angular speed [°/s]")
    ax.legend(fontsize=7, frameon=False, ncols=2, loc="lower center", bbox_to_anchor=(0.5, 1.0))


def _degrees(speed: Any) -> Any:
    return np.rad2deg(speed) * 1e3


def show(data: SimpleNamespace, section: Section) -> None:
    """Fig. S2 on synthetic tracks."""
    section.text(
        "The tracks of the paper's cockroach were not published. These are synthetic tracks with"
        " noise and gaps, whose planted mean peak speed is the paper's; the method must give it"
        " back. They say nothing about cockroaches."
    )
    section.figure(
        "figS2_tracking",
        "Synthetic tracks with a simulated mean of 86.67 °/s, not animal data. a: paths of four"
        " landmarks, and angular speed of one trial with its peaks; b: average maximum speed of"
        " every trial (dots, n = 6) and side; red: median. (Fig. S2)",
        lambda figure: plot(data, figure),
        height=3.0,
        numbers={"mean_peak": data.exploration.mean_peak, "planted": data.planted},
    )
