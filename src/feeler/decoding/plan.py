"""How much to compute: one dial from smoke to paper."""

from dataclasses import dataclass

from feeler.errors import InvalidInput


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
    """All groups and both noise levels before encoding, or the first group at the common level only."""
    n_restarts: int = 3
    """Restarts of an encoder's fit."""


PLANS = {
    "smoke": Plan(ratios=(0.2,), n_repeats=1, n_copies=3, other_copies=(), before_repeats=0, n_restarts=1),
    "quick": Plan(
        ratios=(0.1, 0.3), n_repeats=2, other_copies=(3,), other_kinds=("joint", "raw"), before_copies=2, n_restarts=1
    ),
    "paper": Plan(
        ratios=(0.0, 0.05, 0.1, 0.15, 0.2, 0.25, 0.3),
        n_repeats=10,
        other_repeats=3,
        before_copies=3,
        before_all=True,
    ),
}


def get_plan(scale: str | Plan) -> Plan:
    """The plan called ``scale``, or the plan itself."""
    if isinstance(scale, Plan):
        return scale
    if scale not in PLANS:
        raise InvalidInput(f"unknown scale {scale!r}; valid: {', '.join(PLANS)}.")
    return PLANS[scale]
