"""Robot files: one TOML file says how a robotic antenna is built, which hinges are sensed, and
where its calibration is.
"""

import os
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import numpy as np

from feeler.antenna import Antenna
from feeler.checked import checked
from feeler.errors import InvalidInput
from feeler.robot.hinge import FACTS, Flexures
from feeler.robot.sensor import MAX_HINGES
from feeler.toml import read_toml

SCHEMA = "feeler.robot/1"
KEYS = {
    "hinges": ("width", "thickness", "length", "modulus"),
    "links": ("length", "mass", "radius"),
    "factors": ("stiffness", "damping"),
    "sensors": ("hinges", "calibration"),
}
TEMPLATE = """\
# A robotic antenna, base to tip. Each list holds one number per hinge; one number alone stands \
for all hinges.
# Try it: feeler robot classify my_recording.csv --antenna {file}
schema = "feeler.robot/1"
name = "my robot"

[hinges]                # flexures: stiffness k = E·w·t³/(12·ℓ) each
width = {width}  # w [mm], across the antenna
thickness = 0.05        # t [mm], of the sheet that bends; it enters as its cube, so measure it
length = 0.5            # ℓ [mm], free length of the flexure
modulus = 2500          # E [MPa]; Kapton 2500

[links]                 # the stiff pieces; link n hangs on hinge n
length = {length}  # [mm]
mass = {mass}  # [g]
radius = 1.0            # [mm], half the thickness that touches things

[factors]               # make the model ring as your robot does: feeler robot fit release.csv \
--antenna {file}
stiffness = 1.0         # p1 [1]
damping = 2.0           # p2 [ms]

[sensors]
hinges = {sensors}  # numbers of the hinges that have a channel, 1 at the base
# calibration = "calibration.json"   # made by feeler robot calibrate; leave out if recordings \
hold angles
"""


@dataclass(frozen=True, kw_only=True, eq=False)
class RobotFile:
    """What a robot file holds."""

    antenna: Antenna
    """The model, p1 and p2 included."""
    theory: Antenna
    """The same with p1 = 1 and p2 = 1 ms: what :func:`feeler.robot.fit_factors` starts from."""
    calibration: Path | None
    """The sensors' calibration, where the file names one."""


@checked
def write_robot(path: str | os.PathLike, n_hinges: Annotated[int, "> 0"]) -> None:
    """Write a commented robot file to be edited: widths fall linearly from 12 to 4 mm, 8 mm links
    of 30 mg [C].

    Raises
    ------
    InvalidInput
        The file exists, or there are more hinges than a calibration can hold (256).
    """
    path = Path(path)
    if path.exists():
        raise InvalidInput(f"{path} exists already. Choose another name.")
    if n_hinges > MAX_HINGES:
        raise InvalidInput(f"a robot has at most {MAX_HINGES} hinges, got {n_hinges}.")
    text = TEMPLATE.format(
        file=path.name,
        width=[round(width, 2) for width in np.linspace(12.0, 4.0, n_hinges).tolist()],
        length=[8.0] * n_hinges,
        mass=[0.03] * n_hinges,
        sensors=list(range(1, n_hinges + 1)),
    )
    path.write_text(text, encoding="utf-8")


def is_robot_file(path: str | os.PathLike) -> bool:
    """Whether a file says of itself that it is a robot file."""
    if not Path(path).is_file():
        return False
    try:
        with open(path, encoding="utf-8", errors="replace") as file:
            return f'"{SCHEMA.split("/")[0]}/' in file.read(4096)
    except OSError:
        return False


@checked
def load_robot(path: str | os.PathLike) -> RobotFile:
    """The robot in a TOML file, as ``feeler robot new`` writes one.

    Raises
    ------
    InvalidInput
        Not TOML of this schema, an unknown or missing key, or lists whose lengths do not agree.
    """
    path = Path(path)
    try:
        return _build(read_toml(path), path)
    except ValueError as error:
        words = str(error)[:300]
        raise InvalidInput(words if path.name in words else f"{path.name}: {words}") from error


def _build(content: dict[str, Any], path: Path) -> RobotFile:
    if content.get("schema") != SCHEMA:
        raise InvalidInput(f"schema must be {SCHEMA!r}, got {str(content.get('schema'))[:40]!r}.")
    _check_keys(content)
    hinges, links, factors, sensors = (content.get(name, {}) for name in KEYS)
    flexures = Flexures(**{name: _read(hinges, "hinges", name) for name in KEYS["hinges"]})
    widths = {
        np.size(_read(table, name, key))
        for name, table in (("hinges", hinges), ("links", links))
        for key in table
    }
    if len(widths - {1}) > 1:
        raise InvalidInput(
            "lists must have one number per hinge; their lengths are"
            f" {', '.join(map(str, sorted(widths)))}."
        )
    n = max(widths)
    stiffness = np.broadcast_to(flexures.stiffness, n)
    theory = Antenna(
        segment_length=np.broadcast_to(_read(links, "links", "length"), n),
        segment_mass=np.broadcast_to(_read(links, "links", "mass"), n),
        radius=_read(links, "links", "radius"),
        stiffness=stiffness,
        damping=stiffness,
        sensors=sensors.get("hinges", np.arange(1, n + 1)),
        name=str(content.get("name", path.stem)),
    )
    p1 = factors.get("stiffness", FACTS["stiffness_factor"].number)
    p2 = factors.get("damping", FACTS["damping_factor"].number)
    for name, factor in (("stiffness", p1), ("damping", p2)):
        if (
            isinstance(factor, bool)
            or not isinstance(factor, int | float)
            or not 0 < factor < np.inf
        ):
            raise InvalidInput(f"[factors] {name} must be a number > 0, got {str(factor)[:40]!r}.")
    named = sensors.get("calibration")
    return RobotFile(
        antenna=theory.replace(stiffness=p1 * stiffness, damping=p2 * stiffness),
        theory=theory,
        calibration=None if named is None else path.parent / str(named),
    )


def _check_keys(content: dict[str, Any]) -> None:
    if unknown := sorted(content.keys() - KEYS.keys() - {"schema", "name"}):
        raise InvalidInput(f"unknown key {unknown[0]!r}; valid: schema, name, {', '.join(KEYS)}.")
    for name, keys in KEYS.items():
        table = content.get(name, {})
        if not isinstance(table, dict):
            raise InvalidInput(f"{name} must be a table [{name}].")
        if unknown := sorted(table.keys() - set(keys)):
            raise InvalidInput(f"[{name}] has no {unknown[0]!r}; valid: {', '.join(keys)}.")


def _read(table: dict[str, Any], name: str, key: str) -> np.ndarray:
    """One number or a list of them."""
    if key not in table:
        raise InvalidInput(f"[{name}] needs {key}; see `feeler robot new`.")
    values = table[key] if isinstance(table[key], list) else [table[key]]
    if not 1 <= len(values) <= MAX_HINGES or not all(
        type(value) in (int, float) for value in values
    ):
        raise InvalidInput(
            f"[{name}] {key} must be a number or a list of 1 to {MAX_HINGES} numbers."
        )
    return np.array(values if len(values) > 1 else values[0], dtype=float)
