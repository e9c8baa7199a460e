"""Recordings of a robotic antenna, and what ``feeler info`` says of a robot's files."""

import fnmatch
import os
import re
from collections.abc import Sequence
from dataclasses import field, replace
from pathlib import Path
from shlex import quote
from typing import Annotated

import numpy as np

from feeler.errors import InvalidInput
from feeler.files import writing
from feeler.objects import load_objects
from feeler.records import ALLOW_NAN, Choice, Ge, Le, Record
from feeler.robot.description import is_robot_file, load_robot
from feeler.robot.sensors import (
    ANGLE_UNITS,
    MAX_HINGES,
    READING_UNITS,
    SensorCalibration,
    load_calibration,
    load_calibration_table,
)
from feeler.robot.stream import unwrap_clock
from feeler.sandbox import Limits
from feeler.tables import (
    TIME_UNITS,
    Table,
    find_times,
    read_table,
    sniff_columns,
    split_unit,
)
from feeler.tensors.bags import choose_names, describe_bag, find_bag, read_bag, sort_names
from feeler.tensors.formats import Format
from feeler.validation import checked

# Recordings: what a robotic antenna's electronics wrote, as it is; repair is another step.

N_CHANNELS = 8  # [P]
_TIME_VALID = "ms, s, us, ns"
_SOURCES = ("robot", "surrogate", "simulation")
_QUANTITIES = {
    "pF": "capacitance",
    "counts": "capacitance",
    "mV": "voltage",
    "ohm": "resistance",
    "mT": "field",
    "ustrain": "strain",
}
_UNITS = {**{name: ("rad", factor) for name, factor in ANGLE_UNITS.items()}, **READING_UNITS}
_CHANNEL = re.compile(
    r"(?:.*/)?(?:hinge|sensor|channel|segment|joint|angle|capacitance|cap|voltage|signal|analog"
    r"|adc|ch|c|a|s|v)[\s_.-]*(\d{1,3})(?:/position)?"
    rf"[\s_(\[]*({'|'.join(map(re.escape, _UNITS))})?[)\]]?",
    re.IGNORECASE,
)
# of joint states, beside their positions: the factors from ROS's units to feeler's
_BESIDE = {"/velocity": 1e-3, "/effort": 1e3}
_JOINT_STATE = re.compile(r"(velocity|effort)\d+")
_LABELS = ("feature", "size", "location", "speed")


