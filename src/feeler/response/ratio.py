"""Deflection ratios: how far inner points follow the tip."""

import numpy as np

from feeler.checked import checked
from feeler.errors import InvalidInput
from feeler.response.trace import check_trace, find_vertex


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
