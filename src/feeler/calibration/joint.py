"""One antenna fitted to everything that was measured: releases, force against deflection, and
impulses.
"""

import itertools
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.optimize import least_squares, minimize_scalar
from scipy.stats import t as student

from feeler.analysis import measure_deflection_ratios
from feeler.antenna import Antenna, compute_modes
from feeler.calibration.fitting import EigenParameters, decompose
from feeler.calibration.hinges import Hinges
from feeler.calibration.measurements import STEEP, Film, ForceCurve, compute_force
from feeler.calibration.problem import Protocol
from feeler.calibration.traces import (
    LATE,
    Traces,
    measure_trace,
    project,
    simulate_steps,
    subtract,
)
from feeler.errors import InvalidInput
from feeler.progress import Advance, show_progress
from feeler.records import Gt, Len, Record, Shown, Unit
from feeler.validation import checked

# What is fitted: factors on the hinges and masses of the antenna that one begins with.

_FACTORS = {
    "stiffness": "factor on every hinge's stiffness",
    "damping": "factor on every hinge's damping",
    "mass": "factor on every segment's mass",
    "stiffness_tilt": "stiffness times exp(tilt · (x − ½)), x the place",
    "damping_tilt": "damping times exp(tilt · (x − ½))",
}
_KNOWN = 1.5  # [C] factor, or exp of a tilt, within which a parameter counts as determined
_LEAST = (
    5e-3  # [C] least sd of a deflection or force, as a share of the largest: the model's own
)
_LEAST_RATIO = 0.01  # [C] of an impulse's deflection ratio
_HEAVY = 2.0  # [C] factor on the mass that is questioned
_STIFF = 30.0  # [C] the same of the stiffness, of which a modulus is a first guess only
_AT_ZERO = 0.02  # [C] of a curve's deflections, by which their end may miss 0 and 0 be at rest
_BETTER = 6.0  # [C] squares of the noise by which another zero must fit a curve better than 0
_ZEROS = 23  # zeros that are tried before a fit
_ROUNDS = 3  # fits, with the noise of each measurement taken from the fit before
_MAX_STEPS = 30
_BAD = 0.15  # [C] relative residual, beyond which another start is tried


class Ratios(Record):
    """Deflections over the tip's when an object has pushed the tip farthest.

    Attributes
    ----------
    place : np.ndarray
        Of the points, as fractions of the length.
    ratio : np.ndarray
        Deflection over the tip's.
    sd : np.ndarray
        Standard deviation of ``ratio`` that comes from tracking.
    """

    place: Annotated[np.ndarray, "point", Len(1)]
    ratio: Annotated[np.ndarray, "point"]
    sd: Annotated[np.ndarray, "point"]


class Measurements(Record):
    """What was measured on one animal.

    Attributes
    ----------
    releases : tuple[Traces, ...]
        Free responses, each of one film.
    forces : tuple[ForceCurve, ...]
    ratios : tuple[Ratios, ...]
        Of impulses, as :func:`measure_impulse_film` gives them.
    deflection : float | None
        How far the antenna was held aside before its releases, where the protocol says
        (:meth:`Film.match_protocol`) [mm]; default: the protocol's.
    """

    name: str = "animal"
    releases: tuple[Traces, ...] = ()
    forces: tuple[ForceCurve, ...] = ()
    ratios: tuple[Ratios, ...] = ()
    deflection: Annotated[float, Gt(0), Unit("mm")] | None = None

    def _check(self) -> None:
        if not (self.releases or self.forces or self.ratios):
            raise InvalidInput(f"nothing was measured on {self.name}.")


@checked
def measure_impulse_film(film: Film) -> Ratios:
    """How far points were deflected when the tip was farthest out, over the tip's deflection.

    Raises
    ------
    InvalidInput
        No point between base and tip, or a tip that is farthest out at an end of the film.
    """
    traces = film.make_traces(release=False)
    place, moved = traces.take(film.name)
    if place.size < 2 or place[-1] != 1:
        raise InvalidInput(
            f"{film.name}: an impulse needs the tip and a point before it, as in base,mid,tip."
        )
    begin = moved[:, :5].mean(axis=1, keepdims=True)
    moved = moved - begin
    noise = np.std(np.diff(moved, 2), axis=1) / np.sqrt(6.0)
    ratio = measure_deflection_ratios(traces.time, moved[:-1], moved[-1])
    peak = np.abs(moved[-1]).max()
    return Ratios(
        place=place[:-1], ratio=ratio, sd=np.hypot(noise[:-1], noise[-1] * ratio) / peak
    )