class Recording(Record):
    """Channels over time exactly as recorded: gaps are NaN, times are as written.

    Attributes
    ----------
    time : np.ndarray
        (sample,) [ms].
    values : np.ndarray
        (sensor, sample) [``unit``], base to tip; NaN where a value is missing.
    quantity : str
        ``angle``, or what the sensors read instead of it.
    unit : str
        ``rad``, ``pF``, ``counts``, ``mV``, ``ohm``, ``mT`` or ``ustrain``; empty for that of the
        quantity.
    robot : str
        Name of the robot; empty where it is not known.
    velocity, effort : np.ndarray | None
        (sensor, sample) as the joints' driver gave them [rad/ms] and [N·mm]; None where it did not.
    labels : dict[str, str | float]
        What is known of the touch: feature, size [mm], location, speed [mm/ms].
    history : tuple[str, ...]
        Every change made to the data since they were read, in words.
    """

    time: Annotated[np.ndarray, "sample", ALLOW_NAN]
    values: Annotated[np.ndarray, "sensor sample", ALLOW_NAN]
    quantity: Annotated[str, Choice(("angle", *dict.fromkeys(_QUANTITIES.values())))] = "angle"
    unit: str = ""
    robot: str = ""
    source: Annotated[str, Choice(_SOURCES)] = "robot"
    velocity: Annotated[np.ndarray, "sensor sample", ALLOW_NAN] | None = None
    effort: Annotated[np.ndarray, "sensor sample", ALLOW_NAN] | None = None
    labels: dict[str, str | float] = field(default_factory=dict)
    history: tuple[str, ...] = ()

    def _check(self) -> None:
        of = {"rad": "angle", **_QUANTITIES}
        unit = self.unit or next(unit for unit, name in of.items() if name == self.quantity)
        if of.get(unit) != self.quantity:
            valid = ", ".join(name for name, what in of.items() if what == self.quantity)
            raise InvalidInput(f"unit of {self.quantity} is {valid}, got {unit!r}.")
        vars(self)["unit"] = unit
        if self.values.shape[1] != self.time.size or self.time.size < 2:
            raise InvalidInput(
                "a recording is time (sample,) and values (sensor, sample) of at least 2 samples;"
                f" got {self.time.shape} and {self.values.shape}."
            )
        most = np.fmax.reduce(np.abs(self.values), axis=None, initial=0.0)
        if self.quantity == "angle" and most > np.pi:
            raise InvalidInput(
                f"a hinge turns by {most:.4g} rad, more than half a turn. Are its angles in rad?"
            )
        for name in ("velocity", "effort"):
            beside = getattr(self, name)
            if beside is not None and beside.shape != self.values.shape:
                raise InvalidInput(
                    f"{name} has the shape {beside.shape}, values have {self.values.shape}."
                )

    @property
    def n_sensors(self) -> int:
        """Number of channels."""
        return self.values.shape[0]

    def to_angles(
        self,
        calibration: SensorCalibration,
        *,
        outside: str = "refuse",
        bad_channels: Annotated[str, Choice(("refuse", "missing"))] = "refuse",
    ) -> "Recording":
        """The same recording as hinge angles.

        Another robot's calibration and readings out of range are refused. Under
        ``bad_channels="missing"`` a channel that never comes into its range is made missing (NaN),
        where more than half of the channels do: its wire is broken.
        """
        if self.quantity == "angle":
            raise InvalidInput(
                "the recording already holds angles; a calibration applies to readings only."
            )
        if calibration.unit != self.unit:
            raise InvalidInput(
                f"the calibration is of readings in {calibration.unit}, the recording is in"
                f" {self.unit}. Calibrate these channels, or state the unit that they have."
            )
        values, said = self.values.copy(), ""
        if bad_channels == "missing" and self.n_sensors == calibration.n_hinges:
            never = (calibration.find_outside(values) | np.isnan(values)).all(axis=1)
            off = np.flatnonzero(never & np.isfinite(values).any(axis=1))
            if off.size < self.n_sensors / 2:
                values[off] = np.nan
                said = (
                    f"; never in its range, made missing: {', '.join(map(str, off + 1))}"
                    if off.size
                    else ""
                )
        angle = calibration.apply(values, robot=self.robot, outside=outside)
        result = self.replace(values=angle, quantity="angle", unit="rad")
        return result.noted(f"{self.quantity} to angle by calibration, outside={outside}{said}")

    def noted(self, words: str) -> "Recording":
        """The same recording with one more line of history."""
        return self.replace(history=(*self.history, words))


