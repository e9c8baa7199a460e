"""Files dropped on the page: an antenna file, or a recording of one's own."""

import tempfile
from pathlib import Path
from typing import Any

import numpy as np

from feeler.antenna.antenna import Antenna
from feeler.antenna.parse import parse_antenna
from feeler.errors import InvalidInput
from feeler.presets import make_preset
from feeler.robot import load_recording, make_dataset, repair
from feeler.studio.catalogue import describe_original
from feeler.studio.touching import describe_antenna, find_sensed
from feeler.studio.wish import AntennaWish
from feeler.tensors.posture import reconstruct_posture

MAX_TEXT = 6 * 2**20  # [C] characters


def open_text(message: dict[str, Any]) -> tuple[dict[str, Any], dict[str, np.ndarray]]:
    """What a dropped file holds: header and arrays of the answer."""
    name, text = message.get("name"), message.get("text")
    if not isinstance(name, str) or not isinstance(text, str) or len(name) > 200 or len(text) > MAX_TEXT:
        raise InvalidInput(f"a file needs a name and a text of at most {MAX_TEXT:,} characters.")
    if name.lower().endswith(".toml"):
        antenna = parse_antenna(text, name).antenna
        wish = AntennaWish(toml=text, name=antenna.name)
        return {"what": "antenna", "antenna": wish.to_plain(), "original": describe_original(antenna)}, {}
    if name.lower().endswith(".csv"):
        return open_recording(name, text, AntennaWish.read(message.get("antenna", {})).make())
    raise InvalidInput(f"{name[-40:]!r} is neither an antenna (.toml) nor a recording (.csv).")


def open_recording(name: str, text: str, antenna: Antenna) -> tuple[dict[str, Any], dict[str, np.ndarray]]:
    """A recording (time and hinge angles) as readings; postures between sensors are interpolated."""
    with tempfile.TemporaryDirectory(prefix="feeler-studio-") as folder:
        path = Path(folder) / "recording.csv"
        path.write_text(text, encoding="utf-8", errors="replace")
        recording = load_recording(path, n_channels=None)
    if recording.quantity != "angle":
        raise InvalidInput(
            f"{name} holds capacitance; convert it first: feeler robot calibrate, then feeler robot convert."
        )
    robot = make_preset("robot")
    fitting = next((a for a in (antenna, robot) if find_sensed(a).size == recording.n_sensors), None)
    if fitting is None:
        raise InvalidInput(
            f"{name} has {recording.n_sensors} channels, but the antenna {antenna.name!r} has {find_sensed(antenna).size} "
            f"sensors (and the robot {find_sensed(robot).size}). Set the number of sensors, or open the antenna's own file first."
        )
    tensors = make_dataset([repair(recording, gaps="bridge")], fitting)
    points = reconstruct_posture(tensors, fitting).values[0]
    step = np.diff(points, axis=1)
    heading = np.unwrap(np.arctan2(step[..., 0], step[..., 1]), axis=1)
    header = {"what": "recording", "name": name, "antenna": describe_antenna(fitting), "rims": [], "preview": False,
              "interval": float(tensors["time"][1] - tensors["time"][0]), "source": recording.source,
              "total": len(heading), "history": list(recording.history)}  # fmt: skip
    return header, {"angle": np.diff(heading, axis=1, prepend=0.0), "base": np.zeros((len(heading), 3))}