@dataclass(frozen=True, kw_only=True, eq=False)
class MeasurementFit(Shown):
    """An antenna fitted to several kinds of measurements at once.

    Attributes
    ----------
    antenna : Antenna
        With the fitted parameters.
    names : tuple[str, ...]
        Parameters: factors on the start's stiffness, damping and mass, and tilts.
    each : np.ndarray
        Parameters (animal, parameter).
    p : np.ndarray
        Mean over the animals (of the logarithms, where positive).
    low : np.ndarray
        Lower end of the 95 % interval.
    high : np.ndarray
        Upper end.
    determined : tuple[bool, ...]
        Whether the interval lies within a factor of 1.5 about ``p`` (±0.41 of a tilt).
    interval : str
        Where the interval comes from.
    held : dict[str, str]
        Parameters that were not fitted, and what measurement would determine them.
    residual : dict[str, float]
        Root mean square of what is left of each measurement, as a share of its largest value.
    zero : dict[str, tuple[float, float]]
        Fitted deflection at which the antenna rests, and half of its 95 % interval [mm], of each
        force curve that neither begins nor ends at a deflection of 0, or is clearly not one from
        rest at 0. A straight curve has none.
    directions : EigenParameters
        Combinations that the first animal's measurements determine best and least.
    protocol : Protocol
        How the releases and impulses were simulated.
    """

    DRAWN = "draw_measurements"

    antenna: Antenna
    names: tuple[str, ...]
    animals: tuple[str, ...]
    each: np.ndarray
    p: np.ndarray
    low: np.ndarray
    high: np.ndarray
    determined: tuple[bool, ...]
    interval: str
    held: dict[str, str]
    residual: dict[str, float]
    zero: dict[str, tuple[float, float]]
    directions: EigenParameters
    start: Antenna
    protocol: Protocol

    def to_plain(self) -> dict[str, Any]:
        """The numbers as plain data, without the antennas."""
        names = ("names", "animals", "each", "p", "low", "high", "determined", "interval")
        plain = {name: getattr(self, name) for name in (*names, "held", "residual", "zero")}
        plain["protocol"] = self.protocol.to_plain()
        return plain | {"means": {name: _FACTORS[name] for name in self.names}}

    def describe(self) -> list[str]:
        """A line for each parameter, and one for each that was not fitted."""
        lines = []
        rows = zip(self.names, self.p, self.low, self.high, self.determined, strict=True)
        for name, p, low, high, known in rows:
            words = "" if known else "; these data hardly determine it"
            lines.append(f"{name} = {p:.4g}  (95 %: {low:.4g} to {high:.4g}{words})")
            if name == "mass" and not 1 / _HEAVY < p < _HEAVY:
                lines.append(
                    f"the antenna is {p:.3g} times as heavy as its diameters and density say: are"
                    " the frame rate, the force's unit and the place where it acts right?"
                )
            if name == "stiffness" and not 1 / _STIFF < p < _STIFF:
                lines.append(
                    f"the antenna is {p:.3g} times as stiff as the first guess: are its modulus,"
                    " the frame rate, and the units of force and deflection right?"
                )
        lines += [
            f"{name}: its deflections neither begin nor end at 0, or its curve is not one from rest"
            f" at 0, so where the antenna rests is fitted too: at {value:.4g} ± {half:.2g} mm"
            for name, (value, half) in self.zero.items()
        ]
        return [*lines, *(f"{name}: as given; {why}" for name, why in self.held.items())]


