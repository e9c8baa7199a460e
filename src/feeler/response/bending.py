"""Static bending: flexural rigidity from force and deflection."""

import numpy as np

from feeler.checked import checked
from feeler.errors import InvalidInput


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
    if np.any(position <= 0):
        raise InvalidInput(f"position must be > 0 mm from the clamp, got {position.min():g}.")
    if np.any(force * deflection <= 0):
        raise InvalidInput("force and deflection must both be non-zero and of one sign.")
    return force * position**3 / (3 * deflection)
