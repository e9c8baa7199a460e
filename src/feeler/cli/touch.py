"""``feeler touch``: one touch in seconds: tensor, picture and page; or many, kept in a store.

Examples:

  feeler touch --feature ball --size 1.53 --location 0.5 --speed 0.6

  feeler touch --feature triangle --size 3 --location 0.8 --speed 0.06 --side right --antenna linear

  feeler touch --feature outline --outline leaf.svg --speed 0.3

  feeler touch --feature ball --feature box --location 0.3 --location 0.7 --store set.zarr

The last one simulates every combination of the repeated options. After Ctrl-C, a crash or a power \
cut the same command
goes on where it stopped, and ends with the same numbers.
"""

import sys
from functools import partial
from itertools import product
from pathlib import Path
from types import SimpleNamespace
from typing import Annotated, Any

import numpy as np
import typer

from feeler.cli.options import (
    EngineName,
    Json,
    as_sentence,
    report_interrupt,
    say,
    say_adapted,
    try_movie,
)
from feeler.errors import InvalidInput
from feeler.progress import ProgressBar

_MANY = "; repeat it with --store"
_VECTOR = ("tensor.svg", "tensor.pdf")


def touch(
    feature: Annotated[
        list[str],
        typer.Option(
            "--feature",
            "--object",
            help="ball, peg, box, triangle, outline, mesh or wall, or as in"
            f" box:half_height=3,rounding=0.2 or mesh:file=rock.stl{_MANY}",
        ),
    ] = ["ball"],  # noqa: B006
    size: Annotated[
        list[float],
        typer.Option(help=f"ball's radius, box's or triangle's half-width [mm]{_MANY}"),
    ] = [1.53],  # noqa: B006
    location: Annotated[
        list[float],
        typer.Option(help=f"fraction of the length from the base, in (0, 1]{_MANY}"),
    ] = [0.5],  # noqa: B006
    speed: Annotated[
        list[float],
        typer.Option(help=f"speed of the feature [m/s]{_MANY}"),
    ] = [0.6],  # noqa: B006
    outline: Annotated[
        Path | None, typer.Option(help="SVG or CSV file of --feature outline")
    ] = None,
    approach: Annotated[
        float, typer.Option(help="angle to the antenna [degrees], 90 is perpendicular")
    ] = 90.0,
    azimuth: Annotated[
        float,
        typer.Option(
            help="for an antenna in space: side from which it comes [degrees about it]"
        ),
    ] = 0.0,
    side: Annotated[str, typer.Option(help="left or right")] = "left",
    friction: Annotated[float, typer.Option(help="coefficient of friction")] = 1.0,
    duration: Annotated[float, typer.Option(help="recorded time [ms]")] = 380.0,
    timestep: Annotated[float | None, typer.Option(help="integration step [ms]")] = None,
    engine: EngineName = "chain-consistent",
    contact: Annotated[
        str,
        typer.Option(
            help="smooth, hard, or even as in version 0.2; smooth:0.05 sets its time constant [ms]"
            " (docs: Contact)"
        ),
    ] = "smooth",
    antenna: Annotated[str, typer.Option(help="preset or antenna TOML file")] = "exponential",
    out: Annotated[Path, typer.Option(help="folder for the results of a single touch")] = Path(
        "out/touch"
    ),
    movie: Annotated[bool, typer.Option(help="write movie.mp4 as well")] = False,
    vector: Annotated[
        bool, typer.Option("--vector", help="write tensor.svg and tensor.pdf as well")
    ] = False,
    store: Annotated[
        Path | None,
        typer.Option(
            help="folder that keeps each touch as it finishes; resumed if it is there already"
        ),
    ] = None,
    seed: Annotated[
        int, typer.Option(min=0, help="with --store: seed; each touch gets its own from it")
    ] = 0,
    workers: Annotated[
        int | None, typer.Option(help="with --store: how many at once; default one per core")
    ] = None,
    processes: Annotated[
        bool, typer.Option("--processes", help="with --store: in processes, memory bounded")
    ] = False,
    cluster: Annotated[
        str | None,
        typer.Option(help="with --store: a Dask scheduler's address or JSON file"),
    ] = None,
    log_json: Annotated[
        bool, typer.Option("--log-json", help="with --store: progress as JSON on stderr")
    ] = False,
    as_json: Json = False,
) -> None:
    """Touch an antenna: tensor, picture, page.

    Touch an antenna once (touch.html, tensor.nc, tensor.png; movie and vector graphics on
    request), or many times into a store.
    """
    said = SimpleNamespace(**locals())
    from feeler.cli.choose import choose_antenna

    chosen, trials = choose_antenna(said.antenna), _make_trials(said)
    if said.store is not None:
        _fill(said, chosen, trials)
    elif said.cluster is not None or said.processes:
        raise InvalidInput("--cluster and --processes need a --store, as in --store set.zarr.")
    elif len(trials) > 1:
        raise InvalidInput(
            f"{len(trials)} touches need a --store, as in --store set.zarr; a picture shows one."
        )
    else:
        _show(said, chosen, trials[0])


