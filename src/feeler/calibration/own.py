"""Fit your own animals: hinges from recorded free responses."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.optimize import least_squares
from scipy.stats import t as student

from feeler.antenna.antenna import Antenna
from feeler.calibration.hinges import Band, Hinges, compute_band, make_scale
from feeler.calibration.identify import Directions, decompose
from feeler.calibration.optimise import search
from feeler.calibration.problem import Problem
from feeler.calibration.protocol import Protocol
from feeler.calibration.recording import Traces, get_place
from feeler.calibration.targets import make_targets
from feeler.calibration.trace import measure_free_trace, measure_trace
from feeler.errors import InvalidInput
from feeler.physics.clock import MAX_SAMPLES
from feeler.progress import Advance, show_progress
from feeler.records.checked import checked
from feeler.records.record import OneOf
from feeler.records.shown import Shown

_MAX_ITERATIONS = 25
_LATE = (-1.0, 4.0)  # samples [C]; so early or late may a release be that was found in a trace


@dataclass(frozen=True, kw_only=True, eq=False)
class TraceFit(Shown):
    """Hinges fitted to recorded traces, animal by animal.

    Attributes
    ----------
    each : np.ndarray
        Parameters (animal, parameter).
    p : np.ndarray
        Mean over the animals (of the logarithms, where positive).
    low : np.ndarray
        Lower end of the confidence interval of ``p``.
    high : np.ndarray
        Upper end.
    residual : np.ndarray
        Relative root-mean-square residual (animal,); by targets: the error.
    simulated : np.ndarray
        Displacement (trace, sample) of each fit, as the recording's: 1 is the animal's outermost
        point at the release.
    interval : str
        Where the interval comes from.
    band : Band | None
        Stiffness and damping along the antenna with their intervals; None where nothing is known of
        the spread.
    directions : Directions | None
        What the first animal's trace determines best and least; None for a fit by targets.
    """

    DRAWN = "draw_traces"

    names: tuple[str, ...]
    animals: tuple[str, ...]
    each: np.ndarray
    p: np.ndarray
    low: np.ndarray
    high: np.ndarray
    residual: np.ndarray
    simulated: np.ndarray
    interval: str
    band: Band | None
    directions: Directions | None


@dataclass(frozen=True, kw_only=True, eq=False)
class _Fitted:
    """One animal's searched vector, and what its residuals say of it.

    Attributes
    ----------
    shift : float
        How long after its release the trace begins [ms].
    """

    x: np.ndarray
    residual: float
    covariance: np.ndarray
    jacobian: np.ndarray | None = None
    shift: float = 0.0


@checked
def fit_traces(
    traces: Traces,
    antenna: Antenna,
    *,
    by: Annotated[str, OneOf(("trace", "targets"))] = "trace",
    hinges: Hinges | None = None,
    protocol: Protocol | None = None,
    confidence: float = 0.95,
    progress: Advance | None = None,
) -> TraceFit:
    """Fit hinges to the free responses of one or more animals after a step release.

    Parameters
    ----------
    by
        ``trace``: least squares over every sample of every point, one amplitude free. ``targets``:
        damped frequency and damping ratio of the outermost point.
    hinges
        Family to search; default: two factors on the antenna's stiffness and damping, as much as a
        tip's free response can determine (see ``directions`` and ``band`` of the result before
        asking for more).
    protocol
        How the step is made; default: held 10 mm from the fixation.
    progress
        Called with (done, total) animals; default: a bar that appears after 5 s.

    Returns
    -------
    TraceFit
        With ``confidence`` intervals of the mean: Student's t over the animals, or for a single
        animal the linear estimate from its residuals taken as white noise.
    """
    if not 0 < confidence < 1:
        raise InvalidInput(f"confidence must lie between 0 and 1, got {confidence}.")
    hinges = make_scale(antenna) if hinges is None else hinges
    step = float(traces.time[1] - traces.time[0])
    late = _LATE[1] * step if traces.found else 0.0
    protocol = (protocol or Protocol()).replace(
        step_duration=float(max(traces.time[-1], 20.0)) + 1.0 + late
    )
    found = []
    with show_progress(progress, "animals") as advance:
        for done, animal in enumerate(traces.animals, 1):
            found.append(_fit_one(traces, animal, hinges, protocol, by))
            advance(done, len(traces.animals))
    first = found[0]
    xs = np.array([one.x for one in found])
    middle, covariance, factor, origin = _measure_spread(
        xs, first.covariance, confidence, len(traces.time)
    )
    half = factor * np.sqrt(np.diag(covariance))
    return TraceFit(
        names=hinges.names,
        animals=traces.animals,
        each=hinges.to_p(xs),
        p=hinges.to_p(middle),
        low=hinges.to_p(middle - half),
        high=hinges.to_p(middle + half),
        residual=np.array([one.residual for one in found]),
        simulated=_simulate_all(traces, hinges, found, protocol),
        interval=origin,
        band=(
            None
            if np.isnan(covariance).any()
            else compute_band(hinges, hinges.to_p(middle), covariance, factor)
        ),
        directions=(
            None
            if first.jacobian is None
            else decompose(hinges.names, hinges.to_p(first.x), first.jacobian * hinges.scale)
        ),
    )


def _simulate_all(
    traces: Traces, hinges: Hinges, found: Sequence[_Fitted], protocol: Protocol
) -> np.ndarray:
    """Every trace's fit (trace, sample), in the order of the traces."""
    rows: dict[str, np.ndarray] = {}
    for animal, one in zip(traces.animals, found, strict=True):
        places = traces.take(animal)[0]
        moved = _simulate_steps(hinges, [one.x], protocol, traces.time, places, [one.shift])[0]
        rows |= {
            f"{animal}@{place:.12g}": row for place, row in zip(places, moved, strict=True)
        }
    return np.array(
        [rows[f"{name.partition('@')[0]}@{get_place(name):.12g}"] for name in traces.names]
    )


