"""``feeler follow``: run along a wall.

Examples:

  feeler follow exponential --turn 45

  feeler follow exponential --turn -30 --speed 0.6 --friction 0.3
"""

from typing import Annotated

import typer

from feeler.cli.options import Json, say_json


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
    speed: Annotated[float, typer.Option(help="speed of the body [m/s]")] = 0.45,
    target: Annotated[float, typer.Option(help="distance to keep [mm]")] = 12.0,
    friction: Annotated[float, typer.Option(help="coefficient of friction")] = 0.0,
    oracle: Annotated[bool, typer.Option(help="steer by the true distance instead")] = False,
    as_json: Json = False,
) -> None:
    """Run a body along a wall, steered by its antenna."""
    from feeler.cli.choose import choose_antenna
    from feeler.wall import FOLLOWING, Controller, follow, make_turn

    run = follow(
        choose_antenna(antenna),
        make_turn(turn),
        posture=FOLLOWING.replace(friction=friction),
        controller=Controller(target=target),
        speed=speed,
        oracle=oracle,
    )
    if as_json:
        known = {
            "collided": run.collided,
            "error": run.error,
            "nearest": run.nearest,
            "estimate_error": run.estimate_error,
            "duration": run.time[-1],
            "r2": None if run.map is None else run.map.r2,
        }
        units = dict.fromkeys(("error", "nearest", "estimate_error"), "mm")
        say_json({**known, "units": units | {"duration": "ms", "r2": "1"}})
        return
    end = "ran into the wall" if run.collided else "passed"
    words = (
        f"{antenna}: {end} after {run.time[-1]:.0f} ms; tracking error {run.error:.2f} mm, nearest"
        f" {run.nearest:.2f} mm"
    )
    if run.map is not None:
        touched = run.estimate_error == run.estimate_error  # NaN: the antenna never touched
        off = (
            f"estimate off by {run.estimate_error:.2f} mm"
            if touched
            else "it never touched, so there was no estimate"
        )
        words += f", {off} (map R² {run.map.r2:.3f})"
    if oracle:
        words += "; it steered by the true distance: the antenna and --friction did not count"
    typer.echo(words)
