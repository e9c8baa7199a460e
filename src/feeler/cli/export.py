"""``feeler export``: a scene as MJCF for MuJoCo's viewer, or the antenna alone for a robot's model.

Examples:

  feeler export scene.xml --feature box --size 3 --location 0.7 --speed 0.3

  feeler export controlled.xml --control --antenna robot

  feeler export antenna.xml --body --units si --antenna robot --speed 0.3

  python -m mujoco.viewer --mjcf=scene.xml
"""

from pathlib import Path
from typing import Annotated, Any

import typer

from feeler.errors import InvalidInput


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
    antenna: Annotated[str, typer.Option(help="preset or antenna TOML file")] = ("exponential"),
    control: Annotated[
        bool,
        typer.Option("--control", help="servos at the base, sensors, objects as mocap bodies"),
    ] = False,
    body: Annotated[
        bool,
        typer.Option("--body", help="the antenna alone, to be attached to a robot's model"),
    ] = False,
    servo: Annotated[
        bool, typer.Option("--servo", help="with --body: a position servo that turns the base")
    ] = False,
    units: Annotated[str, typer.Option(help="mm (g, mm, ms) or si (kg, m, s)")] = "mm",
) -> None:
    """Write one touch as a MuJoCo model.

    Keyframe 'start' holds the object's speed. With --body the antenna alone, without objects and
    options; the touch is then simulated by feeler and by MuJoCo, and the difference is printed.
    """
    import feeler
    from feeler.cli.choose import choose_antenna
    from feeler.objects.shapes import parse_feature
    from feeler.physics import spec

    if file.suffix.lower() not in (".xml", ".mjcf"):
        raise InvalidInput(
            f"the scene is written as MJCF, which is XML; got {file.name!r}. Name it"
            f" {file.with_suffix('.xml').name}."
        )
    if units not in spec.UNITS:
        raise InvalidInput(f"--units must be one of {', '.join(spec.UNITS)}, got {units!r}.")
    if servo and not body:
        raise InvalidInput("--servo goes with --body; --control has servos of its own.")
    if control and body:
        raise InvalidInput("give either --control (a scene) or --body (the antenna alone).")
    shape = parse_feature(feature, size)
    where: dict[str, Any] = {"location": location, "azimuth": azimuth, "side": side}
    trial = feeler.Trial(feature=shape, speed=speed, **where)
    chosen = choose_antenna(antenna)
    if not body:
        spec.write_mjcf(chosen, trial, file, control=control, units=units)
        clock = "kg, m, s" if units == "si" else "g, mm, ms: 1 s in the viewer is 1 ms"
        typer.echo(f"wrote {file} (units {clock}); load keyframe 'start' to set it moving")
        return
    options: dict[str, Any] = {"units": units, "speed": speed}
    spec.write_body(chosen, file, servo=servo, **options)
    clock = "kg, m, s" if units == "si" else "g, mm, ms"
    typer.echo(
        f"wrote {file} ({chosen.n_segments} segments, units {clock}); attach it at a site: the"
        " antenna points along the site's +y. It has no objects and no options."
    )
    raised = spec.count_raised(chosen) if units == "si" else 0
    if raised:
        typer.echo(
            f"raised the moments of inertia of {raised} segments to 1e-15 kg·m², the least that"
            " MuJoCo takes; --units mm has no such limit"
        )
    found = spec.compare_body(chosen, trial, units)
    peak = found.pop("peak")
    options.pop("speed")
    told = spec.describe_options(chosen, **options)
    lines = [f"a touch by {trial.label} (peak {peak:.3g} rad) differs from feeler's by"]
    for name, value in found.items():
        how = told if name == "own" else f"MuJoCo's default options and a timestep of {name}"
        far = "no number, it diverges," if value == float("inf") else f"{value:.1e} rad"
        lines.append(f"  {far} with {how}")
    if found["own"] > _FAITHFUL * peak:
        lines.append("this antenna is too light for SI in MuJoCo; use --units mm")
    typer.echo("\n".join(lines))


_FAITHFUL = 1e-3  # [C] of the peak
