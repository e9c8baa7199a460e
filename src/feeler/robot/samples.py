"""Samples as lines of text: from a file, standard input or a serial port."""

import re
from collections.abc import Iterable, Iterator, Sequence
from typing import BinaryIO

import numpy as np

from feeler.errors import InvalidInput, MissingExtra
from feeler.robot.link import MAX_NUMBER, Link, is_sound

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
    if not is_sound(values) or not (time is None or abs(time) <= MAX_NUMBER):
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
    cells = re.split(r" *[,;\t] *|\s+", _decode(line).strip(" \r\n"))
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
    lines: Iterable[str | bytes],
    n_sensors: int,
    link: Link | None = None,
    time_factor: float = 1.0,
) -> Iterator[tuple[float | None, np.ndarray]]:
    """Samples from lines; blank lines, ``#`` notes and one header line are passed over.

    A line that is no sample is left out, see :class:`feeler.robot.link.Link`; ``link`` counts it.
    """
    first, link = True, link or Link(n_sensors)
    for line in lines:
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


def read_lines(stream: BinaryIO) -> Iterator[bytes]:
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


def open_serial(port: str, baudrate: int = 115_200, timeout: float = 2.0) -> Iterator[bytes]:
    """Lines from a serial port, until ``timeout`` seconds pass without one (extra ``robot``).

    The port is open on return, so that nothing is lost of what comes before the first is asked for.

    Raises
    ------
    InvalidInput
        There is no such port, it is in use, or its board was unplugged.
    MissingExtra
        pyserial is not installed.
    """
    try:
        import serial
    except ImportError as error:
        raise MissingExtra(
            "a serial port needs pyserial: pip install 'feeler[robot]'."
        ) from error
    try:
        connection = serial.Serial(port, baudrate, timeout=timeout)
    except (serial.SerialException, ValueError, OSError) as error:
        raise InvalidInput(f"cannot open serial port {port!r}: {error}.") from error

    def read() -> Iterator[bytes]:
        try:
            with connection:
                yield from read_lines(connection)
        except (serial.SerialException, OSError) as error:
            raise InvalidInput(
                f"the board at {port} is gone ({error}). Plug it in and begin again."
            ) from error

    return read()
