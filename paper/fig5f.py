"""Fig. 5F, G and S5: bases by stiffness profile and by how long they last."""

from collections.abc import Callable, Mapping
from functools import lru_cache
from types import SimpleNamespace
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from sklearn.base import clone

from feeler.decoding import make_labels
from feeler.encoding import (
    ConvolutiveNMF,
    compute_entropies,
    compute_histogram_entropy,
    match_components,
)
from feeler.plotting import plot_bases
from feeler.plotting.style import mark_panels, pick_colours
from feeler.report import Section
from paper.context import Context
from paper.data import WINDOWS, complete_tensors, list_profiles, load_complete, load_tensors
from paper.fig4 import compare_others, prepare, span
from paper.fig4 import compute as fit_ranks

# Fig. 5F–G: the bases of each stiffness profile, their entropy, and how well they map to
# contact location.

_PAPER = {"exponential": 1.9, "linear": 2.7, "uniform": 2.8}  # bits, mean over three bases [P]


_Entropies = Mapping[str, np.ndarray]
"""By profile: (restart, component)."""


def _each(measure: Callable[[np.ndarray], float]) -> Callable[[np.ndarray], np.ndarray]:
    return lambda bases: np.array([measure(basis) for basis in bases])


def _measure_unscaled(basis: np.ndarray) -> float:
    return compute_histogram_entropy(basis, scale="none")


READINGS: dict[str, Callable[[np.ndarray], np.ndarray]] = {
    "histogram of [0, 1]": compute_entropies,
    "histogram of unit length": _each(_measure_unscaled),
    "histogram, together of unit length": lambda bases: _each(_measure_unscaled)(
        bases / np.linalg.norm(bases)
    ),
    "32 bins in nats": _each(
        lambda basis: float(np.log(2)) * compute_histogram_entropy(basis, levels=32)
    ),
    "10 bins": _each(lambda basis: compute_histogram_entropy(basis, levels=10)),
    "probability mass": lambda bases: compute_entropies(bases, "mass"),
}
"""Readings of "entropy of a basis", (component, sensor, lag) → (component,): grey levels of the
basis as a picture, stretched to its greatest entry, of unit length, or all three together of unit
length (256 levels, clipped at 1, as MATLAB's ``entropy`` does); with fewer levels; or its entries
as shares of mass. Bits but for the one in nats."""
_DRAWN = "histogram of [0, 1]"  # the reading that is nearest to the paper's words


@lru_cache(maxsize=1)
def compute(context: Context) -> SimpleNamespace:
    """The bases of each profile, in the paper's window and of complete touches.

    Returns
    -------
    SimpleNamespace
        ``rows``; ``windows``: what :func:`fit_profiles` gives, by window.
    """
    names = list_profiles(context)
    sets = {WINDOWS[0]: {name: load_tensors(context, name) for name in names}}
    if len(names) > 1:
        sets[WINDOWS[1]] = {
            name: complete_tensors(load_complete(context, name)) for name in names
        }
    fewer = {"n_restarts": context.effort.control_restarts}
    windows = {
        window: fit_profiles(
            tensors,
            context.effort.make_encoder(
                random_state=context.seed, **({} if window == WINDOWS[0] else fewer)
            ),
        )
        for window, tensors in sets.items()
    }
    before = {window: f"{window}, " for window in WINDOWS} | {WINDOWS[0]: ""}
    rows = {
        f"encoding.basis_entropy.{before[window]}{definition}.{name}": span(
            np.nanmean(values, axis=1)
        )
        for window, one in windows.items()
        for definition, by_profile in one.entropy.items()
        for name, values in by_profile.items()
    }
    return SimpleNamespace(rows=rows, windows=windows)


