"""Accuracy curves of a comparison with their nulls and baselines."""

import warnings
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Annotated, Any, NamedTuple

import numpy as np
import xarray as xr
from sklearn.base import clone

from feeler.analysis.indices import check_tensors
from feeler.decoding.classifiers import CLASSIFIERS, Classifier, make_labels, make_lda
from feeler.decoding.sweeps import Plan, Sweep, compute_sweep
from feeler.errors import InvalidInput, ModelValidityWarning
from feeler.objects.noise import NOISES, Common, Relative
from feeler.renamed import rename_arguments
from feeler.tensors.transforms import (
    MUCH,
    find_right,
    fold_signs,
    label_like,
    measure_negative,
    measure_peak,
    mirror_to_left,
    rectify,
    require_variables,
    stack_planes,
)
from feeler.validation import Count, Seed, checked

# The codes that a classifier can be given, and two tests of those fitted with their bases.
#
# The tests are identical touches, which tell nothing, and every touch twice.

CODES = ("joint", "sparse", "ridge", "raw")
"""Kinds of code; ``feeler.encoding.LABELS`` has a label for each.

``joint`` activations are fitted together with the bases (the paper's recipe); ``sparse`` and
``ridge`` ones belong to fixed bases, with and without the sparseness constraint; ``raw`` is the
tensors themselves.
"""


@checked
def make_codes(tensors: Any, encoder: Any, kinds: Sequence[str] = CODES) -> dict[str, Any]:
    """Every kind of code of the same tensors, after one fit of the bases.

    Parameters
    ----------
    tensors
        Non-negative (trial, sensor, time).
    encoder
        An unfitted encoder such as :class:`feeler.encoding.ConvolutiveNMF`; it is fitted here. None
        where only ``raw`` is asked for.
    kinds
        Any of joint, sparse, ridge, raw.
    """
    array = check_tensors(tensors, least=1)
    if unknown := [kind for kind in kinds if kind not in CODES]:
        raise InvalidInput(f"unknown code {unknown[0]!r}; known: {', '.join(CODES)}.")
    codes = {}
    if set(kinds) - {"raw"}:
        if encoder is None:
            raise InvalidInput("codes need an encoder; only 'raw' does without.")
        codes["joint"] = encoder.fit(array).activations_
    codes |= {kind: encode_with(array, encoder, kind) for kind in kinds if kind != "joint"}
    dims = {
        kind: ("trial", "sensor" if kind == "raw" else "component", "time") for kind in kinds
    }
    return {kind: label_like(codes[kind], tensors, dims[kind], kind) for kind in kinds}


@checked
def encode_with(
    tensors: Annotated[np.ndarray, "trial sensor time"], encoder: Any, kind: str
) -> Any:
    """New tensors in one kind of code; jointly fitted activations do not exist for new tensors."""
    if kind == "joint":
        raise InvalidInput(
            "joint activations exist only for the tensors of the fit; use 'sparse' or 'ridge'."
        )
    if kind == "raw":
        return tensors
    if encoder is None:
        raise InvalidInput(f"the code {kind!r} needs an encoder; only 'raw' does without.")
    return encoder.transform(tensors, code=kind)


