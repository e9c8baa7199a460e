"""Time to accuracy: processor time against the error of the tip, the chain engine beside MuJoCo's
integrators.

    python benchmarks/workprecision.py            # measures, writes results/workprecision.json
    python benchmarks/workprecision.py --draw     # draws docs/images/workprecision.png from it

Three touches of 100 ms of the cockroach's antenna at 0.3 m/s and 0.7 L [C], with the smooth
contact, each with timesteps from 0.1 ms down. MuJoCo steps bare (``mj_step`` at its default
iterations and the loosest tolerance that leaves no trace; nothing is read out); feeler's times are
of ``run_scene``, 100 samples included. The error is the tip's greatest distance from the chain
engine's path at 0.0005 ms, over the tip's greatest excursion; a run that diverges counts 100 %. One
thread, the fastest of three runs in processor time.
"""

import argparse
import json
import time
from dataclasses import replace
from pathlib import Path

import mujoco as mj
import numpy as np
from kept import write_kept

from feeler.objects import Trial, make_feature
from feeler.physics.run import run_scene
from feeler.physics.scene import Clock, Scene, make_scene
from feeler.physics.spec import compile_model
from feeler.presets import cockroach

DURATION, REFERENCE, RUNS = 100.0, 0.0005, 3
# of MuJoCo's solver: the loosest at which its answers no longer depend on it, in g, mm, ms
TOLERANCE = 1e-17
TIMESTEPS = (0.1, 0.05, 0.02, 0.01, 0.005)
INTEGRATORS = {
    "MuJoCo Euler": mj.mjtIntegrator.mjINT_EULER,
    "MuJoCo implicitfast": mj.mjtIntegrator.mjINT_IMPLICITFAST,
    "MuJoCo RK4": mj.mjtIntegrator.mjINT_RK4,
}
RESULT = Path(__file__).parent / "results" / "workprecision.json"
PEERS = RESULT.with_name(
    "workprecision_peers.json"
)  # one swing of a rod, by peers/workprecision.py
PICTURE = Path(__file__).parents[1] / "docs" / "images" / "workprecision.png"


def run_feeler(scene: Scene, timestep: float, engine: str) -> np.ndarray:
    """The tip's path (sample, 2) [mm]."""
    motion = run_scene(scene, Clock(duration=DURATION, timestep=timestep), engine)
    return scene.antenna.shape(motion.angle)[:, -1]


def run_mujoco(scene: Scene, timestep: float, integrator: mj.mjtIntegrator) -> np.ndarray:
    """The same from bare MuJoCo."""
    model = compile_model(scene, timestep)
    default = mj.MjOption()
    default.tolerance = TOLERANCE
    model.opt.integrator, model.opt.tolerance, model.opt.iterations = (
        integrator,
        default.tolerance,
        default.iterations,
    )
    alone = compile_model(replace(scene, objects=()), timestep)
    model.stat.meaninertia = (
        alone.stat.meaninertia
    )  # the solver's tolerance is a share of it: the object must not count
    data, n = mj.MjData(model), scene.antenna.n_segments
    data.qvel[n:] = np.ravel([[*item.velocity, item.turn] for item in scene.objects])
    angle = [data.qpos[:n].copy()]
    for _ in range(round(DURATION) - 1):
        mj.mj_step(model, data, nstep=round(1 / timestep))
        angle.append(data.qpos[:n].copy())
        if not np.isfinite(data.qpos).all():
            return np.full((round(DURATION), 2), np.nan)
    return scene.antenna.shape(np.array(angle))[:, -1]


def measure(run, *args) -> tuple[np.ndarray, float]:
    """The path, and the fastest run's processor time [s]."""
    best = np.inf
    for _ in range(RUNS):
        start = time.process_time()
        path = run(*args)
        best = min(best, time.process_time() - start)
        if best > 5:
            break
    return path, best


def compare(kind: str) -> list[dict]:
    """One row per solver and timestep."""
    scene = make_scene(
        cockroach(), Trial(feature=make_feature(kind, 1.5), location=0.7, speed=0.3)
    )
    truth = run_feeler(scene, REFERENCE, "chain-consistent")
    size = np.linalg.norm(truth - truth[0], axis=1).max()
    solvers = {f"feeler {name}": (run_feeler, name) for name in ("chain-consistent", "chain")}
    solvers |= {name: (run_mujoco, integrator) for name, integrator in INTEGRATORS.items()}
    rows = []
    for name, (run, argument) in solvers.items():
        for timestep in TIMESTEPS:
            path, seconds = measure(run, scene, timestep, argument)
            error = float(np.linalg.norm(path - truth, axis=1).max() / size)
            error = error if np.isfinite(error) else 1.0
            rows.append(
                {
                    "touch": kind,
                    "solver": name,
                    "timestep": timestep,
                    "seconds": seconds,
                    "error": error,
                }
            )
            print(
                f"{kind:9} {name:24} {timestep:<6g} ms  {seconds:8.3f} s  {error:.2%}",
                flush=True,
            )
    return rows


def draw() -> None:
    """The picture of the docs."""
    import matplotlib.pyplot as plt

    rows = [
        row for path in (RESULT, PEERS) if path.exists() for row in json.loads(path.read_text())
    ]
    kinds, solvers = (
        list(dict.fromkeys(row[key] for row in rows)) for key in ("touch", "solver")
    )
    figure, axes = plt.subplots(
        1, len(kinds), figsize=(13, 4), sharex=True, sharey=True, layout="constrained"
    )
    for ax, kind in zip(axes, kinds, strict=True):
        for number, solver in enumerate(solvers):
            mine = [row for row in rows if row["touch"] == kind and row["solver"] == solver]
            style = {"marker": "o"} if "feeler" in solver else {"marker": "s", "ls": "--"}
            x, y = [row["seconds"] for row in mine], [100 * row["error"] for row in mine]
            ax.loglog(x, y, label=solver, color=f"C{number}", ms=4, **style)
        ax.axhline(1, color="0.6", lw=0.8)  # what accuracy=0.01 asks for
        swing = kind == "swing"
        ax.set(
            title="one swing of a rod, 57 ms" if swing else f"{kind}, 100 ms",
            xlabel="processor time [s]",
        )
    axes[0].set_ylabel("greatest error of the tip\n[% of its excursion]")
    figure.legend(
        *axes[0].get_legend_handles_labels(),
        loc="outside lower center",
        ncols=len(solvers),
        fontsize=8,
    )
    PICTURE.parent.mkdir(exist_ok=True)
    figure.savefig(PICTURE, dpi=110)


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--draw", action="store_true", help="only draw what was measured")
    if not parser.parse_args().draw:
        rows = [row for kind in ("ball", "box", "triangle") for row in compare(kind)]
        rounded = json.loads(json.dumps(rows), parse_float=lambda x: float(f"{float(x):.3g}"))
        write_kept(RESULT, json.dumps(rounded, indent=1) + "\n")
    draw()


if __name__ == "__main__":
    main()
