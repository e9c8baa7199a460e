"""Robot files: one TOML file describes hinges, sensors and calibration of a robotic antenna."""

import os
from collections.abc import Sequence
from functools import cached_property
from importlib.resources import files
from pathlib import Path
from typing import Annotated, Any

import numpy as np

from feeler.antenna import Antenna
from feeler.antenna.files import Fact
from feeler.errors import InvalidInput
from feeler.execute import Executor
from feeler.files import make_record, read_start, read_toml, write_text
from feeler.objects import Ball, Box, Feature, Trial
from feeler.physics.engine import DEFAULT_ENGINE, choose_timestep
from feeler.records import Ge, Gt, Le, Record, Unit, freeze
from feeler.robot.sensors import MAX_HINGES
from feeler.validation import checked

# The robotic antenna's hinges: geometry, theoretical stiffness, numbers with their sources.

ROBOT_FACTS: dict[str, Fact] = {
    "n_hinges": Fact(value=8, unit="1", tag="P", note="capacitive hinges"),
    "body": Fact(
        value=(73.0, 16.0, 2.0),
        unit="mm",
        tag="P",
        note="length, width, thickness of the whole device",
    ),
    "mass": Fact(value=0.491, unit="g", tag="P", note="of the whole device"),
    "modulus": Fact(value=2500.0, unit="MPa", tag="P", note="Young's modulus of Kapton"),
    "stiffness_factor": Fact(value=1.19, unit="1", tag="P", note="p1: k = p1·k_th"),
    "damping_factor": Fact(
        value=2.06, unit="ms", tag="P", note="p2: c = p2·k_th; the unit is not stated [C]"
    ),
    "spacing": Fact(
        value=7.85, unit="mm", tag="D", note="between hinges; from the poster [A, D]"
    ),
    "mount": Fact(
        value=6.2, unit="mm", tag="D", note="rigid part before hinge 1; about, [A, D]"
    ),
    "last_link": Fact(value=7.5, unit="mm", tag="D", note="beyond hinge 8; about, [A, D]"),
    "width": Fact(
        value=(11.0, 10.0, 9.2, 8.2, 7.1, 6.1, 5.2, 4.6),
        unit="mm",
        tag="D",
        note="±0.3, base to tip; [A, D]",
    ),
    "thickness": Fact(
        value=0.0508,
        unit="mm",
        tag="C",
        note="of the flexure; plausible range 0.0254 to 0.0508",
    ),
    "hinge_length": Fact(
        value=0.5, unit="mm", tag="C", note="of the flexure; plausible range 0.5 to 0.9"
    ),
    "radius": Fact(
        value=1.0,
        unit="mm",
        tag="C",
        note="collision radius: half the 2 mm thickness of the device",
    ),
}


class Flexures(Record):
    """Flexure hinges as geometry; each field is one number or one per hinge, base to tip.

    Attributes
    ----------
    width : np.ndarray
        Width across the antenna [mm].
    thickness : np.ndarray
        Thickness of the bending sheet [mm].
    length : np.ndarray
        Free length of the flexure along the antenna [mm].
    modulus : np.ndarray
        Young's modulus [MPa = N/mm²].
    """

    width: Annotated[np.ndarray, "hinge?", Gt(0), Unit("mm")]
    thickness: Annotated[np.ndarray, "hinge?", Gt(0), Unit("mm")]
    length: Annotated[np.ndarray, "hinge?", Gt(0), Unit("mm")]
    modulus: Annotated[np.ndarray, "hinge?", Gt(0), Unit("MPa")]

    def _check(self) -> None:
        try:
            arrays = np.broadcast_arrays(np.empty(1), *vars(self).values())[1:]
        except ValueError as error:
            raise InvalidInput(
                "width, thickness, length and modulus must be one number or one per hinge, all of"
                " one length."
            ) from error
        vars(self).update(zip(vars(self), map(freeze, arrays), strict=True))
        with np.errstate(over="ignore", under="ignore"):
            theory = self.stiffness
        if not np.all((theory > 0) & np.isfinite(theory)):
            raise InvalidInput(
                "width, thickness, length and modulus give no stiffness that can be computed with;"
                f" check their units (mm, MPa): got {theory.min():g} to {theory.max():g} N·mm/rad."
            )

    @property
    def stiffness(self) -> np.ndarray:
        """Theoretical stiffness (hinge,) [N·mm/rad]: k_th = E·w·t³/(12·ℓ) (Methods; form [B])."""
        return self.modulus * self.width * self.thickness**3 / (12 * self.length)


