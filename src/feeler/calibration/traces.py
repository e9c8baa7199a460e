"""Recorded free responses of several animals: read, cut at the release, measured, simulated."""

import re
from collections.abc import Sequence
from importlib.resources import files
from pathlib import Path
from typing import Annotated

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.signal import savgol_filter

from feeler.analysis import FreeResponse, check_trace, measure_free_response
from feeler.antenna.segments import Antenna
from feeler.calibration.hinges import make_scale
from feeler.calibration.problem import Protocol
from feeler.errors import FeelerError, InvalidInput
from feeler.physics.scene import MAX_SAMPLES
from feeler.records import ALLOW_NAN, Choice, Gt, Record, freeze
from feeler.tables import (
    ROW,
    TIME_UNITS,
    Table,
    find_times,
    parse_table,
    read_table,
)
from feeler.validation import Count, checked

# Recorded free responses: tip displacement of several animals over time, from a CSV file.

_EXAMPLE = "synthetic_step"
MAX_GAP = 5  # [C] samples, as in tracks


class Traces(Record):
    """Free responses that were sampled together.

    A trace's name is its animal's, for the tip; ``animal@0.5`` is another point, at that fraction
    of the length.

    Attributes
    ----------
    time : np.ndarray
        (sample,) since the release [ms].
    displacement : np.ndarray
        (trace, sample), in any unit.
    found : bool
        Whether the release was found in the traces, and is thus known to a few samples only.
    bridged : np.ndarray
        Samples (trace, sample) that were missing and are filled in; a fit leaves them out.
    """

    time: Annotated[np.ndarray, "sample", ALLOW_NAN]
    displacement: Annotated[np.ndarray, "trace sample", ALLOW_NAN]
    names: tuple[str, ...]
    source: str = "recorded"
    found: bool = False
    bridged: Annotated[np.ndarray, "trace? sample?"] = False  # type: ignore[assignment]  # none

    def _check(self) -> None:
        if self.displacement.shape != (len(self.names), self.time.size):
            raise InvalidInput(
                "Traces need one name per animal and one displacement per sample: got"
                f" {len(self.names)} names, {self.time.size} samples and displacement of shape"
                f" {self.displacement.shape}."
            )
        if len(set(self.names)) < len(self.names):
            raise InvalidInput(f"Traces need names that differ, got {', '.join(self.names)}.")
        shape = self.displacement.shape
        vars(self)["bridged"] = freeze(np.broadcast_to(self.bridged, shape), bool)
        for name, row in zip(self.names, self.displacement, strict=True):
            check_trace(self.time, row, f"trace {name!r}")
            read_place(name)

    @property
    def animals(self) -> tuple[str, ...]:
        """Who was recorded, in order."""
        return tuple(dict.fromkeys(name.partition("@")[0] for name in self.names))

    def take(self, animal: str) -> tuple[np.ndarray, np.ndarray]:
        """Places (point,), rising, and displacements (point, sample) of one animal."""
        rows = self._list_rows(animal)
        return np.array([read_place(self.names[k]) for k in rows]), self.displacement[rows]

    def take_seen(self, animal: str) -> np.ndarray:
        """Whether its samples (point, sample) were recorded and not filled in."""
        return ~self.bridged[self._list_rows(animal)]

    def select(self, animal: str) -> "Traces":
        """The traces of one animal."""
        rows = self._list_rows(animal)
        return self.replace(
            names=[self.names[k] for k in rows],
            displacement=self.displacement[rows],
            bridged=self.bridged[rows],
        )

    def _list_rows(self, animal: str) -> list[int]:
        """The rows of one animal, base to tip."""
        rows = [k for k, name in enumerate(self.names) if name.partition("@")[0] == animal]
        return sorted(rows, key=lambda k: read_place(self.names[k]))


def read_place(name: str, what: str = "trace") -> float:
    """The fraction of the length that a point's name says; 1, the tip, where it says none. A trace
    is not of the base, at 0.
    """
    _, at, text = name.partition("@")
    try:
        place = float(text) if at else 1.0
    except ValueError:
        place = float("nan")
    if not 0 <= place <= 1 or (place == 0 and what == "trace"):
        span = "> 0 and ≤ 1, as in a@0.5" if what == "trace" else "from 0 to 1"
        raise InvalidInput(
            f"{what} {name!r}: what follows @ is a fraction of the length, {span}."
        )
    return place