@checked
def make_factors(antenna: Antenna, names: Sequence[str]) -> Hinges:
    """A family of factors on ``antenna``, of those called ``names``: stiffness, damping, mass,
    stiffness_tilt, damping_tilt.

    A tilt multiplies by exp(tilt · (x − ½)), x the place of the hinge (0 base, 1 tip).
    """
    for name in names:
        if name not in _FACTORS:
            raise InvalidInput(f"unknown factor {name!r}; valid: {', '.join(_FACTORS)}.")
    if not names:
        raise InvalidInput("nothing is fitted: give one name or more.")
    tilts = [name.endswith("_tilt") for name in names]
    x = antenna.hinge_position / antenna.length - 0.5

    def build(p: np.ndarray) -> Antenna:
        said = dict(zip(names, np.asarray(p, dtype=float), strict=True))
        stiffness, damping = (
            said.get(name, 1.0) * np.exp(said.get(f"{name}_tilt", 0.0) * x)
            for name in ("stiffness", "damping")
        )
        return antenna.replace(
            stiffness=antenna.stiffness * stiffness,
            damping=antenna.damping * damping,
            segment_mass=antenna.segment_mass * said.get("mass", 1.0),
        )

    return Hinges(
        name="factors",
        names=tuple(names),
        units=("1",) * len(names),
        positive=tuple(not tilt for tilt in tilts),
        start=np.where(tilts, 0.0, 1.0),
        low=np.where(tilts, -8.0, 1e-4),
        high=np.where(tilts, 8.0, 1e4),
        build=build,
    )


def _choose_factors(animals: Sequence[Measurements]) -> tuple[list[str], dict[str, str]]:
    """Parameters that the kinds of measurements can determine, and why not the others.

    A free swing shows stiffness and damping over mass, so that the mass stays as given where no
    force was measured; how stiffness falls along the antenna needs more than the tip.
    """
    swings = any(animal.releases for animal in animals)
    forces = any(animal.forces for animal in animals)
    points = any(len(one.names) > 1 for animal in animals for one in animal.releases)
    places = max((len({one.at for one in animal.forces}) for animal in animals), default=0)
    struck = any(animal.ratios for animal in animals)
    needs = {
        "stiffness": (swings or forces, "a release or a force–deflection curve determines it"),
        "damping": (swings, "a release determines it"),
        "mass": (
            swings and forces,
            "a release and a force–deflection curve together determine it",
        ),
        "stiffness_tilt": (
            points or struck or places > 1,
            "more points along the antenna, forces at several places, or an impulse determine it",
        ),
        "damping_tilt": (points, "a release with more points along the antenna determines it"),
    }
    return (
        [name for name, (can, _) in needs.items() if can],
        {name: why for name, (can, why) in needs.items() if not can},
    )


@checked
def fit_measurements(
    animals: Sequence[Measurements],
    antenna: Antenna,
    *,
    names: Sequence[str] | None = None,
    protocol: Protocol | None = None,
    progress: Advance | None = None,
) -> MeasurementFit:
    """Fit one antenna to all measurements of each animal at once, by least squares.

    Each measurement weighs by its own noise: of a first fit's residuals, corrected for how much
    neighbouring residuals agree, and at least 0.5 % of its largest value [C]. Of releases one
    amplitude and the moment of release are free, of force curves the force at rest and, where the
    deflections neither begin nor end at 0 or the curve is clearly not one from rest at 0, the
    deflection at rest.

    Parameters
    ----------
    antenna
        Segments, masses and first guess.
    names
        Parameters to fit; default: those that the kinds of measurements can determine.
    protocol
        How releases and impulses are made: ``at``, ``deflection``, ``speed``, ``lever``.
    progress
        Called with (done, total) animals.

    Returns
    -------
    MeasurementFit
        With 95 % intervals: linear, from the residuals, for one animal; for several the wider of
        this and Student's t over the animals.

    Raises
    ------
    InvalidInput
        No measurement, or one that does not determine what is to be fitted.
    """
    if not animals:
        raise InvalidInput("no animal was measured; give one or more.")
    chosen, held = _choose_factors(animals)
    if names is not None:
        held = {name: why for name, why in held.items() if name not in names}
        held |= {name: "not asked for" for name in chosen if name not in names}
        chosen = list(names)
    hinges = make_factors(antenna, chosen)
    protocol = protocol or Protocol(at=0.25 * antenna.length, deflection=0.025 * antenna.length)
    found = []
    with show_progress(progress, "animals") as advance:
        for done, animal in enumerate(animals, 1):
            found.append(_fit_animal(animal, hinges, protocol))
            advance(done, len(animals))
    searched, covariances, jacobians, lefts, sizes, zeros = zip(*found, strict=True)
    xs = np.array(searched)
    middle = xs.mean(axis=0)
    own = np.sqrt(np.mean([np.diag(one) for one in covariances], axis=0) / len(found))
    if any(animal.forces or animal.ratios for animal in animals):
        own = own * np.sqrt(len(found))  # they may be one animal's for all
    half = student.ppf(0.975, max(sizes[0] - len(chosen), 1)) * own
    origin = "one animal: from the residuals" if len(found) == 1 else ""
    if len(found) > 1:
        spread = xs.std(axis=0, ddof=1) / np.sqrt(len(found))
        half = np.maximum(half, student.ppf(0.975, len(found) - 1) * spread)
        origin = f"the wider of spread of {len(found)} animals (Student's t) and of residuals"
    tall = np.log(_KNOWN)
    residual, zero = (
        {f"{a.name}: {k}": v for a, row in zip(animals, rows, strict=True) for k, v in row}
        for rows in (lefts, zeros)
    )
    return MeasurementFit(
        antenna=hinges.build(hinges.to_p(middle)),
        names=tuple(chosen),
        animals=tuple(animal.name for animal in animals),
        each=hinges.to_p(xs),
        p=hinges.to_p(middle),
        low=hinges.to_p(middle - half),
        high=hinges.to_p(middle + half),
        determined=tuple(bool(one < tall) for one in half),
        interval=origin,
        held=held,
        residual=residual,
        zero=zero,
        directions=decompose(tuple(chosen), hinges.to_p(xs[0]), jacobians[0] * hinges.scale),
        start=antenna,
        protocol=protocol,
    )


