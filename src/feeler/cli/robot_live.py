"""``feeler robot stream``, ``board`` and ``replay``: a robot while it touches."""

import os
import sys
from collections.abc import Iterator
from pathlib import Path
from queue import Queue
from threading import Thread
from typing import Annotated, Any, BinaryIO

import numpy as np
import typer

from feeler.cli.options import Json, require_new, say_json
from feeler.cli.robot_options import (
    AntennaName,
    Calibration,
    ChannelUnit,
    Engine,
    Numbers,
    Objects,
    Out,
    Outside,
    Robot,
    Speeds,
    Timestep,
    TimeUnit,
    Workers,
    make_touches,
    require,
    tell,
)
from feeler.errors import InvalidInput, require_extra
from feeler.files import write_text

_WAITING = 10**6  # [C] lines that wait while touches are simulated
_WRONG = "broken", "outside", "restarts"


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
    unit: ChannelUnit = None,
    time_unit: TimeUnit = None,
    outside: Outside = "refuse",
    serial: Annotated[
        bool, typer.Option("--serial", help="source is a serial port (extra: robot)")
    ] = False,
    baud: Annotated[
        int, typer.Option(min=1, help="characters of a serial port: bits per second")
    ] = 115_200,
    threshold: Annotated[
        float, typer.Option(help="posterior at which the answer counts as decided")
    ] = 0.9,
    every: Annotated[int, typer.Option(help="print every so many ms after contact")] = 50,
    engine: Engine = None,
    timestep: Timestep = None,
    workers: Workers = None,
    out: Out = None,
    as_json: Json = False,
) -> None:
    """Classify a touch while it happens.

    Classify a touch while it happens: one line of numbers per sample, time in ms first or left
    out. A line that is no sample is skipped and counted. Each answer says if the touch is so
    far unlike any that was trained; from 400 ms after its peak on it is the answer of classify.
    """
    from feeler.robot import (
        choose_before,
        draw_training_set,
        load_calibration,
        load_recording,
        make_classifier,
        make_decoder,
    )
    from feeler.robot.live import LiveTouch, Readings
    from feeler.robot.stream import Link

    if serial:
        require_extra("serial", "robot", "a serial port")
    robot, touches = Robot(antenna), make_touches(objects, locations, speeds)
    calibration = calibration or robot.calibration
    lines = None if calibration is None else load_calibration(calibration)
    how = tell(engine=engine, timestep=timestep, workers=workers)
    n = robot.antenna.sensors.size
    if lines is not None and lines.n_hinges != n:
        raise InvalidInput(
            f"the calibration is for {lines.n_hinges} hinges, the antenna has {n} sensors."
        )
    link, labels, readings = Link(n), {}, None
    if serial or source == "-":
        readings = Readings(lines, unit, outside)
        samples = _listen(source, serial, baud, link, n, time_unit)
    else:
        recording = load_recording(source, **robot.channels, unit=unit, time_unit=time_unit)
        if recording.quantity != "angle":
            lines = require(lines, source, recording.quantity)
            recording = recording.to_angles(lines, outside=outside)
        labels = recording.labels
        samples = zip(recording.time, recording.values.T, strict=True)
    typer.echo("training on simulated touches of surrogate robots", err=True)
    lessons = draw_training_set(robot.antenna, touches, **how)
    decoder = make_decoder(robot.antenna, touches, threshold=threshold, **how)
    lessons.watch(decoder)
    classifier = make_classifier(lessons=lessons)
    before = choose_before(robot.antenna, touches)
    touch = LiveTouch(decoder, classifier, robot.antenna, before, labels)
    if readings is not None:
        named = "" if unit else ", unless --unit says otherwise"
        typer.echo(f"listening: {n} numbers a line, in {readings.unit}{named}", err=True)
    say = say_json if as_json else _say_state
    state = _decode(touch, samples, readings, every, say, link)
    contact = state is not None and state.since_contact >= 0
    counts = touch.stream.missed, link, readings
    (_say_whole_json if as_json else _say_whole)(contact, *counts, labels, touch.answer)
    if out is not None and touch.kept:
        from feeler.cli.robot_pages import write_stream

        typer.echo(
            f"page: {write_stream(out, list(decoder.classes_), list(touch.kept))}", err=True
        )


def _listen(source: str, serial: bool, baud: int, link, n: int, time_unit: str | None):
    """Times and values as they arrive; what arrives before they are asked for waits."""
    from feeler.robot.recordings import find_time_factor
    from feeler.robot.stream import open_serial, read_lines, read_samples

    factor = find_time_factor(time_unit or "ms")
    arriving = open_serial(source, baud) if serial else read_lines(_open_input())
    waiting: Queue = Queue(maxsize=_WAITING)

    def read() -> None:
        try:
            for line in arriving:
                waiting.put(line)
            waiting.put(None)
        except Exception as error:
            waiting.put(error)

    Thread(target=read, daemon=True).start()

    def give() -> Iterator[bytes]:
        due = 1
        while (line := waiting.get()) is not None:
            if isinstance(line, Exception):
                raise line
            yield line
            if link.broken >= due:
                typer.echo(f"{link.broken} broken lines so far; {link.fault}", err=True)
                due = 10 * due

    return read_samples(give(), n, link, factor)