@checked
def make_null(tensors: Any, n_copies: Count | None = None) -> np.ndarray:
    """One and the same tensor, as often as there were trials.

    A pipeline that discriminates these measures itself.

    The tensor with the median energy of the set is taken. Whatever accuracy above chance the copies
    reach, labelled as if they were different touches, comes from the method and not from touch.
    """
    array = check_tensors(tensors, least=1)
    energy = (array**2).sum(axis=(1, 2))
    typical = np.argsort(energy, kind="stable")[len(array) // 2]
    return np.repeat(array[typical][None], n_copies or len(array), axis=0)


@dataclass(frozen=True, kw_only=True, eq=False)
class JointFit:
    """Jointly fitted codes, and how the fit ended.

    Attributes
    ----------
    codes : np.ndarray
        (trial, component, time)
    converged : bool
        Whether the fit ended by its tolerance, not by its iterations.
    """

    codes: np.ndarray
    n_iter: int
    converged: bool


@dataclass(frozen=True, kw_only=True, eq=False)
class DuplicateControl:
    """Accuracies on the codes of a set in which every touch stands twice.

    Attributes
    ----------
    same : Sweep
        Trained and tested on noisy copies of the first twins, as in the paper's recipe.
    other : Sweep
        Tested on copies of the second twins: what of the accuracy belongs to the touch.
    """

    same: Sweep
    other: Sweep
    fitted: JointFit

    @property
    def kept(self) -> float:
        """Share of the accuracy above chance that carries over to the twin; at least 0."""
        above = self.same.ratios > 0
        height = self.same.noisy[above].mean() - self.same.chance
        return (
            float(max(self.other.noisy[above].mean() - self.other.chance, 0.0) / height)
            if height > 0
            else 0.0
        )


def configure(encoder: Any, settings: Mapping[str, Any]) -> Any:
    """An unfitted copy of an encoder with those of the settings that it knows."""
    known = encoder.get_params()
    return clone(encoder).set_params(
        **{key: value for key, value in settings.items() if key in known}
    )


def _fit_jointly(tensors: np.ndarray, encoder: Any, plan: Plan) -> JointFit:
    """Codes of one joint fit of the plan's effort, where the encoder has such limits; only the
    start that is ahead after a third of the iterations goes on, since no other's codes are used.
    """
    settings = {"max_iter": plan.null_iter, "n_restarts": plan.null_restarts, "n_finished": 1}
    fitted = configure(encoder, settings).fit(tensors)
    done = int(getattr(fitted, "n_iter_", 0))
    return JointFit(codes=fitted.activations_, n_iter=done, converged=done < plan.null_iter)


def fit_null(tensors: np.ndarray, encoder: Any, plan: Plan) -> JointFit:
    """Joint codes of one tensor, repeated as if it were different touches."""
    return _fit_jointly(make_null(tensors), encoder, plan)


def compare_twins(
    tensors: np.ndarray,
    labels: np.ndarray,
    encoder: Any,
    plan: Plan,
    *,
    random_state: Seed = 0,
) -> DuplicateControl:
    """Each tensor twice in one joint fit; one twin is learned, the other is tested.

    A code that belongs to the touch gives both twins the same, and then both accuracies are equal.
    """
    fitted = _fit_jointly(np.concatenate([tensors, tensors]), encoder, plan)
    first, second = np.split(fitted.codes, 2)
    options: dict[str, Any] = {
        "ratios": plan.ratios,
        "n_copies": plan.n_copies,
        "n_repeats": plan.n_repeats,
        "noise": Relative(each="vector"),
        "estimator": make_lda(),
        "random_state": random_state,
    }
    return DuplicateControl(
        same=compute_sweep(first, labels, **options),
        other=compute_sweep(first, labels, held_out=(second, labels), **options),
        fitted=fitted,
    )


# All accuracy curves of one comparison, with their null and their baseline.

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


@rename_arguments(reader="classifier")
def compute_curves(
    groups: Mapping[str, Group],
    plan: Plan,
    *,
    kinds: Sequence[str] = CODES,
    noises: Sequence[str] | None = None,
    classifier: str | Classifier = "lda",
    random_state: Seed = 0,
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
    classifier
        Who reads the codes, or its name (:data:`CLASSIFIERS`). ``lda``, the paper's, has as many
        components as the copies can give. The ideal observer and the templates are told the noise,
        and so are not asked about noise that is added before encoding.
    """
    shares = (name for name, model in NOISES.items() if model.is_share)
    noises = tuple(shares if noises is None else noises)
    # None: each sweep makes an LDA with as many components as its copies can give
    fixed: Any = None if classifier == "lda" else classifier
    fixed = CLASSIFIERS[fixed]() if isinstance(fixed, str) else fixed
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
            name: group.null or fit_null(group.tensors, group.encoder, plan)
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
        name: compute_sweep(
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
    codes, labels, kind, model, peak, plan: Plan, random_state, classifier
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
            found[Curve(name, kind, model, n_copies)] = compute_sweep(
                array,
                labels,
                ratios=ratios,
                n_copies=n_copies,
                n_repeats=n_repeats,
                estimator=classifier or make_lda(),
                noise=noise,
                random_state=random_state,
            )
    return found


def _sweep_before(
    groups, kinds, noises, plan: Plan, random_state, classifier
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
                    estimator=classifier or make_lda(),
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
    def __init__(self, random_state: Seed = 0):
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


# Two comparisons: one antenna at several speeds, several antennas at the slowest speed.


@checked
def group_tensors(
    tensors: Mapping[str, Any],
    encoder: Any,
    plan: Plan,
    *,
    quantity: str = "angle",
    reference: str = "exponential",
    random_state: Seed = 0,
) -> dict[str, dict[str, Group]]:
    """Both comparisons of ``list_groups``, encoded, with a null of jointly fitted codes; by speed
    of one fit of them all, by profile of one fit each.
    """
    settings = {"random_state": random_state}
    listed = list_groups(tensors, quantity=quantity, reference=reference)
    groups: dict[str, dict[str, Group]] = {}
    nulls: dict[
        bytes, JointFit
    ] = {}  # the slow touches of the reference stand in both comparisons

    def find_null(array: np.ndarray) -> JointFit:
        if (key := array.tobytes()) not in nulls:
            nulls[key] = fit_null(array, configure(encoder, settings), plan)
        return nulls[key]

    if "speed" in listed:
        fitted = configure(encoder, settings)
        ends = np.cumsum([len(array) for array, _ in listed["speed"].values()])[:-1]
        codes = make_codes(
            np.concatenate([array for array, _ in listed["speed"].values()]), fitted
        )
        parts = {kind: np.split(code, ends) for kind, code in codes.items()}
        groups["speed"] = {
            name: Group(
                tensors=a,
                labels=y,
                encoder=fitted,
                codes={kind: parts[kind][k] for kind in parts},
                null=find_null(a),
            )
            for k, (name, (a, y)) in enumerate(listed["speed"].items())
        }
    if "profile" in listed:
        groups["profile"] = {}
        for name, (array, labels) in listed["profile"].items():
            fitted = configure(encoder, settings)
            codes = make_codes(array, fitted)
            fields = {"encoder": fitted, "codes": codes, "null": find_null(array)}
            groups["profile"][name] = Group(tensors=array, labels=labels, **fields)
    return groups


@checked
def list_groups(
    tensors: Mapping[str, Any], *, quantity: str = "angle", reference: str = "exponential"
) -> dict[str, dict[str, tuple[np.ndarray, np.ndarray]]]:
    """Tensors and labels of every group, rectified, on one scale, in one order of stimuli.

    ``speed``: the reference antenna at each speed, slowest first; ``profile``: all antennas at the
    slowest speed. A comparison with one group only is left out.

    Touches from the right are mirrored first (:func:`feeler.tensors.mirror_to_left`). Trials that
    do not say their side, as of antennas touched on both, or in space of an azimuth other than 0,
    may bend both ways: where more than a quarter of such a trial's sum of squares is negative,
    bending both ways is kept in all groups, as further sensors
    (:func:`feeler.tensors.fold_signs`), with a ``ModelValidityWarning`` warning.
    """
    if reference not in tensors:
        raise InvalidInput(
            f"no tensors of the reference antenna {reference!r}; given: {', '.join(tensors)}."
        )
    for data in tensors.values():
        require_variables(data, quantity, "speed")
    units = {one[quantity].attrs.get("units", "no unit"): name for name, one in tensors.items()}
    if len(units) > 1:
        raise InvalidInput(
            f"{quantity} is in {' and in '.join(units)} ({', '.join(units.values())}): take all in"
            " one unit, feeler.tensors.in_unit."
        )
    # tensors (trial, sensor, time) ≥ 0 of all sets, made in one way
    sets = {name: stack_planes(mirror_to_left(one[quantity])) for name, one in tensors.items()}
    lost = max(_measure_other_way(one) for one in sets.values())
    if lost > MUCH:
        text = (
            "much of a touch's signal is bending the other way, which rectifying would remove:"
            " bending both ways is kept, as twice the sensors."
        )
        share = f"Up to {lost:.0%} of a touch's sum of squares."
        warnings.warn(ModelValidityWarning(text, share), stacklevel=3)
    keep = fold_signs if lost > MUCH else rectify
    arrays = {name: keep(one).values for name, one in sets.items()}
    peak = measure_peak(*arrays.values())
    if not peak > 0:
        raise InvalidInput(
            f"no tensor has a {quantity} other than 0: did any contact take place?"
        )
    speed = np.asarray(tensors[reference]["speed"])

    def pick(name: str, wanted: float) -> tuple[np.ndarray, np.ndarray]:
        every = make_labels(tensors[name])
        trials = np.flatnonzero(np.asarray(tensors[name]["speed"]) == wanted)
        trials = trials[np.argsort(every[trials], kind="stable")]
        return arrays[name][trials] / peak, every[trials]

    listed = {
        "speed": {f"{v:g} m/s": pick(reference, v) for v in np.unique(speed)},
        "profile": {name: pick(name, speed.min()) for name in tensors},
    }
    wanted = listed["profile"][reference][1]
    for name, (_, labels) in listed["profile"].items():
        if not np.array_equal(labels, wanted):
            odd = sorted({*labels.tolist()} ^ {*wanted.tolist()}) or ["another number of each"]
            raise InvalidInput(
                f"{name!r} and {reference!r} were not touched alike at {speed.min():g} m/s (in one"
                f" of them only: {', '.join(odd[:3])}): give sets of the same touches."
            )
    return {comparison: groups for comparison, groups in listed.items() if len(groups) > 1}


def _measure_other_way(tensors: Any) -> float:
    """The greatest negative share of those trials whose direction no label says."""
    share = measure_negative(tensors)
    if find_right(tensors) is not None:
        known = np.isin(tensors["side"], ("left", "right"))
        share = share[~(known & (np.asarray(tensors.coords.get("azimuth", 0.0)) == 0))]
    return float(share.max(initial=0.0))
