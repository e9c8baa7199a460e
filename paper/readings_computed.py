"""The rows of :mod:`paper.readings`: every declared reading, computed where a stage of the run
holds what it needs.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from copy import copy
from dataclasses import dataclass, field
from functools import lru_cache
from itertools import product
from types import SimpleNamespace
from typing import Any

import numpy as np

from feeler.analysis.dispersion import bootstrap_mean, compute_dispersion
from feeler.decoding import compute_sweep, make_labels
from feeler.decoding.classifiers import PrincipalComponents, fit_lda, make_lda
from feeler.decoding.curves import configure, encode_with, make_null
from feeler.execute.workers import ThreadExecutor
from feeler.objects.noise import Common, Relative
from feeler.report import Section
from feeler.tensors import rectify
from feeler.wall.distance import SETUP_CHOICES, SUBSTEPS
from paper import fig3, fig4, fig5_data, fig5f
from paper.context import Context
from paper.data import (
    CLAIMED,
    WINDOWS,
    complete_tensors,
    find_end,
    list_profiles,
    list_speeds,
    load_complete,
    load_tensors,
    select_speed,
)
from paper.fig5_sparse import cut_spans, list_groups, measure_hoyer
from paper.readings import FILE, Reading, Sentence, load_sentences, make_rows

_N_COMPONENTS = 30  # [P]

# The wall: R² and place of greatest curvature of every declared configuration, from the figure.


def _compute_wall(sentence: Sentence, context: Context, section: Section) -> Iterator[Reading]:
    found = fig3.compute(context)
    family, ends = found.family, found.main_r2
    if family is None or len(family.names) < 2:
        return
    numbers = family.offset if sentence.measure == "wall offset" else family.r2
    for choice, values in zip(family.choices, numbers, strict=True):
        named = dict(zip(SETUP_CHOICES, choice, strict=True))
        chosen = {
            "angle": f"{named['inter_antennal_angle']:g}",
            "friction": f"{named['friction']:g}",
            "hook": f"{named['hook_share']:g}",
            "tip": f"{named['tip_heading']:g}",
            "measure": f"{named['quantity']} {named['method']}",
        }
        by_name: dict[str, Any] = dict(zip(family.names, map(float, values), strict=True))
        if sentence.is_main(chosen) and numbers is family.r2:
            by_name = {
                name: (value, *ends[name], len(SUBSTEPS)) for name, value in by_name.items()
            }
        yield chosen, by_name, {}


# Encoding: residual and entropy by the number of bases; entropy of the bases by profile.


def _compute_ranks(sentence: Sentence, context: Context, section: Section) -> Iterator[Reading]:
    data, null = fig4.compute(context), _fit_identical(context)
    residual = sentence.id == "residual-falls"
    sets = {"": data.residual} if residual else data.entropy
    for entropy, fit in product(sets, ("best of all starts", "one start")):
        chosen = {"fit": fit} if residual else {"entropy": entropy, "fit": fit}
        by_rank = {f"M{rank}": row for rank, row in zip(data.ranks, sets[entropy], strict=True)}
        yield chosen, by_rank, null["residual" if residual else entropy]


@lru_cache(maxsize=1)
def _fit_identical(context: Context) -> dict[str, dict[str, float]]:
    """Residual, and entropies of the activations, of one typical touch by the number of bases: the
    fit of identical touches is that of one.
    """
    tensors = fig4.prepare(load_tensors(context, list_profiles(context)[0]))
    found: dict[str, dict[str, float]] = {}
    for rank in context.effort.ranks:
        encoder = context.effort.make_encoder(
            n_components=rank, n_restarts=1, random_state=context.seed
        )
        if (
            rank * encoder.n_lags > tensors.shape[-1]
        ):  # one touch is too short for so many bases
            continue
        encoder = encoder.fit(make_null(tensors, 1))
        found.setdefault("residual", {})[f"M{rank}"] = float(encoder.relative_residual_)
        for name, measure in fig4.ENTROPIES.items():
            found.setdefault(name, {})[f"M{rank}"] = measure(encoder.activations_)
    return found


def _compute_bases(sentence: Sentence, context: Context, section: Section) -> Iterator[Reading]:
    names = [name for name in CLAIMED if name in list_profiles(context)]
    quantities, constraints = ("angle", "curvature"), ("each trial", "whole recording")
    for quantity, constraint, window in product(quantities, constraints, WINDOWS):
        found, null = _measure_bases(context, tuple(names), quantity, constraint, window)
        for entropy in found:
            chosen = {"entropy": entropy, "quantity": quantity}
            chosen |= {"constraint": constraint, "window": window}
            yield chosen, found[entropy], null[entropy]


@lru_cache(maxsize=8)
def _measure_bases(
    context: Context, names: tuple[str, ...], quantity: str, constraint: str, window: str
) -> tuple[dict, dict]:
    """Mean entropy of the bases by definition and profile, best start with the ends of all, and of
    one touch.
    """
    arrays = _collect_arrays(context, "profile", quantity, window)
    known = fig5f.compute(context).windows.get(window) if quantity == "angle" else None
    if known is None or constraint != "each trial":
        known = SimpleNamespace(encoders={})
    found: dict[str, dict[str, Any]] = {name: {} for name in fig5f.READINGS}
    null: dict[str, dict[str, float]] = {name: {} for name in fig5f.READINGS}
    for name in names:
        encoder = context.effort.make_encoder(
            n_restarts=context.effort.side_restarts,
            constraint=_CONSTRAINTS[constraint],
            random_state=context.seed,
        )
        # of one touch both constraints say the same: it is fitted once for both
        alone = copy(encoder).set_params(n_restarts=1, constraint="trial")
        alone.fit(make_null(arrays[name], 1))
        encoder = known.encoders.get(name) or encoder.fit(arrays[name])
        for definition, measure in fig5f.READINGS.items():
            starts = [float(np.nanmean(measure(one))) for one in encoder.restart_components_]
            ends = (min(starts), max(starts)) if len(starts) > 1 else (np.nan, np.nan)
            found[definition][name] = (starts[0], *ends, len(starts))
            null[definition][name] = float(np.nanmean(measure(alone.components_)))
    return found, null


# Tensors and codes of every group.

_CONSTRAINTS = {"each trial": "trial", "whole recording": "all"}
_CODES = ("joint", "sparse", "ridge")


@lru_cache(maxsize=16)
def _collect_arrays(
    context: Context, comparison: str, quantity: str, window: str
) -> dict[str, np.ndarray]:
    """Rectified tensors (trial, sensor, time) of every group, in order of label; slow touches of
    each profile, or of the first profile at each speed.
    """
    profiles = list_profiles(context)
    arrays = {}
    if comparison == "profile":
        slow = min(list_speeds(context, profiles[0]).values())
        for name in profiles:
            data = (
                select_speed(load_tensors(context, name), slow)
                if window == WINDOWS[0]
                else complete_tensors(load_complete(context, name))
            )
            arrays[name] = _order(data, quantity)
        return {name: arrays[name] for name in arrays if name in CLAIMED or len(profiles) < 2}
    for name, speed in reversed(list_speeds(context, profiles[0]).items()):
        data = select_speed(load_tensors(context, profiles[0]), speed)
        if window == WINDOWS[1]:
            if speed == min(list_speeds(context, profiles[0]).values()):
                data = load_complete(context, profiles[0])
            data = data.isel(time=data["time"].values < find_end(data))
        arrays[name] = _order(data, quantity)
    return arrays


def _order(data: Any, quantity: str) -> np.ndarray:
    array = rectify(data[quantity].transpose("trial", "sensor", "time").values)
    return array[np.argsort(make_labels(data), kind="stable")]


@dataclass(frozen=True, kw_only=True)
class _Codes:
    """Codes of every group (trial, component, time), by kind: a list of those of every start, the
    best first; and of identical touches.
    """

    real: dict[str, dict[str, list[np.ndarray]]] = field(default_factory=dict)
    null: dict[str, dict[str, np.ndarray]] = field(default_factory=dict)

    def keep(self, kind: str, group: str, starts: list[np.ndarray], null: np.ndarray) -> None:
        """Add those of one kind and group."""
        self.real.setdefault(kind, {})[group] = starts
        self.null.setdefault(kind, {})[group] = null


@lru_cache(maxsize=8)
def _encode(context: Context, comparison: str, constraint: str, window: str) -> _Codes:
    """Codes of the groups: by speed of one fit, by profile of one each; of the report's own fits
    where it has them.
    """
    codes = _Codes()
    arrays = _collect_arrays(context, comparison, "angle", window)
    if constraint == "each trial":
        known = (
            fig5_data.compute(context).groups.get(comparison, {})
            if window == WINDOWS[0]
            else fig5_data.compute_codes(context).groups
        )
        names = fig5_data.name_speeds(context)
        ends = np.cumsum([len(group.tensors) for group in known.values()])[:-1]
        for k, (label, group) in enumerate(known.items()):
            name = names.get(label, label)
            if name not in arrays:
                continue
            starts = group.encoder.restart_activations_
            if comparison == "speed":
                starts = [np.split(one, ends)[k] for one in starts]
            codes.keep("joint", name, starts, group.null.codes)
            for kind in _CODES[1:]:
                code = group.codes.get(kind)
                code = encode_with(group.tensors, group.encoder, kind) if code is None else code
                codes.keep(kind, name, [code], _repeat(group.encoder, group.tensors, kind))
        return codes
    parts = [arrays] if comparison == "speed" else [{name: a} for name, a in arrays.items()]
    peak = max(array.max() for array in arrays.values())
    for part in parts:
        _fit(context, codes, part, constraint, peak)
    return codes


def _fit(
    context: Context,
    codes: _Codes,
    arrays: Mapping[str, np.ndarray],
    constraint: str,
    peak: float,
) -> None:
    """Codes of groups from one fit of them all, and of as many identical touches of each."""
    settings = {"n_restarts": context.effort.side_restarts, "random_state": context.seed}
    fresh = context.effort.make_encoder(constraint=_CONSTRAINTS[constraint])
    whole = np.concatenate([*arrays.values()]) / peak
    same = np.concatenate([make_null(array) for array in arrays.values()]) / peak
    encoder = configure(fresh, settings).fit(whole)
    alone = configure(fresh, settings | {"n_restarts": 1}).fit(same)
    ends = np.cumsum([len(array) for array in arrays.values()])[:-1]
    for k, (name, array) in enumerate(arrays.items()):
        starts = [np.split(one, ends)[k] for one in encoder.restart_activations_]
        codes.keep("joint", name, starts, np.split(alone.activations_, ends)[k])
        for kind in _CODES[1:]:
            code = encode_with(array / peak, encoder, kind)
            codes.keep(kind, name, [code], _repeat(encoder, array / peak, kind))


def _repeat(encoder: Any, tensors: np.ndarray, kind: str) -> np.ndarray:
    """The code of a typical touch, as often as there are touches."""
    return np.repeat(encode_with(make_null(tensors, 1), encoder, kind), len(tensors), axis=0)


@lru_cache(maxsize=2)
def _encode_own(context: Context, constraint: str) -> dict[str, _Codes]:
    """By profile, codes of its touches at all speeds, from one fit of them all; by speed."""
    first, *controls = [name for name in list_profiles(context) if name in CLAIMED]
    found = {first: _encode(context, "speed", constraint, WINDOWS[0])}
    speeds = list_speeds(context, first)
    for name in controls:
        if list_speeds(context, name) != speeds:
            continue
        data = load_tensors(context, name)
        parts = {
            speed: _order(select_speed(data, value), "angle")
            for speed, value in reversed(speeds.items())
        }
        codes = _Codes()
        _fit(context, codes, parts, constraint, max(array.max() for array in parts.values()))
        found[name] = codes
    return found


# Classification, and the variance that principal components keep.


def fit_components(codes: np.ndarray) -> PrincipalComponents:
    """The first 30 principal components of flattened codes, fewer where there are none."""
    flat = codes.reshape(len(codes), -1)
    return PrincipalComponents(min(_N_COMPONENTS, len(flat) - 1, flat.shape[1])).fit(flat)


def scale_noise(codes: np.ndarray, scaling: str, peak: float) -> np.ndarray:
    """Standard deviation (trial, vector) of noise of ratio 1."""
    tops = codes.max(axis=2)
    if scaling == "each vector":
        return tops
    return np.broadcast_to(
        tops.max(axis=1, keepdims=True) if scaling == "each touch" else peak, tops.shape
    )


def classify_projected(
    codes: np.ndarray,
    components: PrincipalComponents,
    sd: np.ndarray,
    *,
    ratios: Sequence[float],
    n_copies: int,
    n_repeats: int,
    rng: np.random.Generator,
) -> tuple[np.ndarray, np.ndarray]:
    """Accuracy of LDA with components that the noise does not enter, each touch a class.

    Gaussian noise stays Gaussian under a projection: its covariance there is Σ_v sd_v² A_v A_vᵀ,
    with the part A_v of the components that belongs to vector v. So copies are drawn in 30
    dimensions, not in the thousands of the codes, and one draw serves all ratios.

    Parameters
    ----------
    codes
        (trial, vector, time).
    sd
        Of noise of ratio 1 (trial, vector).

    Returns
    -------
    noisy, clean : np.ndarray
        Accuracy on other noisy copies and on the originals (ratio, repeat).
    """
    n, n_vectors, n_times = codes.shape
    axes = components.components_
    parts = axes.reshape(len(axes), n_vectors, n_times)
    grams = np.einsum("kvt,lvt->vkl", parts, parts, optimize=True)
    energy, turn = np.linalg.eigh(np.einsum("nv,vkl->nkl", sd**2, grams, optimize=True))
    root = turn * np.sqrt(np.maximum(energy, 0))[:, None]
    places = (codes.reshape(n, -1) - components.mean_) @ axes.T
    noisy, clean = np.empty((len(ratios), n_repeats)), np.empty((len(ratios), n_repeats))
    own = np.arange(n)
    every = np.tile(own, n_copies)
    for repeat in range(n_repeats):
        drawn = rng.standard_normal((2, n_copies, n, len(axes)))
        noise = np.einsum("nkl,scnl->scnk", root, drawn, optimize=True)
        for k, ratio in enumerate(ratios):
            train, test = (places + ratio * noise).reshape(2, every.size, -1)
            classify = fit_lda(train, every)
            noisy[k, repeat] = np.mean(classify(test) == every)
            clean[k, repeat] = np.mean(classify(places) == own)
    return noisy, clean


def _compute_lda(sentence: Sentence, context: Context, section: Section) -> Iterator[Reading]:
    comparison = "profile" if "window" in sentence.main else "speed"
    windows = WINDOWS if comparison == "profile" else WINDOWS[:1]
    sets: list[tuple[dict[str, str], Any, Any]] = []
    for window in windows:
        named = {"window": window} if comparison == "profile" else {}
        arrays = _collect_arrays(context, comparison, "angle", window)
        same = {name: np.repeat(make_null(a, 1), len(a), axis=0) for name, a in arrays.items()}
        sets.append(({"code": "tensors"} | named, {n: [a] for n, a in arrays.items()}, same))
        for constraint, code in product(_CONSTRAINTS, _CODES):
            if window == WINDOWS[1] and constraint != "each trial":
                continue
            codes = _encode(context, comparison, constraint, window)
            chosen = {"code": code, "constraint": constraint} | named
            if code in codes.real:
                sets.append((chosen, codes.real[code], codes.null[code]))
    pipelines: list[tuple[Any, ...]] = []
    for chosen, real, null in sets:
        for components in ("all clean", "group's clean", "noisy copies"):
            scalings = ("each vector", "each touch", "all touches")
            for scaling in scalings[chosen["code"] == "tensors" :]:
                base = {"components": components, "scaling": scaling} | chosen
                main = all(sentence.main.get(key) == value for key, value in base.items())
                pipelines.append((base, real, null, None, main))
    if comparison == "profile":
        pipelines += _list_own(context)
    with ThreadExecutor() as pool:  # the last section of a run, when no other keeps a core busy
        for found in pool.map(lambda one: [*_classify(context, *one)], pipelines):
            yield from found


def _classify(
    context: Context,
    chosen: dict[str, str],
    real: Mapping[str, list[np.ndarray]],
    null: Mapping[str, np.ndarray],
    fitted: Callable[[Mapping[str, np.ndarray], str], np.ndarray] | None = None,
    main: bool = False,
) -> Iterator[Reading]:
    """Both tests of one pipeline: each start's accuracy, and that of identical touches; of the
    ``main`` one with the paper's repeats and of every start.
    """
    plan = context.effort.plan
    n_repeats = plan.n_repeats if main else plan.control_repeats or plan.n_repeats
    n_starts = min(len(starts) for starts in real.values())
    n_starts = n_starts if main else min(n_starts, context.effort.control_restarts)
    sets = [{name: starts[k] for name, starts in real.items()} for k in range(n_starts)]
    if chosen["components"] == "noisy copies":
        sets = sets[:1]
    found = [_score(context, chosen, codes, fitted, n_repeats) for codes in sets]
    alone = {name: (1 / len(code),) * 2 for name, code in null.items()}  # of one code: chance
    if chosen["code"] == "joint":
        alone = _score(context, chosen, null, fitted, n_repeats)
    for k, test in enumerate(("noisy copies", "clean originals")):
        values = {name: np.array([one[name][k] for one in found]) for name in real}
        spreads = {name: one if len(one) > 1 else float(one[0]) for name, one in values.items()}
        yield {**chosen, "test": test}, spreads, {name: alone[name][k] for name in alone}


def _score(
    context: Context,
    chosen: Mapping[str, str],
    codes: Mapping[str, np.ndarray],
    fitted: Callable[[Mapping[str, np.ndarray], str], np.ndarray] | None,
    n_repeats: int,
) -> dict[str, tuple[float, float]]:
    """Accuracy on noisy copies and on clean originals of every group, mean over the noise."""
    plan = context.effort.plan
    ratios = [ratio for ratio in plan.ratios if ratio > 0]
    peak = max(float(code.max()) for code in codes.values())
    pooled = np.concatenate([*codes.values()]) if chosen["components"] == "all clean" else None
    shared = fit_components(pooled) if pooled is not None else None
    scores = {}
    for k, (name, code) in enumerate(codes.items()):
        if chosen["components"] == "noisy copies":
            scores[name] = _sweep_noisy(context, code, chosen, peak, ratios)
            continue
        components = shared or fit_components(code if fitted is None else fitted(codes, name))
        noisy, clean = classify_projected(
            code,
            components,
            scale_noise(code, chosen["scaling"], peak),
            ratios=ratios,
            n_copies=plan.n_copies,
            n_repeats=n_repeats,
            rng=np.random.default_rng((context.seed, k)),
        )
        scores[name] = float(noisy.mean()), float(clean.mean())
    return scores


def _sweep_noisy(
    context: Context,
    code: np.ndarray,
    chosen: Mapping[str, str],
    peak: float,
    ratios: Sequence[float],
) -> tuple[float, float]:
    plan, labels = context.effort.plan, np.arange(len(code))
    each: Any = "tensor" if chosen["scaling"] == "each touch" else "vector"
    noise = (
        Common(reference=peak) if chosen["scaling"] == "all touches" else Relative(each=each)
    )
    found = compute_sweep(
        code,
        labels,
        ratios=ratios,
        n_copies=plan.n_copies,
        n_repeats=1,  # of 300 tests at each of six ratios
        noise=noise,
        estimator=make_lda(),
        random_state=context.seed,
    )
    return float(found.noisy.mean()), float(found.clean.mean())


def trace_main(context: Context, comparison: str) -> dict[str, np.ndarray]:
    """Accuracy (ratio, repeat) of every group under the main reading of Fig. 5C–D: the best start's
    jointly fitted codes, components of all clean ones, noise relative to each vector.
    """
    plan = context.effort.plan
    real = _encode(context, comparison, "each trial", WINDOWS[0]).real["joint"]
    shared = fit_components(np.concatenate([starts[0] for starts in real.values()]))
    return {
        name: classify_projected(
            starts[0],
            shared,
            scale_noise(starts[0], "each vector", 0.0),
            ratios=[ratio for ratio in plan.ratios if ratio > 0],
            n_copies=plan.n_copies,
            n_repeats=plan.n_repeats,
            rng=np.random.default_rng((context.seed, k)),
        )[0]
        for k, (name, starts) in enumerate(real.items())
    }


def _list_own(context: Context) -> Iterator[tuple[Any, ...]]:
    """Of slow touches of every profile, with components of all its touches at all speeds, what
    :func:`_classify` is given.
    """
    for constraint in _CONSTRAINTS:
        sets = _encode_own(context, constraint)
        if len(sets) < len(CLAIMED):
            return
        for code, scaling in product(_CODES, ("each vector", "each touch", "all touches")):
            chosen = {"components": "profile's 90 clean", "scaling": scaling, "code": code}
            chosen |= {"constraint": constraint, "window": WINDOWS[0]}
            own = {
                name: np.concatenate([p[0] for p in c.real[code].values()])
                for name, c in sets.items()
            }
            same = {name: np.concatenate([*c.null[code].values()]) for name, c in sets.items()}
            real = {name: c.real[code]["slow"] for name, c in sets.items()}
            null = {name: c.null[code]["slow"] for name, c in sets.items()}
            firsts = {name: starts[:1] for name, starts in real.items()}
            pools = [own, same]

            def fitted(codes: Mapping[str, np.ndarray], name: str, pools=pools, null=null):
                return pools[codes is null][name]

            yield chosen, firsts, null, fitted


def _compute_variance(
    sentence: Sentence, context: Context, section: Section
) -> Iterator[Reading]:
    for constraint, code in product(_CONSTRAINTS, _CODES):
        codes = _encode(context, "speed", constraint, WINDOWS[0])
        if code not in codes.real:
            continue
        base = {"code": code, "constraint": constraint}
        starts = codes.real[code]
        n_starts = min(len(found) for found in starts.values())
        every = [{name: found[k] for name, found in starts.items()} for k in range(n_starts)]
        for components, variance, noise in product(
            ("all clean", "group's clean", "noisy copies"),
            ("clean", "noisy copies"),
            (0.1, 0.2, 0.3),
        ):
            chosen = {"components": components, "variance": variance} | base
            if components == "noisy copies" or variance == "noisy copies":
                chosen["noise"] = f"{100 * noise:g} %"
            elif noise > 0.1:
                continue
            sets = (
                every if sentence.is_main(chosen) else every[: context.effort.control_restarts]
            )
            kept = [_keep_variance(one, components, variance, noise) for one in sets]
            ends = (min(kept), max(kept)) if len(kept) > 1 else (np.nan, np.nan)
            same = _keep_variance(codes.null[code], components, variance, noise)
            yield chosen, {"kept": (kept[0], *ends, len(kept))}, {"kept": same}


def _keep_variance(
    codes: Mapping[str, np.ndarray], components: str, variance: str, noise: float
) -> float:
    """Share of the variance that 30 components keep: of all groups' codes, or of the first's."""
    first = next(iter(codes.values()))
    chosen = np.concatenate([*codes.values()]) if components == "all clean" else first
    n = len(chosen)
    sd = noise * scale_noise(chosen, "each vector", 0.0)[..., None]
    flat, rng = chosen.reshape(n, -1), np.random.default_rng(0)

    def draw() -> np.ndarray:
        copies = [chosen + sd * rng.standard_normal(chosen.shape) for _ in range(10)]
        return np.concatenate(copies).reshape(10 * n, -1)

    fitted = fit_components(chosen)
    if components == "noisy copies":
        fitted = PrincipalComponents(_N_COMPONENTS).fit(draw())
    shown = flat if variance == "clean" else draw()
    apart = shown - shown.mean(axis=0)
    total = float((apart**2).sum())
    return float(((apart @ fitted.components_.T) ** 2).sum()) / total if total > 0 else np.nan


# Dispersion and sparseness.


def _compute_dispersion(
    sentence: Sentence, context: Context, section: Section
) -> Iterator[Reading]:
    comparison, *_, data = sentence.id.split("-")
    for chosen, by_index in _disperse(context, comparison, data):
        if "detail" in sentence.main or chosen.get("detail") in (None, _DETAILS[0]):
            own = {k: v for k, v in chosen.items() if k in sentence.main}
            real, same = (found[sentence.index] for found in by_index)
            yield own, real, {name: value for name, (value, *_) in same.items()}


_DETAILS = ("256 bins, whole picture", "32 bins, without borders")
_DETAILED = {"nmi": {"n_bins": 32}, "ssim": {"border": "interior"}}


@lru_cache(maxsize=4)
def _disperse(context: Context, comparison: str, data: str) -> list[tuple[dict, tuple]]:
    """By reading and index: the average of every group, and that of identical touches."""
    found = []
    scales = ("common", "per group")
    if data == "tensor":
        for quantity, scale, window in product(("angle", "curvature"), scales, WINDOWS):
            arrays = _collect_arrays(context, comparison, quantity, window)
            same = {name: make_null(array, 2) for name, array in arrays.items()}
            chosen = {"quantity": quantity, "scale": scale, "window": window}
            for detail in _DETAILS:
                options = _DETAILED if detail == _DETAILS[1] else {}
                pair = tuple(
                    _average(one, scale, context, options, (*_DETAILED,) if options else None)
                    for one in (arrays, same)
                )
                found.append((chosen | {"detail": detail}, pair))
        return found
    for constraint, code, scale in product(_CONSTRAINTS, _CODES, scales):
        codes = _encode(context, comparison, constraint, WINDOWS[0])
        if code in codes.real:
            firsts = {name: starts[0] for name, starts in codes.real[code].items()}
            pair = tuple(
                _average(one, scale, context, {}, None) for one in (firsts, codes.null[code])
            )
            found.append(({"code": code, "constraint": constraint, "scale": scale}, pair))
    return found


def _average(
    arrays: Mapping[str, np.ndarray],
    scale: str,
    context: Context,
    options: dict,
    indices: tuple[str, ...] | None,
) -> dict[str, dict[str, Any]]:
    peaks = {name: float(array.max()) for name, array in arrays.items()}
    divisor = max(peaks.values())
    scaled = {
        name: array / (divisor if scale == "common" else peaks[name] or 1.0)
        for name, array in arrays.items()
    }
    result = compute_dispersion(
        scaled, indices=indices, options=options, scale=False, random_state=context.seed
    )
    return {
        index: {
            str(name): (one.estimate, one.low, one.high, len(arrays[str(name)]))
            for name, one in averages.items()
        }
        for index, averages in result.average.items()
    }


def _compute_sparseness(
    sentence: Sentence, context: Context, section: Section
) -> Iterator[Reading]:
    for (kind, window, quantity), groups in _measure_sparseness(
        context, sentence.id.split("-")[1]
    ).items():
        chosen = {"sparseness": kind, "window": window, "quantity": quantity}
        spreads = {}
        for name, values in groups.items():
            one = bootstrap_mean(values[np.isfinite(values)], np.random.default_rng(0))
            spreads[name] = (one.estimate, one.low, one.high, len(values))
        yield chosen, spreads, {}


def compute_gini(tensors: np.ndarray) -> np.ndarray:
    """Gini index of each tensor's entries (trial,): 0 where all are equal, near 1 where one is all.

    Entries are ≥ 0; of n of them the greatest index is 1 − 1/n.
    """
    flat = np.sort(tensors.reshape(len(tensors), -1), axis=1)
    n = flat.shape[1]
    with np.errstate(invalid="ignore"):
        return (2 * np.arange(1, n + 1) - n - 1) @ flat.T / (n * flat.sum(axis=1))


_SPARSENESS: dict[str, Callable[[np.ndarray], np.ndarray]] = {
    "Hoyer": measure_hoyer,
    "entries below 1 % of the peak": lambda tensors: np.mean(
        tensors < 0.01 * tensors.max(axis=(1, 2), keepdims=True), axis=(1, 2)
    ),
    "Gini": compute_gini,
}


@lru_cache(maxsize=2)
def _measure_sparseness(
    context: Context, comparison: str
) -> dict[tuple, dict[str, np.ndarray]]:
    found: dict[tuple, dict[str, np.ndarray]] = {}
    sets = list_groups(context)[comparison]
    for quantity, (name, data) in product(("angle", "curvature"), sets.items()):
        if comparison == "profile" and name not in CLAIMED:
            continue
        one = data.assign(angle=data[quantity].transpose(*data["angle"].dims))
        one["angle"].attrs = data["angle"].attrs
        for (kind, measure), (window, parts) in product(
            _SPARSENESS.items(), cut_spans(one).items()
        ):
            values = np.concatenate([measure(part) for part in parts])
            found.setdefault((kind, window, quantity), {})[name] = values
    return found


_MEASURES: dict[str, Callable[[Sentence, Context, Section], Iterator[Reading]]] = {
    "wall": _compute_wall,
    "wall offset": _compute_wall,
    "ranks": _compute_ranks,
    "bases": _compute_bases,
    "variance": _compute_variance,
    "lda": _compute_lda,
    "dispersion": _compute_dispersion,
    "sparseness": _compute_sparseness,
}


def show(context: Context, section: Section) -> None:
    """Compute the readings of the sentences that belong to this stage, into its folder; they speak
    of the paper's antennae alone.
    """
    if not context.is_cockroach:
        return
    rows = [
        row
        for sentence in load_sentences()
        if sentence.section == section.name and sentence.measure in _MEASURES
        for row in make_rows(sentence, _MEASURES[sentence.measure](sentence, context, section))
    ]
    section.numbers(FILE.removesuffix(".json"), rows=rows)
