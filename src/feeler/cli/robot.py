"""``feeler robot``: calibrate, check, convert, fit, classify and stream the recordings of a robotic antenna."""

import json
import sys
from pathlib import Path
from typing import Annotated

import typer

from feeler.cli.robot_options import Robot, make_touches, require, tell

EXAMPLES = """Examples:

  feeler robot example .

  feeler robot calibrate surrogate_calibration_table.csv --out calibration.json

  feeler robot classify surrogate_ball_tip_fast.csv --calibration calibration.json

  feeler robot stream surrogate_ball_tip_fast.csv --calibration calibration.json

  feeler robot fit surrogate_release.csv

A board of your own (feeler robot board writes an Arduino sketch), or a recording in its stead, as fast as it was recorded:

  feeler robot stream /dev/ttyUSB0 --serial --calibration calibration.json

  feeler robot replay surrogate_ball_tip_fast.csv | feeler robot stream - --calibration calibration.json

Your own robot and objects (an objects file holds tables such as [[object]] name = "bolt", shape = "ball", radius = 3):

  feeler robot new robot.toml --hinges 12

  feeler robot classify touch1.csv touch2.csv --antenna robot.toml --objects objects.toml --speeds 0.1,0.3 --out out/touches

  feeler robot gap --antenna robot.toml --objects objects.toml --speeds 0.3 --robots 5 --out out/gap
"""

app = typer.Typer(help="Recordings of a robotic antenna: describe it, calibrate, check, convert, fit, classify, stream.",
                  epilog=EXAMPLES, no_args_is_help=True)  # fmt: skip

Files = Annotated[list[Path], typer.Argument(help="CSV recordings: time_ms, hinge1_pF, hinge2_pF … (or _deg, _rad)")]
Calibration = Annotated[Path | None, typer.Option(help="sensor calibration (JSON), for capacitance")]
AntennaName = Annotated[str, typer.Option("--antenna", help="robot file (feeler robot new), antenna TOML, or preset")]
Objects = Annotated[Path | None, typer.Option(help="TOML with a table [[object]] each; default: ball and box of 4 mm")]
Numbers = Annotated[str | None, typer.Option(help="of the touches to tell apart: 0.5,0.9 (fractions of the length)")]
Speeds = Annotated[str | None, typer.Option(help="of the touches to tell apart [m/s]: 0.027,0.27")]
Json = Annotated[bool, typer.Option("--json", help="print JSON in place of words")]
Out = Annotated[Path | None, typer.Option(help="folder for a page (HTML), its figure and its numbers (JSON)")]
Outside = Annotated[str, typer.Option(help="readings out of the calibrated range: refuse, clip, missing, extend")]
Engine = Annotated[str | None, typer.Option(help="of the simulated touches: chain-consistent, chain or mujoco")]
Timestep = Annotated[float | None, typer.Option(help="of the simulated touches [ms]; default: the engine's own")]
Workers = Annotated[int | None, typer.Option(help="threads; default one per core")]
Gaps = Annotated[str, typer.Option(help="gaps over 10 ms: refuse, bridge, keep")]


@app.command()
def example(folder: Annotated[Path, typer.Argument(help="where to put them")] = Path()) -> None:
    """Copy the example files (made by a surrogate robot) to a folder."""
    from feeler.robot.examples import EXAMPLES, get_example

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
    """Write a commented robot file to be edited and given to --antenna."""
    from feeler.robot import write_robot

    write_robot(file, hinges)
    typer.echo(f"wrote {file}; edit its numbers, then give it to --antenna")


@app.command()
def calibrate(
    table: Annotated[Path, typer.Argument(help="CSV: hinge, angle_deg, capacitance_pF, optionally time_ms")],
    out: Annotated[Path, typer.Option(help="where to save the calibration")] = Path("calibration.json"),
    as_json: Json = False,
) -> None:
    """Fit capacitance to angle, one line per hinge, and say how good it is."""
    from feeler.report.section import to_json
    from feeler.robot import load_calibration_table, save_calibration

    calibration = load_calibration_table(table)
    save_calibration(calibration, out)
    if as_json:
        typer.echo(json.dumps(to_json(vars(calibration))))
        return
    typer.echo(calibration.report())
    typer.echo(f"saved to {out}" + (f", robot {calibration.robot}" if calibration.robot else ""))


