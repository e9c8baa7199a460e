"""What runs while it is shown: by hand, from a real antenna, and files dropped on the page."""

import re
import time
from collections import Counter
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from itertools import chain, islice, pairwise
from pathlib import Path
from threading import Event, Lock
from time import monotonic
from typing import Any

import numpy as np

from feeler.antenna.files import parse_antenna
from feeler.antenna.segments import Antenna
from feeler.errors import InvalidInput
from feeler.files import temporary_folder
from feeler.physics.simulation import Simulations
from feeler.presets import make_preset
from feeler.robot import SensorCalibration, load_calibration, load_recording, repair
from feeler.robot.stream import Link, open_serial, split_sample, take_line
from feeler.studio.requests import (
    SAMPLE_INTERVAL,
    AntennaRequest,
    TouchRequest,
    describe_antenna,
    describe_original,
    describe_scene,
    hash_tensor,
    join_samples,
    make_simulation,
    read_number,
    read_sample,
)
from feeler.studio.study import AntennaStudy
from feeler.tensors.transforms import spread_angles
from feeler.validation import checked

# By hand: objects and the antenna's base follow the mouse while the simulation runs.

_FRAME_HAND = 1 / 60  # s
LONGEST = (
    4000  # [C] samples of one recording; then time stands still, so that memory stays bounded
)
_MAX_SPEED, _MAX_TURN = (
    1.2,
    0.03,
)  # [C] mm/ms and rad/ms; the hand is not followed faster than that
_GLIDE = 6.0  # [C] ms in which a hand at rest would be reached
_STILL = 2e-5  # rad/ms; slower than this everywhere, with nothing in motion, time stands still
Say = Callable[..., None]
Command = tuple[int, int, float, float, float]
"""Sample before which it holds, object (−1: the base), velocity x, y [mm/ms] and turn [rad/ms]."""


class Hand:
    """Where the hand is, and the run that follows it."""

    def __init__(self) -> None:
        self._lock, self._ended = Lock(), Event()
        self._aims: dict[int, tuple[float, float, float]] = {}

    def aim(self, message: dict[str, Any]) -> None:
        """Take where an object (its number, or −1 for the base) should go: x, y [mm] and, for the
        base, turn [rad].
        """
        what = message.get("what")
        if what == "end":
            self._ended.set()
            return
        number = int(read_number(what, "aim.what", -1, 100))
        place = [
            read_number(message.get(name, 0.0), f"aim.{name}", -1e4, 1e4)
            for name in ("x", "y", "turn")
        ]
        with self._lock:
            self._aims[number] = (place[0], place[1], place[2])

    def end(self) -> None:
        """End the run."""
        self._ended.set()

    def begin(self) -> None:
        """A run is asked for: the one before ends, and what is said from now on is for this one."""
        with self._lock:
            self._ended.set()
            self._ended, self._aims = Event(), {}

    def run(self, wish: TouchRequest, pace: float, say: Say, stop: Event) -> None:
        """Simulate until the hand lets go; ``pace`` is simulated time per real time."""
        ended = self._ended
        simulation = make_simulation(wish)
        # nothing moves by itself
        commands = [(1, number, 0.0, 0.0, 0.0) for number in range(1 + len(wish.objects))]
        _apply(simulation, commands)
        antenna = wish.antenna.make()
        say({"part": "begin", "total": LONGEST, **describe_scene(wish)})
        piece = [read_sample(simulation)]
        sensed = [piece[-1]["angle"][antenna.sensors - 1]]
        done, sent, due = 1, 0, 1.0
        while not (stop.is_set() or ended.is_set()):
            began = time.monotonic()
            due = min(due + pace * 1e3 * _FRAME_HAND / SAMPLE_INTERVAL, done + 40)
            while done < min(int(due), LONGEST) and not stop.is_set():
                new = self._steer(simulation, done, max(_GLIDE, 1.5e3 * _FRAME_HAND * pace))
                commands += new
                _apply(simulation, new)
                last = {what: (vx, vy, turn) for _, what, vx, vy, turn in commands}
                moving = any(abs(number) > 0 for rates in last.values() for number in rates)
                if not moving and float(np.abs(simulation.state.velocity).max()) < _STILL:
                    due = float(done)
                    break
                simulation.step(SAMPLE_INTERVAL)
                piece.append(read_sample(simulation))
                sensed.append(piece[-1]["angle"][antenna.sensors - 1])
                done += 1
            if piece:
                say({"part": "piece", "first": sent}, **join_samples(piece))
                sent, piece = done, []
            if done >= LONGEST:
                break
            ended.wait(max(0.0, _FRAME_HAND - (time.monotonic() - began)))
        if not stop.is_set():
            tensor = np.array(sensed).T
            end = {
                "part": "end",
                "hash": hash_tensor(tensor),
                "preview": wish.preview,
                "commands": commands,
            }
            say(end)

    def _steer(self, simulation: Simulations, sample: int, glide: float) -> list[Command]:
        """Commands that bring everything nearer to where the hand wants it, where they change."""
        with self._lock:
            aims = dict(self._aims)
        state, found = simulation.state, []
        for what, (x, y, turn) in aims.items():
            if what >= state.place.shape[1]:
                continue
            here = state.base[0] if what < 0 else np.append(state.place[0, what], turn)
            way = (np.array([x, y]) - here[:2]) / glide
            fast = float(np.hypot(*way))
            way *= min(1.0, _MAX_SPEED / fast) if fast > 1e-4 else 0.0
            spin = (
                float(np.clip((turn - here[2]) / glide, -_MAX_TURN, _MAX_TURN))
                if what < 0
                else 0.0
            )
            found.append(
                (sample, what, float(way[0]), float(way[1]), spin if abs(spin) > 1e-5 else 0.0)
            )
        return found


