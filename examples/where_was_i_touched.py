"""Locate a contact along a whisker.

The moment at the base of a whisker gives the contact location (Birdwell et al. 2007).
"""

import sys
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

import feeler

LENGTH, BASE, MODULUS, TURN, GAP = 40.0, 0.1, 5000.0, 0.02, 0.01  # mm, mm, MPa, rad, mm


def measure_moment(whisker: feeler.Antenna, place: float) -> float:
    """Moment at the base [N·mm] once it has turned against a peg, ``place`` [mm] from it."""
    across = GAP + float(np.interp(place, whisker.hinge_position, whisker.radius))
    peg = feeler.Ball(radius=0.1)
    peg = feeler.Object(feature=peg, place=(across, place), forward=(-1, 0), friction=0.0)
    simulation = feeler.Simulation(whisker, peg)
    simulation.move_base(turn=(TURN + GAP / place) / 200)
    simulation.step(200.0)
    simulation.move_base()
    simulation.step(150.0)  # it comes to rest
    return abs(simulation.base_moment)


def main(out: Path) -> dict[str, float]:
    """Draw moments and the places that they tell; return the greatest error [mm]."""
    beam = {"length": LENGTH, "modulus": MODULUS, "density": 1.4e-3, "damping_time": 3.0}
    whisker = feeler.Antenna.from_beam(
        **beam, radius=lambda x: BASE * (1 - 0.998 * x)
    )  # a cone
    places = LENGTH * np.linspace(0.3, 0.9, 7)
    moments = np.array([measure_moment(whisker, place) for place in places])
    stiffness = (
        3 * MODULUS * np.pi / 4 * BASE**4 * TURN
    )  # M = stiffness (1/place - 0.998/LENGTH)
    told = 1 / (moments / stiffness + 0.998 / LENGTH)
    error = float(np.abs(told - places).max())
    figure = Figure(figsize=(3.5, 2.8), layout="constrained")
    ax = figure.subplots()
    ax.plot(places, told, "o", label="told by the moment at the base")
    ax.plot(places, places, color="#59636e", label="true")
    ax.set(xlabel="place of the peg [mm]", ylabel="place that is told [mm]")
    ax.legend(fontsize=7)
    figure.savefig(out / "where_was_i_touched.png", dpi=160)
    print(f"a peg 12 to 36 mm from the base is placed within {error:.2f} mm")
    return {"error": error}


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "."))
