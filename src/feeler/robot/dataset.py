"""Recordings as the same Dataset that simulations give."""

import json
from collections.abc import Sequence
from importlib.metadata import version

import numpy as np
import xarray as xr

from feeler.antenna import Antenna
from feeler.errors import InvalidInput
from feeler.robot.preset import make_robot
from feeler.robot.recording import Recording
from feeler.robot.repair import INTERVAL


def make_dataset(recordings: Sequence[Recording], antenna: Antenna | None = None) -> xr.Dataset:
    """Tactile tensors from repaired angle recordings: dims (trial, sensor, time), coordinates as simulations have them.

    Shorter recordings are padded with NaN at their ends. ``tip`` follows from the angles and the antenna's lengths;
    ``curvature`` is angle / segment length. What a recording does not say about its touch is NaN or an empty word.

    Parameters
    ----------
    recordings
        Hinge angles on an even time base (see :func:`feeler.robot.repair`), as many sensors as the antenna has.
    antenna
        The model whose lengths and sensor places apply; default :func:`make_robot`.

    Raises
    ------
    InvalidInput
        No recording, capacitance, the wrong number of channels, an uneven time base, or different intervals.
    """
    antenna = make_robot() if antenna is None else antenna
    interval = _check(recordings, antenna)
    samples = max(recording.time.size for recording in recordings)
    n = antenna.sensors.size
    angle = np.full((len(recordings), n, samples), np.nan)
    for k, recording in enumerate(recordings):
        angle[k, :, : recording.time.size] = recording.values
    lengths = antenna.segment_length[antenna.sensors - 1]
    data = {
        "angle": (("trial", "sensor", "time"), angle, {"units": "rad"}),
        "curvature": (("trial", "sensor", "time"), angle / lengths[:, None], {"units": "1/mm"}),
    }
    if n == antenna.n_segments:  # every hinge is sensed, so the shape is known
        data["tip"] = (("trial", "time", "axis"), antenna.shape(angle.transpose(0, 2, 1))[:, :, -1], {"units": "mm"})
    return xr.Dataset(data, coords=_make_coords(recordings, antenna, samples, interval), attrs=_make_attrs(recordings))


def _check(recordings: Sequence[Recording], antenna: Antenna) -> float:
    if not recordings:
        raise InvalidInput("make_dataset needs at least one recording, got none.")
    for k, recording in enumerate(recordings):
        step = np.diff(recording.time)
        if recording.quantity != "angle":
            raise InvalidInput(f"recording {k} holds capacitance; turn it into angles with a sensor calibration first.")
        if recording.n_sensors != antenna.sensors.size:
            raise InvalidInput(
                f"recording {k} has {recording.n_sensors} channels, the antenna {antenna.sensors.size} sensors."
            )
        if recording.time[0] != 0 or np.ptp(step) > 1e-6 * step.mean():
            raise InvalidInput(f"recording {k} has an uneven time base, or one that does not start at 0: repair it first.")
    intervals = {round(float(recording.time[1]), 9) for recording in recordings}
    if len(intervals) > 1:
        raise InvalidInput(
            f"recordings with different intervals ({', '.join(f'{i:g}' for i in sorted(intervals))} ms) cannot be put in "
            f"one set: repair them all with interval={INTERVAL:g}."
        )
    return intervals.pop()


def _make_coords(recordings: Sequence[Recording], antenna: Antenna, samples: int, interval: float) -> dict:
    hinge = antenna.sensors
    labels = [recording.labels for recording in recordings]
    numbers = {name: np.array([float(label.get(name, np.nan)) for label in labels]) for name in ("size", "location", "speed")}
    return {
        "time": ("time", np.arange(samples) * interval, {"units": "ms"}),
        "sensor": ("sensor", np.arange(hinge.size)),
        "position": ("sensor", antenna.hinge_position[hinge - 1] / antenna.length),
        "segment": ("sensor", np.asarray(hinge)),
        "axis": ("axis", np.array(["x", "y"])),
        "trial": ("trial", np.arange(len(recordings))),
        "feature": ("trial", np.array([str(label.get("feature", "")) for label in labels])),
        "size": ("trial", numbers["size"], {"units": "mm"}),
        "location": ("trial", numbers["location"]),
        "speed": ("trial", numbers["speed"], {"units": "mm/ms"}),
        "antenna": ("trial", np.array([recording.robot or antenna.name for recording in recordings])),
        "source": ("trial", np.array([recording.source for recording in recordings])),
        "seed": ("trial", np.full(len(recordings), -1)),
    }


def _make_attrs(recordings: Sequence[Recording]) -> dict:
    histories = [list(recording.history) for recording in recordings]
    return {
        "configuration": json.dumps({"histories": histories}, ensure_ascii=False),
        "engine": "none (recorded)",
        "versions": json.dumps({"feeler": version("feeler")}),
        "timestep": float("nan"),
        "units": "g, mm, ms",
    }
