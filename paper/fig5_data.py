"""What Figs. 5A–E and S6 show, and beside it: identical touches, whole touches, every speed, and
codes of whole touches.
"""

from collections.abc import Mapping
from dataclasses import replace
from functools import lru_cache
from itertools import product
from types import SimpleNamespace
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from feeler.analysis import INDICES, Dispersion, compute_dispersion
from feeler.analysis.dispersion import bootstrap_mean
from feeler.decoding import (
    CODES,
    NOISES,
    Relative,
    Sweep,
    compute_sweep,
    group_tensors,
    make_labels,
)
from feeler.decoding.classifiers import make_lda
from feeler.decoding.curves import (
    Curves,
    DuplicateControl,
    Group,
    JointFit,
    compare_twins,
    compute_curves,
    configure,
    fit_null,
    make_codes,
)
from feeler.decoding.sweeps import Plan
from feeler.experiments.tactile import DURATION
from feeler.plotting.results import plot_sweep
from feeler.plotting.style import PALETTE, PROFILE_COLOURS
from feeler.report import Section, make_spread
from feeler.tensors import rectify
from paper.cache import keep
from paper.context import Context
from paper.data import (
    CLAIMED,
    COMPLETE,
    SAME,
    WINDOWS,
    complete_arrays,
    complete_tensors,
    keep_whole,
    list_profiles,
    list_speeds,
    load_complete,
    load_tensors,
    measure_window,
    select_speed,
)

# What Figs. 5A–E and S6 show: dispersion and accuracy by speed and by profile.

MAIN = ("joint", "raw")
"""The paper's two data sets: activations and tensors."""


