"""Rhythm of an antenna or whisker, left against right, and groups of animals."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, Any, ClassVar

import numpy as np
import pandas as pd
import xarray as xr
from scipy.signal import butter, hilbert, sosfiltfilt
from scipy.stats import alexandergovern, t, ttest_ind

from feeler.errors import InvalidInput
from feeler.records import ALLOW_NAN, Gt, Shown
from feeler.tracking.kinematics import Sweeps, _find_runs
from feeler.tracking.tracks import Tracks
from feeler.validation import checked

_BAND = 2.0  # [C] the band around a frequency reaches from its half to its double
_FEWEST = 3.0  # [C] cycles of a stretch that has a phase
_AT_ENDS = 0.5  # [C] cycles at a stretch's ends whose phase is not used


@checked
def measure_rhythm(
    angle: Annotated[np.ndarray, "frame", ALLOW_NAN],
    interval: Annotated[float, Gt(0)],
    frequency: Annotated[float, Gt(0)],
) -> xr.Dataset:
    """Amplitude and phase of an angle (frame,) [rad] by the Hilbert transform, in the band from
    half to twice a ``frequency`` [kHz], such as :attr:`Sweeps.frequency`.

    The band is taken by a second-order Butterworth filter, forwards and backwards, of each stretch
    without NaN (Hill, Curtis, Moore & Kleinfeld 2011, Neuron 72:344).

    Returns
    -------
    Dataset
        ``phase`` (frame,) [rad] in (−π, π], 0 where the angle is greatest: outward, or protracted;
        NaN where the stretch is shorter than three cycles, and in half a cycle at its ends.
        ``amplitude`` (frame,) [rad], half of peak to peak, and ``offset``, the midpoint about which
        it swings. Among the attributes ``frequency``, the median of the phase's rate [kHz], and
        ``mean_amplitude``, the median over frames [rad]; NaN without a phase.

    Raises
    ------
    InvalidInput
        A frequency of which the film shows fewer than four frames a cycle.
    """
    if frequency * _BAND * interval >= 0.5:
        raise InvalidInput(
            f"a rhythm at {frequency * 1e3:.3g} Hz needs more than {4e3 * frequency:.3g} frames/s,"
            f" got {1e3 / interval:.4g}."
        )
    band = [frequency / _BAND, frequency * _BAND]
    sos = butter(2, band, "bandpass", fs=1 / interval, output="sos")
    wave = np.full(angle.size, np.nan + 0j)
    offset = np.full(angle.size, np.nan)
    cycle = 1 / (frequency * interval)
    ends = int(np.ceil(_AT_ENDS * cycle))
    rates = []
    for run in _find_runs(angle):
        values = angle[run]
        if values.size < max(_FEWEST * cycle, 30):
            continue
        swing = sosfiltfilt(sos, values - values.mean())
        inner = slice(run.start + ends, run.stop - ends)
        wave[inner] = hilbert(swing)[ends : values.size - ends]
        offset[inner] = (values - swing)[ends : values.size - ends]
        rates.append(np.diff(np.unwrap(np.angle(wave[inner]))) / (2 * np.pi * interval))
    columns = {"phase": np.angle(wave), "amplitude": np.abs(wave), "offset": offset}
    swings = columns["amplitude"][np.isfinite(wave)]
    return xr.Dataset(
        {name: ("frame", values, {"units": "rad"}) for name, values in columns.items()},
        attrs={
            "frequency": float(np.median(np.concatenate(rates))) if rates else float("nan"),
            "mean_amplitude": float(np.median(swings)) if swings.size else float("nan"),
        },
    )


@checked
def compare_sides(left: Sweeps, right: Sweeps, interval: Annotated[float, Gt(0)]) -> pd.Series:
    """The left antenna against the right one, ``interval`` [ms] between frames; angles count
    outward on both sides, so that in phase means that both go outward at once.

    Returns
    -------
    Series
        ``correlation``, Pearson's r of the two angles, NaN where one does not move;
        ``best_correlation``, the greatest r within half a cycle either way, and ``lag`` [ms], by
        how much the right one then comes later; ``phase`` [rad], the circular mean of left minus
        right, NaN without a rhythm, and ``locking``, the length of the mean phase vector, 0 (any
        phase) to 1 (always the same); ``frames`` with both angles.
    """
    both = np.isfinite(left.angle) & np.isfinite(right.angle)
    found = np.array([side.frequency for side in (left, right)])
    frequency = float(np.nanmean(found)) if np.isfinite(found).any() else float("nan")
    phase = locking = float("nan")
    if 0 < frequency * _BAND * interval < 0.5:
        one, other = (measure_rhythm(side.angle, interval, frequency) for side in (left, right))
        apart = np.exp(1j * (one["phase"].values - other["phase"].values))
        apart = apart[np.isfinite(apart)]
        if apart.size:
            mean = apart.mean()
            phase, locking = float(np.angle(mean)), float(abs(mean))
    # half a period and a frame more: opposite sides agree best just there
    reach = math.ceil(0.5 / (frequency * interval)) + 1 if frequency > 0 else 0
    reach = min(reach, left.angle.size // 4)
    shifts = np.arange(-reach, reach + 1)
    r = np.array([_correlate(left.angle, right.angle, int(shift)) for shift in shifts])
    best = int(np.nanargmax(r)) if np.isfinite(r).any() else reach
    return pd.Series(
        {
            "correlation": float(r[reach]),
            "best_correlation": float(r[best]),
            "lag": float(shifts[best] * interval),
            "phase": phase,
            "locking": locking,
            "frames": int(both.sum()),
        }
    )


def _correlate(left: np.ndarray, right: np.ndarray, shift: int) -> float:
    """Pearson's r of left[k] with right[k + shift]."""
    n = left.size
    one, other = (
        left[max(0, -shift) : n - max(0, shift)],
        right[max(0, shift) : n + min(0, shift)],
    )
    both = np.isfinite(one) & np.isfinite(other)
    one, other = one[both], other[both]
    if one.size < 3 or np.ptp(one) < 1e-12 or np.ptp(other) < 1e-12:
        return float("nan")
    return float(np.corrcoef(one, other)[0, 1])