@checked
def load_recording(
    path: str | os.PathLike,
    *,
    n_channels: int | None = N_CHANNELS,
    hinges: Sequence[int] = (),
    unit: str | None = None,
    time_unit: str | None = None,
    joints: Sequence[str] = (),
    bad_channels: Annotated[str, Choice(("refuse", "missing"))] = "refuse",
) -> Recording:
    """Read a recording: a CSV with a time column and numbered hinges, or ROS 2's MCAP.

    The header names units: ``time_ms``, ``Time [s]`` or a logger's clock (``__time`` of
    PlotJuggler, ``%time`` of ROS 1); ``hinge1_pF``, ``hinge 1 (deg)``, ``ch0_mV``, ``c1`` with
    ``unit=``. Other columns (temperature, remarks) are left out and named in the history. Notes
    above the header may hold ``# robot:``, ``# source:``, ``# unit:``, ``#
    time unit:``, ``# feature:``, ``# size:`` [mm], ``# location:``, ``# speed:`` [m/s]. Columns are
    put in the order of their numbers and the history says so.

    ``run.mcap``, or a bag's folder, gives its one topic of numbers, ``run.mcap:TOPIC`` one of
    several and ``run.mcap:TOPIC:UNIT`` says its unit (extra ``ros``, see
    :func:`feeler.tensors.bags.read_bag`). Joints stand in the order of their numbers, which ROS
    does not keep, or in their own where they have none.

    Parameters
    ----------
    n_channels
        How many channels there must be; None takes what the file has.
    hinges
        Numbers of the hinges that have a sensor, from 1 at the base: channels may be numbered by
        them in place of 1, 2, 3 ….
    unit, time_unit
        Units where the file does not name them.
    joints
        Names or patterns (``antenna_*``) of the robot's channels, base to tip, in a topic or table
        that has others too; a table of numbered channels alone needs none.
    bad_channels
        Channels that are absent: ``refuse``, or make them ``missing`` (NaN).

    Raises
    ------
    InvalidInput
        No time column, missing, doubled or extra channels, no unit or mixed units, angles beyond
        half a turn, or an unreadable file.
    """
    bag = find_bag(path)
    if bag is None:
        table = read_table(path, words=True)
        fits = any(fnmatch.filter(table.columns, joint) for joint in joints)
        if joints and (fits or not _find_channels(table)[0]):
            table = _pick_columns(table, joints, unit)
    else:
        table = _number_joints(read_bag(*bag, joints), joints)
    written = _read_time(table, time_unit)
    time = _check_time(table, unwrap_clock(written))
    numbers, columns, found = _find_channels(table)
    table.refuse_words(*(table.columns[k] for k in columns))
    lenient = bad_channels == "missing"
    numbers, counted_from_0 = _count_channels(numbers, hinges, lenient)
    absent = []
    if lenient and n_channels and numbers:
        absent = [n for n in range(1, n_channels + 1) if n not in numbers]
    _check_numbers(table, [*numbers, *absent], n_channels)
    chosen = _choose_unit(table, found, unit)
    order = np.argsort(numbers)
    kept, factor = _UNITS[chosen]
    values = table.values[:, np.array(columns)[order]].T * factor
    if absent:
        values = np.insert(values, [n - 1 - k for k, n in enumerate(absent)], np.nan, axis=0)
    most = np.fmax.reduce(np.abs(values), axis=None, initial=0.0)
    if kept == "rad" and most > np.pi:
        raise InvalidInput(
            f"{table.source}: a hinge turns by {most / factor:.4g} {chosen}, more than half a turn."
            " Is the unit right?"
        )
    # columns that are neither time nor channels
    left = [
        f"{name} (text)" if name in table.words else name
        for k, name in enumerate(table.columns)
        if k not in columns and name != _find_time(table) and not _JOINT_STATE.fullmatch(name)
    ]
    more = f", … ({len(left)} in all)" if len(left) > 12 else ""
    return Recording(
        time=time,
        values=values,
        quantity=_QUANTITIES.get(kept, "angle"),
        unit=kept,
        robot=table.notes.get("robot", ""),
        source=_read_source(table),
        labels=_read_labels(table),
        **_read_beside(table, len(numbers)),
        history=(
            f"read from {table.source}",
            *([f"channels are {table.notes['channels']}"] if "channels" in table.notes else []),
            *(["decimal commas are read as points"] if "decimals" in table.notes else []),
            *(["channels are numbered from 0: hinge 1 is number 0"] if counted_from_0 else []),
            *([f"absent, made missing: {', '.join(map(str, absent))}"] if absent else []),
            *(
                table.notes[name]
                for name in ("publishers", "clock", "cut")
                if name in table.notes
            ),
            *([f"left out, being no channels: {', '.join(left[:12])}{more}"] if left else []),
            *(
                ["the board's clock of 32 bits began anew; time goes on"]
                if not np.array_equal(written, time)
                else []
            ),
            *(
                ["columns put in the order of their hinge numbers"]
                if not np.array_equal(order, np.arange(order.size))
                else []
            ),
        ),
    )


