"""Fig. 4: encoding, and what the encoder does with one touch as a drawing."""

from collections.abc import Callable, Mapping
from copy import copy, deepcopy
from functools import lru_cache
from types import SimpleNamespace
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import Normalize
from matplotlib.figure import Figure

from feeler.analysis.dispersion import student_mean
from feeler.decoding import make_labels
from feeler.encoding import (
    ConvolutiveNMF,
    compute_basis_similarity,
    compute_entropies,
    compute_mass_entropy,
    compute_stability,
    locate_components,
    map_locations,
    match_components,
    reconstruct,
)
from feeler.encoding.inputs import check_choice
from feeler.plotting import plot_bases
from feeler.plotting.style import BASIS_COLOURS, mark_panels
from feeler.plotting.tensors import plot_tensor
from feeler.report import Section, make_spread
from feeler.tensors import in_unit, measure_peak, rectify
from paper.cache import keep
from paper.context import Context
from paper.data import list_profiles, load_tensors

# Fig. 4: what convolutive NMF makes of the tensors: residual, entropy, bases, activations,
# map of locations.


class CachedNMF(ConvolutiveNMF, auto_wrap_output_keys=None):  # type: ignore[call-arg]
    """The encoder; a fit of the same tensors with the same settings comes from the cache."""

    def fit(self, X: Any, y: Any = None, **beside: Any) -> "CachedNMF":
        """Learn the bases of tensors, or recall them."""
        settings = self.get_params()
        n_jobs = settings.pop("n_jobs")
        self.__dict__ |= keep("fit", _fit, settings, X, workers=n_jobs, **beside)
        return self


def _fit(settings: dict[str, Any], X: Any, workers: int, **beside: Any) -> dict[str, Any]:
    fitted = vars(ConvolutiveNMF(**settings, n_jobs=workers).fit(X, **beside))
    # copies: two names for one array would make another key than what is read from the cache
    return {
        name: deepcopy(value)
        for name, value in fitted.items()
        if name not in (*settings, "n_jobs")
    }


MAIN_RANK = 3  # [P]
_RESIDUAL, _ENTROPY = "#000000", "#777777"


def _as_rows(activations: np.ndarray) -> np.ndarray:
    """One row per component, over all trials."""
    return activations.transpose(1, 0, 2).reshape(activations.shape[1], -1)


ENTROPIES: dict[str, Callable[[np.ndarray], float]] = {
    "mean of rows": lambda found: float(np.nanmean(compute_entropies(_as_rows(found)))),
    "sum of rows": lambda found: float(np.nansum(compute_entropies(_as_rows(found)))),
    "mass of all rows": lambda found: compute_mass_entropy(_as_rows(found)),
    "mass per tensor": lambda found: float(np.nanmean(compute_entropies(found, "mass"))),
}
"""Readings of "entropy of the activations" (trial, component, time), bits: grey levels of each row
over all trials, their mean or sum; or activations as shares of mass, of all trials together or of
each tensor."""


