"""Sensor calibration: from what a sensor reads to its hinge's angle, kept as JSON."""

import json
import os
from collections.abc import Callable
from functools import cached_property
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from scipy.interpolate import PchipInterpolator
from sklearn.isotonic import isotonic_regression

from feeler.errors import InvalidInput
from feeler.files import make_record, parse_json, read_bytes, writing
from feeler.records import ALLOW_NAN, Record
from feeler.tables import MAX_BYTES, TIME_UNITS, find_times, read_table
from feeler.validation import Choice, checked

# Sensor calibration: from what a sensor reads (capacitance, voltage, counts) to its hinge's
# angle, by linear regression per hinge, or by a curve where a straight line leaves a bend.

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
    "mT": ("mT", 1.0),
    "uT": ("mT", 1e-3),
    "µT": ("mT", 1e-3),
    "ustrain": ("ustrain", 1.0),
}
"""Units of what sensors read: the unit in which it is kept, and the factor to it."""
_READINGS = ("reading", "capacitance", "voltage", "resistance", "field", "strain")
_NUMBERED = ("hinge", "sensor", "channel", "joint")  # what the channels of a table are called


CURVES = ("line", "quadratic", "cubic", "spline")
"""What angle may be of a reading: polynomials, or a monotone cubic spline (PCHIP)."""
_FOLLOWS = 0.5  # [C] R² of a sensor's line, below which it does not measure its hinge
_FLAT = 3  # [C] angles in a row at one end, from which on equal readings are saturated
_LEVELS = dict(zip(CURVES, (3, 4, 5, 5), strict=True))  # [C] least angles to be cross-validated
_BETTER = 0.9  # [C] of a simpler curve's error: what a more flexible one must reach
_KNOTS = 33  # [C] of the table in which a curve is kept
_PerHinge = Annotated[np.ndarray, "hinge"]
_MaybePerHinge = Annotated[np.ndarray, "hinge", ALLOW_NAN]


