"""Robot files: one TOML file describes a robotic antenna, its sensors and their calibration."""

import os
from functools import cached_property
from pathlib import Path
from typing import Annotated, Any

import numpy as np

from feeler.antenna import Antenna
from feeler.disk.files import read_start, writing
from feeler.disk.toml import make_record, read_toml
from feeler.errors import InvalidInput
from feeler.records.checked import checked
from feeler.records.record import Ge, Gt, Le, Of, Record, Unit
from feeler.robot.hinge import ROBOT_FACTS, Flexures
from feeler.robot.sensor import MAX_HINGES

_SCHEMA = "feeler.robot/1"
_HEAD = """\
# A robotic antenna, base to tip. Each list holds one number per hinge; one number alone stands \
for all hinges.
# Try it: feeler robot classify my_recording.csv --antenna {file}
schema = "feeler.robot/1"
name = "my robot"

"""
_HINGED = """\
[hinges]                # flexures: stiffness k = E·w·t³/(12·ℓ) each
width = {width}  # w [mm], across the antenna
thickness = 0.05        # t [mm], of the sheet that bends; it enters as its cube, so measure it
length = 0.5            # ℓ [mm], free length of the flexure
modulus = 2500          # E [MPa]; Kapton 2500

[links]                 # the stiff pieces; link n hangs on hinge n
length = {length}  # [mm]
mass = {mass}  # [g]
radius = 1.0            # [mm], half the thickness that touches things

"""
_MOULDED = """\
[beam]                  # one soft piece, such as cast silicone
length = {length}           # [mm], from the clamp to the tip
segments = {hinges}           # stiff pieces that stand for it in the model; sensors count them
diameter = "4 - 2 * x"  # [mm] at x, 0 at the base, 1 at the tip: a cone; of a rod one number
# width = 6.0           # or, of a strip: [mm] across,
# thickness = 2.0       # and [mm] in the direction that bends
modulus = 0.8           # E [MPa] of small strains; silicones 0.1 to 3: measure it, or fit it
density = 1.1e-3        # [g/mm3]

"""
_TAIL = """\
[factors]               # make the model ring as your robot does: feeler robot fit release.csv \
--antenna {file}
stiffness = 1.0         # p1 [1]
damping = 2.0           # p2 [ms]

[sensors]
hinges = {sensors}  # numbers of the hinges that have a channel, 1 at the base
# calibration = "calibration.json"   # made by feeler robot calibrate; leave out if recordings \
hold angles
"""


class _Links(Record):
    """Table ``[links]``: the stiff pieces; each field is one number or one per hinge."""

    length: Annotated[np.ndarray, "hinge?", Gt(0), Unit("mm")]
    mass: Annotated[np.ndarray, "hinge?", Gt(0), Unit("g")]
    radius: Annotated[np.ndarray, "hinge?", Gt(0), Unit("mm")]


class _Beam(Record):
    """Table ``[beam]``: one soft piece, as :meth:`feeler.Antenna.from_beam` takes it; each of
    diameter, width, thickness, modulus and density is a number or a formula of the place x.
    """

    length: Annotated[float, Gt(0), Unit("mm")]
    segments: Annotated[int, Ge(1), Le(MAX_HINGES)]
    modulus: Any
    density: Any
    diameter: Any = None
    width: Any = None
    thickness: Any = None

    def make(self, **fields: Any) -> Antenna:
        """The antenna of this beam, without damping.

        Raises
        ------
        InvalidInput
            Neither a diameter nor width and thickness, or one that is not > 0 all along.
        """
        section = {"width": self.width, "thickness": self.thickness}
        if self.diameter is not None:
            section["radius"] = f"({self.diameter}) / 2"
        elif None in section.values():
            raise InvalidInput("[beam] needs diameter [mm], or width and thickness [mm].")
        how = {"modulus": self.modulus, "density": self.density, "n_segments": self.segments}
        return Antenna.from_beam(length=self.length, **how, **section, **fields)


class _Factors(Record):
    """Table ``[factors]``: stiffness and damping of a hinge over its theoretical stiffness k_th.

    Attributes
    ----------
    stiffness : float
        p1 [1]: k = p1·k_th.
    damping : float
        p2 [ms]: c = p2·k_th.
    """

    stiffness: Annotated[float, Gt(0)] = ROBOT_FACTS["stiffness_factor"].number
    damping: Annotated[float, Gt(0), Unit("ms")] = ROBOT_FACTS["damping_factor"].number


