"""Rat whiskers of published geometry.

First modes of thirty whiskers, the moment at the base by contact location, and how far a whisker
turns before it slips off a peg.
"""

import sys
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

import feeler
from feeler.antenna import compute_modes

LENGTHS = {  # mm, an average rat's whiskers from the back to the front, row by row
    "A": (39.9, 31.0, 25.1, 15.4, 10.7),
    "B": (46.8, 40.8, 29.3, 20.7, 11.8),
    "C": (52.8, 45.2, 32.6, 22.9, 13.3, 7.68, 4.4),
    "D": (52.6, 45.9, 35.3, 25.5, 17.1, 10.9, 6.62),
    "E": (44.1, 34.6, 24.4, 15.5, 9.4, 7.13),
}
MODULUS = 5000.0  # MPa
LENGTH, BASE = 40.0, 0.1  # mm; the beams that theory knows
PEG = feeler.Ball(radius=0.1)


def make_whisker(row: int, column: int, length: float) -> feeler.Antenna:
    """A whisker: it tapers, and is heavier towards its tip."""
    base = 0.5 * (0.041 + 0.002 * length + 0.011 * row - 0.0039 * column)
    slope = 0.0012 + 0.00017 * row - 0.000066 * column + 0.00011 * column**2
    tip = max(base - slope * length, 0.0015)
    return feeler.Antenna.from_beam(
        length=length,
        modulus=MODULUS,
        density=lambda x: 1.26e-3 + 0.43e-3 * x,  # g/mm³
        radius=lambda x: base + (tip - base) * x,
        n_segments=60,
        damping_time=3.0,
        sensors=[1],
    )


def make_beam(taper: float, n_segments: int = 60) -> feeler.Antenna:
    """A straight beam: ``taper`` 0 is a cylinder, 1 a whole cone."""
    return feeler.Antenna.from_beam(
        length=LENGTH,
        modulus=MODULUS,
        density=1.4e-3,
        radius=lambda x: BASE * (1 - taper * x),
        n_segments=n_segments,
        damping_time=3.0,
        sensors=[1],
    )


def place_peg(antenna: feeler.Antenna, share: float, gap: float = 0.01) -> feeler.Simulation:
    """The antenna with a peg beside it, ``gap`` [mm] from its surface."""
    place = share * antenna.length
    across = gap + float(np.interp(place, antenna.hinge_position, antenna.radius))
    peg = feeler.Object(feature=PEG, place=(across, place), forward=(-1, 0), friction=0.0)
    return feeler.Simulation(antenna, peg)


def measure_moment(antenna: feeler.Antenna, share: float, turn: float = 0.02) -> float:
    """Moment at the base [N·mm] once it has turned [rad] against the peg and has come to rest."""
    simulation = place_peg(antenna, share)
    simulation.move_base(turn=(turn + 0.01 / (share * LENGTH)) / 200)
    simulation.step(200.0)
    simulation.move_base()
    simulation.step(150.0)
    return abs(simulation.base_moment)


def compute_moment(taper: float, share: float, turn: float = 0.02) -> float:
    """The same by beam theory (Birdwell et al. 2007, equations for small angles)."""
    return 3 * MODULUS * np.pi / 4 * BASE**4 * turn / LENGTH * (1 / share - taper)


def measure_slip(antenna: feeler.Antenna, share: float, rate: float = 2e-4) -> float:
    """Turn of the base [rad] at which the whisker slips off the peg; NaN up to 1.6 rad."""
    simulation, last = place_peg(antenna, share), np.nan
    simulation.move_base(turn=rate)
    while simulation.time < 1.6 / rate:
        simulation.step(5.0)
        if len(simulation.contacts.place):
            last = simulation.time * rate
        elif simulation.time * rate > last + 0.05:
            return last
    return np.nan


def compute_slip(taper: float, share: float) -> float:
    """The same by the exact elastica: the peg pushes square on the place that touches it.

    As the base turns, that place moves out along the whisker; the whisker slips off where no
    further turn has an equilibrium.
    """

    def bend(force: float, touched: float) -> tuple[float, float]:
        """How far the base is from the touched place, and the angle between them."""

        def go(
            s: float, y: np.ndarray
        ) -> list[float]:  # from the touched place back to the base
            radius = BASE * (1 - taper * (touched - s) / LENGTH)
            turn = force * y[0] / (MODULUS * np.pi / 4 * radius**4)
            return [np.cos(y[2]), np.sin(y[2]), turn]

        x, y, angle = solve_ivp(go, (0, touched), [0, 0, 0], rtol=1e-6).y[:, -1]
        return float(np.hypot(x, y)) - share * LENGTH, float(angle - np.arctan2(y, x))

    turns, force, ends = [0.0], 1e-9, 1e3
    for touched in LENGTH * np.linspace(share, 1.0, 15)[1:]:
        most = force / 4
        while bend(most, touched)[0] > 0:
            most *= 1.5
            if most > ends:  # N; bent as far as it goes, it still reaches beyond the peg
                return max(turns)
        force = brentq(lambda f, at: bend(f, at)[0], most / 1.5, most, (touched,), rtol=1e-6)
        turns.append(bend(force, touched)[1])
        ends = 20 * force
    return max(turns)


