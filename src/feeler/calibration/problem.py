"""A calibration problem: hinges to search, targets to meet, the protocol between them, and how far
simulated quantities are from their targets.
"""

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np

from feeler.calibration.hinges import Hinges
from feeler.calibration.protocol import Measured, Protocol
from feeler.calibration.targets import Targets
from feeler.disk.journal import Journal
from feeler.disk.provenance import make_key
from feeler.errors import FeelerError, InvalidInput
from feeler.records.checked import checked

# [C] residual of every target of an antenna that could not be simulated or measured; larger than
# any real one
FAILED = 10.0


@dataclass(kw_only=True, eq=False)
class Problem:
    """Residuals of hinges against targets, counted.

    ``best_x`` and ``best_error`` remember the best ever seen.

    What stands in the ``journal`` is taken from there, and counts as if it had been simulated.

    Attributes
    ----------
    seconds : float
        Processor time of the simulations.
    watch : Callable[[int, float], None] | None
        Called after each group of simulations with ``evaluations`` and ``best_error``.
    """

    hinges: Hinges
    targets: Targets
    protocol: Protocol = field(default_factory=Protocol)
    evaluations: int = 0
    failures: int = 0
    best_x: np.ndarray = field(init=False, repr=False)
    best_error: float = field(init=False, default=np.inf)
    seconds: float = 0.0
    journal: Journal = field(default_factory=Journal, repr=False)
    watch: Callable[[int, float], None] | None = None

    def __post_init__(self) -> None:
        for name, kind in (("hinges", Hinges), ("targets", Targets)):
            if not isinstance(given := getattr(self, name), kind):
                raise InvalidInput(
                    f"Problem.{name} must be {kind.__name__}, got {type(given).__name__}."
                )

    def measure(self, p: Sequence[float] | np.ndarray) -> Measured:
        """Quantities of the antenna with parameters ``p``."""
        return self.protocol.measure(
            self.hinges.build(np.asarray(p, dtype=float)), self.targets.names
        )

    def compute_residuals(self, x: np.ndarray) -> np.ndarray:
        """Residuals (target,) at the searched vector ``x``."""
        return self.compute_many(np.asarray(x, dtype=float)[None])[0]

    def compute_many(self, xs: np.ndarray) -> np.ndarray:
        """Residuals (vector, target), simulated together; ``FAILED`` where none is measured."""
        new = [k for k, x in enumerate(xs) if self.journal.find(x) is None]
        for k, entry in zip(new, self._simulate(xs[new]) if new else (), strict=True):
            self.journal.add(entry, xs[k])
        entries = [self.journal.find(x) for x in xs]
        residuals = np.array([residuals for residuals, _ in entries], dtype=float)
        self.evaluations += len(xs)
        self.seconds += sum(entry[1] for entry in entries)
        self.failures += int(np.all(residuals == FAILED, axis=1).sum())
        errors = np.linalg.norm(residuals, axis=1)
        if errors.min() < self.best_error:
            self.best_x, self.best_error = np.array(xs[np.argmin(errors)]), float(errors.min())
        if self.watch:
            self.watch(self.evaluations, self.best_error)
        return residuals

    def _simulate(self, xs: np.ndarray) -> list[tuple[np.ndarray, float]]:
        """Residuals (target,) of each, and the processor time [s] that they took."""
        antennas = [self.hinges.build(self.hinges.to_p(x)) for x in xs]
        began = time.process_time()
        outcomes = self.protocol.measure_many(antennas, self.targets.names)
        share = (time.process_time() - began) / len(xs)
        return [(self._compare(outcome), share) for outcome in outcomes]

    def _compare(self, outcome: Measured | FeelerError) -> np.ndarray:
        if isinstance(outcome, Exception):
            return np.full(len(self.targets.names), FAILED)
        return compute_residuals(outcome.values, self.targets.values)

    def compute_error(self, x: np.ndarray) -> float:
        """The paper's cost at ``x``: normalised Euclidean distance."""
        return float(np.linalg.norm(self.compute_residuals(x)))

    def compute_jacobian(self, x: np.ndarray, step: float = 0.01) -> np.ndarray:
        """Central differences (target, parameter) of the residuals, all 2·n simulations together.

        ``step`` is a share of a parameter's typical change; steps that leave the bounds are cut at
        them.
        """
        low, high = self.hinges.bounds
        change = np.diag(step * self.hinges.scale)
        points = np.clip(np.concatenate([x + change, x - change]), low, high)
        residuals = self.compute_many(points)
        n = len(x)
        distance = np.diag(points[:n] - points[n:])
        return ((residuals[:n] - residuals[n:]) / distance[:, None]).T

    def describe(self) -> str:
        """A short text that changes with anything that changes a residual."""
        made_with = {
            "hinges": self.hinges.name,
            "bounds": self.hinges.bounds,
            "antenna": self.hinges.build(self.hinges.start),
            "protocol": self.protocol,
            "targets": self.targets,
        }
        return make_key(made_with, "feeler.calibration.problem")

    def score(self, p: Sequence[float] | np.ndarray) -> tuple[Measured, float, float]:
        """Measured quantities, normalised distance and median symmetric accuracy of ``p``."""
        measured = self.measure(p)
        values = self.targets.values
        return (
            measured,
            compute_distance(measured.values, values),
            compute_symmetric_accuracy(measured.values, values),
        )


@checked
def compute_residuals(simulated: np.ndarray, target: np.ndarray) -> np.ndarray:
    """Relative deviations (target,) = (target − simulated) / target, of the paper's cost."""
    simulated, target = np.asarray(simulated, dtype=float), np.asarray(target, dtype=float)
    if simulated.shape != target.shape:
        raise InvalidInput(
            f"one simulated value per target is needed, got {simulated.shape} and {target.shape}."
        )
    if not (np.isfinite(simulated).all() and np.isfinite(target).all()):
        raise InvalidInput(
            f"a cost of missing numbers is no number: simulated {simulated}, targets {target}."
        )
    if np.any(target == 0):
        raise InvalidInput(
            "a target of 0 has no relative deviation; choose a quantity that is not 0."
        )
    return (target - simulated) / target


@checked
def compute_distance(simulated: np.ndarray, target: np.ndarray) -> float:
    """Normalised Euclidean distance ``√ Σ ((target − simulated) / target)²`` (Methods)."""
    return float(np.linalg.norm(compute_residuals(simulated, target)))


@checked
def compute_symmetric_accuracy(simulated: np.ndarray, target: np.ndarray) -> float:
    """Median symmetric accuracy ``exp(median |ln(simulated / target)|) − 1``, as a fraction.

    Morley et al. 2018, doi:10.1002/2017SW001669; infinite where half the simulated quantities or
    more have no logarithm.
    """
    compute_residuals(simulated, target)
    ratio = np.asarray(simulated, dtype=float) / np.asarray(target, dtype=float)
    size = np.where(ratio > 0, np.abs(np.log(np.where(ratio > 0, ratio, 1.0))), np.inf)
    return float(np.expm1(np.median(size)))
