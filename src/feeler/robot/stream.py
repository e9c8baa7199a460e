"""Samples of a board as lines of text, framed or plain, from a file, standard input or a serial
port.
"""

import contextlib
import re
import time
from collections.abc import Iterable, Iterator, Sequence
from functools import reduce
from operator import xor
from typing import Any, BinaryIO

import numpy as np

from feeler.errors import InvalidInput, require_extra

# The lines that a board sends: numbered, timed and summed, so that every fault is noticed.
#
#     $12,1034.250,4.73,4.71,nan*7F
#
# After the dollar: a number that rises by one and wraps at 65536, the board's time [ms], one
# value per sensor; after the asterisk the exclusive or of all bytes between the two, as two
# hexadecimal digits (as NMEA 0183 has it).

WRAP = 65536
CLOCK = (
    2**32 / 1000
)  # ms after which a board's clock of microseconds in 32 bits begins anew (71.6 minutes)
_MAX_HOLE = 2000  # [C] samples in a row; a longer hole is a board that began anew
_MAX_LATE = 50  # [C] late samples in a row; more come from a board that began anew
_MAX_PAUSE = (
    2000.0  # [C] ms from one plain line to the next; a longer one needs a second witness
)
MAX_NUMBER = 1e15  # [C] of any reading or time [ms]; squares of it are still finite
_LAYOUT = (
    "it is laid out otherwise than the lines around it (with a time, without, or from `$` on)."
)


def unwrap_clock(time: np.ndarray) -> np.ndarray:
    """Times (sample,) [ms] that go on where a board's clock began anew.

    Times that fall by less than half of its range stay.
    """
    return time + CLOCK * np.cumsum(np.diff(time, prepend=time[:1]) < -CLOCK / 2)