def main(out: Path) -> dict[str, float]:
    """Draw the figure, print its numbers and return them."""
    rows = [
        (row, k, mm) for row in LENGTHS for k, mm in enumerate(LENGTHS[row], start=row == "E")
    ]  # the hindmost are column 0, and row E has none
    whiskers = [make_whisker("ABCDE".index(row) + 1, k, mm) for row, k, mm in rows]
    first = np.array([1e3 * compute_modes(one, 1).frequency[0] for one in whiskers])
    long = first[[mm > 20 for *_, mm in rows]]
    unit = BASE / (4 * np.pi * LENGTH**2) * np.sqrt(MODULUS / 1.4e-3)
    exact = {"cylinder": 3.5160 * unit, "cone": 8.7193 * unit}
    got = {"cylinder": make_beam(0.0, 140), "cone": make_beam(1.0, 140)}
    off = {k: compute_modes(one, 1).frequency[0] / exact[k] - 1 for k, one in got.items()}

    figure = Figure(figsize=(7, 5.4), layout="constrained")
    modes, beams, moments, slips = figure.subplots(2, 2).flat
    modes.loglog([mm for *_, mm in rows], first, ".", label="30 whiskers")
    modes.axhspan(27, 260, alpha=0.2, label="measured, Hartmann et al. 2003")
    modes.set(xlabel="length [mm]", ylabel="first mode [Hz]")
    modes.set_xticks([5, 10, 20, 50], ["5", "10", "20", "50"], minor=False)
    modes.set_xticks([], minor=True)
    for name, taper in (("cylinder", 0.0), ("cone", 1.0)):
        n = np.array([10, 20, 40, 80, 140])
        found = [compute_modes(make_beam(taper, k), 1).frequency[0] for k in n]
        beams.loglog(n, 100 * np.abs(np.array(found) / exact[name] - 1), ".-", label=name)
    beams.set(xlabel="segments", ylabel="first mode off theory [%]")

    places, worst = np.array([0.3, 0.4, 0.5, 0.65, 0.8, 0.9]), 0.0
    slip: dict[str, np.ndarray] = {}
    elastica: dict[str, np.ndarray] = {}
    for name, taper in (("cylinder", 0.0), ("cone", 0.998)):
        theory = np.array([compute_moment(taper, share) for share in places])
        found = np.array([measure_moment(make_beam(taper), share) for share in places])
        worst = max(worst, float(np.abs(found / theory - 1).max()))
        (line,) = moments.semilogy(places, 1e3 * theory, label=f"{name}, theory")
        moments.semilogy(
            places, 1e3 * found, "o", color=line.get_color(), label=f"{name}, feeler"
        )
    moments.set(xlabel="place of contact [length]", ylabel="base moment at 0.02 rad [µN·m]")
    for name, taper in (("cylinder", 0.0), ("tip of a tenth", 0.9)):
        shares = np.array([0.6, 0.7, 0.8, 0.9, 0.95])
        elastica[name] = np.array([compute_slip(taper, share) for share in shares])
        slip[name] = np.array([measure_slip(make_beam(taper), share) for share in shares])
        (line,) = slips.plot(shares, elastica[name], label=f"{name}, elastica")
        slips.plot(shares, slip[name], "o", color=line.get_color(), label=f"{name}, feeler")
    late = [slip[name] / elastica[name] - 1 for name in slip]
    slips.set(xlabel="place of first contact [length]", ylabel="turn at slip-off [rad]")
    for ax in figure.axes:
        ax.legend(fontsize=6)
    figure.savefig(out / "rat_whiskers.png", dpi=160)

    values = {
        "slowest": long.min(),
        "fastest": long.max(),
        "cylinder": 100 * off["cylinder"],
        "cone": 100 * off["cone"],
        "moment": 100 * worst,
        "slip_cylinder": float(slip["cylinder"][3]),
        "slip_cone": float(slip["tip of a tenth"][3]),
        "slip_off": 100 * float(np.nanmax(np.abs(late))),
    }
    print(f"first modes of whiskers over 20 mm: {long.min():.0f} to {long.max():.0f} Hz")
    print(
        f"140 segments off theory: cylinder {values['cylinder']:.3f} %, cone {values['cone']:.3f} %"
    )
    print(f"base moment off theory by at most {values['moment']:.2f} %")
    print(f"slips off at 0.9 of the length after {values['slip_cylinder']:.2f} rad (cylinder)")
    print(f"or {values['slip_cone']:.2f} rad (tip of a tenth)")
    return values


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "."))
