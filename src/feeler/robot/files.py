"""What ``feeler info`` says of a robot's files."""

import re
from pathlib import Path
from typing import Any

from feeler.disk.guard import Limits
from feeler.robot.description import RobotFile, is_robot_file, load_robot
from feeler.robot.recording import N_CHANNELS, Recording, load_recording
from feeler.robot.sensor import SensorCalibration, load_calibration_table
from feeler.robot.sensor_file import load_calibration
from feeler.stimulus import load_objects
from feeler.tensors.bags import describe_bag, find_bag
from feeler.tensors.formats import Format

_TIME = re.compile(
    rb"(?im)(?:^|[,;\t])[\"\s#]*(?:__|%)?(?:time|t|time[ _-]?stamp|elapsed|millis|micros|seconds)"
    rb"(?:[\s_(\[]*[nmu\xb5\xc2]*s[)\]]?)?[\"\s]*(?:[,;\t ]|$)"
)


def _read(path: Path, limits: Limits, trusted: bool) -> list[str]:
    """What is said of a recording; of a bag whose topic is not named, what it holds."""
    bag = find_bag(path)
    if bag is not None and not bag[1]:
        return describe_bag(bag[0])
    recording = load_recording(path, n_channels=None)
    return [*_describe_recording(recording), f"next        {_suggest(path, recording)}"]


def _suggest(path: Path, recording: Recording) -> str:
    """The command that looks for faults, with the files that it needs."""
    words = ["feeler robot check", path.name]
    if recording.n_sensors != N_CHANNELS:
        words.append("--antenna robot.toml")
    if recording.quantity != "angle":
        words.append("--calibration calibration.json")
    return " ".join(words)


def _describe_recording(recording: Recording) -> list[str]:
    labels = ", ".join(f"{name} {value}" for name, value in recording.labels.items())
    return [
        f"channels    {recording.n_sensors}, {recording.quantity} [{recording.unit}]",
        f"samples     {recording.time.size} over {recording.time[-1] - recording.time[0]:g} ms",
        f"source      {recording.source}",
        f"robot       {recording.robot or 'not said'}",
        f"labels      {labels or 'none'}",
        *(f"history     {words}" for words in recording.history),
    ]


def _describe_calibration(lines: SensorCalibration) -> list[str]:
    return [
        f"robot       {lines.robot or 'not said'}",
        f"hinges      {lines.n_hinges}, readings in {lines.unit}",
        *(f"            {row}" for row in lines.report().splitlines()),
    ]


def _describe_objects(objects: list[Any]) -> list[str]:
    return [f"object      {item.name}: {item.kind}, size {item.size:g} mm" for item in objects]


def _describe_robot(robot: RobotFile) -> list[str]:
    antenna = robot.antenna
    return [
        f"name        {antenna.name}",
        f"hinges      {antenna.n_segments}, {antenna.length:g} mm",
        f"stiffness   {antenna.stiffness[0]:g} (base) … {antenna.stiffness[-1]:g} (tip) N·mm/rad",
        f"damping     {antenna.damping[0]:g} (base) … {antenna.damping[-1]:g} (tip) N·mm·ms/rad",
        f"calibration {robot.calibration or 'none'}",
    ]


ROBOT_FILES = {
    "robot": Format(
        words="robot (TOML)",
        kind="robot",
        detect=lambda path, start: is_robot_file(path),
        load=lambda path, limits, trusted: load_robot(path),
        tell=_describe_robot,
    ),
    "bench": Format(
        words="readings of a robot's sensors at known angles",
        kind="bench",
        detect=lambda path, start: b"hinge," in start and b"angle_" in start,
        load=lambda path, limits, trusted: load_calibration_table(path),
        tell=_describe_calibration,
    ),
    "calibration": Format(
        words="calibration of a robot's sensors (JSON)",
        kind="calibration",
        detect=lambda path, start: b'"feeler sensor calibration"' in start,
        load=lambda path, limits, trusted: load_calibration(path),
        tell=_describe_calibration,
    ),
    "objects": Format(
        words="objects to touch (TOML)",
        kind="objects",
        detect=lambda path, start: b"[[object]]" in start,
        load=lambda path, limits, trusted: load_objects(path),
        tell=_describe_objects,
    ),
    "recording": Format(
        words="recording of a robot",
        kind="recording",
        detect=lambda path, start: (
            find_bag(path) is not None or _TIME.search(start) is not None
        ),
        load=_read,
        tell=list,
    ),
}
