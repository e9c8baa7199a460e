"""``feeler robot``: calibrate, check, convert, fit and classify the recordings of a robotic
antenna.

Examples:

  feeler robot example .

  feeler robot calibrate surrogate_calibration_table.csv --out calibration.json

  feeler robot check surrogate_ball_tip_fast.csv --calibration calibration.json

  feeler robot classify surrogate_ball_tip_fast.csv --calibration calibration.json

  feeler robot stream surrogate_ball_tip_fast.csv --calibration calibration.json

  feeler robot train --calibration calibration.json -o my.decoder

  feeler robot classify surrogate_ball_tip_fast.csv --decoder my.decoder

  feeler robot fit surrogate_release.csv

  feeler robot convert surrogate_release.csv --out set.nc

A recording by ROS 2 in the place of a CSV, by file and topic (extra: ros):

  feeler robot check run.mcap:joint_states --antenna robot.toml

A board of your own:

  feeler robot board sketch.ino --channels 12 --rate 200

  feeler robot stream /dev/ttyUSB0 --serial --calibration calibration.json

Your own robot and objects (an objects file holds tables such as [[object]] name = "bolt", shape = \
"ball", radius = 3):

  feeler robot new robot.toml --hinges 12

  feeler robot train robot.toml objects.toml --speeds 0.1,0.3 -o my.decoder

  feeler robot classify touch1.csv touch2.csv --antenna robot.toml --objects objects.toml --speeds \
0.1,0.3 --out out/touches
"""

import re
import sys
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer

from feeler.cli.options import Commands, Json, list_examples, require_new, say
from feeler.cli.robot_live import board, stream
from feeler.cli.robot_options import (
    AntennaName,
    BadChannels,
    Calibration,
    ChannelUnit,
    DecoderFile,
    Engine,
    Files,
    Gaps,
    JointNames,
    Numbers,
    Objects,
    Out,
    Outside,
    Robot,
    Speeds,
    Timestep,
    TimeUnit,
    Workers,
    _make_touches,
    choose_decoder,
    list_given,
    say_progress,
)
from feeler.errors import InvalidInput
from feeler.files import write_text

# of a recording's history: what its answers must be seen beside
_TOLD = re.compile("was not closed|stamps are all 0|gaps over|noise alone")

app = Commands(
    help="Calibrate, test and classify with a robotic antenna.",
    no_args_is_help=True,
)


@app.command()
def example(folder: Annotated[Path, typer.Argument(help="where to put them")] = Path()) -> None:
    """Copy the example files to a folder.

    They were made by a surrogate robot.
    """
    from feeler.robot.description import EXAMPLES, get_example

    folder.mkdir(parents=True, exist_ok=True)
    for name in EXAMPLES:
        source = get_example(name)
        (folder / source.name).write_bytes(source.read_bytes())
        typer.echo(f"{name:12} {folder / source.name}")


@app.command()
def new(
    file: Annotated[Path, typer.Argument(help="TOML file to write")] = Path("robot.toml"),
    hinges: Annotated[int, typer.Option(min=1, help="how many hinges it has")] = 8,
) -> None:
    """Write a commented robot file to be edited.

    Give it to --antenna.
    """
    from feeler.robot import write_robot

    write_robot(file, hinges)
    typer.echo(f"wrote {file}; edit its numbers, then give it to --antenna")


@app.command()
def calibrate(
    table: Annotated[
        Path, typer.Argument(help="CSV: hinge, angle_deg, capacitance_pF, optionally time_ms")
    ],
    out: Annotated[Path, typer.Option(help="where to save the calibration")] = Path(
        "calibration.json"
    ),
    curve: Annotated[
        str,
        typer.Option(
            help="line, quadratic, cubic, spline (monotone), or auto: the simplest that predicts"
            " angles that it did not see"
        ),
    ] = "auto",
    as_json: Json = False,
) -> None:
    """Fit capacitance to angle, one curve per hinge.

    Also prints how good the fit is.
    """
    from feeler.robot import load_calibration_table, save_calibration

    calibration = load_calibration_table(table, curve=curve)
    save_calibration(calibration, out)
    robot = f", robot {calibration.robot}" if calibration.robot else ""
    lines = [calibration.report(), *calibration.explain(), f"saved to {out}{robot}"]
    say(as_json, vars(calibration), lines)