@checked
def fit_traces(traces: Traces, antenna: Antenna, **how: Any) -> MeasurementFit:
    """:func:`fit_measurements` of each animal's free responses; ``how`` are its options.

    A tip's free response determines two factors, on stiffness and damping; traces of several
    points also how these change along the antenna.
    """
    each = [Measurements(name=name, releases=(traces.select(name),)) for name in traces.animals]
    return fit_measurements(each, antenna, **how)


# One animal's fit: blocks of residuals, each with its own noise.


@dataclass(kw_only=True)
class _Block:
    """One measurement: what is left of it for several antennas (antenna, sample), as a share of
    its largest value; ``free`` counts what is fitted of it alone. Its shift, where it has one
    (least, first guess, most), is a number of its own in the searched vector; of a force it is the
    zero of deflections over ``zero`` [mm].
    """

    name: str
    compute: Callable[[Sequence[Antenna], np.ndarray], np.ndarray]
    seen: np.ndarray
    sd: np.ndarray
    least: float
    free: int = 0
    shift: tuple[float, float, float] | None = None
    zero: float = 0.0


_Named = list[tuple[str, float]]
_Zeros = list[tuple[str, tuple[float, float]]]
# An animal's searched vector, its covariance, the Jacobian, what is left of each measurement, how
# many numbers were measured, and the zeros of deflections that were fitted [mm].
_Found = tuple[np.ndarray, np.ndarray, np.ndarray, _Named, int, _Zeros]


