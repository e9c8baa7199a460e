"""Fig. S1: the sigmoid of segment lengths. Drawn from synthetic antennae: the measured lengths were
never published.
"""

from collections.abc import Sequence
from types import SimpleNamespace

import numpy as np
from matplotlib.figure import Figure, SubFigure

from feeler.antenna.animals import cockroach, fit_sigmoid
from feeler.plotting.style import PALETTE
from feeler.report.page import Section
from paper.context import Context

_N_ANTENNAE = 4  # [P]
_SCATTER = 0.08  # [C] sd of one segment's length, as a share of it


def compute(lengths: Sequence[np.ndarray] | None = None, *, seed: int = 0) -> SimpleNamespace:
    """Fit measured ``lengths`` (one array per antenna), or four synthetic antennae scattered about
    the default one.

    The synthetic ones test the method; how well they are fitted says nothing about cockroaches.

    Returns
    -------
    SimpleNamespace
        ``fit`` (:class:`~feeler.antenna.animals.SigmoidFit`) and ``planted``: the length shares
        (segment,) that synthetic antennae were made from, None for measured ones.
    """
    if lengths is not None:
        return SimpleNamespace(fit=fit_sigmoid(lengths), planted=None)
    rng, antenna = np.random.default_rng(seed), cockroach()
    scatter = np.exp(_SCATTER * rng.standard_normal((_N_ANTENNAE, antenna.n_segments)))
    return SimpleNamespace(
        fit=fit_sigmoid(list(antenna.segment_length * scatter)),
        planted=antenna.segment_length / antenna.length,
    )


def plot(data: SimpleNamespace, figure: Figure | SubFigure) -> None:
    """Length share against relative segment number."""
    ax, fit = figure.subplots(), data.fit
    for number, share in enumerate(fit.share):
        ax.plot(
            fit.x,
            100 * share,
            ".",
            ms=2.5,
            color="#999999",
            label="antennae" if number == 0 else None,
        )
    ax.plot(fit.x, 100 * fit.share.mean(axis=0), ".", ms=4, color=PALETTE[0], label="mean")
    ax.plot(fit.x, 100 * fit.sigmoid.at(fit.x), color=PALETTE[1], label="sigmoid")
    if data.planted is not None:
        ax.plot(fit.x, 100 * data.planted, "k--", lw=0.8, label="planted")
        ax.set_title("synthetic antennae, not animal data")
    ax.text(
        0.97,
        0.05,
        f"squared residual {fit.squared_residual:.1e}",
        transform=ax.transAxes,
        ha="right",
    )
    ax.set(xlabel="segment number / number of segments", ylabel="share of the length [%]")
    ax.legend(loc="upper left")


def show(context: Context, section: Section) -> None:
    """The sigmoid on synthetic antennae."""
    data = compute(seed=context.seed)
    section.figure(
        "figS1_lengths",
        "Sigmoid fitted to segment lengths of four synthetic antennae scattered about the default"
        " one; the measured lengths were not published. (Fig. S1)",
        lambda figure: plot(data, figure),
        width=3.5,
        height=2.6,
        numbers={
            "segment": data.fit.x,
            "share": data.fit.share,
            "sigmoid": data.fit.sigmoid.at(data.fit.x),
            "planted": data.planted,
        },
    )
    section.values["calibration.sigmoid_residual"] = data.fit.squared_residual
