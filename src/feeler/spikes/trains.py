"""Spike trains, drawn or recorded, and classifiers of counts, first spikes and whole trains."""

import warnings
from collections.abc import Iterable, Sequence
from typing import Annotated, Any

import numpy as np
import xarray as xr
from scipy.special import logsumexp, softmax

from feeler.analysis.indices import check_tensors
from feeler.decoding.classifiers import (
    Classifier,
    Labels,
    check_labels,
    count_until,
    make_lda,
    number_labels,
    sort_classes,
)
from feeler.decoding.observers import warn_of_copies
from feeler.errors import InvalidInput, ModelValidityWarning
from feeler.records import Ge, Record, Registry, Unit, freeze
from feeler.spikes.sensilla import (
    find_step,
    fire_touch,
)
from feeler.tensors.schema import label_units
from feeler.tensors.transforms import in_unit, label_like
from feeler.validation import Seed, checked, is_array, show

# Spike trains: drawn from rates, given by hand, counted, thinned, and by their first spikes.


class Firing(Record):
    """How spikes follow from a rate; the defaults draw a Poisson process.

    Intervals in ∫ rate dt are gamma distributed with mean 1, so that any stretch of time holds
    ∫ rate dt spikes in the mean. After each spike a unit rests for ``refractory``, which makes a
    constant rate r fire r / (1 + r · refractory) times a second.

    Attributes
    ----------
    order : int
        Order of the gamma distribution; 1 is Poisson, more is more regular: the intervals of a
        constant rate vary by 1/√order.
    refractory : float
        [ms]
    latency : float
        From the receptor to where the nerve is read [ms].
    spread : float
        Standard deviation of the latency, spike by spike [ms].
    """

    order: Annotated[int, Ge(1)] = 1
    refractory: Annotated[float, Ge(0), Unit("ms")] = 0.0
    latency: Annotated[float, Ge(0), Unit("ms")] = 0.0
    spread: Annotated[float, Ge(0), Unit("ms")] = 0.0


POISSON = Firing()
"""Spikes that do not know of each other."""


@checked
def draw_spikes(touches: xr.Dataset, firing: Firing = POISSON, *, seed: Seed = 0) -> xr.Dataset:
    """The touches with ``spike_time`` (trial, unit, event) [ms] beside their ``rate``.

    Parameters
    ----------
    touches
        With ``rate`` (trial, unit, time) [Hz], as :meth:`Population.encode` gives them; the rate at
        a time holds for the step that ends there.
    firing
        How regular they are.
    seed
        With a trial's own number it makes that trial's generator, so that a trial has the same
        spikes alone or among others.

    Returns
    -------
    xarray.Dataset
        Times rise along ``event`` and are NaN beyond a train's last spike. Spikes whose latency
        carries them out of the record are lost.

    Raises
    ------
    InvalidInput
        No rates, or negative ones.
    """
    # Rates (trial, time, unit) [Hz] and times [ms].
    if "rate" not in touches:
        raise InvalidInput("there are no rates; population.encode(touches) gives them.")
    rated = in_unit(touches["rate"], "Hz").transpose("trial", "time", "unit")
    rates = np.ascontiguousarray(rated, dtype=float)
    if not np.all(rates >= 0):
        raise InvalidInput("rates must be ≥ 0 Hz and finite; rectify them first.")
    time = in_unit(touches["time"], "ms").values
    step = find_step(time)
    begin, end = time[0] - step, time[-1]
    told = (firing.order, firing.refractory, firing.spread)
    found = []
    for trial, rate in zip(touches["trial"].values, rates, strict=True):
        rng = np.random.default_rng([seed, int(trial)])
        units, times = fire_touch(rate, begin + firing.latency, step, *told, rng)
        kept = (times > begin) & (times <= end)
        found.append((units[kept], times[kept]))
    if not any(times.size for _, times in found):
        _doubt("the gain is too low for these touches, or the rates are all 0.")
    return _attach(touches, rates.shape[2], found).assign_attrs(
        spike_seed=seed, firing=str(firing.to_plain())
    )


def _doubt(why: str) -> None:
    warnings.warn(f"no unit fired in any trial: {why}", ModelValidityWarning, stacklevel=4)


