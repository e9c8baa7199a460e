"""A synthetic animal with known mechanics, as the files that a laboratory would have; and a plan to
fill in.
"""

import csv
from importlib.resources import files
from pathlib import Path
from typing import Any

import numpy as np

from feeler.antenna.segments import Antenna
from feeler.calibration import Protocol, compute_force, make_factors
from feeler.calibration.traces import simulate_steps
from feeler.errors import InvalidInput
from feeler.experiments.mechanics import hit
from feeler.files import ensure_folder, write_text
from feeler.objects.bodies import Object
from feeler.objects.motion import BaseMotion
from feeler.objects.shapes import Ball
from feeler.physics.contact import get_contact
from feeler.physics.engine import DEFAULT_ENGINE, choose_timestep
from feeler.physics.run import run_scene
from feeler.physics.scene import Clock, Scene
from feeler.validation import Seed, checked

PLANTED = {
    "stiffness": 1.4,
    "damping": 0.7,
    "mass": 1.1,
    "stiffness_tilt": -0.4,
    "damping_tilt": 0.3,
}
"""Factors between the guess that a plan begins with and the synthetic animals' mean."""
_LENGTH = np.linspace(0.6, 1.4, 25)  # mm
_RADIUS = np.linspace(0.14, 0.05, 25)
_GUESS: dict[str, Any] = {"modulus": 300.0, "density": 1.1e-3, "damping_time": 1.5}
_HELD = Protocol(at=6.0, deflection=0.6)
_SCALE = 8.0  # px/mm
_ALONG = np.array([0.5, np.sqrt(0.75)])  # of the antenna in the picture, y upwards


def write_template(path: Path) -> None:
    """A commented plan, to be filled in."""
    text = files("feeler.animal").joinpath("template.toml").read_text(encoding="utf-8")
    if path.exists():
        raise InvalidInput(f"{path} exists already. Choose another name.")
    write_text(path, text)


@checked
def write_example(folder: Path, *, seed: Seed = 0, spread: float = 0.04) -> Path:
    """Write all files of a synthetic animal, and the plan that names them; the plan's path.

    Three animals' releases, a fourth's that is held out, a microscope's table, a force–deflection
    curve, an impulse and a walk. Their mean is :data:`PLANTED` times the plan's guess, and each
    differs by ``spread`` (log-normal sd) in stiffness and damping.
    """
    folder, rng = ensure_folder(folder), np.random.default_rng(seed)
    segments = np.stack([np.arange(1, 26), 1e3 * _LENGTH, 2e3 * _RADIUS], axis=1)
    _write_table(folder / "segments.csv", "segment,length_um,diameter_um", segments)
    guess = Antenna.from_beam(length=_LENGTH, radius=_RADIUS, **_GUESS)
    mean = make_factors(guess, [*PLANTED]).build(np.array([*PLANTED.values()]))
    for name in ("c1", "c2", "c3", "c4"):
        factors = np.exp(rng.normal(0, spread, 2))
        own = mean.replace(
            stiffness=mean.stiffness * factors[0], damping=mean.damping * factors[1]
        )
        _film_release(folder / f"release_{name}.csv", own, rng)
    moved = np.linspace(0, 1.0, 14)
    force = compute_force(mean, moved, 10.0)
    force = force + 2e-6 + rng.normal(0, 0.01 * force.max(), moved.size)
    curve = np.stack([1e3 * moved, 1e6 * force], axis=1)
    _write_table(folder / "force.csv", "deflection_um,force_uN", curve)
    impulse = hit(mean, points=(0.5, 0.8), sample_interval=1.0)
    deflection, tip = impulse["deflection"].values, impulse["tip"].values
    rows = np.vstack([np.zeros(tip.size), deflection, tip])
    _film(folder / "impulse.csv", mean.length, (0, 0.5, 0.8, 1), "base,p50,p80,tip", rows, rng)
    _film_walk(folder / "walk.csv", mean, rng)
    write_text(
        folder / "animal.toml",
        files("feeler.animal").joinpath("example.toml").read_text(encoding="utf-8"),
    )
    return folder / "animal.toml"


