"""A sensor calibration on disk: JSON that people read too, nothing in it is ever executed."""

import json
import os
from pathlib import Path

import numpy as np

from feeler.disk.files import parse_json, read_bytes, writing
from feeler.disk.toml import make_record
from feeler.errors import InvalidInput
from feeler.records.checked import checked
from feeler.robot.sensor import SensorCalibration

_FORMAT = "feeler sensor calibration"
_VERSION = 1
_MAX_FILE = 2**20


@checked
def save_calibration(calibration: SensorCalibration, path: str | os.PathLike) -> None:
    """Write the lines as JSON: readable, versioned, nothing in it is ever executed."""
    plain = calibration.to_plain()
    robot, unit = plain.pop("robot"), plain.pop("unit")
    content = {"format": _FORMAT, "version": _VERSION, "robot": robot, "unit": unit}
    for name, values in plain.items():
        content[name] = [None if np.isnan(value) else value for value in values]
    with writing(path) as part:
        part.write_text(json.dumps(content, indent=1) + "\n", encoding="utf-8")


@checked
def load_calibration(path: str | os.PathLike) -> SensorCalibration:
    """Read what :func:`save_calibration` wrote.

    Raises
    ------
    InvalidInput
        Not such a file, another version, or damaged content.
    """
    try:
        content = parse_json(read_bytes(path, _MAX_FILE), os.fspath(path))
    except InvalidInput as error:
        advice = "`feeler robot calibrate` makes a calibration from a table."
        raise InvalidInput(f"{error} {advice}") from error
    if content.pop("format", None) != _FORMAT:
        raise InvalidInput(
            f"{path} is no sensor calibration of feeler. Make one with `feeler robot calibrate`."
        )
    if (version := content.pop("version", None)) != _VERSION:
        raise InvalidInput(
            f"{path} has version {version!r}; this feeler reads version {_VERSION}."
        )
    return make_record(SensorCalibration, content, Path(path).name)