@checked
def measure_base(
    tracks: Tracks, points: Sequence[str], *, head: str = "head", abdomen: str = "abdomen"
) -> pd.DataFrame:
    """Angle and curvature at the base, as they are given for whiskers, a row per frame.

    Parameters
    ----------
    points
        Landmarks along the whisker, base to tip, at least three; the first three are used.
    head, abdomen
        The body's axis, which points from abdomen to head.

    Returns
    -------
    DataFrame
        ``time_ms``; ``angle_deg`` between the base's tangent and the backward axis: 0 points
        backward, 180 forward, greater is more protracted; ``curvature`` [1/px or 1/mm] of the
        circle through the first three points, positive where the whisker bends towards the front.

    Raises
    ------
    InvalidInput
        Fewer than three points, or places in space.
    """
    if len(points) < 3:
        raise InvalidInput(f"curvature at the base needs three points, got {len(points)}.")
    a, b, c = (tracks.of(name) for name in points[:3])
    if a.shape[1] != 2:
        raise InvalidInput("angles of whiskers are measured in a plane; give plane='xy'.")
    back = tracks.of(abdomen) - tracks.of(head)
    first, second = b - a, c - b
    bend = np.arctan2(_cross(first, second), np.sum(first * second, axis=1))
    sides = [np.linalg.norm(one, axis=1) for one in (first, second, c - a)]
    size = 2 * np.abs(_cross(first, c - a)) / np.prod(sides, axis=0)
    # the circle's tangent at its first point lies off the first chord by half of that chord's arc
    half = np.arcsin(np.clip(0.5 * size * sides[0], 0, 1)) * np.sign(bend)
    heading = np.arctan2(first[:, 1], first[:, 0]) - half
    tangent = np.stack([np.cos(heading), np.sin(heading)], axis=1)
    forward = np.sign(_cross(back, tangent))
    angle = np.abs(np.arctan2(_cross(back, tangent), np.sum(back * tangent, axis=1)))
    return pd.DataFrame(
        {
            "time_ms": tracks.time,
            "angle_deg": np.degrees(angle),
            "curvature": np.sign(bend) * forward * size,
        }
    )


