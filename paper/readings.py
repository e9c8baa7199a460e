"""Every natural reading of the paper's sentences, computed: rows, verdicts, and on which choices
agreement depends.

``readings.toml`` declares the sentences, their choices and options; the first option of each choice
is nearest to the paper's words, and all of these together are the main reading. The stages that
hold what is needed compute the rows (:func:`show`); :func:`judge_sentences` says what follows.
"""

import json
from collections.abc import Callable, Iterator, Mapping, Sequence
from copy import copy
from dataclasses import dataclass, field
from functools import cache, lru_cache
from itertools import combinations, product
from types import SimpleNamespace
from typing import Any, Literal

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from sklearn.tree import DecisionTreeClassifier

from feeler.analysis import INDICES, compute_dispersion
from feeler.analysis.dispersion import bootstrap_mean
from feeler.decoding import compute_sweep, make_labels
from feeler.decoding.classifiers import PrincipalComponents, make_fitting_lda
from feeler.decoding.curves import configure, encode_with, make_null
from feeler.encoding import hoyer_sparseness
from feeler.errors import InvalidInput
from feeler.files import make_record
from feeler.objects.noise import Common, Relative
from feeler.plotting.style import PALETTE
from feeler.records import Record
from feeler.report import Section
from feeler.tensors import rectify
from paper import fig4, fig5_codes, fig5_data, fig5f
from paper.context import Context
from paper.data import list_profiles, list_speeds, load_complete, load_tensors, select_speed
from paper.declared import CLAIMED, read_declared
from paper.fig5_sparse import SPANS
from paper.window import (
    WINDOWS,
    complete_tensors,
    cut_to_contact,
    cut_to_motion,
    measure_window,
)

WORDS = (
    "reproduced under the paper's own words",
    "reproduced only under another reading",
    "not reproduced under any reading",
    "cannot be compared",
)
"""Verdicts on a sentence."""
COLUMNS = (
    *("sentence", "quantity", "figure", "statement", "reading", "main", "natural", "group"),
    *("value", "low", "high", "n", "null", "unit", "share", "agrees", "identical"),
)
"""Of a row. ``null``: the value of identical touches. ``share``: of draws of single fits that
agree. ``agrees``: 1, 0, or NaN where the spreads do not let it be told. ``identical``: whether
identical touches show the same effect.
"""
NATURAL = ("stated", "natural", "possible", "far")
"""How natural an option is, and a reading is as natural as its least natural option."""
_FILE = "readings.json"
_SURE = 0.95  # share of draws of fits that says yes; 1 - _SURE says no
_N_COMPONENTS = 30  # [P]
_MOST_LEAVES, _LEAF = 6, 0.02  # of a rule; a leaf must be worth this share of the readings
_CLEAR = 0.9  # share of the readings that agree where a sentence comes out

# What is declared.


class Option(Record):
    """One choice that the paper's words leave open.

    Attributes
    ----------
    options : Mapping[str, str]
        A word of ``NATURAL`` for each option, the one nearest to the paper's words first.
    why : str
        Why the first is nearest.
    indices : tuple[str, ...]
        Of a sentence for several indices those that have this choice; empty: all.
    """

    name: str
    asks: str
    why: str
    options: Mapping[str, str]
    indices: tuple[str, ...] = ()

    def _check(self) -> None:
        if unknown := {*self.options.values()} - {*NATURAL}:
            raise InvalidInput(
                f"choice {self.name!r}: unknown word {unknown.pop()!r}; valid: {', '.join(NATURAL)}."
            )


class Sentence(Record):
    """A sentence of the paper with a number or an order, and how a reading of it is judged.

    Attributes
    ----------
    claims : tuple[str, ...]
        The claims of ``claims.toml`` that it answers.
    kind : str
        ``order`` (groups rise in this order), ``greatest`` or ``least`` (the last group is above, or
        below, all others), ``value`` (each group within ``tolerance``, relative, of its target),
        ``factor`` (1 − value within ``tolerance`` as a factor of 1 − target), ``dip`` (the middle
        group is the least), ``above`` or ``below`` the target.
    least : float
        Smallest effect that counts.
    ratio : bool
        Whether effects are logarithms of ratios, not differences.
    identical : str
        ``order``: agreement that identical touches show too is no evidence of touch. Other words:
        why nothing is asked of them.
    measure : str
        What computes it (``_MEASURES``); ``values`` reads ``key`` from the sections' values.
    """

    id: str
    claims: tuple[str, ...] = ()
    figure: str
    says: str
    paper: str
    section: str
    measure: str
    kind: Literal["order", "greatest", "least", "value", "factor", "dip", "above", "below"]
    groups: tuple[str, ...]
    target: tuple[float, ...] = ()
    tolerance: float = 0.0
    least: float = 0.0
    ratio: bool = False
    unit: str
    identical: str
    key: str = ""
    index: str = ""
    choice: tuple[Option, ...] = ()

    @property
    def main(self) -> dict[str, str]:
        """The option nearest to the paper's words of every choice."""
        return {one.name: next(iter(one.options)) for one in self.choice}

    def is_main(self, chosen: Mapping[str, str]) -> bool:
        """Whether every choice that a reading makes is the first."""
        return all(self.main[name] == option for name, option in chosen.items())

    def weigh(self, chosen: Mapping[str, str]) -> str:
        """How natural a reading is."""
        known = {one.name: one.options for one in self.choice}
        words = [known[name][option] for name, option in chosen.items()]
        return max(words, key=NATURAL.index, default=NATURAL[0])


