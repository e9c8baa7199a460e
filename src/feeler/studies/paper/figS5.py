"""Fig. S5: do the bases change with how long they last?"""

from collections.abc import Sequence
from types import SimpleNamespace
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from feeler.encoding import ConvolutiveNMF, match_components
from feeler.plotting.bases import plot_bases
from feeler.report.section import Section
from feeler.studies.paper.context import Context
from feeler.studies.paper.data import list_profiles, load_tensors
from feeler.studies.paper.fig4 import load, prepare
from feeler.studies.scale import Scale
from feeler.tensors.unit import in_unit

REFERENCE = 40  # [P]


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
        ``encoders`` by duration [samples]. ``profile_similarity`` (duration, component): cosine of
        the bases' profiles along the antenna (sums over lags) with the reference's.
        ``basis_similarity`` (duration, component): greatest cosine over shifts of the whole bases
        with the reference's; a shorter one can reach 1 only where the longer one is silent.
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
    reference = encoders[REFERENCE if REFERENCE in encoders else durations[-1]].components_
    profiles = [encoder.components_.sum(axis=2, keepdims=True) for encoder in encoders.values()]
    return SimpleNamespace(
        encoders=encoders,
        profile_similarity=np.stack(
            [match_components(reference.sum(axis=2, keepdims=True), p)[1] for p in profiles]
        ),
        basis_similarity=np.stack(
            [match_components(reference, e.components_)[1] for e in encoders.values()]
        ),
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
    profile, basis = data.profile_similarity.min(), data.basis_similarity.min()
    section.values |= {
        "encoding.duration.profile along the antenna": float(profile),
        "encoding.duration.whole basis": float(basis),
    }
    section.text(
        "Along the antenna the bases of all durations resemble those of 40 ms with a cosine of at"
        f" least {profile:.2f}; as whole pictures, at least {basis:.2f}."
    )
