"""Does ``accuracy=`` keep its word? Random touches, each against the same touch at a timestep 1/64
of the coarsest.

python benchmarks/accuracy.py [--touches 2000] [--accuracy 0.01] [--seed 0] [--seconds 400] [--out
out/accuracy]

Drawn before anything was run [C]: three stiffness profiles times 0.3 to 3 (compliance) and damping
likewise; ball, box, triangle of half size 0.3 to 4 mm, every second one rounded, plain walls,
saw-tooth walls of slopes up to 4; place 0.2 to 1; speed 0.02 to 5 m/s; approach 45 to 135 degrees;
friction 0 (every tenth) or up to 1.5. Each lasts until 40 mm are travelled or longer: 20, 50, 100
or (at most) 200 ms. Touches that were stepped as finely as the reference are held against a finer
one. References and lines are kept in --out, so that a run can be cut short and gone on with.
"""

import argparse
import json
import time
from collections import defaultdict
from dataclasses import replace
from pathlib import Path

import numpy as np
from kept import write_kept

from feeler.objects import Ball, Box, Trial, Triangle, Wall
from feeler.physics.engine import DEFAULT_ENGINE
from feeler.physics.run import compute_error, find_coarsest, run_accurately, run_group
from feeler.physics.scene import Clock, Motion, Scene, make_scene
from feeler.presets import cockroach

FINER = 64
LANES = 8
DURATIONS = (20.0, 50.0, 100.0, 200.0)
OFF = 0.05  # of the peak: what no touch may be off by without a warning


def draw(index: int, seed: int) -> tuple[Scene, float]:
    """The scene number ``index`` and how long it lasts [ms]."""
    rng = np.random.default_rng([seed, index])
    antenna = cockroach(str(rng.choice(["exponential", "linear", "uniform"])))
    scale = np.exp(rng.uniform(np.log(0.3), np.log(3), 2))
    antenna = antenna.replace(
        stiffness=antenna.stiffness * scale[0], damping=antenna.damping * scale[1]
    )
    kind, size = (
        str(rng.choice(["ball", "box", "triangle", "wall", "texture"])),
        np.exp(rng.uniform(np.log(0.3), np.log(4))),
    )
    rounding = float(rng.uniform(0.05, 0.5) * size * rng.integers(2))
    shapes = {
        "ball": lambda: Ball(radius=size),
        "box": lambda: Box(
            half_width=size, half_height=size * rng.uniform(0.5, 2), rounding=rounding
        ),
        "triangle": lambda: Triangle(half_width=size, rounding=rounding),
        "wall": Wall,
        "texture": lambda: Wall(
            profile=((-size, 0.0), (0.0, size * rng.uniform(0.1, 4)), (size, 0.0)),
            repeat=max(1, int(30 / size)),
        ),
    }
    speed = float(np.exp(rng.uniform(np.log(0.02), np.log(5))))
    trial = Trial(
        feature=shapes[kind](),
        location=float(rng.uniform(0.2, 1)),
        speed=speed,
        approach=float(rng.uniform(45, 135)),
        friction=0.0 if rng.integers(10) == 0 else float(rng.uniform(0, 1.5)),
        lead=min(5.0, 2 / speed),
    )
    return make_scene(antenna, trial), next(
        (d for d in DURATIONS if d >= 40 / speed), DURATIONS[-1]
    )


def judge(scenes: list[Scene], duration: float, accuracy: float, kept: Path) -> list[dict]:
    """What each touch said of itself, and how far off it was."""
    fine = min(find_coarsest(scene.contact, 1.0) for scene in scenes) / FINER
    truth = load_reference(scenes, duration, fine, kept)
    start = time.process_time()
    found = run_accurately(scenes, duration, 1.0, DEFAULT_ENGINE, accuracy)
    seconds = (time.process_time() - start) / len(scenes)
    for i, motion in enumerate(found):
        if isinstance(motion, Motion) and motion.timestep < 4 * fine:
            finer = Clock(duration=duration, timestep=motion.timestep / 4)
            truth[i] = _list_angles([*run_group([scenes[i]], finer), motion])[0]
    return [
        {
            "label": scene.label,
            "speed": float(np.hypot(*scene.objects[0].velocity)),
            "diverged": not isinstance(motion, Motion),
            "timestep": getattr(motion, "timestep", None),
            "said": getattr(motion, "error", None),
            "off": (
                compute_error(scene, motion, replace(motion, angle=angle))
                if isinstance(motion, Motion) and np.isfinite(angle).all()
                else None
            ),
            "seconds": seconds,
        }
        for scene, motion, angle in zip(scenes, found, truth, strict=True)
    ]