def _fit_animal(animal: Measurements, hinges: Hinges, protocol: Protocol) -> _Found:
    if animal.deflection is not None:
        protocol = protocol.replace(deflection=animal.deflection)
    blocks = _make_blocks(animal, hinges, protocol)
    n, late = len(hinges.names), [block for block in blocks if block.shift]
    ends = np.array([block.shift for block in late]).reshape(-1, 3)
    low, high = (
        np.append(bound, end) for bound, end in zip(hinges.bounds, ends[:, ::2].T, strict=True)
    )
    scale = np.concatenate([hinges.scale, np.ones(len(late))])

    def compute(xs: np.ndarray) -> list[np.ndarray]:
        antennas = [hinges.build(hinges.to_p(x[:n])) for x in xs]
        shift = {id(block): xs[:, n + k] for k, block in enumerate(late)}
        zero = np.zeros(len(xs))
        return [block.compute(antennas, shift.get(id(block), zero)) for block in blocks]

    def weigh(parts: list[np.ndarray]) -> np.ndarray:
        return np.concatenate(
            [part / block.sd for part, block in zip(parts, blocks, strict=True)], axis=1
        )

    def residual(x: np.ndarray) -> np.ndarray:
        return weigh(compute(x[None]))[0]

    def jacobian(x: np.ndarray) -> np.ndarray:
        change = np.diag(0.01 * scale)
        both = weigh(compute(np.clip(np.concatenate([x + change, x - change]), low, high)))
        moved = np.clip(x + change, low, high) - np.clip(x - change, low, high)
        return ((both[: len(x)] - both[len(x) :]) / np.diag(moved)[:, None]).T

    def search(start: np.ndarray) -> Any:
        return least_squares(
            residual,
            np.clip(np.append(start, ends[:, 1]), low + 1e-9, high - 1e-9),
            jac=jacobian,
            bounds=(low, high),
            x_scale=scale,
            max_nfev=_MAX_STEPS,
            xtol=1e-6,
            ftol=1e-8,
        )

    def measure_left(x: np.ndarray) -> list[float]:
        parts = compute(x[None])
        return [
            float(np.sqrt(np.sum(part**2) / max(int(block.seen.sum()), 1)))
            for part, block in zip(parts, blocks, strict=True)
        ]

    begin = _guess(animal, hinges)
    best = search(begin)
    if max(measure_left(best.x)) > _BAD:
        others = [hinges.to_x(hinges.start), begin + 0.5, begin - 0.5]
        best = min([best, *(search(one) for one in others)], key=lambda one: one.cost)
    for _ in range(_ROUNDS - 1):
        for block, part in zip(blocks, compute(best.x[None]), strict=True):
            block.sd = _measure_sd(part[0], block)
        best = search(best.x[:n])
    size = sum(int(block.seen.sum()) - block.free for block in blocks)
    whole = np.linalg.pinv(best.jac.T @ best.jac)
    names = [block.name for block in blocks]
    left = list(zip(names, measure_left(best.x), strict=True))
    halves = 1.96 * np.sqrt(np.diag(whole)[n:])
    shifts = zip(late, best.x[n:], halves, strict=True)
    return (
        best.x[:n],
        whole[:n, :n],
        project(best.jac[:, :n], best.jac[:, n:]),
        left,
        size,
        [
            (block.name, (float(x * block.zero), float(half * block.zero)))
            for block, x, half in shifts
            if block.zero
        ],
    )


def _measure_sd(left: np.ndarray, block: _Block) -> np.ndarray:
    """sd of one sample of a measurement, larger where neighbouring residuals agree."""
    if block.sd.size > 1 or int(block.seen.sum()) < 6:
        return block.sd
    rms = np.sqrt(np.sum(left**2) / max(int(block.seen.sum()) - block.free, 1))
    kept = left[block.seen.ravel()]
    alike = np.clip(kept[1:] @ kept[:-1] / max(kept @ kept, 1e-300), 0.0, 0.95)
    return np.maximum([rms * np.sqrt((1 + alike) / (1 - alike))], block.least)


def _make_blocks(animal: Measurements, hinges: Hinges, protocol: Protocol) -> list[_Block]:
    blocks = []
    for k, traces in enumerate(animal.releases):
        label = "release" if len(animal.releases) == 1 else f"release {k + 1}"
        blocks.append(_make_release(label, traces, protocol))
    forces = [
        _make_force(f"force at {curve.at:.4g} mm", curve, hinges.build(hinges.start))
        for curve in animal.forces
    ]
    impulses = [_make_impulse("impulse", ratios, protocol) for ratios in animal.ratios]
    return [*blocks, *forces, *impulses]


def _make_release(label: str, traces: Traces, protocol: Protocol) -> _Block:
    if len(traces.animals) != 1:
        raise InvalidInput(
            "the releases of one animal are traces of this animal alone, got"
            f" {', '.join(traces.animals)}."
        )
    (place, rows), seen = traces.take(traces.animals[0]), traces.take_seen(traces.animals[0])
    step = float(traces.time[1] - traces.time[0])
    goal = (rows / rows[-1, 0] * seen).ravel()
    long = protocol.replace(
        step_duration=float(max(traces.time[-1], 20.0)) + 1 + LATE[1] * step
    )

    def compute(antennas: Sequence[Antenna], shift: np.ndarray) -> np.ndarray:
        moved = simulate_steps(antennas, long, traces.time, place, step * shift)
        return subtract(moved.reshape(len(antennas), -1) * seen.ravel(), goal)

    sd = np.array([max(float(np.std(np.diff(rows[-1] / rows[-1, 0], 2)) / np.sqrt(6)), _LEAST)])
    return _Block(
        name=label,
        compute=compute,
        seen=seen,
        sd=sd,
        least=1e-4,
        free=1 + traces.found,
        shift=(LATE[0], 0.5, LATE[1]) if traces.found else None,
    )