def _list_options(said: SimpleNamespace) -> dict[str, Any]:
    """What one touch and many are simulated with."""
    return {
        "duration": said.duration,
        "timestep": said.timestep,
        "engine": said.engine,
        "contact": said.contact,
    }


def _make_trials(said: SimpleNamespace) -> list[Any]:
    """Every combination of features, sizes, locations and speeds."""
    from feeler.objects.shapes import parse_feature
    from feeler.objects.trials import Trial

    named = said.feature
    if said.outline:
        asked = ["outline"] if named == ["ball"] else named  # a ball if nothing is said
        if "outline" not in asked:
            raise InvalidInput(
                f"--outline {said.outline} needs --feature outline, got"
                f" --feature {' --feature '.join(named)}."
            )
        named = [f"outline:file={said.outline}" if k == "outline" else k for k in asked]
    same: dict[str, Any] = {
        "approach": said.approach,
        "azimuth": said.azimuth,
        "side": said.side,
        "friction": said.friction,
    }
    return [
        Trial(feature=parse_feature(kind, width), location=place, speed=pace, **same)
        for kind, width, place, pace in product(named, said.size, said.location, said.speed)
    ]


def _fill(said: SimpleNamespace, antenna: Any, trials: list[Any]) -> None:
    """Simulate what the store lacks, and say what it then holds."""
    from feeler.cli.choose import choose_executor
    from feeler.experiments.tactile import touch as simulate

    with choose_executor(said.workers, said.cluster, processes=said.processes) as executor:
        if sys.stderr.isatty():
            typer.echo(f"{len(trials)} touches on {executor.describe()}", err=True)
        with (
            ProgressBar("touches", log_json=said.log_json) as progress,
            report_interrupt(f"finished touches are in {said.store}"),
        ):
            tensors = simulate(
                antenna,
                trials,
                store=said.store,
                executor=executor,
                progress=progress,
                seed=said.seed,
                **_list_options(said),
            )
        finished, asked = tensors.sizes["trial"], len(trials)
        words = f"{said.store}: {finished} of {asked} touches finished ({executor.describe()})"
        say(
            said.as_json, {"store": said.store, "finished": finished, "touches": asked}, [words]
        )


