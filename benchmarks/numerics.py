"""Where the simulation can be trusted: extremes of each parameter, and random antennas with random
touches.

Each extreme is run twice, the second time with half the timestep; "holds" means that both answers
are finite and that the paths of the tip agree within 2 % of the largest excursion. Everything else
must be a refusal with a name.

    python benchmarks/numerics.py                 # table of extremes
    python benchmarks/numerics.py --random 10000  # and random antennas
"""

import argparse
import json
import time
from collections import Counter
from pathlib import Path

import numpy as np
from kept import write_kept

from feeler.antenna import Antenna
from feeler.antenna.animals import cockroach
from feeler.antenna.segments import compute_mass_matrix
from feeler.errors import FeelerError, InvalidInput, SimulationDivergedError
from feeler.objects.shapes import make_feature
from feeler.objects.trials import Trial
from feeler.physics.engine import DEFAULT_ENGINE
from feeler.physics.run import simulate
from feeler.physics.scene import Clock, Scene, make_scene

TIMESTEP = 0.02  # ms, the default
TOLERANCE = 0.02  # of the largest deflection
FACTORS = [10.0**n for n in range(-6, 7)]
SEGMENTS = [1, 2, 3, 5, 10, 20, 50, 140, 300, 500, 1000]
SPEEDS = [1e-3, 1e-2, 0.06, 0.3, 0.6, 1.0, 2.0, 5.0, 10.0]
SIZES = [0.05, 0.1, 0.3, 1.5, 3.0, 10.0, 20.0, 50.0]
CONTACT = "diverged (named): in contact"
KINDS = ("ball", "box", "triangle", "wall")


def make_antenna(
    n_segments: int = 140, stiffness: float = 1.0, damping: float = 1.0
) -> Antenna:
    """The cockroach antenna, cut into another number of segments of the same total compliance, mass
    and length.
    """
    base = cockroach()
    if n_segments != base.n_segments:
        share = np.linspace(0, base.n_segments, n_segments + 1)
        numbers = np.arange(base.n_segments + 1)

        def pool(values: np.ndarray) -> np.ndarray:
            return np.diff(
                np.interp(share, numbers, np.concatenate(([0.0], np.cumsum(values))))
            )

        base = Antenna(
            segment_length=pool(base.segment_length),
            segment_mass=pool(base.segment_mass),
            radius=base.radius[0],
            stiffness=1 / pool(1 / base.stiffness),
            damping=1 / pool(1 / base.damping),
        )
    return base.replace(stiffness=stiffness * base.stiffness, damping=damping * base.damping)


def make_extremes() -> dict[str, tuple[Antenna, Trial]]:
    """Cases by name: one parameter at a time; stiffness with and without damping."""
    ball, middle = make_feature("ball", 1.5), {"location": 0.7, "speed": 0.3}
    usual = Trial(feature=ball, **middle)
    cases = {f"stiffness × {f:g}": (make_antenna(stiffness=f), usual) for f in FACTORS}
    cases |= {
        f"stiffness, damping × {f:g}": (make_antenna(stiffness=f, damping=f), usual)
        for f in FACTORS
    }
    cases |= {f"segments {n}": (make_antenna(n), usual) for n in SEGMENTS}
    for kind in KINDS[:3]:
        feature = make_feature(kind, 1.5)
        cases |= {
            f"{kind} speed {v:g} m/s": (
                make_antenna(),
                Trial(feature=feature, location=0.7, speed=v),
            )
            for v in SPEEDS
        }
        cases |= {
            f"{kind} size {s:g} mm": (
                make_antenna(),
                Trial(feature=make_feature(kind, s), **middle),
            )
            for s in SIZES
        }
    return cases


def judge(antenna: Antenna, trial: Trial, duration: float) -> tuple[str, float, float]:
    """The verdict on one case, the relative change when the timestep is halved, and the timestep at
    which it holds.

    Where the default timestep does not hold, a quarter and a sixteenth of it are tried.
    """
    first = None
    for timestep in (TIMESTEP, TIMESTEP / 4, TIMESTEP / 16):
        verdict, change = judge_at(antenna, trial, duration, timestep)
        first = first or (verdict, change)
        if verdict == "holds":
            return *first, timestep
        if verdict.startswith("refused"):
            break
    return *first, np.nan


