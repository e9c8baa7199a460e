"""``feeler robot stream``, ``board`` and ``replay``: a robot while it touches."""

import sys
from collections import deque
from pathlib import Path
from typing import Annotated

import numpy as np
import typer

from feeler.cli.robot_options import (
    AntennaName,
    Calibration,
    Engine,
    Numbers,
    Objects,
    Out,
    Robot,
    Speeds,
    Timestep,
    Workers,
    make_touches,
    require,
    tell,
)
from feeler.cli.say import Json, require_new, say_json
from feeler.disk.files import write_text
from feeler.errors import InvalidInput, require_extra

_KEPT = 60_000  # samples that are judged as a whole: a minute at 1 kHz


def stream(
    source: Annotated[
        str,
        typer.Argument(
            help="CSV recording, - for standard input, or a serial port with --serial"
        ),
    ],
    antenna: AntennaName = "robot",
    objects: Objects = None,
    locations: Numbers = None,
    speeds: Speeds = None,
    calibration: Calibration = None,
    serial: Annotated[
        bool, typer.Option("--serial", help="source is a serial port (extra: robot)")
    ] = False,
    threshold: Annotated[
        float, typer.Option(help="posterior at which the answer counts as decided")
    ] = 0.9,
    every: Annotated[int, typer.Option(help="print every so many samples after contact")] = 50,
    engine: Engine = None,
    timestep: Timestep = None,
    workers: Workers = None,
    out: Out = None,
    as_json: Json = False,
) -> None:
    """Decode touches while they happen: one line of numbers per sample, time in ms first or left
    out. Each line says if the touch is so far unlike any that was learned; at the end it is judged
    as a whole, as by classify.
    """
    from feeler.robot import draw_lessons, load_calibration, load_recording, make_decoder
    from feeler.robot.link import Link

    if serial:
        require_extra("serial", "robot", "a serial port")
    robot, touches = Robot(antenna), make_touches(objects, locations, speeds)
    calibration = calibration or robot.calibration
    lines = None if calibration is None else load_calibration(calibration)
    how = tell(engine=engine, timestep=timestep, workers=workers)
    n = robot.antenna.sensors.size
    recording = None if serial or source == "-" else load_recording(source, **robot.channels)
    lines = _match_lines(lines, n, recording, source)
    lessons = draw_lessons(robot.antenna, touches, **how)
    decoder = make_decoder(robot.antenna, touches, threshold=threshold, **how)
    lessons.watch(decoder)
    link = Link(n)
    samples = _open_samples(recording, source, serial, n, link)
    running = decoder.start()
    kept: list[tuple] | deque[tuple] = [] if out is not None else deque(maxlen=_KEPT)
    say = say_json if as_json else _say_state
    state = _decode(running, samples, lines, every, say, kept.append)
    contact = state is not None and state.since_contact >= 0
    labels = None if recording is None else recording.labels
    answer = _judge(robot.antenna, touches, kept, labels or {}, lessons) if contact else None
    (_say_whole_json if as_json else _say_whole)(contact, running.missed, link, labels, answer)
    if out is not None and kept:
        from feeler.cli.robot_pages import write_stream

        typer.echo(f"page: {write_stream(out, decoder.classes_, list(kept))}", err=True)


def _match_lines(lines, n: int, recording, source: str):
    """The calibration by which samples become angles; None where they are angles."""
    if lines is not None and lines.n_hinges != n:
        raise InvalidInput(
            f"the calibration is for {lines.n_hinges} hinges, the antenna has {n} sensors."
        )
    if recording is None:
        return lines
    if recording.quantity == "angle":
        return None
    lines = require(lines, source, recording.quantity)
    recording.to_angles(lines, outside="extend")  # refused now where it does not fit
    return lines


def _open_samples(recording, source: str, serial: bool, n: int, link):
    """Times and values, of a recording or as they arrive."""
    from feeler.robot.samples import open_serial, read_lines, read_samples

    if recording is not None:
        return zip(recording.time, recording.values.T, strict=True)
    arriving = open_serial(source) if serial else read_lines(sys.stdin.buffer)
    return read_samples(arriving, n, link)