def fit_profiles(tensors: Mapping[str, Any], encoder: ConvolutiveNMF) -> SimpleNamespace:
    """Encode each profile's tensors alone, on the touches of the slowest speed that all
    profiles have, as profiles are compared there.

    tensors : Datasets by profile, with location and speed.

    encoder : unfitted; each profile gets a copy.

    Returns
    -------
    SimpleNamespace
        ``encoders`` by profile. ``entropy`` [bits] by definition and profile: (restart, component),
        best restart first. ``sampling`` [ms].
    """
    common = set.intersection(
        *(set(np.unique(np.round(d["speed"].values, 6))) for d in tensors.values())
    )
    # on the scale and in the order in which Fig. 5A–E fits the same tensors, which then come from
    # the cache
    peak = max(float(prepare(dataset).max()) for dataset in tensors.values())
    encoders = {}
    for name, dataset in tensors.items():
        order = np.argsort(make_labels(dataset), kind="stable")
        slow = np.abs(dataset["speed"].values[order] - min(common)) < 1e-6
        array = prepare(dataset.isel(trial=order[slow])) / peak
        encoders[name] = clone(encoder).fit(array)
    entropy = {
        definition: {
            name: np.array([measure(bases) for bases in encoder.restart_components_])
            for name, encoder in encoders.items()
        }
        for definition, measure in READINGS.items()
    }
    return SimpleNamespace(
        encoders=encoders,
        entropy=entropy,
        sampling=float(np.diff(next(iter(tensors.values()))["time"].values[:2])[0]),
    )


def _average(entropies: _Entropies) -> dict[str, float]:
    """Mean over the bases of the best restart, by profile."""
    return {name: float(np.nanmean(values[0])) for name, values in entropies.items()}


def _plot_entropy(data: SimpleNamespace, ax: Axes) -> None:
    """Fig. 5G: mean entropy of the bases, 256 grey levels; whiskers span the restarts; crosses are
    the paper's.
    """
    names, found = list(data.encoders), data.entropy[_DRAWN]
    values = [np.nanmean(found[name], axis=1) for name in names]
    middle = np.array([v[0] for v in values])
    ends = np.abs([[v[0] - v.min(), v.max() - v[0]] for v in values]).T
    spread = ends if values[0].size > 1 else None  # one start has none
    for place, (name, colour) in enumerate(pick_colours(names).items()):
        ax.bar(place, middle[place], 0.6, color=colour, label=name)
    ax.errorbar(range(len(names)), middle, spread, fmt="none", color="#000000", capsize=3)
    known = [(k, _PAPER[name]) for k, name in enumerate(names) if name in _PAPER]
    ax.plot(*zip(*known, strict=True), "kx", label="the paper") if known else None
    ax.set_xticks([])
    ax.set(ylabel="mean entropy of the bases [bits]", ylim=(0, 1.5 * float(middle.max())))
    ax.legend(loc="upper left")
    mark_panels(ax, "g")


def plot(data: SimpleNamespace, figure: Figure) -> None:
    """F on the left, G on the right, in the paper's window; needs about 7.2 × 4 inches."""
    data = data.windows[WINDOWS[0]]
    left, right = figure.subfigures(1, 2, width_ratios=(1.4, 1), squeeze=False).flat
    plot_bases(
        {name: encoder.components_ for name, encoder in data.encoders.items()},
        data.sampling,
        left.subplots(),
    )
    mark_panels(left.axes[0], "f")
    _plot_entropy(data, right.subplots())


def show(data: SimpleNamespace, section: Section) -> None:
    """The bases of each profile, and their entropies."""
    section.heading("Bases by stiffness profile")
    section.figure(
        "fig5f_bases",
        "f: the three bases of each profile's slow tensors. g: their mean entropy (256 grey levels;"
        " the paper does not name its definition), best of the restarts, whiskers span all;"
        " crosses:"
        " the paper. Both in the paper's window; complete touches are in the table. (Fig. 5F–G)",
        lambda figure: plot(data, figure),
        height=4.2,
        numbers={"entropy": {window: one.entropy for window, one in data.windows.items()}},
    )
    rows: list[list[object]] = [
        [window, definition, *_average(by_profile).values()]
        for window, one in data.windows.items()
        for definition, by_profile in one.entropy.items()
    ]
    first = data.windows[WINDOWS[0]]
    said = [_PAPER.get(name, "–") for name in first.encoders]
    section.table(
        ["window", "definition", *first.encoders],
        [*rows, [WINDOWS[0], "the paper, which names none", *said]],
        "Mean entropy of the three bases [bits, but nats where said], best restart, under every"
        " definition tried.",
    )


