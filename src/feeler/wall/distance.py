"""From the point of greatest curvature to the wall's distance, and on which choices the map
depends.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import product
from typing import Annotated, Any, ClassVar

import numpy as np
import pandas as pd

from feeler.antenna.segments import Antenna, require_plane
from feeler.errors import InvalidInput
from feeler.execute import Executor, ThreadExecutor, run_batch
from feeler.records import Gt, Lt, Shown
from feeler.validation import Count, checked
from feeler.wall.approach import DISTANCES, Approach, Peak, Posture, approach, find_sweep_peak

# The map from the point of greatest curvature to the wall's distance: how straight, how exact,
# over what range.

FEWEST_DISTANCES = 3  # a line through two points always fits


@dataclass(frozen=True, kw_only=True, eq=False)
class DistanceMap(Shown):
    """A straight line distance = ``slope`` · position + ``intercept`` and how well it does.

    Attributes
    ----------
    distance : np.ndarray
        Distances (step,) [mm], farthest first.
    position : np.ndarray
        Arc length of the peak (step,) [mm], NaN without one.
    used : np.ndarray
        Which (step,) entered the fit: an inverted J in contact, with its peak away from the base
        hinge.
    at_base : np.ndarray
        Which (step,) had their peak at the base hinge: reported, not fitted.
    slope : float
        [mm of distance per mm of arc length]
    intercept : float
        [mm]
    r2 : float
        Share of variance explained; NaN where it is undefined, and ``undefined`` then says why.
    undefined : str
        Empty, or why there is no fit.
    residual : np.ndarray
        Distance minus the line (step,) [mm], NaN where not used.
    error : float
        Predicted distance error [mm]: root mean square over the used distances, each left out of
        its own fit.
    monotone : bool
        Whether the position rises, or falls, strictly over the used distances.
    told_apart : tuple[float, float]
        Nearest and farthest distance [mm] of the longest run in which neighbours are discriminated;
        NaN without one.
    bending : str
        Where the antenna bends, and why (:func:`explain_bending`).
    """

    DRAWN: ClassVar[str] = "draw_map"

    distance: np.ndarray
    position: np.ndarray
    used: np.ndarray
    at_base: np.ndarray
    slope: float
    intercept: float
    r2: float
    undefined: str
    residual: np.ndarray
    error: float
    monotone: bool
    told_apart: tuple[float, float]
    bending: str = ""

    def predict(self, position: float | np.ndarray) -> float | np.ndarray:
        """Distance [mm] from the position of the peak [mm]; NaN in, NaN out."""
        return self.slope * np.asarray(position) + self.intercept

    def to_frame(self) -> pd.DataFrame:
        """A row per distance: the peak's place, whether it was fitted, and what is read from it."""
        return pd.DataFrame(
            {
                "distance_mm": self.distance,
                "peak_mm": self.position,
                "at_base": self.at_base,
                "fitted": self.used,
                "estimate_mm": self.predict(self.position),
            }
        )


@checked
def fit_distance(
    distance: Annotated[np.ndarray, "step"],
    position: Annotated[np.ndarray, "step"],
    used: Annotated[np.ndarray, "step"],
    at_base: Annotated[np.ndarray, "step"],
    resolution: float,
) -> DistanceMap:
    """Fit the line by least squares.

    Parameters
    ----------
    distance, position, used, at_base
        One value per step, farthest first [mm].
    resolution
        Positions closer than this [mm] are not discriminated.
    """
    distance, position = np.asarray(distance, dtype=float), np.asarray(position, dtype=float)
    if distance.shape != position.shape or distance.ndim != 1:
        raise InvalidInput(
            f"distance and position need one length, got shapes {distance.shape} and"
            f" {position.shape}."
        )
    used = np.asarray(used, dtype=bool) & np.isfinite(position)
    x, y = position[used], distance[used]
    slope, intercept, r2, error, why = _fit_line(x, y)
    change = np.diff(x)
    return DistanceMap(
        distance=distance,
        position=position,
        used=used,
        at_base=np.asarray(at_base, dtype=bool),
        slope=slope,
        intercept=intercept,
        r2=r2,
        undefined=why,
        residual=np.where(used, distance - (slope * position + intercept), np.nan),
        error=error,
        monotone=bool(x.size >= 2 and (np.all(change > 0) or np.all(change < 0))),
        told_apart=_longest_run(distance, np.where(used, position, np.nan), resolution),
    )