@app.command()
def check(
    recordings: Files,
    antenna: AntennaName = "robot",
    calibration: Calibration = None,
    unit: ChannelUnit = None,
    time_unit: TimeUnit = None,
    outside: Outside = "refuse",
    gaps: Gaps = "refuse",
    bad_channels: BadChannels = "refuse",
    joints: JointNames = None,
    out: Out = None,
    as_json: Json = False,
) -> None:
    """Report what a recording holds and what is wrong.

    Also what would be repaired.
    """
    from feeler.cli.robot_pages import write_recordings

    robot, units = Robot(antenna, joints), {"unit": unit, "time_unit": time_unit}
    read = robot.read(recordings, calibration, outside, gaps, bad_channels, **units)
    known = [
        {
            "file": path.name,
            "channels": one.n_sensors,
            "duration_ms": float(one.time[-1]),
            "source": one.source,
            "history": list(one.history),
        }
        for path, one in zip(recordings, read, strict=True)
    ]
    words = "{file}: {channels} channels, {duration_ms:g} ms, source {source}".format
    lines = [
        line for one in known for line in (words(**one), *(f"  {w}" for w in one["history"]))
    ]
    say(as_json, known, lines)
    if out is not None:
        typer.echo(f"page: {write_recordings(out, known, read)}", err=True)


@app.command()
def convert(
    recordings: Files,
    out: Annotated[
        Path,
        typer.Option(help="ending .zarr, .nc or .mat; for NWB give the .nc to feeler convert"),
    ],
    antenna: AntennaName = "robot",
    calibration: Calibration = None,
    unit: ChannelUnit = None,
    time_unit: TimeUnit = None,
    outside: Outside = "refuse",
    gaps: Gaps = "refuse",
    bad_channels: BadChannels = "refuse",
    joints: JointNames = None,
    lengths: Annotated[
        str, typer.Option(help="different durations: refuse, crop, hold")
    ] = "refuse",
) -> None:
    """Write recordings as one set of tactile tensors.

    Write recordings as one set of tactile tensors, in the same form as simulations.
    """
    from feeler.robot import make_dataset
    from feeler.tensors.formats import save

    robot, units = Robot(antenna, joints), {"unit": unit, "time_unit": time_unit}
    read = robot.read(recordings, calibration, outside, gaps, bad_channels, **units)
    dataset = make_dataset(read, robot.antenna, lengths=lengths)
    save(dataset, out)
    typer.echo(f"{dict(dataset.sizes)} saved to {out}")


@app.command()
def fit(
    recording: Annotated[Path, typer.Argument(help="CSV recording that starts at the release")],
    antenna: AntennaName = "robot",
    calibration: Calibration = None,
    unit: ChannelUnit = None,
    time_unit: TimeUnit = None,
    bad_channels: BadChannels = "refuse",
    joints: JointNames = None,
    thickness: Annotated[float | None, typer.Option(help="flexure thickness [mm]")] = None,
    length: Annotated[float | None, typer.Option(help="flexure length [mm]")] = None,
    engine: Engine = None,
    timestep: Timestep = None,
    out: Out = None,
    as_json: Json = False,
) -> None:
    """Fit stiffness and damping to a recorded release.

    Fit the stiffness and damping factors p1 and p2 to a recorded release.
    """
    from feeler.cli.robot_pages import _describe_fit, write_fit
    from feeler.robot import compare_tips, fit_factors, make_flexures

    robot, sheet = Robot(antenna, joints), list_given(thickness=thickness, length=length)
    if sheet and antenna != "robot":
        raise InvalidInput(
            "--thickness and --length belong to the paper's robot; write yours into the robot file."
        )
    units = {"unit": unit, "time_unit": time_unit}
    how = list_given(engine=engine, timestep=timestep)
    read = robot.read([recording], calibration, "refuse", "refuse", bad_channels, **units)[0]
    theory = (
        {"hinges": make_flexures(**sheet)} if antenna == "robot" else {"theory": robot.theory}
    )
    result = fit_factors(read, **theory, **how)
    if out is not None:
        typer.echo(
            f"page: {write_fit(out, read, result, compare_tips(read, result.antenna, **how))}",
            err=True,
        )
    lines = [
        f"{name:10} {ringing.frequency * 1e3:.3f} Hz damped, damping ratio"
        f" {ringing.damping_ratio:.4f}, a damped cosine explains {ringing.r_squared:.1%}"
        for name, ringing in (("recording", result.target), ("model", result.reached))
    ]
    factors = (
        f"p1 = {result.stiffness_factor:.4f}, p2 = {result.damping_factor:.4f} ms, error"
        f" {result.error:.2g}, {result.n_evaluations} evaluations (source: {read.source}; the"
        " paper's robot: 1.19, 2.06, 0.0009)"
    )
    say(as_json, _describe_fit(read, result), [*lines, factors])


