"""On which unstated choices the order of the stiffness profiles depends."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import product
from typing import Any

import numpy as np

from feeler.antenna.antenna import Antenna
from feeler.errors import InvalidInput
from feeler.execute import Executor, ThreadExecutor, run_batch
from feeler.records.checked import checked
from feeler.wall.distance_map import (
    FEWEST_DISTANCES,
    DistanceMap,
    bootstrap_median,
    list_standing,
    map_distance,
)
from feeler.wall.posture import Posture
from feeler.wall.sweep import DISTANCES, Approach, approach

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
    apart = np.abs(found.position - sweep.contact_position)[list_standing(sweep)]
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
        median, low, high = bootstrap_median(r2, rng)
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
    cases: Iterable[Case], order: tuple[str, ...] = ("exponential", "linear", "constant")
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
