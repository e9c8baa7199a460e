"""Sensor calibration: from what a sensor reads to its hinge's angle, kept as JSON."""

import json
import os
from pathlib import Path
from typing import Annotated

import numpy as np

from feeler.errors import InvalidInput
from feeler.files import make_record, parse_json, read_bytes, writing
from feeler.records import ALLOW_NAN, Record
from feeler.tensors.table import MAX_BYTES, Table, read_table
from feeler.validation import checked

# Sensor calibration: from what a sensor reads (capacitance, voltage, counts) to its hinge's
# angle, by linear regression per hinge.

# [C] share of the calibrated range by which a reading may lie outside and still count as inside
_MARGIN = 0.02
_MIN_READINGS = 3
MAX_HINGES = 256
_OUTSIDE = ("refuse", "clip", "missing", "extend")
ANGLE_UNITS = {"rad": 1.0, "mrad": 1e-3, "deg": np.pi / 180, "°": np.pi / 180}
READING_UNITS = {
    "pF": ("pF", 1.0),
    "fF": ("pF", 1e-3),
    "nF": ("pF", 1e3),
    "counts": ("counts", 1.0),
    "mV": ("mV", 1.0),
    "V": ("mV", 1e3),
    "ohm": ("ohm", 1.0),
    "kohm": ("ohm", 1e3),
}
"""Units of what sensors read: the unit in which it is kept, and the factor to it."""
_READINGS = ("capacitance", "voltage", "resistance", "reading")


_PerHinge = Annotated[np.ndarray, "hinge"]
_MaybePerHinge = Annotated[np.ndarray, "hinge", ALLOW_NAN]


