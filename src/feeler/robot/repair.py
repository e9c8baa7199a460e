"""Recordings repaired and turned into a Dataset."""

from collections.abc import Sequence
from importlib.metadata import version
from typing import Annotated

import numpy as np
import xarray as xr

from feeler.antenna import Antenna
from feeler.errors import InvalidInput
from feeler.records import Choice, Gt
from feeler.robot.description import INTERVAL, make_robot
from feeler.robot.recordings import Recording
from feeler.tensors import make_tensors, validate
from feeler.validation import checked

# Repair of recordings: bad channels named, gaps mended as asked, every change written down.

_MAX_GAP = 10.0  # [C] ms; a fast touch lasts about 100 ms
_MAX_SAMPLES = 2_000_000
_FLAT_RUN = (
    20  # [C] fewest samples in a row at the channel's extreme that count as saturation, …
)
_FLAT_SHARE = 0.1  # [C] … a tenth of the recording, …
_FLAT_LONG = 100  # [C] … or 100 in any case (hysteresis rests too), …
_FLAT_STEP = 8.0  # [C] … if the extreme lies this many noise sds from the median
_MOVES, _NOISE = 0.1, 0.5  # [C] of white noise's roughness: less is motion, more is noise alone


@checked
def _find_bad_channels(recording: Recording) -> dict[int, str]:
    """Channels not to be trusted: hinge number → why.

    They are empty, dead (never change) or saturated (stuck at an end).
    """
    bad = {}
    for number, values in enumerate(recording.values, 1):
        known = values[np.isfinite(values)]
        if known.size == 0:
            bad[number] = "empty (no value at all)"
        elif np.ptp(known) == 0:
            bad[number] = f"dead (always {known[0]:.4g})"
        elif (stuck := _count_saturated(known)) >= max(
            _FLAT_RUN, min(_FLAT_SHARE * known.size, _FLAT_LONG)
        ):
            bad[number] = f"saturated ({stuck} samples in a row at its extreme value)"
    return bad


def _count_saturated(values: np.ndarray) -> int:
    """Longest run at the minimum or maximum, where that lies far outside the noise; else 0."""
    noise = np.median(np.abs(np.diff(values))) / 0.6745 / np.sqrt(2)
    longest = 0
    for extreme in (values.min(), values.max()):
        if abs(extreme - np.median(values)) <= _FLAT_STEP * max(noise, 1e-6 * np.ptp(values)):
            continue
        edges = np.flatnonzero(
            np.diff(np.concatenate(([False], values == extreme, [False])).astype(int))
        )
        longest = max(longest, int((edges[1::2] - edges[::2]).max()))
    return longest


@checked
def repair(
    recording: Recording,
    *,
    interval: Annotated[float, Gt(0)] = INTERVAL,
    max_gap: float = _MAX_GAP,
    gaps: Annotated[str, Choice(("refuse", "bridge", "keep"))] = "refuse",
    bad_channels: Annotated[str, Choice(("refuse", "missing"))] = "refuse",
) -> Recording:
    """The recording on an even time base that starts at 0, with every change in its history.

    Parameters
    ----------
    interval
        Time between samples of the result [ms]; values are interpolated linearly where it differs
        from the recorded.
    max_gap
        Longest stretch without a sample that counts as recorded continuously [ms].
    gaps
        Longer stretches: ``refuse``; ``bridge`` them linearly all the same; ``keep`` them as NaN.
    bad_channels
        Empty, dead or saturated channels: ``refuse``, or make them ``missing`` (NaN).

    Raises
    ------
    InvalidInput
        Bad channels or gaps under ``refuse``, time that stands still or runs backwards, or a
        recording too long.
    """
    recording = _drop_bad(recording, bad_channels)
    time = _check_time(recording.time)
    count = int(np.floor((time[-1] - time[0]) / interval + 1e-9)) + 1
    if not 2 <= count <= _MAX_SAMPLES:
        raise InvalidInput(
            f"{time[-1] - time[0]:.4g} ms at {interval:g} ms are {count:,} samples; 2 to"
            f" {_MAX_SAMPLES:,} are possible. Is the time unit right? Otherwise cut the recording."
        )

    grid = np.arange(count) * interval
    words = [_describe_time(time, interval)]
    values = np.empty((recording.n_sensors, count))
    said: dict[str, list[str]] = {}
    for row, channel in enumerate(recording.values):
        values[row], found = _mend(time - time[0], channel, grid, max_gap, gaps, row + 1)
        for line in found:
            said.setdefault(line, []).append(str(row + 1))
    words += [f"hinge {', '.join(rows)}: {line}" for line, rows in said.items()]
    words += _name_noise(recording.values)
    beside = {
        name: np.array([_resample(time - time[0], row, grid) for row in found])
        for name in ("velocity", "effort")
        if (found := getattr(recording, name)) is not None
    }
    return recording.replace(
        time=grid, values=values, history=(*recording.history, *words), **beside
    )


