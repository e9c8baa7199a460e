"""``feeler follow``: run along a wall.

Examples:

  feeler follow exponential --turn 45 --out out/follow

  feeler follow exponential --turn -30 --speed 0.6 --friction 0.3

  feeler follow own.toml --speed 0.1 --target 8
"""

import warnings
from functools import partial
from pathlib import Path
from typing import Annotated, Any

import typer

from feeler.cli.options import EngineName, Json, as_sentence, say, try_movie
from feeler.files import write_text

_POOR = 0.8  # [C] R² below which a straight line is called poor


def follow(
    antenna: Annotated[
        str, typer.Argument(help="preset or antenna file (TOML)")
    ] = "exponential",
    turn: Annotated[
        float,
        typer.Option(
            min=-80, max=80, help="turn of the wall [degrees], positive towards the body"
        ),
    ] = 30.0,
    speed: Annotated[
        float | None,
        typer.Option(
            help="speed of the body [m/s]; default 0.45, for a shorter antenna than 42 mm less"
        ),
    ] = None,
    target: Annotated[
        float | None,
        typer.Option(help="distance to keep [mm]; default 12 for an antenna of 42 mm"),
    ] = None,
    friction: Annotated[float, typer.Option(help="coefficient of friction")] = 0.0,
    oracle: Annotated[bool, typer.Option(help="steer by the true distance instead")] = False,
    engine: EngineName = "chain-consistent",
    timestep: Annotated[
        float | None, typer.Option(help="integration step [ms]; default: what the speed needs")
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option(
            help="folder for page (HTML), figures, movie, table (CSV) and numbers (JSON)"
        ),
    ] = None,
    movie: Annotated[bool, typer.Option(help="with --out: write the movie as well")] = True,
    as_json: Json = False,
) -> None:
    """Run a body along a wall, steered by its antenna."""
    from feeler.cli.choose import choose_planar
    from feeler.wall import FOLLOWING, Controller, calibrate, follow, make_turn
    from feeler.wall.following import RUN_UP, measure_scale

    chosen = choose_planar(antenna)
    if out is not None:
        out.mkdir(parents=True, exist_ok=True)
    how: dict[str, Any] = {
        "posture": FOLLOWING.replace(friction=friction),
        "speed": speed,
        "engine": engine,
        "timestep": timestep,
    }
    known: Any = None if oracle else calibrate(chosen, **how)
    run = None
    if known is None or not known.undefined:
        given = {} if target is None else {"target": target}
        with warnings.catch_warnings():
            warnings.filterwarnings("ignore", "A contact sank")  # said in mm, with the numbers
            run = follow(
                chosen,
                make_turn(turn, [RUN_UP * measure_scale(chosen)] * 2),
                controller=Controller.for_antenna(chosen, **given),
                distance_map=known,
                oracle=oracle,
                **how,
            )
    if run is None:
        words = [
            f"{antenna}: no map to steer by: {known.undefined}",
            f"  it {known.bending}",
            "  --oracle runs a body that is told the true distance",
        ]
    else:
        words = _tell(antenna, run, oracle)
    say(as_json, _make_plain(run, known), words)
    if out is not None:
        _save(out, antenna, run, known, words, movie)


def _make_plain(run: Any, known: Any) -> dict[str, Any]:
    """The numbers of a run, or of a map that there is none of."""
    known = known if run is None else run.map
    plain: dict[str, Any] = {
        "outcome": "no map",
        "r2": None if known is None else known.r2,
        "bending": "" if known is None else known.bending,
    }
    lengths = ("error", "nearest", "estimate_error")
    units = {"r2": "1"}
    if run is not None:
        plain |= {name: getattr(run, name) for name in (*lengths, "collided", "touching")}
        outcome = "collided" if run.collided else "passed"
        plain |= {"outcome": outcome, "duration": run.time[-1], "settings": run.settings}
        units |= {
            "settings.speed": "mm/ms",
            "settings.timestep": "ms",
            "settings.penetration": "mm",
        }
        units |= dict.fromkeys(lengths, "mm") | {"duration": "ms", "touching": "1"}
    return plain | {"units": units}


def _tell(name: str, run: Any, oracle: bool) -> list[str]:
    """The end of a run, its numbers, and what they depend on."""
    end = "ran into the wall" if run.collided else "passed"
    line = (
        f"{name}: {end} after {run.time[-1]:.0f} ms; tracking error {run.error:.2f} mm, nearest"
        f" {run.nearest:.2f} mm"
    )
    words = []
    if oracle:
        line += "; it steered by the true distance: the antenna and --friction did not count"
    else:
        touched = run.estimate_error == run.estimate_error  # NaN: the antenna never touched
        off = (
            f"estimate off by {run.estimate_error:.2f} mm"
            if touched
            else "it never touched, so there was no estimate"
        )
        line += f", {off} (map R² {run.map.r2:.3f})"
        poor = run.map.r2 < _POOR
        words += (
            [f"  the map is poor: a straight line explains {run.map.r2:.0%}"] if poor else []
        )
        words += [f"  it {run.map.bending}"] if run.map.bending else []
        words += [f"  in contact {run.touching:.0%} of the time"] if run.touching < 1 else []
    if run.settings:
        chosen = run.settings
        words.append(
            f"  {chosen['speed']:.3g} m/s, {run.target:.3g} mm to keep; engine"
            f" {chosen['engine']}, timestep {chosen['timestep']:.3g} ms; contacts penetrate by at"
            f" most {chosen['penetration']:.2g} mm"
        )
    return [line, *words]


def _save(out: Path, name: str, run: Any, known: Any, words: list[str], movie: bool) -> None:
    """follow.html with its pictures and movie, follow.csv, map.csv and follow.json."""

    from feeler.plotting.results import plot_maps
    from feeler.plotting.walls import FOLLOW_SLOWER, plot_run, write_run_movie
    from feeler.report import Section, write_page

    section = Section(name="follow", title=f"{name} along a wall", folder=out, vector=False)
    files = ["follow.html", "follow.json"]
    for line in words[1:]:
        section.text(as_sentence(line))
    if run is not None:
        caption = "From above with eight postures, and the distance of the wall, true and felt."
        section.figure("run", caption, lambda figure: plot_run(run, figure), height=3.6)
        write_text(out / "follow.csv", run.to_frame().to_csv(index=False))
        files += ["run.png", "follow.csv"]
    write = None if run is None or not movie else partial(write_run_movie, run)
    if write and (path := try_movie(write, out / "follow.mp4")):
        section.movie(path, f"{FOLLOW_SLOWER:g} times slower than life; colours: curvature.")
        files.append(path.name)
    if known is not None:
        section.figure(
            "map",
            "Wall distance against the point of greatest curvature while the body runs along a"
            " straight wall, and the line that is steered by.",
            lambda figure: plot_maps({name: known}, figure.subplots()),
            height=3.2,
        )
        write_text(out / "map.csv", known.to_frame().to_csv(index=False))
        files += ["map.png", "map.csv"]
    section.numbers("follow", **_make_plain(run, known))
    write_page(out / "follow.html", "Following a wall", f"{words[0]}.", section)
    typer.echo(f"wrote {out}/{', '.join(files)}", err=True)
