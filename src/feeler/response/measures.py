"""Stiffness from bending, deflection ratios, and the coefficient of restitution of a bounce."""

import numpy as np

from feeler.checked import checked
from feeler.errors import InvalidInput
from feeler.response.trace import check_trace, find_vertex


@checked
def measure_bending_stiffness(
    force: np.ndarray, deflection: np.ndarray, position: np.ndarray
) -> np.ndarray:
    """Flexural rigidity EI [N·mm²] that a uniform cantilever would have: ``EI = F a³ / (3 δ)``.

    Parameters
    ----------
    force
        Transverse force F [N].
    deflection
        Deflection δ [mm] of the loaded point, small against ``position``.
    position
        Distance a [mm] of the loaded point from the clamp.

    Notes
    -----
    On a tapered antenna this is an average that weighs the base most; it falls as the loaded point
    moves out.
    """
    force, deflection, position = (
        np.asarray(x, dtype=float) for x in (force, deflection, position)
    )
    for name, values in (("force", force), ("deflection", deflection), ("position", position)):
        if not np.isfinite(values).all():
            raise InvalidInput(f"{name} must be finite, got {values}.")
    try:
        np.broadcast_shapes(force.shape, deflection.shape, position.shape)
    except ValueError as error:
        shapes = f"{force.shape}, {deflection.shape} and {position.shape}"
        words = f"force, deflection and position must have one shape, got {shapes}."
        raise InvalidInput(words) from error
    if np.any(position <= 0):
        raise InvalidInput(f"position must be > 0 mm from the clamp, got {position.min():g}.")
    if np.any(force * deflection <= 0):
        raise InvalidInput("force and deflection must both be non-zero and of one sign.")
    return force * position**3 / (3 * deflection)


@checked
def measure_deflection_ratios(
    time: np.ndarray, deflection: np.ndarray, tip: np.ndarray
) -> np.ndarray:
    """Deflections (point,) over the tip's at the moment when the tip is farthest out.

    Parameters
    ----------
    time
        (sample,) [ms].
    deflection
        (point, sample), from rest, in the tip's unit.
    tip
        (sample,), from rest.

    Notes
    -----
    The moment is interpolated between samples (parabola through the three samples around the
    largest |tip|), and so are the points, so that the ratios change smoothly with the mechanics.
    """
    time, tip = check_trace(time, tip, "tip")
    deflection = np.atleast_2d(np.asarray(deflection, dtype=float))
    if deflection.shape[1:] != tip.shape:
        raise InvalidInput(
            f"deflection must be (point, sample) with {tip.size} samples, got shape"
            f" {deflection.shape}."
        )
    if not np.isfinite(deflection).all():
        raise InvalidInput(
            "deflection has missing samples; interpolate the gaps or leave the point out."
        )
    k = int(np.argmax(np.abs(tip)))
    if k in (0, tip.size - 1):
        raise InvalidInput(
            f"the tip is farthest out at the {'first' if k == 0 else 'last'} sample ({time[k]:g}"
            " ms): the trace does not hold the whole deflection. Record longer."
        )
    share = float(find_vertex(*tip[k - 1 : k + 2]))
    return _parabola(deflection[:, k - 1 : k + 2], share) / _parabola(
        tip[None, k - 1 : k + 2], share
    )


def _parabola(three: np.ndarray, share: float) -> np.ndarray:
    before, here, after = three.T
    return here + 0.5 * share * (after - before) + 0.5 * share**2 * (before - 2 * here + after)


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
