"""Change a stiffness gradient.

How the gradient of stiffness moves an antenna's resonances, and how fast it comes to rest after a
touch.
"""

import sys
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

import feeler
from feeler.analysis import measure_free_response
from feeler.antenna import Exponential, compute_modes

N = 60


def make_antenna(rate: float) -> feeler.Antenna:
    """40 mm of equal segments whose hinges soften towards the tip by ``rate`` per segment, at one
    mean compliance.
    """
    shape = Exponential(base=1.0, rate=rate).sample(N)
    stiffness = 3.0 * shape * np.mean(1 / shape)  # N·mm/rad
    return feeler.Antenna(
        segment_length=np.full(N, 40 / N),
        segment_mass=np.full(N, 1.5e-3 / N),
        radius=0.2,
        stiffness=stiffness,
        damping=0.6 * stiffness,
        sensors=np.arange(1, N + 1),
        name=f"rate {rate:g}",
    )


def main(out: Path) -> None:
    figure = Figure(figsize=(7, 3), layout="constrained")
    ax = figure.subplots()
    for rate in (0.0, -0.03, -0.06):
        antenna = make_antenna(rate)
        motion = feeler.release(antenna, at=10.0, deflection=1.0, duration=150)
        tip = motion["tip"].sel(trial=0, axis="x").values
        ax.plot(motion["time"], tip, label=antenna.name)
        found = measure_free_response(motion["time"].values, tip)
        modes = 1e3 * compute_modes(antenna, 2).frequency
        ratio = found.damping_ratio
        print(
            f"{antenna.name}: modes at {modes[0]:.0f} and {modes[1]:.0f} Hz, damping ratio"
            f" {ratio:.2f}, at rest within 5 % after {found.settle_5:.0f} ms"
        )
    ax.set(xlabel="time since release [ms]", ylabel="tip displacement [mm]")
    ax.legend(frameon=False)
    figure.savefig(out / "design_an_antenna.png", dpi=160)


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "."))
