"""Optimise: from one or several starts to the antennas that tell a task's touches apart best."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np

from feeler.design.constraints import Constraints
from feeler.design.problem import FAR, Candidate, DesignProblem, check_task
from feeler.design.scoring import score
from feeler.design.space import Design, Space
from feeler.design.task import DesignTask
from feeler.disk.journal import Journal
from feeler.errors import InvalidInput, require_extra
from feeler.progress import Advance, show_progress
from feeler.records.checked import checked
from feeler.records.registry import Registry
from feeler.records.shown import Shown

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
    evaluations: Annotated[int, "> 0"] = 150,
    starts: Annotated[int, "> 0"] = 1,
    far: bool = False,
    seed: Annotated[int, "≥ 0"] = 0,
    aim: Literal["bits", "accuracy"] = "bits",
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
        What is searched for: the fewest missing bits, or the fewest touches named wrong. Bits are
        smoother; but a decoder that is sure and wrong, as of touches unlike all it learned from,
        loses many.
    journal
        File that receives each simulated candidate at once; the same call goes on from there with
        the same numbers.
    watch
        Called with the :class:`DesignProblem` after each candidate.
    options
        ``workers`` or ``executor``, as for :func:`feeler.touch`.

    Raises
    ------
    InvalidInput
        A task at which nothing is to be gained, constraints that exclude all, or a journal of
        another search.
    """
    search = SEARCHES[method]
    if method == "cma":
        require_extra("cma", "design", "designing by CMA-ES")
    check_task(score(space.reference, task, "optimiser", **options), task, aim)
    made = DesignProblem(
        task=task, space=space, constraints=constraints or Constraints(), options=options
    )
    # who watches shows by itself how far it is
    silent = None if watch is None else lambda _done, _total: None
    with (
        Journal(journal, made.describe() if journal else "0", "search") as kept,
        show_progress(silent, "antennas simulated, at most") as advance,
    ):
        found = []
        for number in range(starts):
            rng = np.random.default_rng([seed, number])
            problem = DesignProblem(
                task=task,
                space=space,
                constraints=made.constraints,
                options=options,
                journal=kept,
                aim=aim,
                watch=watch,
            )
            report = partial(_report, advance, number * evaluations, starts * evaluations)
            found.append(
                _run(problem, search, number == 0 and not far, evaluations, rng, report)
            )
    return sorted(found, key=lambda one: one.best.cost)


def _report(advance: Advance, before: int, total: int, now: DesignProblem) -> None:
    advance(min(before + now.evaluations, total), total)


def _run(
    problem: DesignProblem,
    search: _Method,
    near: bool,
    evaluations: int,
    rng: np.random.Generator,
    report: Callable[[DesignProblem], None],
) -> Optimum:
    start = find_start(problem, rng, near)
    history, watch = [], problem.watch

    def note(now: DesignProblem) -> None:
        assert now.best is not None
        history.append((now.evaluations, now.best.cost))
        report(now)
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


def find_start(
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