class Link:
    """Samples in order from lines as they come, whatever happened to them on the way.

    A board's lines are checked by their number and checksum; what was lost becomes samples of NaN.
    Plain lines have neither. Their layout (with or without a time) and the first time hold once two
    lines in a row agree, and a time that falls, or rises by more than 2 s, once the next line goes
    on from it; until then such a line is held back.

    Attributes
    ----------
    lost, late, broken : how many samples never came, came again or too late, and lines that are no
        sample.
    restarts : how often the time began anew.
    fault : what was wrong with the latest broken line; empty where none was broken.
    """

    def __init__(self, n_sensors: int) -> None:
        self.lost = self.late = self.broken = self.restarts = 0
        self.fault = ""
        self._n, self._last, self._time, self._turns = n_sensors, -1, 0.0, 0
        self._again = -1, 0  # number of the latest late sample, and how many came in a row
        self._timed: bool | None = None  # of plain lines; None as long as it is not known
        self._held: tuple[float | None, np.ndarray] | None = None

    def take(self, line: str) -> list[tuple[float, np.ndarray]]:
        """Samples (time [ms], values) that a line adds: none, one, or one and those lost before."""
        number, time, values = self._read(line.strip())
        if number is None:
            self.refuse(f"its checksum, or its number of values, is wrong: {line[:80]!r}.")
            return []
        ahead = 1 if self._last < 0 else (number - self._last) % WRAP
        if ahead == 0 or ahead > WRAP - _MAX_HOLE:
            self.late += 1
            run = self._again[1] + 1 if number == self._again[0] + 1 else 1
            self._again = number, run
            if run < _MAX_LATE:
                return []
            ahead = WRAP  # so many in a row come from a board that began anew
        if ahead > _MAX_HOLE:  # a board that began anew, and its clock with it
            self.restarts += time < self._time
            self._turns, self._time = 0, time
        before, missing, time = (
            self._time,
            (ahead - 1 if ahead <= _MAX_HOLE else 0),
            self.follow(time),
        )
        step = (time - before) / (missing + 1)
        holes = [(before + k * step, np.full(self._n, np.nan)) for k in range(1, missing + 1)]
        self.lost += missing
        self._last, self._again = number, (-1, 0)
        return [*holes, (time, values)]

    def add(
        self, time: float | None, values: np.ndarray
    ) -> list[tuple[float | None, np.ndarray]]:
        """Samples that a plain line adds: none, one, or it and the one held back before it."""
        if self._last >= 0 or self._timed not in (None, time is not None):
            self.refuse(_LAYOUT)
            return []
        held, self._held = self._held, None
        if time is None:
            if self._timed is None and (held is None or held[0] is not None):
                return self._hold(time, values, held)
            self._timed = False
            return [*([] if held is None else [held]), (time, values)]
        if self._timed:
            ahead = time + self._turns * CLOCK - self._time
            if 0 < (ahead + CLOCK if ahead < -CLOCK / 2 else ahead) <= _MAX_PAUSE:
                self._drop(held)
                return [(self.follow(time), values)]
        if held is None or held[0] is None or not 0 < time - held[0] <= _MAX_PAUSE:
            return self._hold(time, values, held)
        self._timed, before, first = True, self._time, self.follow(held[0])
        self.restarts += first < before
        return [(first, held[1]), (self.follow(time), values)]

    def begin_anew(self) -> None:
        """Take what comes now as of a board that began anew, whatever its numbers and times."""
        self._drop(self._held)
        self.restarts += 1
        self._last, self._time, self._turns, self._again = -1, 0.0, 0, (-1, 0)
        self._timed, self._held = None, None

    def end(self) -> list[tuple[float | None, np.ndarray]]:
        """The sample held back, where it is the only one; else it goes."""
        held, self._held = self._held, None
        if self._timed is None and held is not None and self._last < 0:
            return [held]
        self._drop(held)
        return []

    def refuse(self, fault: str) -> None:
        """Count a line that is no sample."""
        self.broken += 1
        self.fault = fault

    def _hold(
        self,
        time: float | None,
        values: np.ndarray,
        held: tuple[float | None, np.ndarray] | None,
    ) -> list[tuple[float | None, np.ndarray]]:
        self._drop(held, time)
        self._held = time, values
        return []

    def _drop(
        self, held: tuple[float | None, np.ndarray] | None, after: float | None = None
    ) -> None:
        """Count a sample held back that no other goes on from, not even that at ``after`` [ms]."""
        if held is None:
            return
        time = held[0]
        if time is not None and after is not None and self._timed is None:
            self.refuse(
                f"the next line comes {after - time:g} ms after it, by their times. Are they in ms?"
                " State their unit with time_unit=."
            )
        elif time is None or self._timed is None:
            self.refuse(_LAYOUT)
        elif -_MAX_PAUSE <= time + self._turns * CLOCK - self._time <= 0:
            self.late += 1
        else:
            self.refuse(f"its time of {time:g} ms comes after {self._time:g} ms.")

    def follow(self, time: float) -> float:
        """The board's time [ms], going on where its clock began anew."""
        self._turns += time + self._turns * CLOCK < self._time - CLOCK / 2
        self._time = time + self._turns * CLOCK
        return self._time

    def describe(self) -> str:
        """What was wrong, in words; empty where nothing was."""
        parts = [
            (self.lost, "lost"),
            (self.late, "late or doubled"),
            (self.broken, "broken"),
            (self.restarts, "times begun anew"),
        ]
        return ", ".join(f"{count} {word}" for count, word in parts if count)

    def _read(self, line: str) -> tuple[int | None, float, np.ndarray]:
        bad = None, 0.0, np.empty(0)
        body, star, digits = line[1:].partition("*")
        cells = body.split(",")
        try:
            told = reduce(xor, body.encode("utf-8", errors="replace"), 0)
            if not star or int(digits, 16) != told or len(cells) != self._n + 2:
                return bad
            number, time, values = (
                int(cells[0]),
                float(cells[1]),
                np.array([float(cell) for cell in cells[2:]]),
            )
        except ValueError:
            return bad
        sound = 0 <= number < WRAP and abs(time) <= MAX_NUMBER and _is_sound(values)
        return (number, time, values) if sound else bad


