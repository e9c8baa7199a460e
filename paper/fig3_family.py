"""Beside Fig. 3B: R² over the family of set-ups of declared.toml, by which the wall claims are
judged.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from feeler.antenna.segments import Antenna
from feeler.report import Section, make_spread
from feeler.wall import Approach, Case, Posture, compare, count_orderings, make_postures
from feeler.wall.distance import SETUP_CHOICES
from paper.cache import keep
from paper.context import Context
from paper.declared import CLAIMED
from paper.fig3 import load
from paper.table import read_declared

_LEAST_DEFINED = 1 / 3
"""Share of the family in which R² must be defined for every profile, or nothing is judged."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Family:
    """R² of every profile in every set-up of the declared family.

    Attributes
    ----------
    names : tuple[str, ...]
        Profiles compared, in the order claimed.
    choices : tuple[tuple, ...]
        What tells a set-up from others, by ``feeler.wall.distance.SETUP_CHOICES``.
    r2 : np.ndarray
        (set-up, profile), NaN where it is undefined.
    offset : np.ndarray
        Median distance between greatest curvature and contact (set-up, profile), as a share of the
        length; NaN where the antenna stands at fewer than three distances.
    """

    names: tuple[str, ...]
    choices: tuple[tuple, ...]
    r2: np.ndarray
    offset: np.ndarray
    cases: tuple[Case, ...]

    @property
    def is_defined(self) -> np.ndarray:
        """Where R² is defined for every profile (set-up,)."""
        return np.isfinite(self.r2).all(axis=1)

    @property
    def defined(self) -> np.ndarray:
        """R² where it is defined for every profile (set-up, profile)."""
        return self.r2[self.is_defined]

    @property
    def in_order(self) -> np.ndarray:
        """Where R² falls from profile to profile as the paper claims (set-up,)."""
        return self.is_defined & np.all(np.diff(self.r2, axis=1) < 0, axis=1)

    def select(self, asked: Mapping[str, Sequence]) -> np.ndarray:
        """Which set-ups have one of the asked values of each choice (set-up,)."""
        place = {name: SETUP_CHOICES.index(name) for name in asked}
        return np.array(
            [
                all(choice[place[name]] in values for name, values in asked.items())
                for choice in self.choices
            ],
            dtype=bool,
        )

    def deviate(self, targets: Mapping[str, float]) -> np.ndarray:
        """How far 1 − R² is from that of the targets (set-up, profile), as a factor ≥ 1: near 1 a
        distance of R² itself lets all pass.
        """
        wanted = np.array([targets[name] for name in self.names])
        with np.errstate(divide="ignore"):
            return np.exp(np.abs(np.log((1 - self.r2) / (1 - wanted))))

    def share(self, holds: np.ndarray) -> dict[str, Any]:
        """Share of the defined set-ups in which something holds (set-up,); undefined where too few
        are defined.
        """
        if len(self.defined) < _LEAST_DEFINED * len(self.r2) or not len(self.defined):
            return {
                "undefined": (
                    f"R² is defined for every profile in {len(self.defined)} of {len(self.r2)}"
                    " set-ups only"
                )
            }
        return {"value": float(np.mean(holds)), "n": len(self.defined)}


def list_setups(part: str = "") -> tuple[list[Posture], list[dict[str, str]]]:
    """Postures and measures of the declared family, or of the part that a smaller scale runs."""
    family = dict(read_declared("declared.toml")["wall_family"])
    parts, measures, _ = (family.pop(name) for name in ("part", "measure", "lead"))
    axes = family | (parts[part] if part else {})
    return (
        make_postures(*([{name: value} for value in values] for name, values in axes.items())),
        measures,
    )


def compute(
    antennas: Mapping[str, Antenna],
    *,
    part: str = "",
    known: Sequence[tuple[str, Approach]] = (),
    workers: int | None = None,
) -> Family:
    """Sweep every profile that the paper names through the family; ``known`` sweeps are not done
    again.
    """
    chosen = {name: antennas[name] for name in CLAIMED if name in antennas}
    postures, measures = list_setups(part)
    options = {"measures": measures, "workers": workers, "known": known}
    cases = keep("wall", compare, chosen, postures, **options)
    found: dict[tuple, dict[str, tuple[float, float]]] = {}
    for case in cases:
        r2 = np.nan if case.map.undefined else case.map.r2
        offset = case.offset / chosen[case.antenna].length
        found.setdefault(case.choice, {})[case.antenna] = (r2, offset)
    numbers = np.array([[by_name[name] for name in chosen] for by_name in found.values()])
    return Family(
        names=tuple(chosen),
        choices=tuple(found),
        r2=numbers[..., 0],
        offset=numbers[..., 1],
        cases=tuple(cases),
    )