def _apply(simulation: Simulations, commands: list[Command]) -> None:
    """Give commands to a simulation."""
    for _, what, vx, vy, turn in commands:
        if what < 0:
            simulation.move_base(0, (vx, vy), turn)
        else:
            simulation.move_object(0, what, (vx, vy), turn)


def replay(
    wish: TouchRequest, commands: list[Command], n_samples: int
) -> dict[str, np.ndarray]:
    """The readings of a run again, to the last bit."""
    simulation = make_simulation(wish)
    samples = [read_sample(simulation)]
    waiting = sorted(commands, key=lambda command: command[0])
    for k in range(1, n_samples):
        while waiting and waiting[0][0] <= k:
            _apply(simulation, [waiting.pop(0)])
        simulation.step(SAMPLE_INTERVAL)
        samples.append(read_sample(simulation))
    return join_samples(samples)


def read_commands(value: Any) -> list[Command]:
    """Commands from a page."""
    items = value if isinstance(value, list) and len(value) <= 20 * LONGEST else []
    found: list[Command] = []
    for item in items:
        row = item if isinstance(item, list) and len(item) == 5 else [None] * 5
        numbers = [read_number(number, "command", -1e5, 1e5) for number in row]
        found.append((int(numbers[0]), int(numbers[1]), numbers[2], numbers[3], numbers[4]))
    return found


# Samples of a real antenna in, what a page is shown out.

# [C] samples; a longer gap is a pause, and a clock that steps back is one that began anew
_PAUSE = 2000
_REST = 100  # [C] samples at rest after which the next touch may begin


class Judge:
    """A study's decoder on a stream without end: when a touch is over and the antenna rests, it
    waits for the next.
    """

    def __init__(self, study: AntennaStudy, interval: float) -> None:
        self.study, self._stream = study, study.decoder.start()
        self._every = max(1, round(study.decoder.interval / interval))
        self._seen = self._rest = 0
        self._touched = False

    def restart(self) -> None:
        """Forget what was felt."""
        self._stream.reset()
        self._rest, self._touched = 0, False

    def update(self, angle: np.ndarray, time: float) -> tuple[np.ndarray, bool]:
        """Posterior (answer,) after a sample (sensor,) [rad], and whether contact is noticed with
        it.
        """
        self._seen += 1
        noticed = False
        if self._seen % self._every == 0:
            state = self._stream.update(angle, time)
            noticed = state.since_contact >= 0 and not self._touched
            self._touched |= noticed
            away = np.abs(angle - self._stream.finder.level)
            rests = state.state == "over" and not (away > self._stream.finder.onset).any()
            self._rest = self._rest + 1 if rests else 0
            if self._rest >= _REST:
                self.restart()
        return self._stream.posterior, noticed


