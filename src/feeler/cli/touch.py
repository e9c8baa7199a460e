"""``feeler touch``: one touch in seconds: tensor, picture and movie; or many, kept in a store."""

import itertools
import sys
from pathlib import Path
from typing import Annotated

import typer

from feeler.cli.say import Json, say_json

EXAMPLES = """Examples:

  feeler touch --feature ball --size 1.53 --location 0.5 --speed 0.6

  feeler touch --feature triangle --size 3 --location 0.8 --speed 0.06 --side right --antenna linear

  feeler touch --feature outline --outline leaf.svg --speed 0.3

  feeler touch --feature ball --feature box --location 0.3 --location 0.7 --store set.zarr

The last one simulates every combination of the repeated options. Ctrl-C, a crash or a power cut costs nothing that is
finished: the same command goes on where it stopped, and ends with the same numbers.
"""

MANY = "; repeat it with --store"
Features = Annotated[
    list[str],
    typer.Option(
        help=f"ball, box, triangle, outline or wall, or as in box:half_height=3,rounding=0.2{MANY}"
    ),
]
Sizes = Annotated[
    list[float], typer.Option(help=f"ball's radius, box's or triangle's half-width [mm]{MANY}")
]
Locations = Annotated[
    list[float], typer.Option(help=f"fraction of the length from the base, in (0, 1]{MANY}")
]
Speeds = Annotated[list[float], typer.Option(help=f"speed of the feature [m/s]{MANY}")]
StorePath = Annotated[
    Path | None,
    typer.Option(
        help="folder that keeps each touch as it finishes; resumed if it is there already"
    ),
]


def touch(
    feature: Features = ["ball"],  # noqa: B006 - Typer copies defaults
    size: Sizes = [1.53],  # noqa: B006
    location: Locations = [0.5],  # noqa: B006
    speed: Speeds = [0.6],  # noqa: B006
    outline: Annotated[
        Path | None, typer.Option(help="SVG, DXF or CSV file of --feature outline")
    ] = None,
    approach: Annotated[
        float, typer.Option(help="angle to the antenna [degrees], 90 is perpendicular")
    ] = 90.0,
    side: Annotated[str, typer.Option(help="left or right")] = "left",
    friction: Annotated[float, typer.Option(help="coefficient of friction")] = 1.0,
    duration: Annotated[float, typer.Option(help="recorded time [ms]")] = 380.0,
    timestep: Annotated[float | None, typer.Option(help="integration step [ms]")] = None,
    engine: Annotated[
        str, typer.Option(help="chain-consistent, chain (MuJoCo's equations) or mujoco")
    ] = "chain-consistent",
    antenna: Annotated[str, typer.Option(help="preset or antenna TOML file")] = "cockroach",
    out: Annotated[Path, typer.Option(help="folder for the results of one touch")] = Path(
        "out/touch"
    ),
    movie: Annotated[bool, typer.Option(help="write the movie as well")] = True,
    store: StorePath = None,
    seed: Annotated[int, typer.Option(min=0, help="with --store: root of one seed per touch")] = 0,
    workers: Annotated[
        int | None, typer.Option(help="with --store: how many at once; default one per core")
    ] = None,
    processes: Annotated[
        bool, typer.Option("--processes", help="with --store: in processes, memory bounded")
    ] = False,
    cluster: Annotated[
        str | None,
        typer.Option(
            help="with --store: a Dask scheduler's address or JSON file, or local:4 for 4 processes"
        ),
    ] = None,
    log_json: Annotated[
        bool, typer.Option("--log-json", help="with --store: progress as JSON on stderr")
    ] = False,
    as_json: Json = False,
) -> None:
    """Touch an antenna once (touch.html, tensor.nc, tensor.png/svg/pdf and movie.mp4), or many
    times into a store.
    """
    import feeler
    from feeler.cli.choose import choose_antenna
    from feeler.errors import InvalidInput
    from feeler.stimulus.feature import parse_feature

    chosen = choose_antenna(antenna)
    if outline is not None:
        feature = [f"outline:file={outline}" if kind == "outline" else kind for kind in feature]
    trials = [
        feeler.Trial(
            feature=parse_feature(kind, width), location=place, speed=pace, approach=approach, side=side, friction=friction
        )
        for kind, width, place, pace in itertools.product(feature, size, location, speed)
    ]  # fmt: skip
    options = {"timestep": timestep, "engine": engine}
    if store is not None:
        _fill(
            store,
            chosen,
            trials,
            {**options, "duration": duration, "seed": seed},
            workers,
            processes,
            cluster,
            log_json,
            as_json,
        )
    elif len(trials) > 1:
        raise InvalidInput(
            f"{len(trials)} touches need a --store, as in --store set.zarr; a picture shows one."
        )
    else:
        _show(chosen, trials[0], duration, options, out, movie, as_json)