@lru_cache(maxsize=1)
def compute(context: Context) -> SimpleNamespace:
    """Encode the tensors of the main antenna with each rank and measure what the paper shows; Fig.
    S5 takes its bases of 40 ms from here.

    Returns
    -------
    SimpleNamespace
        ``rows``. By rank (``ranks``), of the restarts that every rank finished: ``residual``
        ‖V − V̂‖/‖V‖, (rank, restart), best first; ``entropy`` of the activations [bits], by
        definition (``ENTROPIES``): (rank, restart); ``stability``, how alike their bases are up to
        shifts, (rank,). ``encoders`` by rank.
        ``starts``: the bases of every start (:func:`.compute_map`).
        ``examples``: fixed-basis sparse codes by example, "ball 0.5" …: (component, time).
        ``data``: what the fits were given (trial, sensor, time), as shares of ``peak`` [rad].
        ``sampling``: time between samples [ms]. ``effort``: what this scale asks of fits.
    """
    effort, sets = context.effort, [load_tensors(context, p) for p in list_profiles(context)]
    # as Fig. 5 compares speeds, so that one fit serves both: slowest first, on one scale
    tensors = sets[0].isel(trial=np.lexsort((make_labels(sets[0]), sets[0]["speed"].values)))
    ranks, done, peak = effort.ranks, effort.finished, measure_peak(*map(prepare, sets))
    data = prepare(tensors) / peak
    encoders = {
        m: effort.make_encoder(
            n_components=m,
            n_finished=None if m == MAIN_RANK else done,
            random_state=context.seed,
        ).fit(data)
        for m in ranks
    }
    main = encoders[MAIN_RANK if MAIN_RANK in encoders else ranks[0]]
    locations = np.asarray(tensors["location"].values)
    residual = np.stack([encoder.restarts_[:done] for encoder in encoders.values()])
    entropy = {
        definition: np.array(
            [
                [measure(found) for found in encoder.restart_activations_[:done]]
                for encoder in encoders.values()
            ]
        )
        for definition, measure in ENTROPIES.items()
    }
    starts = compute_map(main, data, locations)
    rows = {
        f"encoding.{name}.M{rank}": span(one)
        for name, by_rank in {
            "residual": residual,
            **{f"entropy.{definition}": found for definition, found in entropy.items()},
        }.items()
        for rank, one in zip(ranks, by_rank, strict=True)
    }
    if max(ranks) > MAIN_RANK:
        least, others = compare_ranks(encoders, MAIN_RANK, done)
        rows |= {"encoding.ranks": span(least), "encoding.ranks.others": span(others)}
    return SimpleNamespace(
        rows=rows | list_values(starts),
        ranks=tuple(ranks),
        residual=residual,
        entropy=entropy,
        stability=np.array(
            [compute_stability(list(e.restart_components_[:done])) for e in encoders.values()]
        ),
        encoders=encoders,
        data=data,
        peak=peak,
        examples=_pick_examples(tensors, peak * main.transform(data, code="sparse")),
        starts=starts,
        sampling=float(np.diff(in_unit(tensors["time"], "ms").values[:2])[0]),
        effort=effort,
    )


def prepare(tensors: Any, quantity: str = "angle") -> np.ndarray:
    """What is encoded: one quantity of a Dataset as (trial, sensor, time), negatives set to 0 [D:
    as in the video].
    """
    check_choice("quantity", quantity, ("angle", "curvature"))
    return rectify(tensors[quantity].transpose("trial", "sensor", "time").values)


def _pick_examples(tensors: Any, codes: np.ndarray) -> dict[str, np.ndarray]:
    """Codes of the slowest touches of the smaller ball and box, at every location."""
    feature, location = tensors["feature"].values.astype(str), tensors["location"].values
    speed, size = tensors["speed"].values, tensors["size"].values
    slow = speed == speed.min()
    picked = {}
    for name in ("ball", "box"):
        chosen = np.flatnonzero(slow & (feature == name))
        if chosen.size:
            chosen = chosen[size[chosen] == size[chosen].min()]
        for index in chosen[np.argsort(location[chosen], kind="stable")]:
            picked[f"{name} {location[index]:g}"] = codes[index]
    return picked


def _plot_ranks(data: SimpleNamespace, ax: Axes) -> None:
    """Fig. 4B: residual and activation entropy by the number of bases; bars span the restarts."""
    ranks = np.array(data.ranks)
    right = ax.twinx()
    right.spines["right"].set_visible(True)
    curves = (
        (ax, data.residual, _RESIDUAL, "o"),
        (right, data.entropy["mean of rows"], _ENTROPY, "s"),
    )
    for shift, (axis, values, colour, marker) in zip((-0.04, 0.04), curves, strict=True):
        middle = values[:, 0]
        ends = np.abs(np.stack([middle - values.min(axis=1), values.max(axis=1) - middle]))
        spread = ends if values.shape[1] > 1 else None  # one start has none
        axis.plot(ranks + shift, middle, color=colour)
        axis.errorbar(ranks + shift, middle, spread, color=colour, fmt=marker, ms=4, capsize=3)
    ax.set_xticks(ranks)
    ax.set_xlabel("number of bases M")
    ax.set_ylabel("relative residual (L2 norm)", color=_RESIDUAL)
    right.set_ylabel("activation entropy [bits]", color=_ENTROPY)


