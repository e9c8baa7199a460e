"""The clock of a film: frame rate from times, and frames that a file leaves out."""

import re
from dataclasses import dataclass
from typing import Any

import numpy as np

from feeler.errors import InvalidInput
from feeler.tensors.table import Table

_MAX_JITTER = 0.35  # [C] of a frame interval, by which a time may lie off its frame
_MAX_CELLS = 12_000_000  # [C] ~100 MB of numbers
_SLOWEST, _FASTEST = 2.0, 2e4  # [C] frames per second of films of moving animals
_FRAME = re.compile(r"frames?|frame[ _.]?(?:idx|index|no|number|num|nr)|fnum", re.IGNORECASE)
_TIME = re.compile(
    r"(?:time|times|t|timestamps?)(?:[ _.]?[(\[]? ?(?P<unit>s|secs?|seconds?|ms|msecs?|"
    r"milliseconds?|us|µs|microseconds?) ?[)\]]?)?",
    re.IGNORECASE,
)
_MS = {"s": 1e3, "sec": 1e3, "secs": 1e3, "second": 1e3, "seconds": 1e3}
_MS |= {"us": 1e-3, "µs": 1e-3, "microsecond": 1e-3, "microseconds": 1e-3}  # others are ms


def count_frames(time: np.ndarray) -> tuple[np.ndarray | None, float, str]:
    """Number of the frame (row,) that each time belongs to, the mean interval in the times' unit,
    and, where the times are of no even clock (then without numbers), what is wrong with them.

    Steps of whole multiples of the interval are frames that were left out.
    """
    steps = np.diff(time)
    if not steps.size or not (np.isfinite(steps) & (steps > 0)).all():
        return None, float("nan"), "its times do not rise"
    median = float(np.median(steps))
    step = float(steps[steps < 1.6 * median].mean())
    many = np.maximum(np.round(steps / step), 1)
    interval = float(steps.sum() / many.sum())
    if np.abs(steps / interval - many).max() > _MAX_JITTER:
        return None, median, f"its frames are {steps.min():.4g} to {steps.max():.4g} ms apart"
    return np.concatenate([[0.0], np.cumsum(many)]), interval, ""


def spread_frames(
    frame: np.ndarray, source: str, *arrays: np.ndarray | None
) -> tuple[list[Any], dict[str, str]]:
    """Arrays (row, …) with a row for each frame of the film, NaN for those that the file leaves
    out, and a note of how many these are.

    Raises
    ------
    InvalidInput
        Frame numbers that do not rise, are no whole numbers, or span too many frames.
    """
    steps = np.diff(frame)
    wrong = ~((steps >= 1) & (steps == np.round(steps)))
    if wrong.any():
        row = int(np.argmax(wrong))
        raise InvalidInput(
            f"{source}: frame numbers must rise, but {frame[row]:g} is followed by"
            f" {frame[row + 1]:g}; there are frames missing, twice or in another order. Sort"
            " them, one row for each frame."
        )
    n = int(frame[-1] - frame[0]) + 1 if frame.size else 0
    if n == frame.size:
        return list(arrays), {}
    cells = n * max(int(np.prod(one.shape[1:])) for one in arrays if one is not None)
    if cells > _MAX_CELLS:
        raise InvalidInput(
            f"{source}: frames {frame[0]:g} to {frame[-1]:g} are {n:,}, of which the file holds"
            f" {frame.size:,}. Split it where frames are left out."
        )
    index = (frame - frame[0]).astype(int)
    full: list[Any] = []
    for one in arrays:
        if one is not None:
            wide = np.full((n, *one.shape[1:]), np.nan)
            wide[index] = one
            one = wide
        full.append(one)
    return full, {"left out": f"{n - frame.size} of {n} frames, which count as not seen"}


@dataclass(frozen=True, kw_only=True)
class Clock:
    """What a table says of its film's time.

    ``frame`` (row,): number of each row's frame, where frames or times are given; ``rate`` [frames
    per second] and the column ``timed`` that it was measured from; ``wrong``: why there is no rate
    although there are times.
    """

    frame: np.ndarray | None = None
    rate: float | None = None
    timed: str = ""
    wrong: str = ""


def read_clock(table: Table, given: float | None) -> Clock:
    """Frames and times of a table's columns, such as ``frame``, ``time_s`` or ``Time (ms)``.

    A column ``time`` without a unit is in s or ms, whichever fits the ``given`` frame rate or,
    without one, is the only possible film.
    """
    numbers = next((name for name in table.columns if _FRAME.fullmatch(name)), None)
    frame = None if numbers is None or numbers in table.words else table.column(numbers)
    found = [(name, match) for name in table.columns if (match := _TIME.fullmatch(name))]
    if not found:
        return Clock(frame=frame)
    column, match = next((one for one in found if one[1]["unit"]), found[0])
    if column in table.words:
        return Clock(frame=frame, wrong=f"column {column!r} holds text")
    time = table.column(column)
    counted, step, wrong = count_frames(time * _MS.get((match["unit"] or "s").lower(), 1.0))
    if counted is None:
        return Clock(frame=frame, wrong=f"{wrong} in column {column!r}")
    if frame is not None:
        step *= counted[-1] / max(frame[-1] - frame[0], 1)
    rate = 1e3 / step
    if match["unit"] is None:
        options = [rate, 1e3 * rate]
        if given is not None:
            rate = min(options, key=lambda one: abs(np.log(one / given)))
        elif (possible := [one for one in options if _SLOWEST < one <= _FASTEST]) and len(
            possible
        ) == 1:
            rate = possible[0]
        else:
            return Clock(frame=counted, wrong=f"column {column!r} has no unit")
        if np.all(np.diff(time) == np.round(np.diff(time))) and abs(step - 1e3) < 1e-6:
            return Clock(frame=counted, wrong=f"column {column!r} may count frames or ms")
    return Clock(
        frame=counted if frame is None else frame, rate=rate, timed=f"column {column!r}"
    )
