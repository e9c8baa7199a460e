"""The paper's ninety touches."""

from collections.abc import Sequence

from feeler.records.checked import checked
from feeler.stimulus.feature import Feature
from feeler.stimulus.shapes import Ball, Box, Triangle
from feeler.stimulus.trial import Trial, make_grid

SPEEDS = {"fast": 0.6, "medium": 0.3, "slow": 0.06}  # m/s [P]
LOCATIONS = (0.5, 0.6, 0.7, 0.8, 0.9)  # fractions of length; the first [D], the others [C]
HALF_SIZES = {
    "small": 1.5,
    "large": 3.0,
}  # mm; ball of the video 1.53 [D], large about twice small [A], values [C]


def make_features() -> list[Feature]:
    """Ball, box and triangle, each small and large."""
    sizes = HALF_SIZES.values()
    return [
        *(Ball(radius=size) for size in sizes),
        *(Box(half_width=size, half_height=size) for size in sizes),
        *(Triangle(half_width=size, half_height=size) for size in sizes),
    ]


@checked
def trials(
    speeds: Sequence[float] | None = None,
    locations: Sequence[float] = LOCATIONS,
    features: Sequence[Feature] | None = None,
) -> list[Trial]:
    """Six features at five locations and three speeds (fast, medium, slow): 90 trials (Results,
    Fig. 2D).
    """
    return make_grid(
        make_features() if features is None else list(features),
        list(locations),
        list(SPEEDS.values() if speeds is None else speeds),
    )
