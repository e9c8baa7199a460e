"""Wall room: cost of a sweep and of following, agreement with simulation, what R² depends on,
following by profile.

Run: python benchmarks/wall.py
"""

import json
import time
from pathlib import Path

import numpy as np
from kept import write_kept

from feeler.errors import FeelerError
from feeler.physics.run import run_scene
from feeler.physics.scene import Clock
from feeler.presets import PROFILE_NAMES, cockroach
from feeler.wall import (
    FOLLOWING,
    Posture,
    approach,
    calibrate,
    compare,
    count_orderings,
    follow,
    make_postures,
    make_turn,
    map_distance,
    summarise,
)
from feeler.wall.approach import make_wall_scene
from feeler.wall.distance import BENDS, FRICTIONS, READINGS

RESULTS = Path(__file__).parent / "results" / "wall.json"
TURNS = (30.0, 45.0, -30.0, -45.0)
SPEEDS = (0.3, 0.45, 0.6)


def time_sweeps() -> list[dict]:
    """CPU seconds of a sweep over 20 distances, warm."""
    rows = []
    postures = {
        "default": Posture(),
        "frictionless": Posture(friction=0.0),
        "whole-length hook": Posture(hook_share=1.0),
        "rotation": Posture(prebend="rotation"),
        "straight": FOLLOWING,
    }
    for label, posture in postures.items():
        for name in PROFILE_NAMES:
            antenna = cockroach(name)
            start = time.process_time()
            found = map_distance(approach(antenna, posture))
            rows.append(
                {
                    "posture": label,
                    "antenna": name,
                    "cpu_s": time.process_time() - start,
                    "r2": found.r2,
                }
            )
    return rows


def tabulate_sensitivity() -> list[dict]:
    """All combinations of the choices: R² over set-ups per profile, and how often the paper's order
    holds.
    """
    antennas = {name: cockroach(name) for name in PROFILE_NAMES}
    cases = compare(antennas, make_postures(READINGS, FRICTIONS, BENDS), workers=1)
    rows = [
        {"antenna": name, **row}
        for name, row in summarise(cases, np.random.default_rng(0)).items()
    ]
    rows += [
        {"choice": key[0], "value": key[1], **counts}
        for key, counts in count_orderings(cases).items()
    ]
    for case in cases:
        if case.measure == {"quantity": "bend", "method": "smooth"}:
            rows.append(
                {"antenna": case.antenna, "choice": list(case.choice), "r2": case.map.r2}
            )
    return rows


def compare_with_simulation() -> list[dict]:
    """An antenna bent a tenth too much is let go: heading difference from the static answer at
    start and end [degrees].

    MuJoCo gets a little friction: at its smallest its solver diverges against this wall.
    """
    rows = []
    runs = (
        ("chain", 120.0, 0.02, 0.0),
        ("mujoco", 60.0, 0.02, 0.05),
    )
    for engine, duration, timestep, friction in runs:
        for label, posture in {"hook": Posture(friction=0.0), "straight": FOLLOWING}.items():
            sweep = approach(cockroach(), posture, [12.0])
            start = sweep.antenna.rest_angle + 1.1 * sweep.bend[0]
            scene = make_wall_scene(
                sweep.antenna, posture.replace(friction=friction), 12.0, angle=start
            )
            motion = run_scene(scene, Clock(duration=duration, timestep=timestep), engine)
            gap = np.degrees(
                np.abs(np.cumsum(motion.angle - sweep.angle[0], axis=1)).max(axis=1)
            )
            rows.append(
                {
                    "engine": engine,
                    "posture": label,
                    "start_deg": float(gap[0]),
                    "end_deg": float(gap[-1]),
                }
            )
    return rows


def refine() -> list[dict]:
    """R² of the exponential antenna against the length of the wall's steps: what friction leaves
    undetermined.
    """
    rows = []
    for friction in (0.0, 0.3):
        for substep in (1.0, 0.5, 0.25, 0.1):
            r2 = map_distance(
                approach(cockroach(), Posture(friction=friction), substep=substep)
            ).r2
            rows.append({"friction": friction, "substep_mm": substep, "r2": r2})
    return rows


def run_courses() -> list[dict]:
    """Tracking error by profile, speed and turn."""
    follow(cockroach(), make_turn(30.0), oracle=True)  # compile
    rows = []
    for name, friction in (
        *((name, 0.0) for name in PROFILE_NAMES),
        ("exponential", 0.3),
        (None, 0.0),
    ):
        posture = FOLLOWING.replace(friction=friction)
        for speed in SPEEDS:
            found = calibrate(cockroach(name), posture, speed=speed) if name else None
            for turn in TURNS:
                row = {
                    "antenna": name or "(truth)",
                    "friction": friction,
                    "speed": speed,
                    "turn": turn,
                }
                rows.append(row | _run(name, posture, speed, turn, found))
    return rows


def _run(name, posture, speed, turn, found) -> dict:
    antenna, taken = cockroach(name or "exponential"), np.inf
    for _ in range(3):
        start = time.process_time()
        try:
            run = follow(
                antenna,
                make_turn(turn),
                posture=posture,
                speed=speed,
                distance_map=found,
                oracle=name is None,
            )
        except FeelerError as error:
            return {"failed": str(error)}
        taken = min(taken, time.process_time() - start)
    return {
        "error_mm": run.error,
        "estimate_error_mm": run.estimate_error if name else None,
        "nearest_mm": run.nearest,
        "collided": run.collided,
        "map_r2": found.r2 if name else None,
        "times_real_time": run.time[-1] / 1e3 / taken,
    }


def main() -> None:
    """Print the tables and keep them."""
    approach(cockroach(), Posture(), [20.0])  # compile
    tables = {
        "sweeps": time_sweeps(),
        "static_against_simulated": compare_with_simulation(),
        "substep": refine(),
        "sensitivity": tabulate_sensitivity(),
        "following": run_courses(),
    }
    for title, rows in tables.items():
        print(f"\n{title}")
        for row in rows:
            print(
                "  "
                + "  ".join(
                    f"{k} {v:.3f}" if isinstance(v, float) else f"{k} {v}"
                    for k, v in row.items()
                )
            )
    RESULTS.parent.mkdir(exist_ok=True)
    rounded = json.loads(json.dumps(tables), parse_float=lambda x: float(f"{float(x):.4g}"))
    text = json.dumps(rounded, indent=1).replace("NaN", "null")
    write_kept(RESULTS, text + "\n")


if __name__ == "__main__":
    main()