class SensorCalibration(Record):
    """Lines angle = slope · capacitance + offset, or curves, one per hinge, and how far to trust
    them.

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
        Unit of the readings: pF, mV, ohm, mT, ustrain, or counts for uncalibrated electronics.
    curve : str
        ``line``, or the curve that is used in its stead: ``quadratic``, ``cubic``, ``spline``.
    readings, angles : np.ndarray | None
        (hinge, knot) the curve as a table, joined by a monotone cubic spline (PCHIP) and beyond its
        ends by straight lines; None for lines.
    straight : np.ndarray | None
        (hinge,) root mean square residual of the straight line [rad].
    hysteresis : np.ndarray | None
        (hinge,) how much larger the angle is than the curve says on the way up than on the way down
        [rad]; NaN where the bench moved one way only.
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
    curve: Annotated[str, Choice(CURVES)] = "line"
    readings: Annotated[np.ndarray, "hinge knot"] | None = None
    angles: Annotated[np.ndarray, "hinge knot"] | None = None
    straight: _MaybePerHinge | None = None
    hysteresis: _MaybePerHinge | None = None

    def _check(self) -> None:
        sizes = {
            len(values) for values in vars(self).values() if isinstance(values, np.ndarray)
        }
        tables = [table for table in (self.readings, self.angles) if table is not None]
        if len(tables) != (0 if self.curve == "line" else 2) or (
            tables and (tables[0].shape != tables[1].shape or (np.diff(tables[0]) <= 0).any())
        ):
            raise InvalidInput(
                f"a calibration by {self.curve} has readings that rise and angles of one shape"
                " (hinge, knot), one by lines has neither."
            )
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
            ``refuse``, ``clip`` to the range, ``missing`` (NaN), or ``extend`` the line (of a
            curve, its slope at the end).

        Raises
        ------
        InvalidInput
            Another robot, another number of hinges, or readings outside the range under ``refuse``.
        """
        capacitance = np.asarray(capacitance, dtype=float)
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
        slope, offset, low, high = (
            v[:, None] for v in (self.slope, self.offset, self.low, self.high)
        )
        beyond = self.find_outside(capacitance)
        if outside == "refuse" and beyond.any():
            raise InvalidInput(self.describe_outside(capacitance))
        if outside == "clip":
            capacitance = np.where(beyond, np.clip(capacitance, low, high), capacitance)
        angle = slope * capacitance + offset
        if self._curves:
            found = zip(self._curves, capacitance, strict=True)
            angle = np.array([curve(values) for curve, values in found])
        return np.where(beyond, np.nan, angle) if outside == "missing" else angle

    def find_outside(self, capacitance: np.ndarray) -> np.ndarray:
        """Which readings (hinge, sample) lie outside their range, by more than 2 % of it."""
        low, high = self.low[:, None], self.high[:, None]
        margin = _MARGIN * (high - low)
        return (capacitance < low - margin) | (capacitance > high + margin)

    @cached_property
    def _curves(self) -> list[Callable[[np.ndarray], np.ndarray]]:
        """Angle as a function of the reading, hinge by hinge; none for lines."""
        if self.readings is None or self.angles is None:
            return []
        return [_join(*table) for table in zip(self.readings, self.angles, strict=True)]

    def describe_outside(self, capacitance: np.ndarray) -> str:
        """What lies outside the calibrated range, in words."""
        beyond = self.find_outside(capacitance)
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
        head = f"{'°/' + self.unit:>9}"
        rows = [
            f"hinge{head}      R²   residual °   cross-validated °   resolution °   drift °/min"
            "   angles °"
        ]
        ends = np.array([self.low, self.high]).T
        spans = np.rad2deg(np.sort(self.apply(ends), axis=1))
        per_minute = self.drift * 6e4
        columns = (self.slope, self.residual, self.cross_validated, self.resolution, per_minute)
        for n, (slope, rms, cv, resolution, drift) in enumerate(np.rad2deg(columns).T):
            rows.append(
                f"{n + 1:5d} {slope:8.3g} {self.r_squared[n]:7.4f} {rms:12.3f} {cv:19.3f}"
                f" {resolution:14.3f} {drift:13.3g}   {spans[n, 0]:.2f} to {spans[n, 1]:.2f}"
            )
        return "\n".join(rows)

    def explain(self) -> list[str]:
        """What the numbers mean, in sentences: the bend that a straight line leaves, the curve that
        is used, hysteresis.
        """
        middle = {
            name: float(np.rad2deg(np.nanmedian(np.abs(values))))
            for name in ("straight", "residual", "cross_validated", "resolution", "hysteresis")
            if (values := getattr(self, name)) is not None and np.isfinite(values).any()
        }
        said = []
        repeat = middle.get("resolution", float("nan"))
        beside = f", repeatability {repeat:.2g}°" if repeat == repeat else ""
        straight = middle.get("straight", middle["residual"])
        if self.curve != "line":
            said.append(
                f"a straight line leaves {straight:.2g}°{beside} (medians over hinges): a"
                f" {self.curve} curve leaves {middle['residual']:.2g}° and is used"
            )
        elif straight > 2 * repeat + 0.5 * middle.get("hysteresis", 0.0):
            said.append(
                f"a straight line leaves {straight:.2g}°{beside}: no curve is better at angles that"
                " it did not see by a tenth, or lines were asked for"
            )
        wide = middle.get("hysteresis", 0.0)
        if wide > max(2 * repeat, 0.05) or (repeat != repeat and wide > 0.2):
            said.append(
                f"hysteresis: readings on the way up and on the way down differ by {wide:.2g}°,"
                " which no curve can mend"
            )
        return said


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
    curve: Annotated[str, Choice(("auto", *CURVES))] = "line",
) -> SensorCalibration:
    """Least-squares line, or curve, per hinge from readings (reading,) at known angles (Fig. 6A
    iii).

    Parameters
    ----------
    hinge
        Hinge number of each reading, 1 to the number of hinges.
    angle, capacitance
        Known angle [rad] and reading [unit].
    time
        When each reading was made [ms], for the drift.
    curve
        ``line``, ``quadratic``, ``cubic``, ``spline`` (monotone, through the mean reading at each
        angle); ``auto``: the simplest whose error at angles that it did not see is within a tenth
        of the best.

    Raises
    ------
    InvalidInput
        A hinge with fewer than 3 readings or 2 angles, readings that hardly follow the angle or
        are saturated, missing hinges.
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
    if np.abs(angle).max(initial=0.0) > np.pi:
        raise InvalidInput(
            f"a hinge turns by {np.abs(angle).max():.4g} rad, more than half a turn. Angles are in"
            " rad; a table says its own unit (angle_deg)."
        )
    numbers = np.unique(hinge)
    if numbers.size > MAX_HINGES:
        raise InvalidInput(
            f"a robot has at most {MAX_HINGES} hinges, got readings of {numbers.size}."
        )
    if numbers.size == 0 or not np.array_equal(numbers, np.arange(1, numbers.size + 1)):
        shown = ", ".join(f"{number:g}" for number in numbers[:12])
        raise InvalidInput(
            "channels must be numbered 1, 2, … from the base, whichever hinges they sit on, without"
            f" a hole, got {shown or 'none'}."
        )
    n = numbers.size
    each = [(angle[hinge == k], capacitance[hinge == k]) for k in range(1, n + 1)]
    for k, pair in enumerate(each, 1):
        _check_hinge(k, *pair)
    chosen = _choose_curve(each) if curve == "auto" else curve
    lines = [_fit_one(chosen, *pair, time[hinge == k]) for k, pair in enumerate(each, 1)]
    arrays = {key: np.array([line[key] for line in lines]) for key in lines[0]}
    if chosen != "line":
        tables = [_tabulate(_fit_curve(chosen, *pair), pair[1]) for pair in each]
        arrays["readings"], arrays["angles"] = map(np.array, zip(*tables, strict=True))
    return SensorCalibration(**arrays, robot=robot, unit=unit, curve=chosen)


def _choose_curve(each: list[tuple[np.ndarray, np.ndarray]]) -> str:
    """The simplest curve whose cross-validated error, of the hinge in the middle, is within a tenth
    of the best.
    """
    errors = {}
    for curve in CURVES:
        found = [_leave_one_angle_out(curve, *pair) for pair in each]
        # angles that only rise, or only fall, with the reading within its range
        steps = [np.diff(_tabulate(_fit_curve(curve, *pair), pair[1])[1]) for pair in each]
        monotone = all((step > 0).all() or (step < 0).all() for step in steps)
        if np.isfinite(found).all() and monotone:
            errors[curve] = float(np.median(found))
    best = min(errors.values(), default=0.0)
    return next((curve for curve, error in errors.items() if _BETTER * error <= best), "line")


def _tabulate(
    function: Callable[[np.ndarray], np.ndarray], reading: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    knots = np.linspace(reading.min(), reading.max(), _KNOTS)
    return knots, function(knots)


def _join(readings: np.ndarray, angles: np.ndarray) -> Callable[[np.ndarray], np.ndarray]:
    """Angles at readings: the monotone cubic spline through a table, straight beyond its ends."""
    spline, ends = PchipInterpolator(readings, angles), readings[[0, -1]]
    first, last = spline(ends, 1)

    def follow(at: np.ndarray) -> np.ndarray:
        inside = np.clip(at, *ends)
        return spline(inside) + np.where(at < ends[0], first, last) * (at - inside)

    return follow


def _fit_curve(
    curve: str, angle: np.ndarray, reading: np.ndarray
) -> Callable[[np.ndarray], np.ndarray]:
    """Angle as a function of the reading."""
    if curve == "spline":
        levels = np.unique(np.round(angle, 9))
        means = np.array([reading[np.round(angle, 9) == level].mean() for level in levels])
        order = np.argsort(means)
        rising = isotonic_regression(
            levels[order], increasing=bool(np.corrcoef(means, levels)[0, 1] > 0)
        )
        knots, first = np.unique(means[order], return_index=True)
        return _join(knots, rising[first])
    centre, half = reading.mean(), np.ptp(reading) / 2
    line = np.polyfit((reading - centre) / half, angle, CURVES.index(curve) + 1)
    return lambda at: np.polyval(line, (at - centre) / half)


def _check_hinge(number: int, angle: np.ndarray, capacitance: np.ndarray) -> None:
    """Refuse too few readings, ones that hardly follow the angle, and saturated ones."""
    levels = np.unique(np.round(angle, 9))
    if angle.size < _MIN_READINGS or levels.size < 2:
        raise InvalidInput(
            f"hinge {number} has {angle.size} readings at {levels.size} angles; a line needs"
            f" {_MIN_READINGS} at 2."
        )
    follows = 0.0 if _is_flat(capacitance) else np.corrcoef(angle, capacitance)[0, 1] ** 2
    if follows < _FOLLOWS:
        raise InvalidInput(
            f"hinge {number} reads {capacitance.min():g} to {capacitance.max():g}, which hardly"
            f" follows its angle (R² {follows:.2g}): a dead or unconnected sensor, or one that"
            " rises and falls. Mend it, or describe the robot without it."
        )
    for end in (capacitance.min(), capacitance.max()):
        stuck = [
            level for level in levels if np.all(capacitance[np.isclose(angle, level)] == end)
        ]
        if len(stuck) >= _FLAT:
            low, high = np.rad2deg([min(stuck), max(stuck)])
            raise InvalidInput(
                f"hinge {number} reads {end:g} at all angles from {low:g}° to {high:g}°: saturated."
                " Leave these rows out, or calibrate with less gain."
            )


def _fit_one(
    curve: str, angle: np.ndarray, capacitance: np.ndarray, time: np.ndarray
) -> dict[str, float]:
    slope, offset = np.polyfit(capacitance, angle, 1)
    straight = angle - (slope * capacitance + offset)
    residual = straight
    if curve != "line":
        levels = np.unique(np.round(angle, 9)).size
        if levels < _LEVELS[curve]:
            raise InvalidInput(
                f"a {curve} curve needs readings at {_LEVELS[curve]} angles, got {levels}."
            )
        residual = angle - _fit_curve(curve, angle, capacitance)(capacitance)
    # The way that the bench moved to each reading: 1 up, −1 down, 0 unknown; at a turn, and
    # where it stands, the way before.
    way = np.sign(np.diff(np.round(angle, 9), prepend=np.nan))
    way[0] = 0
    last = np.maximum.accumulate(np.where(way != 0, np.arange(way.size), 0))
    way = way[last]
    at = [np.round(angle, 9) == level for level in np.unique(np.round(angle, 9))]
    both = [[residual[here & (way == sign)] for sign in (1, -1)] for here in at]
    wide = [up.mean() - down.mean() for up, down in both if up.size and down.size]
    timed = bool(np.isfinite(time).all()) and not _is_flat(time)
    return {
        "slope": slope,
        "offset": offset,
        "low": capacitance.min(),
        "high": capacitance.max(),
        "residual": np.sqrt(np.mean(residual**2)),
        "cross_validated": _leave_one_angle_out(curve, angle, capacitance),
        "resolution": abs(slope) * _repeat_spread(np.round(angle, 9), way, capacitance),
        "drift": np.polyfit(time - time.mean(), residual, 1)[0] if timed else float("nan"),
        "r_squared": 1 - residual.var() / angle.var(),
        "straight": np.sqrt(np.mean(straight**2)),
        "hysteresis": np.mean(wide) if wide else float("nan"),
    }


def _is_flat(readings: np.ndarray) -> bool:
    """Whether readings differ by no more than their own rounding, or by less than any board can
    say.
    """
    return bool(np.ptp(readings) <= max(1e-12 * np.abs(readings).max(), 1 / _MAX_READING))


def _leave_one_angle_out(curve: str, angle: np.ndarray, capacitance: np.ndarray) -> float:
    rounded = np.round(angle, 9)
    levels = np.unique(rounded)
    if levels.size < _LEVELS[curve]:
        return float("nan")
    errors = []
    for level in levels:
        held = rounded == level
        if _is_flat(capacitance[~held]):
            return float("nan")
        fitted = _fit_curve(curve, angle[~held], capacitance[~held])
        errors.append(angle[held] - fitted(capacitance[held]))
    return float(np.sqrt(np.mean(np.concatenate(errors) ** 2)))


def _repeat_spread(angle: np.ndarray, way: np.ndarray, capacitance: np.ndarray) -> float:
    """Pooled sd of readings at equal angles that were reached the same way; whichever way, where
    none was reached so twice.
    """
    for kept in (way, np.zeros(way.size)):
        pairs = np.unique(np.column_stack([angle, kept]), axis=0)
        groups = [capacitance[(angle == level) & (kept == sign)] for level, sign in pairs]
        freedom = sum(group.size - 1 for group in groups)
        if freedom:
            squares = sum(((group - group.mean()) ** 2).sum() for group in groups)
            return float(np.sqrt(squares / freedom))
    return float("nan")


@checked
def load_calibration_table(
    path: str | os.PathLike, *, curve: Annotated[str, Choice(("auto", *CURVES))] = "line"
) -> SensorCalibration:
    """Fit the lines, or curves (see :func:`fit_sensors`), to a CSV table of a calibration bench.

    Columns are ``hinge``, ``angle_deg`` (or ``_rad``), ``capacitance_pF`` (or ``reading_counts``,
    ``voltage_mV``, ``resistance_ohm``, ``field_uT``, ``strain_ustrain``) and optionally
    ``time_ms``; a note ``# robot: NAME`` names the robot.
    """
    table = read_table(path, max_bytes=MAX_BYTES, words=True)
    angle, _ = table.quantity(("angle",), ANGLE_UNITS)
    units = {unit: factor for unit, (_, factor) in READING_UNITS.items()}
    capacitance, unit = table.quantity(_READINGS, units)
    clock = next((pair for pair in find_times(table.columns).items() if pair[1]), None)
    time = None if clock is None else table.column(clock[0]) * TIME_UNITS[clock[1]]
    numbers = next((name for name in table.columns if name.lower() in _NUMBERED), "hinge")
    return fit_sensors(
        table.column(numbers),
        angle,
        capacitance,
        time=time,
        robot=table.notes.get("robot", ""),
        unit=READING_UNITS[unit][0],
        curve=curve,
    )


# A sensor calibration on disk: JSON that people read too, nothing in it is ever executed.

_FORMAT = "feeler sensor calibration"
_VERSION = 2  # of lines alone: 1
_MAX_FILE = 2**20


@checked
def save_calibration(calibration: SensorCalibration, path: str | os.PathLike) -> None:
    """Write the lines as JSON: readable, versioned, nothing in it is ever executed."""
    with writing(path) as part:
        text = json.dumps(write_calibration(calibration), indent=1)
        part.write_text(text + "\n", encoding="utf-8")


def write_calibration(calibration: SensorCalibration) -> dict[str, Any]:
    """A calibration in JSON's types, for :func:`parse_calibration`."""
    plain = calibration.to_plain()
    words = {name: plain.pop(name) for name in ("robot", "unit", "curve")}
    content = {"format": _FORMAT, "version": _VERSION, **words}
    for name, values in plain.items():
        if values is not None:
            content[name] = [None if value != value else value for value in values]
    return content


def parse_calibration(content: dict[str, Any], name: str) -> SensorCalibration:
    """What :func:`write_calibration` gave; ``name`` is the file's, for messages.

    Raises
    ------
    InvalidInput
        Another format or version, or damaged content.
    """
    content = dict(content)
    if content.pop("format", None) != _FORMAT:
        raise InvalidInput(
            f"{name} is no sensor calibration of feeler. Make one with `feeler robot calibrate`."
        )
    if (version := content.pop("version", None)) not in (1, _VERSION):
        raise InvalidInput(
            f"{name} has version {version!r}; this feeler reads version 1 and {_VERSION}."
        )
    return make_record(SensorCalibration, content, name)


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
    return parse_calibration(content, Path(path).name)
