"""A sensor calibration on disk: JSON that people read too, nothing in it is ever executed."""

import json
import os
from pathlib import Path

import numpy as np

from feeler.checked import checked
from feeler.errors import InvalidInput
from feeler.robot.sensor import MAX_HINGES, SensorCalibration

_FORMAT = "feeler sensor calibration"
_VERSION = 1
_MAX_FILE = 2**20
_FIELDS = (
    "slope",
    "offset",
    "low",
    "high",
    "residual",
    "cross_validated",
    "resolution",
    "drift",
    "r_squared",
)


@checked
def save_calibration(calibration: SensorCalibration, path: str | os.PathLike) -> None:
    """Write the lines as JSON: readable, versioned, nothing in it is ever executed."""
    content = {
        "format": _FORMAT,
        "version": _VERSION,
        "robot": calibration.robot,
        "unit": calibration.unit,
    }
    for name in _FIELDS:
        content[name] = [None if np.isnan(v) else float(v) for v in getattr(calibration, name)]
    Path(path).write_text(json.dumps(content, indent=1) + "\n", encoding="utf-8")


@checked
def load_calibration(path: str | os.PathLike) -> SensorCalibration:
    """Read what :func:`save_calibration` wrote.

    Raises
    ------
    InvalidInput
        Not such a file, another version, or damaged content.
    """
    content = _read_json(path)
    if content.get("format") != _FORMAT:
        raise InvalidInput(
            f"{path} is no sensor calibration of feeler. Make one with `feeler robot calibrate`."
        )
    if content.get("version") != _VERSION:
        raise InvalidInput(
            f"{path} has version {content.get('version')!r}; this feeler reads version {_VERSION}."
        )
    arrays = {name: _read_numbers(path, name, content.get(name)) for name in _FIELDS}
    sizes = {values.size for values in arrays.values()}
    if len(sizes) != 1 or not 1 <= sizes.copy().pop() <= MAX_HINGES:
        raise InvalidInput(f"{path} is damaged: its lists have different lengths.")
    for name in ("slope", "offset", "low", "high"):
        if not np.all(np.isfinite(arrays[name])):
            raise InvalidInput(f"{path} is damaged: {name} is missing for a hinge.")
    if np.any(arrays["low"] > arrays["high"]):
        raise InvalidInput(f"{path} is damaged: a calibrated range is empty (low > high).")
    robot, unit = str(content.get("robot", ""))[:200], str(content.get("unit", ""))[:20]
    return SensorCalibration(**arrays, robot=robot, unit=unit)


def _read_json(path: str | os.PathLike) -> dict:
    try:
        if not Path(path).is_file():
            raise InvalidInput(
                f"cannot read {path!s}: no such file. `feeler robot calibrate` makes a calibration."
            )
        if Path(path).stat().st_size > _MAX_FILE:
            raise InvalidInput(
                f"{path} is no sensor calibration: it has more than {_MAX_FILE:,} bytes."
            )
        content = json.loads(Path(path).read_text(encoding="utf-8"))
    except (OSError, ValueError, RecursionError) as error:
        if isinstance(error, InvalidInput):
            raise
        raise InvalidInput(
            f"cannot read {path!s} as JSON: {str(error)[:200]}. From a table `feeler robot"
            " calibrate` makes the calibration."
        ) from error
    if not isinstance(content, dict):
        raise InvalidInput(f"{path} is no sensor calibration of feeler: it holds no object.")
    return content


def _read_numbers(path: str | os.PathLike, name: str, values: object) -> np.ndarray:
    numeric = (int, float, type(None))
    if not isinstance(values, list) or not all(
        isinstance(v, numeric) and not isinstance(v, bool) for v in values
    ):
        raise InvalidInput(f"{path} is damaged: {name} must be a list of numbers.")
    try:
        return np.array([np.nan if v is None else float(v) for v in values])
    except OverflowError as error:
        raise InvalidInput(f"{path} is damaged: {name} holds a number out of range.") from error
