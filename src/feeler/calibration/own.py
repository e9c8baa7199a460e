"""Fit your own animals: hinges from recorded free responses, by the whole trace or by frequency and damping."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.optimize import least_squares
from scipy.signal import savgol_filter
from scipy.stats import t as student

from feeler.antenna.antenna import Antenna
from feeler.calibration.hinges import Hinges, make_scale
from feeler.calibration.optimise import search
from feeler.calibration.problem import Problem
from feeler.calibration.protocol import Protocol
from feeler.calibration.recording import Traces
from feeler.calibration.targets import make_targets
from feeler.checked import checked
from feeler.errors import FeelerError, InvalidInput
from feeler.response import check_trace, measure_free_response

WAYS = ("trace", "targets")
MAX_ITERATIONS = 25
MIN_FREQUENCY, MAX_FREQUENCY = 5e-4, 1.0  # kHz [C]; cricket and cockroach antennae swing at tens of Hz
MAX_JUMP = 0.25  # [C] white noise, as a share of the first deflection, beyond which no turning point can be trusted


@dataclass(frozen=True, kw_only=True, eq=False)
class TraceFit:
    """Hinges fitted to recorded traces, animal by animal."""

    names: tuple[str, ...]
    animals: tuple[str, ...]
    each: np.ndarray
    """Parameters (animal, parameter)."""
    p: np.ndarray
    """Mean over the animals (of the logarithms, where positive)."""
    low: np.ndarray
    """Lower end of the confidence interval of ``p``."""
    high: np.ndarray
    """Upper end."""
    residual: np.ndarray
    """Relative root-mean-square residual (animal,); by targets: the error."""
    simulated: np.ndarray
    """Tip displacement (animal, sample), first value 1, of each fit."""
    interval: str
    """Where the interval comes from."""


@checked
def fit_traces(
    traces: Traces,
    antenna: Antenna,
    *,
    by: str = "trace",
    hinges: Hinges | None = None,
    protocol: Protocol | None = None,
    confidence: float = 0.95,
) -> TraceFit:
    """Fit hinges to the free responses of one or more animals after a step release.

    Parameters
    ----------
    by
        ``trace``: least squares over every sample, amplitude free. ``targets``: damped frequency and damping ratio.
    hinges
        Family to search; default: two factors on the antenna's stiffness and damping, as much as a tip's free
        response can determine (see ``analyse_directions`` before asking for more).
    protocol
        How the step is made; default: held 10 mm from the fixation.

    Returns
    -------
    TraceFit
        With ``confidence`` intervals of the mean: Student's t over the animals, or for a single animal the linear
        estimate from its residuals taken as white noise.
    """
    if by not in WAYS:
        raise InvalidInput(f"unknown way {by!r} of fitting; valid: {', '.join(WAYS)}.")
    if not 0 < confidence < 1:
        raise InvalidInput(f"confidence must lie between 0 and 1, got {confidence}.")
    hinges = make_scale(antenna) if hinges is None else hinges
    protocol = replace(protocol or Protocol(), step_duration=float(max(traces.time[-1], 20.0)) + 1.0)
    results = [
        _fit_one(traces.time, row, name, hinges, protocol, by)
        for name, row in zip(traces.names, traces.displacement, strict=True)
    ]
    xs = np.array([result[0] for result in results])
    middle = xs.mean(axis=0)
    half, origin = _compute_half_width(xs, results[0][2], confidence, len(traces.time))
    return TraceFit(
        names=hinges.names,
        animals=traces.names,
        each=hinges.to_p(xs),
        p=hinges.to_p(middle),
        low=hinges.to_p(middle - half),
        high=hinges.to_p(middle + half),
        residual=np.array([result[1] for result in results]),
        simulated=np.array([simulate_tip(hinges, [x], protocol, traces.time)[0] for x in xs]),
        interval=origin,
    )


def _compute_half_width(xs: np.ndarray, deviation: np.ndarray, confidence: float, n: int) -> tuple[np.ndarray, str]:
    """Half width (parameter,) of the interval of the mean."""
    count = len(xs)
    if count > 1:
        factor = student.ppf((1 + confidence) / 2, count - 1) / np.sqrt(count)
        return factor * xs.std(axis=0, ddof=1), f"spread of {count} animals (Student's t)"
    factor = student.ppf((1 + confidence) / 2, max(n - xs.shape[1], 1))
    return factor * deviation, "one animal: residuals taken as white noise"


def simulate_tip(hinges: Hinges, xs: Sequence[np.ndarray], protocol: Protocol, time: np.ndarray) -> np.ndarray:
    """Tip displacement (vector, sample) after a step at ``time`` [ms] from release, first value 1."""
    tips = protocol.simulate_steps([hinges.build(hinges.to_p(x)) for x in xs])
    found = []
    for outcome in tips:
        if isinstance(outcome, Exception):
            raise outcome
        own, tip = outcome
        found.append(_interpolate(time, own, tip / tip[0]))
    return np.array(found)


def _interpolate(time: np.ndarray, own: np.ndarray, tip: np.ndarray) -> np.ndarray:
    return CubicSpline(own, tip)(time)


def _fit_one(
    time: np.ndarray, trace: np.ndarray, name: str, hinges: Hinges, protocol: Protocol, by: str
) -> tuple[np.ndarray, float, np.ndarray]:
    """Searched vector, residual and standard deviations of one animal."""
    start = _fit_targets(time, trace, name, hinges, protocol)
    if by == "targets":
        deviation = np.full(len(start[0]), np.nan)
        return *start, deviation
    goal = trace / trace[0]
    low, high = hinges.bounds

    def residual(x: np.ndarray) -> np.ndarray:
        return _subtract(simulate_tip(hinges, [x], protocol, time), goal)[0]

    def jacobian(x: np.ndarray) -> np.ndarray:
        change = np.diag(0.02 * hinges.scale)
        both = _subtract(simulate_tip(hinges, [*(x + change), *(x - change)], protocol, time), goal)
        return ((both[: len(x)] - both[len(x) :]) / (2 * np.diag(change))[:, None]).T

    inside = np.clip(start[0], low + 1e-6, high - 1e-6)
    best = least_squares(
        residual, inside, jac=jacobian, bounds=(low, high), x_scale=hinges.scale, max_nfev=MAX_ITERATIONS, xtol=1e-6
    )
    variance = 2 * best.cost / max(time.size - len(start[0]) - 1, 1)
    deviation = np.sqrt(variance * np.diag(np.linalg.pinv(best.jac.T @ best.jac)))
    return best.x, float(np.sqrt(2 * best.cost / np.sum(goal**2))), deviation


def _subtract(simulated: np.ndarray, goal: np.ndarray) -> np.ndarray:
    """Simulated − recorded with the simulated amplitude (linear) at its best."""
    amplitude = simulated @ goal / np.einsum("ij,ij->i", simulated, simulated)
    return amplitude[:, None] * simulated - goal


def _fit_targets(time, trace, name, hinges: Hinges, protocol: Protocol) -> tuple[np.ndarray, float]:
    """Match the trace's damped frequency and damping ratio; the searched vector and the error."""
    free = measure_trace(time, trace, name)
    targets = make_targets(frequency=free.frequency, damping_ratio=free.damping_ratio)
    found = search(Problem(hinges=hinges, targets=targets, protocol=protocol), hinges.start, max_evaluations=120)
    return hinges.to_x(found.p), found.error