def _measure_spread(
    xs: np.ndarray, covariance: np.ndarray, confidence: float, n: int
) -> tuple[np.ndarray, np.ndarray, float, str]:
    """Mean, its covariance, the interval's reach in standard deviations, and its origin."""
    count, upper = len(xs), (1 + confidence) / 2
    if count > 1:
        spread = np.atleast_2d(np.cov(xs.T)) / count
        return (
            xs.mean(axis=0),
            spread,
            student.ppf(upper, count - 1),
            f"spread of {count} animals (Student's t)",
        )
    words = "one animal: residuals taken as white noise"
    return xs[0], covariance, student.ppf(upper, max(n - xs.shape[1], 1)), words


def _simulate_steps(
    hinges: Hinges,
    xs: Sequence[np.ndarray],
    protocol: Protocol,
    time: np.ndarray,
    places: Sequence[float] | np.ndarray = (1.0,),
    shifts: Sequence[float] | np.ndarray | None = None,
) -> np.ndarray:
    """Displacement (vector, place, sample) after a step at ``time`` + shift [ms] from release.

    1 is the last place's displacement while it is held, as it is before the release.
    """
    found = []
    outcomes = protocol.simulate_steps([hinges.build(hinges.to_p(x)) for x in xs], places)
    for outcome, shift in zip(
        outcomes, np.zeros(len(xs)) if shifts is None else shifts, strict=True
    ):
        if isinstance(outcome, Exception):
            raise outcome
        own, moved = outcome
        found.append(
            CubicSpline(own, moved / moved[-1, 0], axis=1)(np.maximum(time + shift, 0.0))
        )
    return np.array(found)


