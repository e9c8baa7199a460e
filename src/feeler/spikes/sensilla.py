"""Sensilla: how receptors turn bending into rates of spikes, and where they sit."""

import warnings
from typing import Annotated, Literal

import numpy as np
import xarray as xr
from scipy.special import cosdg, sindg

from feeler.compiled import compiled, lean
from feeler.errors import InvalidInput, ModelValidityWarning
from feeler.records import Ge, Gt, Le, Len, Record, Unit
from feeler.tensors.schema import label_units
from feeler.tensors.transforms import in_unit
from feeler.validation import checked

# Sensilla: how a receptor turns bending into a rate of spikes, and adapts.


class Sensillum(Record):
    """A mechanoreceptor whose threshold follows the stimulus.

    With the stimulus u ≥ 0, which is the gain of a unit times the bending towards its side, and the
    adapting threshold x,

        y = max(0, a (u − x) + c u + d + v du/dt) and τ dx/dt = sign(u − x) |u − x|^b,

    at most ``ceiling``. A step of u adapts as a power law, a ramp soon reaches
    a (τ du/dt)^(1/b) above the tonic part. The defaults are those of the proximal campaniform
    sensilla on the cockroach's tibia, fitted to one recording, in which u is a force in mN [B].

    Attributes
    ----------
    tau : float
        τ, time of adaptation [ms, for u in units of 1].
    a : float
        Phasic gain [Hz]; 0: no adapting part.
    b : float
        Power of adaptation, ≥ 1; 1 is an exponential.
    c : float
        Tonic gain [Hz].
    d : float
        Offset [Hz]; below 0 it is a threshold.
    v : float
        Gain for the rate of change [Hz·ms], that of hair sensilla.
    ceiling : float
        Greatest rate [Hz], chosen [C].

    Raises
    ------
    InvalidInput
        A field outside its range.

    Notes
    -----
    Szczecinski, Dallmann, Quinn & Zill 2021, doi:10.1088/1748-3190/ac1ced.
    """

    tau: Annotated[float, Gt(0), Unit("ms")] = 3.8595
    a: Annotated[float, Ge(0), Unit("Hz")] = 707.6
    b: Annotated[float, Ge(1)] = 2.2615
    c: Annotated[float, Ge(0), Unit("Hz")] = 54.287
    d: float = -41.1551
    v: Annotated[float, Ge(0)] = 0.0
    ceiling: Annotated[float, Gt(0), Unit("Hz")] = 1000.0

    @property
    def phasic(self) -> "Sensillum":
        """The same without its tonic part: c = d = 0."""
        return self.replace(c=0.0, d=0.0)

    @property
    def tonic(self) -> "Sensillum":
        """The same without its phasic part: a = v = 0."""
        return self.replace(a=0.0, v=0.0)


CAMPANIFORM = Sensillum()
"""The cockroach's tibial campaniform sensilla [B]."""
HAIR = Sensillum(a=0.0, c=0.0, d=0.0, v=5000.0)
"""A hair sensillum by the rate of bending alone; 400 Hz at u = 0.08 per ms [C]."""


# The compiled steps of sensilla: one sample of bending in, rates and spikes out.
#
# Whole touches and streams take the same steps, so that both give the same numbers.

TABLE = ("tau", "a", "b", "c", "d", "v", "ceiling")
"""The rows of a table of parameters (parameter, unit)."""


@lean
def _adapt(excess, time, b):
    """e after ``time`` (in τ) of de/dt = −sign(e) |e|^b: exact, a power law for b > 1."""
    size = abs(excess)
    if size == 0.0:
        return 0.0
    if b == 1.0:
        return excess * np.exp(-time)
    return excess * (1.0 + (b - 1.0) * time * size ** (b - 1.0)) ** (-1.0 / (b - 1.0))


@lean
def step_units(sample, taps, shares, gains, table, step, excess, before, rate):
    """Move every unit on by one sample (sensor,); returns how stiff the stiffest one was.

    The stimulus runs straight from the sample before to this one: half of its change, the exact
    adaptation over the step, the other half (Strang's splitting, second order). The stiffness is
    the step over the time in which the threshold comes to follow such a slope.
    """
    stiffest = 0.0
    for k in range(rate.size):
        tau, a, b = table[0, k], table[1, k], table[2, k]
        near = taps[k]
        bend = sample[near] + shares[k] * (sample[near + 1] - sample[near])
        stimulus = max(0.0, gains[k] * bend)
        change = stimulus - before[k]
        before[k] = stimulus
        if change == 0.0 and excess[k] == 0.0:  # at rest, as one side always is
            rate[k] = min(max(table[3, k] * stimulus + table[4, k], 0.0), table[6, k])
            continue
        excess[k] = _adapt(excess[k] + 0.5 * change, step / tau, b) + 0.5 * change
        found = (
            a * excess[k] + table[3, k] * stimulus + table[4, k] + table[5, k] * change / step
        )
        rate[k] = min(max(found, 0.0), table[6, k])
        if a != 0.0 and change != 0.0:
            follows = (tau * abs(change) / step) ** ((b - 1.0) / b)
            stiffest = max(stiffest, step * b * follows / tau)
    return stiffest


