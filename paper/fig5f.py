"""Fig. 5F, G and S5: bases by stiffness profile and by how long they last."""

from collections.abc import Callable, Mapping, Sequence
from functools import lru_cache
from types import SimpleNamespace
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from feeler.decoding import make_labels
from feeler.encoding import (
    ConvolutiveNMF,
    compute_entropies,
    compute_histogram_entropy,
    locate_components,
    map_locations,
    match_components,
)
from feeler.plotting import plot_bases
from feeler.plotting.style import mark_panels, pick_colours
from feeler.report import Section
from feeler.tensors.transforms import in_unit
from paper.context import Context
from paper.data import WINDOWS, complete_tensors, list_profiles, load_complete, load_tensors
from paper.fig4 import compare_others, load, prepare, span
from paper.scale import Scale

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


def compute(
    tensors: Mapping[str, Any],
    *,
    effort: Scale,
    quantity: str = "angle",
    speed: float | None = None,
    random_state: int = 0,
) -> SimpleNamespace:
    """Encode each profile's tensors by itself, on the touches that all profiles have.

    Parameters
    ----------
    tensors : Datasets by profile, with location and speed.
    speed : only touches of this speed, mm/ms; None: the slowest that all profiles have, as profiles
    are compared there.

    Returns
    -------
    SimpleNamespace
        ``encoders`` by profile. ``entropy`` [bits] by definition and profile: (restart, component),
        best restart first. ``mapping`` (:class:`~feeler.encoding.LocationMapping`) by profile:
        location against dominant component of the ridge code. ``sampling`` [ms].
    """
    common = set.intersection(
        *(set(np.unique(np.round(d["speed"].values, 6))) for d in tensors.values())
    )
    speed = min(common) if speed is None else speed
    # on the scale and in the order in which Fig. 5A–E fits the same tensors, which then come from
    # the cache
    peak = max(float(prepare(dataset, quantity).max()) for dataset in tensors.values())
    chosen = {}
    for name, dataset in tensors.items():
        order = np.argsort(make_labels(dataset), kind="stable")
        slow = np.abs(dataset["speed"].values[order] - speed) < 1e-6
        chosen[name] = dataset.isel(trial=order[slow])
    encoders, mapping = {}, {}
    for name, dataset in chosen.items():
        data = prepare(dataset, quantity) / peak
        encoder = effort.make_encoder(
            n_restarts=effort.plan.n_restarts, random_state=random_state
        )
        encoders[name] = encoder.fit(data)
        code = encoders[name].transform(data, code="ridge")
        mapping[name] = map_locations(
            code, dataset["location"].values, locate_components(encoders[name].components_)
        )
    entropy = {
        definition: {
            name: np.array([measure(bases) for bases in encoder.restart_components_])
            for name, encoder in encoders.items()
        }
        for definition, measure in READINGS.items()
    }
    sampling = float(np.diff(next(iter(chosen.values()))["time"].values[:2])[0])
    return SimpleNamespace(
        encoders=encoders, entropy=entropy, mapping=mapping, sampling=sampling
    )


def _average(entropies: _Entropies) -> dict[str, float]:
    """Mean over the bases of the best restart, by profile."""
    return {name: float(np.nanmean(values[0])) for name, values in entropies.items()}


def _find_nearest(data: SimpleNamespace) -> str:
    """The definition whose values come nearest to the paper's, by their root mean square
    difference.
    """
    off = {}
    for definition, entropies in data.entropy.items():
        found = _average(entropies)
        errors = [found[name] - value for name, value in _PAPER.items() if name in found]
        if errors:
            off[definition] = float(np.sqrt(np.mean(np.square(errors))))
    return min(off, key=off.__getitem__) if off else ""


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
    """F on the left, G on the right; needs about 7.2 × 4 inches."""
    left, right = figure.subfigures(1, 2, width_ratios=(1.4, 1), squeeze=False).flat
    plot_bases(
        {name: encoder.components_ for name, encoder in data.encoders.items()},
        data.sampling,
        left.subplots(),
    )
    mark_panels(left.axes[0], "f")
    _plot_entropy(data, right.subplots())


@lru_cache(maxsize=1)
def load_bases(context: Context) -> dict[str, SimpleNamespace]:
    """What this run shows, fitted once, by window."""
    names = list_profiles(context)
    options: dict[str, Any] = {"effort": context.effort, "random_state": context.seed}
    sets = {WINDOWS[0]: {name: load_tensors(context, name) for name in names}}
    if len(names) > 1:
        sets[WINDOWS[1]] = {
            name: complete_tensors(load_complete(context, name)) for name in names
        }
    return {window: compute(tensors, **options) for window, tensors in sets.items()}


def show(context: Context, section: Section) -> None:
    """The bases of each profile, and their entropies, in the paper's window and of complete
    touches.
    """
    fitted = load_bases(context)
    data = fitted[WINDOWS[0]]
    found = {window: one.entropy for window, one in fitted.items()}
    section.heading("Bases by stiffness profile")
    section.figure(
        "fig5f_bases",
        "f: the three bases of each profile's slow tensors. g: their mean entropy (256 grey levels;"
        " the paper does not name its definition), best of the restarts, whiskers span all;"
        " crosses:"
        " the paper. Both in the paper's window; complete touches are in the table. (Fig. 5F–G)",
        lambda figure: plot(data, figure),
        height=4.2,
        numbers={"entropy": found},
    )
    _keep_values(section, found)
    if nearest := _find_nearest(data):
        section.text(
            f"Nearest to the paper's three values: {nearest}. The scale of a basis is one free"
            " number that nobody stated, so being near is no reproduction, and being far says"
            " something of the definition only."
        )


