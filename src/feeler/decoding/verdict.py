"""Whether an order that was claimed holds, with effect size, interval and null."""

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np

from feeler.decoding.sweep import Sweep
from feeler.dispersion.interval import Interval, bootstrap_difference
from feeler.errors import InvalidInput


@dataclass(frozen=True, kw_only=True)
class Verdict:
    """One claim of an order, first to last, on one measure.

    Attributes
    ----------
    means : tuple[tuple[str, float], ...]
        Groups with their means, in the claimed order.
    difference : Interval
        First minus last over paired stimuli, > 0 if the ends stand as claimed; d_z as effect.
    word : str
        ``agrees``, ``ends agree`` (the middle does not), ``undecided`` or ``opposite``.
    explained : float
        Share of the first group's accuracy above chance that the null reaches; NaN: no null.
    """

    claim: str
    measure: str
    means: tuple[tuple[str, float], ...]
    difference: Interval
    word: str
    explained: float = float("nan")

    @property
    def is_evidence(self) -> bool:
        """Whether the null leaves the measure standing: less than half of it explained."""
        return not self.explained >= 0.5

    def describe(self) -> str:
        """One line of words."""
        order = ", ".join(f"{name} {mean:.3g}" for name, mean in self.means)
        line = f"{self.claim}, {self.measure}: {self.word} ({order}; difference {self.difference}, "
        line += f"d_z {self.difference.effect:.2g})"
        if not self.is_evidence:
            line += f"; no evidence: identical tensors reach {100 * self.explained:.0f} % of it"
        return line


def judge_order(
    values: Mapping[Any, np.ndarray],
    *,
    claim: str,
    measure: str,
    greater: bool = True,
    explained: float = float("nan"),
    random_state: int = 0,
) -> Verdict:
    """Judge "the first is the greatest, the last the least" (``greater``), or the reverse.

    Parameters
    ----------
    values
        Values per stimulus (stimulus,) for each group, in the claimed order; stimuli in the same
        order in all groups.
    greater
        True if the claim says first > … > last, False if first < … < last.

    Notes
    -----
    ``agrees``: the means stand in the claimed order and the 95 % bootstrap interval of the ends'
    difference lies above 0. ``ends agree``: the latter only. ``opposite``: the interval lies below
    0. Otherwise ``undecided``.
    """
    if len(values) < 2:
        raise InvalidInput(f"an order needs at least two groups, got {len(values)}.")
    groups = [np.asarray(v, dtype=float) for v in values.values()]
    sign = 1.0 if greater else -1.0
    difference = bootstrap_difference(
        sign * groups[0], sign * groups[-1], np.random.default_rng(random_state)
    )
    means = [float(v.mean()) for v in groups]
    ordered = all(sign * a > sign * b for a, b in pairwise(means))
    word = "opposite" if difference.high < 0 else "undecided"
    if difference.low > 0:
        word = "agrees" if ordered else "ends agree"
    return Verdict(
        claim=claim,
        measure=measure,
        means=tuple(zip(map(str, values), means, strict=True)),
        difference=difference,
        word=word,
        explained=explained,
    )


def compute_explained(sweep: Sweep, null: Sweep) -> float:
    """Share of a sweep's accuracy above chance that the null reaches, ≥ 0."""
    above = np.isin(sweep.ratios, null.ratios), np.isin(null.ratios, sweep.ratios)
    height = sweep.noisy[above[0]].mean() - sweep.chance
    return (
        float(max(null.noisy[above[1]].mean() - null.chance, 0.0) / height)
        if height > 0
        else float("nan")
    )
