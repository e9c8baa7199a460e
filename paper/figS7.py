"""Fig. S7: tensors of the six tip contacts, simulation beside surrogate robot. Shares Fig. 6's
data.
"""

from types import SimpleNamespace

import numpy as np
from matplotlib.figure import Figure, SubFigure

from feeler.report.page import Section
from paper.context import Context
from paper.fig6 import plot_tensor
from paper.fig6_data import load


def _compute_differences(data: SimpleNamespace) -> dict[tuple, float]:
    """Relative difference ‖surrogate − simulation‖ / ‖simulation‖ of the aligned tensors, per
    contact.
    """
    differences = {}
    for label, surrogate in zip(data.touches.labels, data.touches.values, strict=True):
        simulated = data.training.values[data.training.labels.index(label)]
        differences[label] = float(
            np.linalg.norm(surrogate - simulated) / np.linalg.norm(simulated)
        )
    return differences


def plot(data: SimpleNamespace, figure: Figure | SubFigure) -> None:
    """A column per contact: simulation above, surrogate below, aligned on the tip's first peak."""
    axes = figure.subplots(2, len(data.touches.labels), sharex=True, sharey=True)
    limit = max(
        float(np.rad2deg(np.abs(values)).max())
        for values in (data.training.values, data.touches.values)
    )
    for (label, difference), (above, below) in zip(
        _compute_differences(data).items(), axes.T, strict=True
    ):
        feature, _, speed = label
        for ax, touches, name in (
            (above, data.training, f"{feature}, {speed:g} m/s\nsimulation"),
            (below, data.touches, f"surrogate\ndiffers by {difference:.0%}"),
        ):
            plot_tensor(touches.values[touches.labels.index(label)], ax, name, limit)
            ax.title.set_fontsize(7)
    figure.colorbar(axes[0, 0].images[0], ax=axes, label="hinge angle [°]", pad=0.01)
    for ax in axes.flat:
        ax.label_outer()


def show(context: Context, section: Section) -> None:
    """The six contacts, and how much they differ."""
    data = load(context)
    differences = {
        " ".join(map(str, label)): value for label, value in _compute_differences(data).items()
    }
    section.figure(
        "figS7_tensors",
        "Six tip contacts: simulation above, surrogate robot below. (Fig. S7)",
        lambda figure: plot(data, figure),
        height=3.4,
        numbers={"relative_difference": differences},
    )
