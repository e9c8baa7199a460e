"""``feeler tracks``: how fast an animal moves its antennae, from tracked landmarks."""

from pathlib import Path
from typing import Annotated

import numpy as np
import typer

EXAMPLES = """Examples:

  feeler tracks trial1_xypts.csv trial2_xypts.csv --frame-rate 30

  feeler tracks walk.csv --frame-rate 60 --origin bottom-left --landmarks left_tip,right_tip,head,abdomen
"""


def tracks(
    files: Annotated[list[Path], typer.Argument(help="DLTdv xypts CSV, or a table with NAME_x, NAME_y columns")],
    frame_rate: Annotated[float, typer.Option(help="frames per second")],
    origin: Annotated[str, typer.Option(help="top-left (DLTdv8) or bottom-left (older DLTdv)")] = "top-left",
    landmarks: Annotated[str, typer.Option(help="names of the points in order, separated by commas")] = "",
    cutoff: Annotated[float, typer.Option(help="low-pass [Hz]")] = 6.0,
    max_gap: Annotated[int, typer.Option(help="longest gap bridged by a straight line [frames]")] = 5,
    length: Annotated[float, typer.Option(help="antenna length [mm]")] = 42.0,
) -> None:
    """Average maximum angular speed per trial and side, and the equivalent lateral speed."""
    from feeler.tracking import load_tracks, measure_exploration

    names = tuple(landmarks.split(",")) if landmarks else None
    trials = [load_tracks(file, frame_rate=frame_rate, origin=origin, landmarks=names) for file in files]
    result = measure_exploration(trials, length=length, cutoff=cutoff * 1e-3, max_gap=max_gap)
    typer.echo("trial                            left °/s (peaks)   right °/s (peaks)   bridged   missing frames")
    for file, speeds, counts, sweeps in zip(files, result.mean_peak, result.n_peaks, result.sweeps, strict=True):
        left, right = np.rad2deg(speeds) * 1e3
        bridged, missing = sum(side.bridged for side in sweeps), sum(side.missing for side in sweeps)
        typer.echo(
            f"{file.name[:32]:32} {left:9.2f} ({counts[0]:3d}) {right:14.2f} ({counts[1]:3d}) {bridged:9d} {missing:9d}"
        )
    typer.echo(
        f"average maximum angular speed {np.rad2deg(result.mean) * 1e3:.2f} °/s; with an antenna of {length:g} mm "
        f"that is {result.lateral_speed * 100:.2f} cm/s sideways. Tracks: {result.source}."
    )


def register(app: typer.Typer) -> None:
    """Add ``tracks`` to the command line."""
    app.command("tracks", epilog=EXAMPLES)(tracks)
