"""All accuracy curves of one comparison: every code, noise level and number of copies, with null
and baseline.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np

from feeler.decoding.baseline import PeakEncoder
from feeler.decoding.classifiers import make_fitting_lda, make_lda
from feeler.decoding.codes import CODES, encode_with, make_null
from feeler.decoding.null import JointFit, fit_null
from feeler.decoding.plan import Plan
from feeler.decoding.sweep import Sweep, compute_sweep
from feeler.task.noise import NOISES, Common
from feeler.tensors.scaling import rectify


class Curve(NamedTuple):
    """Which curve."""

    group: str
    kind: str
    noise: str
    """Name of the model; ``relative`` means to each tensor for tensors, to each vector for all
    other codes.
    """
    n_copies: int
    when: str = "after"
    """Noise ``after`` encoding (the paper) or ``before``."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Group:
    """One condition of a comparison: its tensors, labels, fitted encoder and codes."""

    tensors: np.ndarray
    """Non-negative (trial, sensor, time), on a scale common to all groups."""
    labels: np.ndarray
    encoder: Any = None
    codes: dict[str, np.ndarray] = field(default_factory=dict, repr=False)
    null: JointFit | None = None
    """Jointly fitted codes of one tensor of the group, repeated; made where it is needed if it is
    not there.
    """


@dataclass(frozen=True, kw_only=True, eq=False)
class Curves:
    """Sweeps of all groups, and what each must be read beside."""

    sweeps: dict[Curve, Sweep]
    nulls: dict[Curve, Sweep]
    """The same pipelines on one single tensor repeated, labelled as if it were different touches:
    of every group for jointly fitted codes, of the first for fixed ones."""
    baselines: dict[str, Sweep]
    """Peak position and time only, by group, noise on the tensors at one common level."""
    noises: tuple[str, ...]
    n_copies: int
    fits: dict[str, JointFit] = field(default_factory=dict, repr=False)
    """Jointly fitted codes of the null, by group."""

    def find(
        self,
        kind: str,
        noise: str = "relative",
        *,
        when: str = "after",
        n_copies: int | None = None,
    ) -> dict:
        """Sweeps by group name."""
        wanted = (kind, noise, n_copies or self.n_copies, when)
        return {
            c.group: s
            for c, s in self.sweeps.items()
            if (c.kind, c.noise, c.n_copies, c.when) == wanted
        }

    def find_null(
        self,
        kind: str,
        noise: str = "relative",
        n_copies: int | None = None,
        *,
        group: str | None = None,
    ) -> Sweep | None:
        """The null of a kind of code: of jointly fitted ones the group's own, or the first there
        is.
        """
        wanted = (kind, noise, n_copies or self.n_copies)
        found = {
            c.group: s for c, s in self.nulls.items() if (c.kind, c.noise, c.n_copies) == wanted
        }
        return found.get(group) if group and kind == "joint" else next(iter(found.values()), None)


def compute_curves(
    groups: Mapping[str, Group],
    plan: Plan,
    *,
    kinds: Sequence[str] = CODES,
    noises: Sequence[str] | None = None,
    random_state: int = 0,
    report: Callable[[str], None] = lambda line: None,
) -> Curves:
    """Every curve of the plan for every group; the null and the baseline are made from the groups
    themselves.

    Parameters
    ----------
    groups
        Conditions to compare, e.g. three speeds; the first one also gives the null of fixed codes
        its tensor.
    kinds
        Codes to compare; each group must hold them.
    noises
        Names of noise models; all registered ones by default.
    """
    noises = tuple(NOISES) if noises is None else tuple(noises)
    peaks = {
        kind: max(np.abs(group.codes[kind]).max() for group in groups.values()) for kind in kinds
    }
    sweeps: dict[Curve, Sweep] = {}
    for name, group in groups.items():
        for kind in kinds:
            codes = {name: group.codes[kind]}
            sweeps |= _sweep_kind(
                codes, group.labels, kind, noises, peaks[kind], plan, random_state
            )
        report(f"{name}: {len(kinds)} codes")
    if plan.before_repeats:
        sweeps |= _sweep_before(
            groups, [k for k in kinds if k == "sparse"], noises, plan, random_state
        )
    reference = next(iter(groups))
    fits = {
        n: g.null or fit_null(g.tensors, g.encoder, plan.null_iter)
        for n, g in groups.items()
        if "joint" in kinds
    }
    nulls: dict[Curve, Sweep] = {}
    for kind in kinds:
        codes = (
            {n: f.codes for n, f in fits.items()}
            if kind == "joint"
            else {reference: _repeat_code(groups[reference], kind)}
        )
        nulls |= _sweep_kind(
            codes, groups[reference].labels, kind, noises, peaks[kind], plan, random_state
        )
    peak = max(group.tensors.max() for group in groups.values())
    baselines = {
        name: compute_baseline(group, plan, float(peak), random_state)
        for name, group in groups.items()
    }
    return Curves(
        sweeps=sweeps,
        nulls=nulls,
        baselines=baselines,
        noises=noises,
        n_copies=plan.n_copies,
        fits=fits,
    )


