"""A search's problem: what each candidate costs, from the journal where it is known, and how many
broke down.
"""

import time
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, Literal

import numpy as np

from feeler.design.constraints import Constraints
from feeler.design.scoring import Score, score
from feeler.design.space import Design, Space
from feeler.design.task import DesignTask
from feeler.disk.journal import Journal
from feeler.disk.provenance import make_key
from feeler.errors import InvalidInput, SimulationDiverged
from feeler.records.checked import checked

FAR = 1e3  # [C] cost of what breaks a constraint, or diverges: more than any number of missing bits
_CLEAR = (
    0.02,
    0.99,
)  # [C] shares of log₂ K outside which the reference says that there is nothing to search


@dataclass(frozen=True, kw_only=True, eq=False)
class Candidate:
    """A point that was looked at; ``cost``: missing bits or errors; ≥ ``FAR`` if it must not win.

    Attributes
    ----------
    fate : str
        ``simulated``, ``excluded`` (a constraint), ``diverged`` or ``peak`` (an angle over the
        limit).
    """

    x: np.ndarray
    cost: float
    bits: float = float("nan")
    bits_error: float = float("nan")
    errors: float = float("nan")
    peak: float = float("nan")
    fate: str = "simulated"


@checked
@dataclass(kw_only=True, eq=False)
class DesignProblem:
    """Missing bits of designs on the optimiser's draws; counted, and kept in the ``journal``.

    Attributes
    ----------
    aim : Literal[bits, accuracy]
        What costs: missing bits, or the share named wrong.
    options : dict[str, Any]
        Workers or executor, as for :func:`feeler.touch`.
    watch : Callable[[DesignProblem], None] | None
        Called after each candidate.
    seconds : float
        Processor time of the simulations.
    """

    task: DesignTask
    space: Space
    constraints: Constraints = field(default_factory=Constraints)
    options: dict[str, Any] = field(default_factory=dict)
    journal: Journal = field(default_factory=Journal)
    aim: Literal["bits", "accuracy"] = "bits"
    watch: Callable[["DesignProblem"], None] | None = None
    counts: dict[str, int] = field(
        default_factory=lambda: dict.fromkeys(("simulated", "excluded", "diverged", "peak"), 0)
    )
    seconds: float = 0.0
    best: Candidate | None = None

    @property
    def evaluations(self) -> int:
        """Candidates that were simulated, or taken from the journal."""
        return sum(self.counts.values()) - self.counts["excluded"]

    @property
    def ceiling(self) -> float:
        """log₂ K."""
        return float(np.log2(self.task.n_classes))

    def look(self, x: np.ndarray) -> Candidate:
        """What the point x costs."""
        found = self._look(np.asarray(x, dtype=float))
        self.counts[found.fate] += 1
        if self.best is None or found.cost < self.best.cost:
            self.best = found
        if self.watch:
            self.watch(self)
        return found

    def _look(self, x: np.ndarray) -> Candidate:
        design = self.space.build(x)
        if broken := self.measure_violation(design):
            return Candidate(x=x, cost=FAR * (1 + broken), fate="excluded")
        bits, bits_error, errors, peak = self._recall(x, design)
        if np.isinf(peak):
            return Candidate(x=x, cost=1e3 * FAR, fate="diverged")
        over = self.constraints.check_peak(peak)
        cost, fate = (errors if self.aim == "accuracy" else self.ceiling - bits), "simulated"
        if over:
            cost, fate = FAR * (1 + over), "peak"
        return Candidate(
            x=x,
            cost=cost,
            bits=bits,
            bits_error=bits_error,
            errors=errors,
            peak=peak,
            fate=fate,
        )

    def measure_violation(self, design: Design) -> float:
        """How far the design breaks what is known before it is simulated."""
        return sum(self.constraints.check(design.antenna, self.space.reference).values())

    def _recall(self, x: np.ndarray, design: Design) -> np.ndarray:
        """Bits, their error, share of errors, and peak; a peak of ∞ where it diverged."""
        values, seconds = self.journal.get_or(lambda: self._measure(design), x)
        self.seconds += seconds
        return np.array(values, dtype=float)

    def _measure(self, design: Design) -> tuple[np.ndarray, float]:
        """What the journal keeps: the four numbers, and the processor time [s] they took."""
        began = time.process_time()
        return self._simulate(design), time.process_time() - began

    def _simulate(self, design: Design) -> np.ndarray:
        try:
            task = self.task.at(design.speed)
            found = score(design.antenna, task, "optimiser", **self.options)
        except SimulationDiverged:
            return np.array([0.0, 0.0, 1.0, np.inf])
        return np.array([found.bits, np.nan_to_num(found.bits_error), found.errors, found.peak])

    def describe(self) -> str:
        """A short text that changes with anything that changes a score."""
        made_with = {"task": self.task, "space": self.space, "constraints": self.constraints}
        return make_key(made_with, "feeler.design.problem")


def check_task(found: Score, task: DesignTask, aim: str = "bits") -> None:
    """Refuse a task at which there is nothing to gain, before minutes are spent.

    Raises
    ------
    InvalidInput
        ``found``, the score of the reference, is next to nothing, or next to everything.
    """
    whole, chance = np.log2(task.n_classes), 1 / task.n_classes
    share, told = found.bits / whole, f"{found.bits:.4g} of {whole:.4g} bits"
    if aim == "accuracy":
        right = 1 - found.errors
        share, told = (
            (right - chance) / (1 - chance),
            f"{right:.0%} right (chance {chance:.0%})",
        )
    if share < _CLEAR[0]:
        raise InvalidInput(
            f"the reference tells {told}: nothing can be told in this noise, so that a search would"
            f" follow chance. Lower the noise (now {task.noise}), or give more time or larger"
            " objects."
        )
    if share > _CLEAR[1]:
        raise InvalidInput(
            f"the reference already tells {told}: nothing is left to gain. Raise the noise (now"
            f" {task.noise}), or give less time or more classes."
        )