def _attach(
    touches: xr.Dataset, n_units: int, found: Sequence[tuple[np.ndarray, np.ndarray]]
) -> xr.Dataset:
    """The touches with a train of each unit, given unit and time of all spikes of each trial."""
    counts = [np.bincount(units, minlength=n_units) for units, _ in found]
    times = np.full((len(found), n_units, max(1, int(np.max(counts)))), np.nan)
    for row, many, (units, spikes) in zip(times, counts, found, strict=True):
        order = np.lexsort((spikes, units))
        starts = np.repeat(np.cumsum(many) - many, many)
        row[units[order], np.arange(units.size) - starts] = spikes[order]
    bare = touches.drop_vars("spike_time", errors="ignore")
    return label_units(bare.assign(spike_time=(("trial", "unit", "event"), times)))


@checked
def attach_trains(
    touches: xr.Dataset, trains: Sequence[Any], units: Sequence[Any]
) -> xr.Dataset:
    """The touches with recorded trains beside them, in the place of drawn ones.

    Parameters
    ----------
    touches
        The trials that the trains belong to.
    trains
        For each trial, for each unit, times [ms] on the trial's own clock.
    units
        What each unit is called.

    Raises
    ------
    InvalidInput
        Two trains of one unit, other numbers of trials or units, or times that do not rise within
        the record.
    """
    names = [*units]
    if not all(isinstance(name, str | int | float | np.generic) for name in names):
        raise InvalidInput(f"units must be one text or number for each, got {show(units)}.")
    if twice := [name for name in names if names.count(name) > 1]:
        raise InvalidInput(
            f"there are two trains of unit {twice[0]!r}; join them, or rename one."
        )
    if len(trains) != touches.sizes["trial"]:
        raise InvalidInput(f"{touches.sizes['trial']} trials but trains of {len(trains)}.")
    first, last = (float(in_unit(touches["time"], "ms")[k]) for k in (0, -1))
    if not all(isinstance(row, Iterable) for row in trains):
        raise InvalidInput(f"trains are, by trial, one for each unit, got {show(trains)}.")
    rows = [[freeze(train) for train in row] for row in trains]
    for number, row in enumerate(rows):
        if len(row) != len(names):
            raise InvalidInput(f"trial {number} has {len(row)} trains for {len(names)} units.")
        for name, train in zip(names, row, strict=True):
            within = train.ndim == 1 and np.all((train >= first) & (train <= last))
            if not (within and np.all(np.diff(train) >= 0)):
                raise InvalidInput(
                    f"the train of unit {name!r} in trial {number} must rise within the record,"
                    f" {first:g} to {last:g} ms."
                )
    bare = touches.drop_dims({"unit", "event"} & {*touches.dims})
    owners = [np.repeat(np.arange(len(row)), [train.size for train in row]) for row in rows]
    found = [(owner, np.concatenate(row)) for owner, row in zip(owners, rows, strict=True)]
    if not any(times.size for _, times in found):
        _doubt("every train that was given is empty.")
    return _attach(bare, len(names), found).assign_coords(unit=("unit", np.array(names)))


@checked
def count_spikes(touches: xr.Dataset) -> xr.DataArray:
    """How many spikes fall within each sample: a raster (trial, unit, time), for classifiers.

    A spike belongs to the first sample at or after it. Coordinates travel along, so that a
    classifier knows the deadline (``time``, ``lead``).
    """
    if "spike_time" not in touches:
        raise InvalidInput("there are no spikes; draw_spikes(touches) gives them.")
    time = in_unit(touches["time"], "ms").values
    spikes = in_unit(touches["spike_time"], "ms").transpose("trial", "unit", "event").values
    found = np.zeros((*spikes.shape[:2], time.size), dtype=np.int32)
    trial, unit, event = np.nonzero(np.isfinite(spikes))
    bins = np.searchsorted(time, spikes[trial, unit, event] - 1e-9)
    np.add.at(found, (trial, unit, np.minimum(bins, time.size - 1)), 1)
    dims = ("trial", "unit", "time")
    coords = {
        name: item
        for name, item in touches.coords.items()
        if item.dims and {*item.dims} <= {*dims}
    }
    return xr.DataArray(found, coords, dims, name="spikes", attrs={"units": "1"})


