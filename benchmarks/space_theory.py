"""The chain in space against theory: beam modes, a heavy elastica, a helix, the moment of a whisker
against a peg. Prints and keeps the errors, and draws docs/images/space.png.
"""

import json
from pathlib import Path

import numpy as np
from kept import write_kept
from matplotlib.figure import Figure
from scipy.integrate import solve_bvp

import feeler
from feeler.antenna import compute_modes
from feeler.antenna.segments import Antenna, to_matrix
from feeler.plotting import style

ROOT = Path(__file__).parents[1]
LENGTH, MODULUS, RADIUS, DENSITY = 40.0, 5000.0, 0.1, 1.4e-3
STIFF = MODULUS * np.pi / 4 * RADIUS**4
ROOTS = {
    "cylinder": (3.51602, 22.0345, 61.6972, 120.902, 199.860),
    "cone": (8.7193, 21.1457, 38.4538, 60.6803, 87.8336),
}
TURNS = (0.0, 0.7, 2.3)  # rad, of the plane about the antenna


def make_beam(radius, n: int, damping: float = 5.0) -> Antenna:
    return Antenna.from_beam(
        length=LENGTH,
        radius=radius,
        modulus=MODULUS,
        density=DENSITY,
        n_segments=n,
        damping_time=damping,
        planes=2,
    )


def draw_modes(ax) -> dict[str, float]:
    """Errors [%] of modes 1 to 5."""
    swift, worst = RADIUS / (4 * np.pi * LENGTH**2) * np.sqrt(MODULUS / DENSITY), {}
    for kind, tip in (("cylinder", 1.0), ("cone", 1e-4)):
        for n in (60, 100):
            beam = make_beam(lambda x, tip=tip: RADIUS * (1 - (1 - tip) * x), n)
            found = compute_modes(beam, 10).frequency[::2] / swift / np.array(ROOTS[kind])
            ax.plot(range(1, 6), 100 * (found - 1), "o-", ms=3, label=f"{kind}, {n} segments")
            worst[f"{kind} {n}"] = float(100 * np.abs(found - 1).max())
    ax.axhline(0, color="0.7", lw=0.8, zorder=0)
    ax.set(xlabel="mode", ylabel="frequency over theory − 1 [%]", title="beam modes")
    ax.legend(fontsize=6)
    return worst


def solve_elastica(weight: float) -> np.ndarray:
    """Points (place, 2) of a clamped beam under a weight per length across it."""

    def slope(s, y):
        return [y[1], -weight * (LENGTH - s) * np.cos(y[0]) / STIFF]

    s = np.linspace(0, LENGTH, 200)
    found = solve_bvp(slope, lambda a, b: [a[0], b[1]], s, np.zeros((2, 200)), tol=1e-9)
    angle = found.sol(np.linspace(0, LENGTH, 4001))[0][:-1]
    return np.cumsum(np.stack([np.sin(angle), np.cos(angle)], axis=1), axis=0) * LENGTH / 4000


def draw_elastica(ax) -> float:
    """Greatest error of the tip over the length [%]."""
    antenna, worst = make_beam(RADIUS, 60, 20.0), 0.0
    pull = 3.6 * STIFF / (antenna.segment_mass.sum() * LENGTH**2)
    exact = solve_elastica(pull * antenna.segment_mass.sum() / LENGTH)
    for turn in TURNS:
        across = np.array([np.cos(turn), 0.0, np.sin(turn)])
        runs = feeler.Simulation(antenna, gravity=tuple(pull * across), timestep=0.1)
        runs.step(600.0)
        wanted = exact[:, :1] * across + exact[:, 1:] * [0.0, 1.0, 0.0]
        (line,) = ax.plot(*wanted.T, lw=1)
        ax.plot(*runs.shape()[::6].T, "o", ms=3, color=line.get_color())
        worst = max(worst, float(np.linalg.norm(runs.tip - wanted[-1]) / LENGTH))
    ax.set(
        xlabel="x [mm]", ylabel="y [mm]", zlabel="z [mm]", title="heavy elastica (lines: exact)"
    )
    return 100 * worst