def _count_channels(
    numbers: list[int], hinges: Sequence[int], lenient: bool
) -> tuple[list[int], bool]:
    """Channels counted from 1, whether they are numbered from 0, from 1, or by their hinges, and
    whether it was from 0.
    """
    from_0 = sorted(numbers) == list(range(len(numbers))) or (lenient and 0 in numbers)
    by_hinge = not from_0 and (
        sorted(numbers) == sorted(hinges)
        or (lenient and {*numbers} < {*hinges} and max(numbers) > len(hinges))
    )
    own = [sorted(hinges).index(n) + 1 for n in numbers if n in hinges]
    if lenient and not from_0 and not by_hinge and len(own) == len(numbers) and own != numbers:
        raise InvalidInput(
            f"channels {', '.join(map(str, numbers))} may be the numbers of hinges or of sensors,"
            " which are others here. Leave absent channels in the table, empty, or name all in"
            " order with joints=."
        )
    if by_hinge:
        return [sorted(hinges).index(number) + 1 for number in numbers], False
    return [number + from_0 for number in numbers], from_0


def _read_beside(table: Table, n: int) -> dict[str, np.ndarray]:
    """Velocities [rad/ms] and efforts [N·mm] of a bag's joints, where it has them."""
    found = {}
    for what, factor in _BESIDE.items():
        names = [f"{what[1:]}{k + 1}" for k in range(n)]
        if {*names} <= {*table.columns}:
            found[what[1:]] = np.array([table.column(name) for name in names]) * factor
    return found


def find_unit(unit: str) -> tuple[str, float]:
    """The unit in which channels of ``unit`` are kept, and the factor to it."""
    if unit not in _UNITS:
        raise InvalidInput(f"unit of the channels is {unit!r}; valid: {', '.join(_UNITS)}.")
    return _UNITS[unit]


def find_time_factor(unit: str) -> float:
    """Milliseconds of one ``unit`` of time."""
    if unit not in TIME_UNITS:
        raise InvalidInput(f"time_unit={unit!r} is unknown; valid: {_TIME_VALID}.")
    return TIME_UNITS[unit]


def _number_joints(table: Table, joints: Sequence[str] = ()) -> Table:
    """Channels of a bag in the order of ``joints``, else of the numbers that end their names.

    Where some have none, they keep their own order.
    """
    names = [name for name in table.columns[1:] if not name.endswith((*_BESIDE,))]
    chosen = names if joints else sort_names(names)
    beside = [end for end in _BESIDE if f"{names[0]}{end}" in table.columns]
    index = [table.columns.index(f"{name}{end}") for end in ("", *beside) for name in chosen]
    ends = [end.removeprefix("/") for end in beside]
    columns = [f"{what}{k + 1}" for what in ("hinge", *ends) for k in range(len(names))]
    return replace(
        table,
        columns=("time_ms", *columns),
        values=table.values[:, [0, *index]],
        notes={**table.notes, "channels": ", ".join(chosen)},
    )


def _pick_columns(table: Table, joints: Sequence[str], unit: str | None) -> Table:
    """Of a table that has other columns too those that are named, base to tip, as its channels."""
    time = _find_time(table)
    chosen = choose_names([name for name in table.columns if name != time], joints)
    found = [
        re.search(rf"[\s_(\[]({'|'.join(map(re.escape, _UNITS))})[)\]]?$", name)
        for name in chosen
    ]
    units = {match[1] for match in found if match}
    said = f"_{next(iter(units))}" if len(units) == 1 and all(found) and not unit else ""
    index = [table.columns.index(name) for name in (time, *chosen)]
    columns = (time, *(f"hinge{k + 1}{said}" for k in range(len(chosen))))
    table.refuse_words(time, *chosen)
    return replace(
        table,
        columns=columns,
        values=table.values[:, index],
        words={},
        notes={**table.notes, "channels": ", ".join(chosen)},
    )


def _find_time(table: Table) -> str:
    found = [*find_times(table.columns)]
    if not found:
        raise InvalidInput(
            f"{table.source}: no time column (time_ms, time_s) among"
            f" {', '.join(table.columns[:12])}."
        )
    return found[0]


def _read_time(table: Table, time_unit: str | None) -> np.ndarray:
    column = _find_time(table)
    table.refuse_words(column)
    written = find_times([column])[column]
    unit = (written or time_unit or table.notes.get("time unit") or "").lower()
    if unit not in TIME_UNITS:
        raise InvalidInput(
            f"{table.source}: column {column!r} has no time unit; valid: {_TIME_VALID}. Name the"
            " column time_ms, or give time_unit=."
        )
    return table.column(column) * TIME_UNITS[unit]


