"""Fig. 4: what convolutive NMF makes of the tensors: residual, entropy, bases, activations, map of locations."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from feeler.encoding import (
    ConvolutiveNMF,
    LocationMapping,
    compute_entropies,
    hoyer_sparseness,
    locate_components,
    map_locations,
    reconstruct,
)
from feeler.paper.encoder import make_encoder, prepare
from feeler.plotting.bases import plot_bases
from feeler.plotting.style import PALETTE

RANKS = (2, 3, 4, 5)  # [P]
MAIN_RANK = 3  # [P]


@dataclass(frozen=True, kw_only=True, eq=False)
class Fig4Data:
    """What Fig. 4B–D shows, and the tests of its reading."""

    ranks: tuple[int, ...]
    residual: np.ndarray
    """‖V − V̂‖/‖V‖ of each restart, (rank, restart), best first."""
    entropy: dict[str, np.ndarray]
    """Activation entropy of each restart, bits, by definition: (rank, restart), mean over activation vectors."""
    stability: np.ndarray
    """How alike the restarts' bases are, (rank,)."""
    encoders: dict[int, ConvolutiveNMF]
    """The fitted encoder of each rank."""
    examples: dict[str, np.ndarray]
    """Fixed-basis sparse codes by example, "ball 0.5" …: (component, time)."""
    mapping: dict[str, LocationMapping]
    """Location against dominant component, by code."""
    residual_by_code: dict[str, float]
    """‖V − V̂‖/‖V‖ of the jointly found activations and of each code on the same, fixed bases."""
    sparseness_by_code: dict[str, float]
    """Mean Hoyer sparseness of the rows of each code."""
    sampling: float
    """Time between samples, ms."""
    tensor_sparseness: float = field(default=float("nan"))
    """Mean Hoyer sparseness of the tensors, each as one vector."""

    def exception_at(self, definition: str = "histogram") -> tuple[int, ...]:
        """Ranks at which the best restart's entropy falls below that of the rank before; the paper: (4,)."""
        best = self.entropy[definition][:, 0]
        return tuple(rank for rank, rise in zip(self.ranks[1:], np.diff(best), strict=True) if rise < 0)


def compute(
    tensors: Any, *, scale: str = "quick", quantity: str = "angle", ranks: Sequence[int] = RANKS, random_state: int = 0
) -> Fig4Data:
    """Encode the tensors of the main antenna with each rank and measure what the paper shows.

    Parameters
    ----------
    tensors : Dataset (trial, sensor, time) with the trials' feature, location, size and speed.
    scale : smoke, quick or paper; sets restarts and iterations.
    quantity : "angle" or "curvature"; rectified.
    """
    data = prepare(tensors, quantity)
    encoders = {m: make_encoder(scale, n_components=m, random_state=random_state).fit(data) for m in ranks}
    main = encoders[MAIN_RANK if MAIN_RANK in encoders else ranks[0]]
    codes = {code: main.transform(data, code=code) for code in ("sparse", "ridge", "nonnegative")}
    codes = {"joint": main.activations_, **codes}
    locations, places = np.asarray(tensors["location"].values), locate_components(main.components_)
    size = np.linalg.norm(data)
    return Fig4Data(
        ranks=tuple(ranks),
        residual=np.stack([encoder.restarts_ for encoder in encoders.values()]),
        entropy={
            definition: np.stack([_measure_restarts(encoder, definition) for encoder in encoders.values()])
            for definition in ("histogram", "mass")
        },
        stability=np.array([encoder.stability_ for encoder in encoders.values()]),
        encoders=encoders,
        examples=_pick_examples(tensors, codes["sparse"]),
        mapping={code: map_locations(codes[code], locations, places) for code in codes},
        residual_by_code={
            code: float(np.linalg.norm(data - reconstruct(main.components_, found)) / size)
            for code, found in codes.items()
        },
        sparseness_by_code={code: float(np.nanmean(hoyer_sparseness(found))) for code, found in codes.items()},
        sampling=float(np.diff(tensors["time"].values[:2])[0]),
        tensor_sparseness=float(np.nanmean(hoyer_sparseness(data.reshape(len(data), -1)))),
    )


