"""Fig. 2D: what touches, and where."""

import numpy as np
from matplotlib.figure import Figure

from feeler.antenna.segments import Antenna
from feeler.objects.trials import LOCATIONS, SPEEDS, make_features
from feeler.plotting.antennas import make_patch, plot_posture
from feeler.report.page import Section
from paper.context import Context
from paper.data import load_tensors, select_speed


def plot(antenna: Antenna, figure: Figure) -> None:
    """The six features and the five locations (Fig. 2D)."""
    left, right = figure.subplots(1, 2, width_ratios=(1, 2))
    plot_posture(antenna.shape(), left, linewidth=2)
    left.plot(
        np.zeros(len(LOCATIONS)),
        np.array(LOCATIONS) * antenna.length,
        "o",
        color="#CC0000",
        markersize=4,
    )
    left.set(
        xlabel="x [mm]",
        ylabel="y [mm]",
        xlim=(-8, 8),
        aspect="equal",
        title="contact locations",
    )
    for i, feature in enumerate(make_features()):
        right.add_patch(make_patch(feature, np.array([8.0 * i, 0.0]), np.array([1.0, 0.0])))
        right.text(
            8.0 * i - feature.size,
            -5.5,
            f"{feature.kind}\n{feature.size:g} mm",
            ha="center",
            fontsize=7,
        )
    right.annotate(
        "motion", (46, 5), (38, 5), arrowprops={"arrowstyle": "->"}, va="center", fontsize=7
    )
    right.plot([34, 39], [-8, -8], color="black", lw=1.5)
    right.text(40, -8, "5 mm", va="center", fontsize=7)
    right.axis("off")
    right.set(xlim=(-8, 48), ylim=(-9, 8), aspect="equal", title="features (half-size)")


def show(context: Context, section: Section) -> None:
    """The stimuli, and which of them this run has."""
    slow = select_speed(load_tensors(context, next(iter(context.profiles))), SPEEDS["slow"])
    section.figure(
        "fig2d_stimuli",
        "What touches, and where. (Fig. 2D)",
        lambda figure: plot(context.antenna, figure),
        height=1.9,
        numbers={name: slow[name] for name in ("feature", "size", "location")},
    )