def _fit_line(x: np.ndarray, y: np.ndarray) -> tuple[float, float, float, float, str]:
    if x.size < FEWEST_DISTANCES:
        return (np.nan,) * 4 + (f"{x.size} usable distances, a fit needs {FEWEST_DISTANCES}",)
    dx, dy = x - x.mean(), y - y.mean()
    spread = float(dx @ dx)
    if spread < 1e-12 * x.size or float(dy @ dy) == 0.0:
        return (np.nan,) * 4 + ("the peak stays at one place",)
    slope = float(dx @ dy) / spread
    intercept = float(y.mean() - slope * x.mean())
    residual = dy - slope * dx
    leverage = 1 / x.size + dx**2 / spread
    left_out = residual / np.maximum(1 - leverage, 1e-9)
    r2 = 1 - float(residual @ residual) / float(dy @ dy)
    return slope, intercept, r2, float(np.sqrt(np.mean(left_out**2))), ""


# Where an antenna bends, by its stiffness alone: over its length, or at its base.

_PUSHED = np.linspace(0.3, 0.9, 13)  # [C] shares of the length
_BASE = 0.05  # [C] of the length, which counts as the base


@checked
def predict_peak(
    antenna: Antenna, contact: Annotated[np.ndarray, "place"]
) -> Annotated[np.ndarray, "place"]:
    """Arc lengths (place,) [mm] at which an antenna bends most when it is pushed lightly aside at
    arc lengths ``contact`` (place,) [mm].

    The moment of a push at c is proportional to c − s, so the bend peaks where (c − s) / (k ℓ) is
    greatest, over hinges at s of stiffness k behind segments of length ℓ: with k ℓ falling as
    exp(−s/λ) at c − λ, or at the base if c < λ; with that of a cone of length L, (1 − s/L)⁴, at
    (4 c − L)/3.

    Raises
    ------
    InvalidInput
        An antenna in space.
    """
    require_plane(antenna, "a wall")
    push = np.asarray(contact, dtype=float)[:, None]
    place = antenna.hinge_position
    bend = np.maximum(push - place, 0.0) / (antenna.stiffness * antenna.segment_length)
    return place[bend.argmax(axis=1)]


@checked
def explain_bending(antenna: Antenna) -> str:
    """In words, whether an antenna bends over its length, so that a wall's distance can be read
    from where, or at its base, and why.
    """
    peak = predict_peak(antenna, _PUSHED * antenna.length) / antenna.length
    along = peak > _BASE
    stiffness = antenna.stiffness * antenna.segment_length
    falls = float(
        np.log(
            stiffness[0]
            / stiffness[np.searchsorted(antenna.hinge_position, antenna.length / 2)]
        )
    )
    fall = f"{np.exp(max(falls, 0.0)):.3g}-fold from base to middle"
    if along.mean() >= 0.5:
        return (
            f"bends over its length: pushed at 30 to 90 % of its length it bends most at"
            f" {peak[0]:.0%} to {peak[-1]:.0%}, since its stiffness falls {fall}"
        )
    return (
        f"bends most at its base wherever it is pushed, since its stiffness falls too little,"
        f" {fall}; over its length bends one whose stiffness falls by more than a factor e between"
        " base and wall"
    )


def _longest_run(
    distance: np.ndarray, position: np.ndarray, resolution: float
) -> tuple[float, float]:
    """Ends of the longest stretch over which the position moves on, one way, by more than
    ``resolution`` per step.
    """
    best = (np.nan, np.nan)
    for way in (1.0, -1.0):
        apart = way * np.diff(position) > resolution  # False next to a missing position
        start = 0
        for k in range(apart.size + 1):
            if k == apart.size or not apart[k]:
                if k > start and not distance[start] - distance[k] <= best[1] - best[0]:
                    best = (float(distance[k]), float(distance[start]))
                start = k + 1
    return best


