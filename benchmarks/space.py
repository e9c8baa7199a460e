"""The chain in space against bare ``mj_step`` on the same compiled scene, in turns in one process:
ratios of processor time per step, of one scene and of eight in lanes.

Free: 280 hinges of the cockroach's length (140 segments bending in two planes) and a whisker of 20
segments. In contact: a ball pushes on. MuJoCo runs as feeler's reference sets it (tolerance 0, so
that its contact is converged) and with its default tolerance.
"""

import json
import time
from pathlib import Path

import mujoco
import numpy as np
from kept import write_kept

import feeler
from feeler.antenna.segments import Antenna
from feeler.objects.bodies import Object
from feeler.physics.engine import ENGINES
from feeler.physics.mujoco import _SpaceMujocoStepper
from feeler.physics.scene import Scene

ROUNDS, LANES, TIMESTEP = 5, 8, 0.02
WARM = 4.0  # ms before the clock starts, so that the ball presses


def make_antenna(n: int) -> Antenna:
    """The cockroach in two planes, or a whisker of fewer segments."""
    if n == 140:
        flat = feeler.presets.cockroach()
        rows = {name: np.stack([getattr(flat, name)] * 2) for name in ("stiffness", "damping")}
        return flat.replace(**rows, rest_angle=np.zeros((2, 140)))
    beam = {"radius": "0.075 - 0.07 * x", "modulus": 5000.0, "density": 1.4e-3}
    return Antenna.from_beam(length=40.0, n_segments=n, planes=2, damping_time=0.9, **beam)


def make(n: int, touched: bool) -> Scene:
    antenna = make_antenna(n)
    start = np.random.default_rng(0).normal(0, 0.003, (2, n))
    if not touched:
        return Scene(antenna=antenna, angle=start)
    place = (-antenna.radius.max() - 0.01, 0.6 * antenna.length, 0.1)
    ball = Object(feature=feeler.Ball(radius=1.5), place=place, velocity=(0.01, 0.0, 0.001))
    return Scene(antenna=antenna, objects=(ball,))


def time_chain(scene: Scene, lanes: int, steps: int) -> float:
    """Seconds of processor time per step and scene."""
    stepper = ENGINES["chain"].make([scene] * lanes, TIMESTEP)
    stepper.step(round(WARM / TIMESTEP))
    start = time.process_time()
    stepper.step(steps)
    taken = (time.process_time() - start) / steps / lanes
    assert len(stepper.read_contacts(0)) > 0 or not scene.objects
    return taken


def time_mujoco(scene: Scene, tolerance: float, steps: int) -> float:
    """Seconds of processor time per bare ``mj_step``."""
    stepper = _SpaceMujocoStepper([scene], TIMESTEP)
    stepper.step(round(WARM / TIMESTEP))
    model, data = stepper.model, stepper.data
    data.qfrc_applied[:] = 0.0
    model.opt.tolerance = tolerance
    start = time.process_time()
    mujoco.mj_step(model, data, nstep=steps)
    taken = (time.process_time() - start) / steps
    assert data.ncon or not scene.objects
    return taken


def measure(n: int, touched: bool, tolerance: float) -> dict[str, float]:
    scene, few = make(n, touched), 60 if n == 140 else 600
    rounds = []
    for _ in range(ROUNDS):
        theirs = time_mujoco(scene, tolerance, few)
        rounds.append([theirs / time_chain(scene, lanes, 10 * few) for lanes in (1, LANES)])
    one, many = np.median(rounds, axis=0)
    return {"one": round(float(one), 1), "lanes": round(float(many), 1)}


def main() -> None:
    cases = {
        "free": (False, 0.0),
        "contact, converged": (True, 0.0),
        "contact, MuJoCo's default tolerance": (True, 1e-8),
    }
    found = {
        f"{2 * n} hinges, {name}": measure(n, *case)
        for n in (140, 20)
        for name, case in cases.items()
    }
    for name, ratios in found.items():
        print(f"{name:52s} one {ratios['one']:7.1f}x   lanes {ratios['lanes']:7.1f}x")
    path = Path(__file__).parent / "results" / "space.json"
    write_kept(path, json.dumps(found, indent=1))


if __name__ == "__main__":
    main()