@app.command()
def check(
    recordings: Files,
    antenna: AntennaName = "robot",
    calibration: Calibration = None,
    outside: Outside = "refuse",
    gaps: Gaps = "refuse",
    as_json: Json = False,
) -> None:
    """Say what a recording holds, what is wrong with it and what would be mended."""
    read = Robot(antenna).read(recordings, calibration, outside, gaps)
    if as_json:
        known = [(one.n_sensors, float(one.time[-1]), one.source, list(one.history)) for one in read]
        names = ("channels", "duration_ms", "source", "history")
        rows = [
            {"file": p.name, **dict(zip(names, row, strict=True))} for p, row in zip(recordings, known, strict=True)
        ]
        typer.echo(json.dumps(rows))
        return
    for path, recording in zip(recordings, read, strict=True):
        typer.echo(f"{path.name}: {recording.n_sensors} channels, {recording.time[-1]:g} ms, source {recording.source}")
        for line in recording.history:
            typer.echo(f"  {line}")


@app.command()
def convert(
    recordings: Files,
    out: Annotated[Path, typer.Option(help="ending .zarr, .nc or .mat; for NWB give the .nc to feeler convert")],
    antenna: AntennaName = "robot",
    calibration: Calibration = None,
    outside: Outside = "refuse",
    gaps: Gaps = "refuse",
    lengths: Annotated[str, typer.Option(help="different durations: refuse, crop, hold")] = "refuse",
) -> None:
    """Write recordings as one set of tactile tensors, in the same form as simulations."""
    from feeler.robot import make_dataset
    from feeler.tensors.formats import save

    robot = Robot(antenna)
    dataset = make_dataset(robot.read(recordings, calibration, outside, gaps), robot.antenna, lengths=lengths)
    save(dataset, out)
    typer.echo(f"{dict(dataset.sizes)} saved to {out}")


@app.command()
def fit(
    recording: Annotated[Path, typer.Argument(help="CSV recording that starts at the release")],
    antenna: AntennaName = "robot",
    calibration: Calibration = None,
    thickness: Annotated[float | None, typer.Option(help="flexure thickness [mm]")] = None,
    length: Annotated[float | None, typer.Option(help="flexure length [mm]")] = None,
    method: Annotated[str, typer.Option(help="update (fast) or powell (the paper's)")] = "update",
    engine: Engine = None,
    timestep: Timestep = None,
    as_json: Json = False,
) -> None:
    """Fit the stiffness and damping factors p1 and p2 to a recorded release."""
    from feeler.errors import InvalidInput
    from feeler.robot import fit_factors, make_flexures

    robot, sheet = Robot(antenna), tell(thickness=thickness, length=length)
    if sheet and antenna != "robot":
        raise InvalidInput("--thickness and --length belong to the paper's robot; write yours into the robot file.")
    read = robot.read([recording], calibration, "refuse", "refuse")[0]
    result = fit_factors(
        read,
        **({"hinges": make_flexures(**sheet)} if antenna == "robot" else {"theory": robot.theory}),
        method=method,
        **tell(engine=engine, timestep=timestep),
    )
    if as_json:
        factors = {name: getattr(result, name) for name in ("stiffness_factor", "damping_factor", "error")}
        rings = {"recording": vars(result.target), "model": vars(result.reached)}
        typer.echo(json.dumps({**factors, **rings, "source": read.source}))
        return
    for name, ringing in (("recording", result.target), ("model", result.reached)):
        typer.echo(
            f"{name:10} {ringing.frequency * 1e3:.3f} Hz damped, damping ratio {ringing.damping_ratio:.4f}, "
            f"a damped cosine explains {ringing.r_squared:.1%}"
        )
    typer.echo(
        f"p1 = {result.stiffness_factor:.4f}, p2 = {result.damping_factor:.4f} ms, error {result.error:.2g}, "
        f"{result.n_evaluations} evaluations (source: {read.source}; the paper's robot: 1.19, 2.06, 0.0009)"
    )