def _show(said: SimpleNamespace, antenna: Any, trial: Any) -> None:
    """One touch as tensor, picture and page, and what else was asked for."""
    from feeler.experiments.tactile import touch as simulate
    from feeler.report import Section, write_page
    from feeler.tensors.formats import save

    out = said.out
    # first of all: a wrong path is said before the work is done
    out.mkdir(parents=True, exist_ok=True)
    everything = simulate(antenna, trial, all_hinges=True, **_list_options(said))
    tensors = everything.isel(sensor=antenna.sensors - 1)
    save(tensors, out / "tensor.nc")
    section = Section(name="touch", title=trial.label, folder=out, vector=False)
    movie = said.movie and _film(antenna, trial, everything, section)
    _draw(antenna, trial, everything, tensors, section, vector=said.vector)
    facts = _measure(tensors)
    known = facts | {
        "penetration depth": (float(tensors["sink"].max()), "of the smaller radius")
    }
    for name in ("contact_time_constant", "timestep"):
        if name in tensors.attrs:
            known[name.replace("_", " ")] = tensors.attrs[name], "ms"
    rows = [[f"{name} [{unit}]", value] for name, (value, unit) in known.items()]
    error = float(tensors["error"][0])
    rows += [["numerical error [of the peak]", error]]
    section.table(["quantity", "value"], rows)
    adapted = say_adapted(tensors) if said.contact == "smooth" else ""
    if adapted:
        section.text(as_sentence(adapted))
    angle, curvature, force = (value for value, _ in facts.values())
    lead = (
        f"It bends by at most {angle:.3g}° at one hinge; the greatest force is {force:.3g} mN."
        f" Touched by: {trial.label}. L is the antenna's length."
    )
    write_page(
        out / "touch.html", f"Simulated touch of the antenna '{antenna.name}'", lead, section
    )
    more = [*_VECTOR] * said.vector + ["movie.mp4"] * movie
    lines = [
        f"{trial.label}: peak hinge angle {angle:.3g}°, peak curvature {curvature:.3g} /mm",
        *([adapted] if adapted else []),
        f"wrote {out}/" + ", ".join(["touch.html", "tensor.nc", "tensor.png", *more]),
    ]
    known["error"] = error, "1"
    plain: dict[str, Any] = {
        name.replace(" ", "_"): value for name, (value, _) in known.items()
    }
    units = {name.replace(" ", "_"): unit for name, (_, unit) in known.items()}
    units["peak_hinge_angle"] = "deg"
    plain |= {"touch": trial.label, "units": units, "page": out / "touch.html"}
    say(said.as_json, plain, lines)


def _film(antenna: Any, trial: Any, everything: Any, section: Any) -> bool:
    """The touch as a movie, where there is what writes movies."""
    from feeler.plotting import write_touch_movie
    from feeler.plotting.antennas import SLOWER

    write = partial(write_touch_movie, antenna, trial, everything)
    path = try_movie(write, section.folder / "movie.mp4")
    words = f"{trial.label}: {SLOWER:g} times slower than life; colours: curvature."
    if path:
        section.movie(path, words)
    return path is not None


def _draw(
    antenna: Any, trial: Any, everything: Any, tensors: Any, section: Any, *, vector: bool
) -> None:
    """The tensor on the page and as files, and what can be turned of an antenna in space."""
    from feeler.plotting import plot_touch, style

    if vector:
        from matplotlib.figure import Figure

        with style():
            figure = Figure(figsize=(4.5, 3.0), layout="constrained")
            plot_touch(tensors, figure)
            for name in _VECTOR:
                figure.savefig(section.folder / name)
    section.figure(
        "tensor",
        "Curvature at every sensor against time.",
        lambda figure: plot_touch(tensors, figure),
    )
    if antenna.spatial:
        from feeler.plotting.antennas import describe_turnable

        scene = describe_turnable(antenna, trial, everything)
        section.turnable(
            "turnable",
            "The touch as it goes on: drag the picture, or use the arrow keys, to turn it. Colours:"
            f" curvature of all hinges, from none to {scene['top']:.3g} /mm, by square root.",
            scene,
        )


def _measure(tensors: Any) -> dict[str, tuple[float, str]]:
    """The peak of each quantity, the same from either side, and its unit."""
    from feeler.tensors.transforms import in_unit, measure_peak

    force = np.linalg.norm(in_unit(tensors["force"], "mN").values, axis=-1)
    return {
        "peak hinge angle": (measure_peak(in_unit(tensors["angle"], "deg")), "°"),
        "peak curvature": (measure_peak(in_unit(tensors["curvature"], "1/mm")), "1/mm"),
        "peak force": (measure_peak(force), "mN"),
    }