class Listener:
    """Turns samples into angles of all hinges and, once there is a study, into the decoder's
    posterior.

    Parameters
    ----------
    calibration
        From readings to angles; None where they are angles [rad].
    interval
        Usual time between samples [ms].
    """

    def __init__(
        self, antenna: Antenna, calibration: SensorCalibration | None, interval: float
    ) -> None:
        self._antenna, self._calibration, self._interval = antenna, calibration, interval
        self._sensed = antenna.sensors - 1
        self._last, self._time = np.zeros(self._sensed.size), float("nan")
        self._rows: list[np.ndarray] = []
        self._beliefs: list[np.ndarray] = []
        self._judge: Judge | None = None
        self.count, self.missing, self.contact = 0, 0, -1

    def learn(self, study: AntennaStudy | None) -> None:
        """Judge by a study from now on."""
        if study is not None and (self._judge is None or self._judge.study is not study):
            self._judge = Judge(study, self._interval)

    def take(self, time: float | None, values: np.ndarray) -> None:
        """One sample and its time [ms]; what is missing is shown as it was last, counted, and no
        evidence.

        Raises
        ------
        InvalidInput
            Readings that are no angles, without a calibration.
        """
        angle, first = self._convert(values), np.isnan(self._time)
        time = (0.0 if first else self._time + self._interval) if time is None else time
        gap = 0 if first else round((time - self._time) / self._interval) - 1
        anew = not -1 <= gap < _PAUSE
        if not anew:
            self.missing += max(gap, 0)
            self._rows += [self._last] * gap
            self._beliefs += self._beliefs[-1:] * gap
        elif self._judge is not None:
            self._judge.restart()
        self.missing += bool(
            np.isnan(angle).all()
        )  # a sample that its board numbered, and that never came
        self._time, self._last = time, np.where(np.isnan(angle), self._last, angle)
        self._rows.append(self._last)
        if self._judge is not None:
            belief, noticed = self._judge.update(angle, time)
            self._beliefs.append(belief)
            self.contact = self.count + len(self._rows) - 1 if noticed else self.contact

    def give(self) -> tuple[int, dict[str, np.ndarray]]:
        """The samples since the last call: number of the first, and arrays (sample, …)."""
        first, angle = self.count, np.array(self._rows).reshape(-1, self._last.size)
        arrays = {
            "angle": spread_angles(angle, self._antenna, self._sensed),
            "base": np.zeros((len(angle), 3)),
        }
        if self._beliefs:
            unknown = np.zeros((len(angle) - len(self._beliefs), self._beliefs[0].size))
            arrays["posterior"] = np.concatenate([unknown, self._beliefs])
        self.count += len(angle)
        self._rows, self._beliefs = [], []
        return first, arrays

    def _convert(self, values: np.ndarray) -> np.ndarray:
        if self._calibration is not None:
            angle = self._calibration.apply(values[:, None], outside="extend")[:, 0]
            return np.where(np.isfinite(angle), angle, np.nan)
        if (np.abs(values) > np.pi).any():
            raise InvalidInput(
                f"{values[np.nanargmax(np.abs(values))]:.4g} is no angle of a hinge in rad. Open"
                " the sensors' calibration first (.json, made by feeler robot calibrate), or start"
                " with --calibration."
            )
        return values


# A live board: what the sensors of a real antenna feel, shown while they feel it.

_WINDOW = 2000  # [C] samples that the page keeps
_FRAME = 1 / 30  # s between messages to the page
_PROBE = 12  # [C] lines by which a board is known: how many numbers, how far apart
_LEAST_STEP = 0.2  # [C] ms; twelve readings in a row that rise faster are a clock and no hinge
_PATIENCE = 50  # [C] lines in a row that are no samples
_BAUDRATE = 115_200


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
        lines = open_serial(port, self.baudrate)
        return (line for line in lines if line is not None)


def listen(
    lines: Iterator[bytes],
    antenna: Antenna,
    calibration: SensorCalibration | None,
    find: Callable[[Antenna], AntennaStudy | None],
    say: Say,
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
    # usual time between samples [ms]; without times a millisecond
    samples = [sample for sample in _read(known, n_channels) if sample is not None]
    steps = np.diff(np.array([time for time, _ in samples if time is not None], dtype=float))
    steps = steps[steps > 0]
    usual = steps[steps < 1.5 * np.median(steps)] if steps.size else [SAMPLE_INTERVAL]
    interval = float(np.mean(usual))
    listener = Listener(antenna, calibration, interval)
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
        broken = link.broken
        samples = take_line(line, n_channels, link)  # also those lost before it, as NaN
        damaged = not samples and link.broken > broken
        bad = bad + 1 if damaged else 0
        if bad >= _PATIENCE:
            raise InvalidInput(
                f"{_PATIENCE} lines in a row are no samples, such as {line[:60]!r}: a sample is"
                f" {n_channels} numbers, the time in ms before them, or a line as feeler's sketch"
                " sends it."
            )
        yield from [None] if damaged else samples


def _find_antenna(known: list[bytes], antenna: Antenna) -> Antenna:
    """The antenna, or the robot, that has a sensor for each number of a line, or for each but the
    first, a time that rises.
    """
    cells = (
        split_sample(  # a line may be numbered and summed
            line.partition(b"*")[0].partition(b",")[2]
            if line.lstrip().startswith(b"$")
            else line
        )
        for line in known
        if not line.startswith(b"#")
    )
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
        f" {robot.sensors.size}). Set the number of sensors, or open the antenna's own file first."
    )


