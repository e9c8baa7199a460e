"""``feeler touch``: one touch in seconds: tensor, picture and movie."""

from pathlib import Path
from typing import Annotated

import typer

EXAMPLES = """Examples:

  feeler touch --feature ball --size 1.53 --location 0.5 --speed 0.6

  feeler touch --feature triangle --size 3 --location 0.8 --speed 0.06 --side right --antenna linear
"""


def touch(
    feature: Annotated[str, typer.Option(help="ball, box, triangle or wall")] = "ball",
    size: Annotated[float | None, typer.Option(help="ball's radius, box's or triangle's half-width [mm]")] = 1.53,
    location: Annotated[float, typer.Option(help="fraction of the length from the base, in (0, 1]")] = 0.5,
    speed: Annotated[float, typer.Option(help="speed of the feature [m/s]")] = 0.6,
    approach: Annotated[float, typer.Option(help="angle to the antenna [degrees], 90 is perpendicular")] = 90.0,
    side: Annotated[str, typer.Option(help="left or right")] = "left",
    friction: Annotated[float, typer.Option(help="coefficient of friction")] = 1.0,
    duration: Annotated[float, typer.Option(help="recorded time [ms]")] = 380.0,
    timestep: Annotated[float | None, typer.Option(help="integration step [ms]")] = None,
    engine: Annotated[str, typer.Option(help="chain-consistent, chain (MuJoCo's equations) or mujoco")] = "chain-consistent",
    antenna: Annotated[str, typer.Option(help="preset or antenna TOML file")] = "cockroach",
    out: Annotated[Path, typer.Option(help="folder for the results")] = Path("out/touch"),
    movie: Annotated[bool, typer.Option(help="write the movie as well")] = True,
) -> None:
    """Touch an antenna once; writes tensor.nc, tensor.png/svg/pdf and movie.mp4."""
    import feeler
    from feeler.cli.choose import choose_antenna
    from feeler.paper import movie_s2
    from feeler.physics.engine import TIMESTEP
    from feeler.touch.feature import make_feature

    chosen = choose_antenna(antenna)
    trial = feeler.Trial(
        feature=make_feature(feature, size), location=location, speed=speed, approach=approach, side=side, friction=friction
    )  # fmt: skip
    options = {"timestep": timestep or TIMESTEP, "engine": engine}
    everything = movie_s2.compute(chosen, trial, duration, **options)
    tensors = everything.isel(sensor=chosen.sensors - 1)
    out.mkdir(parents=True, exist_ok=True)
    _save(tensors, out)
    if movie:
        movie_s2.write(chosen, trial, everything, out / "movie.mp4")
    peak = tensors["angle"].max().item() * 57.29578
    typer.echo(
        f"{trial.label}: peak hinge angle {peak:.3g}°, peak curvature {tensors['curvature'].max().item():.3g} /mm"
    )
    typer.echo(f"wrote {out}/tensor.nc, tensor.png, tensor.svg, tensor.pdf{', movie.mp4' if movie else ''}")


def _save(tensors, out: Path) -> None:
    from matplotlib.colors import Normalize
    from matplotlib.figure import Figure

    from feeler.plotting import plot_tensor, style
    from feeler.tensors.export import save

    save(tensors, out / "tensor.nc")
    with style():
        figure = Figure(figsize=(4.5, 3.0))
        values = tensors["curvature"].values[0]
        ax = figure.subplots()
        image = plot_tensor(values, tensors["time"].values, ax, Normalize(0.0, max(float(values.max()), 1e-9)))
        figure.colorbar(image, ax=ax, label="curvature [1/mm] (negative drawn as 0)")
        for kind in ("png", "svg", "pdf"):
            figure.savefig(out / f"tensor.{kind}")


def register(app: typer.Typer) -> None:
    """Add ``touch`` to the command line."""
    app.command("touch", epilog=EXAMPLES)(touch)
