"""``feeler robot stream`` and ``board``: a robot while it touches."""

import gc
import os
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from queue import Queue
from threading import Thread
from typing import Annotated, Any, BinaryIO

import numpy as np
import typer

from feeler.cli.options import Json, require_new, say, say_json
from feeler.cli.robot_options import (
    AntennaName,
    Calibration,
    ChannelUnit,
    DecoderFile,
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
    choose_decoder,
    list_given,
    split_numbers,
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
    decoder: DecoderFile = None,
    missing: Annotated[
        str | None, typer.Option(help="sensors that give no usable value, such as 4,7")
    ] = None,
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
    timeout: Annotated[
        float,
        typer.Option(
            min=0.0,
            help="seconds without a line, or without the board, after which listening ends; 0:"
            " never",
        ),
    ] = 0.0,
    repeat: Annotated[
        bool, typer.Option("--repeat", help="go on with the next touch, until Ctrl-C")
    ] = False,
    threshold: Annotated[
        float,
        typer.Option(min=0.0, max=1.0, help="posterior at which the answer counts as decided"),
    ] = 0.9,
    every: Annotated[
        int, typer.Option(min=1, help="print every so many ms after contact")
    ] = 50,
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

    With --decoder it answers at once; without, a decoder is trained first and kept for the next
    time. What arrives meanwhile waits. A board that is unplugged is waited for (--timeout). Ctrl-C
    ends it with the summary.
    """
    from feeler.robot.decoder import Readings
    from feeler.robot.stream import Link

    if serial:
        require_extra("serial", "robot", "a serial port")
    robot, gone = Robot(antenna), split_numbers("--missing", missing, int) or ()
    said = {"objects": objects, "locations": locations, "speeds": speeds}
    how = list_given(engine=engine, timestep=timestep, workers=workers)
    if decoder is not None:
        robot.adopt(choose_decoder(decoder, robot, said, **how), antenna != "robot")
    lines = robot.load_lines(calibration)
    n = robot.antenna.sensors.size
    link, labels, readings = Link(n), {}, None
    if serial or source == "-":
        readings = Readings(lines, unit, outside, gone)
        samples = _listen(source, serial, baud, timeout, link, n, time_unit)
    else:
        units = {"unit": unit, "time_unit": time_unit}
        recording = robot.load(source, lines, outside, "missing", **units)
        labels = recording.labels
        samples = zip(recording.time, recording.values.T, strict=True)
    chosen = robot.decoder or choose_decoder(None, robot, said, **how)
    chosen.stream.threshold = threshold
    touch = chosen.start(missing=gone, labels=labels)
    if readings is not None:
        where = f" at {source}, {baud} baud" if serial else ""
        typer.echo(
            f"listening{where}: {n} numbers a line, in {readings.unit} (--unit), times in"
            f" {time_unit or 'ms'} (--time-unit)",
            err=True,
        )
    watch = _Watch(samples, link, readings)
    gc.freeze()  # a search through all that is loaded would hold the samples up for 100 ms
    again = True
    while again:
        state, end = _decode(touch, watch, every, say_json if as_json else _say_state)
        again = repeat and end is None and state is not None and state.state == "over"
        if not watch.samples and not isinstance(end, typer.Exit):
            waited = f" in {timeout:g} s" if serial else ""
            raise InvalidInput(
                f"no sample came from {source}{waited}. Is the board sending, and is this its port?"
                if serial
                else f"{'standard input' if source == '-' else source} held no sample."
            )
        contact = state is not None and state.since_contact >= 0
        say(as_json, *_describe_whole(contact, touch, watch, labels))
        if out is not None and touch.kept:
            from feeler.cli.robot_pages import write_stream

            page = write_stream(out, chosen.stream.classes_, list(touch.kept))
            typer.echo(f"page: {page}", err=True)
        if end is not None:
            raise end
        if again:
            touch.begin()


class _Watch:
    """Samples as they come, counted: how many, and how many in a second.

    Attributes
    ----------
    samples : int
        How many came.
    link, readings
        What counts the lines that were no samples, and readings that are not possible.
    """

    def __init__(self, samples: Any, link: Any, readings: Any) -> None:
        self._from, self.link, self.readings = iter(samples), link, readings
        self.samples, self._began, self._span = 0, time.monotonic(), 0.0
        self._first: float | None = None

    def __iter__(self) -> Iterator[tuple[float | None, np.ndarray]]:
        for at, values in self._from:
            at_here = 1e3 * (time.monotonic() - self._began) if at is None else at
            if self._first is None:
                self._first = at_here
                if at is None:
                    typer.echo("lines hold no time: each is taken as 1 ms", err=True)
            self._span = max(self._span, at_here - self._first)
            self.samples += 1
            yield at, values

    @property
    def rate(self) -> float:
        """Samples per second; 0 where there are too few."""
        return 1e3 * (self.samples - 1) / self._span if self._span > 0 else 0.0

    def count(self) -> dict[str, int]:
        """What of the lines so far was no sample, or no possible one."""
        outside = 0 if self.readings is None else self.readings.outside
        names = ("lost", "late", "broken", "restarts")
        return {name: getattr(self.link, name) for name in names} | {"outside": outside}


def _listen(
    source: str, serial: bool, baud: int, timeout: float, link, n: int, time_unit: str | None
):
    """Times and values as they arrive; what arrives before they are asked for waits."""
    from feeler.cli.app import put_in_shell
    from feeler.robot.recordings import find_time_factor
    from feeler.robot.stream import open_serial, read_lines, read_samples

    factor = find_time_factor(time_unit or "ms")
    arriving = (
        open_serial(source, baud, timeout, reconnect=True)
        if serial
        else read_lines(_open_input())
    )
    waiting: Queue = Queue(maxsize=_WAITING)
    over = object()

    def read() -> None:
        try:
            for line in arriving:
                waiting.put(line)
            waiting.put(over)
        except Exception as error:
            waiting.put(error)

    Thread(target=read, daemon=True).start()

    def give() -> Iterator[bytes | None]:
        due = 1
        while (line := waiting.get()) is not over:
            if isinstance(line, Exception):
                raise line
            if line is None:
                typer.echo(f"connected to {source} anew; a new touch begins", err=True)
            yield line
            if link.broken >= due:
                said = f"{link.broken} broken lines so far; {link.fault}"
                typer.echo(put_in_shell(said), err=True)
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


def _decode(touch, watch, every: int, say) -> tuple[Any, Exception | None]:
    """The last state of a touch, and the error or interruption that ended it; what came before is
    summed up all the same. ``say`` is given each change, and one every so many ms after contact.

    A board that begins anew begins a new touch.
    """
    link, readings = watch.link, watch.readings
    last, state, due, restarts = ("waiting", False), None, 0, link.restarts
    said = None

    def tell(state) -> None:
        nonlocal last, due, said
        last, said = (state.state, state.strange), state
        due = state.since_contact // every * every + every
        say({**_describe_state(state), **watch.count()})

    try:
        for at, values in watch:
            if link.restarts > restarts:
                restarts, last, due = link.restarts, ("waiting", False), 0
                touch.begin()
            state = touch.update(values if readings is None else readings.convert(values), at)
            changed = (state.state, state.strange) != last
            if changed or (0 <= due <= state.since_contact and state.state != "over"):
                tell(state)
            if state.state == "over":
                break
    except KeyboardInterrupt:
        return touch.end(), typer.Exit(130)
    except InvalidInput as error:
        if not touch.kept:
            raise
        return touch.end(), error
    state = touch.end()
    untouched = state is None or state.since_contact < 0
    if untouched and link.broken > max(watch.samples, 1):
        raise InvalidInput(
            f"{link.broken} of {link.broken + watch.samples} lines are no samples; of the latest:"
            f" {link.fault} Is this the antenna whose sensors the board has, and its baud rate?"
        )
    if state is not None and state.since_contact >= 0 and said is not None:
        before, now = _describe_state(said), _describe_state(state)
        if before["label"] != now["label"] or before["probability"] != now["probability"]:
            tell(state)
    return state, None


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


def _describe_whole(
    contact: bool, touch, watch, labels: dict | None
) -> tuple[dict[str, Any], list[str]]:
    """What came and what it was taken for, as numbers and in words."""
    from feeler.robot.classify import name_notes

    answer, missed, readings = touch.answer, touch.stream.missed, watch.readings
    plain = {"contact": contact, "missing": missed, **watch.count(), "samples": watch.samples}
    plain |= {"rate_hz": watch.rate, "unit": readings and readings.unit, "truth": labels}
    plain["whole"] = None if answer is None else answer.to_plain()
    short = "as a whole: not judged; it was too short, or held too few samples"
    rate = f" at {watch.rate:.4g} per second" if watch.rate else ""
    lines = [
        f"as a whole: {answer}" if answer else short if contact else "no contact",
        f"{watch.samples} samples{rate}" + (f", {missed} missing" if missed else ""),
    ]
    if wrong := watch.link.describe():
        lines.append(f"of the lines that came: {wrong}")
    if noted := name_notes(labels or {}):
        lines.append(noted)
    if readings is not None and readings.outside:
        lines.append(f"{readings.outside} samples held readings {readings.fate}")
    return plain, lines