def _resample(time: np.ndarray, values: np.ndarray, grid: np.ndarray) -> np.ndarray:
    """Values on another clock, by straight lines; NaN where there are none."""
    known = np.isfinite(values)
    return (
        np.interp(grid, time[known], values[known])
        if known.any()
        else np.full(grid.shape, np.nan)
    )


def _drop_bad(recording: Recording, bad_channels: str) -> Recording:
    bad = _find_bad_channels(recording)
    if not bad:
        return recording
    words = "; ".join(f"hinge {number} is {why}" for number, why in bad.items())
    if len(bad) == recording.n_sensors:
        raise InvalidInput(f"no channel is usable: {words}. Record again.")
    if bad_channels == "refuse":
        raise InvalidInput(
            f"bad channels: {words}. Record again, leave them out with bad_channels='missing', or"
            " describe the robot without these sensors."
        )
    values = recording.values.copy()
    values[[number - 1 for number in bad]] = np.nan
    return recording.replace(values=values).noted(f"made missing: {words}")


def _check_time(time: np.ndarray) -> np.ndarray:
    step = np.diff(time)
    if not np.all(np.isfinite(time)) or np.any(step < 0):
        place = int(np.argmax(~(step >= 0)))
        raise InvalidInput(
            f"time runs backwards after sample {place}. Sort or split the recording."
        )
    if np.any(step == 0):
        place = int(np.argmax(step == 0))
        raise InvalidInput(
            f"{int(np.sum(step == 0))} samples share their time with the one before, the first at"
            f" {time[place]:g} ms. Remove the doubles, or write times with more digits."
        )
    return time


def _describe_time(time: np.ndarray, interval: float) -> str:
    step = np.diff(time)
    typical = np.median(step)
    regular = step[step < 1.5 * typical]
    words = f"recorded every {typical:.4g} ms (jitter sd {regular.std():.2g} ms)"
    dropped = int(np.sum(np.round(step / typical) - 1))
    words += f", {dropped} samples dropped" if dropped else ", none dropped"
    same = np.isclose(typical, interval, rtol=0.02)
    return words + ("; time base evened" if same else f"; resampled to {interval:g} ms")


def _mend(
    time: np.ndarray,
    values: np.ndarray,
    grid: np.ndarray,
    max_gap: float,
    gaps: str,
    number: int,
) -> tuple[np.ndarray, list[str]]:
    known = np.isfinite(values)
    if not known.any():
        return np.full(grid.shape, np.nan), []
    stamps = time[known]
    steps = np.diff(np.concatenate(([time[0]], stamps, [time[-1]])))
    long = steps > max_gap * (1 + 1e-4)  # stamps are rounded
    if long.any() and gaps == "refuse":
        slow = np.median(np.diff(time)) > max_gap
        found = (
            f"is recorded every {np.median(np.diff(time)):.4g} ms, more slowly than every"
            f" {max_gap:g} ms: a fast touch may pass between two samples. Record faster, or set"
            if slow
            else f"has {int(long.sum())} gaps longer than {max_gap:g} ms, the longest"
            f" {steps.max():.4g} ms. Set"
        )
        raise InvalidInput(f"hinge {number} {found} gaps='bridge', which draws straight lines.")
    mended = np.interp(grid, stamps, values[known])
    said = []
    if long.any() and gaps == "keep":
        after = np.searchsorted(
            stamps, grid - 1e-9
        )  # index of the step that each grid time lies in
        inside = long[np.minimum(after, steps.size - 1)]
        exact = np.isin(np.round(grid, 6), np.round(stamps, 6))
        mended[inside & ~exact] = np.nan
    if long.any():
        done = "kept" if gaps == "keep" else "bridged"
        said.append(f"{int(long.sum())} gaps over {max_gap:g} ms, {done}")
    if not known.all():
        said.append(f"{int((~known).sum())} missing values")
    return mended, said