@checked
def map_distance(sweep: Approach, *, peak: Peak | None = None, **options: Any) -> DistanceMap:
    """The map of a sweep; ``options`` go to :func:`feeler.wall.find_sweep_peak`.

    Used are distances at which the antenna stands against the wall as its posture asks (an inverted
    J, or any contact with ``prebend="none"``) in equilibrium, and its peak is not at the base
    hinge. Positions closer than the longest segment are not discriminated.
    """
    peak = peak or find_sweep_peak(sweep, **options)
    used = _list_standing(sweep) & ~peak.at_base
    found = fit_distance(
        sweep.distance,
        peak.position,
        used,
        peak.at_base,
        float(sweep.antenna.segment_length.max()),
    )
    return replace(found, bending=explain_bending(sweep.antenna))


SUBSTEPS = (1.0, 0.5, 0.25, 0.1)  # mm [C]; steps in which the wall comes


@checked
def range_r2(
    antenna: Antenna,
    posture: Posture,
    distances: Sequence[float] | np.ndarray = DISTANCES,
    **options: Any,
) -> tuple[float, float]:
    """Least and greatest R² where the wall comes in steps of 0.1, 0.25, 0.5 or 1 mm.

    With friction an antenna rests where it sticks, which depends on how the wall came: there is no
    one equilibrium, and smaller steps do not lead to one. Without friction both are nearly equal.

    Returns
    -------
    tuple[float, float]
        NaN where some R² is undefined. Arguments are those of :func:`feeler.wall.approach` and
        :func:`map_distance`.
    """
    found = [
        map_distance(approach(antenna, posture, distances, substep=step), **options).r2
        for step in SUBSTEPS
    ]
    return float(np.min(found)), float(np.max(found))


def _list_standing(sweep: Approach) -> np.ndarray:
    """At which distances (step,) the antenna stands against the wall as its posture asks, in
    equilibrium.
    """
    standing = sweep.contact if sweep.posture.prebend == "none" else sweep.inverted
    return standing & sweep.balanced


@checked
def _bootstrap_median(
    values: Annotated[np.ndarray, "setup"],
    rng: np.random.Generator,
    *,
    n_resamples: Count = 2000,
    level: Annotated[float, Gt(0), Lt(1)] = 0.95,
) -> tuple[float, float, float]:
    """Median and its bootstrap interval (median, low, high) over set-ups; undefined values (NaN)
    are left out.
    """
    values = np.asarray(values, dtype=float)
    values = values[np.isfinite(values)]
    if values.size == 0:
        return np.nan, np.nan, np.nan
    medians = np.median(rng.choice(values, (n_resamples, values.size)), axis=1)
    low, high = np.quantile(medians, [(1 - level) / 2, (1 + level) / 2])
    return float(np.median(values)), float(low), float(high)


# On which unstated choices the order of the stiffness profiles depends.

READINGS = ({"reading": "midline"}, {"reading": "total"})
FRICTIONS = ({"friction": 0.0}, {"friction": 0.3}, {"friction": 1.0})
BENDS = (
    {"hook_share": 0.25},
    {"hook_share": 0.5},
    {"hook_share": 0.5, "tip_heading": 150.0},
    {"hook_share": 1.0},
    {"prebend": "rotation"},
    {"prebend": "none"},
)
_MEASURES = (
    {"quantity": "bend", "method": "smooth"},
    {"quantity": "bend", "method": "hinge"},
    {"quantity": "total", "method": "smooth"},
)

_MEASURED = ("quantity", "method")
_POSED = ("inter_antennal_angle", "reading", "friction", "prebend", "hook_share", "tip_heading")
SETUP_CHOICES = (*_POSED, *_MEASURED)


@checked
@dataclass(frozen=True, kw_only=True, eq=False)
class Case:
    """One set-up of one antenna: the choices, how the sweep went and the map.

    Attributes
    ----------
    offset : float
        Median distance along the antenna [mm] between the point of greatest curvature and the
        contact, over the distances at which it stands against the wall as its posture asks; NaN
        where these are fewer than three.
    """

    antenna: str
    posture: Posture
    measure: Mapping[str, str]
    map: DistanceMap
    offset: float

    def __post_init__(self) -> None:
        if {*self.measure} != {*_MEASURED}:
            named = ", ".join(map(str, self.measure)) or "nothing"
            raise InvalidInput(
                f"Case.measure must name {' and '.join(_MEASURED)}, got {named}."
            )

    @property
    def choice(self) -> tuple:
        """What tells the set-up from others, without the antenna, by ``SETUP_CHOICES``."""
        posed = (getattr(self.posture, name) for name in _POSED)
        return (*posed, *(self.measure[name] for name in _MEASURED))