def _check_time(table: Table, time: np.ndarray) -> np.ndarray:
    if np.isnan(time).any():
        raise InvalidInput(
            f"{table.source} line {table.line[np.argmax(np.isnan(time))]}: no time given."
        )
    back = np.flatnonzero(np.diff(time) < 0)
    if back.size:
        raise InvalidInput(
            f"{table.source} line {table.line[back[0] + 1]}: time runs backwards, from"
            f" {time[back[0]]:g} to {time[back[0] + 1]:g} ms. Is the time column swapped with a"
            " channel, or are two recordings joined?"
        )
    return time


def _find_channels(table: Table) -> tuple[list[int], list[int], list[str | None]]:
    numbers, columns, units = [], [], []
    for index, column in enumerate(table.columns):
        match = _CHANNEL.fullmatch(column)
        if match:
            numbers.append(int(match[1]))
            columns.append(index)
            unit = (match[2] or "").lower()
            units.append(next((name for name in _UNITS if name.lower() == unit), None))
    return numbers, columns, units


def _check_numbers(table: Table, numbers: list[int], n_channels: int | None) -> None:
    expected = len(numbers) if n_channels is None else n_channels
    missing = [n for n in range(1, expected + 1) if n not in numbers]
    extra = sorted(n for n in set(numbers) if not 1 <= n <= expected)
    double = sorted({n for n in numbers if numbers.count(n) > 1})
    if not numbers or len(numbers) > MAX_HINGES or missing or extra or double:
        faults = (("missing", missing), ("not expected", extra), ("twice", double))
        words = [
            f"{label} {', '.join(map(str, found[:12]))}" for label, found in faults if found
        ]
        there = "" if numbers else f" Its columns are {', '.join(table.columns[:12])}."
        wanted = f" where {expected} were expected" if expected else ""
        raise InvalidInput(
            f"{table.source}: {len(numbers)} channels{wanted}"
            f" ({'; '.join(words) or 'none found'}).{there} Name them hinge1_deg, hinge2_deg … from"
            f" the base; units are {', '.join(u for u in _UNITS if u.isascii())}. For another"
            " antenna give n_channels=. No channel is left out for you: name those of the"
            " antenna with joints=, or take absent ones as bad_channels='missing'."
        )


def _choose_unit(table: Table, found: list[str | None], unit: str | None) -> str:
    named = sorted({name for name in found if name})
    if len(named) > 1 or (named and None in found):
        shown = [name or "no unit" for name in dict.fromkeys(found)]
        raise InvalidInput(
            f"{table.source}: mixed units ({', '.join(shown)}). Give every channel the same unit."
        )
    chosen = named[0] if named else unit or table.notes.get("unit")
    if named and unit and unit != chosen:
        raise InvalidInput(
            f"{table.source}: its header says {chosen}, unit={unit!r} was given. Which is right?"
        )
    if chosen not in _UNITS:
        raise InvalidInput(
            f"{table.source}: unit of the channels is {chosen!r}; valid: {', '.join(_UNITS)}. Name"
            " the columns hinge1_deg or hinge1_pF, give unit=, or ask for run.mcap:TOPIC:UNIT."
        )
    return chosen


def _read_source(table: Table) -> str:
    source = (table.notes.get("source") or "robot").split()[0].strip(",;.").lower()
    if source not in _SOURCES:
        raise InvalidInput(
            f"{table.source}: unknown source {source!r}; valid: {', '.join(_SOURCES)}."
        )
    return source


def _read_labels(table: Table) -> dict[str, str | float]:
    labels: dict[str, str | float] = {}
    for name in _LABELS:
        text = table.notes.get(name, "").split(" ")[0]
        if not text:
            continue
        try:
            labels[name] = text if name == "feature" else float(text)
        except ValueError:
            raise InvalidInput(
                f"{table.source}: note {name!r} must be a number, got {text[:40]!r}."
            ) from None
    return labels


