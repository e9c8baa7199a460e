"""How small a timestep, and how hard a contact: joint angles of the paper's 90 touches against
converged ones.

For every contact setting each touch is run at falling timesteps; the error of a touch is the
largest difference of any joint angle at any sample from the run at the smallest timestep, as a
share of the touch's largest angle. A second table compares the contact settings with each other at
the smallest timestep. Touches whose error does not fall with the timestep are chaotic: a start 1 nm
later moves them as much; they are found by doing just that.

    python benchmarks/convergence.py [--workers 2]
"""

import argparse
import json
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
from kept import write_kept

from feeler.objects import Trial, make_feature, make_grid
from feeler.physics.contact import Contact, get_contact
from feeler.physics.run import simulate
from feeler.physics.scene import Clock, Motion, Scene, make_scene
from feeler.presets import make_preset

DURATION = 380.0  # ms [P]
NUDGE = 1e-6  # mm
TIMESTEPS = (0.1, 0.05, 0.04, 0.025, 0.02, 0.0125, 0.01, 0.005, 0.0025)
FINEST = {
    "chain": 0.00125,
    "chain-consistent": 0.0025,
}  # ms; MuJoCo's scheme needs more to be converged
NAMES = {"chain": "parity", "chain-consistent": "consistent"}  # of the files in results/
CONTACTS = {
    "smooth": get_contact("smooth"),
    "solref 0.1": Contact(solref=(0.1, 1.0)),
    "solref 0.2": Contact(solref=(0.2, 1.0)),
    "solref 0.5": Contact(solref=(0.5, 1.0)),
    "solref 1.0": Contact(solref=(1.0, 1.0)),
    "solref 0.2, width 0.02": Contact(solref=(0.2, 1.0), solimp=(0.9, 0.95, 0.02, 0.5, 2.0)),
    "solref 0.2, even 0.9": Contact(solref=(0.2, 1.0), solimp=(0.9, 0.9, 0.001, 0.5, 2.0)),
}


def make_trials() -> list[Trial]:
    """Three features of two sizes, five locations, three speeds: the paper's 90 touches."""
    features = [
        make_feature(kind, size) for kind in ("ball", "box", "triangle") for size in (1.5, 3.0)
    ]
    return make_grid(features, [0.5, 0.6, 0.7, 0.8, 0.9], [0.6, 0.3, 0.06])


def nudge(scene: Scene) -> Scene:
    """The same scene, its object NUDGE further back."""
    item = scene.objects[0]
    back = np.asarray(item.place) - NUDGE * np.asarray(item.forward)
    return replace(scene, objects=(item.replace(place=tuple(back)),))


def angles(motions: list[Motion]) -> np.ndarray:
    """(trial, sample, segment), NaN where a trial diverged."""
    shape = next(m.angle.shape for m in motions if isinstance(m, Motion))
    return np.stack(
        [m.angle if isinstance(m, Motion) else np.full(shape, np.nan) for m in motions]
    )


def compute_error(angle: np.ndarray, reference: np.ndarray) -> np.ndarray:
    """Largest difference of each trial as a share of its largest angle (trial,)."""
    return np.abs(angle - reference).max(axis=(1, 2)) / np.abs(reference).max(axis=(1, 2))


def study(name: str, contact: Contact, how: dict, reference: dict) -> dict:
    """Errors (trial,) per timestep, of a nudge, and how deep the core sank."""
    antenna = make_preset("cockroach")
    scenes = [make_scene(antenna, trial, contact) for trial in make_trials()]
    result: dict = {"timestep": {}}
    finest = FINEST[how["engine"]]
    for h in sorted(t for t in {*TIMESTEPS, finest} if t <= contact.solref[0] / 2 * (1 + 1e-9)):
        start = time.perf_counter()
        found = angles(simulate(scenes, Clock(duration=DURATION, timestep=h), **how))
        if h == finest:
            reference[name] = found
            nudged = simulate(
                [nudge(s) for s in scenes], Clock(duration=DURATION, timestep=h), **how
            )
            result["nudge"] = compute_error(angles(nudged), found).tolist()
            continue
        error = compute_error(found, reference[name])
        result["timestep"][str(h)] = error.tolist()
        print(
            f"{name:24s} h {h:<8g} median {np.nanmedian(error):8.2%}  worst {np.nanmax(error):8.2%}"
            f"  above 1 %: {np.sum(~(error <= 0.01)):2d} of {len(error)}  "
            f" {time.perf_counter() - start:6.1f} s",
            flush=True,
        )
    return result


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--engine", default="chain", choices=FINEST)
    parser.add_argument("--contacts", nargs="*", default=list(CONTACTS))
    arguments = parser.parse_args()
    how = {"workers": arguments.workers, "engine": arguments.engine}
    reference: dict[str, np.ndarray] = {}
    results = {}
    for name in arguments.contacts:
        results[name] = study(name, CONTACTS[name], how, reference)
        nudged = np.array(results[name]["nudge"])
        labels = [t.label for t in make_trials()]
        print(
            f"{name}: 1 nm moves the worst touch by {nudged.max():.2%}"
            f" ({labels[int(nudged.argmax())]})",
            flush=True,
        )
        write(arguments.engine, results)
    base = reference.get("solref 0.2")
    if base is not None:
        for name, found in reference.items():
            error = compute_error(found, base)
            results[name]["from_default"] = error.tolist()
            print(
                f"{name:24s} against solref 0.2: median {np.median(error):.2%}, worst"
                f" {error.max():.2%}"
            )
    write(arguments.engine, results)


def write(engine: str, results: dict) -> None:
    """Errors per touch, as far as they are known, into results/."""
    labels = [trial.label for trial in make_trials()]
    path = Path(__file__).parent / "results" / f"convergence_{NAMES[engine]}.json"
    rounded = json.loads(json.dumps(results), parse_float=lambda x: float(f"{float(x):.3g}"))
    write_kept(path, json.dumps({"trials": labels, "contacts": rounded}) + "\n")


if __name__ == "__main__":
    main()
