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


def compute(
    tensors: Mapping[str, Any],
    *,
    settings: Mapping[str, Any],
    reference: str = "exponential",
    random_state: int = 0,
    device: str = "auto",
) -> SimpleNamespace:
    """Train and score the network on noisy copies of every group's tensors.

    Parameters
    ----------
    tensors
        Datasets by antenna name, as for Fig. 5.
    settings
        ``max_epochs`` of each training, and what ``compute_sweep`` takes: ``ratios``,
        ``n_repeats``, ``n_copies``.

    Returns
    -------
    SimpleNamespace
        ``sweeps[comparison][group]``; comparisons are ``speed`` and ``profile``. ``shape`` (sensor,
        time) of a tensor, and ``n_classes``.

    Raises
    ------
    MissingDependencyError
        PyTorch is not installed; the message holds the install command.
    """
    groups = list_groups(tensors, reference=reference)
    sweeps = _sweep_groups(groups, settings, random_state=random_state, device=device)
    array, labels = next(iter(next(iter(groups.values())).values()))
    return SimpleNamespace(
        sweeps=sweeps, shape=array.shape[1:], n_classes=np.unique(labels).size
    )


def _sweep_groups(
    groups: Mapping[str, Mapping[str, tuple[np.ndarray, np.ndarray]]],
    settings: Mapping[str, Any],
    *,
    random_state: int = 0,
    device: str = "auto",
) -> dict[str, dict[str, Sweep]]:
    """The network's accuracy against noise for every group of every comparison: tensors and labels
    of each.
    """
    import_torch()
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
                device=device,
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


def show(context: Context, section: Section) -> None:
    """Fig. S4, which needs torch; below paper scale, how to add it."""
    if not context.effort.network:
        section.text(
            "Left out at this scale: the network of Fig. S4 needs PyTorch. `make reproduce"
            " SCALE=paper` installs it and runs this section; `pip install 'feeler[cnn]'` adds it"
            " to an environment of yours."
        )
        return
    sets = {name: load_tensors(context, name) for name in list_profiles(context)}
    first = next(iter(sets))
    with _one_thread(import_torch()):
        data = compute(
            sets, settings=context.effort.network, reference=first, random_state=context.seed
        )
        _show_complete(context, section, data)
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
    speeds = name_speeds(context)
    for sweeps in data.sweeps.values():
        for name, sweep in sweeps.items():
            section.values[f"cnn.{speeds.get(name, name)}"] = spread_accuracy(sweep)


def _show_complete(context: Context, section: Section, cut: SimpleNamespace) -> None:
    """Profiles again over complete touches, each over its own shortest full window with the samples
    of the paper's.
    """
    names = list_profiles(context)
    if len(names) < 2:
        return
    arrays, labels = complete_arrays({name: load_complete(context, name) for name in names})
    groups = {"profile": {name: (array, labels) for name, array in arrays.items()}}
    whole = _sweep_groups(groups, context.effort.network, random_state=context.seed)["profile"]
    found = {WINDOWS[0]: cut.sweeps["profile"], WINDOWS[1]: whole}
    rows = []
    for window, sweeps in found.items():
        for name, sweep in sweeps.items():
            section.values[f"cnn.{window}.{name}"] = spread_accuracy(sweep)
        rows.append(
            [
                window,
                *(float(sweep.noisy[sweep.ratios > 0].mean()) for sweep in sweeps.values()),
            ]
        )
    section.table(
        ["window", *whole],
        rows,
        "Accuracy of the network on slow tensors by profile, averaged over the noise.",
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