def _sweep_kind(codes, labels, kind, noises, peak, plan: Plan, random_state) -> dict[Curve, Sweep]:
    """Main curves with every noise, and the other numbers of copies at the probe ratio."""
    found = {}
    for name, array in codes.items():
        for model in noises:
            noise = NOISES[model]().suit(
                each="tensor" if kind == "raw" else "vector", reference=float(peak)
            )
            options = {
                "noise": noise,
                "rotate": kind == "raw" and noise.is_even(array),
                "random_state": random_state,
            }
            found[Curve(name, kind, model, plan.n_copies)] = compute_sweep(
                array, labels, ratios=plan.ratios, n_copies=plan.n_copies, n_repeats=plan.n_repeats,
                estimator=make_fitting_lda(len(labels), plan.n_copies), **options,
            )  # fmt: skip
            if model == "relative" and kind in plan.other_kinds:
                for n in plan.other_copies:
                    found[Curve(name, kind, model, n)] = compute_sweep(
                        array, labels, ratios=(plan.probe,), n_copies=n, n_repeats=plan.other_repeats,
                        estimator=make_fitting_lda(len(labels), n), **options,
                    )  # fmt: skip
    return found


def _sweep_before(groups, kinds, noises, plan: Plan, random_state) -> dict[Curve, Sweep]:
    """Noise on the tensors, rectified as the encoder needs, then encoded on the fixed bases."""
    names = list(groups)[: None if plan.before_all else 1]
    peak = float(max(group.tensors.max() for group in groups.values()))
    found = {}
    for name in names:
        group = groups[name]
        for kind in kinds:
            for model in noises if plan.before_all else ("common",):

                def encode_noisy(noisy, group=group, kind=kind):
                    return encode_with(rectify(noisy), group.encoder, kind)

                found[Curve(name, kind, model, plan.before_copies, "before")] = compute_sweep(
                    group.tensors, group.labels, ratios=(plan.probe,), n_copies=plan.before_copies,
                    n_repeats=plan.before_repeats, noise=NOISES[model]().suit(reference=peak), encode=encode_noisy,
                    estimator=make_fitting_lda(len(group.labels), plan.before_copies),
                    random_state=random_state,
                )  # fmt: skip
    return found


def _repeat_code(group: Group, kind: str) -> np.ndarray:
    """One code of the fixed bases, as often as there are trials."""
    null = make_null(group.tensors)
    return np.repeat(encode_with(null[:1], group.encoder, kind), len(null), axis=0)


def compute_baseline(group: Group, plan: Plan, peak: float, random_state: int = 0) -> Sweep:
    """Accuracy from the peak's position and time alone, noise at the common level on the tensors."""
    return compute_sweep(
        group.tensors,
        group.labels,
        ratios=(plan.probe,) if plan.n_repeats < 5 else plan.ratios,
        n_copies=3,
        n_repeats=min(plan.n_repeats, 2),
        noise=Common(reference=peak),
        encode=PeakEncoder(random_state),
        estimator=make_lda(None),
        random_state=random_state,
    )