@app.command()
def classify(
    recordings: Files,
    antenna: AntennaName = "robot",
    objects: Objects = None,
    locations: Numbers = None,
    speeds: Speeds = None,
    calibration: Calibration = None,
    outside: Outside = "refuse",
    gaps: Gaps = "bridge",
    robots: Annotated[int, typer.Option(min=0, help="surrogate robots, sensors and all, that join the training")] = 0,
    engine: Engine = None,
    timestep: Timestep = None,
    workers: Workers = None,
    out: Out = None,
    as_json: Json = False,
) -> None:
    """Train on simulated touches, then name feature, location and speed of each recording, and how likely they are.

    Probabilities are tempered on surrogate robots; what the recording's notes know of the touch is printed beside.
    """
    from feeler.robot import align_recordings, choose_before, make_classifier, subtract_rest
    from feeler.robot.answer import judge_touch

    robot, touches = Robot(antenna), make_touches(objects, locations, speeds)
    read = [subtract_rest(recording) for recording in robot.read(recordings, calibration, outside, gaps)]
    how = tell(engine=engine, timestep=timestep, workers=workers)
    classifier = make_classifier(robot.antenna, touches, robots=robots, **how)
    aligned = align_recordings(read, robot.antenna, before=choose_before(robot.antenna, touches)).values
    answers = [judge_touch(classifier, values, one.labels) for values, one in zip(aligned, read, strict=True)]
    found = [{"file": path.name, **answer.to_plain()} for path, answer in zip(recordings, answers, strict=True)]
    if as_json:
        typer.echo(json.dumps(found))
    for path, answer in [] if as_json else zip(recordings, answers, strict=True):
        typer.echo(f"{path.name}: {answer}")
    if out is not None:
        from feeler.cli.robot_pages import write_answers

        typer.echo(f"page: {write_answers(out, found, answers, aligned)}", err=True)


@app.command()
def gap(
    antenna: AntennaName = "robot",
    objects: Objects = None,
    locations: Numbers = None,
    speeds: Speeds = None,
    robots: Annotated[int, typer.Option(min=1, help="surrogate robots per part")] = 10,
    seed: Annotated[int, typer.Option(min=0, help="seed of the robots")] = 0,
    out: Out = None,
    as_json: Json = False,
) -> None:
    """Say which part of the gap between simulation and robot costs what: noise, drift, gain, hysteresis, play and others.

    Surrogate robots differ from your antenna's model in one way only, at full size, and are read by a classifier that knows
    the model alone. The sizes are choices (feeler.robot.Gap), none was measured on your robot.
    """
    from feeler.cli.progress import ProgressBar
    from feeler.robot import measure_parts

    own = objects or locations or speeds or antenna != "robot"
    touches = make_touches(objects, locations, speeds) if own else None
    with ProgressBar("parts of the gap") as progress:
        scores = measure_parts(Robot(antenna).antenna, touches, n_robots=robots, seed=seed, progress=progress)
    found = {name: {what: score.share(what) for what in score.correct} for name, score in scores.items()}
    contacts = next(iter(scores.values())).total
    if as_json:
        typer.echo(json.dumps({"contacts": contacts, "robots": robots, "seed": seed, "shares": found}))
    for name, shares in [] if as_json else found.items():
        value, low, high = shares["all"]
        typer.echo(f"{name:20} {value:5.0%} read right ({low:.0%} to {high:.0%}); feature {shares['feature'][0]:.0%}")
    if out is not None:
        from feeler.cli.robot_pages import write_gap

        typer.echo(f"page: {write_gap(out, found, contacts)}", err=True)


