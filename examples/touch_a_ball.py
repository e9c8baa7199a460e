"""Touch a ball.

A ball moves into a cockroach antenna; every sensor measures the angle of its hinge over time.
"""

import sys
from pathlib import Path

from matplotlib.colors import Normalize
from matplotlib.figure import Figure

import feeler
from feeler.plotting import plot_tensor


def main(out: Path) -> None:
    antenna = feeler.presets.cockroach("exponential")
    trial = feeler.Trial(feature=feeler.Ball(radius=1.53), location=0.5, speed=0.6)
    tensors = feeler.touch(antenna, [trial], duration=100, all_hinges=True)

    curvature = tensors["curvature"].sel(trial=0)
    figure = Figure(figsize=(7, 3), layout="constrained")
    left, right = figure.subplots(1, 2)
    for time, points in zip(
        tensors["time"].values, antenna.shape(tensors["angle"].values[0].T), strict=True
    ):
        if time % 10 == 0:
            left.plot(points[:, 0], points[:, 1], color="#0072B2", alpha=0.2 + 0.008 * time)
    left.set(xlabel="x [mm]", ylabel="y [mm]", aspect="equal", title="every 10 ms")
    image = plot_tensor(
        curvature.values, tensors["time"].values, right, Normalize(0, curvature.max())
    )
    figure.colorbar(image, label="curvature [1/mm]")
    figure.savefig(out / "touch_a_ball.png", dpi=160)

    touching = abs(tensors["force"].sel(trial=0)).sum("axis") > 0
    first = float(tensors["time"][touching.values].min())
    print(f"contact at {first:.0f} ms; greatest curvature {float(curvature.max()):.3f} 1/mm")


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "."))
