"""Beside Fig. 5B, D: jointly fitted codes of complete touches by profile, with their nulls; the
paper's window cuts the profiles differently.
"""

from dataclasses import replace
from functools import lru_cache
from types import SimpleNamespace
from typing import Any

import xarray as xr

from feeler.analysis import INDICES, compute_dispersion
from feeler.decoding.curves import Group, compute_curves, configure, fit_null, make_codes
from feeler.decoding.sweeps import Plan
from feeler.report import Section, make_spread
from paper.cache import keep
from paper.context import Context
from paper.data import list_profiles, load_complete
from paper.fig5_data import spread_accuracy
from paper.fig5_nulls import disperse_null
from paper.fig5_speed import JOINT_CODES
from paper.window import WINDOWS, complete_arrays

_PARTS = {"activation": "dispersion.activation", "null": "dispersion.null"}


def compute(
    tensors: dict[str, xr.Dataset], encoder: Any, *, plan: Plan, random_state: int = 0
) -> SimpleNamespace:
    """Codes of each profile's complete touches, fitted jointly, and of one of them repeated.

    Returns
    -------
    SimpleNamespace
        ``groups``, each profile's tensors and codes; ``dispersion`` of the codes and of their
        nulls, by part; ``curves`` of accuracy.
    """
    arrays, labels = complete_arrays(tensors)
    settings = {"n_restarts": plan.n_restarts, "random_state": random_state}
    groups = {}
    for name, array in arrays.items():
        fitted = configure(encoder, settings)
        codes = make_codes(array, fitted, kinds=("joint",))
        null = fit_null(array, configure(encoder, settings), plan)
        groups[name] = Group(
            tensors=array, labels=labels, encoder=fitted, codes=codes, null=null
        )
    once = replace(plan, other_copies=(), before_repeats=0)
    options = {"kinds": ("joint",), "noises": ("relative",), "random_state": random_state}
    curves = keep("curves", compute_curves, groups, once, **options)
    codes = {name: group.codes["joint"] for name, group in groups.items()}
    dispersion = {
        "activation": compute_dispersion(codes, random_state=random_state),
        "null": disperse_null(groups, curves.fits, random_state),
    }
    return SimpleNamespace(groups=groups, dispersion=dispersion, curves=curves)


@lru_cache(maxsize=1)
def load(context: Context) -> SimpleNamespace:
    """What this run shows, computed once."""
    return compute(
        {name: load_complete(context, name) for name in list_profiles(context)},
        context.effort.make_encoder(),
        plan=context.effort.plan,
        random_state=context.seed,
    )


def show(context: Context, section: Section) -> None:
    """Dispersion and accuracy of such codes beside their nulls."""
    names, plan = list_profiles(context), context.effort.plan
    if len(names) < 2:
        return
    data = load(context)
    starts = {"activation": plan.n_restarts, "null": plan.null_restarts}
    rows = []
    for name, sweep in data.curves.find("joint").items():
        cells = []
        for index in INDICES:
            for part, prefix in _PARTS.items():
                found, n = data.dispersion[part].average[index][name], starts[part]
                spread = make_spread(found.estimate, found.low, found.high, n=n)
                section.values[f"{prefix}.{index}.{WINDOWS[1]}.{name}"] = spread
                kept = section.values.get(f"{prefix}.{index}.{name}")
                section.values[f"{prefix}.{index}.{WINDOWS[0]}.{name}"] = kept
            real, null = (
                data.dispersion[part].average[index][name].estimate for part in _PARTS
            )
            cells.append(f"{real:.3g} / {null:.3g}")
        alone = data.curves.find_null("joint", group=name)
        assert alone is not None  # compute_curves makes one for every group
        for part, one in (("lda", sweep), ("null", alone)):
            spread = spread_accuracy(one, starts.get(part, plan.n_restarts))
            prefix = "lda" if part == "lda" else f"lda.{part}"
            section.values[f"{prefix}.{WINDOWS[1]}, {JOINT_CODES}.{name}"] = spread
        cells.append(f"{100 * sweep.noisy.mean():.0f} / {100 * alone.noisy.mean():.0f}")
        rows.append([name, *cells])
    section.table(
        ["profile", *(known.label for known in INDICES.values()), "accuracy [%]"],
        rows,
        "Real / null: jointly fitted codes of complete touches, and of one of them repeated.",
    )