class _Sensors(Record):
    """Table ``[sensors]``: which hinges have a channel, and the file of their calibration."""

    hinges: Annotated[np.ndarray, "sensor", Of(int)] | None = None
    calibration: str | None = None


class RobotFile(Record):
    """What a robot file holds.

    Attributes
    ----------
    folder : Path
        Where the file lies.
    """

    name: str
    folder: Path
    hinges: Flexures | None = None
    links: _Links | None = None
    beam: _Beam | None = None
    factors: _Factors = _Factors()
    sensors: _Sensors = _Sensors()

    def _check(self) -> None:
        if (self.beam is None) == (self.hinges is None or self.links is None) or (
            self.beam and (self.hinges or self.links)
        ):
            raise InvalidInput(
                "a robot is hinged, with the tables [hinges] and [links], or moulded in one piece,"
                " with [beam]; give one or the other."
            )
        sizes = self._list_sizes()
        if len(sizes - {1}) > 1:
            raise InvalidInput(
                "lists must have one number per hinge; their lengths are"
                f" {', '.join(map(str, sorted(sizes)))}."
            )
        if max(sizes) > MAX_HINGES:
            raise InvalidInput(f"a robot has at most {MAX_HINGES} hinges, got {max(sizes)}.")
        _ = self.antenna  # whose own checks are part of the file's

    def _list_sizes(self) -> set[int]:
        links = self.links
        if self.hinges is None or links is None:
            return {self.beam.segments if self.beam else 0}
        values = (self.hinges.stiffness, links.length, links.mass, links.radius)
        return {array.size for array in values}

    @cached_property
    def theory(self) -> Antenna:
        """p1 = 1 and p2 = 1 ms: what :func:`feeler.robot.fit_factors` starts from."""
        n = max(self._list_sizes())
        every_hinge = np.arange(1, n + 1)
        sensors = every_hinge if self.sensors.hinges is None else self.sensors.hinges
        if self.beam:
            made = self.beam.make(sensors=sensors, name=self.name)
            return made.replace(damping=made.stiffness)
        assert self.hinges is not None and self.links is not None
        stiffness = np.broadcast_to(self.hinges.stiffness, n)
        return Antenna(
            segment_length=np.broadcast_to(self.links.length, n),
            segment_mass=np.broadcast_to(self.links.mass, n),
            radius=self.links.radius,
            stiffness=stiffness,
            damping=stiffness,
            sensors=sensors,
            name=self.name,
        )

    @cached_property
    def antenna(self) -> Antenna:
        """The model with the file's factors: stiffness p1·k_th, damping p2·k_th."""
        k_th, factors = self.theory.stiffness, self.factors
        with np.errstate(over="ignore"):  # the antenna refuses what is no finite number
            return self.theory.replace(
                stiffness=factors.stiffness * k_th, damping=factors.damping * k_th
            )

    @property
    def calibration(self) -> Path | None:
        """The sensors' calibration, where the file names one."""
        return self.folder / self.sensors.calibration if self.sensors.calibration else None


@checked
def write_robot(
    path: str | os.PathLike, n_hinges: Annotated[int, "> 0"], *, moulded: bool = False
) -> None:
    """Write a commented robot file to be edited.

    Widths fall linearly from 12 to 4 mm; links are 8 mm long and weigh 30 mg [C]. ``moulded``: one
    soft piece in place of hinges and links, a cone of silicone [C].

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
    text = (_HEAD + (_MOULDED if moulded else _HINGED) + _TAIL).format(
        file=path.name,
        width=[round(width, 2) for width in np.linspace(12.0, 4.0, n_hinges).tolist()],
        length=8.0 * n_hinges if moulded else [8.0] * n_hinges,
        hinges=n_hinges,
        mass=[0.03] * n_hinges,
        sensors=list(range(1, n_hinges + 1)),
    )
    with writing(path) as part:
        part.write_text(text, encoding="utf-8")


def is_robot_file(path: str | os.PathLike) -> bool:
    """Whether a file says of itself that it is a robot file."""
    try:
        return f'"{_SCHEMA.split("/")[0]}/'.encode() in read_start(path, 4096)
    except InvalidInput:
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
    content = read_toml(path, schema=_SCHEMA)
    return make_record(
        RobotFile, {"name": path.stem, **content, "folder": path.parent}, path.name
    )