@cache
def load_sentences() -> tuple[Sentence, ...]:
    """Every sentence of ``readings.toml``; one for several indices of dispersion becomes several."""
    found: dict[str, Sentence] = {}
    for entry in read_declared("readings.toml")["sentence"]:
        plain = dict(entry)
        indices, same = plain.pop("indices", [""]), plain.pop("choices_of", None)
        for index in indices:
            own = {
                key: value.format(index=index) if key == "id" and index else value
                for key, value in plain.items()
            }
            if index:
                own["says"] = own["says"].replace("{index}", INDICES[index].label)
                own |= {"claims": [own["id"]], "index": index}
                if not INDICES[index].is_similarity:
                    own |= {"groups": own["groups"][::-1], "ratio": True, "least": 0.1}
            source = found[same.replace("pearson", index or "pearson")] if same else None
            options = source.choice if source else own.get("choice", ())
            if not source:
                options = tuple(
                    make_record(Option, one, f"readings.toml, {own['id']}") for one in options
                )
                options = tuple(one for one in options if not one.indices or index in one.indices)
            own["choice"] = options
            found[own["id"]] = make_record(Sentence, own, f"readings.toml, {own['id']}")
    return tuple(found.values())


# Whether a reading agrees with the sentence.

_Spread = tuple[float, float, float]
"""Value, low, high; low and high are NaN where nothing was drawn."""


def measure_effect(sentence: Sentence, values: Sequence[float]) -> float:
    """By how much the groups' values agree: the least of the differences that the sentence asks for,
    or minus the greatest deviation from the targets (relative; of ``factor`` the factor itself).
    """
    found = np.asarray(values, dtype=float)
    if sentence.ratio:
        with np.errstate(divide="ignore", invalid="ignore"):
            found = np.log(found)
    match sentence.kind:
        case "order":
            steps = np.diff(found)
            return float(found[-1] - found[0]) if (steps > 0).all() else float(min(steps.min(), 0))
        case "greatest":
            return float(found[-1] - found[:-1].max())
        case "least":
            return float(found[:-1].min() - found[-1])
        case "dip":
            return float(min(found[0], found[2]) - found[1])
        case "above":
            return float((found - sentence.target).min())
        case "below":
            return float((np.asarray(sentence.target) - found).min())
        case "value":
            return -float(np.abs(found / sentence.target - 1).max())
        case _:
            with np.errstate(divide="ignore"):
                factors = np.abs(np.log((1 - found) / (1 - np.asarray(sentence.target))))
            return -float(np.exp(factors.max()))


def find_threshold(sentence: Sentence) -> float:
    """The effect from which on a reading agrees."""
    if sentence.kind in ("value", "factor"):
        return -sentence.tolerance
    return sentence.least


def agree(
    sentence: Sentence, spreads: Sequence[_Spread], least: float | None = None
) -> bool | None:
    """Whether the groups' values agree with the sentence; None where their spreads leave it open.

    Evidence is asked for both ways: agreement must survive the spreads of the groups, and so must
    its absence. ``least`` replaces the sentence's own threshold.
    """
    points = [value for value, *_ in spreads]
    if not np.isfinite(points).all():
        return None
    threshold = find_threshold(sentence) if least is None else least
    holds = measure_effect(sentence, points) >= threshold
    ends = [
        [value] if not np.isfinite([low, high]).all() else [low, high]
        for value, low, high in spreads
    ]
    others = [measure_effect(sentence, chosen) for chosen in product(*ends)]
    if sentence.kind in ("value", "factor"):
        return True if holds else None if max(others) >= threshold else False
    if holds:
        return True if min(others) > 0 else None
    return None if max(others) >= threshold else False


def decide(agrees: Sequence[bool | None], main: bool | None) -> str:
    """The verdict from the readings of a sentence: whether each agrees, and the main one."""
    if main:
        return WORDS[0]
    if any(agrees):
        return WORDS[1]
    return WORDS[2] if False in agrees else WORDS[3]


# Rows of one sentence.

_Reading = tuple[dict[str, str], dict[str, Any], dict[str, float]]
"""Choices; by group a value, (value, low, high, n) or starts; by group the null's value."""


def make_rows(
    sentence: Sentence, readings: Iterator[_Reading] | Sequence[_Reading]
) -> list[dict[str, Any]]:
    """Rows (``COLUMNS`` and ``choices``) of the readings in which every group was computed."""
    rows = []
    for chosen, by_group, nulls in readings:
        if not all(group in by_group for group in sentence.groups):
            continue
        spreads = [_spread(by_group[group]) for group in sentence.groups]
        share, values = np.nan, [spread[:3] for spread in spreads]
        agrees = agree(sentence, values)
        if isinstance(next(iter(by_group.values())), np.ndarray):
            share = _share_draws(sentence, [by_group[group] for group in sentence.groups], chosen)
            agrees = True if share >= _SURE else False if share <= 1 - _SURE else None
        null = [nulls.get(group, np.nan) for group in sentence.groups]
        identical = (
            sentence.identical == "order"
            and np.isfinite(null).all()
            and agree(sentence, [(value, np.nan, np.nan) for value in null]) is True
        )
        rows += [
            {
                "sentence": sentence.id,
                "quantity": sentence.measure,
                "figure": sentence.figure,
                "statement": sentence.says,
                "reading": "; ".join(f"{name}: {option}" for name, option in chosen.items()),
                "main": sentence.is_main(chosen),
                "natural": sentence.weigh(chosen),
                "group": group,
                "value": spread[0],
                "low": spread[1],
                "high": spread[2],
                "n": spread[3],
                "null": beside,
                "unit": sentence.unit,
                "share": share,
                "agrees": np.nan if agrees is None else float(agrees),
                "identical": bool(identical),
                "choices": dict(chosen),
            }
            for group, spread, beside in zip(sentence.groups, spreads, null, strict=True)
        ]
    return rows


def _spread(found: Any) -> tuple[float, float, float, int]:
    if isinstance(found, np.ndarray):
        return float(found[0]), float(found.min()), float(found.max()), len(found)
    if isinstance(found, tuple):
        value, low, high, n = found
        return float(value), float(low), float(high), int(n)
    return float(found), np.nan, np.nan, 1


