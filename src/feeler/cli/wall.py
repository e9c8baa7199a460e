"""``feeler wall``: the distance of a wall from where an antenna bends most.

Examples:

  feeler wall exponential linear constant --out out/wall

  feeler wall exponential --reading total --friction 0 --prebend none --near 5 --far 16
"""

from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer

from feeler.cli.options import Json, say_json
from feeler.errors import InvalidInput


def wall(
    antennas: Annotated[list[str] | None, typer.Argument(help="preset names")] = None,
    angle: Annotated[float, typer.Option(help="inter-antennal angle [degrees]")] = 30.0,
    reading: Annotated[
        str, typer.Option(help="angle from the midline, or total between both antennae")
    ] = "midline",
    prebend: Annotated[
        str,
        typer.Option(
            help="how the J comes about: rest (its slack shape), placed, rotation or none"
        ),
    ] = "rest",
    friction: Annotated[float, typer.Option(help="coefficient of friction")] = 0.3,
    near: Annotated[float, typer.Option(help="nearest distance [mm]")] = 5.0,
    far: Annotated[float, typer.Option(help="farthest distance [mm]")] = 25.0,
    steps: Annotated[int, typer.Option(help="number of distances", min=1)] = 20,
    out: Annotated[
        Path | None, typer.Option(help="folder for page (HTML), figures and numbers (JSON)")
    ] = None,
    as_json: Json = False,
) -> None:
    """Map wall distance from antenna curvature.

    Let a wall approach each antenna, and fit the wall's distance to the place of greatest
    curvature.
    """
    from feeler.cli.choose import name_antennas
    from feeler.wall import Posture, approach, map_distance

    if not near <= far:
        raise InvalidInput(f"--near must not exceed --far, got {near:g} and {far:g} mm.")
    said: dict[str, Any] = {"reading": reading, "prebend": prebend}
    posture = Posture(inter_antennal_angle=angle, friction=friction, **said)
    distances = np.linspace(far, near, steps) if steps > 1 else np.array([near])
    names = antennas or ["exponential", "linear", "constant", "matched"]
    sweeps = {
        name: approach(antenna, posture, distances)
        for name, antenna in name_antennas(names).items()
    }
    maps = {name: map_distance(sweep) for name, sweep in sweeps.items()}
    if as_json:
        say_json({name: _make_plain(sweeps[name], found) for name, found in maps.items()})
    else:
        _tell(sweeps, maps)
    if out is not None:
        _save(out, sweeps, maps)


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
    )
    return {
        "contact": sweep.contact,
        "inverted": sweep.inverted,
        **{name: getattr(found, name) for name in known},
    }


def _tell(sweeps: dict[str, Any], maps: dict[str, Any]) -> None:
    typer.echo(
        f"{'antenna':14} contact  inverted  fitted      R²   slope  intercept mm  error mm "
        " monotone  discriminated mm"
    )
    for (name, found), sweep in zip(maps.items(), sweeps.values(), strict=True):
        counts = (
            f"{name[:14]:14} {sweep.contact.sum():7d} {sweep.inverted.sum():9d}"
            f" {found.used.sum():7d}"
        )
        if found.undefined:
            typer.echo(
                f"{counts}  undefined: {found.undefined} ({found.at_base.sum()} peaks at the base"
                " hinge)"
            )
            continue
        low, high = found.told_apart
        apart = "none" if np.isnan(low) else f"{low:.1f} to {high:.1f}"
        line = (
            f"{counts} {found.r2:7.3f} {found.slope:7.2f} {found.intercept:13.2f}"
            f" {found.error:9.2f}"
        )
        typer.echo(f"{line}  {'yes' if found.monotone else 'no':8}  {apart}")
        if found.error > found.distance.max():
            typer.echo(
                f"  the line of {name} hangs on one of its {found.used.sum()} distances: left out,"
                f" that one is missed by more than {found.distance.max():g} mm; ask for more"
                " --steps"
            )


def _save(out: Path, sweeps: dict[str, Any], maps: dict[str, Any]) -> None:
    """wall.html with the antennae beside the wall and the maps, their pictures, and wall.json."""
    from feeler.plotting.results import Shapes, plot_maps, plot_shapes
    from feeler.report import Section, write_page

    out.mkdir(parents=True, exist_ok=True)
    section = Section(name="wall", title="Antennae beside a wall", folder=out, vector=False)
    shapes = {name: Shapes.of_sweep(sweep) for name, sweep in sweeps.items()}
    caption = "Each antenna beside the wall, farthest first, in equilibrium."
    height = 0.8 + 1.2 * len(shapes)
    section.figure(
        "shapes",
        caption,
        lambda figure: plot_shapes(shapes, figure.subplots()),
        height=height,
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
            found.r2,
            found.slope,
            found.intercept,
            found.error,
            found.undefined or "defined",
        ]
        for name, found in maps.items()
    ]
    section.table(["antenna", "R²", "slope", "intercept [mm]", "error [mm]", "R² is"], rows)
    for name, found in maps.items():
        section.numbers(name, distance=found.distance, position=found.position, r2=found.r2)
    write_page(
        out / "wall.html",
        "How far is the wall?",
        "Read from where each antenna bends most.",
        section,
    )
    typer.echo(
        f"wrote {out}/wall.html, shapes.png, maps.png and each antenna's numbers as JSON",
        err=True,
    )
