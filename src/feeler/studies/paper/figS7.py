"""Fig. S7: tensors of the six tip contacts, simulation beside surrogate robot. Shares Fig. 6's
data.
"""

import numpy as np
from matplotlib.figure import Figure, SubFigure

from feeler.report.section import Section
from feeler.studies.paper.context import Context
from feeler.studies.paper.fig6 import plot_tensor
from feeler.studies.paper.fig6_data import Fig6Data, load


def compute_differences(data: Fig6Data) -> dict[tuple, float]:
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


def plot(data: Fig6Data, figure: Figure | SubFigure) -> None:
    """A column per contact: simulation above, surrogate below, aligned on the tip's first peak."""
    axes = figure.subplots(2, len(data.touches.labels), sharex=True, sharey=True)
    limit = max(
        float(np.rad2deg(np.abs(values)).max())
        for values in (data.training.values, data.touches.values)
    )
    for column, (label, difference) in enumerate(compute_differences(data).items()):
        feature, _, speed = label
        plot_tensor(
            data.training.values[data.training.labels.index(label)],
            axes[0, column],
            "simulation",
            limit,
        )
        plot_tensor(
            data.touches.values[data.touches.labels.index(label)],
            axes[1, column],
            "surrogate",
            limit,
        )
        axes[0, column].set_title(
            f"{feature}, {speed:g} m/s\n{axes[0, column].get_title()}", fontsize=7
        )
        axes[1, column].set_title(
            f"{axes[1, column].get_title()}\ndiffers by {difference:.0%}", fontsize=7
        )
    figure.colorbar(axes[0, 0].images[0], ax=axes, label="hinge angle [°]", pad=0.01)
    for ax in axes.flat:
        ax.label_outer()


def show(context: Context, section: Section) -> None:
    """The six contacts, and how much they differ."""
    data = load(context)
    section.figure(
        "figS7_tensors",
        "Six tip contacts: simulation above, surrogate robot below. (Fig. S7)",
        lambda figure: plot(data, figure),
        height=3.4,
    )
    differences = {
        " ".join(map(str, label)): value for label, value in compute_differences(data).items()
    }
    section.numbers("figS7_tensors", relative_difference=differences)