def judge_at(
    antenna: Antenna, trial: Trial, duration: float, timestep: float
) -> tuple[str, float]:
    """The verdict at one timestep and the relative change when it is halved."""
    try:
        scene, tips, angles = make_scene(antenna, trial), [], []
        for step in (timestep, timestep / 2):
            outcome = simulate([scene], Clock(duration=duration, timestep=step), workers=1)[0]
            if isinstance(outcome, Exception):
                raise outcome
            tips.append(antenna.shape(outcome.angle)[:, -1])
            angles.append(outcome.angle)
    except SimulationDivergedError:
        return "diverged (named)", np.nan
    except InvalidInput as error:
        return f"refused: {shorten(error)}", np.nan
    return compare(tips, angles)


def compare(tips: list[np.ndarray], angles: list[np.ndarray]) -> tuple[str, float]:
    """Whether two answers are finite and alike."""
    if not (np.isfinite(tips).all() and np.isfinite(angles).all()):
        return "NOT FINITE", np.nan
    size = np.abs(tips[1] - tips[1][0]).max()
    change = float(np.abs(tips[0] - tips[1]).max() / max(size, 1e-6))
    return ("holds" if change <= TOLERANCE else "finite, depends on the timestep"), change


def shorten(error: Exception) -> str:
    """First clause of a message without its numbers, so that equal reasons are counted together."""
    words = str(error).split(".")[0].split(":")[0].split("(")[0]
    return "".join(letter for letter in words if not letter.isdigit())[:60].strip()


def make_random(rng: np.random.Generator) -> tuple[Antenna, Trial]:
    """An antenna and a touch drawn far beyond what is sensible; may raise InvalidInput."""
    n = (
        int(np.exp(rng.uniform(0, np.log(1000))))
        if rng.random() < 0.1
        else int(rng.integers(1, 60))
    )
    length = np.exp(rng.uniform(np.log(1), np.log(100)))
    share = rng.dirichlet(np.full(n, 3.0)) if n > 1 else np.ones(1)
    decades = rng.uniform(-6, 3), rng.uniform(-3, 3)
    stiffness = 10 ** np.linspace(decades[0] + decades[1], decades[0], n)
    antenna = Antenna(
        segment_length=np.maximum(length * share, 1e-6 * length),
        segment_mass=10 ** rng.uniform(-8, -1) / n,
        radius=10 ** rng.uniform(-2, 0.5),
        stiffness=stiffness,
        damping=stiffness * 10 ** rng.uniform(-3, 2) * (rng.random() < 0.9),
        rest_angle=rng.normal(0, 0.3 / n, n) * (rng.random() < 0.3),
    )
    kind = KINDS[rng.integers(len(KINDS))]
    trial = Trial(
        feature=make_feature(
            kind, None if kind == "wall" else 10 ** rng.uniform(np.log10(0.05), np.log10(50))
        ),
        location=rng.uniform(0.05, 1.0),
        speed=10 ** rng.uniform(-3, 1),
        approach=rng.uniform(30, 150) if rng.random() < 0.3 else 90.0,
        friction=rng.choice([0.0, 0.3, 1.0, 3.0]),
        side=("left", "right")[rng.integers(2)],
    )
    return antenna, trial


def run_random(n: int, seed: int = 0, duration: float = 30.0, batch: int = 200) -> Counter:
    """How ``n`` random touches end, by reason; anything that is not feeler's own refusal raises."""
    rng, ends = np.random.default_rng(seed), Counter()
    for start in range(0, n, batch):
        scenes: list[Scene] = []
        for _ in range(min(batch, n - start)):
            try:
                antenna, trial = make_random(rng)
                scenes.append(make_scene(antenna, trial))
            except InvalidInput as error:
                ends[f"refused: {shorten(error)}"] += 1
        outcomes = simulate(scenes, Clock(duration=duration, timestep=TIMESTEP))
        named = [
            (scene, name_end(scene, outcome))
            for scene, outcome in zip(scenes, outcomes, strict=True)
        ]
        ends.update(end for _, end in named if end != CONTACT)
        ends.update(find_cures([scene for scene, end in named if end == CONTACT], duration))
    return ends