def _share_draws(
    sentence: Sentence, starts: list[np.ndarray], chosen: Mapping[str, str]
) -> float:
    """Share of draws in which the sentence holds: of one start for each group, or of the best of
    as many as there are, drawn with replacement; starts stand best first.
    """
    weights = []
    for found in starts:
        n = len(found)
        if chosen.get("fit") == "one start":
            weights.append(np.full(n, 1 / n))
        else:
            left = ((n - np.arange(n + 1)) / n) ** n
            weights.append(left[:-1] - left[1:])
    total = 0.0
    for drawn in product(*(range(len(found)) for found in starts)):
        values = [found[k] for found, k in zip(starts, drawn, strict=True)]
        if measure_effect(sentence, values) >= sentence.least:
            total += float(np.prod([w[k] for w, k in zip(weights, drawn, strict=True)]))
    return total


# The wall: R² and place of greatest curvature of every declared configuration, from the figure.


def _compute_wall(sentence: Sentence, context: Context, section: Section) -> Iterator[_Reading]:
    path = section.folder / "fig3_family.json"
    if not path.exists():
        return
    found = json.loads(path.read_text())
    part = "offset" if sentence.measure == "wall offset" else "r2"
    for choice, values in zip(found["choices"], found[part], strict=True):
        named = dict(zip(_wall_choices(), choice, strict=True))
        chosen = {
            "angle": f"{named['inter_antennal_angle']:g}",
            "friction": f"{named['friction']:g}",
            "hook": f"{named['hook_share']:g}",
            "tip": f"{named['tip_heading']:g}",
            "measure": f"{named['quantity']} {named['method']}",
        }
        numbers = [np.nan if value is None else value for value in values]
        yield chosen, dict(zip(found["names"], numbers, strict=True)), {}


def _wall_choices() -> tuple[str, ...]:
    from feeler.wall.distance import SETUP_CHOICES

    return SETUP_CHOICES


# Encoding: residual and entropy by the number of bases; entropy of the bases by profile.


def _compute_ranks(sentence: Sentence, context: Context, section: Section) -> Iterator[_Reading]:
    data, null = fig4.load(context), _fit_identical(context)
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
        ).fit(make_null(tensors, 1))
        found.setdefault("residual", {})[f"M{rank}"] = float(encoder.relative_residual_)
        for name, measure in fig4.ENTROPIES.items():
            found.setdefault(name, {})[f"M{rank}"] = measure(encoder.activations_)
    return found


