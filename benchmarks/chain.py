"""The chain engine against MuJoCo: time per step and core, the paper's 90 touches. Growth with
segments is in claims.py.

Both engines run the same steps of the same scene in turns, in one process on one thread; times are
the median of the turns in processor time, ratios the median of the turns' ratios, so that a busy
machine disturbs little. MuJoCo is tuned: dense Jacobian, only the pairs object–segment collide,
many steps per call. "Converged" is the reference engine's setting (tolerance 0, 25 iterations),
"quick" MuJoCo's default tolerance, which leaves errors of 1e-3 rad.

    python benchmarks/chain.py
"""

import json
import os
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import mujoco as mj
import numpy as np
from kept import write_kept

from feeler.antenna.segments import Antenna
from feeler.objects import Trial, make_feature, make_grid
from feeler.physics import mujoco
from feeler.physics.chain.fields import LANES
from feeler.physics.chain.stepper import ChainStepper
from feeler.physics.run import simulate
from feeler.physics.scene import Clock, Scene, make_scene
from feeler.presets import make_preset

TIMESTEP = 0.02  # ms
ENGINES = {"parity": "chain", "consistent": "chain-consistent"}
TURNS, STEPS = 12, 100


def make_antenna(n: int) -> Antenna:
    """The cockroach cut into ``n`` segments of equal length; stiffness and damping per hinge grow
    with n.
    """
    whole = make_preset("cockroach")
    x = np.linspace(0, 1, n)
    old = np.linspace(0, 1, whole.n_segments)
    share = n / whole.n_segments
    return Antenna(
        segment_length=np.full(n, whole.length / n),
        segment_mass=np.full(n, whole.segment_mass.sum() / n),
        radius=0.225,
        stiffness=np.interp(x, old, whole.stiffness) * share,
        damping=np.interp(x, old, whole.damping) * share,
    )


class Chain:
    """Steps of one scene in each of ``lanes`` lanes."""

    def __init__(self, scene: Scene, lanes: int, scheme: str, warm_up: int) -> None:
        self.stepper, self.lanes = (
            ChainStepper([scene] * lanes, TIMESTEP, scheme == "consistent"),
            lanes,
        )
        self.step(warm_up)

    def step(self, n_steps: int) -> None:
        """Advance every lane."""
        self.stepper.step(n_steps)


class Mujoco:
    """The same scene in MuJoCo."""

    lanes = 1

    def __init__(self, scene: Scene, warm_up: int, tolerance: float, iterations: int) -> None:
        self.model = mujoco.compile_model(scene, TIMESTEP)
        self.model.opt.tolerance, self.model.opt.iterations = tolerance, iterations
        self.data = mj.MjData(self.model)
        n = scene.antenna.n_segments
        self.data.qpos[:n], self.data.qvel[:n] = scene.initial_angle, scene.initial_velocity
        self.data.qvel[n:] = np.ravel([[*item.velocity, item.turn] for item in scene.objects])
        self.step(warm_up)

    def step(self, n_steps: int) -> None:
        """Advance."""
        mj.mj_step(self.model, self.data, nstep=n_steps)


def measure(runners: dict[str, object], steps: int = STEPS) -> dict[str, np.ndarray]:
    """Time per simulation and step of each in every turn (turn,) [µs]."""
    times: dict[str, list[float]] = {name: [] for name in runners}
    for _ in range(TURNS):
        for name, runner in runners.items():
            start = time.process_time()
            runner.step(steps)
            times[name].append((time.process_time() - start) / steps / runner.lanes * 1e6)
    return {name: np.array(values) for name, values in times.items()}


