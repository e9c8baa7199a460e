"""Repair of recordings: bad channels named, gaps mended as asked, every change written down."""

from typing import Annotated

import numpy as np

from feeler.errors import InvalidInput
from feeler.records.checked import checked
from feeler.records.record import OneOf
from feeler.robot.recording import Recording
from feeler.robot.touches import INTERVAL

_MAX_GAP = 10.0  # [C] ms; a fast touch lasts about 100 ms
_MAX_SAMPLES = 2_000_000
_FLAT_RUN = (
    20  # [C] fewest samples in a row at the channel's extreme that count as saturation, …
)
_FLAT_SHARE = 0.1  # [C] … a tenth of the recording, …
_FLAT_LONG = 100  # [C] … or 100 in any case (hysteresis rests too), …
_FLAT_STEP = 8.0  # [C] … if the extreme lies this many noise sds from the median


@checked
def find_bad_channels(recording: Recording) -> dict[int, str]:
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
    interval: Annotated[float, "> 0"] = INTERVAL,
    max_gap: float = _MAX_GAP,
    gaps: Annotated[str, OneOf(("refuse", "bridge", "keep"))] = "refuse",
    bad_channels: Annotated[str, OneOf(("refuse", "missing"))] = "refuse",
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
    count = _check_length(time, interval)
    grid = np.arange(count) * interval
    words = [_describe_time(time, interval)]
    values = np.empty((recording.n_sensors, count))
    for row, channel in enumerate(recording.values):
        values[row], said = _mend(time - time[0], channel, grid, max_gap, gaps, row + 1)
        words += said
    return recording.replace(time=grid, values=values, history=(*recording.history, *words))


def _drop_bad(recording: Recording, bad_channels: str) -> Recording:
    bad = find_bad_channels(recording)
    if not bad:
        return recording
    words = "; ".join(f"hinge {number} is {why}" for number, why in bad.items())
    if bad_channels == "refuse" or len(bad) == recording.n_sensors:
        raise InvalidInput(
            f"bad channels: {words}. Record again, or describe the robot without these sensors."
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


def _check_length(time: np.ndarray, interval: float) -> int:
    count = np.floor((time[-1] - time[0]) / interval + 1e-9) + 1
    if count > _MAX_SAMPLES:
        raise InvalidInput(
            f"{time[-1] - time[0]:.4g} ms at {interval:g} ms are {count:.4g} samples, more than"
            f" {_MAX_SAMPLES:,}. Is the time unit right? Otherwise cut the recording."
        )
    return int(count)


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
    long = steps > max_gap * (1 + 1e-9)
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
        said.append(f"hinge {number}: {int(long.sum())} gaps over {max_gap:g} ms, {done}")
    if not known.all():
        said.append(f"hinge {number}: {int((~known).sum())} missing values")
    return mended, said