class SensorCalibration(Record):
    """Lines angle = slope · capacitance + offset, one per hinge, and how far to trust them.

    Attributes
    ----------
    slope : _PerHinge
        (hinge,) [rad per unit].
    offset : _PerHinge
        (hinge,) [rad].
    low : _PerHinge
        (hinge,) smallest calibrated reading [unit].
    high : _PerHinge
        (hinge,) largest calibrated reading [unit].
    residual : _MaybePerHinge
        (hinge,) root mean square residual [rad].
    cross_validated : _MaybePerHinge
        (hinge,) root mean square error at angles that the line did not see (leave one angle out)
        [rad].
    resolution : _MaybePerHinge
        (hinge,) sd of repeated readings at one angle, as an angle [rad]; NaN without repeats.
    drift : _MaybePerHinge
        (hinge,) trend of the residuals in time [rad/ms]; NaN without times.
    r_squared : _MaybePerHinge
        (hinge,) share of the angles' variance that the line explains.
    robot : str
        Name of the robot the lines belong to; empty where unknown.
    unit : str
        Unit of the readings: pF, mV, ohm, or counts for uncalibrated electronics.
    """

    slope: _PerHinge
    offset: _PerHinge
    low: _PerHinge
    high: _PerHinge
    residual: _MaybePerHinge
    cross_validated: _MaybePerHinge
    resolution: _MaybePerHinge
    drift: _MaybePerHinge
    r_squared: _MaybePerHinge
    robot: str = ""
    unit: str = "pF"

    def _check(self) -> None:
        sizes = {
            values.size for values in vars(self).values() if isinstance(values, np.ndarray)
        }
        if len(sizes) != 1 or not 1 <= self.n_hinges <= MAX_HINGES:
            raise InvalidInput(
                "a calibration has one number per hinge in each list, for 1 to"
                f" {MAX_HINGES} hinges; got lists of {', '.join(map(str, sorted(sizes)))}."
            )
        if np.any(self.low > self.high):
            raise InvalidInput("a calibrated range is empty: low > high.")

    @property
    def n_hinges(self) -> int:
        """Number of hinges."""
        return self.slope.size

    def apply(
        self, capacitance: np.ndarray, *, robot: str = "", outside: str = "refuse"
    ) -> np.ndarray:
        """Angles (hinge, sample) [rad] of capacitances (hinge, sample).

        Parameters
        ----------
        robot
            Name of the robot that was recorded; refused where it differs from the calibrated one.
        outside
            What to do with readings beyond the calibrated range (by more than 2 % of it):
            ``refuse``, ``clip`` to the range, ``missing`` (NaN), or ``extend`` the line.

        Raises
        ------
        InvalidInput
            Another robot, another number of hinges, or readings outside the range under ``refuse``.
        """
        capacitance = np.asarray(capacitance, dtype=float)
        self._check_readings(capacitance, robot, outside)
        slope, offset, low, high = (
            v[:, None] for v in (self.slope, self.offset, self.low, self.high)
        )
        margin = _MARGIN * (high - low)
        beyond = (capacitance < low - margin) | (capacitance > high + margin)
        if outside == "refuse" and beyond.any():
            raise InvalidInput(self._describe(capacitance, beyond))
        if outside == "clip":
            capacitance = np.where(beyond, np.clip(capacitance, low, high), capacitance)
        angle = slope * capacitance + offset
        return np.where(beyond, np.nan, angle) if outside == "missing" else angle

    def _check_readings(self, capacitance: np.ndarray, robot: str, outside: str) -> None:
        if outside not in _OUTSIDE:
            raise InvalidInput(f"unknown outside={outside!r}; valid: {', '.join(_OUTSIDE)}.")
        if capacitance.ndim != 2 or capacitance.shape[0] != self.n_hinges:
            raise InvalidInput(
                f"the calibration is for {self.n_hinges} hinges, the readings have shape"
                f" {capacitance.shape}; expected (hinge, sample)."
            )
        if robot and self.robot and robot != self.robot:
            raise InvalidInput(
                f"the calibration belongs to robot {self.robot!r}, the recording to {robot!r}."
                " Calibrate that robot."
            )

    def _describe(self, capacitance: np.ndarray, beyond: np.ndarray) -> str:
        hinge = int(np.argmax(beyond.sum(axis=1)))
        values = capacitance[hinge][beyond[hinge]]
        return (
            f"{int(beyond.sum())} readings lie outside the calibrated range, most in hinge"
            f" {hinge + 1}: {values.min():.4g} to {values.max():.4g} {self.unit}, calibrated"
            f" {self.low[hinge]:.4g} to {self.high[hinge]:.4g}. Calibrate a wider range, or choose"
            " outside='clip', 'missing' or 'extend'."
        )

    def report(self) -> str:
        """A table in words, one row per hinge, angles in degrees."""
        rows = [
            "hinge   °/unit      R²   residual °   cross-validated °   resolution °   drift °/min"
        ]
        per_minute = self.drift * 6e4
        columns = (self.slope, self.residual, self.cross_validated, self.resolution, per_minute)
        for n, (slope, rms, cv, resolution, drift) in enumerate(np.rad2deg(columns).T):
            rows.append(
                f"{n + 1:5d} {slope:8.3g} {self.r_squared[n]:7.4f} {rms:12.3f} {cv:19.3f}"
                f" {resolution:14.3f} {drift:13.3g}"
            )
        return "\n".join(rows)


_MAX_READING = 1e15  # [C] in any unit; squares of it are still finite


