"""Fit a recorded release.

Releases of an antenna (synthetic, with noise) determine its stiffness and damping.
"""

import sys
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from feeler.calibration import fit_traces, make_synthetic_traces, predict_release
from feeler.presets import cockroach

PLANTED = (1.3, 0.8)  # factors on the preset's stiffness and damping that the fit has to find


def main(out: Path) -> None:
    antenna = cockroach("exponential")
    traces = make_synthetic_traces(
        antenna, np.random.default_rng(3), n_animals=3, planted=PLANTED
    )
    found = fit_traces(traces, antenna)
    for name, planted, value, low, high in zip(
        found.names, PLANTED, found.p, found.low, found.high, strict=True
    ):
        print(
            f"{name}: planted {planted:g}, found {value:.2f} (95 % interval {low:.2f} to"
            f" {high:.2f})"
        )

    figure = Figure(figsize=(5, 3.2), layout="constrained")
    ax = figure.subplots()
    for name in traces.animals:
        one = predict_release(traces.select(name), found.antenna)
        (line,) = ax.plot(one.time, one.recorded[-1], ".", ms=3)
        ax.plot(one.time, one.simulated[-1], color=line.get_color())
    ax.set(xlabel="time since release [ms]", ylabel="tip displacement [share of the first]")
    ax.set_title("dots: synthetic recordings; lines: their mean antenna")
    figure.savefig(out / "fit_a_recording.png", dpi=160)


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "."))
