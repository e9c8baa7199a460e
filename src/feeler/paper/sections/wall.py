"""Wall distance from the point of greatest curvature."""

import numpy as np

from feeler.errors import InvalidInput
from feeler.paper import fig3, movie_s3
from feeler.paper.context import Context
from feeler.paper.data import list_profiles
from feeler.paper.fig3_shapes import Shapes, plot_shapes
from feeler.report.section import Section
from feeler.wall.distance_map import DistanceMap
from feeler.wall.following import follow
from feeler.wall.sensitivity import CHOICES, count_orderings


def make(context: Context, section: Section) -> None:
    """Fig. 3A–D, Movie S3, the sensitivity of R², and a body that follows a wall by it."""
    antennas = {name: context.profiles[name] for name in list_profiles(context)}
    data = fig3.compute(antennas, scale=context.scale, engine=context.engine)
    section.text(
        "A wall pushes a pre-bent antenna into an inverted J. How the pre-bend comes about, which angle is meant and how much "
        "the wall rubs are not stated in the paper; the default was fixed with its reason (see the guide) before any R² was "
        "looked at, and the table below says what depends on it."
    )
    section.figure(
        "fig3_wall",
        "A: equilibrium at every distance of a wall (green) that comes nearer, base at the lower left, body looking up. "
        "Black: an inverted J in contact; red: in contact without one; grey: no contact; dots: greatest bend. B: distance "
        "against its position, with straight lines; open marks are not fitted. C, D: tactile tensors of a wall that slides "
        "past at four distances and of one that comes nearer. (Fig. 3A–D)",
        lambda figure: fig3.plot(data, figure),
        height=7.4,
    )
    section.numbers(
        "fig3_wall",
        distance={name: found.distance for name, found in data.maps.items()},
        position={name: found.position for name, found in data.maps.items()},
        r2={name: found.r2 for name, found in data.maps.items()},
        shapes={name: sweep.points for name, sweep in data.sweeps.items()},
    )
    if data.far_slides:
        _show_slides(section, data)
    _list_maps(section, data)
    _list_cases(section, data)
    frames = context.pick(smoke=8, quick=24, paper=movie_s3.FRAMES)
    section.movie(
        movie_s3.write(data.drives, section.folder / "movieS3_wall.mp4", frames),
        "A wall comes nearer, every profile. (Movie S3)",
    )
    if context.scale != "smoke":
        _follow(context, section)


def _show_slides(section: Section, data: fig3.Fig3Data) -> None:
    shapes = {name: Shapes.of_slides(touch) for name, touch in data.far_slides.items()}
    section.figure(
        "fig3_slides",
        "Where a wall that slid past backward at 0.3 m/s for 200 ms has left every antenna, at every distance; colours as in A.",
        lambda figure: plot_shapes(shapes, figure.subplots()),
        height=3.2,
    )
    section.numbers("fig3_slides", **{name: {"wall": s.wall, "points": s.points} for name, s in shapes.items()})
    words = [f"{name} {s.inverted.sum()} of {s.contact.sum()}" for name, s in shapes.items()]
    section.text(f"The inverted J still stands after sliding, of the distances in contact: {', '.join(words)}.")


def _list_maps(section: Section, data: fig3.Fig3Data) -> None:
    for name, found in data.maps.items():
        spread = [case.map.r2 for case in data.cases if case.antenna == name and np.isfinite(case.map.r2)]
        if np.isfinite(found.r2):
            low, high = (min(spread), max(spread)) if spread else (None, None)
            section.values[f"wall.r2.{name}"] = {"value": found.r2, "low": low, "high": high}
        else:
            section.values[f"wall.r2.{name}"] = {"undefined": f"{name}: {found.undefined}"}
    rows = [_row(name, found) for name, found in data.maps.items()]
    rows += [_row(f"{name}, not pre-bent", found) for name, found in data.straight.items()]
    section.table(
        [
            "profile",
            "R²",
            "slope",
            "intercept [mm]",
            "error [mm]",
            "monotone",
            "told apart [mm]",
            "distances used",
            "peak at base",
        ],
        rows,
        "Default posture, then without pre-bend. Error: predicted distance, each distance left out of its own fit. Monotone: "
        "the peak moves one way over all distances used. Told apart: the longest run of distances over which the peak moves on "
        "by more than a segment per step.",
    )
    first = next(iter(data.maps.values()))
    positions = first.position[first.used]
    resolution = 1e-3  # mm: two walls this close in peak position give the same answer
    unique = np.unique(np.round(positions / resolution)).size / max(positions.size, 1)
    section.values["wall.unique_share"] = float(unique) if positions.size else None


def _row(name: str, found: DistanceMap) -> list[object]:
    apart = "none" if np.isnan(found.told_apart[0]) else f"{found.told_apart[0]:.3g}–{found.told_apart[1]:.3g}"
    counts = int(found.used.sum()), int(found.at_base.sum())
    monotone = ("yes" if found.monotone else "no") if found.used.sum() > 1 else "nothing to judge"
    return [name, found.r2, found.slope, found.intercept, found.error, monotone, apart, *counts]


def _list_cases(section: Section, data: fig3.Fig3Data) -> None:
    if not data.cases:
        return
    section.heading("What R² depends on")
    counts = count_orderings(data.cases)
    section.text(_count_orders(counts))
    section.text(
        "Below paper scale each set-up changes one choice of the default. The hook over the whole length is among them because "
        "the paper's order had been seen to hold there; the full table of paper scale has every combination."
    )
    section.table(
        ["choice", "value", "order holds", "does not", "cannot be judged"],
        [[*key, n["yes"], n["no"], n["undefined"]] for key, n in counts.items() if key[0] != "all"],
        "Set-ups by the value of each choice that the paper does not state.",
    )
    names = list(dict.fromkeys(case.antenna for case in data.cases))
    found: dict[tuple, dict[str, float]] = {}
    for case in data.cases:
        found.setdefault(case.choice, {})[case.antenna] = case.map.r2
    section.table(
        [*CHOICES, *(f"R² {name}" for name in names)],
        [[*choice, *(r2[name] for name in names)] for choice, r2 in found.items()],
        "R² of every set-up. Undefined: the peak stays at one place, mostly the base hinge, or too few distances hold a J.",
    )
    section.numbers("fig3_sensitivity", rows=fig3.tabulate(data.cases))


def _count_orders(counts: dict[tuple, dict[str, int]]) -> str:
    """In how many set-ups the paper's order of R² holds."""
    every = counts["all", ""]
    judged = every["yes"] + every["no"]
    return (
        f"The paper's order is R² falling from exponential over linear to constant. Of {judged + every['undefined']} set-ups, "
        f"R² is defined for all three in {judged}; the order holds in {every['yes']} of these. Each choice and how often:"
    )


def _follow(context: Context, section: Section) -> None:
    rows = []
    for name, antenna in context.profiles.items():
        try:
            run = follow(antenna)
        except InvalidInput:  # its peak stays at the base hinge: that is the result
            rows.append([name, *["no map to steer by"] * 4])
            continue
        rows.append([name, run.error, run.estimate_error, run.nearest, "yes" if run.collided else "no"])
    section.heading("Following a wall by it")
    section.table(
        ["profile", "tracking error [mm]", "estimate error [mm]", "nearest [mm]", "collided"],
        rows,
        "A point body at 0.45 m/s along a wall with turns, steering by the estimated distance.",
    )
