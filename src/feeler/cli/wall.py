"""``feeler wall``: the distance of a wall from where an antenna bends most.

Examples:

  feeler wall exponential linear uniform --out out/wall

  feeler wall own.toml --prebend none --friction 0                  a straight antenna

  feeler wall exponential --reading total --friction 0 --prebend none --near 5 --far 16
"""

from collections.abc import Iterator
from functools import partial
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer

from feeler.cli.options import Json, as_sentence, say, try_movie
from feeler.errors import InvalidInput
from feeler.files import write_text


def wall(
    antennas: Annotated[
        list[str] | None, typer.Argument(help="presets or antenna files (TOML)")
    ] = None,
    angle: Annotated[float, typer.Option(help="inter-antennal angle [degrees]")] = 35.0,
    reading: Annotated[
        str, typer.Option(help="angle from the midline, or total between both antennae")
    ] = "midline",
    prebend: Annotated[
        str,
        typer.Option(
            help="how the J comes about: rest (its slack shape), placed, rotation or none"
        ),
    ] = "rest",
    hook: Annotated[
        float, typer.Option(help="share of the length that the J takes, with --prebend rest")
    ] = 1.0,
    tip: Annotated[
        float, typer.Option(help="heading of the J's tip [degrees]; 180 is straight backward")
    ] = 150.0,
    friction: Annotated[float, typer.Option(help="coefficient of friction")] = 0.3,
    near: Annotated[
        float | None,
        typer.Option(help="nearest distance [mm]; default 5 for an antenna of 42 mm"),
    ] = None,
    far: Annotated[
        float | None, typer.Option(help="farthest distance [mm]; default 25 likewise")
    ] = None,
    steps: Annotated[int, typer.Option(help="number of distances", min=1)] = 20,
    out: Annotated[
        Path | None,
        typer.Option(
            help="folder for page (HTML), figures, movie, table (CSV) and numbers (JSON)"
        ),
    ] = None,
    movie: Annotated[bool, typer.Option(help="with --out: write the movie as well")] = True,
    as_json: Json = False,
) -> None:
    """Map wall distance from antenna curvature.

    Let a wall approach each antenna, and fit the wall's distance to the place of greatest
    curvature.
    """
    from feeler.cli.choose import choose_planar, name_antennas
    from feeler.wall import Posture, approach, map_distance, range_r2
    from feeler.wall.following import measure_scale

    if near is not None and far is not None and not near <= far:
        raise InvalidInput(f"--near must not exceed --far, got {near:g} and {far:g} mm.")
    said: dict[str, Any] = {"reading": reading, "prebend": prebend, "tip_heading": tip}
    posture = Posture(inter_antennal_angle=angle, friction=friction, hook_share=hook, **said)
    sweeps = {}
    chosen = name_antennas(
        antennas or ["exponential", "linear", "uniform", "matched"], choose_planar
    )
    for name, antenna in chosen.items():
        last = measure_scale(antenna) * _FAR if far is None else far
        first = min(measure_scale(antenna) * _NEAR, last) if near is None else near
        if first > last:
            raise InvalidInput(
                f"--near {first:g} mm exceeds the {last:g} mm from which {name} is tried; give"
                " --far too."
            )
        sweeps[name] = approach(
            antenna, posture, np.linspace(last, first, steps) if steps > 1 else [first]
        )
    maps = {name: map_distance(sweep) for name, sweep in sweeps.items()}
    words = _describe_posture(posture)
    plain = {name: _make_plain(sweeps[name], found) for name, found in maps.items()}
    plain["posture"] = posture.to_plain()
    if friction:
        shown = []
        for name in (name for name, found in maps.items() if not found.undefined):
            low, high = range_r2(chosen[name], posture, sweeps[name].distance)
            plain[name]["r2_range"] = low, high
            shown.append(f"{low:.2f} to {high:.2f} ({name})")
        if shown:
            words += (
                "\n  with friction R² depends on the steps in which the wall comes; in steps of 0.1"
                f" to 1 mm: {', '.join(shown)}"
            )
    say(as_json, plain, [*_describe(sweeps, maps), words])
    if out is not None:
        _save(out, sweeps, maps, words, movie)


def _describe_posture(posture: Any) -> str:
    """The configuration, which changes the numbers, and whence it is."""
    from feeler.wall import NEAREST

    shape = {
        "rest": f"a J over {posture.hook_share:.0%} of the length, tip at {posture.tip_heading:g}°",
        "none": "a straight antenna",
    }.get(posture.prebend, f"a J that is {posture.prebend}")
    words = (
        f"posture: {shape}, base {np.degrees(posture.base_angle):g}° from the midline, friction"
        f" {posture.friction:g}"
    )
    if posture == NEAREST:
        words += (
            "\n  the paper states none of these; of 324 configurations that were declared"
            " beforehand this is the nearest to its R² of 0.985, 0.924 and 0.704, and others give"
            " another order (docs/guide/wall.md)"
        )
    return words