def _fill(
    store,
    antenna,
    trials,
    options,
    workers,
    processes,
    cluster: str | None,
    log_json: bool,
    as_json,
) -> None:
    """Simulate what the store lacks, and say what it then holds."""
    import feeler
    from feeler.cli.choose import choose_executor
    from feeler.cli.progress import ProgressBar, say_what_stays

    with choose_executor(workers, cluster, processes=processes) as executor:
        if sys.stderr.isatty():
            typer.echo(f"{len(trials)} touches on {executor.describe()}", err=True)
        with (
            ProgressBar("touches", log_json=log_json) as progress,
            say_what_stays(f"finished touches are in {store}"),
        ):
            tensors = feeler.touch(
                antenna, trials, store=store, executor=executor, progress=progress, **options
            )
        finished = tensors.sizes["trial"]
        if as_json:
            say_json({"store": store, "finished": finished, "touches": len(trials)})
        else:
            typer.echo(
                f"{store}: {finished} of {len(trials)} touches finished ({executor.describe()})"
            )


def _show(antenna, trial, duration: float, options, out: Path, movie: bool, as_json: bool) -> None:
    """One touch as tensor, picture and movie."""
    import numpy as np
    from matplotlib.figure import Figure

    from feeler.errors import MissingExtra
    from feeler.experiment.touch import touch as simulate
    from feeler.plotting import plot_touch, style, write_touch_movie
    from feeler.plotting.movie import SLOWER
    from feeler.report import Section, write_page
    from feeler.tensors.formats import save
    from feeler.tensors.unit import in_unit

    out.mkdir(
        parents=True, exist_ok=True
    )  # first of all: a wrong path is said before the work is done
    everything = simulate(antenna, trial, duration=duration, all_hinges=True, **options)
    tensors = everything.isel(sensor=antenna.sensors - 1)
    save(tensors, out / "tensor.nc")
    with style():
        figure = Figure(figsize=(4.5, 3.0), layout="constrained")
        plot_touch(tensors, figure)
        for kind in ("svg", "pdf"):
            figure.savefig(out / f"tensor.{kind}")
    section = Section(name="touch", title=trial.label, folder=out, vector=False)
    if movie:
        try:
            write_touch_movie(antenna, trial, everything, out / "movie.mp4")
        except MissingExtra as missing:
            typer.echo(f"no movie: {missing}", err=True)
            movie = False
        else:
            section.movie(
                out / "movie.mp4",
                f"{trial.label}: {SLOWER:g} times slower than life; colours: curvature.",
            )
    section.figure(
        "tensor",
        "Curvature of every sensor against time.",
        lambda figure: plot_touch(tensors, figure),
    )
    peak = in_unit(tensors["angle"], "deg").values.max()
    curvature = in_unit(tensors["curvature"], "1/mm").values.max()
    force = np.linalg.norm(in_unit(tensors["force"], "mN").values, axis=-1).max()
    facts = [
        ["peak hinge angle [°]", peak],
        ["peak curvature [1/mm]", curvature],
        ["peak force [mN]", force],
    ]
    section.table(["of this touch", ""], [*facts, ["timestep [ms]", tensors.attrs["timestep"]]])
    write_page(
        out / "touch.html", "A touch", f"{antenna.name} is touched by a {trial.label}.", section
    )
    if as_json:
        known = {"peak_hinge_angle": peak, "peak_curvature": curvature, "peak_force": force}
        units = dict(zip(known, ("deg", "1/mm", "mN"), strict=True))
        say_json({"touch": trial.label, **known, "units": units, "page": out / "touch.html"})
        return
    typer.echo(f"{trial.label}: peak hinge angle {peak:.3g}°, peak curvature {curvature:.3g} /mm")
    typer.echo(
        f"wrote {out}/touch.html, tensor.nc, tensor.png, tensor.svg,"
        f" tensor.pdf{', movie.mp4' if movie else ''}"
    )


def register(app: typer.Typer) -> None:
    """Add ``touch`` to the command line."""
    app.command("touch", epilog=EXAMPLES)(touch)
