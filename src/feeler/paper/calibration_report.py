"""Tables of the calibration: what the published constants give, what refits find, what is determined."""

from dataclasses import dataclass

import numpy as np
from matplotlib.figure import Figure, SubFigure

from feeler.antenna.antenna import Antenna
from feeler.antenna.cockroach import cockroach
from feeler.calibration import (
    Directions,
    Fit,
    Measured,
    Minimum,
    Problem,
    Profiles,
    Protocol,
    analyse_directions,
    bootstrap,
    compute_profiles,
    fit,
    load_targets,
    make_hinges,
    make_starts,
    search,
    walk_loose,
)
from feeler.physics.engine import DEFAULT_ENGINE
from feeler.plotting.style import PALETTE

PAPER_P = (37.78, 25.24, -0.0827, -0.0533)  # [P] p1…p4
PAPER_ERROR, PAPER_ACCURACY = 0.067, 0.0035  # [P]
WALK = np.array([-1.0, -0.6, -0.4, -0.2, 0.2, 0.4, 0.6, 1.0])  # [C] typical changes along the loosest direction
FAMILIES = ("exponential", "linear", "constant")


@dataclass(frozen=True, kw_only=True, eq=False)
class Effort:
    """How much a scale spends; zero leaves a part out."""

    refits: int
    """Starts of the exponential family beyond the published constants."""
    control_starts: int
    """Starts of the linear and of the constant family."""
    compared: tuple[str, ...]
    """Optimisers to compare from one start."""
    places: int
    """Places of each error profile (odd), 0 for none."""
    draws: int
    speeds: tuple[float, ...]
    """Speeds and levers of the impulse whose effect on the ratios is shown."""
    levers: tuple[float | None, ...]


EFFORTS = {
    "smoke": Effort(refits=0, control_starts=0, compared=(), places=0, draws=50, speeds=(), levers=()),
    "quick": Effort(refits=0, control_starts=0, compared=(), places=0, draws=500, speeds=(), levers=()),
    "paper": Effort(
        refits=3,
        control_starts=2,
        compared=("powell", "nelder-mead", "least-squares"),
        places=5,
        draws=2000,
        speeds=(0.1, 0.2, 0.4, 0.6),
        levers=(None, 20.0),
    ),
}


@dataclass(frozen=True, kw_only=True, eq=False)
class Calibration:
    """Everything the report shows."""

    published: tuple[Measured, float, float]
    """Quantities, error and symmetric accuracy of p1…p4."""
    presets: dict[str, tuple[Measured, float, float]]
    """The same of the shipped profiles."""
    refits: Fit | None
    controls: dict[str, Fit]
    compared: tuple[Minimum, ...]
    directions: Directions
    walked: tuple[np.ndarray, np.ndarray]
    """Parameters (step, parameter) and errors (step,) along the loosest direction from the published constants."""
    profiles: Profiles | None
    draws: np.ndarray
    """Bootstrapped parameters (draw, parameter)."""
    ratios: list[tuple[float, float | None, np.ndarray]]
    """Speed [mm/ms], lever [mm] and the published constants' deflection ratios there."""

    @property
    def widest_spread(self) -> float:
        """Largest factor by which one base parameter differs among fits at least as good as the paper's 0.067."""
        found = [PAPER_P, *self.walked[0][self.walked[1] <= PAPER_ERROR]]
        if self.refits is not None:
            found += [m.p for m in self.refits.minima if m.error <= PAPER_ERROR]
        if self.profiles is not None:
            good = self.profiles.error <= PAPER_ERROR
            found += list(self.profiles.others[good])
        base = np.abs(np.array(found))
        return float((base.max(axis=0) / base.min(axis=0)).max())

    def describe(self) -> str:
        """A plain sentence on what the targets determine."""
        p, error = self.walked
        good = np.vstack([PAPER_P, p[error <= PAPER_ERROR]])
        pairs = zip(self.directions.names, good.min(axis=0), good.max(axis=0), strict=True)
        ranges = ", ".join(f"{name} {low:.3g} to {high:.3g}" for name, low, high in pairs)
        return (
            f"{self.directions.describe()} Along that least determined line the model stays at or below the paper's "
            f"error of {PAPER_ERROR} over {ranges}."
        )


