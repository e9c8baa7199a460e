"""Encoding: what the bases are, and what they mean."""

import numpy as np

from feeler.encoding import LABELS
from feeler.paper import fig4, fig5_bases, figS5
from feeler.paper.context import Context
from feeler.paper.data import list_profiles, load_tensors
from feeler.paper.encoder import EFFORT, SIDE_RESTARTS
from feeler.report.section import Section


def make(context: Context, section: Section) -> None:
    """Figs. 4B–D, 5F–G and S5, and whether bases map to contact location."""
    sets = {name: load_tensors(context, name) for name in list_profiles(context)}
    first = next(iter(sets))
    ranks = (2, 3) if context.scale == "smoke" else fig4.RANKS
    main = fig4.compute(sets[first], scale=context.scale, ranks=ranks, random_state=context.seed)
    _show_ranks(section, main)
    _show_codes(section, main)
    _show_profiles(context, section, sets)
    if context.scale != "smoke":
        _show_durations(context, section, sets[first], main)
    n_restarts, max_iter, tol = EFFORT[context.scale]
    section.text(
        f"Effort at this scale: {n_restarts} random starts by rank, {SIDE_RESTARTS[context.scale]} by profile and duration, "
        f"at most {max_iter} iterations, stopping when one gains less than {tol:g}."
    )


def _show_ranks(section: Section, main: fig4.Fig4Data) -> None:
    section.text(
        "Every tensor is approximated by a few bases (sensor × 40 ms) laid down where sparse activations say. Joint angles, "
        "negative values set to 0; one fit of all tensors, several random starts."
    )
    section.figure(
        "fig4_encoding",
        "Left: residual and activation entropy against the number of bases; bars span the restarts. Below: the bases of each "
        "fit, base to tip upwards, 40 ms across. Right: codes of ball and box on the fixed bases. (Fig. 4B–D)",
        lambda figure: fig4.plot(main, figure),
        height=7.0,
    )
    section.numbers(
        "fig4_encoding", ranks=main.ranks, residual=main.residual, entropy=main.entropy, stability=main.stability
    )
    entropy = main.entropy["histogram"]
    for i, rank in enumerate(main.ranks):
        section.values[f"encoding.residual.M{rank}"] = _spread(main.residual[i])
        section.values[f"encoding.entropy.M{rank}"] = _spread(entropy[i])
    encoder = main.encoders.get(3)
    if encoder is not None:
        for number, centre in enumerate(_centres(encoder.components_), start=1):
            section.values[f"encoding.centre.{number}"] = centre
    section.text(
        f"Restarts agree on their bases to {main.stability.min():.2f}…{main.stability.max():.2f} (1: identical after matching "
        f"order and shift). Tensors have a mean Hoyer sparseness of {main.tensor_sparseness:.2f}."
    )


def _show_codes(section: Section, main: fig4.Fig4Data) -> None:
    section.heading("The same tensors, four codes")
    section.text(
        "Activations found together with the bases (the paper's recipe) are not unique: the same tensor can get different "
        "codes in one fit. On fixed bases each tensor has one code: with the sparseness constraint, or without it, "
        "with a small ridge or as plain non-negative least squares."
    )
    section.table(
        [
            "code",
            "residual",
            "Hoyer sparseness",
            "information on location [bits]",
            "of at most",
            "under permutation",
            "p",
        ],
        [
            [
                LABELS[code],
                main.residual_by_code[code],
                main.sparseness_by_code[code],
                m.information,
                m.ceiling,
                m.information_null,
                m.p_information,
            ]
            for code, m in main.mapping.items()
        ],
        "How well the dominant component tells the contact location: mutual information against a permutation null.",
    )
    section.values["encoding.location_p"] = main.mapping["ridge"].p_information


def _show_profiles(context: Context, section: Section, sets: dict) -> None:
    data = fig5_bases.compute(sets, scale=context.scale, random_state=context.seed)
    section.heading("Bases by stiffness profile")
    section.figure(
        "fig5f_bases",
        "Three bases of each profile's slow tensors, and their entropy by three definitions; whiskers span the restarts, "
        "crosses are the paper's values. The paper does not say how its entropy was computed. (Fig. 5F–G)",
        lambda figure: fig5_bases.plot(data, figure),
        height=4.2,
    )
    for name, values in data.entropy[fig5_bases.DEFINITIONS[0]].items():
        section.values[f"encoding.basis_entropy.{name}"] = _spread(np.nanmean(values, axis=1))
    section.table(
        ["definition", *data.encoders],
        [[d, *(float(np.nanmean(data.entropy[d][name][0])) for name in data.encoders)] for d in data.entropy],
        "Mean entropy of the three bases [bits], best restart.",
    )
    section.numbers("fig5f_bases", entropy=data.entropy)


def _show_durations(context: Context, section: Section, tensors, main: fig4.Fig4Data) -> None:
    data = figS5.compute(tensors, scale=context.scale, fitted=main.encoders.get(3), random_state=context.seed)
    section.heading("How long a basis lasts")
    section.figure(
        "figS5_durations",
        "Three bases for each duration from 10 to 60 ms. (Fig. S5)",
        lambda figure: figS5.plot(data, figure),
        height=5.0,
    )
    section.numbers(
        "figS5_durations", profile=data.profile_similarity, basis=data.basis_similarity, residual=data.residual
    )
    section.values["encoding.duration_similarity"] = float(np.min(data.profile_similarity))
    section.text(
        f"Along the antenna the bases of all durations resemble those of 40 ms with a cosine of at least "
        f"{np.min(data.profile_similarity):.2f}; as whole pictures, at least {np.min(data.basis_similarity):.2f}."
    )


def _spread(values: np.ndarray) -> dict[str, float]:
    """Best restart first; the spread is that of the restarts."""
    return {"value": float(values[0]), "low": float(np.min(values)), "high": float(np.max(values))}


def _centres(components: np.ndarray) -> list[float]:
    along = components.sum(axis=2)
    return [float(v) for v in along @ np.arange(along.shape[1]) / along.sum(axis=1)]
