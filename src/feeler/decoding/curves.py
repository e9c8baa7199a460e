"""All accuracy curves of one comparison, with their null and their baseline."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Annotated, Any, NamedTuple

import numpy as np
import xarray as xr

from feeler.decoding.classifiers import make_fitting_lda, make_lda
from feeler.decoding.codes import CODES, JointFit, encode_with, fit_null, make_null
from feeler.decoding.plan import Plan
from feeler.decoding.reader import READERS, Reader
from feeler.decoding.sweep import Sweep, compute_sweep
from feeler.dispersion.index import check_tensors
from feeler.records.checked import checked
from feeler.task.noise import NOISES, Common
from feeler.tensors.scaling import label_like
from feeler.tensors.sides import measure_peak, mirror_to_left

_MAIN_NOISES = ("relative",)
"""The paper's own noise; it reads activations (``joint``) and tensors (``raw``)."""


class Curve(NamedTuple):
    """Which curve.

    Attributes
    ----------
    noise : str
        Name of the model; ``relative`` is to each tensor for tensors, to each vector for codes.
    when : str
        Noise ``after`` encoding (the paper) or ``before``.
    """

    group: str
    kind: str
    noise: str
    n_copies: int
    when: str = "after"


@dataclass(frozen=True, kw_only=True, eq=False)
class Group:
    """One condition of a comparison: its tensors, labels, fitted encoder and codes.

    Attributes
    ----------
    tensors : np.ndarray
        Non-negative (trial, sensor, time), on a scale common to all groups.
    null : JointFit | None
        Jointly fitted codes of one tensor of the group, repeated; None: made where needed.
    """

    tensors: np.ndarray
    labels: np.ndarray
    encoder: Any = None
    codes: dict[str, np.ndarray] = field(default_factory=dict, repr=False)
    null: JointFit | None = None


@dataclass(frozen=True, kw_only=True, eq=False)
class Curves:
    """Sweeps of all groups, and what each must be read beside.

    Attributes
    ----------
    nulls : dict[Curve, Sweep]
        The same pipelines on one single tensor repeated, labelled as if it were different touches:
        of every group for jointly fitted codes, of the first for fixed ones.
    baselines : dict[str, Sweep]
        Peak position and time only, by group, noise on the tensors at one common level.
    fits : dict[str, JointFit]
        Jointly fitted codes of the null, by group.
    """

    sweeps: dict[Curve, Sweep]
    nulls: dict[Curve, Sweep]
    baselines: dict[str, Sweep]
    noises: tuple[str, ...]
    n_copies: int
    fits: dict[str, JointFit] = field(default_factory=dict, repr=False)

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
        """The null of a kind of code: of jointly fitted ones the group's own, or the first."""
        wanted = (kind, noise, n_copies or self.n_copies)
        found = {
            c.group: s for c, s in self.nulls.items() if (c.kind, c.noise, c.n_copies) == wanted
        }
        return (
            found.get(group) if group and kind == "joint" else next(iter(found.values()), None)
        )


