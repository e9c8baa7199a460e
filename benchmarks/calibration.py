"""Calibration: processor time of one evaluation with both engines, and of a fit by each optimiser."""

import json
import time
from pathlib import Path

import numpy as np

from feeler.antenna.cockroach import cockroach
from feeler.calibration import METHODS, Problem, Protocol, load_targets, make_hinges, search

PUBLISHED = np.array([37.78, 25.24, -0.0827, -0.0533])
START = np.array([50.0, 20.0, -0.075, -0.05])  # one perturbed start for all optimisers
EVALUATIONS = 250


def make_problem(engine: str = "chain") -> Problem:
    """The four targets of the cockroach."""
    return Problem(
        hinges=make_hinges("exponential", cockroach()), targets=load_targets(), protocol=Protocol(engine=engine)
    )


def time_evaluation(engine: str, turns: int) -> float:
    """Smallest processor seconds of one evaluation."""
    problem, best = make_problem(engine), np.inf
    for _ in range(turns):
        begin = time.process_time()
        problem.measure(PUBLISHED)
        best = min(best, time.process_time() - begin)
    return best


def main() -> None:
    """Print a table and write benchmarks/results/calibration.json."""
    make_problem().measure(PUBLISHED)  # compile
    seconds = {"chain": time_evaluation("chain", 5), "mujoco": time_evaluation("mujoco", 1)}
    ratio = seconds["mujoco"] / seconds["chain"]
    print(
        f"one evaluation: chain {seconds['chain'] * 1e3:.0f} ms, mujoco {seconds['mujoco'] * 1e3:.0f} ms ({ratio:.0f}×)"
    )
    fits = {}
    for method in METHODS:
        problem, begin = make_problem(), time.process_time()
        found = search(problem, START, method, max_evaluations=EVALUATIONS)
        fits[method] = {
            "evaluations": found.evaluations,
            "processor_s": time.process_time() - begin,
            "error": found.error,
        }
        row = fits[method]
        print(f"{method:14} {row['evaluations']:4d} evaluations, {row['processor_s']:6.1f} s, error {row['error']:.4g}")
    results = {
        "evaluation_s": seconds,
        "ratio": ratio,
        "fits": fits,
        "published_error": make_problem().score(PUBLISHED)[1],
    }
    path = Path(__file__).parent / "results" / "calibration.json"
    path.parent.mkdir(exist_ok=True)
    rounded = json.loads(json.dumps(results), parse_float=lambda x: float(f"{float(x):.4g}"))
    path.write_text(json.dumps(rounded, indent=1) + "\n")


if __name__ == "__main__":
    main()
