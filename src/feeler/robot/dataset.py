"""Recordings as the same Dataset that simulations give."""

from collections.abc import Sequence
from importlib.metadata import version
from typing import Annotated

import numpy as np
import xarray as xr

from feeler.antenna import Antenna
from feeler.errors import InvalidInput
from feeler.records.checked import checked
from feeler.records.record import OneOf
from feeler.robot.preset import make_robot
from feeler.robot.recording import Recording
from feeler.robot.touches import INTERVAL
from feeler.tensors import make_tensors, validate

_NO_SEED = -1


@checked
def make_dataset(
    recordings: Sequence[Recording],
    antenna: Antenna | None = None,
    *,
    lengths: Annotated[str, OneOf(("refuse", "crop", "hold"))] = "refuse",
) -> xr.Dataset:
    """Tactile tensors from repaired angle recordings, through the same door as simulations.

    ``tip`` follows from the angles and the antenna's lengths where every hinge is sensed. What a
    recording does not say about its touch is NaN or an empty word; its seed is −1.

    Parameters
    ----------
    recordings
        Hinge angles on an even time base (see :func:`feeler.robot.mending`), as many channels as
        the antenna's sensors.
    antenna
        The model whose lengths and sensor places apply; default :func:`make_robot`.
    lengths
        Recordings of different durations: ``refuse``, ``crop`` all to the shortest, or ``hold``
        each one's last sample.

    Raises
    ------
    InvalidInput
        No recording, capacitance, missing values, the wrong number of channels, an uneven time
        base, different intervals or durations.
    """
    antenna = make_robot() if antenna is None else antenna
    interval = _check(recordings, antenna)
    angle = _stack(recordings, lengths)
    index = antenna.sensors - 1
    whole = antenna.sensors.size == antenna.n_segments
    dataset = make_tensors(
        angle=angle,
        time=np.arange(angle.shape[2]) * interval,
        segment=antenna.sensors,
        position=antenna.hinge_position[index] / antenna.length,
        segment_length=antenna.segment_length[index],
        trials=_list_trials(recordings, antenna),
        tip=antenna.tip(angle.transpose(0, 2, 1)) if whole else None,
        attrs={
            "configuration": {
                "histories": [list(recording.history) for recording in recordings],
                "lengths": lengths,
            },
            "engine": "none (recorded)",
            "versions": {"feeler": version("feeler")},
            "timestep": interval,
            "timestep_units": "ms",
        },
    )
    return validate(dataset)


def _stack(recordings: Sequence[Recording], lengths: str) -> np.ndarray:
    counts = [recording.time.size for recording in recordings]
    if len(set(counts)) > 1 and lengths == "refuse":
        raise InvalidInput(
            f"the recordings have {min(counts)} to {max(counts)} samples; a set has one length. "
            "Choose lengths='crop' or 'hold'."
        )
    samples = max(counts) if lengths == "hold" else min(counts)
    return np.stack(
        [r.values[:, np.minimum(np.arange(samples), r.time.size - 1)] for r in recordings]
    )


def _check(recordings: Sequence[Recording], antenna: Antenna) -> float:
    if not recordings:
        raise InvalidInput("make_dataset needs at least one recording, got none.")
    for k, recording in enumerate(recordings):
        step = np.diff(recording.time)
        if recording.quantity != "angle":
            raise InvalidInput(
                f"recording {k} holds {recording.quantity}; turn it into angles with a sensor"
                " calibration first."
            )
        if recording.n_sensors != antenna.sensors.size:
            raise InvalidInput(
                f"recording {k} has {recording.n_sensors} channels, the antenna"
                f" {antenna.sensors.size} sensors."
            )
        if not np.isfinite(recording.values).all():
            raise InvalidInput(
                f"recording {k} has missing values, which a set of tactile tensors cannot have:"
                " bridge its gaps, or leave out the recording."
            )
        if recording.time[0] != 0 or np.ptp(step) > 1e-6 * step.mean():
            raise InvalidInput(
                f"recording {k} has an uneven time base or does not start at 0: repair it first."
            )
    intervals = {round(float(recording.time[1]), 9) for recording in recordings}
    if len(intervals) > 1:
        raise InvalidInput(
            f"recordings every {', '.join(f'{i:g}' for i in sorted(intervals))} ms cannot be one"
            f" set: repair them all with interval={INTERVAL:g}."
        )
    return intervals.pop()


def _list_trials(recordings: Sequence[Recording], antenna: Antenna) -> dict[str, list]:
    labels = [recording.labels for recording in recordings]
    numbers = {
        name: [float(label.get(name, np.nan)) for label in labels]
        for name in ("size", "location", "speed")
    }
    return {
        "feature": [str(label.get("feature", "")) for label in labels],
        **numbers,
        "antenna": [recording.robot or antenna.name for recording in recordings],
        "source": [recording.source for recording in recordings],
        "seed": [_NO_SEED] * len(recordings),
    }