def compare(name: str, scene: Scene, warm_up: int) -> dict[str, dict[str, float]]:
    """Print one scene's table."""
    runners: dict[str, object] = {
        "MuJoCo, converged": Mujoco(scene, warm_up, 0.0, 25),
        "MuJoCo, quick": Mujoco(scene, warm_up, 1e-8, 100),
    }
    for scheme in ENGINES:
        for lanes in (1, LANES):
            runners[f"chain, {scheme}, {lanes}"] = Chain(scene, lanes, scheme, warm_up)
    times, found = measure(runners), {}
    for label, value in times.items():
        ratios = [
            float(np.median(times[f"MuJoCo, {kind}"] / value))
            for kind in ("converged", "quick")
        ]
        found[label] = dict(
            zip(
                ("us", "vs_converged", "vs_quick"),
                [float(np.median(value)), *ratios],
                strict=True,
            )
        )
        print(
            f"{name:20s} {label:24s} {np.median(value):9.2f} µs per step  {ratios[0]:6.1f}x "
            f" {ratios[1]:6.1f}x"
        )
    return found


def run_paper(scheme: str) -> tuple[float, float]:
    """Wall and processor seconds for the paper's 90 touches of 380 ms on two threads, warm."""
    antenna = make_preset("cockroach")
    features = [
        make_feature(kind, size) for kind in ("ball", "box", "triangle") for size in (1.5, 3.0)
    ]
    trials = make_grid(features, [0.5, 0.6, 0.7, 0.8, 0.9], [0.6, 0.3, 0.06])
    scenes = [make_scene(antenna, trial) for trial in trials]
    start, used = time.perf_counter(), time.process_time()
    simulate(
        scenes, Clock(duration=380.0, timestep=TIMESTEP), workers=2, engine=ENGINES[scheme]
    )
    return time.perf_counter() - start, time.process_time() - used


def time_cold_start() -> dict[str, list[float]]:
    """Processor seconds of a first and a second process that simulate one step, with an empty
    compile cache.
    """
    code = (
        "import time; t = time.process_time(); from feeler.presets import make_preset; from"
        " feeler.physics.run import simulate; from feeler.physics.scene import Clock; from"
        " feeler.physics.scene import Scene; s = Scene(antenna=make_preset('cockroach')); t1 ="
        " time.process_time(); c = Clock(duration=2, timestep=0.02); simulate([s], c); t2 ="
        " time.process_time(); simulate([s, s], c); print(t1 - t, t2 - t1, time.process_time()"
        " - t2)"
    )
    found = {}
    with tempfile.TemporaryDirectory() as folder:
        environment = {**os.environ, "NUMBA_CACHE_DIR": folder}
        for name in ("cold", "warm"):
            done = subprocess.run(
                [sys.executable, "-c", code], env=environment, capture_output=True, check=True
            )
            found[name] = [float(x) for x in done.stdout.split()]
            print(
                f"{name} start: import {found[name][0]:.1f} s, first run {found[name][1]:.1f} s, "
                f"first batch {found[name][2]:.1f} s"
            )
    return found


def main() -> None:
    rng, antenna = np.random.default_rng(0), make_preset("cockroach")
    free = Scene(antenna=antenna, angle=rng.normal(0, 2e-3, antenna.n_segments))
    results: dict[str, object] = {"timestep": TIMESTEP, "lanes": LANES}
    print(
        "scene                engine, lanes                 time                vs converged, quick"
        " MuJoCo"
    )
    results["free"] = compare("free", free, 10)
    for kind in ("ball", "box", "triangle"):
        trial = Trial(feature=make_feature(kind, 1.5), location=0.7123, speed=0.3, lead=0.5432)
        results[kind] = compare(f"{kind} in contact", make_scene(antenna, trial), 400)
    results["paper"] = {scheme: run_paper(scheme) for scheme in ENGINES}
    for scheme, (wall, used) in results["paper"].items():
        print(
            f"90 touches of 380 ms at {TIMESTEP} ms, 2 threads, {scheme}: {wall:.1f} s, {used:.1f}"
            " s of processor"
        )
    results["start"] = time_cold_start()
    results["memory"] = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    print(f"peak memory of this process {results['memory']:.0f} MB")
    path = Path(__file__).parent / "results" / "chain.json"
    rounded = json.loads(json.dumps(results), parse_float=lambda x: float(f"{float(x):.4g}"))
    write_kept(path, json.dumps(rounded, indent=1) + "\n")


if __name__ == "__main__":
    main()
