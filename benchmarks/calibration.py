"""Calibration: processor time of one evaluation with both engines, accuracy of its timestep, and
every optimiser's fit.

Run: PYTHONPATH=. python benchmarks/calibration.py
"""

import json
import time
from pathlib import Path

import numpy as np
from kept import write_kept

from feeler.antenna.animals import cockroach
from feeler.calibration import Problem, Protocol, fit, load_targets, make_hinges, make_starts
from paper.fig2 import PAPER_P

RESULTS = Path(__file__).parent / "results" / "calibration.json"
N_STARTS = 3
FINE = 0.005  # ms; reference for the timestep's error


def make_problem(name: str = "exponential", **protocol: object) -> Problem:
    """The four targets of the cockroach."""
    return Problem(
        hinges=make_hinges(name, cockroach()),
        targets=load_targets(),
        protocol=Protocol(**protocol),
    )


def time_evaluation(engine: str, turns: int, together: int = 1) -> float:
    """Smallest processor seconds of one evaluation, ``together`` of them in SIMD lanes."""
    problem, best = make_problem(engine=engine), np.inf
    x = problem.hinges.to_x(np.array(PAPER_P))
    xs = x + 1e-3 * np.arange(together)[:, None] * problem.hinges.scale
    for _ in range(turns):
        begin = time.process_time()
        problem.compute_many(xs)
        best = min(best, (time.process_time() - begin) / together)
    return best


def compare_timesteps() -> list[dict[str, float]]:
    """Largest relative deviation of the four quantities from those at a fine timestep."""
    fine = make_problem(timestep=FINE).measure(PAPER_P).values
    rows = []
    for timestep in (0.01, 0.02, 0.05, 0.1):
        values = make_problem(timestep=timestep).measure(PAPER_P).values
        rows.append(
            {"timestep_ms": timestep, "deviation": float(np.abs(values / fine - 1).max())}
        )
    return rows


def main() -> None:
    """Print the tables and keep them."""
    make_problem().measure(PAPER_P)  # compile
    seconds = {
        "alone": time_evaluation("chain-consistent", 9),
        "in lanes of 8": time_evaluation("chain-consistent", 3, together=8),
        "mujoco": time_evaluation("mujoco", 1),
    }
    print(
        "one evaluation [ms]:", {name: round(1e3 * value, 1) for name, value in seconds.items()}
    )
    steps = compare_timesteps()
    for row in steps:
        print(f"timestep {row['timestep_ms']} ms: {row['deviation']:.2%} from {FINE} ms")
    problem = make_problem()
    starts = make_starts(problem.hinges, N_STARTS + 1, np.random.default_rng(0))[1:]
    searches = [
        {
            "method": method,
            "start": number,
            "evaluations": minimum.evaluations,
            "seconds": minimum.seconds,
            "error": minimum.error,
            "accuracy": problem.score(minimum.p)[2],
        }
        for method in ("powell", "nelder-mead", "least-squares")
        for number, minimum in enumerate(
            fit(make_problem(), starts, method=method, max_evaluations=3000).minima, 1
        )
    ]
    for s in searches:
        print(
            f"{s['method']:14} {s['start']} {s['evaluations']:5d} antennas, {s['seconds']:6.1f} s,"
            f" error {s['error']:.4g}"
        )
    results = {
        "evaluation_s": seconds,
        "ratio_alone": seconds["mujoco"] / seconds["alone"],
        "ratio_in_lanes": seconds["mujoco"] / seconds["in lanes of 8"],
        "timesteps": steps,
        "starts": starts.tolist(),
        "searches": searches,
        "published_error": problem.score(PAPER_P)[1],
    }
    rounded = json.loads(json.dumps(results), parse_float=lambda x: float(f"{float(x):.4g}"))
    write_kept(RESULTS, json.dumps(rounded, indent=1) + "\n")


if __name__ == "__main__":
    main()
