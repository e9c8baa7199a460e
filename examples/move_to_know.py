"""Compare active-sensing policies.

A policy of your own against fixed speeds: accuracy by deadline.
"""

import sys
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from feeler.active import Belief, Observer, TouchTask, parse_policy


def policy(known: Belief) -> np.ndarray:
    """Fast to the object; slow once it is felt; slower the more objects it may be."""
    doubt = 1 - known.belief.max(axis=1)
    return np.where(known.touching < 0.5, 1.2, np.where(doubt > 0.5, 0.12, 0.3))


def main(out: Path) -> None:
    observer = Observer(TouchTask(pool=12, duration=50.0, noise=0.03))
    figure = Figure(figsize=(7, 3), layout="constrained")
    left, right = figure.subplots(1, 2)
    for name, chosen in {
        "mine": policy,
        "0.3 m/s": parse_policy("fixed:0.3"),
        "1.2 m/s": parse_policy("fixed:1.2"),
    }.items():
        seen = observer.run(chosen, copies=2)
        left.plot(seen.time, 100 * seen.accuracy, label=name)
        right.plot(seen.time, seen.work.mean(axis=1))
        print(
            f"{name}: {100 * seen.accuracy[-1]:.0f} % right by {seen.time[-1]:g} ms,"
            f" {seen.work[-1].mean():.2f} µJ"
        )
    left.set(xlabel="time [ms]", ylabel="right answers [%]")
    right.set(xlabel="time [ms]", ylabel="work on the antenna [µJ]")
    left.legend()
    figure.savefig(out / "move_to_know.png", dpi=160)


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "."))