@checked
def fit_sensors(
    hinge: np.ndarray,
    angle: np.ndarray,
    capacitance: np.ndarray,
    *,
    time: np.ndarray | None = None,
    robot: str = "",
    unit: str = "pF",
) -> SensorCalibration:
    """Least-squares line per hinge from readings (reading,) at known angles (Fig. 6A iii).

    Parameters
    ----------
    hinge
        Hinge number of each reading, 1 to the number of hinges.
    angle, capacitance
        Known angle [rad] and reading [unit].
    time
        When each reading was made [ms], for the drift.

    Raises
    ------
    InvalidInput
        A hinge with fewer than 3 readings or 2 angles, a reading that does not change with the
        angle, missing hinges.
    """
    hinge, angle, capacitance = (
        np.asarray(v, dtype=float) for v in (hinge, angle, capacitance)
    )
    time = np.full(hinge.shape, np.nan) if time is None else np.asarray(time, dtype=float)
    if not hinge.shape == angle.shape == capacitance.shape == time.shape or hinge.ndim != 1:
        raise InvalidInput("hinge, angle, capacitance and time must be lists of one length.")
    if not all(np.all(np.isfinite(v)) for v in (hinge, angle, capacitance)):
        raise InvalidInput(
            "a calibration table must be complete: hinge, angle and capacitance in every row."
        )
    if any(
        np.nanmax(np.abs(v), initial=0.0) > _MAX_READING for v in (angle, capacitance, time)
    ):
        raise InvalidInput(
            f"angles, readings and times beyond ±{_MAX_READING:g} are no measurements. Check the"
            " table."
        )
    n = _count_hinges(hinge)
    lines = [
        _fit_one(k, angle[hinge == k], capacitance[hinge == k], time[hinge == k])
        for k in range(1, n + 1)
    ]
    arrays = {key: np.array([line[key] for line in lines]) for key in lines[0]}
    return SensorCalibration(**arrays, robot=robot, unit=unit)


def _count_hinges(hinge: np.ndarray) -> int:
    numbers = np.unique(hinge)
    if numbers.size > MAX_HINGES:
        raise InvalidInput(
            f"a robot has at most {MAX_HINGES} hinges, got readings of {numbers.size}."
        )
    if numbers.size == 0 or not np.array_equal(numbers, np.arange(1, numbers.size + 1)):
        shown = ", ".join(f"{number:g}" for number in numbers[:12])
        raise InvalidInput(
            f"hinges must be numbered 1, 2, … without a hole, got {shown or 'none'}."
        )
    return numbers.size


def _fit_one(
    number: int, angle: np.ndarray, capacitance: np.ndarray, time: np.ndarray
) -> dict[str, float]:
    levels = np.unique(np.round(angle, 9))
    if angle.size < _MIN_READINGS or levels.size < 2:
        raise InvalidInput(
            f"hinge {number} has {angle.size} readings at {levels.size} angles; a line needs"
            f" {_MIN_READINGS} at 2."
        )
    if _is_flat(capacitance):
        raise InvalidInput(
            f"hinge {number} reads {capacitance[0]:g} at every angle: a dead or unconnected sensor."
        )
    slope, offset = np.polyfit(capacitance, angle, 1)
    residual = angle - (slope * capacitance + offset)
    return {
        "slope": slope,
        "offset": offset,
        "low": capacitance.min(),
        "high": capacitance.max(),
        "residual": np.sqrt(np.mean(residual**2)),
        "cross_validated": _leave_one_angle_out(angle, capacitance, levels),
        "resolution": abs(slope) * _repeat_spread(np.round(angle, 9), capacitance),
        "drift": _trend(time, residual),
        "r_squared": 1 - residual.var() / angle.var(),
    }


def _is_flat(readings: np.ndarray) -> bool:
    """Whether readings differ by no more than their own rounding, or by less than any board can
    say.
    """
    return bool(np.ptp(readings) <= max(1e-12 * np.abs(readings).max(), 1 / _MAX_READING))


def _leave_one_angle_out(
    angle: np.ndarray, capacitance: np.ndarray, levels: np.ndarray
) -> float:
    if levels.size < 3:
        return float("nan")
    errors = []
    for level in levels:
        held = np.round(angle, 9) == level
        if _is_flat(capacitance[~held]):
            return float("nan")
        slope, offset = np.polyfit(capacitance[~held], angle[~held], 1)
        errors.append(angle[held] - (slope * capacitance[held] + offset))
    return float(np.sqrt(np.mean(np.concatenate(errors) ** 2)))