_NEAR, _FAR = 5.0, 25.0  # [C] mm, for the cockroach's 42 mm


def _make_plain(sweep: Any, found: Any) -> dict[str, Any]:
    """What a map says, as plain data; places in mm."""
    known = (
        "distance",
        "position",
        "r2",
        "slope",
        "intercept",
        "error",
        "monotone",
        "undefined",
        "told_apart",
        "bending",
    )
    return {
        "contact": sweep.contact,
        "inverted": sweep.inverted,
        **{name: getattr(found, name) for name in known},
    }


def _describe(sweeps: dict[str, Any], maps: dict[str, Any]) -> Iterator[str]:
    yield (
        f"{'antenna':14} contact  inverted  fitted      R²   slope  intercept mm  error mm "
        " monotone  discriminated mm"
    )
    for (name, found), sweep in zip(maps.items(), sweeps.values(), strict=True):
        counts = (
            f"{name[:14]:14} {sweep.contact.sum():7d} {sweep.inverted.sum():9d}"
            f" {found.used.sum():7d}"
        )
        if found.undefined:
            yield (
                f"{counts}  undefined: {found.undefined} ({found.at_base.sum()} peaks at the base"
                " hinge)"
            )
            yield f"  {name} {getattr(found, 'bending', '')}"
            continue
        low, high = found.told_apart
        apart = "none" if np.isnan(low) else f"{low:.1f} to {high:.1f}"
        line = (
            f"{counts} {found.r2:7.3f} {found.slope:7.2f} {found.intercept:13.2f}"
            f" {found.error:9.2f}"
        )
        yield f"{line}  {'yes' if found.monotone else 'no':8}  {apart}"
        if apart == "none":
            longest = sweep.antenna.segment_length.max()
            yield (
                f"  from one distance to the next the peak of {name} moves by no more than its"
                f" longest segment ({longest:.2g} mm): ask for fewer --steps"
            )
        if found.error > found.distance.max():
            yield (
                f"  the line of {name} hangs on one of its {found.used.sum()} distances: left out,"
                f" that one is missed by more than {found.distance.max():g} mm; ask for more"
                " --steps"
            )


def _save(
    out: Path, sweeps: dict[str, Any], maps: dict[str, Any], words: str, movie: bool
) -> None:
    """wall.html with the antennae beside the wall, the maps and a movie, wall.csv and JSON."""
    import pandas as pd

    from feeler.plotting.results import list_shapes, plot_maps, plot_shapes
    from feeler.plotting.walls import write_sweeps_movie
    from feeler.report import Section, write_page

    out.mkdir(parents=True, exist_ok=True)
    section = Section(name="wall", title="Antennae beside a wall", folder=out, vector=False)
    for line in words.splitlines():
        section.text(as_sentence(line))
    shapes = {name: list_shapes(sweep) for name, sweep in sweeps.items()}
    caption = "Each antenna beside the wall, farthest first, in equilibrium."
    section.figure(
        "shapes",
        caption,
        lambda figure: plot_shapes(shapes, figure.subplots()),
        height=min(8.0, 0.9 + 13.0 * len(shapes) / (1 + len(next(iter(shapes.values())).wall))),
    )
    caption = (
        "Wall distance against the point of greatest curvature, with the straight line that reads"
        " one from the other."
    )
    section.figure(
        "maps", caption, lambda figure: plot_maps(maps, figure.subplots()), height=3.2
    )
    rows = [
        [
            name,
            found.undefined or found.r2,
            found.slope,
            found.intercept,
            found.error,
            found.bending,
        ]
        for name, found in maps.items()
    ]
    section.table(
        [
            "antenna",
            "R²",
            "slope",
            "intercept [mm]",
            "error [mm]",
            "straight and pushed lightly it",
        ],
        rows,
    )
    several = next(iter(sweeps.values())).distance.size > 1
    files = ["wall.html", "wall.csv", "shapes.png", "maps.png"]
    write = partial(write_sweeps_movie, sweeps)
    if movie and several and (path := try_movie(write, out / "wall.mp4")):
        section.movie(
            path, "A wall comes nearer; colours: curvature beyond rest, on one scale."
        )
        files.append(path.name)
    tables = [
        found.to_frame().assign(contact=sweeps[name].contact, inverted=sweeps[name].inverted)
        for name, found in maps.items()
    ]
    table = pd.concat(dict(zip(maps, tables, strict=True)), names=["antenna"])
    write_text(out / "wall.csv", table.reset_index(level=0).to_csv(index=False))
    for name, found in maps.items():
        section.numbers(name, distance=found.distance, position=found.position, r2=found.r2)
    write_page(
        out / "wall.html",
        "Wall distance",
        "Where an antenna bends most gives the wall's distance: "
        + "; ".join(
            f"{name} {found.undefined or f'R² {found.r2:.3f}, error {found.error:.2g} mm'}"
            for name, found in maps.items()
        )
        + ".",
        section,
    )
    typer.echo(f"wrote {out}/{', '.join(files)} and each antenna's numbers as JSON", err=True)