@compiled
def encode_touch(samples, taps, shares, gains, table, step, rates):
    """Rates (time, unit) of one touch (time, sensor) that begins at rest; returns the stiffness."""
    units = rates.shape[1]
    excess, before, stiffest = np.zeros(units), np.zeros(units), 0.0
    for now in range(len(samples)):
        stiff = step_units(
            samples[now], taps, shares, gains, table, step, excess, before, rates[now]
        )
        stiffest = max(stiffest, stiff)
    return stiffest


@compiled
def start_firing(order, rng, left):
    """Draw for each unit how much of ∫ rate dt is left until its first spike, as if long begun."""
    for k in range(left.size):
        left[k] = 0.0
        for _ in range(1 + int(order * rng.random())):
            left[k] += rng.standard_exponential() / order


@compiled
def fire(rate, begin, step, order, refractory, spread, rng, left, ready, units, times, count):
    """Spikes of one sample that lasts from ``begin`` to ``begin + step`` [ms].

    They are put behind the ``count`` that the buffers hold already, which grow where they are too
    short; returned are both and the new count.
    """
    end = begin + step
    for k in range(rate.size):
        hazard = rate[k] * 1e-3
        now = max(begin, ready[k])
        while hazard > 0.0 and now < end:
            ahead = now + left[k] / hazard
            if ahead >= end:
                left[k] -= hazard * (end - now)
                break
            if count == times.size:
                units = np.append(units, np.zeros_like(units))
                times = np.append(times, np.zeros_like(times))
            units[count] = k
            times[count] = ahead + (spread * rng.standard_normal() if spread > 0.0 else 0.0)
            count += 1
            left[k] = 0.0
            for _ in range(order):
                left[k] += rng.standard_exponential() / order
            now = ready[k] = ahead + refractory
    return units, times, count


@compiled
def fire_touch(rates, begin, step, order, refractory, spread, rng):
    """Unit and time [ms] of every spike of one touch with these rates (time, unit)."""
    count, silent = 0, rates.shape[1]
    left, ready = np.zeros(silent), np.full(silent, -np.inf)
    units, times = np.zeros(64, dtype=np.int64), np.zeros(64)
    start_firing(order, rng, left)
    for now in range(len(rates)):
        units, times, count = fire(
            rates[now],
            begin + now * step,
            step,
            order,
            refractory,
            spread,
            rng,
            left,
            ready,
            units,
            times,
            count,
        )
    return units[:count], times[:count]


# Populations: which sensilla sit where on an antenna, and the rates that a touch gives them.

STIFFEST = 1.0
"""Of one step; up to here rates are within 5 % of their peak."""
_UNITS = {"angle": "rad", "curvature": "1/mm"}
_UNEVEN = 1e-6  # [C] share by which steps of time may differ