def show(context: Context, section: Section) -> None:
    """Every set-up, in how many the paper's order holds, and the values that the wall claims are
    judged by.
    """
    data = load(context)
    if not {*CLAIMED} & {*data.sweeps}:
        return  # nothing of the paper's to be held against
    antennas = {name: context.profiles[name] for name in data.sweeps}
    known = [*data.sweeps.items(), *data.default_sweeps.items()]
    family = compute(antennas, part=context.effort.wall_part, known=known)
    if len(family.names) < 2:
        return
    said = read_declared("declared.toml")["wall_paper"]
    targets = {name: said[name] for name in CLAIMED}
    section.heading("What R² depends on")
    section.text(
        "The paper does not state the posture of the J, the wall's friction, which angle is"
        " meant, or"
        " how the point of greatest curvature was found. So its sentences are judged over a"
        " family of"
        f" {len(family.r2)} set-ups declared beforehand (declared.toml). R² is defined for every"
        f" profile in {len(family.defined)} of them; the others cannot be the paper's."
    )
    section.numbers(
        "fig3_family",
        names=family.names,
        choices=family.choices,
        r2=family.r2,
        offset=family.offset,
        targets=targets,
    )
    section.values |= _list_values(family, targets) | _list_readings(family)
    _tabulate_readings(section, family)
    counts = count_orderings(family.cases, family.names)
    section.table(
        ["choice", "value", "order holds", "does not", "cannot be judged"],
        [
            [*key, n["yes"], n["no"], n["undefined"]]
            for key, n in counts.items()
            if key[0] != "all"
        ],
        "Set-ups by the value of each choice that the paper does not state.",
    )
    section.table(
        [*SETUP_CHOICES, *(f"R² {name}" for name in family.names)],
        [
            [*choice, *map(float, r2)]
            for choice, r2 in zip(family.choices, family.r2, strict=True)
        ],
        "R² of every set-up. Undefined: the peak stays at one place, mostly the base hinge, or too"
        " few distances hold a J.",
    )


def _list_values(family: Family, targets: Mapping[str, float]) -> dict[str, object]:
    """How many set-ups have every R², in which share of these the order holds, and the R² of the
    one nearest to all of the paper's values.
    """
    values: dict[str, object] = {
        "wall.defined": len(family.defined),
        "wall.set_ups": len(family.r2),
        "wall.family.order": family.share(family.in_order[family.is_defined]),
    }
    for name, r2 in zip(family.names, family.defined.T, strict=True):
        if r2.size:
            ends = np.median(r2), r2.min(), r2.max()
            values[f"wall.median.{name}"] = make_spread(*ends, n=len(r2))
            nearest = family.deviate(targets)[family.is_defined].max(axis=1).argmin()
            values[f"wall.nearest.{name}"] = float(r2[nearest])
    return values


def list_readings() -> list[dict[str, Any]]:
    """Readings of the choices that decide most; together they are the whole family."""
    return read_declared("declared.toml")["wall_reading"]


def _list_readings(family: Family) -> dict[str, object]:
    """Share of the set-ups of each reading, of those with every R², in which the order holds."""
    values: dict[str, object] = {}
    for reading in list_readings():
        own = family.select(reading["choices"])
        if n := int((own & family.is_defined).sum()):
            holds = int((own & family.in_order).sum())
            values[f"wall.order.{reading['name']}"] = {"value": holds / n, "n": n}
    return values


def _tabulate_readings(section: Section, family: Family) -> None:
    rows = []
    for reading in list_readings():
        own = family.select(reading["choices"])
        r2 = family.r2[own & family.is_defined]
        median = np.median(r2, axis=0) if len(r2) else np.full(len(family.names), np.nan)
        if own.any():
            holds = int((own & family.in_order).sum())
            rows.append([reading["words"], holds, len(r2), int(own.sum()), *map(float, median)])
    section.table(
        [
            *(
                "reading of the paper",
                "order holds",
                "of those with every R²",
                "configurations",
            ),
            *(f"median R² {name}" for name in family.names),
        ],
        rows,
        "The order of profiles by reading. The readings were formed after the family had been run,"
        " of the choices that decide most; together they are the whole family.",
    )
