"""Fig. S4: the convolutional network on tensors, accuracy against noise by speed and by profile."""

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from types import SimpleNamespace
from typing import Any

import numpy as np
from matplotlib.figure import Figure, SubFigure

from feeler.decoding import Relative, Sweep, compute_sweep, list_groups
from feeler.decoding.network import TouchNetwork, import_torch
from feeler.plotting.results import plot_sweep
from feeler.plotting.style import PALETTE, pick_colours
from feeler.report import Section
from paper.cache import keep
from paper.context import Context
from paper.data import WINDOWS, complete_arrays, list_profiles, load_complete, load_tensors
from paper.fig5_data import name_speeds, spread_accuracy

_LAYERS = (
    "input {h} × {w} × 1",
    "convolution 15 × 15, 32, padding 2",
    "batch norm",
    "ReLU",
    "max pool 2 × 2",
    "fully connected 50",
    "dropout 0.25",
    "fully connected {n}",
    "softmax",
)
_BATCH_SIZE = 8  # [C] few images make many steps


def compute(context: Context) -> SimpleNamespace:
    """Train and score the network on noisy copies of every group's tensors, and, of several
    profiles, on complete touches, each over its own shortest full window with the samples of the
    paper's.

    Returns
    -------
    SimpleNamespace
        ``rows``. ``sweeps[comparison][group]``; comparisons are ``speed`` and ``profile``.
        ``windows[window][profile]``: profiles in both windows. ``shape`` (sensor, time) of a
        tensor, and ``n_classes``. At a scale without the network all are empty.

    Raises
    ------
    MissingDependencyError
        PyTorch is not installed; the message holds the install command.
    """
    names, settings = list_profiles(context), context.effort.network
    if not settings:
        return SimpleNamespace(rows={}, sweeps={})
    groups = list_groups(
        {name: load_tensors(context, name) for name in names}, reference=names[0]
    )
    windows = {}
    with _one_thread(import_torch()):
        sweeps = _sweep_groups(groups, settings, random_state=context.seed)
        if len(names) > 1:
            arrays, labels = complete_arrays(
                {name: load_complete(context, name) for name in names}
            )
            whole = {"profile": {name: (array, labels) for name, array in arrays.items()}}
            found = _sweep_groups(whole, settings, random_state=context.seed)
            windows = {WINDOWS[0]: sweeps["profile"], WINDOWS[1]: found["profile"]}
    speeds = name_speeds(context)
    rows = {
        f"cnn.{speeds.get(name, name)}": spread_accuracy(sweep)
        for one in sweeps.values()
        for name, sweep in one.items()
    } | {
        f"cnn.{window}.{name}": spread_accuracy(sweep)
        for window, one in windows.items()
        for name, sweep in one.items()
    }
    array, labels = next(iter(next(iter(groups.values())).values()))
    return SimpleNamespace(
        rows=rows,
        sweeps=sweeps,
        windows=windows,
        shape=array.shape[1:],
        n_classes=np.unique(labels).size,
    )


def _sweep_groups(
    groups: Mapping[str, Mapping[str, tuple[np.ndarray, np.ndarray]]],
    settings: Mapping[str, Any],
    *,
    random_state: int = 0,
) -> dict[str, dict[str, Sweep]]:
    """The network's accuracy against noise for every group of every comparison: tensors and labels
    of each.
    """
    options = dict(settings)
    max_epochs = options.pop("max_epochs")
    options |= {"noise": Relative(), "n_jobs": 1, "random_state": random_state}
    sweeps: dict[str, dict[str, Sweep]] = {}
    for comparison, members in groups.items():
        sweeps[comparison] = {}
        for name, (array, labels) in members.items():
            network = TouchNetwork(
                array.shape[1:],
                max_epochs=max_epochs,
                batch_size=_BATCH_SIZE,
                random_state=random_state,
            )
            # slow touches of the reference stand in both comparisons
            sweeps[comparison][name] = keep(
                "sweep", compute_sweep, array, labels, estimator=network, **options
            )
    return sweeps


def plot(data: SimpleNamespace, figure: Figure | SubFigure) -> None:
    """The layers, then one panel per comparison."""
    axes = figure.subplots(1, 1 + max(len(data.sweeps), 1))
    _plot_layers(data, axes[0])
    for (comparison, sweeps), ax in zip(data.sweeps.items(), axes[1:], strict=False):
        colours = pick_colours(sweeps)
        for name, sweep in sweeps.items():
            plot_sweep(sweep, ax, color=colours[name], label=name)
        ax.axhline(100 / data.n_classes, color="#888888", ls=":", lw=0.8, label="chance")
        ax.set(
            title=f"by {comparison}", xlabel="noise [%]", ylabel="accuracy [%]", ylim=(0, 103)
        )
        ax.legend(fontsize=7, frameon=False)


def _plot_layers(data: SimpleNamespace, ax) -> None:
    """The layers from top to bottom, in words."""
    h, w = data.shape
    for place, layer in enumerate(_LAYERS):
        text = layer.format(h=h, w=w, n=data.n_classes)
        ax.text(
            0.5,
            1 - (place + 0.5) / len(_LAYERS),
            text,
            ha="center",
            va="center",
            fontsize=7,
            bbox={"boxstyle": "round", "fc": "#DDEEFF", "ec": PALETTE[2]},
        )
    ax.axis("off")


def show(data: SimpleNamespace, section: Section) -> None:
    """Fig. S4, which needs torch; below paper scale, how to add it."""
    if not data.sweeps:
        section.text(
            "Left out at this scale: the network of Fig. S4 needs PyTorch. `make reproduce"
            " SCALE=paper` installs it and runs this section; `pip install 'feeler[cnn]'` adds it"
            " to an environment of yours."
        )
        return
    if data.windows:
        section.table(
            ["window", *data.windows[WINDOWS[0]]],
            [
                [window, *(float(one.noisy[one.ratios > 0].mean()) for one in sweeps.values())]
                for window, sweeps in data.windows.items()
            ],
            "Accuracy of the network on slow tensors by profile, averaged over the noise.",
        )
    section.figure(
        "figS4_cnn",
        "Accuracy of the paper's network against noise, by speed and by profile; mean ± 1 SD. (Fig."
        " S4B–C)",
        lambda figure: plot(data, figure),
        height=3.2,
        numbers={
            comparison: {
                name: {"ratio": s.ratios, "accuracy": s.noisy} for name, s in sweeps.items()
            }
            for comparison, sweeps in data.sweeps.items()
        },
    )


@contextmanager
def _one_thread(torch: Any) -> Iterator[None]:
    """Sums do not depend on the machine's cores; and beside another stage, threads only wait for
    each other.
    """
    before = torch.get_num_threads()
    torch.set_num_threads(1)
    try:
        yield
    finally:
        torch.set_num_threads(before)
