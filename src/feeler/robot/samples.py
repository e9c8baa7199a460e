"""Samples as lines of text: from a file, standard input or a serial port."""

import re
from collections.abc import Iterable, Iterator
from typing import BinaryIO

import numpy as np

from feeler.errors import InvalidInput, MissingExtra
from feeler.robot.link import Link

_MAX_LINE = 4096  # characters of one sample; more is no sample


def _parse_sample(line: str | bytes, n_sensors: int) -> tuple[float | None, np.ndarray]:
    """Time [ms] or None, and values (sensor,), of one line.

    Numbers are separated by commas, semicolons, tabs or blanks.

    ``n_sensors`` numbers are a sample, one more in front is its time. ``nan`` marks a missing
    channel.
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
    try:
        numbers = [float(cell) for cell in cells if "_" not in cell]
    except ValueError:
        numbers = []
    if len(numbers) != len(cells):
        raise InvalidInput(f"a sample must be numbers, got {line[:80]!r}.")
    if len(numbers) == n_sensors:
        return None, np.array(numbers)
    return numbers[0], np.array(numbers[1:])


def split_sample(line: str | bytes) -> list[str]:
    """The cells of a line, whatever they hold."""
    return [cell for cell in re.split(r"[,;\s]+", _decode(line)) if cell]


def _decode(line: str | bytes) -> str:
    return (
        line
        if isinstance(line, str)
        else line[: _MAX_LINE + 1].decode("utf-8", errors="replace")
    )


def take_line(
    line: str | bytes, n_sensors: int, link: Link
) -> list[tuple[float | None, np.ndarray]]:
    """The samples that a line adds.

    A line that begins with ``$`` is a board's, which ``link`` checks and counts.
    """
    text = _decode(line)
    if text.lstrip().startswith("$"):
        return [*link.take(text)]
    time, values = _parse_sample(text, n_sensors)
    return [(None if time is None else link.follow(time), values)]


def read_samples(
    lines: Iterable[str | bytes], n_sensors: int, link: Link | None = None
) -> Iterator[tuple[float | None, np.ndarray]]:
    """Samples from lines; blank lines, ``#`` notes and one header line are passed over.

    ``link`` counts what a board has lost, see :func:`take_line`.
    """
    first, link = True, link or Link(n_sensors)
    for line in lines:
        text = _decode(line)
        if not text.strip() or text.lstrip().startswith("#"):
            continue
        words = not text.lstrip().startswith("$") and text.lower().replace("nan", "").replace(
            "e", ""
        )
        is_header, first = first and any(c.isalpha() for c in words or ""), False
        if not is_header:
            yield from take_line(text, n_sensors, link)


def read_lines(stream: BinaryIO) -> Iterator[bytes]:
    """Lines of a binary stream as they come, each cut where it is longer than any sample."""
    while line := stream.readline(_MAX_LINE + 1):
        yield line


def open_serial(port: str, baudrate: int = 115_200, timeout: float = 2.0) -> Iterator[bytes]:
    """Lines from a serial port, until ``timeout`` seconds pass without one (extra ``robot``).

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
    try:
        with connection:
            while line := connection.readline(_MAX_LINE):
                yield line
    except (serial.SerialException, OSError) as error:
        raise InvalidInput(
            f"the board at {port} is gone ({error}). Plug it in and begin again."
        ) from error