@checked
def make_flexures(**changes: float | np.ndarray) -> Flexures:
    """The robot's eight hinges.

    ``thickness``, ``length``, ``width`` and ``modulus`` replace the defaults.
    """
    facts = {
        "length": "hinge_length",
        **{key: key for key in ("width", "thickness", "modulus")},
    }
    values: dict[str, Any] = {name: ROBOT_FACTS[fact].value for name, fact in facts.items()}
    return Flexures(**values | changes)


# The robotic antenna as an :class:`~feeler.antenna.Antenna` of eight hinges.

MOUNT = ROBOT_FACTS["mount"].number
"""Rigid part before hinge 1 [mm]. The model starts at hinge 1: a clamped rigid mount does not move,
so it has no place in the dynamics, and ``location`` and ``length`` count from hinge 1. Add it to
get places on the device.
"""


@checked
def make_robot(
    *,
    hinges: Flexures | None = None,
    stiffness_factor: Annotated[float, Gt(0)] = ROBOT_FACTS["stiffness_factor"].number,
    damping_factor: Annotated[float, Gt(0)] = ROBOT_FACTS["damping_factor"].number,
    mass: Annotated[float, Gt(0)] = ROBOT_FACTS["mass"].number,
    radius: float = ROBOT_FACTS["radius"].number,
    name: str = "robot",
) -> Antenna:
    """The robotic antenna: k = p1·k_th and c = p2·k_th, k_th from each flexure's geometry.

    The antenna's length counts from hinge 1 (62.45 mm); the 6.2 mm mount before it is rigid and not
    part of the model. The sheet's thickness, its free length, the share of mass in each link and
    the unit of p2 are not published [C], so absolute frequencies and forces of the real robot must
    not be read off this preset: fit p1 and p2 to a recording with :func:`feeler.robot.fit_factors`.

    Parameters
    ----------
    hinges
        Flexure geometry; default :func:`make_flexures`.
    stiffness_factor, damping_factor
        p1 [1] and p2 [ms].
    mass
        Mass of the whole device [g]; link masses are its share by area, width × length, the rest is
        mount [C].
    radius
        Collision radius [mm].

    Returns
    -------
    Antenna
        8 segments, every hinge a sensor.
    """
    hinges = make_flexures() if hinges is None else hinges
    n = hinges.stiffness.size
    segment_length = np.append(
        np.full(n - 1, ROBOT_FACTS["spacing"].number), ROBOT_FACTS["last_link"].number
    )
    # Mass (segment,) [g] of links of one areal density.
    length, body_width, _ = ROBOT_FACTS["body"].numbers
    link_area = segment_length * hinges.width
    mount_area = max(length - segment_length.sum(), MOUNT) * body_width
    return Antenna(
        segment_length=segment_length,
        segment_mass=mass * link_area / (link_area.sum() + mount_area),
        radius=np.full(n, radius),
        stiffness=stiffness_factor * hinges.stiffness,
        damping=damping_factor * hinges.stiffness,
        sensors=np.arange(1, n + 1),
        name=name,
    )


# Robot files: one TOML file describes a robotic antenna, its sensors and their calibration.

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
_TAIL = """\
[factors]               # make the model ring as your robot does: feeler robot fit release.csv \
--antenna {file}
stiffness = 1.0         # p1 [1]
damping = 2.0           # p2 [ms]

[sensors]
hinges = {sensors}  # numbers of the hinges that have a channel, 1 at the base
# calibration = "calibration.json"   # made by feeler robot calibrate; leave out if recordings \
hold angles
# joints = ["antenna_joint_*"]       # names or patterns of its channels, base to tip, in a topic \
that has others too
"""


class _Links(Record):
    """Table ``[links]``: the stiff pieces; each field is one number or one per hinge."""

    length: Annotated[np.ndarray, "hinge?", Gt(0), Unit("mm")]
    mass: Annotated[np.ndarray, "hinge?", Gt(0), Unit("g")]
    radius: Annotated[np.ndarray, "hinge?", Gt(0), Unit("mm")]


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
    """Table ``[sensors]``: which hinges have a channel, the file of their calibration, and what
    their channels are called, by names or patterns, where recordings have others too.
    """

    hinges: Annotated[np.ndarray, "sensor", int] | None = None
    calibration: str | None = None
    joints: tuple[str, ...] = ()