def _is_time(cells: list[str]) -> bool:
    """Whether numbers [ms] go up as a clock's do, and not as a hinge's."""
    try:
        return all(float(b) - float(a) > _LEAST_STEP for a, b in pairwise(cells))
    except ValueError:
        return False


# Files dropped on the page: an antenna file, a recording of one's own, or the calibration of
# its sensors.

_MAX_TEXT = 6 * 2**20  # [C] characters
_NAME = re.compile(r"\w[\w .()+-]{0,80}")  # what messages may call a file
_MAX_SHOWN = 8000  # [C] samples; of longer recordings every second, third … is shown


def open_text(
    message: dict[str, Any],
    calibration: SensorCalibration | None,
    find: Callable[[Antenna], AntennaStudy | None],
) -> tuple[dict[str, Any], dict[str, np.ndarray]]:
    """What a dropped antenna or recording holds: header and arrays of the answer."""
    name, text = read_file(message)
    if name.lower().endswith(".toml"):
        antenna = parse_antenna(text, name).antenna
        wish = AntennaRequest(toml=text, name=antenna.name)
        return {
            "what": "antenna",
            "antenna": wish.to_plain(),
            "original": describe_original(antenna),
        }, {}
    if name.lower().endswith(".csv"):
        return _open_recording(
            name,
            text,
            AntennaRequest.from_plain(message.get("antenna", {})).make(),
            calibration,
            find,
        )
    raise InvalidInput(
        f"{name[-40:]!r} is neither an antenna (.toml), a recording (.csv) nor a calibration"
        " (.json)."
    )


def read_file(message: dict[str, Any]) -> tuple[str, str]:
    """Name and text of a file in a message."""
    name, text = message.get("name"), message.get("text")
    if (
        not isinstance(name, str)
        or not isinstance(text, str)
        or len(name) > 200
        or len(text) > _MAX_TEXT
    ):
        raise InvalidInput(
            f"a file needs a name and a text of at most {_MAX_TEXT:,} characters."
        )
    return name, text


def open_calibration(name: str, text: str) -> SensorCalibration:
    """The calibration of a robot's sensors."""
    with _as_file(name, text) as path:
        return load_calibration(path)


def _open_recording(
    name: str,
    text: str,
    antenna: Antenna,
    calibration: SensorCalibration | None,
    find: Callable[[Antenna], AntennaStudy | None],
) -> tuple[dict[str, Any], dict[str, np.ndarray]]:
    """A recording (time and hinge angles) as readings; angles between sensors are interpolated.

    ``find`` gives the study of an antenna, if there is one; its decoder then judges the recording.
    """
    with _as_file(name, text) as path:
        recording = load_recording(path, n_channels=None)
    if recording.quantity != "angle":
        if calibration is None:
            raise InvalidInput(
                f"{name} holds {recording.quantity}. Open the sensors' calibration first (.json,"
                " made by feeler robot calibrate)."
            )
        recording = recording.to_angles(calibration, outside="extend")
    robot = make_preset("robot")
    fitting = next((a for a in (antenna, robot) if a.sensors.size == recording.n_sensors), None)
    if fitting is None:
        raise InvalidInput(
            f"{name} has {recording.n_sensors} channels, but the antenna {antenna.name!r} has"
            f" {antenna.sensors.size} sensors (and the robot {robot.sensors.size}). Set"
            " the number of sensors, or open the antenna's own file first."
        )
    rate = 1e3 / float(
        np.median(np.diff(recording.time))
    )  # its own; what is shown is resampled
    recording = repair(recording, gaps="bridge")
    angle, interval = recording.values.T, float(recording.time[1] - recording.time[0])
    every = -(-len(angle) // _MAX_SHOWN)
    shown = angle[::every]
    header = {
        "what": "recording",
        "name": name,
        "antenna": describe_antenna(fitting),
        "rims": [],
        "preview": False,
        "interval": interval * every,
        "rate": rate,
        "source": recording.source,
        "total": len(shown),
        "robot": fitting is not antenna,
    }
    arrays = {
        "angle": spread_angles(shown, fitting, fitting.sensors - 1),
        "base": np.zeros((len(shown), 3)),
    }
    if (known := find(fitting)) is not None:
        judge = Judge(known, interval)
        beliefs, noticed = zip(*map(judge.update, angle, recording.time), strict=True)
        header["contact"] = int(np.argmax(noticed)) // every if any(noticed) else -1
        arrays["posterior"] = np.array(beliefs[::every])
    return header, arrays


@contextmanager
def _as_file(name: str, text: str) -> Iterator[Path]:
    """A text as a file, which is how recordings and calibrations are read."""
    with temporary_folder() as folder:
        path = folder / (name if _NAME.fullmatch(name) else f"dropped{Path(name).suffix}")
        path.write_text(text, encoding="utf-8", errors="replace")
        yield path
