"""What there is of an animal, as one TOML file: films, tables, and what touches it."""

import csv
from collections.abc import Mapping
from dataclasses import field
from importlib.resources import files
from pathlib import Path
from typing import Annotated, Any

import numpy as np

from feeler.antenna.segments import Antenna
from feeler.calibration import Protocol, compute_force, make_factors
from feeler.calibration.traces import simulate_steps
from feeler.errors import InvalidInput
from feeler.experiments.mechanics import hit
from feeler.files import ensure_folder, make_record, read_toml, write_text
from feeler.objects.bodies import Object
from feeler.objects.motion import BaseMotion
from feeler.objects.shapes import Ball
from feeler.physics.contact import get_contact
from feeler.physics.engine import DEFAULT_ENGINE, choose_timestep
from feeler.physics.run import run_scene
from feeler.physics.scene import Clock, Scene
from feeler.records import Ge, Gt, Len, Record, Unit
from feeler.validation import Seed, checked

ANIMAL_SCHEMA = "feeler.animal/1"
_FILES = ("files", "held_out")


class _Microscope(Record):
    """Segments along an antenna, and guesses that a fit corrects.

    Attributes
    ----------
    file : str
        A table, as :func:`feeler.calibration.load_microscope` reads it.
    modulus : float
        [MPa]
    density : float
        [g/mm³]
    damping_time : float
        Damping over stiffness [ms].
    """

    file: str
    modulus: Annotated[float, Gt(0), Unit("MPa")]
    density: Annotated[float, Gt(0), Unit("g/mm³")] = 1.1e-3
    damping_time: Annotated[float, Gt(0), Unit("ms")] = 1.0


class Films(Record):
    """Films of antennae that are released or hit, by animal.

    Attributes
    ----------
    files : dict[str, str]
        Animal → film that is fitted.
    held_out : dict[str, str]
        Animal → film that is predicted.
    points : tuple[str, ...]
        Landmarks along the antenna, base to tip.
    at : float | None
        Where the antenna was held [mm from the base].
    speed : float
        Of an object that hits [m/s].
    scale : float | None
        Pixels per mm.
    video : dict[str, str]
        Animal → video of its film, to draw on.
    """

    files: dict[str, str] = field(default_factory=dict)
    held_out: dict[str, str] = field(default_factory=dict)
    points: tuple[str, ...] = ("base", "tip")
    frame_rate: float | None = None
    at: Annotated[float, Gt(0), Unit("mm")] | None = None
    speed: Annotated[float, Gt(0), Unit("m/s")] = 0.2
    scale: Annotated[float, Gt(0), Unit("px/mm")] | None = None
    max_gap: Annotated[int, Ge(0)] = 5
    min_likelihood: float | None = None
    individual: str | None = None
    video: dict[str, str] = field(default_factory=dict)

    def _check(self) -> None:
        if both := {*self.files.values()} & {*self.held_out.values()}:
            raise InvalidInput(
                f"{', '.join(sorted(both))} is in files and in held_out: a film is fitted or"
                " predicted, not both."
            )


class _Forces(Record):
    """Force–deflection tables, by animal; ``at`` [mm from the base] unless a column says it."""

    files: dict[str, str]
    at: Annotated[float, Gt(0), Unit("mm")] | None = None


class _Walks(Record):
    """Films of freely moving animals, and the names of their landmarks.

    Attributes
    ----------
    towards : tuple[str, str]
        Two landmarks that say where the antenna's base points.
    angle : float
        Of the antenna to that direction [degrees], positive to the right.
    """

    files: dict[str, str]
    frame_rate: float | None = None
    scale: Annotated[float, Gt(0), Unit("px/mm")] | None = None
    tips: tuple[str, str] = ("left_tip", "right_tip")
    head: str = "head"
    abdomen: str = "abdomen"
    base: str = ""
    towards: Annotated[tuple[str, ...], Len(2)] | None = None
    angle: Annotated[float, Unit("degrees"), Ge(-180)] = 0.0
    origin: str = "top-left"
    individual: str | None = None


class _Touched(Record):
    """What touches the antenna.

    Attributes
    ----------
    shape : str
        As on the command line: ``ball:radius=1``, ``outline:file=leaf.svg,width=3``,
        ``mesh:file=stone.stl,width=3``.
    landmark : str
        Landmark of the first walk at the object's middle; default: it comes at ``speed`` to
        ``location``.
    """

    shape: str
    location: Annotated[float, Gt(0)] = 0.6
    speed: Annotated[float, Gt(0), Unit("m/s")] = 0.1
    landmark: str = ""


class _WallPlan(Record):
    """A wall that approaches: angle of the antenna to the midline [degrees]; otherwise as
    ``feeler wall``.
    """

    angle: float = 35.0


class _SpikePlan(Record):
    """Recorded spikes: a table with a column ``time_s`` or ``time_ms``."""

    file: str


class AnimalPlan(Record):
    """What there is of an animal.

    Attributes
    ----------
    antenna : str
        A preset or an antenna's file, in the place of ``microscope``.
    folder : str
        What file names are relative to.
    """

    name: str = "animal"
    antenna: str = ""
    microscope: _Microscope | None = None
    force: _Forces | None = None
    releases: Films | None = None
    impulses: Films | None = None
    walks: _Walks | None = None
    object: _Touched | None = None
    wall: _WallPlan | None = None
    spikes: _SpikePlan | None = None
    folder: str = "."

    def find(self, file: str) -> Path:
        """The path of a file that the plan names."""
        path = Path(self.folder) / file
        if not path.exists():
            folder = Path(self.folder).resolve()
            raise InvalidInput(f"cannot read {file}: no such file in {folder}. Check the plan.")
        return path


@checked
def load_animal(path: str | Path) -> AnimalPlan:
    """The plan in a TOML file of the schema ``feeler.animal/1``; files may be a list, whose
    animals are then called as the files are.

    Raises
    ------
    InvalidInput
        Another file, a key that there is not, or a value of the wrong kind.
    """
    content = dict(read_toml(path))
    if content.pop("schema", None) != ANIMAL_SCHEMA:
        raise InvalidInput(
            f'{Path(path).name} must begin with schema = "{ANIMAL_SCHEMA}"; feeler animal --new'
            " FILE writes one to fill in."
        )
    for table in content.values():
        for key in _FILES if isinstance(table, Mapping) else ():
            if key in table:
                # Files by animal, also from a list or a single one.
                files = [table[key]] if isinstance(table[key], str) else table[key]
                if isinstance(files, list):
                    table[key] = {Path(str(one)).stem: one for one in files}
    return make_record(
        AnimalPlan, {**content, "folder": str(Path(path).parent)}, Path(path).name
    )


# A synthetic animal with known mechanics, as the files that a laboratory would have; and a plan
# to fill in.

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
    _write_table(path, ",".join(f"{name}_{axis}" for name in points for axis in "xy"), pixels)


def _point(turn: np.ndarray) -> np.ndarray:
    return np.stack([np.sin(turn), np.cos(turn)], axis=1)


def _write_table(path: Path, header: str, values: np.ndarray) -> None:
    rows = "\n".join(",".join(f"{cell:.4f}" for cell in row) for row in values)
    write_text(path, f"# synthetic\n{header}\n{rows}\n")
