"""Smooth contact against hard: derivatives, the last bit, the timestep, and what moves. Prints the
tables of docs/contact.md.

python benchmarks/contact.py [derivative | bit | timestep | shift | video ...]
"""

import itertools
import sys
from dataclasses import replace

import numpy as np

from feeler.objects import Trial, make_feature
from feeler.objects.trials import trials
from feeler.physics.contact import CONTACTS
from feeler.physics.run import simulate
from feeler.physics.scene import Clock, Scene, make_scene
from feeler.presets import cockroach

DURATION, FINE = 380.0, 0.0025  # ms
STEPS = (1e-2, 1e-3, 1e-4, 1e-5, 1e-6)


def run(scenes: list[Scene], timestep: float, duration: float = DURATION) -> list[np.ndarray]:
    """Hinge angles (sample, segment) [rad] of each scene."""
    return [
        motion.angle for motion in simulate(scenes, Clock(duration=duration, timestep=timestep))
    ]


def differ(found: np.ndarray, reference: np.ndarray) -> float:
    """Greatest difference over the peak."""
    return float(np.abs(found - reference).max() / np.abs(reference).max())


def derivative() -> None:
    """Change of dθ/d log k, all stiffnesses together, from each eps to the next, as a share of its
    norm.
    """
    antenna = cockroach()
    print(
        "contact  timestep  feature   "
        + "  ".join(f"{a:g}→{b:g}" for a, b in itertools.pairwise(STEPS))
    )
    for name in CONTACTS:
        for timestep in (0.05, 0.02):
            for kind in ("ball", "box", "triangle"):
                trial = Trial(feature=make_feature(kind, 1.5), location=0.7, speed=0.3)
                scene = make_scene(antenna, trial, name)
                sides = [
                    replace(
                        scene,
                        antenna=antenna.replace(stiffness=antenna.stiffness * (1 + s * eps)),
                    )
                    for eps in STEPS
                    for s in (1, -1)
                ]
                angle = run(sides, timestep, 100.0)
                slope = [
                    (angle[2 * i] - angle[2 * i + 1]) / (2 * eps) for i, eps in enumerate(STEPS)
                ]
                change = [
                    np.linalg.norm(b - a) / np.linalg.norm(b)
                    for a, b in itertools.pairwise(slope)
                ]
                print(
                    f"{name:8} {timestep:<9g} {kind:9} "
                    + "  ".join(f"{c:.1e}" for c in change),
                    flush=True,
                )


def bit() -> None:
    """Greatest change of any angle [rad] over the ninety touches when the object's velocity changes
    in its last bit.
    """
    for name in CONTACTS:
        for timestep in (0.05, 0.02):
            scenes = [make_scene(cockroach(), trial, name) for trial in trials()]
            nudged = [replace(s, objects=(_nudge(s.objects[0]),)) for s in scenes]
            first, second = run(scenes, timestep), run(nudged, timestep)
            found = [np.abs(a - b).max() for a, b in zip(first, second, strict=True)]
            moved = sum(f > 1e-9 for f in found)
            print(
                f"{name:8} {timestep:g} ms: {max(found):.1e} rad, {moved} of {len(found)} above"
                " 1e-9",
                flush=True,
            )


def _nudge(item):
    return item.replace(
        velocity=tuple(float(np.nextafter(v, np.inf)) if v else v for v in item.velocity)
    )


def timestep() -> None:
    """Error of angles over the peak against the same contact at 0.0025 ms."""
    for name in CONTACTS:
        scenes = [make_scene(cockroach(), trial, name) for trial in trials()]
        reference = run(scenes, FINE)
        for h in (0.02, 0.05, 0.1):
            error = [differ(a, b) for a, b in zip(run(scenes, h), reference, strict=True)]
            print(
                f"{name:8} {h:g} ms: median {np.median(error):.2%}, greatest {max(error):.2%}",
                flush=True,
            )


def shift() -> None:
    """What moves from hard to smooth contact: angles over the peak, and the instant at which the
    touch ends [ms].
    """
    touches = trials()
    both = [
        simulate(
            [make_scene(cockroach(), trial, name) for trial in touches],
            Clock(duration=DURATION, sample_interval=0.5, timestep=0.005),
        )
        for name in ("hard", "smooth")
    ]
    for speed in sorted({trial.speed for trial in touches}):
        chosen = [i for i, trial in enumerate(touches) if trial.speed == speed]
        moved = [differ(both[1][i].angle, both[0][i].angle) for i in chosen]
        ends = [[_find_end(motions[i]) for i in chosen] for motions in both]
        later = np.array(ends[1]) - np.array(ends[0])
        print(
            f"{speed:g} m/s: angles move by {np.median(moved):.2%} (greatest {max(moved):.2%}) of"
            f" the peak; last contact later by {np.median(later):.2f} ms ({later.min():.2f} to"
            f" {later.max():.2f})",
            flush=True,
        )


def video() -> None:
    """The touch of the first author's video (ball of 1.53 mm at half of the length, 0.6 m/s): how
    far the antenna's shape moves from the even contact to the others [mm, r.m.s. over all segments
    and the first 60 ms], and what of the tensor stays (Pearson's r).
    """
    antenna = cockroach()
    trial = Trial(feature=make_feature("ball", 1.53), location=0.5, speed=0.6)
    clock = Clock(duration=60.0, sample_interval=1.0, timestep=0.005)
    found = {
        name: simulate([make_scene(antenna, trial, name)], clock)[0].angle for name in CONTACTS
    }
    heading = {name: np.cumsum(angle, axis=1) for name, angle in found.items()}
    ends = {
        name: np.cumsum(antenna.segment_length * np.exp(1j * turn), axis=1)
        for name, turn in heading.items()
    }
    for name in CONTACTS:
        off = np.sqrt((np.abs(ends[name] - ends["even"]) ** 2).mean())
        kept = np.corrcoef(found[name].ravel(), found["even"].ravel())[0, 1]
        print(f"{name:8} {off:.4f} mm, r {kept:.6f}", flush=True)


def _find_end(motion) -> float:
    touching = np.flatnonzero(np.abs(motion.force).sum(axis=1) > 0)
    return float(motion.time[touching[-1]]) if touching.size else 0.0


if __name__ == "__main__":
    for what in sys.argv[1:] or ("derivative", "bit", "timestep", "shift", "video"):
        print(f"\n{what}: {globals()[what].__doc__}")
        globals()[what]()
