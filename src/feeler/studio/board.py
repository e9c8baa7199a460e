"""A live board: what the sensors of a real antenna feel, shown while they feel it."""

from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Sequence
from itertools import chain, islice, pairwise
from threading import Event
from time import monotonic
from typing import Any

import numpy as np

from feeler.antenna.antenna import Antenna
from feeler.errors import InvalidInput
from feeler.presets import make_preset
from feeler.records.checked import checked
from feeler.robot import SensorCalibration
from feeler.robot.link import Link
from feeler.robot.samples import open_serial, split_sample, take_line
from feeler.studio.listener import Listener
from feeler.studio.study import AntennaStudy
from feeler.studio.touching import SAMPLE_INTERVAL, describe_antenna

_WINDOW = 2000  # [C] samples that the page keeps
_FRAME = 1 / 30  # s between messages to the page
_PROBE = 12  # [C] lines by which a board is known: how many numbers, how far apart
_LEAST_STEP = 0.2  # [C] ms; twelve readings in a row that rise faster are a clock and no hinge
_PATIENCE = 50  # [C] lines in a row that are no samples
_BAUDRATE = 115_200
_Say = Callable[..., None]


@checked
class Boards:
    """Which serial ports a page may ask for: those that the system lists, and the one that was
    named at the start.
    """

    def __init__(
        self,
        port: str | None = None,
        baudrate: int = _BAUDRATE,
        calibration: SensorCalibration | None = None,
    ) -> None:
        self.port, self.baudrate, self.calibration = port, baudrate, calibration

    def find(self) -> dict[str, str]:
        """Description of each port; without pyserial only the one that was named."""
        named = {} if self.port is None else {self.port: "named at the start"}
        try:
            from serial.tools.list_ports import comports
        except ImportError:
            return named
        return named | {
            item.device: item.description for item in comports() if item.device not in named
        }

    def open(self, port: object) -> Iterator[bytes]:
        """Lines from a port; a page can name no other file of this machine."""
        if not isinstance(port, str) or port not in self.find():
            raise InvalidInput(
                f"no board at {str(port)[:60]!r}; found: {', '.join(self.find()) or 'none'}. Plug"
                " it in and look again, or name its port: feeler studio --board PORT."
            )
        return open_serial(port, self.baudrate)


def listen(
    lines: Iterator[bytes],
    antenna: Antenna,
    calibration: SensorCalibration | None,
    find: Callable[[Antenna], AntennaStudy | None],
    say: _Say,
    stop: Event,
) -> None:
    """Show what comes from a board until ``stop`` is set.

    Parameters
    ----------
    antenna
        What has as many sensors as the board has channels; else the robot has.
    find
        The study of an antenna, once there is one.

    Raises
    ------
    InvalidInput
        Another number of channels, no numbers, no angles, or a board that is gone or silent.
    """
    known = list(islice(lines, 1, _PROBE))  # the first line may have begun before
    given, antenna = antenna, _find_antenna(known, antenna)
    n_channels = antenna.sensors.size
    if calibration is not None and calibration.n_hinges != n_channels:
        raise InvalidInput(
            f"the calibration is for {calibration.n_hinges} hinges, the board has {n_channels}"
            " channels."
        )
    listener = Listener(antenna, calibration, interval := _find_interval(known, n_channels))
    listener.learn(find(antenna))
    say({"part": "begin", "total": _WINDOW, "interval": interval, "rims": [], "preview": False,
         "antenna": describe_antenna(antenna), "robot": antenna is not given})  # fmt: skip
    damaged, sent = 0, monotonic()

    def tell() -> None:
        first, arrays = listener.give()
        counts = {"missing": listener.missing, "damaged": damaged, "contact": listener.contact}
        say({"part": "piece", "first": first, **counts}, **arrays)
        listener.learn(find(antenna))

    for sample in _read(chain(known, lines), n_channels):
        if stop.is_set():
            return
        if sample is None:
            damaged += 1
            continue
        listener.take(*sample)
        if monotonic() - sent > _FRAME:
            tell()
            sent = monotonic()
    tell()
    raise InvalidInput(
        "the board fell silent: nothing came for 2 s. Listen again when it sends."
    )


def _read(
    lines: Iterable[bytes], n_channels: int
) -> Iterator[tuple[float | None, np.ndarray] | None]:
    """Samples, and None for each line that is none; too many of those in a row are refused."""
    bad, link = 0, Link(n_channels)
    for line in lines:
        if not line.strip() or line.lstrip().startswith(b"#"):
            continue
        samples = _parse(line, n_channels, link)
        bad = 0 if samples is not None else bad + 1
        if bad >= _PATIENCE:
            raise InvalidInput(
                f"{_PATIENCE} lines in a row are no samples, such as {line[:60]!r}: a sample is"
                f" {n_channels} numbers, the time in ms before them, or a line as feeler's sketch"
                " sends it."
            )
        yield from [None] if samples is None else samples


def _parse(
    line: bytes, n_channels: int, link: Link
) -> Sequence[tuple[float | None, np.ndarray]] | None:
    """The samples that a line adds, those lost before it among them as NaN; None where it is
    damaged.
    """
    broken = link.broken
    samples = take_line(line, n_channels, link)
    return samples if samples or link.broken == broken else None


def _strip_frame(line: bytes) -> bytes:
    """Time and values of a line, whether or not it is numbered and summed."""
    return (
        line.partition(b"*")[0].partition(b",")[2] if line.lstrip().startswith(b"$") else line
    )


def _find_antenna(known: list[bytes], antenna: Antenna) -> Antenna:
    """The antenna, or the robot, that has a sensor for each number of a line, or for each but the
    first, a time that rises.
    """
    cells = (split_sample(_strip_frame(line)) for line in known if not line.startswith(b"#"))
    rows = [row for row in cells if row]
    if known and not rows:
        raise InvalidInput(
            f"the board sends {len(known)} lines without a number. Is its sketch running, and is"
            " this its baud rate?"
        )
    if not rows:
        raise InvalidInput(
            "the board is silent: nothing came for 2 s. Is it sending, and at this baud rate?"
        )
    width = Counter(map(len, rows)).most_common(1)[0][0]
    timed = _is_time([row[0] for row in rows if len(row) == width])
    robot = make_preset("robot")
    for one in (antenna, robot):
        if one.sensors.size == width - timed:
            return one
    raise InvalidInput(
        f"the board sends {width} numbers a line{', the first of them a time' if timed else ''};"
        f" the antenna {antenna.name!r} has {antenna.sensors.size} sensors (and the robot"
        f" {robot.sensors.size}). Set the number of sensors, or open the antenna's own file"
        " first."
    )


def _is_time(cells: list[str]) -> bool:
    """Whether numbers [ms] go up as a clock's do, and not as a hinge's."""
    try:
        return all(float(b) - float(a) > _LEAST_STEP for a, b in pairwise(cells))
    except ValueError:
        return False


def _find_interval(known: list[bytes], n_channels: int) -> float:
    """Usual time between samples [ms]; without times a millisecond."""
    samples: list[Any] = [sample for sample in _read(known, n_channels) if sample is not None]
    times = np.array([time for time, _ in samples if time is not None], dtype=float)
    steps = np.diff(times)
    steps = steps[steps > 0]
    return (
        float(steps[steps < 1.5 * np.median(steps)].mean()) if steps.size else SAMPLE_INTERVAL
    )
