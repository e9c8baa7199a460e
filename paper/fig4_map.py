"""Beside Fig. 4C–D: when and where each basis acts, and which contacts drive it, over every start
of the fit.
"""

from collections.abc import Mapping
from copy import copy
from types import SimpleNamespace
from typing import Any

import numpy as np

from feeler.analysis.dispersion import student_mean
from feeler.encoding import (
    ConvolutiveNMF,
    LocationMapping,
    compute_basis_similarity,
    locate_components,
    map_locations,
    match_components,
)
from feeler.report import Section, make_spread


def compute(
    encoder: ConvolutiveNMF, data: np.ndarray, locations: np.ndarray
) -> SimpleNamespace:
    """What the bases of each start say of time, place and contact, the best start first.

    Returns
    -------
    SimpleNamespace
        ``lag`` (start, component): centre of mass of each basis over its lags [samples], and
        ``span``: its standard deviation over them. ``place``
        (start, component): over the sensors, 0 at the first and 1 at the last. ``mappings``, a
        :class:`~feeler.encoding.LocationMapping` of each start's ridge codes. ``margin`` (start,):
        by how much contacts at the first and last of ``locations`` single out the first and the
        last basis, see :func:`measure_margin`.
    """
    bases = encoder.restart_components_
    places = np.array([locate_components(one) for one in bases])
    mappings = [
        map_locations(_encode(encoder, one, data), locations, place)
        for one, place in zip(bases, places, strict=True)
    ]
    along = bases.sum(axis=2)
    mass = along.sum(axis=2)
    share, lags = along / np.where(mass > 0, mass, np.nan)[..., None], np.arange(along.shape[2])
    lag = share @ lags
    span = np.sqrt(np.maximum(share @ lags**2 - lag**2, 0.0))
    margin = np.array([measure_margin(one.share) for one in mappings])
    return SimpleNamespace(lag=lag, span=span, place=places, mappings=mappings, margin=margin)


def _encode(encoder: ConvolutiveNMF, bases: np.ndarray, data: np.ndarray) -> np.ndarray:
    other = copy(encoder)
    other.components_ = bases
    return other.transform(data, code="ridge")


def measure_margin(share: np.ndarray) -> float:
    """Least margin by which the first basis belongs to the first location and the last to the last.

    Of the ``share`` (location, component) of each basis in a code: that of the first basis at the
    first location less any other's there, and less its own at the last location; and the mirror
    image. Bases that do not know the location have none, whichever of them is the strongest.
    """
    near, far = share[0], share[-1]
    return float(
        min(
            near[0] - near[1:].max(),
            near[0] - far[0],
            far[-1] - far[:-1].max(),
            far[-1] - near[-1],
        )
    )


def compare_ranks(
    encoders: Mapping[int, ConvolutiveNMF], main: int
) -> tuple[np.ndarray, np.ndarray]:
    """How alike the bases stay when their number changes, and how alike different ones are.

    Returns
    -------
    least : np.ndarray
        Of each start (start,) the least cosine, over shifts, between a basis of the ``main`` number
        (its best start) and its match among those of a greater number.
    others : np.ndarray
        Of each start (start,) the greatest cosine between two different bases of the ``main``
        number.
    """
    known = encoders[main]
    more = [encoder for number, encoder in encoders.items() if number > main]
    least = [
        min(
            match_components(known.components_, encoder.restart_components_[start])[1].min()
            for encoder in more
        )
        for start in range(len(known.restart_components_))
    ]
    return np.array(least), np.array([compare_others(one) for one in known.restart_components_])


def compare_others(bases: np.ndarray) -> float:
    """The greatest similarity of two different bases of one fit."""
    similarity = compute_basis_similarity(bases, bases)
    return float(similarity[~np.eye(len(bases), dtype=bool)].max())


def keep_values(section: Section, found: SimpleNamespace) -> None:
    """The values of all starts that claims are held against, and a table of the best."""
    best: LocationMapping = found.mappings[0]
    rows = []
    for k in range(found.lag.shape[1]):
        section.values[f"encoding.lag.{k + 1}"] = _spread_starts(found.lag[:, k])
        section.values[f"encoding.place.{k + 1}"] = span(found.place[:, k])
        rows.append([k + 1, found.lag[0, k], found.place[0, k], *best.share[:, k]])
    if found.span.shape[1] == 3:
        section.values["encoding.span.2"] = _spread_starts(found.span[:, 1])
        section.values["encoding.span.rival"] = _spread_starts(found.span[:, ::2].max(axis=1))
    section.values["encoding.contact_margin"] = span(found.margin)
    p = np.array([one.p_information for one in found.mappings])
    section.values["encoding.location_p"] = span(p)
    section.table(
        [
            "basis",
            "lag [samples]",
            "place",
            *(f"share at {place:g} L" for place in best.locations),
        ],
        rows,
        "Centre of mass of each basis over its lags and along the sensors (0: the first, 1: the"
        " last), and its share of the energy of the ridge codes of contacts at each place; best"
        " start.",
    )


def _spread_starts(starts: np.ndarray) -> dict[str, Any]:
    """The mean of all starts with its 95 % interval."""
    if not np.isfinite(starts).all():
        return {"undefined": "a basis of some start is empty"}
    mean = student_mean(starts)
    return make_spread(mean.estimate, mean.low, mean.high, n=len(starts))


def span(starts: np.ndarray) -> dict[str, Any]:
    """The best start, which comes first, and the ends of all."""
    if not np.isfinite(starts).all():
        return {"undefined": "a basis of some start is empty"}
    return make_spread(starts[0], np.min(starts), np.max(starts), n=len(starts))