def find_cures(scenes: list[Scene], duration: float) -> Counter:
    """For scenes that diverge in contact: at which smaller timestep, if any that was tried, they do
    not.
    """
    cures = Counter()
    for timestep in (TIMESTEP / 4, TIMESTEP / 16):
        outcomes = simulate(scenes, Clock(duration=duration, timestep=timestep))
        left = [
            scene
            for scene, outcome in zip(scenes, outcomes, strict=True)
            if isinstance(outcome, Exception)
        ]
        cures[f"{CONTACT}; finite at {timestep:g} ms"] += len(scenes) - len(left)
        scenes = left
    cures[f"{CONTACT}; also at {timestep:g} ms"] += len(scenes)
    return +cures


def is_free_stable(antenna: Antenna, timestep: float) -> bool:
    """Whether the free antenna is stable at this timestep h: 4 M + 2 h C − h² K is positive
    definite.

    Both engines take (M + h C) v' = M v − h K q, q' = q + h v'; its characteristic polynomial has a
    root at −1 where the matrix above becomes singular. Springs are explicit: a stiff hinge needs
    damping, c > h k / 2, or a smaller h.
    """
    mass = compute_mass_matrix(antenna)
    springs = np.diag(2 * timestep * antenna.damping - timestep**2 * antenna.stiffness)
    scale = 1 / np.sqrt(np.diag(mass))
    return bool(np.linalg.eigvalsh((4 * mass + springs) * scale * scale[:, None]).min() > 0)


def name_end(scene: Scene, outcome: object) -> str:
    """How a simulation ended, in words; an error that is not feeler's is raised."""
    if isinstance(outcome, SimulationDivergedError):
        free = is_free_stable(scene.antenna, TIMESTEP)
        return (
            CONTACT
            if free
            else "diverged (named): hinges too stiff for their damping at this timestep"
        )
    if isinstance(outcome, FeelerError):
        return f"refused: {shorten(outcome)}"
    if isinstance(outcome, Exception):
        raise outcome
    return (
        "finite"
        if np.isfinite(outcome.angle).all() and np.isfinite(outcome.force).all()
        else "NOT FINITE"
    )


def main() -> None:
    """Print the tables and keep the numbers."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--random", type=int, default=0, help="number of random antennas")
    parser.add_argument("--duration", type=float, default=40.0, help="of each extreme [ms]")
    parser.add_argument("--skip-extremes", action="store_true")
    arguments = parser.parse_args()
    file = Path(__file__).parent / "results" / "numerics.json"
    results = json.loads(file.read_text()) if file.exists() else {}
    results["engine"] = DEFAULT_ENGINE
    if not arguments.skip_extremes:
        results["extremes"] = {}
        for name, (antenna, trial) in make_extremes().items():
            verdict, change, timestep = judge(antenna, trial, arguments.duration)
            numbers = {"change": change, "holds_at": timestep}
            shown = {
                key: None if np.isnan(value) else float(f"{value:.3g}")
                for key, value in numbers.items()
            }
            results["extremes"][name] = {"verdict": verdict, **shown}
            print(
                f"{name:32} {verdict:50} {change:9.2g}   holds at {timestep:g} ms", flush=True
            )
    if arguments.random:
        began = time.perf_counter()
        ends = run_random(arguments.random)
        results["random"] = {"n": arguments.random, "ends": dict(ends.most_common())}
        print(f"{arguments.random} random touches in {time.perf_counter() - began:.0f} s")
        for reason, count in ends.most_common():
            print(f"  {count / arguments.random:7.2%}  {reason}")
    file.parent.mkdir(exist_ok=True)
    write_kept(file, json.dumps(results, indent=1, ensure_ascii=False) + "\n")


if __name__ == "__main__":
    main()
