"""The search: antennas near a given one, their cost, and optimisers from several starts."""

import time
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
from annotated_types import Len
from scipy.interpolate import CubicSpline

from feeler.antenna.segments import Antenna, compute_modes
from feeler.decoding.classifiers import describe_classifier
from feeler.design.scoring import DesignTask, Score, score
from feeler.errors import InvalidInput, SimulationDivergedError, require_extra
from feeler.progress import show_progress
from feeler.provenance import Journal, make_key
from feeler.records import Ge, Gt, Record, Registry, Shown
from feeler.validation import Count, Seed, checked

# Space: antennas near one that is given, described by a few numbers.

_PositiveSpace = Annotated[float, Gt(0)]
_Range = tuple[_PositiveSpace, _PositiveSpace]


@dataclass(frozen=True, kw_only=True, eq=False)
class Design:
    """A point of a space: an antenna."""

    antenna: Antenna


class Space(Record):
    """Antennas x ↦ log-factors on a reference's stiffness, damping and length.

    Stiffness and damping have values at knots spread evenly over the segments, between which the
    logarithm of the factor is a natural cubic spline: 0 knots leave the profile, 1 scales it, 2
    give the exponential family (of an exponential reference), as many as hinges free each hinge.
    All entries of x are 0 at the reference; ±1 is each bound. In space the factors are those of
    both planes of bending; torsion stays the reference's.

    Attributes
    ----------
    stiffness : int
        Knots.
    damping : int
        Knots.
    span : float
        The greatest factor on stiffness and damping at a knot, either way.
    length : Range
        Least and greatest factor on all segment lengths; mass goes with it.
    held : Literal[nothing, total, tip]
        The reference's compliance that every antenna has, too; see :func:`match_compliance`.

    Raises
    ------
    InvalidInput
        No freedom at all, or a range that does not hold the reference.
    """

    reference: Antenna
    stiffness: Annotated[int, Ge(0)] = 2
    damping: Annotated[int, Ge(0)] = 2
    span: Annotated[float, Gt(1)] = 100.0
    length: _Range = (1.0, 1.0)
    held: Literal["nothing", "total", "tip"] = "nothing"

    def _check(self) -> None:
        n = self.reference.n_segments
        if max(self.stiffness, self.damping) > n:
            raise InvalidInput(
                f"stiffness and damping must have 0 to {n} knots, one per hinge."
            )
        if not self.length[0] <= 1 <= self.length[1]:
            raise InvalidInput(
                f"length must be factors (low ≤ 1, high ≥ 1), got {self.length}."
            )
        if not self.names:
            raise InvalidInput(
                "this space has no freedom: give stiffness or damping knots, or a range of length."
            )

    @property
    def names(self) -> list[str]:
        """What each number of x changes."""
        knots = [
            f"{what} {k + 1}"
            for what in ("stiffness", "damping")
            for k in range(getattr(self, what))
        ]
        return knots + ["length"] * (self.length != (1.0, 1.0))

    def build(self, x: Annotated[np.ndarray, "parameter"]) -> Design:
        """The design at x, entries beyond ±1 taken at the bound."""
        base, n = self.reference, self.reference.n_segments
        knots = [self.stiffness, self.stiffness + self.damping]
        *logs, rest = np.split(np.clip(np.asarray(x, dtype=float), -1.0, 1.0), knots)
        changes: dict[str, Any] = {}
        for name, at in zip(("stiffness", "damping"), logs, strict=True):
            factor = np.exp(np.log(self.span) * _make_basis(n, len(at)) @ at)
            rows = getattr(base, name)
            changes[name] = _put_bending(rows, _list_bending(rows) * factor)
        low, high = np.log(self.length)
        grow = np.exp(
            np.interp(rest.sum(), (-1, 0, 1), (low, 0.0, high))
        )  # 0 where it is not free
        if self.held != "nothing":
            arm = grow if self.held == "tip" else 1.0  # of a force on the tip
            held = base.replace(stiffness=base.stiffness * arm**2)
            changes["stiffness"] = match_compliance(changes["stiffness"], held, self.held)
        changes["segment_length"] = base.segment_length * grow
        changes["segment_mass"] = base.segment_mass * grow
        return Design(antenna=base.replace(**changes, name="design"))