def _repeat_spread(angle: np.ndarray, capacitance: np.ndarray) -> float:
    """Pooled sd of readings at equal angles."""
    groups = [capacitance[angle == level] for level in np.unique(angle)]
    freedom = sum(group.size - 1 for group in groups)
    if freedom == 0:
        return float("nan")
    return float(
        np.sqrt(sum(((group - group.mean()) ** 2).sum() for group in groups) / freedom)
    )


def _trend(time: np.ndarray, residual: np.ndarray) -> float:
    if not np.all(np.isfinite(time)) or _is_flat(time):
        return float("nan")
    return float(np.polyfit(time - time.mean(), residual, 1)[0])


@checked
def load_calibration_table(path: str | os.PathLike) -> SensorCalibration:
    """Fit the lines to a CSV table of a calibration bench.

    Columns are ``hinge``, ``angle_deg`` (or ``_rad``), ``capacitance_pF`` (or ``_fF``, ``_counts``,
    ``voltage_mV``, ``resistance_ohm``) and optionally ``time_ms``; a note ``# robot: NAME`` names
    the robot.
    """
    table = read_table(path, max_bytes=MAX_BYTES, words=True)
    angle = _take(table, {f"angle_{unit}": factor for unit, factor in ANGLE_UNITS.items()})
    named = {f"{what}_{unit}": unit for what in _READINGS for unit in READING_UNITS}
    capacitance = _take(table, {name: READING_UNITS[unit][1] for name, unit in named.items()})
    unit = next(READING_UNITS[unit][0] for name, unit in named.items() if name in table.columns)
    time = table.column("time_ms") if "time_ms" in table.columns else None
    return fit_sensors(
        table.column("hinge"),
        angle,
        capacitance,
        time=time,
        robot=table.notes.get("robot", ""),
        unit=unit,
    )


def _take(table: Table, factors: dict[str, float]) -> np.ndarray:
    for name, factor in factors.items():
        if name in table.columns:
            return factor * table.column(name)
    what = next(iter(factors)).partition("_")[0]
    valid = ", ".join(name for name in factors if name.isascii() and name.startswith(what))
    raise InvalidInput(
        f"{table.source}: no {what} column; valid: {valid}. It has {', '.join(table.columns[:12])}."
    )


# A sensor calibration on disk: JSON that people read too, nothing in it is ever executed.

_FORMAT = "feeler sensor calibration"
_VERSION = 1
_MAX_FILE = 2**20


@checked
def save_calibration(calibration: SensorCalibration, path: str | os.PathLike) -> None:
    """Write the lines as JSON: readable, versioned, nothing in it is ever executed."""
    plain = calibration.to_plain()
    robot, unit = plain.pop("robot"), plain.pop("unit")
    content = {"format": _FORMAT, "version": _VERSION, "robot": robot, "unit": unit}
    for name, values in plain.items():
        content[name] = [None if np.isnan(value) else value for value in values]
    with writing(path) as part:
        part.write_text(json.dumps(content, indent=1) + "\n", encoding="utf-8")


@checked
def load_calibration(path: str | os.PathLike) -> SensorCalibration:
    """Read what :func:`save_calibration` wrote.

    Raises
    ------
    InvalidInput
        Not such a file, another version, or damaged content.
    """
    try:
        content = parse_json(read_bytes(path, _MAX_FILE), os.fspath(path))
    except InvalidInput as error:
        advice = "`feeler robot calibrate` makes a calibration from a table."
        raise InvalidInput(f"{error} {advice}") from error
    if content.pop("format", None) != _FORMAT:
        raise InvalidInput(
            f"{path} is no sensor calibration of feeler. Make one with `feeler robot calibrate`."
        )
    if (version := content.pop("version", None)) != _VERSION:
        raise InvalidInput(
            f"{path} has version {version!r}; this feeler reads version {_VERSION}."
        )
    return make_record(SensorCalibration, content, Path(path).name)
