"""What Figs. 5A–E and S6 show: dispersion and accuracy by speed and by profile.

``figS6`` shows the dispersion, ``fig5`` the accuracy, ``fig5_nulls`` what identical touches reach,
``fig5_new`` touches that no training copy was made of.
"""

from collections.abc import Mapping
from dataclasses import replace
from functools import lru_cache
from types import SimpleNamespace
from typing import Any

import numpy as np

from feeler.analysis import compute_dispersion
from feeler.analysis.dispersion import bootstrap_mean
from feeler.decoding import (
    CODES,
    Sweep,
    group_tensors,
)
from feeler.decoding.curves import (
    Curves,
    compute_curves,
)
from feeler.decoding.sweeps import Plan
from feeler.report import make_spread
from paper.cache import keep
from paper.context import Context
from paper.data import list_profiles, list_speeds, load_tensors

MAIN = ("joint", "raw")
"""The paper's two data sets: activations and tensors."""


def compute(
    tensors: Mapping[str, Any],
    encoder: Any,
    *,
    plan: Plan,
    reference: str = "exponential",
    random_state: int = 0,
) -> SimpleNamespace:
    """Both comparisons: the reference antenna at its speeds, and all antennas at the slowest speed.

    Parameters
    ----------
    tensors
        Datasets by antenna name; the reference needs all its speeds, the others at least the
        slowest.
    encoder
        An unfitted ``ConvolutiveNMF``; cloned and fitted once per antenna and comparison: by speed
        on all tensors of the reference antenna, by profile on each antenna's slow tensors alone.
    plan
        How much is computed.

    Returns
    -------
    SimpleNamespace
        By comparison (``speed``, ``profile``): ``groups``, each group's tensors and codes;
        ``dispersions`` by kind of code, groups in the claimed order, most dispersed first, controls
        after; ``curves`` of accuracy.
    """
    groups = group_tensors(
        tensors, encoder, plan, reference=reference, random_state=random_state
    )
    dispersions = {
        comparison: {
            kind: compute_dispersion(
                {name: group.codes[kind] for name, group in members.items()},
                random_state=random_state,
            )
            for kind in CODES
        }
        for comparison, members in groups.items()
    }
    curves: dict[str, Curves] = {}
    for comparison, members in groups.items():
        # The first group of both comparisons is the same antenna at the same speed: noise before
        # encoding once.
        once = replace(plan, before_repeats=0) if curves and not plan.before_all else plan
        curves[comparison] = keep(
            "curves", compute_curves, members, once, random_state=random_state
        )
    return SimpleNamespace(
        groups=groups,
        dispersions=dispersions,
        curves=curves,
    )


@lru_cache(maxsize=1)
def load(context: Context) -> SimpleNamespace:
    """What this run shows, computed once for all figures of its section."""
    sets = {name: load_tensors(context, name) for name in list_profiles(context)}
    return compute(
        sets,
        context.effort.make_encoder(),
        plan=context.effort.plan,
        reference=next(iter(sets)),
        random_state=context.seed,
    )


def name_speeds(context: Context) -> dict[str, str]:
    """The names that values of a run have for its groups by speed: "0.06 m/s" is ``slow``."""
    speeds = list_speeds(context, list_profiles(context)[0])
    return {f"{speed:g} m/s": name for name, speed in speeds.items()}


def spread_accuracy(sweep: Sweep, starts: int | None = None) -> dict[str, float]:
    """Accuracy over noise ratios above 0, averaged, with its 95 % interval over touches.

    Touches are what is drawn: repeated noise says nothing of other touches, and in its spread
    shuffled labels stood in an order. ``starts`` of the fit whose codes are read: with one, neither
    touches nor repeats tell anything of the fit.
    """
    repeats = sweep.noisy.shape[1]
    one = bootstrap_mean(sweep.area, np.random.default_rng(0))
    return make_spread(one.estimate, one.low, one.high, n=min(repeats, starts or repeats))
