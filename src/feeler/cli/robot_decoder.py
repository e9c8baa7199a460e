"""``feeler robot train``, and the decoder that ``classify`` and ``stream`` answer with."""

from pathlib import Path
from typing import Annotated, Any

import typer

from feeler.cli.options import Json, _require_new, say
from feeler.cli.robot_options import (
    Calibration,
    Engine,
    JointNames,
    Numbers,
    Robot,
    Speeds,
    Timestep,
    Workers,
    make_touches,
    tell,
)
from feeler.errors import InvalidInput
from feeler.files import write_text
from feeler.progress import ProgressBar

DecoderFile = Annotated[
    Path | None,
    typer.Option("--decoder", help="decoder to answer with, made by feeler robot train"),
]


def train(
    robot: Annotated[
        str, typer.Argument(help="robot file (feeler robot new), antenna TOML, or preset")
    ] = "robot",
    objects: Annotated[
        Path | None,
        typer.Argument(help="TOML with a table [[object]] each; default: ball and box of 4 mm"),
    ] = None,
    out: Annotated[
        Path, typer.Option("--out", "-o", help="file to write, such as my.decoder")
    ] = Path("robot.decoder"),
    locations: Numbers = None,
    speeds: Speeds = None,
    calibration: Calibration = None,
    joints: JointNames = None,
    noise: Annotated[
        float | None,
        typer.Option(help="sd of each reading [rad]; default 0.004", min=1e-6, max=1.0),
    ] = None,
    friction: Annotated[
        float, typer.Option(help="friction of the objects; robots differ from it", min=0.0)
    ] = 1.0,
    robots: Annotated[
        int, typer.Option(min=3, help="surrogate robots whose touches are learned")
    ] = 24,
    seed: Annotated[int, typer.Option(min=0, help="seed of the robots")] = 0,
    header: Annotated[
        Path | None,
        typer.Option(help="also write a linear decoder as a C header (.h) for the board"),
    ] = None,
    engine: Engine = None,
    timestep: Timestep = None,
    workers: Workers = None,
    as_json: Json = False,
) -> None:
    """Train a decoder of a robot's touches, once, and write it into one file.

    classify, stream, Python and a ROS 2 node load the file and answer at once. It holds how it was
    trained, the calibration, the channels' names, and its accuracy on robots that were left out.
    """
    from feeler.robot import load_calibration
    from feeler.robot.decoder import train_decoder

    for file in (out, *([header] if header else [])):
        _require_new(file)
    if not out.parent.is_dir():
        raise InvalidInput(f"there is no folder {out.parent}. Make it first.")
    chosen = Robot(robot, joints)
    touches = make_touches(objects, locations, speeds, friction)
    path = calibration or chosen.calibration
    lines = None if path is None else load_calibration(path)
    chosen.check_lines(lines)
    with _say_progress(touches, robots) as progress:
        decoder = train_decoder(
            chosen.antenna,
            touches,
            robots=robots,
            seed=seed,
            noise=noise,
            calibration=lines,
            joints=chosen.joints,
            progress=progress,
            **tell(engine=engine, timestep=timestep, workers=workers),
        )
    decoder.save(out)
    known: dict[str, Any] = {
        "file": str(out),
        "robot": decoder.robot,
        "held_out": decoder.accuracy,
    }
    known |= {"without": decoder.tolerance, "recipe": decoder.recipe}
    known |= {"confusion": decoder.classifier.confusion_.tolist()}
    if header is not None:
        known["header"] = _write_header(header, decoder)
    words = decoder.describe()
    words += [f"C header    {known['header']['words']}"] if header is not None else []
    words.append(f"wrote {out}; now: feeler robot classify touch.csv --decoder {out}")
    say(as_json, {**known, "classes": decoder.classes}, words)


def _write_header(path: Path, decoder: Any) -> dict[str, Any]:
    """The linear decoder of a board, written where it is accurate enough; what is said of it."""
    from feeler.robot.board import make_board_decoder

    made = make_board_decoder(decoder)
    words = (
        f"linear, {made.window} ms after contact: {made.accuracy:.1%} held out, against"
        f" {decoder.accuracy:.1%}"
    )
    if made.accuracy < decoder.accuracy - 0.03:
        words = f"not written: {words}, more than 3 points less"
    else:
        write_text(path, made.write())
        words = f"{path}: {words}"
    return {"accuracy": made.accuracy, "window": made.window, "words": words}


def _say_progress(touches: list, robots: int) -> Any:
    """A bar, and before it a line on what is to be done."""
    half = (robots + 1) // 2
    typer.echo(
        f"training: {len(touches)} touches by {robots} surrogate robots, and of other objects by"
        f" {half}",
        err=True,
    )
    return ProgressBar("surrogate robots")


def _choose_decoder(
    file: Path | None,
    robot: Robot,
    said: dict[str, Any],
    robots: int = 24,
    **how: Any,
) -> Any:
    """The decoder in a file; else one of the same recipe from the cache, or trained now and kept
    there. ``said`` are the options that belong to its training.
    """
    from feeler.robot.decoder import RobotDecoder, find_cached, keep_cached, train_decoder

    if file is not None:
        given = [f"--{name}" for name, value in {**said, **how}.items() if value is not None]
        given += ["--robots"] if robots != 24 else []
        if given:
            raise InvalidInput(
                f"{', '.join(given)} belongs to the training of {file}: leave it out, or train"
                " another decoder with it."
            )
        return RobotDecoder.load(file)
    touches = make_touches(**said)
    kept = find_cached(robot.antenna, touches, robots=robots, **how)
    if kept.is_file():
        try:
            decoder = RobotDecoder.load(kept)
        except InvalidInput:  # of another version, or cut short: made anew
            decoder = None
        if decoder is not None:
            typer.echo(f"decoder trained before with these settings: {kept}", err=True)
            return decoder
    with _say_progress(touches, robots) as progress:
        decoder = train_decoder(robot.antenna, touches, robots=robots, progress=progress, **how)
    if keep_cached(decoder, kept):
        typer.echo(f"kept for the next time: {kept}", err=True)
    return decoder


def _parse_missing(text: str | None) -> tuple[int, ...]:
    """Numbers of sensors from ``--missing 4,7``."""
    try:
        return () if text is None else tuple(dict.fromkeys(map(int, text.split(","))))
    except ValueError:
        raise InvalidInput(
            f"--missing must be numbers of sensors with commas between, as in 4,7; got {text!r}."
        ) from None