@checked
def match_compliance(
    shape: Annotated[np.ndarray, "... segment"],
    reference: Antenna,
    held: Literal["total", "tip"] = "total",
) -> np.ndarray:
    """Stiffness of this shape, scaled so that one compliance is the reference's.

    ``held`` is the ``total`` Σ 1/k_n, or that of the ``tip`` under a force, Σ (L − s_n)² / k_n with
    s_n the place of hinge n. In space it is the sum of both planes of bending, and torsion is not
    scaled.
    """
    shape, arm = np.asarray(shape, float), reference.length - reference.hinge_position
    if shape.shape != reference.stiffness.shape or not np.all(shape > 0):
        raise InvalidInput(
            f"shape must be a stiffness > 0 for each of the {arm.size} segments of the reference"
            f" {reference.stiffness.shape}, got shape {shape.shape}."
        )
    weight = arm**2 if held == "tip" else np.ones_like(arm)
    bent, known = _list_bending(shape), _list_bending(reference.stiffness)
    return _put_bending(shape, bent * np.sum(weight / bent) / np.sum(weight / known))


def _list_bending(rows: np.ndarray) -> np.ndarray:
    """What a hinge has for bending, without torsion: (plane, segment), in the plane (segment,)."""
    return rows if rows.ndim == 1 else rows[:2]


def _put_bending(rows: np.ndarray, bent: np.ndarray) -> np.ndarray:
    """The rows with others for bending, and that of torsion as it is."""
    return bent if rows.ndim == 1 else np.concatenate([bent, rows[2:]])


def _make_basis(n_segments: int, knots: int) -> np.ndarray:
    """Values (segment, knot) of the natural cubic splines that are 1 at one knot and 0 at the
    others.
    """
    if knots < 2:
        return np.ones((n_segments, knots))
    if knots == n_segments:
        return np.eye(n_segments)
    places = np.linspace(0, n_segments - 1, knots)
    return CubicSpline(places, np.eye(knots), bc_type="natural")(np.arange(n_segments))


SHEETS = (
    0.0075,
    0.0127,
    0.0254,
    0.0508,
    0.0762,
    0.127,
)  # mm; thicknesses in which Kapton is sold [B]

# Constraints: what keeps a search from winning by ringing, floppiness or hinges that nobody can
# make.

_Positive = Annotated[float, Gt(0)]


