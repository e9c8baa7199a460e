"""Where to touch next: several touches in a row, each at a place and from a direction that is
chosen, to discriminate two shapes.

What is not known of either shape (size, and where exactly the object is) makes one touch say less
than it could, and another place say more. Every pair of shape and unknowns is a hypothesis; each is
simulated for every touch that may be chosen.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np
from scipy.special import softmax

from feeler import touch
from feeler.active.observer import expected_information_gain
from feeler.antenna.segments import Antenna
from feeler.errors import InvalidInput
from feeler.objects.shapes import Feature
from feeler.objects.trials import Trial

LOCATIONS = (0.5, 0.6, 0.7, 0.8, 0.9)  # [C] shares of the length
APPROACHES = (75.0, 90.0, 105.0)  # [C] degrees
SIZES, OFFSETS = (0.95, 1.0, 1.05), (-0.8, 0.0, 0.8)  # [C] factors; mm along the antenna
CHOOSERS = ("random", "grid", "greedy")
MOST = 12  # touches; who then still is unsure stops


@dataclass(frozen=True, kw_only=True, eq=False)
class Places:
    """What every hypothesis feels like in every touch that may be chosen."""

    felt: np.ndarray
    """(touch, hypothesis, sensor, sample) [rad]"""
    label: np.ndarray
    """Number of the shape (hypothesis,)."""
    touches: tuple[tuple[float, float], ...]
    """Location and approach of each touch."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Search:
    """Touches in a row until sure."""

    count: np.ndarray
    """How many touches (episode,)."""
    right: np.ndarray
    """Whether the answer was right (episode,)."""
    sure: np.ndarray
    """Whether the threshold was reached (episode,)."""
    chosen: np.ndarray
    """Number of the touch (episode, most), −1 after the end."""


def simulate_places(
    antenna: Antenna,
    shapes: Sequence[Feature],
    *,
    locations: Sequence[float] = LOCATIONS,
    approaches: Sequence[float] = APPROACHES,
    speed: float = 0.3,
    duration: float = 50.0,
    progress: Callable[[int, int], None] | None = None,
) -> Places:
    """Simulate every shape at every size and offset that it may have, in every touch that may be
    chosen.

    Raises
    ------
    InvalidInput
        Fewer than two shapes, or no touch to choose.
    """
    if len(shapes) < 2 or not len(locations) or not len(approaches):
        raise InvalidInput(
            "to discriminate shapes takes at least two of them, and one location and approach to"
            " choose."
        )
    touches = tuple(product((float(x) for x in locations), (float(a) for a in approaches)))
    kinds = [
        (number, size, offset)
        for number in range(len(shapes))
        for size in SIZES
        for offset in OFFSETS
    ]
    trials = [
        Trial(
            feature=shapes[number].scale(size),
            location=min(location + offset / antenna.length, 1.0),
            approach=approach,
            speed=speed,
        )
        for location, approach in touches
        for number, size, offset in kinds
    ]
    angle = touch(
        antenna, trials, duration=duration, timestep=0.1, save=["angle"], progress=progress
    )["angle"].values
    return Places(
        felt=angle.reshape(len(touches), len(kinds), *angle.shape[1:]),
        label=np.array([number for number, *_ in kinds]),
        touches=touches,
    )


def search_places(
    places: Places,
    chooser: str,
    noise: float,
    *,
    n: int = 200,
    threshold: float = 0.95,
    seed: int = 0,
    most: int = MOST,
) -> Search:
    """Touch until the shape is known with probability ``threshold``, ``n`` times, each with a
    hypothesis and noise of its own.

    Parameters
    ----------
    chooser
        ``random``; ``grid``, one place after the other in a drawn order; or ``greedy``, what is
        expected to tell most.
    """
    if chooser not in CHOOSERS:
        raise InvalidInput(f"chooser must be one of {', '.join(CHOOSERS)}, got {chooser!r}.")
    if not (noise > 0 and 0 < threshold < 1):
        raise InvalidInput(
            f"noise must be > 0 rad and threshold in (0, 1), got {noise} and {threshold}."
        )
    n_touches, n_kinds = places.felt.shape[:2]
    flat = places.felt.reshape(n_touches, n_kinds, -1) / noise
    half, members = 0.5 * (flat**2).sum(axis=2), np.eye(places.label.max() + 1)[places.label]
    rng = np.random.default_rng([seed, 3])
    true, order = rng.integers(n_kinds, size=n), np.argsort(rng.random((n, n_touches)), axis=1)
    drawn = rng.integers(n_touches, size=(n, most))
    evidence, open_ = np.zeros((n, n_kinds)), np.ones(n, bool)
    count, chosen = np.zeros(n, int), np.full((n, most), -1)
    for step in range(most):
        rows = np.flatnonzero(open_)
        if not rows.size:
            break
        if chooser == "greedy":
            weight = softmax(evidence[rows], axis=1)
            gain = [
                expected_information_gain(felt, weight, places.label, noise, seed)
                for felt in places.felt
            ]
            picks = np.argmax(gain, axis=0)
        else:
            picks = (order[:, step % n_touches] if chooser == "grid" else drawn[:, step])[rows]
        for row, pick in zip(rows, picks, strict=True):
            noisy = flat[pick, true[row]] + np.random.default_rng(
                [seed, int(row), step]
            ).standard_normal(flat.shape[2])
            evidence[row] += flat[pick] @ noisy - half[pick]
        chosen[rows, step], count[rows] = picks, count[rows] + 1
        open_ = softmax(evidence, axis=1).dot(members).max(axis=1) < threshold
    belief = softmax(evidence, axis=1) @ members
    return Search(
        count=count,
        right=belief.argmax(axis=1) == places.label[true],
        sure=~open_,
        chosen=chosen,
    )