def draw_helix(ax) -> float:
    """Greatest distance from the exact helix over its radius [%]."""
    n, size, bend, twist = 300, 0.1, 0.3, 0.15
    rest = np.stack([np.zeros(n), np.full(n, bend * size), np.full(n, twist * size)])
    fields = {
        "segment_mass": 1e-6,
        "radius": 0.02,
        "stiffness": np.ones((3, n)),
        "damping": 0.0,
    }
    points = Antenna(segment_length=np.full(n, size), rest_angle=rest, **fields).shape()
    square = bend**2 + twist**2
    rate, s = np.sqrt(square), np.linspace(0, n * size, n + 1)
    radius, rise = bend / square, twist / rate
    exact = np.stack(
        [radius * np.cos(rate * s), radius * np.sin(rate * s), rise * s], axis=1
    )  # to be laid onto the points
    a, b = points - points.mean(axis=0), exact - exact.mean(axis=0)
    u, _, v = np.linalg.svd(b.T @ a)
    laid = b @ u @ np.diag([1, 1, np.sign(np.linalg.det(u @ v))]) @ v
    ax.plot(*laid.T, lw=1)
    ax.plot(*a[::10].T, "o", ms=3)
    ax.set(
        xlabel="x [mm]", ylabel="y [mm]", zlabel="z [mm]", title="helix at rest (line: exact)"
    )
    return float(100 * np.linalg.norm(a - laid, axis=1).max() / radius)


def measure_moment(turn: float, place: float, angle: float = 0.02, slow: float = 1e-4) -> float:
    cone = make_beam(lambda x: RADIUS * (1 - x) + 1e-4, 60)
    to_side = to_matrix([0.0, -turn, 0.0])
    push, up = to_side @ [1.0, 0.0, 0.0], to_side @ [0.0, 0.0, 1.0]
    thick = cone.radius[round(place * cone.n_segments) - 1]
    item = feeler.Object(
        feature=feeler.Peg(radius=0.5, half_length=5.0),
        place=tuple(np.array([0.0, place * LENGTH, 0.0]) + (thick + 1e-6) * push),
        forward=tuple(-push),
        left=tuple(np.cross(up, -push)),
        friction=0.0,
    )
    motion = feeler.BaseMotion(turn=tuple(-slow * up))
    runs = feeler.Simulation(cone, item, base=motion, timestep=0.05)
    runs.step(angle / slow)
    runs.move_base()
    runs.step(60.0)
    return abs(float(runs.base_moment @ up))


def draw_moment(ax) -> float:
    """Greatest error [%] of the moment at the base of a cone against a peg."""
    places, worst = np.array([0.3, 0.4, 0.5, 0.6, 0.7, 0.8]), 0.0
    wanted = 3 * STIFF * 0.02 * (1 / (places * LENGTH) - 1 / LENGTH)
    ax.plot(places, 1e3 * wanted, color="0.3", lw=1, label="3EIθ(1/a − 1/L)")
    for turn in TURNS:
        found = np.array([measure_moment(turn, place) for place in places])
        ax.plot(places, 1e3 * found, "o", ms=3, label=f"plane turned by {turn} rad")
        worst = max(worst, float(np.abs(found / wanted - 1).max()))
    ax.set(xlabel="place of the peg / L", ylabel="moment [µN·m]", title="Birdwell's moment")
    ax.legend(fontsize=6)
    return 100 * worst


def main() -> None:
    with style():
        figure = Figure(figsize=(7.2, 6.4), layout="constrained")
        axes = [figure.add_subplot(2, 2, k + 1, projection=p) for k, p in enumerate(_KINDS)]
        for ax in axes[1:3]:
            ax.set_box_aspect((1, 1, 1), zoom=0.8)  # else its labels lie on those beside it
        found = {
            "modes [%]": draw_modes(axes[0]),
            "elastica [% of length]": draw_elastica(axes[1]),
            "helix [% of radius]": draw_helix(axes[2]),
            "moment [%]": draw_moment(axes[3]),
        }
        figure.savefig(ROOT / "docs" / "images" / "space.png", dpi=130)
    print(json.dumps(found, indent=1))
    write_kept(
        ROOT / "benchmarks" / "results" / "space_theory.json", json.dumps(found, indent=1)
    )


_KINDS = (None, "3d", "3d", None)

if __name__ == "__main__":
    main()