@checked
def thin_spikes(raster: Any, keep: Annotated[float, Ge(0)], *, seed: Seed = 0) -> Any:
    """A raster from which spikes are lost at random, so that a trial keeps ``keep`` in the mean.

    A Poisson process thinned stays one, of a lower rate. Where there are fewer already, nothing is
    lost.

    Parameters
    ----------
    raster
        Counts (trial, unit, time).
    keep
        Spikes of a trial, mean over the trials.
    """
    counts = np.asarray(raster) if is_array(raster) else np.array(None)
    if counts.ndim == 0 or counts.dtype.kind not in "iub" or not np.all(counts >= 0):
        raise InvalidInput("raster must be counts (trial, unit, time): whole numbers ≥ 0.")
    share = min(1.0, keep * len(counts) / max(counts.sum(), 1))
    kept = np.random.default_rng(seed).binomial(counts, share)
    return label_like(kept, raster, ("trial", "unit", "time"), "spikes", units="1")


# Classifiers of spikes: by counts, by first spikes, and the ideal observer of Poisson trains.

SPIKE_CODES: Registry[Any] = Registry("code of spikes")
"""What a brain might look at: ``code(raster, width)`` turns counts (trial, unit, time) into a table
(trial, entry); ``SPIKE_CODES.register(name, code)`` adds one.
"""


@SPIKE_CODES.register("counts")
def _sum_windows(raster: np.ndarray, width: int) -> np.ndarray:
    """Spikes of each unit in windows of ``width`` samples, the last one as long as it is."""
    starts = np.arange(0, raster.shape[2], width)
    return np.add.reduceat(raster, starts, axis=2).reshape(len(raster), -1)


@SPIKE_CODES.register("first")
def _find_first(raster: np.ndarray, width: int = 1) -> np.ndarray:
    """Sample of each unit's first spike, in steps of ``width``; a silent unit's is the end."""
    fired = raster > 0
    first = np.where(fired.any(axis=2), fired.argmax(axis=2), raster.shape[2])
    return first // width


@SPIKE_CODES.register("latency")
def _find_latency(raster: np.ndarray, width: int = 1) -> np.ndarray:
    """The same since the first spike of all units, for who is not told when contact began."""
    first = _find_first(raster)
    return (first - first.min(axis=1, keepdims=True)) // width


@SPIKE_CODES.register("onset")
def _find_onset(raster: np.ndarray, width: int = 1) -> np.ndarray:
    """The first spike of all units alone (trial, 1)."""
    return _find_first(raster, width).min(axis=1, keepdims=True)


class SpikeClassifier(Classifier):
    """Reads one code of a raster by principal components and linear discriminant analysis.

    Parameters
    ----------
    code
        ``counts``, ``first``, ``latency``, ``onset``, or another of :data:`SPIKE_CODES`.
    width
        Samples taken together.
    n_components
        Principal components of the code that are kept.

    Attributes
    ----------
    classes_
        Labels, sorted.
    classifier_
        The fitted classifier of codes.
    """

    def __init__(self, code: str = "counts", width: int = 10, n_components: int = 30) -> None:
        self.code = code
        self.width = width
        self.n_components = n_components

    def fit(self, X: Any, y: Labels) -> "SpikeClassifier":
        """Learn from rasters (trial, unit, time), as :func:`count_spikes` gives them."""
        if self.width < 1:
            raise InvalidInput(f"width must be at least 1 sample, got {self.width}.")
        codes = SPIKE_CODES[self.code](_check_rasters(X), self.width).astype(float)
        if not np.ptp(codes, axis=0).any():
            raise InvalidInput(
                f"all training trials have the same code {self.code!r}, as where no unit fires:"
                " nothing to learn. Raise the gain, or give a later deadline."
            )
        self._keep(X, y)
        try:
            self.classifier_ = make_lda(self.n_components).fit(codes, y)
        except InvalidInput as error:
            raise InvalidInput(
                f"training trials of one label all have the same code {self.code!r}, and linear"
                " discriminant analysis learns from how these differ. Draw several trains of each."
            ) from error
        self.classes_ = self.classifier_.classes_
        return self

    def _decide(self, X: Any) -> np.ndarray:
        codes = SPIKE_CODES[self.code](_check_rasters(X), self.width).astype(float)
        return self.classifier_.predict_proba(codes)


