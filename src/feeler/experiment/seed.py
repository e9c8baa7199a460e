"""Seeds: one root, and a child for each trial."""

import numpy as np

from feeler.errors import InvalidInput


def check_seed(seed: object) -> int:
    """A root of seeds: a whole number ≥ 0."""
    if isinstance(seed, bool) or not (isinstance(seed, int | np.integer) and seed >= 0):
        raise InvalidInput(f"seed must be a whole number ≥ 0, got {seed!r}.")
    return int(seed)


def spawn_seed(seed: int, index: int) -> int:
    """The child seed of trial number ``index``, whatever the others are."""
    return int(np.random.SeedSequence(seed, spawn_key=(index,)).generate_state(1, np.uint32)[0])