def _fit_one(
    traces: Traces, animal: str, hinges: Hinges, protocol: Protocol, by: str
) -> _Fitted:
    """The fit of one animal; where the release was found, how late that was is fitted too."""
    (places, rows), n = traces.take(animal), len(hinges.names)
    begin = _fit_targets(traces.time, rows[-1], animal, hinges, protocol, by)
    if by == "targets":
        return _Fitted(x=begin[0], residual=begin[1], covariance=np.full((n, n), np.nan))
    goal = (rows / rows[-1, 0]).ravel()
    step = float(traces.time[1] - traces.time[0]) if traces.found else 0.0
    low, high = (
        np.append(bound, late)[: n + traces.found]
        for bound, late in zip(hinges.bounds, _LATE, strict=True)
    )
    scale = np.append(hinges.scale, 1.0)[: n + traces.found]

    def simulate(xs: Sequence[np.ndarray]) -> np.ndarray:
        shifts = [step * x[n] if traces.found else 0.0 for x in xs]
        return _simulate_steps(
            hinges, [x[:n] for x in xs], protocol, traces.time, places, shifts
        ).reshape(len(xs), -1)

    def residual(x: np.ndarray) -> np.ndarray:
        return _subtract(simulate([x]), goal)[0]

    def jacobian(x: np.ndarray) -> np.ndarray:
        change = np.diag(0.02 * scale)
        both = _subtract(simulate([*(x + change), *(x - change)]), goal)
        return ((both[: len(x)] - both[len(x) :]) / (2 * np.diag(change))[:, None]).T

    start = np.clip(np.append(begin[0], 0.5)[: n + traces.found], low, high)
    best = least_squares(
        residual,
        start,
        jac=jacobian,
        bounds=(low, high),
        x_scale=scale,
        max_nfev=_MAX_ITERATIONS,
        xtol=1e-6,
    )
    variance = 2 * best.cost / max(goal.size - start.size - 1, 1)
    return _Fitted(
        x=best.x[:n],
        residual=float(np.sqrt(2 * best.cost / np.sum(goal**2))),
        covariance=(variance * np.linalg.pinv(best.jac.T @ best.jac))[:n, :n],
        jacobian=_project(best.jac[:, :n], best.jac[:, n:]),
        shift=step * float(best.x[n]) if traces.found else 0.0,
    )


def _project(jacobian: np.ndarray, others: np.ndarray) -> np.ndarray:
    """What of the jacobian's columns the others cannot undo."""
    return (
        jacobian - others @ np.linalg.lstsq(others, jacobian, rcond=None)[0]
        if others.size
        else jacobian
    )


def _subtract(simulated: np.ndarray, goal: np.ndarray) -> np.ndarray:
    """Simulated − recorded with the simulated amplitude (linear) at its best."""
    amplitude = simulated @ goal / np.einsum("ij,ij->i", simulated, simulated)
    return amplitude[:, None] * simulated - goal


def _fit_targets(
    time, trace, name, hinges: Hinges, protocol: Protocol, by: str
) -> tuple[np.ndarray, float]:
    """Match the trace's damped frequency and damping ratio; the searched vector and the error.

    A trace that is fitted sample by sample may be over-damped: the search then starts from the
    family's own start.
    """
    if by == "trace" and measure_free_trace(time, trace, name).frequency is None:
        return hinges.to_x(hinges.start), float("nan")
    free = measure_trace(time, trace, name)
    targets = make_targets(frequency=free.frequency, damping_ratio=free.damping_ratio)
    found = search(
        Problem(hinges=hinges, targets=targets, protocol=protocol),
        hinges.start,
        max_evaluations=120,
    )
    return hinges.to_x(found.p), found.error


@checked
def make_synthetic_traces(
    antenna: Antenna,
    rng: np.random.Generator,
    *,
    n_animals: Annotated[int, "> 0"] = 5,
    spread: float = 0.05,
    noise: float = 0.01,
    interval: Annotated[float, "> 0"] = 1.0,
    duration: Annotated[float, "> 0"] = 90.0,
    protocol: Protocol | None = None,
    planted: tuple[float, float] = (1.0, 1.0),
) -> Traces:
    """Simulated free responses of several animals, sampled at 1000 frames/s as the real ones.

    Each animal's stiffness and damping factors lie around ``planted`` (log-normal, sd ``spread``);
    white noise has an sd of ``noise`` of the first deflection.
    """
    if not duration / interval <= MAX_SAMPLES:
        raise InvalidInput(
            f"{duration:g} ms at an interval of {interval:g} ms are more than {MAX_SAMPLES:,}"
            " samples; use a longer interval."
        )
    hinges = make_scale(antenna)
    time = np.arange(0.0, duration, interval)
    protocol = (protocol or Protocol()).replace(step_duration=duration + 1.0)
    xs: np.ndarray = np.log(planted) + spread * rng.standard_normal((n_animals, 2))
    tips = _simulate_steps(hinges, list(xs), protocol, time)[:, 0]
    noisy = 8.0 * (tips + noise * rng.standard_normal(tips.shape))
    names = tuple(f"synthetic{k + 1}" for k in range(n_animals))
    return Traces(time=time, displacement=noisy, names=names, source="synthetic")