def _plot_examples(data: SimpleNamespace, axes: np.ndarray) -> None:
    """Fig. 4D: activations of ball and box at each location, on fixed bases, as shares of the
    greatest.
    """
    names = sorted({name.split()[0] for name in data.examples})
    top = max((code.max() for code in data.examples.values()), default=1)
    for column, name in zip(axes.T, names, strict=False):
        chosen = [key for key in data.examples if key.startswith(name)]
        for ax, key in zip(column, chosen, strict=False):
            code = data.examples[key]
            time = data.sampling * np.arange(code.shape[1])
            for m, row in enumerate(code):
                ax.plot(
                    time,
                    row / (top or 1),
                    color=BASIS_COLOURS[m % len(BASIS_COLOURS)],
                    label=f"basis {m + 1}",
                    lw=0.9,
                )
            ax.set_ylim(0, 1)
            ax.set_title(f"{name} at {key.split()[1]} L", pad=2)
        column[-1].set_xlabel("time [ms]")
    axes[len(axes) // 2, 0].set_ylabel("activation [of the greatest]")


def plot(data: SimpleNamespace, figure: Figure) -> None:
    """The whole figure: B top left, C below, D on the right; needs about 7.2 × 7 inches."""
    left, right = figure.subfigures(1, 2, width_ratios=(1.2, 1), squeeze=False).flat
    top, bottom = left.subfigures(2, 1, height_ratios=(1, 1.9), squeeze=False).flat
    _plot_ranks(data, above := top.subplots())
    sets = {
        f"M = {len(encoder.components_)}": encoder.components_
        for encoder in data.encoders.values()
    }
    plot_bases(sets, data.sampling, below := bottom.subplots())
    n_rows = (
        max((sum(k.startswith(n) for k in data.examples) for n in ("ball", "box")), default=1)
        or 1
    )
    axes = right.subplots(n_rows, 2, sharex=True, sharey=True, squeeze=False)
    _plot_examples(data, axes)
    right.legend(*axes[0, 0].get_legend_handles_labels(), loc="outside lower center", ncols=5)
    mark_panels((above, below, axes[0, 0]), "bcd")


def show(data: SimpleNamespace, section: Section) -> None:
    """Figs. 4B–D, and whether bases map to contact location."""
    effort = data.effort
    section.text(
        "Every tensor is approximated by a few bases (sensor × 40 ms) laid down where sparse"
        " activations say. Joint angles, negative values set to 0; one fit of all tensors, several"
        " random starts."
    )
    section.figure(
        "fig4_encoding",
        "Left: residual and activation entropy (mean of rows; the table has three other"
        " definitions) against the number of bases; bars span the best starts that were finished"
        " for every number, where there are several. Below: the bases of each fit, base to tip"
        " upwards, 40 ms across. Right: codes of ball and box on the fixed bases. (Fig. 4B–D)",
        lambda figure: plot(data, figure),
        height=7.0,
        numbers={
            name: getattr(data, name) for name in ("ranks", "residual", "entropy", "stability")
        },
    )
    section.table(
        ["entropy of the activations [bits]", *(f"M = {rank}" for rank in data.ranks)],
        [[name, *map(float, entropy[:, 0])] for name, entropy in data.entropy.items()],
        "The paper does not say which entropy rises with M. Rows: grey levels of each component's"
        " activations over all trials, their mean or their sum. Mass: activations as shares of"
        " their total, over everything or tensor by tensor.",
    )
    tabulate_bases(section, data.starts)
    section.text(
        f"Effort at this scale: {effort.restarts} random starts by rank and by profile"
        + (
            f" (of M ≠ {MAIN_RANK} the best {effort.finished} after a third of the iterations go"
            " on)"
            if effort.finished
            else ""
        )
        + f", {effort.side_restarts} by"
        f" duration, at most {effort.max_iter} iterations,"
        f" stopping when one gains less than {effort.tol:g}."
    )


def tabulate_bases(section: Section, found: SimpleNamespace) -> None:
    """A table of the bases of the best start, of :func:`compute_map`."""
    best = found.mappings[0]
    section.table(
        [
            "basis",
            "lag [samples]",
            "place",
            *(f"share at {place:g} L" for place in best.locations),
        ],
        [
            [k + 1, found.lag[0, k], found.place[0, k], *best.share[:, k]]
            for k in range(found.lag.shape[1])
        ],
        "Centre of mass of each basis over its lags and along the sensors (0: the first, 1: the"
        " last), and its share of the energy of the ridge codes of contacts at each place; best"
        " start.",
    )


# When and where each basis acts, and which contacts drive it, over every start of the fit.


def compute_map(
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
        map_locations(_encode_with(encoder, one, data), locations, place)
        for one, place in zip(bases, places, strict=True)
    ]
    along = bases.sum(axis=2)
    mass = along.sum(axis=2)
    share, lags = along / np.where(mass > 0, mass, np.nan)[..., None], np.arange(along.shape[2])
    lag = share @ lags
    span = np.sqrt(np.maximum(share @ lags**2 - lag**2, 0.0))
    return SimpleNamespace(
        lag=lag,
        span=span,
        place=places,
        mappings=mappings,
        margin=np.array([measure_margin(one.share) for one in mappings]),
    )


def _encode_with(encoder: ConvolutiveNMF, bases: np.ndarray, data: np.ndarray) -> np.ndarray:
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
    encoders: Mapping[int, ConvolutiveNMF], main: int, done: int | None = None
) -> tuple[np.ndarray, np.ndarray]:
    """How alike the bases stay when their number changes, and how alike different ones are.

    Returns
    -------
    least : np.ndarray
        Of each start that was finished (start,), ``done`` of them, the least cosine, over shifts,
        between a basis of the ``main`` number (its best start) and its match among those of a
        greater number.
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
        for start in range(len(known.restart_components_[:done]))
    ]
    return np.array(least), np.array([compare_others(one) for one in known.restart_components_])


def compare_others(bases: np.ndarray) -> float:
    """The greatest similarity of two different bases of one fit."""
    return float(compute_basis_similarity(bases, bases)[~np.eye(len(bases), dtype=bool)].max())


def list_values(found: SimpleNamespace) -> dict[str, Any]:
    """The values that claims are held against, of the bases of all starts (:func:`compute_map`)."""
    values: dict[str, Any] = {}
    for k, (lag, place) in enumerate(zip(found.lag.T, found.place.T, strict=True), 1):
        values |= {f"encoding.lag.{k}": _spread_starts(lag), f"encoding.place.{k}": span(place)}
    if found.span.shape[1] == 3:
        values["encoding.span.2"] = _spread_starts(found.span[:, 1])
        values["encoding.span.rival"] = _spread_starts(found.span[:, ::2].max(axis=1))
    p = np.array([one.p_information for one in found.mappings])
    return values | {
        "encoding.contact_margin": span(found.margin),
        "encoding.location_p": span(p),
    }


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


# Fig. 4A as a drawing: a touch of the run as its bases, laid down where its activations say.

_STEPS = (
    "activations  →  noise is added  →  principal components  →  classifier  →  object, place"
)


def compute_encoder(context: Context) -> SimpleNamespace:
    """One slow touch of the smaller ball that Fig. 4D shows: what is encoded (sensor, time), its
    code (component, time), the bases of this run, and what they give together (sensor, time).
    """
    data, tensors = compute(context), load_tensors(context, list_profiles(context)[0])
    name = next(key for key in data.examples if key.startswith("ball"))
    bases = data.encoders[
        MAIN_RANK if MAIN_RANK in data.encoders else data.ranks[0]
    ].components_
    feature, place = name.split()
    chosen = np.flatnonzero(
        (tensors["feature"].values == feature)
        & np.isclose(tensors["location"].values, float(place))
        & np.isclose(tensors["speed"].values, tensors["speed"].values.min())
    )
    number = int(chosen[tensors["size"].values[chosen].argmin()])
    code = data.examples[name]
    return SimpleNamespace(
        rows={},
        name=name,
        touch=prepare(tensors.isel(trial=[number]))[0],
        code=code,
        bases=bases,
        sum=reconstruct(bases, code[None])[0],
        sampling=data.sampling,
    )


def plot_encoder(shown: SimpleNamespace, figure: Figure) -> None:
    """The touch, what the code keeps of it, and a row for each basis with its activation."""
    touch, rows = np.rad2deg(shown.touch), len(shown.bases)
    time, norm = shown.sampling * np.arange(touch.shape[1]), Normalize(0, float(touch.max()))
    widths = (1.5, 0.1, 1.5, 0.2, 0.6, 0.1, 1.7)
    grid = figure.add_gridspec(rows, len(widths), width_ratios=widths)
    wholes = [figure.add_subplot(grid[:, column]) for column in (0, 2)]
    pictures = {"a touch": touch, "what its code keeps": np.rad2deg(shown.sum)}
    for ax, (title, values) in zip(wholes, pictures.items(), strict=True):
        image = plot_tensor(values, time, ax, norm, unit="°")
        ax.set_title(title)
    wholes[1].set_ylabel("")
    mark_panels(wholes[0])
    figure.colorbar(image, ax=wholes, label="angle [°]", location="left", pad=0.02)
    for m, colour in zip(range(rows), BASIS_COLOURS, strict=False):
        axes = [figure.add_subplot(grid[m, column]) for column in (4, 6)]
        # One basis on its own scale, and its activation
        basis, code = shown.bases[m], shown.code[m]
        lag = (time[1] - time[0]) * np.arange(basis.shape[1])
        scale = Normalize(0, float(basis.max()) or 1.0)
        plot_tensor(basis, lag, axes[0], scale, labels=False, unit="of its greatest")
        axes[0].set(yticks=[], xlabel="lag [ms]")
        axes[0].set_title(f"basis {m + 1}", color=colour, pad=2)
        axes[1].plot(time, code / (shown.code.max() or 1), color=colour)
        axes[1].set(ylim=(0, 1.05), xlim=(time[0], time[-1]), yticks=[0, 1], xlabel="time [ms]")
        axes[1].set_title(f"basis {m + 1}: activation", color=colour, pad=2)
        for ax in axes if m < rows - 1 else ():
            ax.set_xticklabels([])
            ax.set_xlabel("")
    for column, sign in ((1, "≈"), (3, "=  Σ"), (5, "∗")):
        ax = figure.add_subplot(grid[:, column])
        ax.text(0.5, 0.5, sign, ha="center", va="center", fontsize=12)
        ax.axis("off")
    figure.supxlabel(_STEPS, fontsize=8)


def show_encoder(shown: SimpleNamespace, section: Section) -> None:
    """The touch on the bases."""
    section.figure(
        "fig4a_encoder",
        f"What the encoder does with one slow touch ({shown.name.replace(' ', ' at ')} L, angles"
        " without their negative values). Each basis (its own colour scale) is laid down wherever"
        " its activation is not 0, as strong as this is (∗ is convolution; activations as shares of"
        " the greatest of all); the sum (Σ) is what the code keeps of the touch. Last line: what is"
        " done with the activations. (Fig. 4A)",
        lambda figure: plot_encoder(shown, figure),
        height=3.6,
        numbers={"touch": shown.touch, "code": shown.code, "sum": shown.sum},
    )