def _keep_values(section: Section, found: Mapping[str, Mapping[str, _Entropies]]) -> None:
    rows: list[list[object]] = []
    for window, entropy in found.items():
        for definition, by_profile in entropy.items():
            reading = definition if window == WINDOWS[0] else f"{window}, {definition}"
            for name, values in by_profile.items():
                average = span(np.nanmean(values, axis=1))
                section.values[f"encoding.basis_entropy.{reading}.{name}"] = average
            rows.append([window, definition, *_average(by_profile).values()])
    names = list(next(iter(found[WINDOWS[0]].values())))
    said = [_PAPER.get(name, "–") for name in names]
    rows.append([WINDOWS[0], "the paper, which names none", *said])
    section.table(
        ["window", "definition", *names],
        rows,
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


def compute_durations(
    tensors: Any,
    *,
    effort: Scale,
    quantity: str = "angle",
    durations: Sequence[int] | None = None,
    fitted: ConvolutiveNMF | None = None,
    random_state: int = 0,
) -> SimpleNamespace:
    """Fit three bases of each duration to the tensors of the main antenna.

    durations : in samples; by default those of the effort.
    fitted : an encoder already fitted to these tensors (Fig. 4's of rank 3), used for its own
    duration.

    Returns
    -------
    SimpleNamespace
        ``encoders`` by duration [samples]. ``profile_similarity`` (duration, component):
        correlation of the bases' profiles along the antenna (sums over lags) with the reference's.
        ``basis_similarity`` (duration, component): greatest cosine over shifts of the whole bases
        with the reference's; a shorter one can reach 1 only where the longer one is silent. By
        definition: ``least`` (start,), the least of these, and ``others`` (start,), how alike at
        most two different bases of the reference are.
        ``residual`` (duration,): ‖V − V̂‖/‖V‖. ``sampling`` [ms].
    """
    durations = durations or effort.durations
    data = prepare(tensors, quantity)
    encoders = {}
    for n_lags in durations:
        if fitted is not None and fitted.n_lags == n_lags:
            encoders[n_lags] = fitted
        else:
            encoder = effort.make_encoder(
                n_lags=n_lags, n_restarts=effort.side_restarts, random_state=random_state
            )
            encoders[n_lags] = encoder.fit(data)
    reference = encoders[_REFERENCE if _REFERENCE in encoders else durations[-1]].components_
    starts = range(min(len(encoder.restart_components_) for encoder in encoders.values()))
    found = {
        name: np.array(
            [
                [
                    match_components(view(reference), view(encoder.restart_components_[start]))[
                        1
                    ]
                    for encoder in encoders.values()
                ]
                for start in starts
            ]
        )
        for name, view in _VIEWS.items()
    }
    known = encoders[
        _REFERENCE if _REFERENCE in encoders else durations[-1]
    ].restart_components_
    return SimpleNamespace(
        encoders=encoders,
        profile_similarity=found[ALONG][0],
        basis_similarity=found[_ALL][0],
        least={name: similarity.min(axis=(1, 2)) for name, similarity in found.items()},
        others={
            name: np.array([compare_others(view(known[start])) for start in starts])
            for name, view in _VIEWS.items()
        },
        residual=np.array([encoder.relative_residual_ for encoder in encoders.values()]),
        sampling=float(np.diff(in_unit(tensors["time"], "ms").values[:2])[0]),
    )


def plot_durations(data: SimpleNamespace, figure: Figure) -> None:
    """One row per duration, one column per basis."""
    sets = {
        f"T = {data.sampling * n_lags:g} ms": encoder.components_
        for n_lags, encoder in data.encoders.items()
    }
    plot_bases(sets, data.sampling, figure.subplots())


def show_durations(context: Context, section: Section) -> None:
    """Bases of every duration, and how alike they are."""
    if not context.effort.durations:
        return
    tensors = load_tensors(context, list_profiles(context)[0])
    fitted = load(context).encoders.get(3)
    data = compute_durations(
        tensors, effort=context.effort, fitted=fitted, random_state=context.seed
    )
    section.heading("How long a basis lasts")
    section.figure(
        "figS5_durations",
        "Three bases for each duration from 10 to 60 ms. (Fig. S5)",
        lambda figure: plot_durations(data, figure),
        height=5.0,
        numbers={
            "profile": data.profile_similarity,
            "basis": data.basis_similarity,
            "residual": data.residual,
        },
    )
    for definition in _VIEWS:
        section.values[f"encoding.duration.{definition}"] = span(data.least[definition])
        section.values[f"encoding.duration.others.{definition}"] = span(data.others[definition])
    (profile, alike), (basis, same) = (
        (data.least[name][0], data.others[name][0]) for name in (ALONG, _ALL)
    )
    section.text(
        "Along the antenna the bases of all durations correlate with those of 40 ms to at least"
        f" {profile:.2f} (two different bases of 40 ms to at most {alike:.2f}); as whole pictures"
        f" their cosine is at least {basis:.2f} (at most {same:.2f})."
    )