def _is_sound(values: np.ndarray) -> bool:
    """Whether readings are numbers that a sensor may give, or NaN where there is none."""
    return not (np.abs(values) > MAX_NUMBER).any()


# Samples as lines of text: from a file, standard input or a serial port.

_MAX_LINE = 4096  # characters of one sample; more is no sample


def _parse_sample(line: str | bytes, n_sensors: int) -> tuple[float | None, np.ndarray]:
    """Time [ms] or None, and values (sensor,), of one line.

    Numbers are separated by commas, semicolons, tabs or blanks.

    ``n_sensors`` numbers are a sample, one more in front is its time. ``nan``, or nothing between
    two commas, marks a missing channel.
    """
    line = _decode(line)
    if len(line) > _MAX_LINE:
        raise InvalidInput(f"a line of more than {_MAX_LINE} characters is no sample.")
    cells = split_sample(line)
    if len(cells) not in (n_sensors, n_sensors + 1):
        raise InvalidInput(
            f"a sample is {n_sensors} numbers, or a time and {n_sensors} numbers; got {len(cells)}"
            f" in {line[:80]!r}."
        )
    numbers = np.array([_parse_number(cell) for cell in cells])
    time, values = (None, numbers) if len(cells) == n_sensors else (numbers[0], numbers[1:])
    if not _is_sound(values) or not (time is None or abs(time) <= MAX_NUMBER):
        raise InvalidInput(
            f"a sample must be finite numbers of at most {MAX_NUMBER:g}, got {line[:80]!r}."
        )
    return None if time is None else float(time), values


def _parse_number(cell: str) -> float:
    """The number in a cell, NaN in an empty one; Python's own also takes 1_0 and the digits of all
    scripts.
    """
    if not cell:
        return float("nan")
    try:
        if cell.isascii() and "_" not in cell:
            return float(cell)
    except ValueError:
        pass
    raise InvalidInput(f"a sample must be numbers, got {cell[:40]!r}.")


def split_sample(line: str | bytes) -> list[str]:
    """The cells of a line, whatever they hold; none where all are empty.

    An empty one between two commas, semicolons or tabs stays, one after the last of them goes.
    """
    cells = re.split(r"\s*[,;]\s*| *\t *|\s+", _decode(line).strip(" \r\n"))
    cells = cells[:-1] if cells[-1] == "" else cells
    return cells if any(cells) else []


def _decode(line: str | bytes) -> str:
    return (
        line
        if isinstance(line, str)
        else line[: _MAX_LINE + 1].decode("utf-8", errors="replace")
    )


def take_line(
    line: str | bytes, n_sensors: int, link: Link, time_factor: float = 1.0
) -> Sequence[tuple[float | None, np.ndarray]]:
    """The samples that a line adds; ``link`` counts those that were lost, and lines that are none.

    A line that begins with ``$`` is a board's. ``time_factor`` turns the times of other lines into
    ms.
    """
    text = _decode(line)
    if text.lstrip().startswith("$"):
        return link.take(text)
    try:
        time, values = _parse_sample(text, n_sensors)
    except InvalidInput as error:
        link.refuse(str(error))
        return []
    return link.add(None if time is None else time_factor * time, values)


def read_samples(
    lines: Iterable[str | bytes | None],
    n_sensors: int,
    link: Link | None = None,
    time_factor: float = 1.0,
) -> Iterator[tuple[float | None, np.ndarray]]:
    """Samples from lines; blank lines, ``#`` notes and one header line are passed over.

    A line that is no sample is left out, see :class:`feeler.robot.stream.Link`; ``link`` counts it.
    None in place of a line: the board was connected anew.
    """
    first, link = True, link or Link(n_sensors)
    for line in lines:
        if line is None:
            yield from link.end()
            link.begin_anew()
            first = True
            continue
        text = _decode(line)
        if not text.strip() or text.lstrip().startswith("#"):
            continue
        is_header, first = first and _is_header(text), False
        if not is_header:
            yield from take_line(text, n_sensors, link, time_factor)
    yield from link.end()


