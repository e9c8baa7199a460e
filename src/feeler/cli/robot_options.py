"""What the options of ``feeler robot`` mean: the robot with its recordings, and the touches to
discriminate.
"""

from pathlib import Path
from typing import Annotated, Any

import typer

from feeler.errors import InvalidInput
from feeler.progress import ProgressBar

Files = Annotated[
    list[Path],
    typer.Argument(
        help="CSV: time_ms, hinge1_pF, hinge2_pF … (or _deg, _rad), or ROS 2: MCAP:TOPIC"
    ),
]
Calibration = Annotated[
    Path | None, typer.Option(help="sensor calibration (JSON), for capacitance")
]
JointNames = Annotated[
    str | None,
    typer.Option(
        "--joints",
        help="channels of the robot in a topic or table that has others: names or patterns with"
        " commas between, base to tip, as in 'antenna_joint_*'",
    ),
]
BadChannels = Annotated[
    str,
    typer.Option(
        "--bad-channels",
        help="channels that are absent, empty, dead or saturated: refuse, or missing",
    ),
]
AntennaName = Annotated[
    str,
    typer.Option("--antenna", help="robot file (feeler robot new), antenna TOML, or preset"),
]
Objects = Annotated[
    Path | None,
    typer.Option(help="TOML with a table [[object]] each; default: ball and box of 4 mm"),
]
Numbers = Annotated[
    str | None,
    typer.Option(help="places of the touches to discriminate: 0.5,0.9 (share of the length)"),
]
Speeds = Annotated[
    str | None, typer.Option(help="speeds of the touches to discriminate [m/s]: 0.027,0.27")
]
Out = Annotated[
    Path | None,
    typer.Option(help="folder for a page (HTML), its figure and its numbers (JSON)"),
]
ChannelUnit = Annotated[
    str | None,
    typer.Option("--unit", help="unit of the channels, if the file names none: deg, mV …"),
]
TimeUnit = Annotated[
    str | None, typer.Option(help="unit of the times, if the file names none: ms, s, us, ns")
]
Outside = Annotated[
    str,
    typer.Option(help="readings outside the calibrated range: refuse, clip, missing, extend"),
]
Engine = Annotated[
    str | None, typer.Option(help="simulator of the touches: chain-consistent, chain or mujoco")
]
Timestep = Annotated[
    float | None,
    typer.Option(help="timestep of the simulation [ms]; default: the engine's own"),
]
Workers = Annotated[int | None, typer.Option(help="threads; default one per core")]
Gaps = Annotated[
    str,
    typer.Option(help="gaps longer than 10 ms: refuse, or bridge by a line"),
]


DecoderFile = Annotated[
    Path | None,
    typer.Option("--decoder", help="decoder to answer with, made by feeler robot train"),
]


def list_given(**options: Any) -> dict[str, Any]:
    """What was said on the command line."""
    return {name: value for name, value in options.items() if value is not None}