@app.command()
def stream(
    source: Annotated[str, typer.Argument(help="CSV recording, - for standard input, or a serial port with --serial")],
    antenna: AntennaName = "robot",
    objects: Objects = None,
    locations: Numbers = None,
    speeds: Speeds = None,
    calibration: Calibration = None,
    serial: Annotated[bool, typer.Option("--serial", help="source is a serial port (extra: robot)")] = False,
    threshold: Annotated[float, typer.Option(help="posterior at which the answer counts as decided")] = 0.9,
    every: Annotated[int, typer.Option(help="print every so many samples after contact")] = 50,
    engine: Engine = None,
    timestep: Timestep = None,
    workers: Workers = None,
) -> None:
    """Decode touches while they happen: one line of numbers per sample, time in ms first or left out."""
    from feeler.decoding.link import Link
    from feeler.decoding.samples import open_serial, read_lines, read_samples
    from feeler.errors import InvalidInput
    from feeler.robot import load_calibration, load_recording, make_decoder
    from feeler.robot.answer import name_notes

    robot, touches = Robot(antenna), make_touches(objects, locations, speeds)
    calibration = calibration or robot.calibration
    lines = None if calibration is None else load_calibration(calibration)
    how = tell(engine=engine, timestep=timestep, workers=workers)
    n = robot.antenna.sensors.size
    recording = None if serial or source == "-" else load_recording(source, n_channels=n)
    if lines is not None and lines.n_hinges != n:
        raise InvalidInput(f"the calibration is for {lines.n_hinges} hinges, the antenna has {n} sensors.")
    decoder = make_decoder(robot.antenna, touches, threshold=threshold, **how)
    if recording is None:
        link = Link(decoder.n_sensors_)
        arriving = open_serial(source) if serial else read_lines(sys.stdin.buffer)
        samples = read_samples(arriving, decoder.n_sensors_, link)
    else:
        samples = zip(recording.time, recording.values.T, strict=True)
        if recording.quantity == "angle":
            lines = None
        else:
            require(lines, source)
    _decode(decoder.start(), samples, lines, every)
    if recording is None and (wrong := link.describe()):
        typer.echo(f"of the board's samples: {wrong}")
    if recording is not None and (noted := name_notes(recording.labels)):
        typer.echo(noted)


@app.command()
def board(
    file: Annotated[Path, typer.Argument(help="sketch to write")] = Path("board.ino"),
    channels: Annotated[int, typer.Option(min=1, max=256, help="how many sensors it reads")] = 8,
    rate: Annotated[int, typer.Option(min=1, max=2000, help="samples per second")] = 500,
) -> None:
    """Write an Arduino sketch that sends samples as `feeler robot stream --serial` reads them."""
    from importlib.resources import files

    from feeler.errors import InvalidInput

    if file.exists():
        raise InvalidInput(f"{file} exists already. Choose another name.")
    text = (files("feeler.robot") / "board.ino").read_text(encoding="utf-8")
    file.write_text(text.replace("CHANNELS = 8", f"CHANNELS = {channels}").replace("RATE = 500", f"RATE = {rate}"))
    typer.echo(f"wrote {file}; put your converter into read_channel()")


@app.command()
def replay(
    recording: Annotated[Path, typer.Argument(help="CSV recording")],
    antenna: AntennaName = "robot",
    speed: Annotated[float, typer.Option(min=0.01, help="times as fast as recorded")] = 1.0,
) -> None:
    """Send a recording to standard output as a board would, as fast as it was recorded: a stand-in for hardware."""
    import time

    from feeler.decoding.link import frame_sample
    from feeler.robot import load_recording

    read = load_recording(recording, n_channels=Robot(antenna).antenna.sensors.size)
    began = time.monotonic()
    for number, (at, values) in enumerate(zip(read.time, read.values.T, strict=True)):
        wait = began + (at - read.time[0]) * 1e-3 / speed - time.monotonic()
        if wait > 0:
            time.sleep(wait)
        sys.stdout.write(frame_sample(number, at, values) + "\n")
        sys.stdout.flush()


def _decode(running, samples, lines, every: int) -> None:
    from feeler.robot.answer import name_touch

    last, state = "waiting", None
    for time, values in samples:
        angle = values if lines is None else lines.slope * values + lines.offset
        state = running.update(angle, time)
        changed = state.state != last
        if changed or (state.since_contact >= 0 and state.since_contact % every == 0 and state.state != "over"):
            label = name_touch(state.label) if state.label else ""
            typer.echo(f"{state.since_contact:6d} ms  {state.state:8} {state.probability:5.2f}  {label}")
        last = state.state
        if state.state == "over":
            break
    if state is None or state.since_contact < 0:
        typer.echo("no contact")
    elif running.missed:
        typer.echo(f"{running.missed} samples were missing")


def register(parent: typer.Typer) -> None:
    """Add ``robot`` with its commands to the command line."""
    parent.add_typer(app, name="robot")