def load_reference(
    scenes: list[Scene], duration: float, timestep: float, kept: Path
) -> list[np.ndarray]:
    """The angles (sample, segment) of each scene stepped that finely, made once: they depend on no
    choice of steps.

    NaN where even so fine a simulation diverges.
    """
    if not kept.exists():
        found = run_group(scenes, Clock(duration=duration, timestep=timestep))
        kept.parent.mkdir(parents=True, exist_ok=True)
        part = kept.with_suffix(".part")
        with part.open("wb") as file:
            np.save(file, np.array(_list_angles(found), dtype=np.float32))
        part.replace(kept)
    return list(np.load(kept).astype(float))


def _list_angles(found: list[Motion | Exception]) -> list[np.ndarray]:
    """NaN where a simulation diverged."""
    shape = next((motion.angle.shape for motion in found if isinstance(motion, Motion)), (1, 1))
    return [
        motion.angle if isinstance(motion, Motion) else np.full(shape, np.nan)
        for motion in found
    ]


def list_tasks(touches: int, seed: int) -> list[tuple[float, list[int]]]:
    """Numbers of the touches that share lanes: those that last equally long."""
    by_duration = defaultdict(list)
    for index in range(touches):
        by_duration[draw(index, seed)[1]].append(index)
    return [
        (d, rest[k : k + LANES])
        for d, rest in by_duration.items()
        for k in range(0, len(rest), LANES)
    ]


def summarise(rows: list[dict], accuracy: float) -> dict:
    """What results/accuracy.json holds."""
    kept = [row for row in rows if row["off"] is not None]
    unknown = [row for row in rows if row["off"] is None and not row["diverged"]]
    off, said = np.array([row["off"] for row in kept]), np.array([row["said"] for row in kept])
    return {
        "touches": len(rows),
        "diverged": len(rows) - len(kept) - len(unknown),
        "reference_diverged": len(unknown),
        "reference_diverged_unwarned": sum(row["said"] <= accuracy for row in unknown),
        "warned": int((said > accuracy).sum()),
        "off_median": float(np.median(off)),
        "off_p99": float(np.quantile(off, 0.99)),
        "off_greatest": float(off.max()),
        "beyond_accuracy_unwarned": int(((off > accuracy) & (said <= accuracy)).sum()),
        "beyond_5_percent_unwarned": int(((off > OFF) & (said <= accuracy)).sum()),
        "seconds_per_touch": float(np.mean([row["seconds"] for row in rows])),
        "timesteps": {
            f"{h:g}": int(sum(row["timestep"] == h for row in kept))
            for h in sorted({row["timestep"] for row in kept})
        },
        "worst": sorted(
            (row for row in kept if row["said"] <= accuracy), key=lambda row: -row["off"]
        )[:10],
    }


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--touches", type=int, default=2000)
    parser.add_argument("--accuracy", type=float, default=0.01)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument(
        "--seconds",
        type=float,
        default=np.inf,
        help="begin nothing after this; run again to go on",
    )
    parser.add_argument(
        "--out",
        type=Path,
        default=Path("out/accuracy"),
        help="references, and a line for each touch",
    )
    args = parser.parse_args()
    start, lines = time.perf_counter(), args.out / "rows.jsonl"
    rows = {
        row["index"]: row
        for row in map(json.loads, lines.read_text().splitlines() if lines.exists() else ())
    }
    for duration, own in list_tasks(args.touches, args.seed):
        if time.perf_counter() - start > args.seconds:
            break
        if not all(index in rows for index in own):
            scenes = [draw(index, args.seed)[0] for index in own]
            found = judge(
                scenes,
                duration,
                args.accuracy,
                args.out / f"{args.seed}_{own[0]}_{own[-1]}.npy",
            )
            rows |= {
                index: {"index": index, **row} for index, row in zip(own, found, strict=True)
            }
            with lines.open("a") as file:
                file.writelines(json.dumps(rows[index]) + "\n" for index in own)
            print(f"{len(rows)} touches, {time.perf_counter() - start:.0f} s", flush=True)
    result = summarise(list(rows.values()), args.accuracy)
    print(json.dumps(result, indent=2))
    if len(rows) == args.touches:
        kept = Path(__file__).with_name("results") / "accuracy.json"
        write_kept(kept, json.dumps(result, indent=1) + "\n")


if __name__ == "__main__":
    main()
