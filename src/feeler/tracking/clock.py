"""The clock of a film: frame rate from times, and frames that a file leaves out."""

from typing import Any

import numpy as np

from feeler.errors import InvalidInput

_MAX_JITTER = 0.35  # [C] of a frame interval, by which a time may lie off its frame
_MAX_CELLS = 12_000_000  # [C] ~100 MB of numbers


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
            f" {frame[row + 1]:g}; frames are missing, twice there or in another order. Sort them,"
            " one row for each frame."
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