class Constraints(Record):
    """What a design must keep; all are off by default. In space stiffness is that of bending.

    Attributes
    ----------
    damping_ratio : Positive | None
        Least damping ratio of each of the first ``modes`` modes.
    damping_share : Positive | None
        Least damping ratio of each of them as a share of the reference's own.
    mass : Positive | None
        Greatest mass [mg].
    compliance : tuple[Positive, Positive] | None
        Least and greatest total compliance Σ 1/k as shares of the reference's.
    softest : Positive | None
        Least stiffness of a hinge as a share of the reference's softest.
    thickness : Positive | None
        Least diameter [mm] of a full round hinge of ``modulus`` that is as stiff: k = E π d⁴ / (64
        ℓ).
    modulus : Positive
        [MPa]; Kapton.
    stiffest : Positive | None
        Greatest stiffness of a hinge as a share of the reference's stiffest.
    width : tuple[Positive, Positive] | None
        Narrowest and widest flexure that can be cut [mm]: each hinge must have a sheet of which a
        strip within these is as stiff, k = p1 E w t³ / (12 ℓ), with E = ``modulus``.
    sheets : tuple[Positive, ...]
        Thicknesses t that are at hand [mm]; default: those in which Kapton is sold.
    hinge_length : Positive
        Free length ℓ of the flexures [mm].
    stiffness_factor : Positive
        p1, the stiffness of the robot's hinges over that formula.
    peak_angle : Positive | None
        Greatest angle of a hinge in all touches [rad]; known only after they are simulated.
    """

    damping_ratio: _Positive | None = None
    damping_share: _Positive | None = None
    modes: Annotated[int, Ge(1)] = 6
    mass: _Positive | None = None
    compliance: tuple[_Positive, _Positive] | None = None
    softest: _Positive | None = None
    thickness: _Positive | None = None
    modulus: _Positive = 2500.0
    stiffest: _Positive | None = None
    width: tuple[_Positive, _Positive] | None = None
    sheets: Annotated[tuple[_Positive, ...], Len(1)] = SHEETS
    hinge_length: _Positive = 0.5
    stiffness_factor: _Positive = 1.0
    peak_angle: _Positive | None = None

    def _check(self) -> None:
        if self.compliance is not None and self.compliance[0] > self.compliance[1]:
            raise InvalidInput(
                f"compliance must be shares 0 < low ≤ high, got {self.compliance}."
            )
        if self.width is not None and self.width[0] > self.width[1]:
            raise InvalidInput(f"width must be 0 < low ≤ high [mm], got {self.width}.")

    def check(self, antenna: Antenna, reference: Antenna) -> dict[str, float]:
        """By constraint, how far it is broken, as the logarithm of the factor that is missing; 0:
        it holds.
        """
        found = {}
        own, other = (_list_bending(one.stiffness) for one in (antenna, reference))
        if self.damping_ratio is not None or self.damping_share is not None:
            ratio = compute_modes(antenna, self.modes).damping_ratio
            if self.damping_ratio is not None:
                found["damping_ratio"] = _lack(ratio.min(), self.damping_ratio)
            if self.damping_share is not None:
                wanted = self.damping_share * compute_modes(reference, self.modes).damping_ratio
                found["damping_share"] = max(
                    _lack(a, b) for a, b in zip(ratio, wanted, strict=True)
                )
        if self.mass is not None:
            found["mass"] = _lack(self.mass, 1e3 * antenna.segment_mass.sum())
        if self.compliance is not None:
            share = np.sum(1 / own) / np.sum(1 / other)
            found["compliance"] = _lack(share, self.compliance[0]) + _lack(
                self.compliance[1], share
            )
        if self.softest is not None:
            found["softest"] = _lack(own.min(), self.softest * other.min())
        if self.stiffest is not None:
            found["stiffest"] = _lack(self.stiffest * other.max(), own.max())
        if self.width is not None:
            # By how much the hinge that is hardest to cut misses the widths, of its best
            # sheet.
            low, high = self.width
            strip = self.stiffness_factor * self.modulus * np.array(self.sheets) ** 3
            bent = _list_bending(antenna.stiffness)[..., None]
            width = 12 * bent * self.hinge_length / strip
            missed = np.maximum(np.log(low / width), 0) + np.maximum(np.log(width / high), 0)
            found["width"] = float(missed.min(axis=-1).max())
        if self.thickness is not None:
            # The diameter d of full round hinges that are as stiff: k = E π d⁴ / (64 ℓ).
            fourth = 64 * own * antenna.segment_length
            found["thickness"] = _lack(
                (fourth / (np.pi * self.modulus)).min() ** 0.25, self.thickness
            )
        return found

    def check_peak(self, peak: float) -> float:
        """How far the peak angle is too great."""
        return 0.0 if self.peak_angle is None else _lack(self.peak_angle, peak)


def _lack(value: float, least: float) -> float:
    return max(float(np.log(least / value)), 0.0) if value > 0 else np.inf


# A search's problem: what each candidate costs, from the journal where it is known, and how
# many broke down.

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

    An optimiser of another library asks ``look(x).cost`` of points in the box ±1, one number for
    each of ``space.names``, and is told that cost.

    Attributes
    ----------
    aim : Literal[bits, accuracy]
        What costs: missing bits, or the share classified incorrectly.
    options : dict[str, Any]
        Workers or executor, as for :func:`feeler.touch`.
    objective : Callable[[Design], float] | None
        What costs, in place of ``aim``: a number to be made small, such as a mass or a score of
        your own; constraints hold all the same. The journal keeps nothing of it.
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
    objective: Callable[[Design], float] | None = None
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
        if self.objective is not None:
            cost = float(self.objective(design))
            fate = "simulated" if np.isfinite(cost) else "diverged"
            return Candidate(x=x, cost=cost if np.isfinite(cost) else 1e3 * FAR, fate=fate)
        # Bits, their error, share of errors, and peak; a peak of ∞ where it diverged.
        values, seconds = self.journal.get_or(lambda: self._measure(design), x)
        self.seconds += seconds
        bits, bits_error, errors, peak = np.array(values, dtype=float)
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

    def _measure(self, design: Design) -> tuple[list[float], float]:
        """What the journal keeps: the four numbers, and the processor time [s] they took."""
        began, values = time.process_time(), [0.0, 0.0, 1.0, np.inf]
        with suppress(SimulationDivergedError):
            one = score(design.antenna, self.task, "optimiser", **self.options)
            values = [one.bits, float(np.nan_to_num(one.bits_error)), one.errors, one.peak]
        return values, time.process_time() - began

    def describe(self) -> str:
        """A short text that changes with anything that changes a score."""
        made_with: dict[str, Any] = {
            "task": self.task,
            "space": self.space,
            "constraints": self.constraints,
        }
        if classifier := self.options.get("classifier"):
            made_with["classifier"] = describe_classifier(classifier)
        return make_key(made_with)