def _measure_restarts(encoder: ConvolutiveNMF, definition: str) -> np.ndarray:
    """Mean entropy of each restart's activation vectors, one vector per component over all trials."""
    return np.array(
        [
            np.nanmean(compute_entropies(found.transpose(1, 0, 2).reshape(found.shape[1], -1), definition))
            for found in encoder.restart_activations_
        ]
    )


def _pick_examples(tensors: Any, codes: np.ndarray) -> dict[str, np.ndarray]:
    """Codes of the slowest touches of the smaller ball and box, at every location."""
    feature, location = tensors["feature"].values.astype(str), tensors["location"].values
    speed, size = tensors["speed"].values, tensors["size"].values
    slow = speed == speed.min()
    picked = {}
    for name in ("ball", "box"):
        chosen = np.flatnonzero(slow & (feature == name))
        if chosen.size:
            chosen = chosen[size[chosen] == size[chosen].min()]
        for index in chosen[np.argsort(location[chosen], kind="stable")]:
            picked[f"{name} {location[index]:g}"] = codes[index]
    return picked


def plot_ranks(data: Fig4Data, ax: Axes) -> None:
    """Fig. 4B: residual and activation entropy against the number of bases; bars span the restarts."""
    ranks = np.array(data.ranks)
    right = ax.twinx()
    right.spines["right"].set_visible(True)
    curves = ((ax, data.residual, PALETTE[0], "o"), (right, data.entropy["histogram"], PALETTE[1], "s"))
    for axis, values, colour, marker in curves:
        middle = values[:, 0]
        spread = np.abs(np.stack([middle - values.min(axis=1), values.max(axis=1) - middle]))
        axis.errorbar(ranks, middle, spread, color=colour, marker=marker, ms=4, capsize=2)
    ax.set_xticks(ranks)
    ax.set_xlabel("number of bases M")
    ax.set_ylabel("relative residual ‖V − V̂‖/‖V‖", color=PALETTE[0])
    right.set_ylabel("activation entropy [bits]", color=PALETTE[1])


def plot_examples(data: Fig4Data, axes: np.ndarray) -> None:
    """Fig. 4D: activations of ball and box at each location, on fixed bases, as shares of the greatest."""
    names = sorted({name.split()[0] for name in data.examples})
    top = max((code.max() for code in data.examples.values()), default=1)
    for column, name in zip(axes.T, names, strict=False):
        chosen = [key for key in data.examples if key.startswith(name)]
        for ax, key in zip(column, chosen, strict=False):
            code = data.examples[key]
            time = data.sampling * np.arange(code.shape[1])
            for m, row in enumerate(code):
                ax.plot(time, row / (top or 1), color=PALETTE[m % len(PALETTE)], label=f"basis {m + 1}", lw=0.9)
            ax.set_ylim(0, 1)
            ax.set_title(f"{name} at {key.split()[1]} L", pad=2)
        column[-1].set_xlabel("time [ms]")
    for ax in axes[:, 0]:
        ax.set_ylabel("activation")


def plot(data: Fig4Data, figure: Figure) -> None:
    """The whole figure: B top left, C below, D on the right; needs about 7.2 × 7 inches."""
    left, right = figure.subfigures(1, 2, width_ratios=(1.2, 1))
    top, bottom = left.subfigures(2, 1, height_ratios=(1, 1.9))
    plot_ranks(data, top.subplots())
    top.suptitle("B", x=0.02, ha="left", weight="bold")
    sets = {f"M = {len(encoder.components_)}": encoder.components_ for encoder in data.encoders.values()}
    plot_bases(sets, data.sampling, bottom.subplots())
    bottom.suptitle("C", x=0.02, ha="left", weight="bold")
    n_rows = max((sum(k.startswith(n) for k in data.examples) for n in ("ball", "box")), default=1) or 1
    axes = right.subplots(n_rows, 2, sharex=True, sharey=True, squeeze=False)
    plot_examples(data, axes)
    right.legend(*axes[0, 0].get_legend_handles_labels(), loc="outside lower center", ncols=5)
    right.suptitle("D", x=0.02, ha="left", weight="bold")
