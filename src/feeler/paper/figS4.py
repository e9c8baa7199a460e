"""Fig. S4: the convolutional network on tensors, accuracy against noise by speed and by profile."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from matplotlib.figure import Figure, SubFigure

from feeler.decoding import Sweep, compute_sweep
from feeler.decoding.cnn import TouchNetwork, import_torch
from feeler.decoding.curves import Group
from feeler.decoding.verdict import Verdict, judge_order
from feeler.errors import MissingExtra
from feeler.paper.fig5 import CLAIMS, PROFILES, plot_sweep
from feeler.paper.figS6 import COLOURS

LAYERS = (
    "input {h} × {w} × 1", "convolution 15 × 15, 32, padding 2", "batch norm", "ReLU", "max pool 2 × 2",
    "fully connected 50", "dropout 0.25", "fully connected {n}", "softmax",
)  # fmt: skip
SETTINGS = {
    "smoke": {"ratios": (0.2,), "n_repeats": 1, "n_copies": 2, "max_epochs": 1, "ends": True},
    "quick": {"ratios": (0.2,), "n_repeats": 1, "n_copies": 4, "max_epochs": 3, "ends": True},
    "paper": {"ratios": (0.05, 0.1, 0.2, 0.3), "n_repeats": 10, "n_copies": 10, "max_epochs": 30, "ends": False},
}
"""``ends``: only the first and the last group of a comparison. Epochs, copies: [C]."""


@dataclass(frozen=True, kw_only=True, eq=False)
class FigS4Data:
    """What Fig. S4 shows; ``missing`` says what was not installed, and then there are no sweeps."""

    sweeps: dict[str, dict[str, Sweep]]
    verdicts: tuple[Verdict, ...]
    shape: tuple[int, int]
    n_classes: int
    scale: str
    missing: str = ""

    def describe(self) -> str:
        """The verdicts in words, or what is missing."""
        return self.missing or "\n".join(verdict.describe() for verdict in self.verdicts)


def compute(
    groups: Mapping[str, Mapping[str, Group]], *, scale: str = "quick", random_state: int = 0, device: str = "auto"
) -> FigS4Data:
    """Train and score the network for every group of ``fig5.make_groups``; without PyTorch, say so and go on."""
    settings = dict(SETTINGS[scale])
    max_epochs, ends = settings.pop("max_epochs"), settings.pop("ends")
    first = next(iter(next(iter(groups.values())).values()))
    shape = tuple(first.tensors.shape[1:])
    common = {"shape": shape, "n_classes": np.unique(first.labels).size, "scale": scale}
    try:
        import_torch()
    except MissingExtra as missing:
        return FigS4Data(sweeps={}, verdicts=(), missing=f"Fig. S4 was left out: {missing}", **common)
    network = TouchNetwork(shape, max_epochs=max_epochs, device=device, random_state=random_state)
    sweeps, verdicts = {}, []
    for comparison, members in groups.items():
        claimed = [n for n in members if comparison == "speed" or n in PROFILES]
        chosen = [claimed[0], claimed[-1]] if ends else list(members)
        sweeps[comparison] = {
            name: compute_sweep(
                members[name].tensors, members[name].labels, estimator=network, level="tensor", n_jobs=1,
                random_state=random_state, **settings,
            )
            for name in dict.fromkeys(chosen)
        }  # fmt: skip
        values = {name: sweeps[comparison][name].area for name in claimed if name in sweeps[comparison]}
        if len(values) > 1:
            verdicts.append(judge_order(values, claim=CLAIMS[comparison], measure="accuracy of the network on tensors"))
    return FigS4Data(sweeps=sweeps, verdicts=tuple(verdicts), **common)


def plot(data: FigS4Data, figure: Figure | SubFigure) -> None:
    """The layers, then one panel per comparison."""
    axes = figure.subplots(1, 1 + max(len(data.sweeps), 1))
    plot_layers(data, axes[0])
    if data.missing:
        axes[1].text(0.5, 0.5, data.missing, ha="center", va="center", wrap=True, fontsize=7)
        axes[1].axis("off")
    for (comparison, sweeps), ax in zip(data.sweeps.items(), axes[1:], strict=False):
        for colour, (name, sweep) in zip(COLOURS, sweeps.items(), strict=False):
            plot_sweep(sweep, ax, color=colour, label=name)
        ax.axhline(100 / data.n_classes, color="#888888", ls=":", lw=0.8, label="chance")
        ax.set(title=f"by {comparison} ({data.scale} scale)", xlabel="noise (%)", ylabel="accuracy (%)", ylim=(0, 103))
        ax.legend(fontsize=6, frameon=False)


def plot_layers(data: FigS4Data, ax) -> None:
    """The layers from top to bottom, in words."""
    h, w = data.shape
    for place, layer in enumerate(LAYERS):
        text = layer.format(h=h, w=w, n=data.n_classes)
        ax.text(0.5, 1 - (place + 0.5) / len(LAYERS), text, ha="center", va="center", fontsize=7,
                bbox={"boxstyle": "round", "fc": "#DDEEFF", "ec": "#0072B2"})  # fmt: skip
    ax.axis("off")
