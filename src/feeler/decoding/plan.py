"""How much to compute of accuracy against noise."""

from dataclasses import dataclass


@dataclass(frozen=True, kw_only=True)
class Plan:
    """Ratios, repeats and copies of every noise sweep of a study."""

    ratios: tuple[float, ...]
    """Noise ratios of the main curves."""
    n_repeats: int
    """Repeats of the main curves; the paper's is ten [P]."""
    n_copies: int = 10
    """Noisy copies per trial [C]."""
    other_copies: tuple[int, ...] = (3, 30)
    """Other numbers of copies, at ``probe``."""
    other_kinds: tuple[str, ...] = ("joint", "sparse", "ridge", "raw")
    """Codes for which other numbers of copies are tried."""
    probe: float = 0.2
    """Noise ratio of everything that is computed at one ratio only."""
    other_repeats: int = 1
    before_copies: int = 10
    """Copies per trial where noise is added before encoding: each has to be encoded."""
    before_repeats: int = 1
    """0 leaves noise before encoding out."""
    before_all: bool = False
    """Noise before encoding for all groups and noises, or for one of each."""
    n_restarts: int = 3
    """Restarts of an encoder's fit."""
    null_iter: int = 300
    """Iterations of the joint fits of identical touches and of twins."""
    twins: str = "all"
    """Groups whose touches are fitted twice: all, the ends of each comparison, or none."""