def _film_release(path: Path, antenna: Antenna, rng: np.random.Generator) -> None:
    time, places = np.arange(0, 120, 1.0), (0.4, 0.7, 1.0)
    moved = simulate_steps(
        [antenna], _HELD.replace(step_duration=130.0), np.maximum(time - 20.4, 0.0), places
    )[0]
    rows = np.vstack([np.zeros(time.size), 6.0 * moved])
    _film(path, antenna.length, (0, *places), "base,p40,p70,tip", rows, rng)


def _film(
    path: Path,
    length: float,
    places: tuple[float, ...],
    names: str,
    moved: np.ndarray,
    rng: np.random.Generator,
) -> None:
    """A DeepLabCut table of points of a clamped antenna, displaced across it (point, frame) [mm];
    three frames of the tip are unsure.
    """
    across = np.array([_ALONG[1], -_ALONG[0]])
    there = length * np.array(places)[:, None, None] * _ALONG + moved[..., None] * across
    pixels = (120, 300) + _SCALE * there * (1, -1) + rng.normal(0, 0.2, there.shape)
    sure = np.full(moved.shape, 0.99)
    sure[-1, 60:63] = 0.2
    with path.open("w", encoding="utf-8", newline="") as file:
        table = csv.writer(file, lineterminator="\n")
        points = names.split(",")
        table.writerow(["scorer", *["synthetic"] * 3 * len(points)])
        table.writerow(["bodyparts", *(name for name in points for _ in range(3))])
        table.writerow(["coords", *["x", "y", "likelihood"] * len(points)])
        cells = np.concatenate([pixels, sure[..., None]], axis=2).transpose(1, 0, 2)
        for k, row in enumerate(cells.reshape(moved.shape[1], -1)):
            table.writerow([k, *(f"{cell:.2f}" for cell in row)])


def _film_walk(path: Path, antenna: Antenna, rng: np.random.Generator) -> None:
    """A body that walks upwards and sways; its left antenna sweeps, bends on the way, and meets a
    stone. The right antenna is a stiff copy in the mirror.
    """
    time = np.arange(240) * 4.0
    sway = 0.06 * np.sin(2 * np.pi * time / 700)
    sweep = -0.45 + 0.3 * np.sin(2 * np.pi * time / 400)
    head = np.stack([0.0 * time, 0.01 * time], axis=1)
    pose = np.column_stack([head, sway + sweep])
    stone = Object(feature=Ball(radius=1.0), place=(-11.0, 16.0))
    scene = Scene(
        antenna=antenna,
        objects=(stone,),
        contact=get_contact(None, antenna),
        base_motion=BaseMotion(time=time, pose=pose),
    )
    clock = Clock(duration=time[-1], sample_interval=4.0, timestep=choose_timestep(
        None, DEFAULT_ENGINE, scene.contact
    ))  # fmt: skip
    motion = run_scene(scene, clock)
    n = motion.time.size
    turn = motion.base[:, 2]
    bent = [
        antenna.shape(angle, heading) for angle, heading in zip(motion.angle, turn, strict=True)
    ]
    shape = np.array(bent)
    points = {
        "head": head[:n],
        "abdomen": head[:n] - 8 * _point(sway)[:n],
        "left_tip": head[:n] + shape[:, -1],
        "left_stalk": head[:n] + shape[:, 3],
        "right_tip": head[:n] + antenna.length * _point(sway - sweep)[:n],
        "stone": np.broadcast_to(stone.centre, (n, 2)),
    }
    place = np.concatenate([*points.values()], axis=1)
    place = place + rng.normal(0, 0.02, place.shape)
    pixels = place * np.tile([_SCALE, -_SCALE], 6) + np.tile([300.0, 500.0], 6)
    header = ",".join(f"{name}_{axis}" for name in points for axis in "xy")
    _write_table(path, header, pixels)


def _point(turn: np.ndarray) -> np.ndarray:
    return np.stack([np.sin(turn), np.cos(turn)], axis=1)


def _write_table(path: Path, header: str, values: np.ndarray) -> None:
    rows = "\n".join(",".join(f"{cell:.4f}" for cell in row) for row in values)
    write_text(path, f"# synthetic\n{header}\n{rows}\n")