def compute(
    scale: str = "quick", *, antenna: Antenna | None = None, seed: int = 0, engine: str = DEFAULT_ENGINE
) -> Calibration:
    """Score, refit and analyse with the effort that belongs to ``scale``."""
    effort, rng = EFFORTS[scale], np.random.default_rng(seed)
    antenna = cockroach() if antenna is None else antenna
    targets, protocol = load_targets("cockroach"), Protocol(engine=engine)

    def make(name: str) -> Problem:
        return Problem(hinges=make_hinges(name, antenna), targets=targets, protocol=protocol)

    problem = make("exponential")
    starts = make_starts(problem.hinges, effort.refits + 1, rng)[1:]
    refits = fit(problem, starts, max_evaluations=80) if effort.refits else None
    best = np.array(PAPER_P) if refits is None else refits.p
    directions = analyse_directions(problem, np.array(PAPER_P))
    return Calibration(
        published=problem.score(PAPER_P),
        presets={name: _score_preset(name, make("scale")) for name in FAMILIES},
        refits=refits,
        controls=_fit_controls(make, effort.control_starts, rng),
        compared=_compare(make, effort.compared, starts),
        directions=directions,
        walked=walk_loose(problem, directions, WALK),
        profiles=compute_profiles(problem, best, n_places=effort.places, refits=2) if effort.places else None,
        draws=bootstrap(problem, np.array(PAPER_P), rng, n_draws=effort.draws),
        ratios=_sweep(make, effort),
    )


def _score_preset(name: str, problem: Problem) -> tuple[Measured, float, float]:
    same = Problem(hinges=make_hinges("scale", cockroach(name)), targets=problem.targets, protocol=problem.protocol)
    return same.score((1.0, 1.0))


def _fit_controls(make, n_starts: int, rng: np.random.Generator) -> dict[str, Fit]:
    if not n_starts:
        return {}
    fits = {}
    for name in ("linear", "constant"):
        problem = make(name)
        fits[name] = fit(problem, make_starts(problem.hinges, n_starts, rng, spread=0.5), max_evaluations=60)
    return fits


def _compare(make, methods: tuple[str, ...], starts: np.ndarray) -> tuple[Minimum, ...]:
    return tuple(search(make("exponential"), starts[0], method, max_evaluations=150) for method in methods)


def _sweep(make, effort: Effort) -> list[tuple[float, float | None, np.ndarray]]:
    rows = []
    for lever in effort.levers:
        for speed in effort.speeds:
            problem = make("exponential")
            problem.protocol = Protocol(speed=speed, lever=lever, engine=problem.protocol.engine)
            problem.targets = problem.targets.only("ratio_71", "ratio_86")
            rows.append((speed, lever, problem.measure(PAPER_P).values))
    return rows


def plot_directions(directions: Directions, figure: Figure | SubFigure) -> None:
    """Sensitivities and what each direction is made of."""
    left, right = figure.subplots(1, 2, width_ratios=(1, 1.6))
    number = np.arange(1, len(directions.sensitivity) + 1)
    left.semilogy(number, directions.sensitivity, "o-", color=PALETTE[0])
    left.set(xlabel="direction", ylabel="change of the error per typical change", xticks=number)
    image = right.imshow(directions.direction, cmap="RdBu_r", vmin=-1, vmax=1, aspect="auto")
    right.set(xticks=range(len(directions.names)), xticklabels=directions.names, yticks=number - 1, yticklabels=number)
    right.set(ylabel="direction", title="what moves together")
    figure.colorbar(image, ax=right, label="share")


def plot_profiles(profiles: Profiles, figure: Figure | SubFigure) -> None:
    """Error of the best fit with one parameter held."""
    axes = figure.subplots(1, len(profiles.names), sharey=True, squeeze=False)[0]
    for ax, name, value, error in zip(axes, profiles.names, profiles.value, profiles.error, strict=True):
        ax.plot(value, error, "o-", ms=3, color=PALETTE[0])
        ax.axhline(PAPER_ERROR, color="#888888", ls="--", lw=0.8)
        ax.set(xlabel=name, yscale="log")
    axes[0].set_ylabel("error, the others refitted")