@app.command()
def classify(
    recordings: Files,
    antenna: AntennaName = "robot",
    objects: Objects = None,
    locations: Numbers = None,
    speeds: Speeds = None,
    decoder: DecoderFile = None,
    calibration: Calibration = None,
    unit: ChannelUnit = None,
    time_unit: TimeUnit = None,
    outside: Outside = "refuse",
    gaps: Gaps = "bridge",
    bad_channels: BadChannels = "missing",
    joints: JointNames = None,
    robots: Annotated[
        int, typer.Option(min=3, help="surrogate robots whose touches are learned")
    ] = 24,
    engine: Engine = None,
    timestep: Timestep = None,
    workers: Workers = None,
    out: Out = None,
    as_json: Json = False,
) -> None:
    """Classify recorded touches: object, location, speed.

    Each recording's feature, location and speed with their probabilities, and whether it is like
    any touch in the training set: by the decoder of feeler robot train, or by one that is trained
    now on simulated touches of surrogate robots and kept for the next time.

    Probabilities are calibrated on robots held out; 5 % of known touches are called strange. What
    the recording's notes know of the touch is printed beside.
    """
    from feeler.robot import subtract_rest
    from feeler.robot.classify import judge_recording

    robot, units = Robot(antenna, joints), {"unit": unit, "time_unit": time_unit}
    said = {"objects": objects, "locations": locations, "speeds": speeds}
    how = list_given(engine=engine, timestep=timestep, workers=workers)
    if decoder is not None:
        robot.adopt(choose_decoder(decoder, robot, said, robots, **how), antenna != "robot")
    read = [
        subtract_rest(recording)
        for recording in robot.read(
            recordings, calibration, outside, gaps, bad_channels, **units
        )
    ]
    chosen = robot.decoder or choose_decoder(None, robot, said, robots, **how)
    judged = [
        judge_recording(chosen.classifier, one, robot.antenna, chosen.before) for one in read
    ]
    answers = [answer for answer, _ in judged]
    aligned = np.array([tensor for _, tensor in judged])
    found = [
        {"file": path.name, **answer.to_plain(), "history": list(one.history)}
        for path, one, answer in zip(recordings, read, answers, strict=True)
    ]
    lines = [
        "\n  ".join([f"{path.name}: {answer}", *filter(_TOLD.search, one.history)])
        for path, one, answer in zip(recordings, read, answers, strict=True)
    ]
    say(as_json, found, lines)
    if out is not None:
        from feeler.cli.robot_pages import write_answers

        typer.echo(f"page: {write_answers(out, found, answers, aligned)}", err=True)


@app.command()
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
    """Train a decoder of a robot's touches into one file.

    classify, stream, Python and a ROS 2 node load the file and answer at once. It holds how it was
    trained, the calibration, the channels' names, and its accuracy on robots that were left out.
    """
    from feeler.robot.decoder import train_decoder

    for file in (out, *([header] if header else [])):
        require_new(file)
    if not out.parent.is_dir():
        raise InvalidInput(f"there is no folder {out.parent}. Make it first.")
    chosen = Robot(robot, joints)
    touches = _make_touches(objects, locations, speeds, friction)
    lines = chosen.load_lines(calibration)
    with say_progress(touches, robots) as progress:
        decoder = train_decoder(
            chosen.antenna,
            touches,
            robots=robots,
            seed=seed,
            noise=noise,
            calibration=lines,
            joints=chosen.joints,
            progress=progress,
            **list_given(engine=engine, timestep=timestep, workers=workers),
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
    from feeler.robot.decoder import make_board_decoder

    header, accuracy, window = make_board_decoder(decoder)
    words = (
        f"linear, {window} ms after contact: {accuracy:.1%} held out, against"
        f" {decoder.accuracy:.1%}"
    )
    if accuracy < decoder.accuracy - 0.03:
        words = f"not written: {words}, more than 3 points less"
    else:
        write_text(path, header)
        words = f"{path}: {words}"
    return {"accuracy": accuracy, "window": window, "words": words}


for verb in (stream, board):
    app.command()(verb)
_EXAMPLES = list_examples(sys.modules[__name__])
for command in app.registered_commands:  # each shows the examples that are its own
    own = [
        line
        for line in _EXAMPLES.splitlines()
        if f"feeler robot {getattr(command.callback, '__name__', '')} " in f"{line} "
    ]
    command.epilog = "\n\n".join(["Examples:", *own])
app.info.epilog = _EXAMPLES