def compute_curves(
    groups: Mapping[str, Group],
    plan: Plan,
    *,
    kinds: Sequence[str] = CODES,
    noises: Sequence[str] | None = None,
    reader: str | Reader = "lda",
    random_state: Annotated[int, "≥ 0"] = 0,
    report: Callable[[str], None] = lambda line: None,
) -> Curves:
    """Every curve of the plan for every group, with null and baseline made from the groups.

    Parameters
    ----------
    groups
        Conditions to compare, e.g. three speeds; the first one also gives the null of fixed codes
        its tensor.
    kinds
        Codes to compare; each group must hold them.
    noises
        Names of noise models; by default all registered ones whose size is a share.
    reader
        Who reads the codes, or its name (:data:`READERS`). ``lda``, the paper's, has as many
        components as the copies can give. The ideal observer and the templates are told the noise,
        and so are not asked about noise that is added before encoding.
    """
    shares = (name for name, model in NOISES.items() if model.is_share)
    noises = tuple(shares if noises is None else noises)
    # None: each sweep makes an LDA with as many components as its copies can give
    fixed: Any = None if reader == "lda" else reader
    fixed = READERS[fixed]() if isinstance(fixed, str) else fixed
    told = getattr(fixed, "knows_noise", False)
    peaks = {
        kind: measure_peak(*(group.codes[kind] for group in groups.values())) for kind in kinds
    }

    fewer = replace(plan, n_repeats=plan.control_repeats or plan.n_repeats)

    def sweep(
        codes: Mapping[str, np.ndarray], labels: np.ndarray, kind: str, main: Sequence[str]
    ) -> dict[Curve, Sweep]:
        """Those noises with all repeats that are ``main``, the others with those of controls."""
        return {
            curve: found
            for model in noises
            for curve, found in _sweep_kind(
                codes,
                labels,
                kind,
                model,
                peaks[kind],
                plan if model in main else fewer,
                random_state,
                fixed,
            ).items()
        }

    sweeps: dict[Curve, Sweep] = {}
    for name, group in groups.items():
        for kind in kinds:
            main = _MAIN_NOISES if kind in ("joint", "raw") else ()
            sweeps |= sweep({name: group.codes[kind]}, group.labels, kind, main)
        report(f"{name}: {len(kinds)} codes")
    # noise on tensors is no known noise of their codes
    if plan.before_repeats and not told:
        before = [kind for kind in kinds if kind == "sparse"]
        sweeps |= _sweep_before(groups, before, noises, plan, random_state, fixed)
    reference = next(iter(groups))
    fits = {}
    if "joint" in kinds:
        fits = {
            name: group.null or fit_null(group.tensors, group.encoder, plan.null_iter)
            for name, group in groups.items()
        }
    nulls: dict[Curve, Sweep] = {}
    for kind in kinds:
        codes = {name: fit.codes for name, fit in fits.items()}
        if kind != "joint":
            codes = {reference: _repeat_code(groups[reference], kind)}
        nulls |= sweep(codes, groups[reference].labels, kind, ())
    peak = measure_peak(*(group.tensors for group in groups.values()))
    baselines = {
        name: compute_baseline(group, plan, peak, random_state)
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


def _sweep_kind(
    codes, labels, kind, model, peak, plan: Plan, random_state, reader
) -> dict[Curve, Sweep]:
    """Main curves with one noise, and the other numbers of copies at the probe ratio."""
    found = {}
    noise = NOISES[model]().suit(
        each="tensor" if kind == "raw" else "vector", reference=float(peak)
    )
    jobs = [(plan.n_copies, plan.ratios, plan.n_repeats)]
    if model == "relative":
        jobs += [(n, (plan.probe,), plan.other_repeats) for n in plan.other_copies]
    for name, array in codes.items():
        for n_copies, ratios, n_repeats in jobs:
            estimator = reader or make_fitting_lda(len(labels), n_copies)
            rotate = not getattr(estimator, "knows_noise", False) and kind == "raw"
            found[Curve(name, kind, model, n_copies)] = compute_sweep(
                array,
                labels,
                ratios=ratios,
                n_copies=n_copies,
                n_repeats=n_repeats,
                estimator=estimator,
                noise=noise,
                rotate=rotate and noise.is_even(array),
                random_state=random_state,
            )
    return found


def _sweep_before(
    groups, kinds, noises, plan: Plan, random_state, reader
) -> dict[Curve, Sweep]:
    """Noise on the tensors, rectified as the encoder needs, then encoded on the fixed bases."""
    peak = measure_peak(*(group.tensors for group in groups.values()))
    found = {}
    for name in list(groups)[: None if plan.before_all else 1]:
        group = groups[name]
        for kind in kinds:

            def encode_noisy(noisy, group=group, kind=kind):
                # noise goes both ways: that half of it is set to 0 is no loss to warn of
                return encode_with(np.maximum(noisy, 0), group.encoder, kind)

            for model in noises if plan.before_all else ("common",):
                found[Curve(name, kind, model, plan.before_copies, "before")] = compute_sweep(
                    group.tensors,
                    group.labels,
                    ratios=(plan.probe,),
                    n_copies=plan.before_copies,
                    n_repeats=plan.before_repeats,
                    noise=NOISES[model]().suit(reference=peak),
                    encode=encode_noisy,
                    estimator=reader or make_fitting_lda(len(group.labels), plan.before_copies),
                    random_state=random_state,
                )
    return found


def _repeat_code(group: Group, kind: str) -> np.ndarray:
    """One code of the fixed bases, as often as there are trials."""
    null = make_null(group.tensors)
    return np.repeat(encode_with(null[:1], group.encoder, kind), len(null), axis=0)


class PeakEncoder:
    """Position and time of a tensor's greatest entry, each as a fraction in [0, 1]; of touches
    whose coordinate ``side`` is "right", of their mirror images (``mirror_to_left``).

    A peak is known to its sample only, so a uniform dither of one sample is added: without it the
    copies of a trial would be identical and the classifier's within-class spread 0.

    Parameters
    ----------
    random_state
        Seed of the dither.
    """

    @checked
    def __init__(self, random_state: Annotated[int, "≥ 0"] = 0):
        self._rng = np.random.default_rng(random_state)

    def __call__(self, tensors: Any) -> Any:
        """(trial, 2, 1): position along the antenna, time."""
        away = mirror_to_left(tensors) if isinstance(tensors, xr.DataArray) else tensors
        array = check_tensors(away, least=1)
        _, n_sensors, n_samples = array.shape
        peak = np.unravel_index(
            array.reshape(len(array), -1).argmax(axis=1), (n_sensors, n_samples)
        )
        dither = self._rng.uniform(-0.5, 0.5, (len(array), 2))
        found = ((np.stack(peak, axis=1) + 0.5 + dither) / (n_sensors, n_samples))[:, :, None]
        return label_like(found, tensors, ("trial", "component", "time"), "peak")


def compute_baseline(
    group: Group, plan: Plan, peak: float, random_state: Annotated[int, "≥ 0"] = 0
) -> Sweep:
    """Accuracy from the peak's position and time alone, in common noise on the tensors."""
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