class Robot:
    """What --antenna says: the antenna, and of a robot file also its calibration and joints."""

    def __init__(self, name: str, joints: str | None = None) -> None:
        from feeler.cli.choose import choose_antenna
        from feeler.robot.description import is_robot_file, load_robot

        file = load_robot(name) if is_robot_file(name) else None
        self.antenna = file.antenna if file else choose_antenna(name)
        self.named, self.name = (file.name, file.name) if file else ("", name)
        self.decoder: Any = None
        self.theory = file.theory if file else self.antenna
        self.calibration = file.calibration if file else None
        self.joints = tuple(filter(None, map(str.strip, (joints or "").split(",")))) or (
            file.sensors.joints if file else ()
        )

    def adopt(self, decoder: Any, named: bool) -> None:
        """Take antenna, calibration and joints of a decoder; ``named``: refuse it where this robot
        is another.
        """
        if named:
            decoder.check_antenna(self.antenna, self.name)
        self.antenna, self.decoder = decoder.antenna, decoder
        self.joints = self.joints or decoder.joints

    @property
    def channels(self) -> dict[str, Any]:
        """How many channels a recording of it has, and how they may be numbered or called."""
        sensors = self.antenna.sensors
        return {
            "n_channels": sensors.size,
            "hinges": tuple(sensors.tolist()),
            "joints": self.joints,
        }

    def load_lines(self, calibration: Path | None) -> Any:
        """The calibration of a file, else of the robot's, else of its decoder; None without. One of
        another number of channels is refused, one of another robot is said.
        """
        from feeler.robot import load_calibration

        path, n = calibration or self.calibration, self.antenna.sensors.size
        if path is None:
            return self.decoder.calibration if self.decoder else None
        lines = load_calibration(path)
        if lines.n_hinges != n:
            raise InvalidInput(
                f"the calibration is for {lines.n_hinges} hinges, the antenna has {n} sensors. Is"
                " the robot's file given (--antenna)?"
            )
        if self.decoder is not None:
            self.decoder.check_robot(lines.robot, path.name)
        elif self.named and lines.robot not in ("", self.named):
            typer.echo(
                f"the calibration is of robot {lines.robot!r}, the antenna is {self.named!r}",
                err=True,
            )
        return lines

    def load(self, path, lines: Any, outside: str, bad_channels: str, **units: Any) -> Any:
        """A recording as angles; ``lines`` are the sensors' calibration."""
        from feeler.cli.info import name_instead
        from feeler.robot import load_recording

        try:
            recording = load_recording(
                path, **self.channels, bad_channels=bad_channels, **units
            )
        except InvalidInput as error:
            raise name_instead(path, "recording") or error from None
        if self.decoder is not None:
            self.decoder.check_robot(recording.robot, Path(path).name)
        if recording.quantity == "angle":
            return recording
        if lines is None:
            raise InvalidInput(
                f"{path} holds {recording.quantity}: give --calibration, made by `feeler robot"
                " calibrate`."
            )
        return recording.to_angles(lines, outside=outside, bad_channels=bad_channels)

    def read(
        self, paths, calibration, outside, gaps, bad_channels: str = "refuse", **units: Any
    ) -> list:
        """Recordings as angles, repaired."""
        from feeler.robot import repair

        lines = self.load_lines(calibration)
        loaded = (self.load(path, lines, outside, bad_channels, **units) for path in paths)
        return [repair(one, gaps=gaps, bad_channels=bad_channels) for one in loaded]


def _make_touches(
    objects: Path | None,
    locations: str | None,
    speeds: str | None,
    friction: float | None = None,
) -> list:
    """The touches to discriminate: the paper's, but for what was said."""
    from feeler.objects import load_objects
    from feeler.robot.description import make_touches as make_robot_touches

    return make_robot_touches(
        **list_given(
            features=None if objects is None else load_objects(objects),
            locations=split_numbers("--locations", locations),
            speeds=split_numbers("--speeds", speeds),
            friction=friction,
        )
    )


def split_numbers(option: str, text: str | None, kind: type = float) -> tuple | None:
    """The numbers of an option such as ``--speeds 0.1,0.3``, each once; None where it was not
    given.
    """
    try:
        return None if text is None else tuple(dict.fromkeys(map(kind, text.split(","))))
    except ValueError:
        such = "0.1,0.3" if kind is float else "4,7"
        raise InvalidInput(
            f"{option} must be numbers with commas between, as in {such}; got {text!r}."
        ) from None


def say_progress(touches: list, robots: int) -> Any:
    """A bar, and before it a line on what is to be done."""
    half = (robots + 1) // 2
    typer.echo(
        f"training: {len(touches)} touches by {robots} surrogate robots, and of other objects by"
        f" {half}",
        err=True,
    )
    return ProgressBar("surrogate robots")


def choose_decoder(
    file: Path | None,
    robot: Robot,
    said: dict[str, Any],
    robots: int = 24,
    **how: Any,
) -> Any:
    """The decoder in a file; else one of the same recipe from the cache, or trained now and kept
    there. ``said`` are the options that belong to its training.
    """
    from feeler.robot.decoder import RobotDecoder, find_cached, keep_cached, train_decoder

    if file is not None:
        given = [f"--{name}" for name, value in {**said, **how}.items() if value is not None]
        given += ["--robots"] if robots != 24 else []
        if given:
            raise InvalidInput(
                f"{', '.join(given)} belongs to the training of {file}: leave it out, or train"
                " another decoder with it."
            )
        return RobotDecoder.load(file)
    touches = _make_touches(**said)
    kept = find_cached(robot.antenna, touches, robots=robots, **how)
    if kept.is_file():
        try:
            decoder = RobotDecoder.load(kept)
        except InvalidInput:  # of another version, or cut short: made anew
            decoder = None
        if decoder is not None:
            typer.echo(f"decoder trained before with these settings: {kept}", err=True)
            return decoder
    with say_progress(touches, robots) as progress:
        decoder = train_decoder(robot.antenna, touches, robots=robots, progress=progress, **how)
    if keep_cached(decoder, kept):
        typer.echo(f"kept for the next time: {kept}", err=True)
    return decoder
