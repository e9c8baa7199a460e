"""A comparison of antennas as one self-contained page."""

from pathlib import Path

from matplotlib.figure import Figure

from feeler.analysis import INDICES
from feeler.encoding import LABELS
from feeler.files import temporary_folder
from feeler.plotting.results import plot_curves, plot_index
from feeler.report import Section, write_page
from feeler.studies.comparison.compare import COMPARED_CODES, Comparison
from feeler.validation import checked


def plot(data: Comparison, figure: Figure) -> None:
    """Dispersion of tensors above, accuracy below."""
    top, bottom = figure.subfigures(2, 1, squeeze=False).flat
    for index, ax in zip(INDICES, top.subplots(1, len(INDICES)), strict=True):
        plot_index(data.dispersion["raw"], index, ax)
        ax.set_title(f"{INDICES[index].label}, tensors", fontsize=8)
    panels = [(kind, noise) for kind in COMPARED_CODES for noise in data.curves.noises]
    axes = bottom.subplots(1, len(panels), sharey=True)
    for (kind, noise), ax in zip(panels, axes, strict=True):
        plot_curves(data.curves, kind, noise, ax)
        ax.set_title(f"{LABELS[kind]}\n{noise} noise", fontsize=7)
        ax.set_xlabel("noise [%]", fontsize=7)
    axes[0].set_ylabel("accuracy [%]", fontsize=7)
    bottom.legend(
        *axes[0].get_legend_handles_labels(), loc="outside lower center", ncols=7, fontsize=7
    )


@checked
def write_comparison(data: Comparison, path: str | Path, conditions: str = "") -> Path:
    """One HTML file with everything inside; ``conditions`` says how it was made."""
    title = " against ".join(data.names)
    lead = (
        "The same touches, at one speed: how far apart their tensors lie, and how well they are"
        " told apart."
    )
    with temporary_folder() as folder:
        section = Section(name="comparison", title="Dispersion and accuracy", folder=folder)
        section.figure(
            "comparison",
            "Above: how alike each tensor and its closest match are (small dots), and their average"
            " with its 95 % bootstrap interval over stimuli; low Pearson r, SSIM and NMI and high"
            " MSE mean more dispersed. Below: accuracy over all classes (object and place) against"
            " noise, with 1 SD; squares: the null, one tensor repeated; crosses: a reader that"
            " knows only place and time of the peak; dotted: chance.",
            lambda figure: plot(data, figure),
            height=5.4,
        )
        section.table(["measure", *data.names], data.list_rows())
        section.table(
            ["accuracy", f"{data.names[0]} minus", "points", "95 % interval", "effect (d_z)"],
            [
                [
                    measure.removeprefix("accuracy, "),
                    name,
                    _say_points(one.estimate),
                    f"{_say_points(one.low)} to {_say_points(one.high)}",
                    f"{round(one.effect, 2) + 0.0:.2f}",  # no −0.00
                ]
                for (measure, name), one in data.differences.items()
            ],
            "Differences over the same touches, in percentage points. An antenna is better where"
            " the interval leaves out 0. d_z: mean of the paired differences over their standard"
            " deviation.",
        )
        section.text(conditions)
        return write_page(path, title, lead, section)


def _say_points(share: float) -> str:
    """Percentage points with their sign; nothing is +0.0."""
    return f"{round(100 * share, 1) + 0.0:+.1f}"