# Fig. S5: do the bases change with how long they last?

_REFERENCE = 40  # [P]


def _sum_lags(bases: np.ndarray) -> np.ndarray:
    """Profiles along the antenna, less their mean: two flat ones are not alike in shape."""
    profile = bases.sum(axis=2, keepdims=True)
    return profile - profile.mean(axis=1, keepdims=True)


ALONG, _ALL = "profile along the antenna", "whole basis"
_VIEWS: dict[str, Callable[[np.ndarray], np.ndarray]] = {
    ALONG: _sum_lags,
    _ALL: lambda bases: bases,
}
"""Readings of "the shape of a basis"."""


def compute_durations(context: Context) -> SimpleNamespace | None:
    """Fit three bases of each duration to the tensors of the main antenna.

    Returns
    -------
    SimpleNamespace
        ``rows``. ``encoders`` by duration [samples]. ``similarity`` by definition (start, duration,
        component), the best start first: along the antenna, correlation of the bases' profiles
        (sums over lags) with the reference's; of whole bases the greatest cosine over shifts; a
        shorter one can reach 1 only where the longer one is silent. ``others`` by definition
        (start,): how alike at most two different bases of the reference are.
        ``residual`` (duration,): ‖V − V̂‖/‖V‖. ``sampling`` [ms].
    """
    effort = context.effort
    if not effort.durations:
        return None
    fitted = fit_ranks(context)
    data, known = fitted.data, fitted.encoders.get(3)
    encoders = {}
    for n_lags in effort.durations:
        if known is not None and known.n_lags == n_lags:
            encoders[n_lags] = known
            continue
        encoder = effort.make_encoder(
            n_lags=n_lags, n_restarts=effort.side_restarts, random_state=context.seed
        )
        encoders[n_lags] = encoder.fit(data)
    reference = encoders[_REFERENCE if _REFERENCE in encoders else effort.durations[-1]]
    starts = range(min(len(encoder.restart_components_) for encoder in encoders.values()))
    similarity = {
        name: np.array(
            [
                [
                    match_components(
                        view(reference.components_), view(encoder.restart_components_[start])
                    )[1]
                    for encoder in encoders.values()
                ]
                for start in starts
            ]
        )
        for name, view in _VIEWS.items()
    }
    others = {
        name: np.array(
            [compare_others(view(reference.restart_components_[start])) for start in starts]
        )
        for name, view in _VIEWS.items()
    }
    rows = {
        f"encoding.duration.{name}": span(found.min(axis=(1, 2)))
        for name, found in similarity.items()
    } | {f"encoding.duration.others.{name}": span(found) for name, found in others.items()}
    return SimpleNamespace(
        rows=rows,
        encoders=encoders,
        similarity=similarity,
        others=others,
        residual=np.array([encoder.relative_residual_ for encoder in encoders.values()]),
        sampling=fitted.sampling,
    )


def plot_durations(data: SimpleNamespace, figure: Figure) -> None:
    """One row per duration, one column per basis."""
    sets = {
        f"T = {data.sampling * n_lags:g} ms": encoder.components_
        for n_lags, encoder in data.encoders.items()
    }
    plot_bases(sets, data.sampling, figure.subplots())


def show_durations(data: SimpleNamespace, section: Section) -> None:
    """Bases of every duration, and how alike they are."""
    section.heading("How long a basis lasts")
    section.figure(
        "figS5_durations",
        "Three bases for each duration from 10 to 60 ms. (Fig. S5)",
        lambda figure: plot_durations(data, figure),
        height=5.0,
        numbers={
            "profile": data.similarity[ALONG][0],
            "basis": data.similarity[_ALL][0],
            "residual": data.residual,
        },
    )
    (profile, alike), (basis, same) = (
        (data.similarity[name][0].min(), data.others[name][0]) for name in (ALONG, _ALL)
    )
    section.text(
        "Along the antenna the bases of all durations correlate with those of 40 ms to at least"
        f" {profile:.2f} (two different bases of 40 ms to at most {alike:.2f}); as whole pictures"
        f" their cosine is at least {basis:.2f} (at most {same:.2f})."
    )