def _make_force(label: str, curve: ForceCurve, antenna: Antenna) -> _Block:
    """A force curve, with a fitted deflection at rest where it neither begins nor ends at 0, or
    where one fits it better: it may begin at a preload, or before contact, when a probe that only
    pushes feels no force.
    """
    largest, span = float(np.ptp(curve.force)), float(np.ptp(curve.deflection))
    ends = np.array([curve.deflection.min(), curve.deflection.max()]) / span
    nearest = float(ends[np.abs(ends).argmin()])
    begin = nearest if ends[0] * ends[1] > 0 else 0.0  # it begins near contact
    side = 1.0 if ends[1] - begin > begin - ends[0] else -1.0
    most = STEEP * curve.at / span
    # a tenth of the curve, at least, is pushed
    far = (ends[0] + 0.1, begin + 1.0) if side < 0 else (begin - 1.0, ends[1] - 0.1)
    reach = (max(far[0], ends[1] - most), min(far[1], ends[0] + most))

    def push(one: Antenna, zero: float, only_pushed: bool) -> np.ndarray:
        moved = side * (curve.deflection - span * zero)
        return compute_force(
            one, side * (np.maximum(moved, 0) if only_pushed else moved), curve.at
        )

    def miss(zero: float, only_pushed: bool) -> float:
        # share of the forces' variance that the antenna leaves at its best stiffness
        return 1 - max(np.corrcoef(push(antenna, zero, only_pushed), curve.force)[0, 1], 0) ** 2

    tried = itertools.product(np.linspace(*reach, _ZEROS)[1:-1], (False, True))
    least, first, only_pushed = min((miss(*how), *how) for how in tried)
    strength = np.var(curve.force) / largest**2 * curve.force.size
    noise = max(strength * least / max(curve.force.size - 3, 1), _LEAST**2)
    unknown = abs(nearest) > _AT_ZERO or strength * (miss(0.0, False) - least) > _BETTER * noise

    def compute(antennas: Sequence[Antenna], shift: np.ndarray) -> np.ndarray:
        left = [
            push(one, zero, bool(only_pushed and unknown)) - curve.force
            for one, zero in zip(antennas, shift, strict=True)
        ]
        left = [one - one.mean() for one in left]  # the force at rest
        return np.array(left) / largest

    return _Block(
        name=label,
        compute=compute,
        seen=np.ones(curve.force.size, bool),
        sd=np.array([0.02]),
        least=1e-3,
        free=1 + unknown,
        shift=(reach[0], float(first), reach[1]) if unknown else None,
        zero=span if unknown else 0.0,
    )


def _make_impulse(label: str, ratios: Ratios, protocol: Protocol) -> _Block:
    def compute(antennas: Sequence[Antenna], _: np.ndarray) -> np.ndarray:
        found = protocol.simulate_ratios(antennas, ratios.place)
        return np.array([one - ratios.ratio for one in found])

    return _Block(
        name=label,
        compute=compute,
        seen=np.ones(ratios.ratio.size, bool),
        sd=np.maximum(ratios.sd, _LEAST_RATIO),
        least=_LEAST_RATIO,
    )


def _guess(animal: Measurements, hinges: Hinges) -> np.ndarray:
    """A searched vector to begin from: forces give the stiffness, the first release's frequency and
    damping ratio the rest.
    """
    p = dict(zip(hinges.names, hinges.start, strict=True))
    antenna = hinges.build(hinges.start)
    if animal.forces:
        curve = max(animal.forces, key=lambda one: one.at)
        model = compute_force(antenna, curve.deflection, curve.at)
        p["stiffness"] = float(np.clip(np.polyfit(model, curve.force, 1)[0], 1e-3, 1e3))
    for traces in animal.releases[:1]:
        name = traces.animals[0]
        free = measure_trace(traces.time, traces.take(name)[1][-1], name)
        if free.frequency is None:  # over-damped
            break
        mode = compute_modes(antenna, 1)
        ratio = min(float(free.damping_ratio or 0.0), 0.95)
        faster = (free.frequency / np.sqrt(1 - ratio**2) / float(mode.frequency[0])) ** 2
        if animal.forces and "mass" in p:
            p["mass"] = p["stiffness"] / faster
        else:
            p["stiffness"] = faster
        if mode.damping_ratio[0] > 0:
            p["damping"] = (
                p["stiffness"] * ratio / float(mode.damping_ratio[0]) / np.sqrt(faster)
            )
    asked = [
        np.clip(p[name], *ends)
        for name, *ends in zip(hinges.names, hinges.low, hinges.high, strict=True)
    ]
    return hinges.to_x(np.array(asked, dtype=float))