class PoissonObserver(Classifier):
    """Knows the rates of every touch: no classifier of the same Poisson trains does better.

    The touches r_c(unit, t) that it was fitted on are equally likely. Of counts n in steps Δt,
    ln p(n | c) = Σ n ln(r_c Δt) − Σ r_c Δt, up to what all touches share; a spike where r_c = 0
    excludes that touch. A class's probability is the sum over its touches. Of trains that are more
    regular than Poisson it is a classifier like others.

    Parameters
    ----------
    step
        Δt [ms].
    floor
        Rate [Hz] added to all known rates, as of spontaneous spikes; above 0 where other touches
        than the known ones will be met.

    Attributes
    ----------
    classes_
        Labels, sorted.
    known_
        Expected spikes of the known touches (touch, unit, time).
    """

    def __init__(self, step: float = 1.0, floor: float = 0.0) -> None:
        self.step = step
        self.floor = floor

    def fit(self, X: Any, y: Labels) -> "PoissonObserver":
        """Know rates (trial, unit, time) [Hz], one label each.

        Warns where several of one label look like drawn spikes: of these it is not ideal.
        """
        rates = self._read(X, "Hz")
        y = check_labels(rates, y)
        if not (self.step > 0 and self.floor >= 0):
            raise InvalidInput(
                f"step must be > 0 ms and floor ≥ 0, got {self.step}, {self.floor}."
            )
        warn_of_copies(self, rates, y, everywhere=False)
        self.known_ = (rates + self.floor) * self.step * 1e-3
        self.shape_ = rates.shape[1:]
        self.classes_ = sort_classes(y)
        self.members_ = number_labels(y, self.classes_)[:, None] == np.arange(
            len(self.classes_)
        )
        return self

    def decide(self, X: Any, until: float | None = None) -> np.ndarray:
        """Log-likelihoods (trial, class), up to what all share; −inf where a class is excluded."""
        self._require(X)
        end = None if until is None else count_until(X, until)
        found = _weigh_rates(self._read(X, "1")[:, :, :end], self.known_[:, :, :end])
        with np.errstate(divide="ignore"):
            return logsumexp(found[:, None, :] + np.log(self.members_.T.astype(float)), axis=2)

    def _read(self, X: Any, unit: str) -> np.ndarray:
        """Rates or counts (trial, unit, time) in this unit, in steps of ``step``, as far as ``X``
        says.
        """
        if "units" in getattr(X, "attrs", {}):
            X = in_unit(X, unit)
        time = np.asarray(X["time"] if "time" in getattr(X, "coords", ()) else ())
        if time.size > 1 and not np.isclose(step := find_step(time), self.step, rtol=1e-3):
            raise InvalidInput(
                f"the samples are {step:g} ms apart, but step is {self.step:g} ms; give"
                f" PoissonObserver(step={step:g})."
            )
        return _check_rasters(X)

    def _weigh(self, scores: np.ndarray) -> np.ndarray:
        """Probabilities; NaN for a train that no known touch can give."""
        excluded = np.isneginf(scores).all(axis=1, keepdims=True)
        return np.where(excluded, np.nan, softmax(np.nan_to_num(scores), axis=1))


def _weigh_rates(counts: np.ndarray, expected: np.ndarray) -> np.ndarray:
    """Log-likelihoods (trial, touch) of counts (trial, …), given what each touch is expected to
    give (touch, …), up to what all touches share.
    """
    met = counts.reshape(len(counts), -1).astype(float)
    known = expected.reshape(len(expected), -1)
    used = met.any(axis=0)
    silent = known[:, used] == 0
    logs = np.log(np.where(silent, 1.0, known[:, used]))
    found = met[:, used] @ logs.T - known.sum(axis=1)
    found[met[:, used] @ silent.T.astype(float) > 0] = -np.inf
    return found


def _check_rasters(X: Any) -> np.ndarray:
    """Counts or rates (trial, unit, time), none negative."""
    values = check_tensors(X, least=1)
    if np.any(values < 0):
        raise InvalidInput("counts and rates of spikes must be ≥ 0.")
    return values
