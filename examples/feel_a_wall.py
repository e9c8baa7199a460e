"""Measure wall distance.

As a wall approaches, the location of greatest bending gives its distance.
"""

import sys
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from feeler.presets import cockroach
from feeler.wall import Posture, approach, map_distance


def main(out: Path) -> None:
    sweep = approach(cockroach("exponential"), Posture(prebend="none", friction=0.0))
    found = map_distance(sweep)
    near, far = found.told_apart
    print(
        f"R² {found.r2:.3f}, error {found.error:.1f} mm, distances from {near:.1f} to {far:.1f} mm"
        " are discriminated"
    )

    figure = Figure(figsize=(7, 3.2), layout="constrained")
    left, right = figure.subplots(1, 2)
    for points in sweep.points:
        left.plot(points[:, 0], points[:, 1], color="#0072B2", alpha=0.5, lw=1)
    left.set(
        xlabel="x [mm]", ylabel="y [mm]", aspect="equal", title="equilibria, one per distance"
    )
    right.plot(found.position, found.distance, "o", ms=4)
    span = np.array([np.nanmin(found.position), np.nanmax(found.position)])
    right.plot(span, found.predict(span), color="grey")
    right.set(
        xlabel="place of greatest curvature from the base [mm]",
        ylabel="distance of the wall [mm]",
    )
    figure.savefig(out / "feel_a_wall.png", dpi=160)


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "."))
