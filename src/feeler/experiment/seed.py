"""Seeds: one root, and a child for each trial."""

import numpy as np

from feeler.errors import InvalidInput


def spawn_seeds(seed: int, n: int) -> list[int]:
    """One child seed per trial, the same whatever the order of work."""
    if not (isinstance(seed, int | np.integer) and seed >= 0):
        raise InvalidInput(f"seed must be a whole number ≥ 0, got {seed!r}.")
    return [int(child.generate_state(1, np.uint32)[0]) for child in np.random.SeedSequence(int(seed)).spawn(n)]