class RobotFile(Record):
    """What a robot file holds.

    Attributes
    ----------
    folder : Path
        Where the file lies.
    """

    name: str
    folder: Path
    hinges: Flexures
    links: _Links
    factors: _Factors = _Factors()
    sensors: _Sensors = _Sensors()

    def _check(self) -> None:
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
        values = (self.hinges.stiffness, links.length, links.mass, links.radius)
        return {array.size for array in values}

    @cached_property
    def theory(self) -> Antenna:
        """p1 = 1 and p2 = 1 ms: what :func:`feeler.robot.fit_factors` starts from."""
        n = max(self._list_sizes())
        stiffness = np.broadcast_to(self.hinges.stiffness, n)
        sensors = self.sensors.hinges
        return Antenna(
            segment_length=np.broadcast_to(self.links.length, n),
            segment_mass=np.broadcast_to(self.links.mass, n),
            radius=self.links.radius,
            stiffness=stiffness,
            damping=stiffness,
            sensors=np.arange(1, n + 1) if sensors is None else sensors,
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
    path: str | os.PathLike, n_hinges: Annotated[int, Ge(1), Le(MAX_HINGES)]
) -> None:
    """Write a commented robot file to be edited.

    Widths fall linearly from 12 to 4 mm; links are 8 mm long and weigh 30 mg [C].

    Raises
    ------
    InvalidInput
        The file exists, or there are more hinges than a calibration can hold (256).
    """
    path = Path(path)
    if path.exists():
        raise InvalidInput(f"{path} exists already. Choose another name.")
    text = (_HEAD + _HINGED + _TAIL).format(
        file=path.name,
        width=[round(width, 2) for width in np.linspace(12.0, 4.0, n_hinges).tolist()],
        length=[8.0] * n_hinges,
        mass=[0.03] * n_hinges,
        sensors=list(range(1, n_hinges + 1)),
    )
    write_text(path, text)


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


# Example files, made by a surrogate robot and labelled so (``benchmarks/robot_examples.py``).

EXAMPLES = {
    "recording": "surrogate_ball_tip_fast.csv",
    "calibration": "surrogate_calibration_table.csv",
    "release": "surrogate_release.csv",
}


def get_example(name: str) -> Path:
    """Path of an example file.

    ``recording`` holds capacitance, ``calibration`` a bench table, ``release`` angles.
    """
    if name not in EXAMPLES:
        raise InvalidInput(f"unknown example {name!r}; valid: {', '.join(EXAMPLES)}.")
    return Path(str(files("feeler.robot") / "data" / EXAMPLES[name]))


# Simulated touches of the robotic antenna.

ROBOT_SPEEDS = (0.270, 0.135, 0.027)  # [P] mm/ms = m/s
ROBOT_LOCATIONS = (
    0.5,
    0.6,
    0.7,
    0.8,
    0.9,
)  # [C] five from middle to tip [P], as for the insect; the last is "the tip"
_SIZE = 4.0  # [C] mm; radius of the ball, half-width and half-height of the box
ROBOT_LEAD = 20.0  # [C] ms before contact, enough to see the resting level
_RINGING = 400.0  # [C] ms kept after contact can last
_SWEEP = (
    60.0,
    -40.0,
)  # [C] mm; how far a feature moves before the antenna slips off: at 0.5 L, and per length beyond
INTERVAL = 1.0  # [P] ms
_ALIKE = 1.35  # ratio of durations up to which touches are simulated on one clock

Label = tuple[str, float, float]
"""A class: feature, location, speed."""
Joints = tuple[str, ...]
"""Names of channels, or patterns as of a shell, from base to tip."""


@checked
def make_touches(
    *,
    features: Sequence[Feature] | None = None,
    locations: Sequence[float] = ROBOT_LOCATIONS,
    speeds: Sequence[float] = ROBOT_SPEEDS,
    size: float = _SIZE,
    friction: float = 1.0,
) -> list[Trial]:
    """Every feature at every location and speed.

    By default the paper's ball and box of ``size``, 30 touches.
    """
    if features is None:
        features = (Ball(radius=size), Box(half_width=size, half_height=size))
    return [
        Trial(
            feature=feature, location=location, speed=speed, lead=ROBOT_LEAD, friction=friction
        )
        for speed in speeds
        for location in locations
        for feature in features
    ]