def _compute_bases(sentence: Sentence, context: Context, section: Section) -> Iterator[_Reading]:
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
    known = fig5f.load(context).get(window) if quantity == "angle" else None
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
        alone = copy(encoder).set_params(n_restarts=1).fit(make_null(arrays[name], 1))
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
            data = data.isel(time=data["time"].values < measure_window(data).end)
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
    codes, plan = _Codes(), context.effort.plan
    arrays = _collect_arrays(context, comparison, "angle", window)
    if constraint == "each trial":
        known = (
            fig5_data.load(context).groups.get(comparison, {})
            if window == WINDOWS[0]
            else fig5_codes.load(context).groups
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
    settings = {"n_restarts": plan.n_restarts, "random_state": context.seed}
    peak = max(array.max() for array in arrays.values())
    arrays = {name: array / peak for name, array in arrays.items()}
    for members in [list(arrays)] if comparison == "speed" else [[name] for name in arrays]:
        fresh = context.effort.make_encoder(constraint=_CONSTRAINTS[constraint])
        encoder = configure(fresh, settings).fit(
            np.concatenate([arrays[name] for name in members])
        )
        alone = configure(fresh, {"n_restarts": 1, "random_state": context.seed}).fit(
            np.concatenate([make_null(arrays[name]) for name in members])
        )
        ends = np.cumsum([len(arrays[name]) for name in members])[:-1]
        for k, name in enumerate(members):
            starts = [np.split(one, ends)[k] for one in encoder.restart_activations_]
            codes.keep("joint", name, starts, np.split(alone.activations_, ends)[k])
            for kind in _CODES[1:]:
                code = encode_with(arrays[name], encoder, kind)
                codes.keep(kind, name, [code], _repeat(encoder, arrays[name], kind))
    return codes


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
        peak = max(array.max() for array in parts.values())
        fresh = context.effort.make_encoder(constraint=_CONSTRAINTS[constraint])
        settings = {"n_restarts": context.effort.plan.n_restarts, "random_state": context.seed}
        ends = np.cumsum([len(array) for array in parts.values()])[:-1]
        encoder = configure(fresh, settings).fit(np.concatenate([*parts.values()]) / peak)
        alone = configure(fresh, settings | {"n_restarts": 1}).fit(
            np.concatenate([make_null(array) for array in parts.values()]) / peak
        )
        codes = _Codes()
        for k, (speed, array) in enumerate(parts.items()):
            starts = [np.split(one, ends)[k] for one in encoder.restart_activations_]
            codes.keep("joint", speed, starts, np.split(alone.activations_, ends)[k])
            for kind in _CODES[1:]:
                code = encode_with(array / peak, encoder, kind)
                codes.keep(kind, speed, [code], _repeat(encoder, array / peak, kind))
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
    for repeat in range(n_repeats):
        drawn = rng.standard_normal((2, n_copies, n, len(axes)))
        train, test = np.einsum("nkl,scnl->scnk", root, drawn, optimize=True)
        for k, ratio in enumerate(ratios):
            classify = fit_lda(places + ratio * train)
            noisy[k, repeat] = np.mean(classify(places + ratio * test) == np.arange(n))
            clean[k, repeat] = np.mean(classify(places) == np.arange(n))
    return noisy, clean


def fit_lda(train: np.ndarray) -> Callable[[np.ndarray], np.ndarray]:
    """The classes that LDA with equal priors gives to (…, entry), from copies (copy, class, entry)."""
    means = train.mean(axis=0)
    apart = (train - means).reshape(-1, train.shape[2])
    within = apart.T @ apart / max(len(apart) - len(means), 1)
    energy, turn = np.linalg.eigh(within)
    keep = energy > 1e-10 * max(energy[-1], np.finfo(float).tiny)
    white = turn[:, keep] / np.sqrt(energy[keep])
    centres = means @ white
    offset = 0.5 * (centres**2).sum(axis=1)
    return lambda places: (places @ white @ centres.T - offset).argmax(axis=-1)


def _compute_lda(sentence: Sentence, context: Context, section: Section) -> Iterator[_Reading]:
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
    for chosen, real, null in sets:
        for components in ("all clean", "group's clean", "noisy copies"):
            scalings = ("each vector", "each touch", "all touches")
            for scaling in scalings[chosen["code"] == "tensors" :]:
                base = {"components": components, "scaling": scaling} | chosen
                yield from _classify(context, base, real, null)
    if comparison == "profile":
        yield from _classify_own(context)


def _classify(
    context: Context,
    chosen: dict[str, str],
    real: Mapping[str, list[np.ndarray]],
    null: Mapping[str, np.ndarray],
    fitted: Callable[[Mapping[str, np.ndarray], str], np.ndarray] | None = None,
) -> Iterator[_Reading]:
    """Both tests of one pipeline: each start's accuracy, and that of identical touches."""
    n_starts = min(len(starts) for starts in real.values())
    sets = [{name: starts[k] for name, starts in real.items()} for k in range(n_starts)]
    if chosen["components"] == "noisy copies":
        sets = sets[:1]
    found = [_score(context, chosen, codes, fitted) for codes in sets]
    alone = _score(context, chosen, null, fitted)
    for k, test in enumerate(("noisy copies", "clean originals")):
        values = {name: np.array([one[name][k] for one in found]) for name in real}
        spreads = {
            name: (one[0], one.min(), one.max(), len(one)) if len(one) > 1 else float(one[0])
            for name, one in values.items()
        }
        yield {**chosen, "test": test}, spreads, {name: alone[name][k] for name in alone}


def _score(
    context: Context,
    chosen: Mapping[str, str],
    codes: Mapping[str, np.ndarray],
    fitted: Callable[[Mapping[str, np.ndarray], str], np.ndarray] | None,
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
            n_repeats=plan.n_repeats,
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
    noise = Common(reference=peak) if chosen["scaling"] == "all touches" else Relative(each=each)
    found = compute_sweep(
        code,
        labels,
        ratios=ratios,
        n_copies=plan.n_copies,
        n_repeats=min(plan.n_repeats, 2),
        noise=noise,
        rotate=noise.is_even(code),
        estimator=make_fitting_lda(len(labels), plan.n_copies),
        random_state=context.seed,
    )
    return float(found.noisy.mean()), float(found.clean.mean())


def _classify_own(context: Context) -> Iterator[_Reading]:
    """Slow touches of every profile, with components of all its touches at all speeds."""
    for constraint in _CONSTRAINTS:
        sets = _encode_own(context, constraint)
        if len(sets) < len(CLAIMED):
            return
        for code, scaling in product(_CODES, ("each vector", "each touch", "all touches")):
            chosen = {"components": "profile's 90 clean", "scaling": scaling, "code": code}
            chosen |= {"constraint": constraint, "window": WINDOWS[0]}
            own = {name: np.concatenate([p[0] for p in c.real[code].values()]) for name, c in sets.items()}
            same = {name: np.concatenate([*c.null[code].values()]) for name, c in sets.items()}
            real = {name: c.real[code]["slow"] for name, c in sets.items()}
            null = {name: c.null[code]["slow"] for name, c in sets.items()}
            firsts = {name: starts[:1] for name, starts in real.items()}
            pools = [own, same]

            def fitted(codes: Mapping[str, np.ndarray], name: str, pools=pools, null=null):
                return pools[codes is null][name]

            yield from _classify(context, chosen, firsts, null, fitted)


def _compute_variance(
    sentence: Sentence, context: Context, section: Section
) -> Iterator[_Reading]:
    for constraint, code in product(_CONSTRAINTS, _CODES):
        codes = _encode(context, "speed", constraint, WINDOWS[0])
        if code not in codes.real:
            continue
        base = {"code": code, "constraint": constraint}
        starts = codes.real[code]
        n_starts = min(len(found) for found in starts.values())
        sets = [{name: found[k] for name, found in starts.items()} for k in range(n_starts)]
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
) -> Iterator[_Reading]:
    comparison, *_, data = sentence.id.split("-")
    for chosen, by_index in _disperse(context, comparison, data):
        if "detail" in sentence.main or chosen.get("detail") in (None, _DETAILS[0]):
            own = {k: v for k, v in chosen.items() if k in sentence.main}
            yield own, by_index[0][sentence.index], by_index[1][sentence.index]


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
            name: (one.estimate, one.low, one.high, len(arrays[name]))
            for name, one in averages.items()
        }
        for index, averages in result.average.items()
    }


def _compute_sparseness(
    sentence: Sentence, context: Context, section: Section
) -> Iterator[_Reading]:
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
    """Gini index of each tensor's entries (trial,), ≥ 0: 0 where all are equal, 1 where one is all."""
    flat = np.sort(tensors.reshape(len(tensors), -1), axis=1)
    n = flat.shape[1]
    with np.errstate(invalid="ignore"):
        return (2 * np.arange(1, n + 1) - n - 1) @ flat.T / (n * flat.sum(axis=1))