def _is_header(text: str) -> bool:
    """Whether a line names columns: words, and no cell that is a number."""
    cells = [
        cell.strip()
        for cell in re.split(r"[,;\t]+" if re.search(r"[,;\t]", text) else r"\s+", text)
    ]
    numbers = [
        cell for cell in cells if re.fullmatch(r"[-+]?[\d.]+(e[-+]?\d+)?|nan", cell.lower())
    ]
    return not numbers and not text.lstrip().startswith("$") and any(map(str.isalpha, text))


def read_lines(stream: "BinaryIO | _Buffer") -> Iterator[bytes]:
    """Lines of a binary stream as they come.

    Of one that is longer than any sample come pieces that are too long to be one, and never its
    end, which might look like a sample.
    """
    inside = False
    while line := stream.readline(_MAX_LINE + 1):
        whole = len(line) <= _MAX_LINE or line.endswith(b"\n")
        if not (inside and whole):
            yield line
        inside = not whole


class _Buffer:
    """Lines of a serial port from what has come; the port's own are read byte by byte, which takes
    a core at 1 kHz.
    """

    def __init__(self, connection: Any) -> None:
        self._connection, self._rest = connection, b""

    def readline(self, limit: int) -> bytes:
        """Up to the end of a line, ``limit`` bytes, or what there is once nothing more comes."""
        seen = 0
        while (end := self._rest.find(b"\n", seen)) < 0 and len(self._rest) < limit:
            seen = len(self._rest)
            more = self._connection.read(max(self._connection.in_waiting, 1))
            if not more:
                break
            self._rest += more
        size = min(end + 1 if end >= 0 else len(self._rest), limit)
        line, self._rest = self._rest[:size], self._rest[size:]
        return line


_PATIENCE = 0.2  # [C] s from one try to open a lost port to the next


def open_serial(
    port: str, baudrate: int = 115_200, timeout: float = 2.0, *, reconnect: bool = False
) -> Iterator[bytes | None]:
    """Lines from a serial port, until ``timeout`` seconds pass without one (extra ``robot``); 0:
    for ever.

    The port is open on return, so that nothing is lost of what comes before the first is asked for.
    With ``reconnect`` a board that is unplugged is waited for, as long as ``timeout`` says, and
    None stands between the lines before and after.

    Raises
    ------
    InvalidInput
        There is no such port, it is in use, or its board was unplugged.
    MissingDependencyError
        pyserial is not installed.
    """
    require_extra("serial", "robot", "a serial port")
    import serial

    if not timeout >= 0:
        raise InvalidInput(f"timeout must be ≥ 0 s, got {timeout:g}.")
    lost = serial.SerialException, OSError

    def connect() -> Any:
        return serial.Serial(port, baudrate, timeout=timeout or None)

    try:
        first = connect()
    except (*lost, ValueError) as error:
        raise InvalidInput(f"cannot open serial port {port!r}: {error}.") from error

    def read() -> Iterator[bytes | None]:
        connection = first
        while True:
            try:
                with connection:
                    yield from read_lines(_Buffer(connection))
                return
            except lost as error:
                gone, since = error, time.monotonic()
            while True:
                if not reconnect or (timeout and time.monotonic() - since > timeout):
                    raise InvalidInput(
                        f"the board at {port} is gone ({gone}). Plug it in and begin again."
                    ) from gone
                time.sleep(_PATIENCE)
                with contextlib.suppress(*lost):
                    connection = connect()
                    break
            yield None

    return read()