@checked
def measure_trace(time: np.ndarray, trace: np.ndarray, name: str = "trace"):
    """Free response of a recorded trace; turning points within its noise do not count.

    Raises
    ------
    InvalidInput
        Over-damped: there is no frequency to fit. Or a trace that cannot be measured, or in another unit of time.
    """
    check_trace(time, trace, f"trace {name!r}")
    noise = float(np.std(np.diff(trace, 2)) / np.sqrt(6.0) / max(abs(trace[0]), 0.05 * np.abs(trace).max()))
    if noise > MAX_JUMP:
        raise InvalidInput(
            f"trace {name!r} jumps from sample to sample by {noise:.0%} of its first deflection: it swings faster than "
            f"its sampling rate ({1 / (time[1] - time[0]):g} kHz) can show, or is too noisy. Sample faster, and check "
            "that the first sample is the release."
        )
    try:
        free = measure_free_response(time, _smooth(trace), floor=float(np.clip(4 * noise, 1e-3, 0.2)), fit=False)
    except FeelerError as error:
        raise InvalidInput(f"trace {name!r}: {error}") from error
    if free.frequency is None:
        raise InvalidInput(
            f"trace {name!r} is over-damped: it settles without a cycle, so it has no damped frequency to fit. Record "
            "with less noise, or leave it out."
        )
    if free.frequency > MAX_FREQUENCY:
        raise InvalidInput(
            f"trace {name!r} swings at {free.frequency:g} kHz, which no antenna does: its time is probably in s, "
            "not ms. Name the column time_s."
        )
    if free.frequency < MIN_FREQUENCY:
        raise InvalidInput(
            f"trace {name!r} swings at {1e3 * free.frequency:g} Hz, which no antenna does: its time is probably in ms, "
            "not s. Name the column time_ms."
        )
    return free


def _smooth(trace: np.ndarray) -> np.ndarray:
    """The trace through a cubic Savitzky–Golay filter that spans 80 % of the time to the first zero crossing, so that
    noise does not move the turning points."""
    crossing = int(np.argmax(trace * np.sign(trace[0]) <= 0))
    window = 2 * int(0.4 * crossing) + 1
    return savgol_filter(trace, window, 3) if 5 <= window < trace.size else trace


@checked
def make_synthetic_traces(
    antenna: Antenna,
    rng: np.random.Generator,
    *,
    n_animals: int = 5,
    spread: float = 0.05,
    noise: float = 0.01,
    interval: float = 1.0,
    duration: float = 90.0,
    protocol: Protocol | None = None,
    planted: tuple[float, float] = (1.0, 1.0),
) -> Traces:
    """Simulated free responses: each animal's stiffness and damping factors around ``planted`` (log-normal, sd
    ``spread``), white noise of sd ``noise`` of the first deflection, sampled as the animals were (1000 frames/s)."""
    hinges = make_scale(antenna)
    time = np.arange(0.0, duration, interval)
    protocol = replace(protocol or Protocol(), step_duration=duration + 1.0)
    xs: np.ndarray = np.log(planted) + spread * rng.standard_normal((n_animals, 2))
    tips = simulate_tip(hinges, list(xs), protocol, time)
    noisy = 8.0 * (tips + noise * rng.standard_normal(tips.shape))
    names = tuple(f"synthetic{k + 1}" for k in range(n_animals))
    return Traces(time=time, displacement=noisy, names=names, source="synthetic")
