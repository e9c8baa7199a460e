"""Time to accuracy on a problem that a chain and a Cosserat rod share: one swing of a uniform
cantilever in its first mode.

    python benchmarks/peers/workprecision.py    # results/workprecision_peers.json, drawn by
    benchmarks/workprecision.py

Declared before it was run [C]: a rod of 42 mm, 2 mg and 0.1 mm radius that swings at 17.5 Hz,
straight at time 0, with the velocities of its first mode and 0.1 mm of excursion at the tip, so
small that Euler–Bernoulli's tip A sin ωt is the truth. A chain's hinges hold EI / ℓ, its first one
twice that, since half a segment lies between clamp and hinge. Every solver takes half of the
greatest timestep that is stable for its number of elements: 2 / ω of the fastest bending wave for
chains; for PyElastica's explicit rod the time of an axial wave through an element, or 2 / ω of its
turning against shear if that is less (with the axial wave alone, as first declared, it diverged: a
rod this thin turns faster). The error is the tip's greatest distance from the truth at 50 moments
of the swing, over A. One thread, the fastest of three runs in processor time, or the only one where
that takes longer than 5 s. Of PyElastica 10 and 20 elements have been run, by hand stopped then.
"""

import json
import time
from pathlib import Path

import elastica as ea
import numpy as np

from feeler.antenna.segments import Antenna
from feeler.physics.run import run_scene
from feeler.physics.scene import Clock, Scene

LENGTH, MASS, RADIUS, HERTZ, EXCURSION, SAMPLES, RUNS = 42.0, 2e-3, 0.1, 17.5, 0.1, 50, 3
ROOT = 1.875104068711961  # of cos x cosh x = −1: the first mode's wave number times the length
OMEGA = 2e-3 * np.pi * HERTZ  # rad/ms
LINEAR = MASS / LENGTH  # g/mm
STIFFNESS = OMEGA**2 * LINEAR * (LENGTH / ROOT) ** 4  # EI, N·mm²
SAMPLE = 1e3 / HERTZ / SAMPLES  # ms
ELEMENTS = {
    "feeler chain-consistent": (10, 20, 40, 80, 160),
    "MuJoCo Euler": (10, 20, 40),
    "PyElastica": (10, 20, 40, 80),
}
RESULT = Path(__file__).parents[1] / "results" / "workprecision_peers.json"


def compute_mode(place: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The first mode's shape and slope [1/mm] at places along the rod [mm]; its tip is at 1."""

    def shape(x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        ratio = (np.cosh(ROOT) + np.cos(ROOT)) / (np.sinh(ROOT) + np.sin(ROOT))
        value = np.cosh(x) - np.cos(x) - ratio * (np.sinh(x) - np.sin(x))
        slope = np.sinh(x) + np.sin(x) - ratio * (np.cosh(x) - np.cos(x))
        return value, slope * ROOT / LENGTH

    (value, slope), (tip, _) = shape(ROOT * place / LENGTH), shape(np.array(ROOT))
    return value / tip, slope / tip


def count_steps(greatest: float) -> int:
    """Steps per sample at half of the greatest timestep [ms]."""
    return int(np.ceil(SAMPLE / (0.5 * greatest)))


def make_chain(n: int, engine: str):
    """The swing of a chain of n rigid segments: a function that gives the tip's path (sample,)
    [mm].
    """
    length = LENGTH / n
    stiffness = np.full(n, STIFFNESS / length)
    stiffness[0] *= 2
    antenna = Antenna(
        segment_length=np.full(n, length),
        segment_mass=MASS / n,
        radius=RADIUS,
        stiffness=stiffness,
        damping=0.0,
    )
    turn = EXCURSION * OMEGA * compute_mode((np.arange(n) + 0.5) * length)[1]
    scene = Scene(antenna=antenna, velocity=np.diff(turn, prepend=0.0))
    steps = count_steps(length**2 / 2 * np.sqrt(LINEAR / STIFFNESS))
    clock = Clock(duration=SAMPLE * SAMPLES, sample_interval=SAMPLE, timestep=SAMPLE / steps)
    return lambda: antenna.shape(run_scene(scene, clock, engine).angle)[:, -1, 0]


def make_elastica(n: int):
    """The swing of a Cosserat rod of n elements by position–Verlet steps, in g, mm, ms."""

    class Simulator(ea.BaseSystemCollection, ea.Constraints):
        pass

    density, modulus = LINEAR / (np.pi * RADIUS**2), STIFFNESS / (np.pi * RADIUS**4 / 4)
    axial, shear = np.sqrt(modulus / density), np.sqrt(27 / 28 * modulus / 2.6 / density)
    steps = count_steps(
        min(LENGTH / n / axial, RADIUS / shear)
    )  # ω = shear √(A / I) = 2 shear / radius

    def begin() -> tuple[Simulator, ea.CosseratRod]:
        simulator = Simulator()
        rod = ea.CosseratRod.straight_rod(
            n,
            np.zeros(3),
            np.array([0.0, 1.0, 0.0]),
            np.array([0.0, 0.0, 1.0]),
            LENGTH,
            RADIUS,
            density,
            youngs_modulus=modulus,
            shear_modulus=modulus / 2.6,
        )
        simulator.append(rod)
        simulator.constrain(rod).using(
            ea.OneEndFixedBC, constrained_position_idx=(0,), constrained_director_idx=(0,)
        )
        simulator.finalize()
        places = np.linspace(0.0, LENGTH, n + 1)
        rod.velocity_collection[0] = EXCURSION * OMEGA * compute_mode(places)[0]
        slope = EXCURSION * OMEGA * compute_mode((places[1:] + places[:-1]) / 2)[1]
        rod.omega_collection[:] = (
            np.einsum("ijk,j->ik", rod.director_collection, [0.0, 0.0, -1.0]) * slope
        )
        return simulator, rod

    def run() -> np.ndarray:
        (simulator, rod), now, tip = begin(), np.float64(0.0), [0.0]
        for _ in range(SAMPLES - 1):
            for _ in range(steps):
                now = stepper.step(simulator, now, np.float64(SAMPLE / steps))
            tip.append(rod.position_collection[0, -1])
        return np.array(tip)

    stepper = ea.PositionVerlet()
    stepper.step(begin()[0], np.float64(0.0), np.float64(SAMPLE / steps))  # compiles
    return run


def main() -> None:
    truth, rows = EXCURSION * np.sin(OMEGA * SAMPLE * np.arange(SAMPLES)), []
    makers = {
        "feeler chain-consistent": lambda n: make_chain(n, "chain-consistent"),
        "MuJoCo Euler": lambda n: make_chain(n, "mujoco"),
        "PyElastica": make_elastica,
    }
    for solver, make in makers.items():
        for n in ELEMENTS[solver]:
            run, best = make(n), np.inf
            for _ in range(RUNS):
                start = time.process_time()
                tip = run()
                best = min(best, time.process_time() - start)
                if best > 5:
                    break
            error = float(np.abs(tip - truth).max() / EXCURSION)
            rows.append(
                {
                    "touch": "swing",
                    "solver": solver,
                    "elements": n,
                    "seconds": best,
                    "error": error,
                }
            )
            print(f"{solver:24} {n:4} elements  {best:8.3f} s  {error:.3%}", flush=True)
            rounded = json.loads(
                json.dumps(rows), parse_float=lambda x: float(f"{float(x):.3g}")
            )
            RESULT.write_text(json.dumps(rounded, indent=1) + "\n")


if __name__ == "__main__":
    main()
