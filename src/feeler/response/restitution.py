"""Coefficient of restitution of one bounce."""

import numpy as np

from feeler.checked import checked
from feeler.errors import InvalidInput
from feeler.response.trace import check_trace


@checked
def measure_restitution(
    time: np.ndarray,
    gap: np.ndarray,
    *,
    touch: tuple[float, float] | None = None,
    n_samples: int = 4,
) -> float:
    """Speed of separation over speed of approach, from the gap between two bodies over time.

    Parameters
    ----------
    time, gap
        (sample,) [ms] and the distance between the surfaces (sample,), any unit.
    touch
        First and last moment of contact [ms]; default: where the gap is ≤ 0, or its smallest value
        if it never is.
    n_samples
        Samples before and after contact through which a straight line is laid.

    Returns
    -------
    float
        e = (d gap / dt after) / −(d gap / dt before); 1 keeps the speed, 0 sticks.
    """
    time, gap = check_trace(time, gap, "gap")
    if n_samples < 2:
        raise InvalidInput(f"n_samples must be ≥ 2 to have a slope, got {n_samples}.")
    if touch is None:
        inside = np.flatnonzero(gap <= 0)
        first, last = (inside[0], inside[-1]) if inside.size else (np.argmin(gap), np.argmin(gap))
    else:
        first, last = (
            np.searchsorted(time, touch[0]),
            np.searchsorted(time, touch[1], side="right") - 1,
        )
    if first < n_samples or last + n_samples >= time.size:
        raise InvalidInput(
            f"contact lasts from {time[first]:g} to {time[last]:g} ms: {n_samples} samples are"
            " needed before and after it. Record longer, or lower n_samples."
        )
    before = np.polyfit(time[first - n_samples : first], gap[first - n_samples : first], 1)[0]
    after = np.polyfit(
        time[last + 1 : last + 1 + n_samples], gap[last + 1 : last + 1 + n_samples], 1
    )[0]
    if before >= 0:
        raise InvalidInput(
            f"the bodies do not approach each other before contact (slope {before:g} per ms). Check"
            " the sign of gap."
        )
    return float(after / -before)
