"""Fig. S5: do the bases change with how long they last?"""

from collections.abc import Callable, Sequence
from types import SimpleNamespace
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from feeler.encoding import ConvolutiveNMF, match_components
from feeler.plotting.results import plot_bases
from feeler.report.page import Section
from feeler.tensors.transforms import in_unit
from paper.context import Context
from paper.data import list_profiles, load_tensors
from paper.fig4 import compare_others, load, prepare, span
from paper.scale import Scale

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


def compute(
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


def plot(data: SimpleNamespace, figure: Figure) -> None:
    """One row per duration, one column per basis."""
    sets = {
        f"T = {data.sampling * n_lags:g} ms": encoder.components_
        for n_lags, encoder in data.encoders.items()
    }
    plot_bases(sets, data.sampling, figure.subplots())


def show(context: Context, section: Section) -> None:
    """Bases of every duration, and how alike they are."""
    if not context.effort.durations:
        return
    tensors = load_tensors(context, list_profiles(context)[0])
    fitted = load(context).encoders.get(3)
    data = compute(tensors, effort=context.effort, fitted=fitted, random_state=context.seed)
    section.heading("How long a basis lasts")
    section.figure(
        "figS5_durations",
        "Three bases for each duration from 10 to 60 ms. (Fig. S5)",
        lambda figure: plot(data, figure),
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
