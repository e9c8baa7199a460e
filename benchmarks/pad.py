"""A pad of the rat's 31 whiskers, 20 segments each, at 0.01 ms: how much faster than life one core
and two step it, free and with a ball against every whisker.

    python benchmarks/pad.py

Best of several rounds: processor time of one thread, as the machine may be shared, and the time on
the wall of two, to which whiskers go in groups of eight (``workers=`` of ``feeler.Simulations``).
The second asks for a machine that does nothing else.
"""

import json
import time
from pathlib import Path

import numpy as np
from kept import write_kept

import feeler
from feeler.objects.bodies import Object
from feeler.physics.scene import Scene
from feeler.presets import rat_whiskers

ROUNDS, SPAN, WARM, TIMESTEP = 11, 10.0, 3.0, 0.01  # ms


def make_scenes(touched: bool) -> list[Scene]:
    """The thirty whiskers of the right cheek and the first of them again."""
    whiskers = [antenna for antenna, _ in rat_whiskers("right").values()]
    return [make(antenna, touched) for antenna in [*whiskers, whiskers[0]]]


def make(antenna: feeler.Antenna, touched: bool) -> Scene:
    """A whisker that swings, or one against which a ball presses at 0.6 of its length."""
    if not touched:
        start = np.random.default_rng(0).normal(0, 0.003, antenna.rest_angle.shape)
        return Scene(antenna=antenna, angle=antenna.rest_angle + start)
    x, y, _ = antenna.shape()[12]
    place = (x - antenna.radius[0] - 0.01, y, 0.05)
    ball = Object(feature=feeler.Ball(radius=1.0), place=place, velocity=(0.02, 0.0, 0.001))
    return Scene(antenna=antenna, objects=(ball,))


def measure(engine: str, touched: bool, workers: int) -> float:
    """Simulated over processor time of one thread, or over the time on the wall of more."""
    read = time.process_time if workers == 1 else time.perf_counter
    scenes = make_scenes(touched)
    pad = feeler.Simulations(scenes, engine=engine, timestep=TIMESTEP, workers=workers)
    pad.step(WARM)
    moment, best = pad.snapshot(), 0.0
    for _ in range(ROUNDS):
        pad.restore(moment)
        start = read()
        pad.step(SPAN)
        best = max(best, 1e-3 * SPAN / (read() - start))
        met = [len(pad.read_contacts(lane)) > 0 for lane in range(len(pad))]
        assert all(met) if touched else not any(met)
    return round(best, 2)


def main() -> None:
    found = {
        f"{engine}, {'all touch' if touched else 'free'}, {cores}": measure(
            engine, touched, workers
        )
        for engine in ("chain", "chain-consistent")
        for touched in (False, True)
        for workers, cores in ((1, "one core"), (2, "two cores"))
    }
    for name, ratio in found.items():
        print(f"{name:40s} {ratio:5.2f} × real time")
    path = Path(__file__).parent / "results" / "pad.json"
    write_kept(path, json.dumps(found, indent=1) + "\n")


if __name__ == "__main__":
    main()
