"""Our MuJoCo path against bare ``mj_step`` on the same compiled model, alternating in one process.

Prints and stores processor time per step and their ratio, and the wall time of the paper's 90
trials on the default engine.
"""

import json
import time
from pathlib import Path

import mujoco
import numpy as np
from kept import write_kept

import feeler
from feeler.physics.run import run_scene
from feeler.physics.scene import Clock, make_scene
from feeler.physics.spec import _compile_model

DURATION, TIMESTEP, ROUNDS = 40.0, 0.02, 5


def time_bare(scene) -> float:
    """Seconds of processor time per bare step."""
    model = _compile_model(scene, TIMESTEP)
    data = mujoco.MjData(model)
    n = scene.antenna.n_segments
    data.qvel[n : n + 2] = scene.objects[0].velocity
    steps = round((DURATION - 1.0) / TIMESTEP)
    start = time.process_time()
    mujoco.mj_step(model, data, nstep=steps)
    return (time.process_time() - start) / steps


def time_ours(scene) -> float:
    """Processor time per step of the reference engine [s], without compiling the model."""
    start = time.process_time()
    _compile_model(scene, TIMESTEP)
    compiling = time.process_time() - start
    start = time.process_time()
    run_scene(scene, Clock(duration=DURATION, timestep=TIMESTEP), "mujoco")
    return (time.process_time() - start - compiling) / round((DURATION - 1.0) / TIMESTEP)


def main() -> None:
    antenna = feeler.presets.cockroach()
    scene = make_scene(
        antenna, feeler.Trial(feature=feeler.Ball(radius=1.53), location=0.5, speed=0.6)
    )
    pairs = np.array([(time_ours(scene), time_bare(scene)) for _ in range(ROUNDS)])
    ratio = np.median(pairs[:, 0] / pairs[:, 1])
    feeler.touch(antenna, feeler.presets.paper_trials()[:8], duration=2.0)  # compile
    start = time.perf_counter()
    feeler.touch(antenna, feeler.presets.paper_trials())
    wall = time.perf_counter() - start
    result = {
        "ours_us_per_step": 1e6 * float(np.median(pairs[:, 0])),
        "bare_us_per_step": 1e6 * float(np.median(pairs[:, 1])),
        "ratio": float(ratio),
        "ninety_trials_seconds": wall,
    }
    for name, value in result.items():
        print(f"{name:24} {value:10.3f}")
    path = Path(__file__).parent / "results" / "physics.json"
    path.parent.mkdir(exist_ok=True)
    write_kept(path, json.dumps(result, indent=1))


if __name__ == "__main__":
    main()
