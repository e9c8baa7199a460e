"""``feeler export``: the compiled scene as MJCF, for MuJoCo's own viewer.

Examples:

  feeler export scene.xml --feature box --size 3 --location 0.7 --speed 0.3

  feeler export controlled.xml --control --antenna robot

  python -m mujoco.viewer --mjcf=scene.xml
"""

from pathlib import Path
from typing import Annotated, Any

import typer


def export(
    file: Annotated[Path, typer.Argument(help="MJCF file to write")],
    feature: Annotated[
        str, typer.Option(help="ball, peg, box, triangle or wall, or as in box:half_height=3")
    ] = "ball",
    size: Annotated[
        float | None, typer.Option(help="ball's radius, box's or triangle's half-width [mm]")
    ] = 1.53,
    location: Annotated[
        float, typer.Option(help="fraction of the length from the base, in (0, 1]")
    ] = 0.5,
    speed: Annotated[float, typer.Option(help="speed of the feature [m/s]")] = 0.6,
    azimuth: Annotated[
        float,
        typer.Option(help="of an antenna in space: turn of the approach about it [degrees]"),
    ] = 0.0,
    side: Annotated[str, typer.Option(help="left or right")] = "left",
    antenna: Annotated[str, typer.Option(help="preset or antenna TOML file")] = "cockroach",
    control: Annotated[
        bool,
        typer.Option("--control", help="servos at the base, sensors, objects as mocap bodies"),
    ] = False,
) -> None:
    """Write one touch as a MuJoCo model.

    Write one touch as a MuJoCo model (g, mm, ms); keyframe 'start' holds the object's speed.
    """
    import feeler
    from feeler.cli.choose import choose_antenna
    from feeler.errors import InvalidInput
    from feeler.objects.shapes import parse_feature
    from feeler.physics.spec import write_mjcf

    if file.suffix.lower() not in (".xml", ".mjcf"):
        raise InvalidInput(
            f"the scene is written as MJCF, which is XML; got {file.name!r}. Name it"
            f" {file.with_suffix('.xml').name}."
        )
    shape = parse_feature(feature, size)
    where: dict[str, Any] = {"location": location, "azimuth": azimuth, "side": side}
    trial = feeler.Trial(feature=shape, speed=speed, **where)
    write_mjcf(choose_antenna(antenna), trial, file, control=control)
    typer.echo(
        f"wrote {file} (units g, mm, ms: 1 s in the viewer is 1 ms); load keyframe 'start' to set"
        " it moving"
    )