@checked
def save_recording(
    recording: Recording, path: str | os.PathLike, *, digits: Annotated[int, Ge(1), Le(17)] = 6
) -> None:
    """Write a recording as CSV that :func:`load_recording` reads with the same data and labels."""
    unit = recording.unit
    notes = {"source": recording.source, "robot": recording.robot, **recording.labels}
    header = ",".join(
        ["time_ms", *(f"hinge{n + 1}_{unit}" for n in range(recording.n_sensors))]
    )
    with writing(path) as part, part.open("w", encoding="utf-8", newline="\n") as file:
        file.writelines(f"# {key}: {value}\n" for key, value in notes.items() if value != "")
        file.write(header + "\n")
        np.savetxt(
            file,
            np.vstack([recording.time, recording.values]).T,
            fmt=f"%.{digits}g",
            delimiter=",",
        )


# What ``feeler info`` says of a robot's files.


def _read(path: Path, limits: Limits, trusted: bool) -> list[str]:
    """What is said of a recording; of a bag whose topic is not named, what it holds."""
    bag = find_bag(path)
    if bag is not None and not bag[1]:
        return describe_bag(bag[0])
    recording = load_recording(path, n_channels=None)
    labels = ", ".join(f"{name} {value}" for name, value in recording.labels.items())
    return [
        f"channels    {recording.n_sensors}, {recording.quantity} [{recording.unit}]",
        f"samples     {recording.time.size} over {np.ptp(recording.time):g} ms",
        f"source      {recording.source}",
        f"robot       {recording.robot or 'not said'}",
        f"labels      {labels or 'none'}",
        *(f"history     {words}" for words in recording.history),
        f"next        {_suggest(path, recording)}",
    ]


def _suggest(path: Path, recording: Recording) -> str:
    """The command that looks for faults, with the files that it needs."""
    words = ["feeler robot check", quote(path.name)]
    if recording.n_sensors != N_CHANNELS:
        words.append("--antenna robot.toml")
    if recording.quantity != "angle":
        words.append("--calibration calibration.json")
    return " ".join(words)


def _describe_calibration(lines: SensorCalibration) -> list[str]:
    return [
        f"robot       {lines.robot or 'not said'}",
        f"hinges      {lines.n_hinges}, readings in {lines.unit}",
        *(f"            {row}" for row in lines.report().splitlines()),
    ]


ROBOT_FILES = {
    "robot": Format(
        words="robot (TOML)",
        kind="robot",
        detect=lambda path, start: is_robot_file(path),
        load=lambda path, limits, trusted: load_robot(path),
        tell=lambda robot: [
            f"name        {robot.antenna.name}",
            f"hinges      {robot.antenna.n_segments}, {robot.antenna.length:g} mm",
            f"stiffness   {robot.antenna.stiffness[0]:g} (base) …"
            f" {robot.antenna.stiffness[-1]:g} (tip) N·mm/rad",
            f"damping     {robot.antenna.damping[0]:g} (base) …"
            f" {robot.antenna.damping[-1]:g} (tip) N·mm·ms/rad",
            f"calibration {robot.calibration or 'none'}",
        ],
    ),
    "bench": Format(
        words="readings of a robot's sensors at known angles",
        kind="bench",
        detect=lambda path, start: (
            {"hinge", "angle"} <= {split_unit(name)[0].lower() for name in sniff_columns(start)}
        ),
        load=lambda path, limits, trusted: load_calibration_table(path, curve="auto"),
        tell=_describe_calibration,
    ),
    "calibration": Format(
        words="calibration of a robot's sensors (JSON)",
        kind="calibration",
        detect=lambda path, start: b'"feeler sensor calibration"' in start,
        load=lambda path, limits, trusted: load_calibration(path),
        tell=_describe_calibration,
    ),
    "objects": Format(
        words="objects to touch (TOML)",
        kind="objects",
        detect=lambda path, start: b"[[object]]" in start,
        load=lambda path, limits, trusted: load_objects(path),
        tell=lambda objects: [
            f"object      {item.name}: {item.kind}, size {item.size:g} mm" for item in objects
        ],
    ),
    "recording": Format(
        words="recording of a robot",
        kind="recording",
        detect=lambda path, start: (
            find_bag(path) is not None or bool(find_times(sniff_columns(start)))
        ),
        load=_read,
        tell=list,
    ),
}