@checked
def load_traces(
    path: str | Path,
    *,
    frame_rate: Annotated[float, Gt(0)] | None = None,
    release: Annotated[str, Choice(("first", "found"))] = "first",
    max_gap: int = MAX_GAP,
) -> Traces:
    """Traces from a CSV table: a column of time or frames, and a named column per animal.

    Time is ``time_ms``, ``time_s`` or ``frame``; the other columns are displacements.

    A column is the tip's, or ``animal@0.5`` a point's at half of the length; any unit serves, as
    only shapes are used. Lines that begin with ``#`` are comments. ``synthetic_step`` names the
    example that ships with feeler: simulated, noisy.

    Parameters
    ----------
    frame_rate
        Frames per second, for a column ``frame``.
    release
        ``first``: the first sample is the release and displacement is from rest. ``found``: traces
        begin while held and end at rest; release and rest are found in each animal's outermost
        point (:func:`find_release`).
    max_gap
        Longest gap (empty cells) that is filled in [samples]; what is filled in does not count in a
        fit.

    Raises
    ------
    InvalidInput
        A missing time column, text among the numbers, no trace, a trace that cannot be measured
        (gaps, uneven time), or no release where one is to be found.
    """
    if path == _EXAMPLE:
        text = (files("feeler.calibration") / "data" / f"{_EXAMPLE}.csv").read_text(
            encoding="utf-8"
        )
        table = parse_table(text, source=_EXAMPLE)
    elif Path(path).is_file():
        table = read_table(path)
    else:
        raise InvalidInput(
            f"cannot read {path}: no such file. Give a CSV file, or {_EXAMPLE!r} for the example."
        )
    time = _read_time(table, frame_rate)
    beside = (*find_times(table.columns), "frame", ROW)
    names = tuple(
        name
        for name in table.columns
        if name not in beside
        and not (np.diff(table.column(name)) == 1).all()  # numbers of rows
    )
    if not names:
        raise InvalidInput(f"{table.source} has no column of an animal beside its time.")
    if channel := next((name for name in names if re.match(r"hinge\d", name)), None):
        raise InvalidInput(f"{table.source} has a channel {channel!r} of a robot.")
    moved = table.values[:, [table.columns.index(name) for name in names]]
    bridged = np.isnan(moved)
    displacement = bridge(moved, max_gap, names, table.source).T
    words = " ".join((str(path), *table.notes.keys(), *table.notes.values())).lower()
    traces = Traces(
        time=time - time[0] if len(time) else time,
        displacement=displacement,
        names=names,
        source="synthetic" if "synthetic" in words else "recorded",
        bridged=bridged.T,
    )
    return traces if release == "first" else cut_at_release(traces)


def bridge(
    values: np.ndarray, max_gap: int, names: Sequence[str], source: str, first: int = 0
) -> np.ndarray:
    """Values (sample, column) in which gaps of at most ``max_gap`` samples are filled by a monotone
    cubic (PCHIP) through the others.

    Raises
    ------
    InvalidInput
        A longer gap, or one at either end; ``first`` is the number of the first sample there.
    """
    missing = np.isnan(values)
    if not missing.any():
        return values
    for name, column in zip(names, missing.T, strict=True):
        edges = np.flatnonzero(np.diff(np.concatenate(([0], column, [0]))))
        for start, stop in edges.reshape(-1, 2):
            if stop - start > max_gap or start == 0 or stop == len(column):
                where = f"from sample {first + start} to {first + stop - 1}"
                raise InvalidInput(
                    f"{source}: {name} is missing {where}. Gaps of up to {max_gap} samples are"
                    f" filled in; with max_gap={stop - start} this one would be, and it would not"
                    " count in the fit. Or cut the trace."
                    if start and stop < len(column)
                    else f"{source}: {name} is missing {where}, at an end. Cut the trace there."
                )
    from pandas import DataFrame

    return DataFrame(values).interpolate(method="pchip").to_numpy()


def _read_time(table: Table, frame_rate: float | None) -> np.ndarray:
    """Time [ms] of each row."""
    clocks = {name: unit for name, unit in find_times(table.columns).items() if unit}
    column = next((name for name in (*clocks, "frame") if name in table.columns), None)
    if column is None or len(table.columns) < 2:
        raise InvalidInput(
            f"{table.source} needs a column time_ms or time_s or frame and one named column per"
            f" animal; its header is {', '.join(table.columns[:12])}."
        )
    if (column == "frame") != (frame_rate is not None):
        raise InvalidInput(
            f"{table.source} counts frames: say how many per second (frame_rate=)."
            if column == "frame"
            else (
                f"{table.source} holds times ({column}); a frame rate is for a column called frame."
            )
        )
    if frame_rate is None:
        return table.column(column) * TIME_UNITS[clocks[column]]
    return table.column(column) * (1000.0 / frame_rate)