@checked
def get_label(trial: Trial) -> Label:
    """The class of a trial."""
    return trial.name, trial.location, trial.speed


def _choose_duration(trial: Trial, reach: float = 1.0) -> float:
    """Time [ms] after which a touch has let go and rung for about 400 ms.

    ``reach`` is the antenna's length over that of the paper's robot.
    """
    sweep = reach * max(_SWEEP[0] + _SWEEP[1] * (trial.location - 0.5), 0.0)
    return float(np.ceil(trial.lead + sweep / trial.speed + _RINGING))


@checked
def simulate_touches(antenna: Antenna, trials: Sequence[Trial], **how: Any) -> list[np.ndarray]:
    """Hinge angles (hinge, time) [rad] of each trial at 1 kHz.

    Durations differ, see :func:`_choose_duration`.

    ``how`` may hold ``duration`` [ms] or ``reach`` (see :func:`_choose_duration`) and,
    as for :func:`feeler.touch`, ``engine``, ``timestep``, ``workers``, ``executor``.
    """
    return simulate_pairs([(antenna, trial) for trial in trials], **how)


@checked
def simulate_pairs(
    pairs: Sequence[tuple[Antenna, Trial]],
    *,
    duration: float | None = None,
    reach: float = 1.0,
    timestep: float | None = None,
    engine: str = DEFAULT_ENGINE,
    workers: int | None = None,
    executor: Executor | None = None,
) -> list[np.ndarray]:
    """As :func:`simulate_touches`, each trial with an antenna of its own.

    Touches of like durations run together.

    Raises
    ------
    SimulationDivergedError
        The first touch that left the finite numbers.
    """
    from feeler.physics.run import expect_motions, simulate
    from feeler.physics.scene import Clock, make_scene

    durations = [duration or _choose_duration(trial, reach) for _, trial in pairs]
    motions: list[np.ndarray] = [np.empty(0)] * len(pairs)
    for group in _group(durations):
        scenes = [make_scene(*pairs[i]) for i in group]
        step = choose_timestep(timestep, engine, *(scene.contact for scene in scenes))
        clock = Clock(
            duration=max(durations[i] for i in group), sample_interval=INTERVAL, timestep=step
        )
        results = simulate(scenes, clock, engine=engine, workers=workers, executor=executor)
        for i, motion in zip(group, expect_motions(results), strict=True):
            motions[i] = np.ascontiguousarray(motion.angle[: round(durations[i] / INTERVAL)].T)
    return motions


def _group(durations: Sequence[float]) -> list[list[int]]:
    """Numbers of the touches whose durations are alike enough to share a clock."""
    groups: list[list[int]] = []
    for i in np.argsort(durations, kind="stable"):
        if groups and durations[i] <= _ALIKE * durations[groups[-1][0]]:
            groups[-1].append(int(i))
        else:
            groups.append([int(i)])
    return groups


@checked
def list_lengths(antenna: Antenna) -> np.ndarray:
    """Lengths (sensor,) [mm] of an antenna from each sensor to the next, of the last to the tip."""
    return np.add.reduceat(antenna.segment_length, antenna.sensors - 1)


@checked
def compute_tip(antenna: Antenna, angle: Annotated[np.ndarray, "... hinge time"]) -> np.ndarray:
    """Tip's sideways position (…, time) [mm] from hinge angles (…, hinge, time).

    Touches are aligned on it.

    Angles of the sensed hinges alone count the others as straight.
    """
    length = antenna.segment_length
    if np.shape(angle)[-2:-1] == (antenna.sensors.size,):
        length = list_lengths(antenna)
    elif np.shape(angle)[-2:-1] != (antenna.n_segments,):
        raise InvalidInput(
            f"angle needs the {antenna.n_segments} hinges of the antenna, or its"
            f" {antenna.sensors.size} sensors, as (…, hinge, time), got shape {np.shape(angle)}."
        )
    heading = np.cumsum(np.nan_to_num(angle), axis=-2)
    return np.einsum("n,...nt->...t", length, np.sin(heading))
