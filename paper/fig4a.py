"""Fig. 4A as a drawing: a touch of the run as its bases, laid down where its activations say."""

from types import SimpleNamespace
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import Normalize
from matplotlib.figure import Figure

from feeler.encoding import reconstruct
from feeler.plotting.style import BASIS_COLOURS, mark_panels
from feeler.plotting.tensors import plot_tensor
from feeler.report.page import Section
from paper.context import Context
from paper.data import list_profiles, load_tensors
from paper.fig4 import MAIN_RANK, load, prepare

_STEPS = (
    "activations  →  noise is added  →  principal components  →  classifier  →  object, place"
)


def take(data: SimpleNamespace, tensors: Any) -> SimpleNamespace:
    """One slow touch of the smaller ball: what is encoded (sensor, time), its code (component,
    time), the bases, and what they give together (sensor, time).
    """
    name = next(key for key in data.examples if key.startswith("ball"))
    bases = data.encoders[
        MAIN_RANK if MAIN_RANK in data.encoders else data.ranks[0]
    ].components_
    feature, place = name.split()
    chosen = np.flatnonzero(
        (tensors["feature"].values == feature)
        & np.isclose(tensors["location"].values, float(place))
        & np.isclose(tensors["speed"].values, tensors["speed"].values.min())
    )
    number = int(chosen[tensors["size"].values[chosen].argmin()])
    code = data.examples[name]
    return SimpleNamespace(
        name=name,
        touch=prepare(tensors.isel(trial=[number]))[0],
        code=code,
        bases=bases,
        sum=reconstruct(bases, code[None])[0],
    )


def plot(shown: SimpleNamespace, sampling: float, figure: Figure) -> None:
    """The touch, what the code keeps of it, and a row for each basis with its activation."""
    touch, rows = np.rad2deg(shown.touch), len(shown.bases)
    time, norm = sampling * np.arange(touch.shape[1]), Normalize(0, float(touch.max()))
    widths = (1.5, 0.1, 1.5, 0.2, 0.6, 0.1, 1.7)
    grid = figure.add_gridspec(rows, len(widths), width_ratios=widths)
    wholes = [figure.add_subplot(grid[:, column]) for column in (0, 2)]
    pictures = {"a touch": touch, "what its code keeps": np.rad2deg(shown.sum)}
    for ax, (title, values) in zip(wholes, pictures.items(), strict=True):
        image = plot_tensor(values, time, ax, norm, unit="°")
        ax.set_title(title)
    wholes[1].set_ylabel("")
    mark_panels(wholes[0])
    figure.colorbar(image, ax=wholes, label="angle [°]", location="left", pad=0.02)
    for m, colour in zip(range(rows), BASIS_COLOURS, strict=False):
        axes = [figure.add_subplot(grid[m, column]) for column in (4, 6)]
        _draw_row(shown, m, colour, time, axes)
        for ax in axes if m < rows - 1 else ():
            ax.set_xticklabels([])
            ax.set_xlabel("")
    for column, sign in ((1, "≈"), (3, "=  Σ"), (5, "∗")):
        ax = figure.add_subplot(grid[:, column])
        ax.text(0.5, 0.5, sign, ha="center", va="center", fontsize=12)
        ax.axis("off")
    figure.supxlabel(_STEPS, fontsize=8)


def _draw_row(
    shown: SimpleNamespace, m: int, colour: str, time: np.ndarray, axes: list[Axes]
) -> None:
    """One basis on its own scale, and its activation."""
    basis, code = shown.bases[m], shown.code[m]
    lag = (time[1] - time[0]) * np.arange(basis.shape[1])
    scale = Normalize(0, float(basis.max()) or 1.0)
    plot_tensor(basis, lag, axes[0], scale, labels=False, unit="of its greatest")
    axes[0].set(yticks=[], xlabel="lag [ms]")
    axes[0].set_title(f"basis {m + 1}", color=colour, pad=2)
    axes[1].plot(time, code / (shown.code.max() or 1), color=colour)
    axes[1].set(ylim=(0, 1.05), xlim=(time[0], time[-1]), yticks=[0, 1], xlabel="time [ms]")
    axes[1].set_title(f"basis {m + 1}: activation", color=colour, pad=2)


def show(context: Context, section: Section) -> None:
    """A touch that Fig. 4D shows, on the bases of this run."""
    data, tensors = load(context), load_tensors(context, list_profiles(context)[0])
    shown = take(data, tensors)
    section.figure(
        "fig4a_encoder",
        f"What the encoder does with one slow touch ({shown.name.replace(' ', ' at ')} L, angles"
        " without their negative values). Each basis (its own colour scale) is laid down wherever"
        " its activation is not 0, as strong as this is (∗ is convolution; activations as shares of"
        " the greatest of all); the sum (Σ) is what the code keeps of the touch. Last line: what is"
        " done with the activations. (Fig. 4A)",
        lambda figure: plot(shown, data.sampling, figure),
        height=3.6,
        numbers={"touch": shown.touch, "code": shown.code, "sum": shown.sum},
    )