@checked
def cut_at_release(traces: Traces) -> Traces:
    """Traces from rest, each animal's cut at its own release (:func:`find_release`).

    All are as long as the shortest.
    """
    parts: dict[str, np.ndarray] = {}
    filled: dict[str, np.ndarray] = {}
    for animal in traces.animals:
        points = [name for name in traces.names if name.partition("@")[0] == animal]
        rows = {name: traces.displacement[traces.names.index(name)] for name in points}
        outermost = max(points, key=read_place)
        first, _ = find_release(rows[outermost], f"trace {outermost!r}")
        parts |= {name: row[first:] - find_rest(row) for name, row in rows.items()}
        filled |= {name: traces.bridged[traces.names.index(name)][first:] for name in points}
    count = min(map(len, parts.values()))
    together, bridged = (
        np.array([found[name][:count] for name in traces.names]) for found in (parts, filled)
    )
    return traces.replace(
        time=traces.time[:count], displacement=together, bridged=bridged, found=True
    )


# What one recorded trace shows in spite of its noise: where it is released, where it comes to
# rest, damped frequency and damping ratio.

_MIN_FREQUENCY, _MAX_FREQUENCY = (
    5e-4,
    1.0,
)  # kHz [C]; cricket and cockroach antennae swing at tens of Hz
# [C] white noise, as a share of the first deflection, beyond which no turning point can be trusted
_MAX_JUMP = 0.25
_TAIL = 0.2  # [C] share of the trace at its end that is taken for rest
_HELD = 5  # samples at the beginning, at least, that are taken for held
_LEAVES = 0.01  # [C] share of the held displacement that counts as having left it
_UNCLEAR = 4.0  # [C] a step must be so many times the noise of the held part and of the end


@checked
def measure_trace(time: np.ndarray, trace: np.ndarray, name: str = "trace") -> FreeResponse:
    """Free response of a recorded trace; turning points within its noise do not count.

    Raises
    ------
    InvalidInput
        A trace that cannot be measured, or in another unit of time.
    """
    check_trace(time, trace, f"trace {name!r}")
    noise = float(
        np.std(np.diff(trace, 2))
        / np.sqrt(6.0)
        / max(abs(trace[0]), 0.05 * np.abs(trace).max())
    )
    if noise > _MAX_JUMP:
        raise InvalidInput(
            f"trace {name!r} jumps from sample to sample by {noise:.0%} of its first deflection: it"
            f" swings faster than its sampling rate ({1 / (time[1] - time[0]):g} kHz) can show, or"
            " is too noisy. Sample faster, and check that the first sample is the release."
        )
    try:
        # The trace through a cubic Savitzky–Golay filter, so that noise moves no turning
        # point.
        crossing = int(np.argmax(trace * np.sign(trace[0]) <= 0))
        window = 2 * int(0.4 * crossing) + 1
        free = measure_free_response(
            time,
            (savgol_filter(trace, window, 3) if 5 <= window < trace.size else trace),
            floor=float(np.clip(4 * noise, 1e-3, 0.2)),
        )
    except FeelerError as error:
        raise InvalidInput(f"trace {name!r}: {error}") from error
    if free.frequency is not None and not _MIN_FREQUENCY <= free.frequency <= _MAX_FREQUENCY:
        units = ("s", "ms") if free.frequency > _MAX_FREQUENCY else ("ms", "s")
        raise InvalidInput(
            f"trace {name!r} swings at {1e3 * free.frequency:g} Hz, which no antenna does: its time"
            f" is probably in {units[0]}, not {units[1]}. Name the column time_{units[0]}."
        )
    return free


@checked
def find_rest(signal: Annotated[np.ndarray, "sample"]) -> float:
    """Where a trace comes to rest: the median of its last fifth."""
    signal = np.asarray(signal, dtype=float)
    if signal.size == 0:
        raise InvalidInput("signal must hold one sample or more, got none.")
    return float(np.median(signal[-max(_HELD, int(_TAIL * signal.size)) :]))