_SPARSENESS: dict[str, Callable[[np.ndarray], np.ndarray]] = {
    "Hoyer": lambda tensors: hoyer_sparseness(tensors.reshape(len(tensors), -1)),
    "entries below 1 % of the peak": lambda tensors: np.mean(
        tensors < 0.01 * tensors.max(axis=(1, 2), keepdims=True), axis=(1, 2)
    ),
    "Gini": compute_gini,
}


@lru_cache(maxsize=2)
def _measure_sparseness(context: Context, comparison: str) -> dict[tuple, dict[str, np.ndarray]]:
    found: dict[tuple, dict[str, np.ndarray]] = {}
    profiles, first = list_profiles(context), list_profiles(context)[0]
    slow = min(list_speeds(context, first).values())
    sets = {name: load_complete(context, name) for name in profiles if name in CLAIMED}
    if comparison == "speed":
        every = load_tensors(context, first)
        sets = {
            name: load_complete(context, first) if speed == slow else select_speed(every, speed)
            for name, speed in list_speeds(context, first).items()
        }
    for quantity, (name, data) in product(("angle", "curvature"), sets.items()):
        one = data.assign(angle=data[quantity].transpose(*data["angle"].dims))
        one["angle"].attrs = data["angle"].attrs
        whole = _rectify(one)
        time = data["time"].values
        cut = {
            SPANS[0]: [whole[:, :, time < 380.0]],
            SPANS[1]: [whole[:, :, time < measure_window(data).end]],
            SPANS[2]: [part[None] for part in cut_to_contact(one)],
            SPANS[3]: [part[None] for part in cut_to_motion(one)],
        }
        for (kind, measure), window in product(_SPARSENESS.items(), SPANS):
            values = np.concatenate([measure(part) for part in cut[window]])
            found.setdefault((kind, window, quantity), {})[name] = values
    return found


def _rectify(data: Any) -> np.ndarray:
    return rectify(data["angle"].transpose("trial", "sensor", "time").values)