def _name_noise(values: np.ndarray) -> list[str]:
    """Channels that hold noise alone while one further out moves, which a touch cannot do; by the
    mean square of their steps over twice their variance: 1 for white noise.
    """
    rough = np.full(len(values), np.nan)
    for row, channel in enumerate(values):
        known = channel[np.isfinite(channel)]
        if known.size > 1 and np.ptp(known) > 0:
            rough[row] = np.mean(np.diff(known) ** 2) / (2 * np.var(known))
    last = max(np.flatnonzero(rough < _MOVES), default=-1)
    still = ", ".join(map(str, np.flatnonzero(rough[: last + 1] > _NOISE) + 1))
    return (
        [f"hinge {still}: noise alone, while hinge {last + 1} moves: broken?"] if still else []
    )


# Recordings as the same Dataset that simulations give.

_NO_SEED = -1


@checked
def make_dataset(
    recordings: Sequence[Recording],
    antenna: Antenna | None = None,
    *,
    lengths: Annotated[str, Choice(("refuse", "crop", "hold"))] = "refuse",
) -> xr.Dataset:
    """Tactile tensors from repaired angle recordings, through the same door as simulations.

    ``tip`` follows from the angles and the antenna's lengths where every hinge is sensed. Sensors
    that have no value in one of the recordings are left out of the set. What a recording does not
    say about its touch is NaN or an empty word; its seed is −1.

    Parameters
    ----------
    recordings
        Hinge angles on an even time base (see :func:`feeler.robot.repair`), as many channels as
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
    there = np.ones(antenna.sensors.size, dtype=bool)
    for recording in recordings:
        if recording.n_sensors == there.size:
            there &= np.isfinite(recording.values).any(axis=1)
    if not there.all() and there.any():
        antenna = antenna.replace(sensors=antenna.sensors[there])
        recordings = [_keep_sensors(recording, there) for recording in recordings]
    interval = _check(recordings, antenna)
    counts = [recording.time.size for recording in recordings]
    if len(set(counts)) > 1 and lengths == "refuse":
        raise InvalidInput(
            f"the recordings have {min(counts)} to {max(counts)} samples; a set has one length. "
            "Choose lengths='crop' or 'hold'."
        )
    samples = max(counts) if lengths == "hold" else min(counts)
    angle = np.stack(
        [r.values[:, np.minimum(np.arange(samples), r.time.size - 1)] for r in recordings]
    )
    index = antenna.sensors - 1
    whole = antenna.sensors.size == antenna.n_segments
    labels = [recording.labels for recording in recordings]
    numbers = {
        name: [float(label.get(name, np.nan)) for label in labels]
        for name in ("size", "location", "speed")
    }
    dataset = make_tensors(
        angle=angle,
        time=np.arange(angle.shape[2]) * interval,
        segment=antenna.sensors,
        position=antenna.hinge_position[index] / antenna.length,
        segment_length=antenna.segment_length[index],
        trials={
            "feature": [str(label.get("feature", "")) for label in labels],
            **numbers,
            "antenna": [recording.robot or antenna.name for recording in recordings],
            "source": [recording.source for recording in recordings],
            "seed": [_NO_SEED] * len(recordings),
        },
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


def _keep_sensors(recording: Recording, there: np.ndarray) -> Recording:
    """The same recording with these of its sensors, where it has as many."""
    if recording.n_sensors != there.size:
        return recording
    names = ("values", "velocity", "effort")
    found = {
        name: values[there]
        for name in names
        if (values := getattr(recording, name)) is not None
    }
    gone = ", ".join(map(str, np.flatnonzero(~there) + 1))
    return recording.replace(**found).noted(f"left out, having no value: sensor {gone}")


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
