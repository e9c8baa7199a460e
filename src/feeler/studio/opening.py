"""Files dropped on the page: an antenna file, a recording of one's own, or the calibration of its
sensors.
"""

import re
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from feeler.antenna.antenna import Antenna
from feeler.antenna.parse import parse_antenna
from feeler.disk.files import temporary_folder
from feeler.errors import InvalidInput
from feeler.presets import make_preset
from feeler.robot import SensorCalibration, load_calibration, load_recording, repair
from feeler.studio.catalogue import describe_original
from feeler.studio.listener import Judge
from feeler.studio.study import AntennaStudy
from feeler.studio.touching import describe_antenna
from feeler.studio.wish import AntennaWish
from feeler.tensors.posture import spread_angles

_MAX_TEXT = 6 * 2**20  # [C] characters
_NAME = re.compile(r"\w[\w .()+-]{0,80}")  # what messages may call a file
_MAX_SHOWN = 8000  # [C] samples; of longer recordings every second, third … is shown


def open_text(
    message: dict[str, Any],
    calibration: SensorCalibration | None,
    find: Callable[[Antenna], AntennaStudy | None],
) -> tuple[dict[str, Any], dict[str, np.ndarray]]:
    """What a dropped antenna or recording holds: header and arrays of the answer."""
    name, text = read_file(message)
    if name.lower().endswith(".toml"):
        antenna = parse_antenna(text, name).antenna
        wish = AntennaWish(toml=text, name=antenna.name)
        return {
            "what": "antenna",
            "antenna": wish.to_plain(),
            "original": describe_original(antenna),
        }, {}
    if name.lower().endswith(".csv"):
        return _open_recording(
            name,
            text,
            AntennaWish.from_plain(message.get("antenna", {})).make(),
            calibration,
            find,
        )
    raise InvalidInput(
        f"{name[-40:]!r} is neither an antenna (.toml), a recording (.csv) nor a calibration"
        " (.json)."
    )


def read_file(message: dict[str, Any]) -> tuple[str, str]:
    """Name and text of a file in a message."""
    name, text = message.get("name"), message.get("text")
    if (
        not isinstance(name, str)
        or not isinstance(text, str)
        or len(name) > 200
        or len(text) > _MAX_TEXT
    ):
        raise InvalidInput(
            f"a file needs a name and a text of at most {_MAX_TEXT:,} characters."
        )
    return name, text


def open_calibration(name: str, text: str) -> SensorCalibration:
    """The calibration of a robot's sensors."""
    with _as_file(name, text) as path:
        return load_calibration(path)


def _open_recording(
    name: str,
    text: str,
    antenna: Antenna,
    calibration: SensorCalibration | None,
    find: Callable[[Antenna], AntennaStudy | None],
) -> tuple[dict[str, Any], dict[str, np.ndarray]]:
    """A recording (time and hinge angles) as readings; angles between sensors are interpolated.

    ``find`` gives the study of an antenna, if there is one; its decoder then judges the recording.
    """
    with _as_file(name, text) as path:
        recording = load_recording(path, n_channels=None)
    if recording.quantity != "angle":
        if calibration is None:
            raise InvalidInput(
                f"{name} holds {recording.quantity}. Open the sensors' calibration first (.json,"
                " made by feeler robot calibrate)."
            )
        recording = recording.to_angles(calibration, outside="extend")
    robot = make_preset("robot")
    fitting = next((a for a in (antenna, robot) if a.sensors.size == recording.n_sensors), None)
    if fitting is None:
        raise InvalidInput(
            f"{name} has {recording.n_sensors} channels, but the antenna {antenna.name!r} has"
            f" {antenna.sensors.size} sensors (and the robot {robot.sensors.size}). Set"
            " the number of sensors, or open the antenna's own file first."
        )
    rate = 1e3 / float(
        np.median(np.diff(recording.time))
    )  # its own; what is shown is resampled
    recording = repair(recording, gaps="bridge")
    angle, interval = recording.values.T, float(recording.time[1] - recording.time[0])
    every = -(-len(angle) // _MAX_SHOWN)
    shown = angle[::every]
    header = {
        "what": "recording",
        "name": name,
        "antenna": describe_antenna(fitting),
        "rims": [],
        "preview": False,
        "interval": interval * every,
        "rate": rate,
        "source": recording.source,
        "total": len(shown),
        "robot": fitting is not antenna,
    }
    arrays = {
        "angle": spread_angles(shown, fitting, fitting.sensors - 1),
        "base": np.zeros((len(shown), 3)),
    }
    if (known := find(fitting)) is not None:
        judge = Judge(known, interval)
        beliefs, noticed = zip(*map(judge.update, angle, recording.time), strict=True)
        header["contact"] = int(np.argmax(noticed)) // every if any(noticed) else -1
        arrays["posterior"] = np.array(beliefs[::every])
    return header, arrays


@contextmanager
def _as_file(name: str, text: str) -> Iterator[Path]:
    """A text as a file, which is how recordings and calibrations are read."""
    with temporary_folder() as folder:
        path = folder / (name if _NAME.fullmatch(name) else f"dropped{Path(name).suffix}")
        path.write_text(text, encoding="utf-8", errors="replace")
        yield path