def _open_input() -> BinaryIO:
    """Standard input under a number of its own: a thread that still reads it when the command ends
    holds no lock that Python's end waits for.
    """
    try:
        return os.fdopen(os.dup(sys.stdin.fileno()), "rb")
    except (OSError, ValueError):  # no file of the system, as in tests
        return sys.stdin.buffer


def board(
    file: Annotated[Path, typer.Argument(help="sketch to write")] = Path("board.ino"),
    channels: Annotated[
        int, typer.Option(min=1, max=256, help="how many sensors it reads")
    ] = 8,
    rate: Annotated[int, typer.Option(min=1, max=2000, help="samples per second")] = 500,
) -> None:
    """Write an Arduino sketch that sends samples.

    Write an Arduino sketch that sends samples as `feeler robot stream --serial` reads them.
    """
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
    """Send a recording to standard output as a board would.

    Send a recording to standard output as a board would, as fast as it was recorded: a stand-in
    for hardware.
    """
    import time

    from feeler.robot import load_recording
    from feeler.robot.stream import frame_sample

    read = load_recording(recording, **Robot(antenna).channels)
    began = time.monotonic()
    for number, (at, values) in enumerate(zip(read.time, read.values.T, strict=True)):
        wait = began + (at - read.time[0]) * 1e-3 / speed - time.monotonic()
        if wait > 0:
            time.sleep(wait)
        sys.stdout.write(frame_sample(number, at, values) + "\n")
        sys.stdout.flush()


def _decode(touch, samples, readings, every: int, say, link):
    """The last state; ``say`` is given each change, and one every so many ms after contact.

    A board that begins anew begins a new touch.
    """
    last, state, due, restarts = ("waiting", False), None, 0, link.restarts
    said = None

    def tell(state) -> None:
        nonlocal last, due, said
        last, said = (state.state, state.strange), state
        due = state.since_contact // every * every + every
        say({**_describe_state(state), **_count(link, readings)})

    for time, values in samples:
        if link.restarts > restarts:
            restarts, last, due = link.restarts, ("waiting", False), 0
            touch.begin()
        state = touch.update(values if readings is None else readings.convert(values), time)
        changed = (state.state, state.strange) != last
        if changed or (0 <= due <= state.since_contact and state.state != "over"):
            tell(state)
        if state.state == "over":
            break
    if state is None and link.fault:
        raise InvalidInput(
            f"none of {link.broken} lines is a sample; of the latest: {link.fault} Is this the"
            " antenna whose sensors the board has, and its baud rate?"
        )
    state = touch.end()
    if state is not None and state.since_contact >= 0 and said is not None:
        before, now = _describe_state(said), _describe_state(state)
        if before["label"] != now["label"] or before["probability"] != now["probability"]:
            tell(state)
    return state


def _describe_state(state) -> dict[str, Any]:
    from feeler.robot.classify import describe_touch

    return {
        "since_contact": state.since_contact,
        "state": state.state,
        "probability": state.probability,
        "unlike_all": state.strange,
        "strangeness": None if np.isnan(state.strangeness) else state.strangeness,
        "mirrored": state.mirrored,
        "label": describe_touch(state.label) if state.label else None,
    }


def _count(link, readings) -> dict[str, int]:
    """What of the lines so far was no sample, or no possible one."""
    outside = 0 if readings is None else readings.outside
    return {
        "lost": link.lost,
        "late": link.late,
        "broken": link.broken,
        "restarts": link.restarts,
        "outside": outside,
    }


def _say_state(known) -> None:
    from feeler.robot.classify import name_touch

    label = name_touch(tuple(known["label"].values())) if known["label"] else ""
    if known["unlike_all"]:
        label = f"so far unlike any touch I know; nearest {label}"
    wrong = ", ".join(f"{known[name]} {name}" for name in _WRONG if known.get(name))
    typer.echo(
        f"{known['since_contact']:6d} ms  {known['state']:8} {known['probability']:5.2f}  {label}"
        + (f"  ({wrong})" if wrong else "")
    )


def _say_whole_json(
    contact: bool, missed: int, link, readings, labels: dict | None, answer
) -> None:
    unit = None if readings is None else readings.unit
    sent = {**_count(link, readings), "unit": unit, "truth": labels}
    whole = None if answer is None else answer.to_plain()
    say_json({"contact": contact, "missing": missed, **sent, "whole": whole})


def _say_whole(contact: bool, missed: int, link, readings, labels: dict | None, answer) -> None:
    from feeler.robot.classify import name_notes

    if answer is not None:
        typer.echo(f"as a whole: {answer}")
    elif contact:
        typer.echo("as a whole: not judged; it was too short, or held too few samples")
    _say_end(contact, missed, link.describe(), name_notes(labels or {}))
    if readings is not None and readings.outside:
        typer.echo(f"{readings.outside} samples held readings {readings.fate}")


def _say_end(contact: bool, missed: int, wrong: str, noted: str) -> None:
    if not contact:
        typer.echo("no contact")
    elif missed:
        typer.echo(f"{missed} samples were missing")
    if wrong:
        typer.echo(f"of the lines that came: {wrong}")
    if noted:
        typer.echo(noted)
