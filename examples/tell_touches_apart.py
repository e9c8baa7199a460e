"""Compare two antennas.

Which of two antennas discriminates thirty touches, and at which noise level accuracy falls.
"""

import sys
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

import feeler
from feeler.analysis import compute_dispersion
from feeler.decoding import Common, compute_sweep, make_labels
from feeler.tensors import rectify

RATIOS = (0.05, 0.1, 0.2, 0.3)


def main(out: Path) -> None:
    figure = Figure(figsize=(5, 3.2), layout="constrained")
    ax = figure.subplots()
    sets = {}
    for name in ("exponential", "uniform"):
        sets[name] = feeler.touch(
            feeler.presets.cockroach(name),
            feeler.presets.paper_trials(speeds=(0.3,)),
            duration=160,
        )
    peak = max(float(tensors["angle"].max()) for tensors in sets.values())
    for name, tensors in sets.items():
        angle = rectify(tensors["angle"])
        similar = compute_dispersion(angle, np.zeros(len(angle))).average["nmi"]
        sweep = compute_sweep(
            angle,
            make_labels(tensors),
            ratios=RATIOS,
            n_repeats=3,
            noise=Common(reference=peak),
            rotate=True,
        )
        accuracy = 100 * sweep.noisy.mean(axis=1)
        ax.plot(100 * sweep.ratios, accuracy, marker="o", label=name)
        nmi = next(iter(similar.values()))
        print(
            f"{name}: NMI of closest matches {nmi.estimate:.2f}, accuracy {accuracy[1]:.0f} % at 10"
            " % noise"
        )
    ax.axhline(100 * sweep.chance, color="grey", ls=":", label="chance")
    ax.set(
        xlabel="noise [% of the largest angle of both sets]",
        ylabel="accuracy, 30 classes [%]",
        ylim=(0, 102),
    )
    ax.legend(frameon=False)
    figure.savefig(out / "tell_touches_apart.png", dpi=160)


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "."))