@checked
def find_release(
    signal: Annotated[np.ndarray, "sample"], name: str = "trace"
) -> tuple[int, float]:
    """Number of the last held sample, and the position at rest, of a trace that is let go.

    Rest is :func:`find_rest`. Let go, a tip may first rise: the release is the last sample before
    the trace leaves the held displacement, by more than four standard deviations of the noise or 1
    %, for two samples.

    Raises
    ------
    InvalidInput
        No held part, or no step: what is held and what is at rest differ by less than four times
        the noise.
    """
    rest = find_rest(signal)
    signal = np.asarray(signal, dtype=float)
    shown = signal - rest
    held = float(np.median(shown[:_HELD]))
    noise = 1.4826 * float(np.median(np.abs(np.diff(shown, 2)))) / np.sqrt(6.0)
    if abs(held) <= _UNCLEAR * noise or held == 0.0:
        raise InvalidInput(
            f"{name}: no release is found: it begins at {signal[:_HELD].mean():.4g} and ends at"
            f" {rest:.4g}, with a noise of {noise:.2g}. Begin while the antenna is held and end"
            " when it has settled, or cut the trace at the release and say release='first'."
        )
    away = np.abs(shown - held) > max(_UNCLEAR * noise, _LEAVES * abs(held))
    last = int(np.argmax(away[:-1] & away[1:])) - 1
    if last < _HELD - 1:
        raise InvalidInput(
            f"{name}: the antenna is let go within the first {_HELD} samples, so how far it was"
            " held is not known. Begin earlier, or cut the trace at the release and say"
            " release='first'."
        )
    return last, rest


# Fit your own animals: hinges from recorded free responses.

LATE = (-1.0, 4.0)  # samples [C]; so early or late may a release be that was found in a trace


def simulate_steps(
    antennas: Sequence[Antenna],
    protocol: Protocol,
    time: np.ndarray,
    places: Sequence[float] | np.ndarray = (1.0,),
    shifts: Sequence[float] | np.ndarray | None = None,
) -> np.ndarray:
    """Displacement (antenna, place, sample) after a step at ``time`` + shift [ms] from release.

    1 is the last place's displacement while it is held, as it is before the release.
    """
    found = []
    outcomes = protocol.simulate_steps(antennas, places)
    for outcome, shift in zip(
        outcomes, np.zeros(len(antennas)) if shifts is None else shifts, strict=True
    ):
        if isinstance(outcome, Exception):
            raise outcome
        own, moved = outcome
        found.append(
            CubicSpline(own, moved / moved[-1, 0], axis=1)(np.maximum(time + shift, 0.0))
        )
    return np.array(found)


def project(jacobian: np.ndarray, others: np.ndarray) -> np.ndarray:
    """What of the jacobian's columns the others cannot undo."""
    return (
        jacobian - others @ np.linalg.lstsq(others, jacobian, rcond=None)[0]
        if others.size
        else jacobian
    )


def subtract(simulated: np.ndarray, goal: np.ndarray) -> np.ndarray:
    """Simulated − recorded with the simulated amplitude (linear) at its best."""
    amplitude = simulated @ goal / np.einsum("ij,ij->i", simulated, simulated)
    return amplitude[:, None] * simulated - goal


@checked
def make_synthetic_traces(
    antenna: Antenna,
    rng: np.random.Generator,
    *,
    n_animals: Count = 5,
    spread: float = 0.05,
    noise: float = 0.01,
    interval: Annotated[float, Gt(0)] = 1.0,
    duration: Annotated[float, Gt(0)] = 90.0,
    protocol: Protocol | None = None,
    planted: tuple[float, float] = (1.0, 1.0),
) -> Traces:
    """Simulated free responses of several animals, sampled at 1000 frames/s as the real ones.

    Each animal's stiffness and damping factors lie around ``planted`` (log-normal, sd ``spread``);
    white noise has an sd of ``noise`` of the first deflection.
    """
    if not duration / interval <= MAX_SAMPLES:
        raise InvalidInput(
            f"{duration:g} ms at an interval of {interval:g} ms are more than {MAX_SAMPLES:,}"
            " samples; use a longer interval."
        )
    hinges = make_scale(antenna)
    time = np.arange(0.0, duration, interval)
    protocol = (protocol or Protocol()).replace(step_duration=duration + 1.0)
    xs: np.ndarray = np.log(planted) + spread * rng.standard_normal((n_animals, 2))
    tips = simulate_steps([hinges.build(np.exp(x)) for x in xs], protocol, time)[:, 0]
    noisy = 8.0 * (tips + noise * rng.standard_normal(tips.shape))
    names = tuple(f"synthetic{k + 1}" for k in range(n_animals))
    return Traces(time=time, displacement=noisy, names=names, source="synthetic")