_MEASURES: dict[str, Callable[[Sentence, Context, Section], Iterator[_Reading]]] = {
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
    """Compute the readings of the sentences that belong to this stage, into its folder."""
    rows = [
        row
        for sentence in load_sentences()
        if sentence.section == section.name and sentence.measure in _MEASURES
        for row in make_rows(sentence, _MEASURES[sentence.measure](sentence, context, section))
    ]
    section.numbers(_FILE.removesuffix(".json"), rows=rows)


# Of all sections together: rows, verdicts, and the choices on which agreement depends.


@dataclass(frozen=True, kw_only=True, eq=False)
class Finding:
    """What the readings of one sentence say.

    Attributes
    ----------
    verdict : str
        One of ``WORDS``.
    line : str
        On which choices agreement depends, with the readings that this rule does not fit.
    note : str
        The main reading, which natural departures from it change the answer, and identical touches.
    moves : str
        How the verdict moves with its threshold.
    rows : pd.DataFrame
        ``COLUMNS`` and ``choices``.
    """

    sentence: Sentence
    verdict: str
    line: str
    note: str
    moves: str
    rows: pd.DataFrame = field(repr=False)

    @property
    def statements(self) -> tuple[str, ...]:
        """The claims that it answers."""
        return self.sentence.claims


def collect(sections: Sequence[Section]) -> pd.DataFrame:
    """All rows of a run: of what stages left in their folders, and of values of the sections."""
    rows: list[dict[str, Any]] = []
    values = {key: value for section in sections for key, value in section.values.items()}
    for section in sections:
        path = section.folder / _FILE
        if path.exists():
            rows += json.loads(path.read_text())["rows"]
    for sentence in load_sentences():
        if sentence.measure == "values":
            rows += make_rows(sentence, _list_values(sentence, values))
    known = [*COLUMNS, "choices"]
    order = {one.id: place for place, one in enumerate(load_sentences())}
    table = pd.DataFrame(rows, columns=known)
    numbers = ["value", "low", "high", "null", "share", "agrees"]
    table[numbers] = table[numbers].astype(float)
    return table.sort_values("sentence", key=lambda ids: ids.map(order), kind="stable")


def _list_values(sentence: Sentence, values: Mapping[str, Any]) -> Iterator[_Reading]:
    names = [one.name for one in sentence.choice]
    for options in product(*(one.options for one in sentence.choice)):
        chosen = dict(zip(names, options, strict=True))
        found: dict[str, Any] = {}
        for group in sentence.groups:
            value = values.get(sentence.key.format(group=group, **chosen))
            if isinstance(value, dict) and value.get("value") is not None:
                ends = [value.get(end) for end in ("low", "high")]
                low, high = (np.nan if end is None else end for end in ends)
                found[group] = (value["value"], low, high, value.get("n", 1))
            elif isinstance(value, int | float):
                found[group] = float(value)
        yield chosen, found, {}


def judge_sentences(rows: pd.DataFrame) -> dict[str, Finding]:
    """What follows for every sentence, by its name; also for those of which nothing was computed."""
    parts = dict(list(rows.groupby("sentence", sort=False)))
    return {one.id: _judge(one, parts.get(one.id, rows.iloc[:0])) for one in load_sentences()}


def _judge(sentence: Sentence, rows: pd.DataFrame) -> Finding:
    readings = _list_readings(sentence, rows)
    agrees = [one.agrees for one in readings]
    main = next((one for one in readings if one.main), None)
    verdict = decide(agrees, main.agrees if main else None) if main else WORDS[3]
    line = find_rule(sentence, [(one.chosen, one.agrees) for one in readings])
    note = _describe_main(sentence, readings, main) if main else "not computed in this run"
    moves = _describe_moves(sentence, readings, main) if main else ""
    return Finding(
        sentence=sentence, verdict=verdict, line=line, note=note, moves=moves, rows=rows
    )


def _list_readings(sentence: Sentence, rows: pd.DataFrame) -> list[SimpleNamespace]:
    """Readings, in order: choices, spreads by group, whether they agree."""
    found = []
    for _, part in rows.groupby("reading", sort=False):
        first = part.iloc[0]
        by_group = part.set_index("group")
        found.append(
            SimpleNamespace(
                chosen=first["choices"],
                main=bool(first["main"]),
                natural=first["natural"],
                agrees=None if np.isnan(first["agrees"]) else bool(first["agrees"]),
                identical=bool(first["identical"]),
                share=float(first["share"]),
                defined=bool(np.isfinite(part["value"]).all()),
                spreads=[
                    tuple(by_group.loc[group, ["value", "low", "high"]].astype(float))
                    for group in sentence.groups
                ],
            )
        )
    return found


def find_rule(
    sentence: Sentence, readings: Sequence[tuple[Mapping[str, str], bool | None]]
) -> str:
    """One line that says on which choices agreement depends: a shallow decision tree over them, with
    the readings that it does not fit. Readings that leave it open are counted apart.
    """
    known = [(chosen, agrees) for chosen, agrees in readings if agrees is not None]
    if not known:
        return "no reading decides" if readings else ""
    yes, n = sum(agrees for _, agrees in known), len(known)
    rest = len(readings) - n
    counted = f"{yes} of {n} readings agree" + (f", {rest} say nothing" if rest else "")
    if yes in (0, n):
        word = "comes out under every reading" if yes else "comes out under no reading"
        return f"{word} ({counted})"
    columns, table = _tabulate(sentence, [chosen for chosen, _ in known])
    target = np.array([agrees for _, agrees in known])
    fits = [
        DecisionTreeClassifier(max_depth=3, max_leaf_nodes=leaves, random_state=0).fit(
            table, target
        )
        for leaves in range(2, _MOST_LEAVES + 1)
    ]
    wrong = [int((tree.predict(table) != target).sum()) for tree in fits]
    best = min(range(len(fits)), key=lambda k: wrong[k] + k * max(0.5, _LEAF * n))
    ways = _list_ways(sentence, fits[best], columns)
    if wrong[best] >= min(yes, n - yes):  # no better than the more frequent answer
        few = yes <= n - yes
        shared = _find_shared(sentence, [chosen for chosen, agrees in known if agrees is few])
        word = "agree" if few else "do not"
        said = _say_allowed(sentence, shared) or "nothing in common"
        return f"no simple rule over the choices; those that {word}: {said} ({counted})"
    counts = [
        (_say_allowed(sentence, way), *_count(known, way))
        for side in (True, False)
        for way in _merge(ways[side])
    ]
    return f"{_say_ways(counts)} ({counted}; a tree over the choices fits {n - wrong[best]} of {n})"


def _count(known: Sequence[tuple[Mapping[str, str], bool | None]], way: "_Allowed") -> tuple:
    """How many readings agree that have these options, and how many there are."""
    found = [
        agrees
        for chosen, agrees in known
        if all(option in way[name] for name, option in chosen.items())
    ]
    return sum(map(bool, found)), len(found)


def _say_ways(counts: Sequence[tuple[str, int, int]]) -> str:
    """Where nearly all readings agree, where nearly none does, and what is left."""
    clear = {
        "comes out if": [one for one in counts if one[1] >= _CLEAR * one[2]],
        "not if": [one for one in counts if one[1] <= (1 - _CLEAR) * one[2]],
    }
    mixed = [one for one in counts if one not in sum(clear.values(), [])]
    if not clear["comes out if"]:
        best = max(mixed, key=lambda one: one[1] / one[2])
        clear["comes out if"], mixed = [best], [one for one in mixed if one is not best]
    said = [
        f"{side} " + " or if ".join(f"{way} ({yes} of {n})" for way, yes, n in found)
        for side, found in clear.items()
        if found
    ]
    if mixed:
        yes, n = (sum(one[k] for one in mixed) for k in (1, 2))
        said.append(f"otherwise in {yes} of {n}")
    return "; ".join(said)


def _find_shared(
    sentence: Sentence, chosen: Sequence[Mapping[str, str]]
) -> dict[str, tuple[str, ...]]:
    """The options that some readings have."""
    shared = {}
    for one in sentence.choice:
        taken = {reading[one.name] for reading in chosen if one.name in reading}
        every = all(one.name in reading for reading in chosen)
        shared[one.name] = tuple(o for o in one.options if o in taken or not every)
    return shared


def _tabulate(
    sentence: Sentence, chosen: Sequence[Mapping[str, str]]
) -> tuple[list[tuple[str, str | None]], np.ndarray]:
    """A column for each option, or one for a choice of numbers, with its choice and option."""
    columns: list[tuple[str, str | None]] = []
    table = []
    for one in sentence.choice:
        taken = {reading[one.name] for reading in chosen if one.name in reading}
        if len(taken | {""} if any(one.name not in r for r in chosen) else taken) < 2:
            continue
        if all(_is_number(option) for option in one.options):
            columns.append((one.name, None))
            table.append([float(reading[one.name]) for reading in chosen])
            continue
        for option in one.options:
            if option in taken:
                columns.append((one.name, option))
                table.append([float(reading.get(one.name) == option) for reading in chosen])
    return columns, np.array(table).T


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True


_Allowed = dict[str, tuple[str, ...]]
"""Options of every choice."""


def _list_ways(
    sentence: Sentence, tree: DecisionTreeClassifier, columns: list[tuple[str, str | None]]
) -> dict[bool, list[_Allowed]]:
    """The options that lead to every leaf, by whether readings there agree."""
    inner, ways = tree.tree_, {True: [], False: []}

    def walk(node: int, allowed: _Allowed) -> None:
        if inner.children_left[node] < 0:
            ways[bool(tree.classes_[inner.value[node][0].argmax()])].append(allowed)
            return
        name, option = columns[inner.feature[node]]
        for side, child in enumerate((inner.children_left[node], inner.children_right[node])):
            limit = inner.threshold[node]
            kept = tuple(
                one
                for one in allowed[name]
                if ((float(one) > limit) if option is None else (one == option)) == bool(side)
            )
            walk(child, allowed | {name: kept})

    walk(0, {one.name: tuple(one.options) for one in sentence.choice})
    return ways


def _merge(ways: list[_Allowed]) -> list[_Allowed]:
    """Ways of which two that differ in one choice alone are one."""
    ways = list(ways)
    while pair := next(
        (
            (one, other, differing[0])
            for one, other in combinations(ways, 2)
            if len(differing := [name for name in one if one[name] != other[name]]) == 1
        ),
        None,
    ):
        one, other, name = pair
        ways = [way for way in ways if way not in (one, other)]
        ways.append(one | {name: one[name] + other[name]})
    return ways


def _say_allowed(sentence: Sentence, allowed: _Allowed) -> str:
    words = []
    for choice in sentence.choice:
        name, every = choice.name, list(choice.options)
        kept = [one for one in every if one in allowed[name]]
        if len(kept) == len(every):
            continue
        if all(map(_is_number, every)):
            kept = sorted(kept, key=float)
        elif len(kept) > 1 and len(kept) == len(every) - 1:
            (left,) = set(every) - set(kept)
            words.append(f"{name} is not “{left}”")
            continue
        words.append(f"{name} is “{'” or “'.join(kept)}”")
    return " and ".join(words)


def _say_values(sentence: Sentence, reading: SimpleNamespace) -> str:
    shown = zip(sentence.groups, reading.spreads, strict=True)
    return ", ".join(f"{group} {value:.3g}" for group, (value, *_) in shown)


_ANSWER = {True: "agrees", False: "does not agree", None: "leaves it open"}


def _describe_main(
    sentence: Sentence, readings: list[SimpleNamespace], main: SimpleNamespace
) -> str:
    words = [f"The main reading {_ANSWER[main.agrees]}: {_say_values(sentence, main)}"]
    if np.isfinite(main.share):
        words[0] += f" (in {main.share:.0%} of draws of the starts)"
    if not main.defined:
        words = ["Under the main reading the numbers are undefined"]
    if main.identical and main.agrees:
        words.append("identical touches show the same effect there, so it is no evidence of touch")
        other = [one for one in readings if one.agrees and not one.identical]
        if other:
            words.append(f"{len(other)} other readings agree in which identical touches do not")
    flips = [
        f"{name} “{option}”"
        for one in readings
        if len(changed := _list_changes(sentence, one)) == 1
        and one.natural in NATURAL[:2]
        and one.defined
        and one.agrees is not main.agrees
        for name, option in changed.items()
    ]
    if flips:
        words.append(f"as natural and with another answer: {', '.join(flips)}")
    if main.agrees is not True and (near := [one for one in readings if one.agrees]):
        best = min(
            near,
            key=lambda one: (len(_list_changes(sentence, one)), NATURAL.index(one.natural)),
        )
        changed = ", ".join(f"{k} “{v}”" for k, v in _list_changes(sentence, best).items())
        words.append(f"nearest that agrees: {changed} ({_say_values(sentence, best)})")
    if undefined := sum(not one.defined for one in readings):
        words.append(f"undefined in {undefined} of {len(readings)} readings")
    chance = [one for one in readings if one.agrees is None and np.isfinite(one.share)]
    if chance and main.agrees is not True:
        most = max(chance, key=lambda one: one.share)
        changed = ", ".join(f"{k} “{v}”" for k, v in most.chosen.items())
        words.append(f"by chance of the starts in {most.share:.0%} of draws at most ({changed})")
    return "; ".join(words) + "."


def _list_changes(sentence: Sentence, reading: SimpleNamespace) -> dict[str, str]:
    """Choices in which a reading departs from the main one."""
    return {k: v for k, v in reading.chosen.items() if v != sentence.main[k]}


def _describe_moves(
    sentence: Sentence, readings: list[SimpleNamespace], main: SimpleNamespace
) -> str:
    """The verdict with thresholds around the one that was declared."""
    asked = find_threshold(sentence)
    if sentence.kind in ("value", "factor"):
        name, steps = "tolerance", (0.5, 2.0)
        wide = [-(sentence.tolerance**k) if sentence.kind == "factor" else k * asked for k in steps]
    elif sentence.kind in ("above", "below"):
        name, wide = "target", [step * max(sentence.target) for step in (-0.1, 0.1)]
    else:
        name, wide = "least effect", [0.5 * asked, 2 * asked]
    said = []
    for threshold in wide:
        answers = {
            id(one): agree(sentence, _drop(one), threshold) for one in readings
        }
        word = decide([*answers.values()], answers[id(main)])
        shown = (
            f"{max(sentence.target) + (threshold if sentence.kind == 'above' else -threshold):.3g}"
            if name == "target"
            else f"{abs(threshold):.3g}"
        )
        said.append(f"{shown}: {word} ({sum(map(bool, answers.values()))} of {len(answers)} agree)")
    now = abs(asked) if name != "target" else max(sentence.target)
    best = measure_effect(sentence, [value for value, *_ in main.spreads])
    reach = "" if not np.isfinite(best) or name == "target" else f"; main reading: {abs(best) if name == 'tolerance' else best:.3g}"
    return f"{name} {now:.3g}{reach}; with {'; with '.join(said)}"


def _drop(reading: SimpleNamespace) -> list[_Spread]:
    """Spreads; of draws of starts the values alone."""
    if np.isfinite(reading.share):
        return [(value, np.nan, np.nan) for value, *_ in reading.spreads]
    return reading.spreads


# The page: a strip of points for every sentence.

_COLOURS = {True: PALETTE[2], False: "#9A9A9A", None: PALETTE[1]}


def plot(finding: Finding, ax: Axes) -> None:
    """A strip for each group: a dot for each reading, coloured by whether it agrees, the main one as
    a diamond, identical touches as ticks below, the paper's values as crosses.
    """
    sentence = finding.sentence
    readings = _list_readings(sentence, finding.rows)
    rng = np.random.default_rng(0)  # spreads the dots across a strip only
    shift = rng.uniform(-0.22, 0.22, len(readings))
    nulls = finding.rows.groupby("group", sort=False)["null"]
    for place, group in enumerate(sentence.groups):
        for agrees, colour in _COLOURS.items():
            own = [k for k, one in enumerate(readings) if one.agrees is agrees]
            values = [readings[k].spreads[place][0] for k in own]
            ax.plot(values, place + shift[own], ".", ms=4, color=colour, alpha=0.7, mew=0)
        main = [one.spreads[place][0] for one in readings if one.main]
        ax.plot(main, [place] * len(main), "D", ms=6, mfc="none", mec="#000000", mew=1.2)
        if group in nulls.groups:
            null = nulls.get_group(group).dropna().unique()
            ax.plot(null, np.full(len(null), place - 0.36), "|", ms=5, color=PALETTE[3], alpha=0.6)
        if sentence.target:
            ax.plot(sentence.target[place], place, "x", ms=7, color="#C00000", mew=1.5)
    ax.set_yticks(range(len(sentence.groups)), sentence.groups)
    ax.set_ylim(-0.55, len(sentence.groups) - 0.5)
    ax.set_xlabel(sentence.unit)


def plot_findings(findings: Sequence[Finding], figure: Figure) -> None:
    """The strips of sentences that differ in their index alone, side by side, with one legend."""
    axes = figure.subplots(1, len(findings), squeeze=False)[0]
    for ax, finding in zip(axes, findings, strict=True):
        plot(finding, ax)
        index = finding.sentence.index
        ax.set_title(INDICES[index].label if index else "", fontsize=8)
    for colour, label in zip(_COLOURS.values(), ("agrees", "does not", "open"), strict=True):
        axes[0].plot([], [], ".", color=colour, label=label)
    axes[0].plot([], [], "D", mfc="none", mec="#000000", label="main reading")
    if findings[0].sentence.identical == "order":
        axes[0].plot([], [], "|", color=PALETTE[3], label="identical touches")
    if findings[0].sentence.target:
        axes[0].plot([], [], "x", color="#C00000", label="the paper" if findings[0].sentence.kind in ("value", "factor") else "asked for")
    figure.legend(loc="outside lower center", ncols=6, fontsize=7, frameon=False)


def make_section(sections: Sequence[Section], context: Context) -> Section:
    """The report's own section: every sentence's verdict, its strip, and on what it depends."""
    folder = context.out / "cache" / "readings"
    folder.mkdir(parents=True, exist_ok=True)
    section = Section(
        name="readings", title="The paper by its own words", folder=folder, vector=False
    )
    rows = collect(sections)
    findings = judge_sentences(rows)
    section.text(
        "The paper leaves open how some of its numbers were computed. For every sentence with a"
        " number or an order, readings.toml declares the choices that its words leave open, with"
        " a word on how natural each option is; the first option of each is nearest to the words"
        " and was chosen from them alone. All readings are computed. A sentence is reproduced"
        " under the paper's own words where the reading of all first options agrees with it."
    )
    section.table(
        ["figure", "sentence", "verdict", "main reading", "on what it depends"],
        [
            [one.sentence.figure, one.sentence.says, one.verdict, one.note, one.line]
            for one in findings.values()
        ],
        f"{len(findings)} sentences, in the paper's order.",
    )
    for members in _group(findings):
        _show_strips(section, members)
    for name, one in findings.items():
        decided = one.rows.drop_duplicates("reading")["agrees"].dropna()
        if len(decided):
            section.values[f"readings.{name}"] = {"value": float(decided.mean()), "n": len(decided)}
        for _, row in one.rows[one.rows["main"]].iterrows():
            ends = {end: row[end] for end in ("low", "high") if np.isfinite(row[end])}
            if np.isfinite(row["value"]):
                key = f"readings.{name}.{row['group']}"
                section.values[key] = {"value": row["value"], **ends, "n": int(row["n"])}
    rows[list(COLUMNS)].to_csv(folder / "readings.csv", index=False, float_format="%.6g")
    section.save()
    return section


def _group(findings: Mapping[str, Finding]) -> list[list[Finding]]:
    """Sentences that differ in their index alone together; those without rows left out."""
    groups: dict[str, list[Finding]] = {}
    for name, one in findings.items():
        if len(one.rows):
            groups.setdefault(name.replace(one.sentence.index or "\0", "index"), []).append(one)
    return [*groups.values()]


def _show_strips(section: Section, members: list[Finding]) -> None:
    first = members[0].sentence
    section.heading(f"{first.figure}: {first.says.split(': ')[0] if first.index else first.says}")
    readings = len(members[0].rows.drop_duplicates("reading"))
    section.figure(
        f"readings_{first.id}",
        f"{readings} readings; the paper: {first.paper}."
        + " ".join(
            f" {INDICES[one.sentence.index].label + ': ' if one.sentence.index else ''}{one.verdict}."
            f" {one.note} {one.line}. Threshold: {one.moves}."
            for one in members
        ),
        lambda figure: plot_findings(members, figure),
        height=1.0 + 0.36 * len(first.groups),
    )
    if first.choice:
        section.table(
            ["choice", "what it asks", "options, nearest to the words first", "why the first"],
            [
                [one.name, one.asks, ", ".join(f"{o} ({w})" for o, w in one.options.items()), one.why]
                for one in first.choice
            ],
        )