# A film that was not used in the fit.


@dataclass(frozen=True, kw_only=True, eq=False)
class Prediction(Shown):
    """A release that a fitted antenna predicts.

    Attributes
    ----------
    simulated : np.ndarray
        Displacement (point, sample) as a share of the outermost point's while it was held.
    recorded : np.ndarray
        Likewise, as filmed.
    time : np.ndarray
        (sample,) since the release [ms].
    error : float
        Root mean square difference at the outermost point, as a share of its held displacement.
    error_before : float
        The same of the antenna before the fit.
    posture : np.ndarray
        Base, hinges and tip (sample, joint, 2) [mm].
    """

    DRAWN = "draw_prediction"

    name: str
    time: np.ndarray
    place: np.ndarray
    recorded: np.ndarray
    simulated: np.ndarray
    error: float
    error_before: float
    posture: np.ndarray


@checked
def predict_release(
    traces: Traces,
    antenna: Antenna,
    *,
    start: Antenna | None = None,
    protocol: Protocol | None = None,
) -> Prediction:
    """What ``antenna`` does when it is released as in a film, beside the film.

    From the film come how far the outermost point was held, and, within four frames, when it was
    let go; nothing of its free swing is fitted.

    Parameters
    ----------
    traces
        Of one animal.
    start
        An antenna to compare with: the one before the fit.
    """
    protocol = protocol or Protocol(at=0.25 * antenna.length, deflection=0.025 * antenna.length)
    name = traces.animals[0]
    (place, rows), seen = traces.take(name), traces.take_seen(name)
    recorded = rows / rows[-1, 0]
    step = float(traces.time[1] - traces.time[0])
    long = protocol.replace(
        step_duration=float(max(traces.time[-1], 20.0)) + 1 + LATE[1] * step
    )

    def follow(one: Antenna) -> tuple[np.ndarray, float, float]:
        outcome = long.simulate_steps([one], place)[0]
        if isinstance(outcome, Exception):
            raise outcome
        own, moved = outcome
        curve = CubicSpline(own, moved / moved[-1, 0], axis=1)

        def measure(shift: float) -> tuple[np.ndarray, float]:
            rows = curve(np.maximum(traces.time + step * shift, 0.0))
            return rows, float(np.sqrt(np.mean((rows - recorded)[-1][seen[-1]] ** 2)))

        shift = 0.0
        if traces.found:
            found = minimize_scalar(lambda s: measure(s)[1], bounds=LATE, method="bounded")
            shift = float(found.x)
        return *measure(shift), shift

    simulated, error, shift = follow(antenna)
    return Prediction(
        name=name,
        time=traces.time,
        place=place,
        recorded=recorded,
        simulated=simulated,
        error=error,
        error_before=float("nan") if start is None else follow(start)[1],
        posture=long.simulate_postures(antenna, np.maximum(traces.time + step * shift, 0.0)),
    )


@checked
def compute_animal_spread(traces: Sequence[Traces]) -> float:
    """Standard deviation between animals of the outermost point's free response, as a share of its
    held displacement, root mean square over time; NaN of one animal.
    """
    rows = {one.animals[0]: (one.time, one.take(one.animals[0])[1][-1]) for one in traces}
    if len(rows) < 2:
        return float("nan")
    end = min(time[-1] for time, _ in rows.values())
    time = np.linspace(0.0, end, 200)
    shares = [np.interp(time, own, row / row[0]) for own, row in rows.values()]
    return float(np.sqrt(np.mean(np.var(shares, axis=0, ddof=1))))
