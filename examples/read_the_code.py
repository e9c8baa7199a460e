"""Encode touches with convolutive NMF.

Thirty touches become three bases and sparse activations, from which the contact location is
classified.
"""

import sys
from pathlib import Path

import numpy as np
from matplotlib.colors import Normalize
from matplotlib.figure import Figure

import feeler
from feeler.encoding import locate_components, map_locations
from feeler.plotting import plot_tensor
from feeler.tensors import rectify


def main(out: Path) -> None:
    antenna = feeler.presets.cockroach("exponential")
    tensors = feeler.touch(antenna, feeler.presets.paper_trials(speeds=(0.3,)), duration=120)
    angle = rectify(tensors["angle"])

    encoder = feeler.ConvolutiveNMF(
        n_components=3, n_lags=40, sparseness=0.8, max_iter=60, warn=False, random_state=0
    )
    encoder.fit(angle)
    code = encoder.transform(angle, code="ridge")
    found = map_locations(
        code, tensors["location"].values, locate_components(encoder.components_)
    )
    print(
        f"residual {encoder.reconstruction_err_ / np.linalg.norm(angle):.2f}; the dominant basis"
        f" tells {found.information:.2f} of {found.ceiling:.2f} bits about the place (p ="
        f" {found.p_information:.3f})"
    )

    figure = Figure(figsize=(7, 4), layout="constrained")
    axes = figure.subplots(2, 3)
    for number, (ax, basis) in enumerate(
        zip(axes[0], encoder.components_, strict=True), start=1
    ):
        plot_tensor(
            basis, np.arange(basis.shape[1]), ax, Normalize(0, basis.max()), labels=number == 1
        )
        ax.set_title(f"basis {number}")
    for ax, place in zip(axes[1], (0.5, 0.7, 0.9), strict=True):
        trial = int(np.flatnonzero(tensors["location"].values == place)[0])
        ax.plot(tensors["time"], code[trial].T)
        ax.set(title=f"ball at {place:g} L", xlabel="time [ms]")
    axes[1, 0].set_ylabel("activation of each basis")
    figure.savefig(out / "read_the_code.png", dpi=160)


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "."))
