"""Fig. 3: wall distance, in the leading set-up and in a family of set-ups."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from types import SimpleNamespace
from typing import Any

import numpy as np
from matplotlib.colors import Normalize
from matplotlib.figure import Figure, SubFigure

from feeler.antenna.segments import Antenna
from feeler.plotting.results import list_shapes, plot_approach, plot_maps
from feeler.plotting.style import mark_panels
from feeler.plotting.tensors import plot_tensor
from feeler.plotting.walls import (
    APPROACH_SLOWER,
    SHOWN,
    write_drives_movie,
)
from feeler.report import Section, make_spread
from feeler.wall import (
    DISTANCES,
    Approach,
    Case,
    DistanceMap,
    Posture,
    WallTouch,
    approach,
    compare,
    count_orderings,
    drive,
    make_postures,
    map_distance,
    range_r2,
    slide,
)
from feeler.wall.distance import SETUP_CHOICES
from paper.cache import keep
from paper.context import Context
from paper.data import CLAIMED, list_profiles
from paper.readings import load_sentences
from paper.table import read_declared

# Fig. 3A–D: a wall approaches and slides past; where the antenna bends most, and how well
# that tells the distance.

LEADING, DEFAULT = "leading set-up", "default set-up"
SLIDE_DISTANCES = (20.0, 15.0, 10.0, 6.0)  # [C] mm
APART = 0.1  # [C] of a tensor's own root mean square: what discriminates two sliding tensors


def get_lead() -> Posture:
    """The posture with which the figure and the movie lead: declared.toml says by which
    rule it was found.
    """
    return Posture(**read_declared("declared.toml")["wall_family"]["lead"])


def get_main() -> tuple[Posture, dict[str, Any]]:
    """The posture and the measure that are nearest to the paper's words, from readings.toml."""
    first = next(one for one in load_sentences() if one.id == "wall-order").main
    quantity, method = first["measure"].split()
    posture = Posture(
        inter_antennal_angle=float(first["angle"]),
        friction=float(first["friction"]),
        hook_share=float(first["hook"]),
        tip_heading=float(first["tip"]),
    )
    return posture, {"quantity": quantity, "method": method}


@lru_cache(maxsize=1)
def compute(context: Context) -> SimpleNamespace:
    """Everything of Fig. 3 for the profiles of this scale, the first of which is shown in C and D.

    Returns
    -------
    SimpleNamespace
        ``rows``. ``family``: R² over the family of set-ups (:class:`Family`), or None. By profile:
        ``main_sweeps``, the quasi-static approach in the configuration nearest to the
        paper's words, ``main_maps`` from position to distance, and ``main_r2``, the ends of their
        R² where the wall comes in other steps; ``sweeps`` and ``maps``, the
        same in the leading set-up; ``default_sweeps`` and ``default_maps``, in the default one;
        ``drives``, a wall that comes nearer
        without stopping; ``far_slides``, a wall past the first profiles at every distance.
        ``slides``: a wall past the first profile at a few constant distances. ``fps`` of movies.
    """
    antennas = {name: context.profiles[name] for name in list_profiles(context)}
    first, lead, (main, measure) = next(iter(antennas.values())), get_lead(), get_main()
    effort, options = context.effort, {"engine": context.engine, "timestep": None}
    mains, sweeps, default = (
        {
            name: keep("wall", approach, antenna, posture, DISTANCES)
            for name, antenna in antennas.items()
        }
        for posture in (main, lead, Posture())
    )
    # before the first slide: it needs none of the engine that another process compiles meanwhile
    family = None
    if {*CLAIMED} & {*antennas}:  # or there is nothing of the paper's to be held against
        family = sweep_family(
            antennas, part=effort.wall_part, known=[*sweeps.items(), *default.items()]
        )
    slides = keep("wall", slide, first, lead, SLIDE_DISTANCES, **options)
    drives = {
        name: keep("wall", drive, antennas[name], lead, **options)
        for name in list(antennas)[: effort.drives]
    }
    far_slides = {
        name: keep("wall", slide, antennas[name], lead, DISTANCES, **options)
        for name in list(antennas)[: effort.far_slides]
    }
    main_r2 = {
        name: keep("wall", range_r2, antenna, main, DISTANCES, **measure)
        for name, antenna in antennas.items()
    }
    rows = {}
    if far_slides:
        plain = keep("wall", slide, first, Posture(), DISTANCES, **options)
        rows = {
            f"wall.{name}.unique_share{part}": _compute_unique_share(touched, apart)
            for name, touched in ((LEADING, next(iter(far_slides.values()))), (DEFAULT, plain))
            for part, apart in (("", APART), (".twentieth", APART / 2))
        }
    return SimpleNamespace(
        rows=rows,
        family=family,
        main_sweeps=mains,
        main_r2=main_r2,
        main_maps={name: map_distance(sweep, **measure) for name, sweep in mains.items()},
        sweeps=sweeps,
        maps={name: map_distance(sweep) for name, sweep in sweeps.items()},
        default_sweeps=default,
        default_maps={name: map_distance(sweep) for name, sweep in default.items()},
        slides=slides,
        drives=drives,
        far_slides=far_slides,
        fps=effort.fps,
    )