@checked
def make_postures(
    *axes: Iterable[Mapping[str, Any]], base: Posture | None = None
) -> list[Posture]:
    """Every combination of the choices, one mapping of changed fields from each axis."""
    base = base or Posture()
    return [
        base.replace(**{k: v for part in parts for k, v in part.items()})
        for parts in product(*axes)
    ]


@checked
def compare(
    antennas: Mapping[str, Antenna],
    postures: Iterable[Posture],
    *,
    distances: Sequence[float] | np.ndarray = DISTANCES,
    measures: Iterable[Mapping[str, str]] = _MEASURES,
    workers: int | None = None,
    executor: Executor | None = None,
    known: Iterable[tuple[str, Approach]] = (),
) -> list[Case]:
    """Sweep every antenna in every posture and fit the map of every measure.

    ``known`` sweeps over the same distances, by the antenna's name, are not done again. The others
    are shared out among ``workers`` threads (the compiled relaxation releases the lock), or go to
    an ``executor``.
    """
    done = {(name, sweep.posture): sweep for name, sweep in known}
    postures, measures = list(postures), [dict(measure) for measure in measures]
    if not antennas or not postures or not measures:
        raise InvalidInput("compare needs at least one antenna, one posture and one measure.")
    jobs = [
        (name, antenna, posture) for posture in postures for name, antenna in antennas.items()
    ]
    todo = [(k, job[1:]) for k, job in enumerate(jobs) if job[::2] not in done]
    with ThreadExecutor(workers) as own:
        for outcome in run_batch(partial(_sweep, distances), todo, executor=executor or own):
            if outcome.error is not None:
                raise outcome.error
            done[jobs[outcome.index][::2]] = outcome.value
    return [
        _fit(name, done[name, posture], measure)
        for name, _, posture in jobs
        for measure in measures
    ]


def _sweep(distances: Sequence[float] | np.ndarray, job: tuple[Antenna, Posture]) -> Approach:
    return approach(*job, distances)


def _fit(name: str, sweep: Approach, measure: Mapping[str, Any]) -> Case:
    found = map_distance(sweep, **measure)
    apart = np.abs(found.position - sweep.contact_position)[_list_standing(sweep)]
    return Case(
        antenna=name,
        posture=sweep.posture,
        measure=measure,
        map=found,
        offset=float(np.median(apart)) if apart.size >= FEWEST_DISTANCES else np.nan,
    )


@checked
def summarise(cases: Iterable[Case], rng: np.random.Generator) -> dict[str, dict[str, float]]:
    """Per antenna: number of set-ups, of undefined R², median R² with its interval, least and
    greatest.
    """
    table: dict[str, dict[str, float]] = {}
    cases = list(cases)
    for name in dict.fromkeys(case.antenna for case in cases):
        r2 = np.array([case.map.r2 for case in cases if case.antenna == name])
        median, low, high = _bootstrap_median(r2, rng)
        known = r2[np.isfinite(r2)]
        table[name] = {
            "set_ups": r2.size,
            "undefined": r2.size - known.size,
            "median": median,
            "low": low,
            "high": high,
            "least": float(known.min()) if known.size else np.nan,
            "greatest": float(known.max()) if known.size else np.nan,
        }
    return table


@checked
def count_orderings(
    cases: Iterable[Case], order: tuple[str, ...] = ("exponential", "linear", "uniform")
) -> dict[tuple, dict[str, int]]:
    """Per value of each choice: in how many set-ups R² falls in ``order``, does not, or is
    undefined.
    """
    groups: dict[tuple, dict[str, float]] = {}
    for case in cases:
        groups.setdefault(case.choice, {})[case.antenna] = case.map.r2
    table: dict[tuple, dict[str, int]] = {}
    for choice, r2 in groups.items():
        values = np.array([r2.get(name, np.nan) for name in order])
        verdict = (
            "undefined"
            if np.isnan(values).any()
            else "yes"
            if np.all(np.diff(values) < 0)
            else "no"
        )
        for key in [("all", ""), *zip(SETUP_CHOICES, choice, strict=True)]:
            table.setdefault(key, {"yes": 0, "no": 0, "undefined": 0})[verdict] += 1
    return table