def compare(
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


KEPT_AT = (0.1, 0.3)
"""Noise ratios at which the paper names the variance that its principal components keep."""
_KINDS = {"raw": "tensor", "joint": "activation"}
"""What the values of the paper's two data sets are called."""


@lru_cache(maxsize=1)
def compute(context: Context) -> SimpleNamespace:
    """What :func:`compare` gives for this run, with ``rows``; ``nulls``, the dispersion of
    identical touches by comparison; ``speeds``, see :func:`name_speeds`; and the ``plan``.
    """
    sets = {name: load_tensors(context, name) for name in list_profiles(context)}
    plan, speeds = context.effort.plan, name_speeds(context)
    data = compare(
        sets,
        context.effort.make_encoder(),
        plan=plan,
        reference=next(iter(sets)),
        random_state=context.seed,
    )
    nulls = {
        comparison: disperse_null(data.groups[comparison], curves.fits, context.seed)
        for comparison, curves in data.curves.items()
    }
    starts = context.effort.restarts
    rows = _list_accuracies(data.curves, speeds, plan, starts)
    for comparison, kinds in data.dispersions.items():
        shown = {_KINDS[kind]: found for kind, found in kinds.items() if kind in _KINDS}
        for kind, found in {**shown, "null": nulls[comparison]}.items():
            n = {"activation": starts, "null": plan.null_restarts}.get(kind)
            rows |= list_dispersion(found, f"dispersion.{kind}", n, speeds)
    return SimpleNamespace(**vars(data), rows=rows, nulls=nulls, speeds=speeds, plan=plan)


def list_dispersion(
    found: Dispersion, prefix: str, n: int | None = None, names: Mapping[Any, str] | None = None
) -> dict[str, Any]:
    """The average of every index and group by name, of ``n`` starts or, by default, of touches;
    ``names``: what groups are called, where it differs.
    """
    return {
        f"{prefix}.{index}.{(names or {}).get(group, group)}": make_spread(
            one.estimate, one.low, one.high, n=n or found.values(index, group).size
        )
        for index, groups in found.average.items()
        for group, one in groups.items()
    }


def _list_accuracies(
    by_comparison: Mapping[str, Curves],
    speeds: Mapping[str, str],
    plan: Plan,
    starts: int,
) -> dict[str, Any]:
    """Accuracy of every group and of its null, and the variance kept of the first group's codes,
    with the ends of its repeats; ``starts``: how many a fit has.
    """
    rows: dict[str, Any] = {}
    for curves in by_comparison.values():
        for group, sweep in curves.find("joint").items():
            name, null = speeds.get(group, group), curves.find_null("joint", group=group)
            assert null is not None  # compute_curves makes one for every group
            rows[f"classification.lda.{name}"] = spread_accuracy(sweep, starts)
            rows[f"classification.null.{name}"] = spread_accuracy(null, plan.null_restarts)
    first = next(iter(next(iter(by_comparison.values())).find("joint").values()))
    kinds = {"clean codes": first.kept_clean, "noisy copies": first.kept_noisy}
    for ratio, (kind, every) in product(KEPT_AT, kinds.items()):
        if (kept := every[np.isclose(first.ratios, ratio)]).size:
            ends = np.nanmean(kept), np.nanmin(kept), np.nanmax(kept)
            rows[f"classification.pca.{kind} at {100 * ratio:g} % noise"] = make_spread(
                *ends, n=starts
            )
    return rows


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


# Beside Fig. 5: what jointly fitted codes reach on identical touches, and what of them
# carries over to a twin.


def compute_nulls(context: Context) -> SimpleNamespace:
    """What :func:`compute` gives, and the twin test of the groups that the plan asks for:
    ``twins`` by group.
    """
    data, seed = compute(context), context.seed
    encoder = configure(context.effort.make_encoder(), {"random_state": seed})
    twins = {
        group: compare_twins(one.tensors, one.labels, encoder, data.plan, random_state=seed)
        for group, one in _list_twins(data.groups, data.plan.twins).items()
    }
    rows, n = {}, data.plan.null_restarts
    for group, found in twins.items():
        name = data.speeds.get(group, group)
        rows[f"classification.twin.{name}"] = spread_accuracy(found.other, n)
        rows[f"classification.twin_kept.{name}"] = make_spread(
            found.kept, *_bound_kept(found), n=n
        )
    return SimpleNamespace(**vars(data) | {"rows": data.rows | rows}, twins=twins)


def show_nulls(data: SimpleNamespace, section: Section) -> None:
    """Null of each group's dispersion and accuracy, and the twin test, beside the real numbers."""
    section.heading("Identical touches, and every touch twice")
    rows = []
    for comparison, curves in data.curves.items():
        null, real = data.nulls[comparison], data.dispersions[comparison]["joint"]
        for group, sweep in curves.find("joint").items():
            cells = [
                f"{real.average[index][group].estimate:.3g} /"
                f" {null.average[index][group].estimate:.3g}"
                for index in INDICES
            ]
            alone, fitted = curves.find_null("joint", group=group), curves.fits[group]
            cells.append(f"{100 * sweep.noisy.mean():.0f} / {100 * alone.noisy.mean():.0f}")
            end = "by its tolerance" if fitted.converged else "at the limit"
            rows.append([comparison, group, *cells, f"{fitted.n_iter}, {end}"])
    section.table(
        [
            "by",
            "group",
            *(known.label for known in INDICES.values()),
            "accuracy [%]",
            "iterations of the null",
        ],
        rows,
        "Real / null: jointly fitted codes of each group's tensors, and of one of its tensors"
        " repeated. A difference that identical touches show too comes from the recipe. Profiles in"
        " the paper's window; complete touches stand below.",
    )
    if data.twins:
        _show_twins(section, data.twins, data.plan)


def disperse_null(
    members: Mapping[str, Group], fits: Mapping[str, JointFit], random_state: int
) -> Dispersion:
    """Dispersion of every group's null, on the common scale of the groups' own codes."""
    peak = max(
        *(group.codes["joint"].max() for group in members.values()),
        *(fitted.codes.max() for fitted in fits.values()),
    )
    scaled = {name: fitted.codes / peak for name, fitted in fits.items()}
    return compute_dispersion(scaled, scale=False, random_state=random_state)


def _list_twins(groups: Mapping[str, Mapping[str, Group]], which: str) -> dict[str, Group]:
    """Speeds, then the other profiles; the first profile's touches are the slowest speed's."""
    speeds, profiles = groups.get("speed", {}), groups.get("profile", {})
    every = {**speeds, **dict(list(profiles.items())[1 if speeds else 0 :])}
    wanted = {
        "all": set(every),
        "ends": {*list(speeds)[:1], *list(speeds)[-1:], CLAIMED[-1]},
        "none": set(),
    }[which]
    return {name: group for name, group in every.items() if name in wanted}


def _bound_kept(found: DuplicateControl) -> tuple[float, float]:
    """The 95 % interval of the share that carries over, over touches (bootstrap)."""
    same, other = (sweep.area - sweep.chance for sweep in (found.same, found.other))
    picks = np.random.default_rng(0).integers(same.size, size=(2000, same.size))
    height, carried = same[picks].mean(axis=1), np.maximum(other[picks].mean(axis=1), 0.0)
    kept = np.divide(carried, height, out=np.zeros(len(picks)), where=height > 0)
    low, high = np.quantile(kept, [0.025, 0.975])
    return float(low), float(high)


def _show_twins(
    section: Section,
    twins: Mapping[str, DuplicateControl],
    plan: Plan,
) -> None:
    rows = []
    for group, found in twins.items():
        accuracies = [
            " / ".join(f"{100 * a:.0f}" for a in sweep.noisy.mean(axis=1))
            for sweep in (found.same, found.other)
        ]
        rows.append([group, *accuracies, f"{100 * found.kept:.0f}", found.fitted.n_iter])
    ratios = " / ".join(f"{100 * ratio:.0f}" for ratio in plan.ratios)
    section.table(
        [
            "group",
            f"same twin [%] at {ratios} % noise",
            "other twin [%]",
            "kept [%]",
            "iterations",
        ],
        rows,
        "Every tensor stands twice in one joint fit. Trained on noisy copies of one twin, tested on"
        " copies of the same and of the other. Kept: the share of the accuracy above chance that"
        " carries over, which is what belongs to the touch.",
    )


# Beside Fig. 5B, D: profiles compared over complete touches, since 380 ms cut all but the
# exponential profile's short.


@lru_cache(maxsize=1)
def compute_complete(context: Context) -> SimpleNamespace | None:
    """Everything of whole slow touches, by profile; of one profile nothing.

    Returns
    -------
    SimpleNamespace
        ``rows``. ``windows`` by profile; ``indices``, see :func:`list_indices`;
        ``cut[noise][profile]`` and ``sweeps[noise][profile]`` of accuracy on tensors, in the
        paper's window and of whole touches; and ``peaks`` by profile, the greatest angle [rad]:
        common noise is a share of the greatest of them.
    """
    names, base, plan = list_profiles(context), compute(context), context.effort.plan
    if len(names) < 2:
        return None
    tensors = {name: load_complete(context, name) for name in names}
    arrays, labels = complete_arrays(tensors)
    options: dict[str, Any] = {
        "ratios": plan.ratios,
        "n_copies": plan.n_copies,
        "n_repeats": plan.n_repeats,
        "estimator": make_lda(),
        "random_state": context.seed,
    }
    sweeps = {
        noise: {
            name: compute_sweep(array, labels, noise=NOISES[noise](), **options)
            for name, array in arrays.items()
        }
        for noise in ("relative", "common")
    }
    cut = {noise: base.curves["profile"].find("raw", noise) for noise in sweeps}
    windows = {name: measure_window(data) for name, data in tensors.items()}
    peaks = {
        name: float(rectify(complete_tensors(data)["angle"].values).max())
        for name, data in tensors.items()
    }
    rows, indices = list_indices(
        compute_dispersion(arrays, random_state=context.seed), base.rows
    )
    rows |= {f"complete.peak.{name}": peak for name, peak in peaks.items()}
    rows |= {
        f"window.{part}.{name}": value
        for name, window in windows.items()
        for part, value in vars(window).items()
    }
    rows |= {
        f"{kind}.{noise}.{name}": spread_accuracy(found[noise][name])
        for kind, found in (("complete", sweeps), ("cut", cut))
        for noise, one in sweeps.items()
        for name in one
    }
    return SimpleNamespace(
        rows=rows, windows=windows, indices=indices, sweeps=sweeps, cut=cut, peaks=peaks
    )


def plot_complete(data: SimpleNamespace, figure: Figure) -> None:
    """Accuracy on tensors by profile: the paper's window on the left, complete touches on the
    right; a row per noise.
    """
    axes = figure.subplots(2, 2, sharex=True, sharey=True)
    for row, noise in zip(axes, data.sweeps, strict=True):
        for ax, sweeps in zip(row, (data.cut[noise], data.sweeps[noise]), strict=True):
            for k, (name, sweep) in enumerate(sweeps.items()):
                plot_sweep(
                    sweep,
                    ax,
                    color=PROFILE_COLOURS.get(name, PALETTE[k % len(PALETTE)]),
                    label=name,
                )
            ax.axhline(100 * sweep.chance, color="#888888", ls=":", lw=0.8)
            ax.set(xlim=(0, 32), ylim=(0, 103))
        row[0].set_ylabel(f"accuracy [%]\n{noise} noise")
    for ax, window in zip(axes[0], WINDOWS, strict=True):
        ax.set_title(window)
    for ax in axes[1]:
        ax.set_xlabel("noise [%]")
    axes[0, 0].legend(fontsize=7, frameon=False)


def show_complete(data: SimpleNamespace, section: Section) -> None:
    """What the window cuts, and the profiles compared without it."""
    section.heading("Complete touches")
    section.text(
        f"The paper's window of {DURATION:g} ms holds the exponential profile's touches whole and"
        " cuts the others'. So the profiles are compared again over complete touches: each over its"
        f" own shortest full window, all with {DURATION:g} samples. Whether a touch begins again"
        f" was looked for up to {COMPLETE:g} ms."
    )
    section.table(
        [
            "profile",
            "lets go at the latest [ms]",
            "cut by the window",
            "of these, out of contact at its end",
            "identical pairs",
            "ceiling",
        ],
        [[name, w.end, w.cut, w.again, w.pairs, w.ceiling] for name, w in data.windows.items()],
        f"Slow touches, {WINDOWS[1]} (of"
        f" {next(iter(data.sweeps['relative'].values())).classes.size}). Identical pairs: touches"
        f" whose tensors differ by less than {SAME:g} rad inside the paper's window; no"
        " classifier can be right more often than the ceiling says.",
    )
    section.figure(
        "fig5_complete",
        "Accuracy of LDA on slow tensors by profile, in the paper's window and over complete"
        " touches, with noise relative to each tensor's peak and with one noise floor for all;"
        " mean ± 1 SD over repeats, chance dotted.",
        lambda figure: plot_complete(data, figure),
        height=4.6,
        numbers={
            WINDOWS[1]: _list_noisy(data.sweeps),
            WINDOWS[0]: _list_noisy(data.cut),
            "windows": {name: vars(window) for name, window in data.windows.items()},
        },
    )
    loudest = max(data.peaks, key=data.peaks.__getitem__)
    section.text(
        "Common noise is a share of the greatest angle of all antennas,"
        f" {data.peaks[loudest]:.3g} rad ({loudest}). The greatest angle of each, in rad: "
        + ", ".join(f"{name} {peak:.3g}" for name, peak in data.peaks.items())
        + "."
    )
    section.table(
        ["index", *data.windows],
        data.indices,
        f"Closest match of the tensors: {WINDOWS[0]} → {WINDOWS[1]}.",
    )


def _list_noisy(found: Mapping[str, Mapping[str, Sweep]]) -> dict[str, dict[str, np.ndarray]]:
    return {
        noise: {name: sweep.noisy for name, sweep in sweeps.items()}
        for noise, sweeps in found.items()
    }


def list_indices(
    whole: Dispersion, known: Mapping[str, Any], names: Mapping[Any, str] | None = None
) -> tuple[dict[str, Any], list[list[str]]]:
    """The four indices of tensors by group, in the paper's window, which are among the ``known``
    values, and over complete touches: values, and lines of a table. ``names`` of groups, where
    values call them otherwise.
    """
    rows, lines = {}, []
    for index in INDICES:
        line = [INDICES[index].label]
        for group, one in whole.average[index].items():
            name, n = (names or {}).get(group, group), whole.values(index, group).size
            cut = known[f"dispersion.tensor.{index}.{name}"]
            rows[f"dispersion.{WINDOWS[0]}.{index}.{name}"] = cut
            rows[f"dispersion.{WINDOWS[1]}.{index}.{name}"] = make_spread(
                one.estimate, one.low, one.high, n=n
            )
            line.append(f"{cut['value']:.3g} → {one.estimate:.3g}")
        lines.append(line)
    return rows, lines


# Beside Fig. 5C: LDA on the tensors of every speed, in the paper's window and over whole
# touches; and every reading by which the two claims on LDA are judged.

JOINT_CODES, TENSORS = "jointly fitted codes", tuple(f"tensors, {window}" for window in WINDOWS)
"""What LDA may have read."""


def sweep_speeds(
    groups: Mapping[str, tuple[np.ndarray, np.ndarray]], plan: Plan, *, random_state: int = 0
) -> tuple[dict[str, Sweep], Sweep]:
    """Accuracy on noisy tensors of every group, given with their labels, and on as many copies of
    one tensor, labelled as if they were different touches.
    """

    def sweep(array: np.ndarray, labels: np.ndarray, n_repeats: int) -> Sweep:
        return compute_sweep(
            array,
            labels,
            ratios=plan.ratios,
            n_copies=plan.n_copies,
            n_repeats=n_repeats,
            noise=Relative(),
            estimator=make_lda(),
            random_state=random_state,
        )

    first, labels = next(iter(groups.values()))
    repeated = np.repeat(first[:1], len(first), axis=0)
    sweeps = {name: sweep(*group, plan.n_repeats) for name, group in groups.items()}
    return sweeps, sweep(repeated, labels, plan.control_repeats or plan.n_repeats)


def compute_speeds(context: Context) -> SimpleNamespace | None:
    """LDA on tensors by speed, in the paper's window (``cut``) and over ``whole`` touches, with
    ``indices``; ``rows``: these, and every reading of the claims on LDA.
    """
    if len(list_speeds(context, list_profiles(context)[0])) < 2:
        return None
    base, groups = compute(context), _list_speeds(context)
    whole, null = sweep_speeds(groups, context.effort.plan, random_state=context.seed)
    arrays = {name: array for name, (array, _) in groups.items()}
    dispersion = compute_dispersion(arrays, random_state=context.seed)
    rows, indices = list_indices(dispersion, base.rows, base.speeds)
    complete = {base.speeds[group]: spread_accuracy(sweep) for group, sweep in whole.items()}
    profiles = compute_complete(context)
    for name, sweep in profiles.sweeps["relative"].items() if profiles else ():
        complete[name] = spread_accuracy(sweep)
    for curves in base.curves.values():
        rows |= _list_readings(curves, base, complete, spread_accuracy(null))
    return SimpleNamespace(
        rows=rows, indices=indices, cut=base.curves["speed"].find("raw"), whole=whole
    )


def show_speeds(data: SimpleNamespace, section: Section) -> None:
    """Tables of accuracy and indices by speed."""
    section.heading("Tensors by speed")
    section.table(
        ["window", *data.whole],
        [
            [
                window,
                *(100 * float(one.noisy[one.ratios > 0].mean()) for one in sweeps.values()),
            ]
            for window, sweeps in zip(WINDOWS, (data.cut, data.whole), strict=True)
        ],
        "Accuracy of LDA on the tensors of every speed [%], mean over the noise: in the paper's"
        " window, and over each speed's own shortest window that holds its touches whole.",
    )
    section.table(
        ["closest match", *data.whole],
        data.indices,
        "Averages by speed: in the paper's window, most of which a fast touch leaves empty → over"
        " each speed's own window of complete touches.",
    )


def _list_speeds(context: Context) -> dict[str, tuple[np.ndarray, np.ndarray]]:
    """Whole touches of the first profile at every speed, named as the paper's groups are."""
    name = list_profiles(context)[0]
    every = load_tensors(context, name)
    names = {given: speed for speed, given in name_speeds(context).items()}
    sets = {
        names[given]: load_complete(context, name)
        if given == "slow"
        else select_speed(every, speed)
        for given, speed in reversed(list_speeds(context, name).items())
    }
    return {
        given: (_order(data, keep_whole(data)), _label(data)) for given, data in sets.items()
    }


def _order(data: xr.Dataset, array: np.ndarray) -> np.ndarray:
    return array[np.argsort(make_labels(data), kind="stable")]


def _label(data: xr.Dataset) -> np.ndarray:
    return np.sort(make_labels(data))


def _list_readings(
    curves: Curves,
    base: SimpleNamespace,
    complete: Mapping[str, dict[str, float]],
    null: dict[str, float],
) -> dict[str, Any]:
    """Accuracy of every group, and of identical touches, in each reading."""
    rows: dict[str, Any] = {}
    alone = curves.find_null("raw")
    assert alone is not None  # compute_curves makes one for every kind of code
    for group, sweep in curves.find("raw").items():
        name = base.speeds.get(group, group)
        readings = {
            JOINT_CODES: [
                base.rows[f"classification.{part}.{name}"] for part in ("lda", "null")
            ],
            TENSORS[0]: (spread_accuracy(sweep), spread_accuracy(alone)),
            TENSORS[1]: (complete[name], null),
        }
        for reading, (own, identical) in readings.items():
            rows |= {f"lda.{reading}.{name}": own, f"lda.null.{reading}.{name}": identical}
    return rows


# Beside Fig. 5B, D: jointly fitted codes of complete touches by profile, with their nulls;
# the paper's window cuts the profiles differently.

_PARTS = ("activation", "null")


@lru_cache(maxsize=1)
def compute_codes(context: Context) -> Any:
    """Codes of each profile's complete touches, fitted jointly, and of one of them repeated; of one
    profile nothing.

    Returns
    -------
    SimpleNamespace | None
        ``rows``. ``groups``, each profile's tensors and codes; ``dispersion`` of the codes and of
        their nulls, by part; ``curves`` of accuracy.
    """
    names, plan, known = list_profiles(context), context.effort.plan, compute(context).rows
    if len(names) < 2:
        return None
    arrays, labels = complete_arrays({name: load_complete(context, name) for name in names})
    encoder, seed = context.effort.make_encoder(), context.seed
    n_starts = context.effort.control_restarts
    settings = {"n_restarts": n_starts, "random_state": seed}
    groups = {}
    for name, array in arrays.items():
        fitted = configure(encoder, settings)
        codes = make_codes(array, fitted, kinds=("joint",))
        null = fit_null(array, configure(encoder, settings), plan)
        groups[name] = Group(
            tensors=array, labels=labels, encoder=fitted, codes=codes, null=null
        )
    once = replace(plan, other_copies=(), before_repeats=0)
    options = {"kinds": ("joint",), "noises": ("relative",), "random_state": seed}
    curves = keep("curves", compute_curves, groups, once, **options)
    codes = {name: group.codes["joint"] for name, group in groups.items()}
    dispersion = {
        "activation": compute_dispersion(codes, random_state=seed),
        "null": disperse_null(groups, curves.fits, seed),
    }
    rows: dict[str, Any] = {}
    for part, starts in zip(_PARTS, (n_starts, plan.null_restarts), strict=True):
        for index, name in product(INDICES, names):
            one, prefix = dispersion[part].average[index][name], f"dispersion.{part}.{index}"
            rows[f"{prefix}.{WINDOWS[0]}.{name}"] = known.get(f"{prefix}.{name}")
            rows[f"{prefix}.{WINDOWS[1]}.{name}"] = make_spread(
                one.estimate, one.low, one.high, n=starts
            )
    for name, sweep in curves.find("joint").items():
        null, reading = curves.find_null("joint", group=name), f"{WINDOWS[1]}, {JOINT_CODES}"
        assert null is not None  # compute_curves makes one for every group
        rows[f"lda.{reading}.{name}"] = spread_accuracy(sweep, n_starts)
        rows[f"lda.null.{reading}.{name}"] = spread_accuracy(null, plan.null_restarts)
    return SimpleNamespace(rows=rows, groups=groups, dispersion=dispersion, curves=curves)


def show_codes(data: SimpleNamespace, section: Section) -> None:
    """Dispersion and accuracy of such codes beside their nulls."""
    rows = []
    for name, sweep in data.curves.find("joint").items():
        cells = [
            " / ".join(
                f"{data.dispersion[p].average[index][name].estimate:.3g}" for p in _PARTS
            )
            for index in INDICES
        ]
        null = data.curves.find_null("joint", group=name)
        cells.append(f"{100 * sweep.noisy.mean():.0f} / {100 * null.noisy.mean():.0f}")
        rows.append([name, *cells])
    section.table(
        ["profile", *(known.label for known in INDICES.values()), "accuracy [%]"],
        rows,
        "Real / null: jointly fitted codes of complete touches, and of one of them repeated.",
    )
