"""Making: a design as flexure hinges that can be cut, and what is lost when they are cut a little
wrong.
"""

from typing import Annotated, Any

import numpy as np
from annotated_types import Len

from feeler.antenna.antenna import Antenna
from feeler.antenna.space import require_plane
from feeler.design.scoring import Score, score
from feeler.design.task import DesignTask
from feeler.records.checked import checked
from feeler.robot.hinge import ROBOT_FACTS, Flexures

SHEETS = (
    0.0075,
    0.0127,
    0.0254,
    0.0508,
    0.0762,
    0.127,
)  # mm; thicknesses in which Kapton is sold [B]
WIDEST = 20.0  # mm [C]; the device is 16 mm wide [P]


@checked
def make_strips(
    antenna: Antenna,
    length: Annotated[float, "> 0"] = 0.5,
    sheets: Annotated[tuple[Annotated[float, "> 0"], ...], Len(1)] = SHEETS,
) -> Flexures:
    """Widths and sheet thicknesses of flexures as stiff as the antenna's hinges: w = 12 k ℓ / (E
    t³).

    Each hinge takes the thickest sheet of which a strip at least ``length`` wide is soft enough, so
    that widths can be cut; otherwise the thinnest.
    """
    require_plane(antenna, "cutting flexures from sheets")
    modulus, stocks = ROBOT_FACTS["modulus"].number, np.array(sorted(sheets))
    widths = 12 * antenna.stiffness[:, None] * length / (modulus * stocks**3)
    fits = (widths >= length) & (widths <= WIDEST)
    chosen = np.where(
        fits.any(axis=1),
        fits.shape[1] - 1 - fits[:, ::-1].argmax(axis=1),
        _nearest(widths, length),
    )
    hinges = np.arange(antenna.n_segments)
    return Flexures(
        width=widths[hinges, chosen],
        thickness=stocks[chosen],
        length=np.array(length),
        modulus=np.array(modulus),
    )


def _nearest(widths: np.ndarray, length: float) -> np.ndarray:
    """For hinges that no sheet fits: the sheet whose strip comes nearest to what can be cut."""
    return np.abs(np.log(widths / np.sqrt(length * WIDEST))).argmin(axis=1)


@checked
def measure_tolerance(
    antenna: Antenna,
    task: DesignTask,
    purpose: str = "test",
    *,
    share: Annotated[float, "> 0"] = 0.05,
    copies: Annotated[int, "> 0"] = 6,
    seed: Annotated[int, "≥ 0"] = 0,
    **options: Any,
) -> list[Score]:
    """Scores of copies whose hinges were made wrong: width and thickness each off by up to ±
    ``share``, hinge by hinge.

    Stiffness goes with width and the cube of thickness, and damping with stiffness.
    """
    require_plane(antenna, "the tolerance of flexures")
    rng, found = np.random.default_rng(seed), []
    for _ in range(copies):
        width, thickness = 1 + share * rng.uniform(-1, 1, (2, antenna.n_segments))
        factor = width * thickness**3
        made = antenna.replace(
            stiffness=antenna.stiffness * factor, damping=antenna.damping * factor
        )
        found.append(score(made, task, purpose, **options))
    return found