def _check_task(found: Score, task: DesignTask, aim: str = "bits") -> None:
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
    if found.bits < -_CLEAR[0] * whole:  # noise alone gives no less than 0
        raise InvalidInput(
            f"the reference tells {found.bits:.4g} of {whole:.4g} bits: less than nothing, because"
            f" the decoder is sure of wrong answers ({1 - found.errors:.0%} are right). It learns"
            f" from too few touches: raise train (now {task.train} of each class); the noise is not"
            " the cause. Or search by aim='accuracy'."
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


# Optimise: from one or several starts to the antennas that tell a task's touches apart best.

_STEP = 0.15  # [C] first standard deviation of CMA-ES, as a share of the bounds
_TRIES = 600  # [C] antennas looked at (not simulated) to find one that keeps all constraints


@checked
@dataclass(frozen=True, kw_only=True, eq=False)
class Optimum(Shown):
    """Where one search ended.

    Attributes
    ----------
    history : tuple[tuple[int, float], ...]
        Evaluations, and the fewest missing bits until then.
    counts : dict[str, int]
        Candidates by their fate: simulated, excluded by a constraint, diverged, over the peak
        angle.
    seconds : float
        Processor time of its simulations.
    """

    DRAWN = "draw_optimum"

    start: np.ndarray
    best: Candidate
    design: Design
    history: tuple[tuple[int, float], ...]
    counts: dict[str, int]
    seconds: float


_Method = Callable[[DesignProblem, np.ndarray, int, np.random.Generator], None]
"""``method(problem, x, evaluations, rng)`` searches from x; the problem itself keeps the best."""
SEARCHES: Registry[_Method] = Registry("method of design")
"""Every known method by its name."""


@checked
def optimise(
    task: DesignTask,
    space: Space,
    constraints: Constraints | None = None,
    *,
    method: str = "cma",
    evaluations: Count = 150,
    starts: Count = 1,
    far: bool = False,
    seed: Seed = 0,
    aim: Literal["bits", "accuracy"] = "bits",
    objective: Callable[[Design], float] | None = None,
    journal: str | Path | None = None,
    watch: Callable[[DesignProblem], None] | None = None,
    **options: Any,
) -> list[Optimum]:
    """Search a space for antennas that tell most on the optimiser's draws; best first.

    Parameters
    ----------
    method
        ``cma`` (CMA-ES, Hansen 2016, arXiv:1604.00772), or another one of :data:`SEARCHES`.
    evaluations
        Candidates simulated from each start.
    starts, far
        The first start is the reference, the others (with ``far`` all) are drawn evenly from the
        whole space.
    aim
        What is searched for: the fewest missing bits, or the fewest touches classified
        incorrectly. Bits are
        smoother; but a decoder that is sure and wrong, as of touches unlike all it learned from,
        loses many.
    objective
        A function of a :class:`Design` whose value is made small, in place of ``aim``.
    journal
        File that receives each simulated candidate at once; the same call goes on from there with
        the same numbers.
    watch
        Called with the :class:`DesignProblem` after each candidate.
    options
        ``classifier``, as for :func:`feeler.design.score`; ``workers`` or ``executor``, as for
        :func:`feeler.touch`.

    Raises
    ------
    InvalidInput
        A task at which nothing is to be gained, constraints that exclude all, or a journal of
        another search.
    """
    search = SEARCHES[method]
    if method == "cma":
        require_extra("cma", "design", "designing by CMA-ES")
    if objective is None:
        _check_task(score(space.reference, task, "optimiser", **options), task, aim)
    elif constraints is not None and constraints.peak_angle is not None:
        raise InvalidInput(
            "peak_angle is known of touches that the task simulates; an objective= of your own must"
            " keep it itself."
        )
    total = starts * evaluations
    problems = [
        DesignProblem(
            task=task,
            space=space,
            constraints=constraints or Constraints(),
            options=options,
            aim=aim,
            objective=objective,
            watch=watch,
        )
        for _ in range(starts)
    ]
    # who watches shows by itself how far it is
    silent = None if watch is None else lambda _done, _total: None
    with (
        Journal(journal, problems[0].describe() if journal else "0", "search") as kept,
        show_progress(silent, "antennas simulated, at most") as advance,
    ):
        found = []
        for number, problem in enumerate(problems):
            problem.journal, before = kept, number * evaluations

            def report(count: int, before: int = before) -> None:
                advance(min(before + count, total), total)

            rng = np.random.default_rng([seed, number])
            found.append(
                _run(problem, search, number == 0 and not far, evaluations, rng, report)
            )
    return sorted(found, key=lambda one: one.best.cost)


def _run(
    problem: DesignProblem,
    search: _Method,
    near: bool,
    evaluations: int,
    rng: np.random.Generator,
    report: Callable[[int], None],
) -> Optimum:
    start = _find_start(problem, rng, near)
    history, watch = [], problem.watch

    def note(now: DesignProblem) -> None:
        assert now.best is not None
        history.append((now.evaluations, now.best.cost))
        report(now.evaluations)
        if watch:
            watch(now)

    problem.watch = note
    problem.look(start)
    search(problem, start, evaluations, rng)
    assert problem.best is not None
    return Optimum(
        start=start,
        best=problem.best,
        design=problem.space.build(problem.best.x),
        history=tuple(dict(history).items()),
        counts=problem.counts,
        seconds=problem.seconds,
    )


def _find_start(
    problem: DesignProblem, rng: np.random.Generator, near: bool = True
) -> np.ndarray:
    """The reference (``near``) or a point drawn from the whole space, moved to where all
    constraints hold.

    Raises
    ------
    InvalidInput
        No such point was found; the message names the constraint that was broken most.
    """
    size = len(problem.space.names)
    x = np.zeros(size) if near else rng.uniform(-1.0, 1.0, size)

    def broken(at: np.ndarray) -> float:
        return problem.measure_violation(problem.space.build(at))

    strategy = _make_strategy(x, 0.3, rng)
    for _ in range(0, _TRIES, strategy.popsize):
        if not broken(x):
            return x
        points = strategy.ask()
        costs = [broken(point) for point in points]
        strategy.tell(points, costs)
        x = np.array(points[int(np.argmin(costs))])
    worst = problem.constraints.check(problem.space.build(x).antenna, problem.space.reference)
    name = max(worst, key=lambda key: worst[key])
    raise InvalidInput(
        f"the constraints exclude every antenna of this space that was tried ({_TRIES}): {name} is"
        f" missed by a factor of at least {np.exp(worst[name]):.3g}. Loosen it, or widen the space."
    )


def _make_strategy(x: np.ndarray, step: float, rng: np.random.Generator) -> Any:
    """CMA-ES in the box ±1 from x, on random numbers of its own."""
    import cma

    options = {
        "bounds": [-1.0, 1.0],
        "seed": np.nan,
        "verbose": -9,
        "randn": lambda *shape: rng.standard_normal(shape),
    }
    if len(x) == 1:
        options["CMA_active"] = False
    return cma.CMAEvolutionStrategy(np.clip(x, -0.999, 0.999), step, options)


@SEARCHES.register("cma")
def _evolve(
    problem: DesignProblem, x: np.ndarray, evaluations: int, rng: np.random.Generator
) -> None:
    """CMA-ES; what a constraint excludes costs no evaluation."""
    strategy = _make_strategy(x, _STEP, rng)
    while problem.evaluations < evaluations and not strategy.stop():
        points = strategy.ask()
        strategy.tell(points, [min(problem.look(point).cost, 1e6 * FAR) for point in points])