def _cross(one: np.ndarray, other: np.ndarray) -> np.ndarray:
    return one[:, 0] * other[:, 1] - one[:, 1] * other[:, 0]


@dataclass(frozen=True, kw_only=True, eq=False)
class Groups(Shown):
    """Groups of animals: each animal counts once, whatever the number of its films and frames.

    Attributes
    ----------
    table : DataFrame
        A row per group: ``n`` animals, ``mean`` of the animals' means, ``sd`` between animals, and
        the ends ``low``, ``high`` of the mean's 95 % interval (t); NaN with one animal.
    animals : DataFrame
        A row per animal: ``group``, ``animal``, ``value`` (mean over its films), ``films``.
    test : str
        Which test compares the groups, ``""`` if there is nothing to test.
    p : float
        Its two-sided probability.
    difference : tuple[float, float, float]
        Of two groups: first minus second in the table's order, and its 95 % interval; else NaN.
    """

    table: pd.DataFrame
    animals: pd.DataFrame
    test: str
    p: float
    difference: tuple[float, float, float]
    LEVEL: ClassVar[float] = 0.95


@checked
def compare_groups(
    values: Sequence[float], animals: Sequence[str], groups: Sequence[str]
) -> Groups:
    """Means of animals, their intervals, and a test: Welch's t of two groups, Alexander and
    Govern's of more; neither takes the groups' variances to be equal.

    Parameters
    ----------
    values, animals, groups
        (film,) one value a film, such as ``Exploration.mean_peak`` over sides; whose film it is;
        and that animal's group. Films without a value (NaN) are left out.

    Raises
    ------
    InvalidInput
        Lists of other lengths, no value, or an animal in two groups.
    """
    if not len(values) == len(animals) == len(groups) or not len(values):
        raise InvalidInput(
            f"give an animal and a group for each value, got {len(values)} values,"
            f" {len(animals)} animals and {len(groups)} groups."
        )
    films = pd.DataFrame({"group": [*groups], "animal": [*animals], "value": [*values]})
    films = films.dropna(subset="value")
    if films.empty:
        raise InvalidInput("no film has a value to compare.")
    several = films.groupby("animal")["group"].nunique()
    if (several > 1).any():
        name = several.idxmax()
        both = films.loc[films["animal"] == name, "group"].unique()
        raise InvalidInput(
            f"animal {name!r} is in the groups {', '.join(both)}; an animal belongs to one. Name"
            " its films by condition, or test pairs."
        )
    by_animal = (
        films.groupby(["group", "animal"], sort=False)["value"]
        .agg(value="mean", films="size")
        .reset_index()
    )
    parts = {
        str(name): part["value"].to_numpy()
        for name, part in by_animal.groupby("group", sort=False)
    }
    rows = []
    for name, part in parts.items():
        n, mean = part.size, float(part.mean())
        sd = float(part.std(ddof=1)) if n > 1 else float("nan")
        half = (
            float(t.ppf(0.5 + Groups.LEVEL / 2, n - 1)) * sd / np.sqrt(n)
            if n > 1
            else float("nan")
        )
        rows.append([name, n, mean, sd, mean - half, mean + half])
    table = pd.DataFrame(rows, columns=["group", "n", "mean", "sd", "low", "high"])
    test, p, difference = _test([*parts.values()])
    return Groups(table=table, animals=by_animal, test=test, p=p, difference=difference)


def _test(parts: list[np.ndarray]) -> tuple[str, float, tuple[float, float, float]]:
    nothing = (float("nan"),) * 3
    if len(parts) < 2 or min(part.size for part in parts) < 2 or not all(map(np.ptp, parts)):
        return "", float("nan"), nothing
    if len(parts) > 2:
        return "Alexander-Govern", float(alexandergovern(*parts).pvalue), nothing
    found: Any = ttest_ind(*parts, equal_var=False)
    ends = found.confidence_interval(Groups.LEVEL)
    apart = float(parts[0].mean() - parts[1].mean())
    return "Welch's t", float(found.pvalue), (apart, float(ends.low), float(ends.high))