def _judge(antenna, touches: list, kept, labels: dict, lessons):
    """The whole touch as ``classify`` judges it; None where it was too short to be one."""
    from feeler.robot import Recording, choose_before, make_classifier, repair, subtract_rest
    from feeler.robot.answer import judge_recording

    times = [at for at, *_ in kept]
    clock = np.arange(len(kept), dtype=float) if None in times else np.array(times, dtype=float)
    values = np.array([angle for _, angle, _ in kept]).T
    try:
        felt = Recording(time=clock, values=values, labels=labels)
        felt = subtract_rest(repair(felt, gaps="bridge", bad_channels="missing"))
    except InvalidInput:  # a stream may hold what a recording must not
        return None
    classifier = make_classifier(lessons=lessons)
    return judge_recording(classifier, felt, antenna, choose_before(antenna, touches))[0]


def board(
    file: Annotated[Path, typer.Argument(help="sketch to write")] = Path("board.ino"),
    channels: Annotated[
        int, typer.Option(min=1, max=256, help="how many sensors it reads")
    ] = 8,
    rate: Annotated[int, typer.Option(min=1, max=2000, help="samples per second")] = 500,
) -> None:
    """Write an Arduino sketch that sends samples as `feeler robot stream --serial` reads them."""
    from importlib.resources import files

    require_new(file)
    text = (files("feeler.robot") / "board.ino").read_text(encoding="utf-8")
    write_text(
        file,
        text.replace("CHANNELS = 8", f"CHANNELS = {channels}").replace(
            "RATE = 500", f"RATE = {rate}"
        ),
    )
    typer.echo(f"wrote {file}; put your converter into read_channel()")


def replay(
    recording: Annotated[Path, typer.Argument(help="CSV recording")],
    antenna: AntennaName = "robot",
    speed: Annotated[float, typer.Option(min=0.01, help="times as fast as recorded")] = 1.0,
) -> None:
    """Send a recording to standard output as a board would, as fast as it was recorded: a stand-in
    for hardware.
    """
    import time

    from feeler.robot import load_recording
    from feeler.robot.link import frame_sample

    read = load_recording(recording, **Robot(antenna).channels)
    began = time.monotonic()
    for number, (at, values) in enumerate(zip(read.time, read.values.T, strict=True)):
        wait = began + (at - read.time[0]) * 1e-3 / speed - time.monotonic()
        if wait > 0:
            time.sleep(wait)
        sys.stdout.write(frame_sample(number, at, values) + "\n")
        sys.stdout.flush()


def _decode(running, samples, lines, every: int, say, keep):
    """The last state; ``say`` is given each change, and every so many samples after contact;
    ``keep`` all of them.
    """
    from feeler.robot.answer import describe_touch

    last, state = ("waiting", False), None
    for time, values in samples:
        angle = values if lines is None else lines.slope * values + lines.offset
        state = running.update(angle, time)
        keep((time, angle, state))
        if (state.state, state.strange) != last or (
            state.since_contact >= 0
            and state.since_contact % every == 0
            and state.state != "over"
        ):
            known = {
                "since_contact": state.since_contact,
                "state": state.state,
                "probability": state.probability,
                "unlike_all": state.strange,
                "strangeness": None if np.isnan(state.strangeness) else state.strangeness,
            }
            say({**known, "label": describe_touch(state.label) if state.label else None})
        last = (state.state, state.strange)
        if state.state == "over":
            break
    return state


def _say_state(known) -> None:
    from feeler.robot.answer import name_touch

    label = name_touch(tuple(known["label"].values())) if known["label"] else ""
    if known["unlike_all"]:
        label = f"so far unlike any touch I know; nearest {label}"
    typer.echo(
        f"{known['since_contact']:6d} ms  {known['state']:8} {known['probability']:5.2f}  {label}"
    )


def _say_whole_json(contact: bool, missed: int, link, labels: dict | None, answer) -> None:
    sent = {"lost": link.lost, "late": link.late, "broken": link.broken, "truth": labels}
    whole = None if answer is None else answer.to_plain()
    say_json({"contact": contact, "missing": missed, **sent, "whole": whole})


def _say_whole(contact: bool, missed: int, link, labels: dict | None, answer) -> None:
    from feeler.robot.answer import name_notes

    if answer is not None:
        typer.echo(f"as a whole: {answer}")
    _say_end(contact, missed, link.describe(), name_notes(labels or {}))


def _say_end(contact: bool, missed: int, wrong: str, noted: str) -> None:
    if not contact:
        typer.echo("no contact")
    elif missed:
        typer.echo(f"{missed} samples were missing")
    if wrong:
        typer.echo(f"of the board's samples: {wrong}")
    if noted:
        typer.echo(noted)