def plot(data: SimpleNamespace, figure: Figure | SubFigure) -> None:
    """Draw the four panels."""
    top, middle, bottom = figure.subfigures(
        3, 1, height_ratios=(1.05, 1.1, 0.9), squeeze=False
    ).flat
    shown = {name: list_shapes(sweep) for name, sweep in data.main_sweeps.items()}
    above = top.subplots(1, len(shown), sharey=True, squeeze=False)[0]
    plot_approach(shown, above)
    below = middle.subplots()
    plot_maps(data.main_maps, below)
    columns = bottom.subplots(1, 2)
    _plot_tensors(data, bottom, columns)
    mark_panels((above[0], below, *columns))


def describe_posture(posture: Posture) -> str:
    """What the declared family of set-ups discriminates."""
    return (
        f"hook {posture.hook_share:g} of the length, tip {posture.tip_heading:g}°,"
        f" base {posture.inter_antennal_angle:g}°, friction {posture.friction:g}"
    )


def _plot_tensors(data: SimpleNamespace, figure: Figure | SubFigure, axes: Sequence) -> None:
    """Bending curvature over time: sliding at some distances, side by side (C), and approaching
    (D).
    """
    slides, driven = data.slides.make_dataset(), next(iter(data.drives.values())).make_dataset()
    curves = np.abs(slides["curvature"].values[: len(SLIDE_DISTANCES)])
    n_times = curves.shape[2]
    gap = np.full((curves.shape[1], n_times // 20), np.nan)
    row = np.concatenate([part for curve in curves for part in (curve, gap)], axis=1)[
        :, : -gap.shape[1]
    ]
    norm = Normalize(0, float(np.nanmax(curves)))
    plot_tensor(row, np.arange(row.shape[1]), axes[0], norm, labels=False)
    centres = (np.arange(len(curves)) * (n_times + gap.shape[1])) + n_times / 2
    axes[0].set(
        xticks=centres,
        xticklabels=[f"{d:g} mm" for d in slides["distance"].values[: len(curves)]],
    )
    axes[0].set(
        title=f"sliding past, {n_times} ms each",
        ylabel="sensor (base → tip)",
        xlabel="wall distance; time runs to the right",
    )
    image = plot_tensor(
        np.abs(driven["curvature"].values[0]),
        driven["time"].values,
        axes[1],
        norm,
        labels=False,
    )
    axes[1].set(title="wall approaching", xlabel="time [ms]")
    figure.colorbar(image, ax=axes, label="|curvature beyond rest| [1/mm]", pad=0.01)


def show(data: SimpleNamespace, section: Section) -> None:
    """Fig. 3A–D, R² of every profile, and the movies."""
    section.text(
        "A wall pushes a pre-bent antenna into an inverted J. How the pre-bend comes about, which"
        " angle is meant and how much the wall rubs are not stated in the paper. Panels a and b"
        " show the configuration nearest to its words; c, d and what slides show the first of a"
        f" family declared beforehand ({describe_posture(get_lead())}) in which all three profiles"
        " have a map, at rest and while the body runs, whatever their R². In the default of this"
        f" software ({describe_posture(Posture())}) the peak of some profiles stays at one place"
        " and gives no map. Every R² is one of many: readings of the whole family decide. With"
        " friction an antenna rests where it sticks, which depends on how the wall came: in steps"
        " of 0.1 to 1 mm, R² of the configuration nearest to the words is "
        + ", ".join(f"{low:.2f} to {high:.2f} ({k})" for k, (low, high) in data.main_r2.items())
        + "."
    )
    section.figure(
        "fig3_wall",
        "a: equilibria beside a wall that comes nearer, in the configuration nearest to the paper's"
        f" words ({describe_posture(get_main()[0])}), coloured by its distance; dots: greatest"
        " curvature. b: distance against its position, with straight lines; open marks are not"
        " fitted (one deterministic sweep each, no interval). c, d: tactile tensors of a wall that"
        " slides past at four distances and of one that comes nearer"
        f" ({describe_posture(get_lead())}), magnitude of the curvature. (Fig. 3A–D)",
        lambda figure: plot(data, figure),
        height=6.4,
        numbers={
            **{
                part: {name: getattr(found, part) for name, found in data.main_maps.items()}
                for part in ("distance", "position", "r2")
            },
            "default_r2": {name: found.r2 for name, found in data.default_maps.items()},
            "shapes": {name: sweep.points for name, sweep in data.main_sweeps.items()},
        },
    )
    if data.far_slides:
        words = [
            f"{name} {touch.inverted[:, -1].sum()} of {touch.contact[:, -1].sum()}"
            for name, touch in data.far_slides.items()
        ]
        section.text(
            "The inverted J still stands after sliding, of the distances in contact:"
            f" {', '.join(words)}."
        )
    rows = [_row(f"{name}, nearest to the words", m) for name, m in data.main_maps.items()]
    rows += [_row(f"{name}, {LEADING}", found) for name, found in data.maps.items()]
    rows += [_row(f"{name}, {DEFAULT}", found) for name, found in data.default_maps.items()]
    section.table(
        [
            "profile",
            "R²",
            "slope",
            "intercept [mm]",
            "error [mm]",
            "monotone",
            "discriminated [mm]",
            "distances used",
            "peak at base",
        ],
        rows,
        "Configuration nearest to the words, leading set-up, default set-up, then the default"
        " without pre-bend. Error: predicted distance, each distance left out of its own fit."
        " Monotone: the peak moves one way over all distances used. Discriminated: the longest run"
        " of distances over which the peak moves on by more than a segment per step.",
    )
    section.movie(
        write_drives_movie(data.drives, section.folder / "movieS3_wall.mp4", data.fps),
        f"A wall (grey) comes nearer to each antenna, {APPROACH_SLOWER:g} times slower than life;"
        f" colours: curvature beyond rest, on one scale, which {100 * (1 - SHOWN):.0f} % of bends"
        " exceed; red: the point of greatest bend while in contact. (Movie S3)",
    )


def _compute_unique_share(touch: WallTouch, apart: float = APART) -> float | None:
    """Share of the distances in contact whose sliding tensor differs from every other's by more
    than ``apart`` of itself, and is most like that of a neighbouring distance: tensors of noise
    differ, too.
    """
    data = touch.make_dataset()
    met = touch.contact.any(axis=1)
    tensors = data["curvature"].values[met].reshape(int(met.sum()), -1)
    if len(tensors) < 2:
        return None
    far = np.linalg.norm(tensors[:, None] - tensors[None], axis=2) + np.diag(
        np.full(len(tensors), np.inf)
    )
    own = far.min(axis=1) > apart * np.linalg.norm(tensors, axis=1)
    beside = np.abs(far.argmin(axis=1) - np.arange(len(tensors))) == 1
    return float(np.mean(own & beside))


def _row(name: str, found: DistanceMap) -> list[object]:
    apart = (
        "none"
        if np.isnan(found.told_apart[0])
        else f"{found.told_apart[0]:.3g}–{found.told_apart[1]:.3g}"
    )
    counts = int(found.used.sum()), int(found.at_base.sum())
    monotone = (
        ("yes" if found.monotone else "no") if found.used.sum() > 1 else "nothing to judge"
    )
    return [name, found.r2, found.slope, found.intercept, found.error, monotone, apart, *counts]


# Movie S3: a wall comes nearer, each antenna's point of greatest curvature marked.


# Beside Fig. 3B: R² over the family of set-ups of declared.toml, by which the wall claims are
# judged.

_LEAST_DEFINED = 1 / 3
"""Share of the family in which R² must be defined for every profile, or nothing is judged."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Family:
    """R² of every profile in every set-up of the declared family.

    Attributes
    ----------
    names : tuple[str, ...]
        Profiles compared, in the order claimed.
    choices : tuple[tuple, ...]
        What tells a set-up from others, by ``feeler.wall.distance.SETUP_CHOICES``.
    r2 : np.ndarray
        (set-up, profile), NaN where it is undefined.
    offset : np.ndarray
        Median distance between greatest curvature and contact (set-up, profile), as a share of the
        length; NaN where the antenna stands at fewer than three distances.
    """

    names: tuple[str, ...]
    choices: tuple[tuple, ...]
    r2: np.ndarray
    offset: np.ndarray
    cases: tuple[Case, ...]

    @property
    def is_defined(self) -> np.ndarray:
        """Where R² is defined for every profile (set-up,)."""
        return np.isfinite(self.r2).all(axis=1)

    @property
    def defined(self) -> np.ndarray:
        """R² where it is defined for every profile (set-up, profile)."""
        return self.r2[self.is_defined]

    @property
    def in_order(self) -> np.ndarray:
        """Where R² falls from profile to profile as the paper claims (set-up,)."""
        return self.is_defined & np.all(np.diff(self.r2, axis=1) < 0, axis=1)

    def select(self, asked: Mapping[str, Sequence]) -> np.ndarray:
        """Which set-ups have one of the asked values of each choice (set-up,)."""
        place = {name: SETUP_CHOICES.index(name) for name in asked}
        return np.array(
            [
                all(choice[place[name]] in values for name, values in asked.items())
                for choice in self.choices
            ],
            dtype=bool,
        )

    def deviate(self, targets: Mapping[str, float]) -> np.ndarray:
        """How far 1 − R² is from that of the targets (set-up, profile), as a factor ≥ 1: near 1 a
        distance of R² itself lets all pass.
        """
        wanted = np.array([targets[name] for name in self.names])
        with np.errstate(divide="ignore"):
            return np.exp(np.abs(np.log((1 - self.r2) / (1 - wanted))))

    def share(self, holds: np.ndarray) -> dict[str, Any]:
        """Share of the defined set-ups in which something holds (set-up,); undefined where too few
        are defined.
        """
        if len(self.defined) < _LEAST_DEFINED * len(self.r2) or not len(self.defined):
            return {
                "undefined": (
                    f"R² is defined for every profile in {len(self.defined)} of {len(self.r2)}"
                    " set-ups only"
                )
            }
        return {"value": float(np.mean(holds)), "n": len(self.defined)}


def list_setups(part: str = "") -> tuple[list[Posture], list[dict[str, str]]]:
    """Postures and measures of the declared family, or of the part that a smaller scale runs."""
    family = dict(read_declared("declared.toml")["wall_family"])
    parts, measures, _ = (family.pop(name) for name in ("part", "measure", "lead"))
    axes = family | (parts[part] if part else {})
    return (
        make_postures(*([{name: value} for value in values] for name, values in axes.items())),
        measures,
    )


def sweep_family(
    antennas: Mapping[str, Antenna],
    *,
    part: str = "",
    known: Sequence[tuple[str, Approach]] = (),
    workers: int | None = None,
) -> Family:
    """Sweep every profile that the paper names through the family; ``known`` sweeps are not done
    again.
    """
    chosen = {name: antennas[name] for name in CLAIMED if name in antennas}
    postures, measures = list_setups(part)
    options = {"measures": measures, "workers": workers, "known": known}
    cases = keep("wall", compare, chosen, postures, **options)
    found: dict[tuple, dict[str, tuple[float, float]]] = {}
    for case in cases:
        r2 = np.nan if case.map.undefined else case.map.r2
        offset = case.offset / chosen[case.antenna].length
        found.setdefault(case.choice, {})[case.antenna] = (r2, offset)
    numbers = np.array([[by_name[name] for name in chosen] for by_name in found.values()])
    return Family(
        names=tuple(chosen),
        choices=tuple(found),
        r2=numbers[..., 0],
        offset=numbers[..., 1],
        cases=tuple(cases),
    )


def compute_family(context: Context) -> SimpleNamespace | None:
    """The ``family`` of set-ups, the paper's R² as ``targets``, and as ``rows`` the values that the
    wall claims are judged by.
    """
    family = compute(context).family
    if family is None or len(family.names) < 2:
        return None
    said = read_declared("declared.toml")["wall_paper"]
    targets = {name: said[name] for name in CLAIMED}
    return SimpleNamespace(
        rows=_list_values(family, targets) | _list_readings(family),
        family=family,
        targets=targets,
    )


def show_family(data: SimpleNamespace, section: Section) -> None:
    """Every set-up, and in how many the paper's order holds."""
    family = data.family
    section.heading("What R² depends on")
    section.text(
        "The paper does not state the posture of the J, the wall's friction, which angle is meant,"
        " or how the point of greatest curvature was found. So its sentences are judged over a"
        f" family of {len(family.r2)} set-ups declared beforehand (declared.toml). R² is defined"
        f" for every profile in {len(family.defined)} of them; the others cannot be the paper's."
    )
    section.numbers(
        "fig3_family",
        names=family.names,
        choices=family.choices,
        r2=family.r2,
        offset=family.offset,
        targets=data.targets,
    )
    _tabulate_readings(section, family)
    counts = count_orderings(family.cases, family.names)
    section.table(
        ["choice", "value", "order holds", "does not", "cannot be judged"],
        [
            [*key, n["yes"], n["no"], n["undefined"]]
            for key, n in counts.items()
            if key[0] != "all"
        ],
        "Set-ups by the value of each choice that the paper does not state.",
    )
    section.table(
        [*SETUP_CHOICES, *(f"R² {name}" for name in family.names)],
        [
            [*choice, *map(float, r2)]
            for choice, r2 in zip(family.choices, family.r2, strict=True)
        ],
        "R² of every set-up. Undefined: the peak stays at one place, mostly the base hinge, or too"
        " few distances hold a J.",
    )


def _list_values(family: Family, targets: Mapping[str, float]) -> dict[str, object]:
    """How many set-ups have every R², in which share of these the order holds, and the R² of the
    one nearest to all of the paper's values.
    """
    values: dict[str, object] = {
        "wall.defined": len(family.defined),
        "wall.set_ups": len(family.r2),
        "wall.family.order": family.share(family.in_order[family.is_defined]),
    }
    for name, r2 in zip(family.names, family.defined.T, strict=True):
        if r2.size:
            ends = np.median(r2), r2.min(), r2.max()
            values[f"wall.median.{name}"] = make_spread(*ends, n=len(r2))
            nearest = family.deviate(targets)[family.is_defined].max(axis=1).argmin()
            values[f"wall.nearest.{name}"] = float(r2[nearest])
    return values


def list_readings() -> list[dict[str, Any]]:
    """Readings of the choices that decide most; together they are the whole family."""
    return read_declared("declared.toml")["wall_reading"]


def _list_readings(family: Family) -> dict[str, object]:
    """Share of the set-ups of each reading, of those with every R², in which the order holds."""
    values: dict[str, object] = {}
    for reading in list_readings():
        own = family.select(reading["choices"])
        if n := int((own & family.is_defined).sum()):
            holds = int((own & family.in_order).sum())
            values[f"wall.order.{reading['name']}"] = {"value": holds / n, "n": n}
    return values


def _tabulate_readings(section: Section, family: Family) -> None:
    rows = []
    for reading in list_readings():
        own = family.select(reading["choices"])
        r2 = family.r2[own & family.is_defined]
        median = np.median(r2, axis=0) if len(r2) else np.full(len(family.names), np.nan)
        if own.any():
            holds = int((own & family.in_order).sum())
            rows.append([reading["words"], holds, len(r2), int(own.sum()), *map(float, median)])
    section.table(
        [
            *(
                "reading of the paper",
                "order holds",
                "of those with every R²",
                "configurations",
            ),
            *(f"median R² {name}" for name in family.names),
        ],
        rows,
        "The order of profiles by reading. The readings were formed after the family had been run,"
        " of the choices that decide most; together they are the whole family.",
    )