class Population(Record):
    """Sensilla along an antenna, from base to tip; a unit is one of them with its nerve fibre.

    Attributes
    ----------
    position : np.ndarray
        (unit,) arc length over the antenna's length; bending between two sensors is interpolated.
    side : np.ndarray
        (unit,) 1 answers to bending of positive sign, −1 to the other, which it cannot feel at all.
    gain : np.ndarray
        (unit,) or one number: u per unit of ``quantity``.
    sensilla : tuple[Sensillum, ...]
        One for each unit, or one for all.
    quantity : Literal[angle, curvature]
        What bends them: the hinge's ``angle`` [rad] or its ``curvature`` [1/mm].
    around : np.ndarray
        (unit,) or one number: where around the antenna side 1 lies, 0 towards x and 90 towards z
        [degrees]; side −1 lies opposite. What bends towards a side compresses it.

    Raises
    ------
    InvalidInput
        A unit without a place on the antenna, a side other than ±1, a gain that is not above 0, or
        other numbers of them than units.
    """

    position: Annotated[np.ndarray, "unit", Ge(0), Le(1)]
    side: Annotated[np.ndarray, "unit", int]
    gain: Annotated[np.ndarray, "unit?", Gt(0)]
    sensilla: Annotated[tuple[Sensillum, ...], Len(1)] = (CAMPANIFORM,)
    quantity: Literal["angle", "curvature"] = "angle"
    around: Annotated[np.ndarray, "unit?", Ge(-360), Le(360), Unit("degrees")] = 0.0  # type: ignore[assignment]

    def _check(self) -> None:
        count = self.position.size
        if not count:
            raise InvalidInput("a population needs at least one unit.")
        if not np.isin(self.side, (-1, 1)).all():
            raise InvalidInput("the side of a unit is 1 or −1.")
        if len(self.sensilla) not in (1, count):
            raise InvalidInput(
                f"{count} units but {len(self.sensilla)} sensilla; give one for all or one for"
                " each."
            )
        for name in ("gain", "around"):
            vars(self)[name] = np.broadcast_to(getattr(self, name), (count,))

    @property
    def table(self) -> np.ndarray:
        """Parameters of the units (parameter, unit), as the compiled steps read them."""
        rows = [[getattr(one, name) for one in self.sensilla] for name in TABLE]
        return np.ascontiguousarray(
            np.broadcast_to(rows, (len(rows), self.position.size)), float
        )

    def find_taps(self, position: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """For each unit the sensor on its base's side, as :meth:`bend_sides` numbers them, and its
        share of the way to the next.

        Raises
        ------
        InvalidInput
            Fewer than two sensors, or a unit further from them than they are from each other.
        """
        places = np.asarray(position, dtype=float)
        if places.size < 2:
            raise InvalidInput("sensilla need at least two sensors to stand between.")
        widest = np.diff(places).max()
        out = np.maximum(places[0] - self.position, self.position - places[-1])
        if out.max() > widest:
            raise InvalidInput(
                f"the unit at {self.position[out.argmax()]:g} lies beyond the sensors, which stand"
                f" from {places[0]:g} to {places[-1]:g}; give it a place among them."
            )
        found = np.searchsorted(places, self.position, side="right") - 1
        taps = np.clip(found, 0, places.size - 2)
        shares = (self.position - places[taps]) / (places[taps + 1] - places[taps])
        rank = np.unique(self.around, return_inverse=True)[1]
        return taps + rank * places.size, np.clip(shares, 0.0, 1.0)

    def bend_sides(self, bent: np.ndarray, spatial: bool) -> np.ndarray:
        """Bending (…, sensor), in space (…, plane, sensor), towards each direction of ``around``
        that occurs: all sensors for one direction, then those for the next. Torsion bends nothing.
        """
        x, z = (bent[..., 0, :], bent[..., 1, :]) if spatial else (bent, 0.0)
        found = [x * cosdg(side) + z * sindg(side) for side in np.unique(self.around)]
        return np.ascontiguousarray(np.concatenate(found, axis=-1))

    @checked
    def encode(self, touches: xr.Dataset, *, limit: float = STIFFEST) -> xr.Dataset:
        """The touches with ``rate`` (trial, unit, time) [Hz] beside them.

        Parameters
        ----------
        touches
            A Dataset of the data contract. Each touch begins at rest: adapted to no bending.
        limit
            Stiffness above which the sampling is refused; ``np.inf`` for white noise, whose
            steps are the signal.

        Raises
        ------
        InvalidInput
            Time steps that differ, or too long for the adaptation; the message says which would do.
        """
        rates = self._encode(touches, limit)
        best = rates.max(axis=(0, 1))
        if best.any() and np.all((best == 0) | (best >= self.table[-1])):
            warnings.warn(
                "every unit that fires reaches its greatest rate; a lower gain would tell touches"
                " apart by how strongly they bend.",
                ModelValidityWarning,
                stacklevel=3,
            )
        known = {"unit", "event"} & {*touches.dims}
        found = touches.drop_dims(known).assign_coords(
            unit=("unit", np.arange(1, self.position.size + 1)),
            unit_position=("unit", self.position),
            unit_side=("unit", self.side),
        )
        if self.around.any() or "plane" in touches.dims:
            found = found.assign_coords(unit_around=("unit", self.around))
        return label_units(found.assign(rate=(("trial", "unit", "time"), rates.swapaxes(1, 2))))

    def _encode(self, touches: xr.Dataset, limit: float) -> np.ndarray:
        """Rates (trial, time, unit)."""
        if self.quantity not in touches:
            raise InvalidInput(f"sensilla feel {self.quantity!r}, which these touches lack.")
        time = in_unit(touches["time"], "ms").values
        step = find_step(time)
        samples = self._feel(touches)
        if not np.isfinite(samples).all():  # which would pass for no bending
            raise InvalidInput("the bending is not finite; fill gaps, or leave the trial out.")
        rates = np.empty((len(samples), time.size, self.position.size))
        fixed = (*self.find_taps(touches["position"].values), self.side * self.gain, self.table)
        for touch, rate in zip(samples, rates, strict=True):
            stiffness = encode_touch(touch, *fixed, step, rate)
            if stiffness > limit:
                raise InvalidInput(
                    f"the samples, {step:g} ms apart, are too coarse for how fast these sensilla"
                    f" adapt. Sample every {step * limit / stiffness:.2g} ms (sample_interval=), or"
                    " lower the gain."
                )
        return rates

    def _feel(self, touches: xr.Dataset) -> np.ndarray:
        """Bending (trial, time, …) as :meth:`bend_sides` gives it."""
        bent = in_unit(touches[self.quantity], _UNITS[self.quantity])
        rows = ("plane", "sensor") if "plane" in bent.dims else ("sensor",)
        values = bent.transpose("trial", "time", *rows).values.astype(float)
        return self.bend_sides(values, "plane" in rows)


def find_step(time: np.ndarray) -> float:
    """The step of evenly spaced times [ms]."""
    steps = np.diff(time)
    if not steps.size or np.ptp(steps) > _UNEVEN * steps.mean():
        raise InvalidInput("sensilla need samples at even steps of time, at least two.")
    return float(steps.mean())


@checked
def place_sensilla(
    position: np.ndarray,
    gain: float | np.ndarray,
    *,
    sensillum: Sensillum = CAMPANIFORM,
    quantity: str = "angle",
    around: float | np.ndarray = 0.0,
) -> Population:
    """A population with a unit on each of both sides at each place.

    Parameters
    ----------
    position
        Places (place,): an antenna's own sensors, ``touches["position"]``, which for the cockroach
        are 56, as its campaniform sensilla are counted [P], spread evenly [C]; or any others, such
        as ``np.linspace(0.1, 0.9, 20)``.
    gain
        u per unit of ``quantity``, one number or (place,) [C].
    sensillum
        What sits there.
    quantity
        ``angle`` [rad] or ``curvature`` [1/mm].
    around
        Where around the antenna side 1 lies, 0 towards x [degrees]; of several there are two sides
        for each: (0, 90) places a unit on four.

    Returns
    -------
    Population
        First all units of side 1 from base to tip, then all of side −1; so for each ``around``.
    """
    places = np.atleast_1d(np.asarray(position, dtype=float))
    gains = np.asarray(gain, dtype=float)
    if places.ndim != 1 or gains.shape not in ((), places.shape):
        raise InvalidInput(
            "position must be places (place,) and gain one number or one for each, got shapes"
            f" {places.shape} and {gains.shape}."
        )
    turns = np.atleast_1d(np.asarray(around, dtype=float))
    gains = np.broadcast_to(gains, places.shape)
    return Population(
        position=np.tile(places, 2 * turns.size),
        side=np.tile(np.repeat((1, -1), places.size), turns.size),
        gain=np.tile(gains, 2 * turns.size),
        sensilla=(sensillum,),
        quantity=quantity,  # type: ignore[arg-type]
        around=np.repeat(turns, 2 * places.size),
    )


@checked
def find_gain(
    touches: xr.Dataset, population: Population, rate: Annotated[float, Gt(0)] = 400.0
) -> Population:
    """The population with all gains scaled so that half of the touches drive a unit beyond a rate.

    Parameters
    ----------
    touches
        A Dataset of the data contract.
    population
        Its gains are scaled by one number.
    rate
        Median over the touches of each one's greatest rate [Hz]; 400 is what is seen in
        recordings from cockroach antennae [A].

    Raises
    ------
    InvalidInput
        No gain gives that rate.
    """
    low, high = 1e-6, 1e6
    peak = float(np.abs(population._feel(touches)).max())
    start = population.replace(gain=population.gain / max(peak * population.gain.max(), 1e-12))
    for _ in range(40):
        middle = float(np.sqrt(low * high))
        found = start.replace(gain=start.gain * middle)._encode(touches, np.inf)
        enough = np.median(found.max(axis=(1, 2))) >= rate
        low, high = (low, middle) if enough else (middle, high)
    if not 1e-5 < high < 1e5:
        raise InvalidInput(
            f"no gain makes half of the touches reach {rate:g} Hz: these touches bend the antenna"
            " too little, or the sensilla's ceiling is lower."
        )
    return start.replace(gain=start.gain * high)
