"""Spike trains: drawn from rates, given by hand, counted, thinned, and by their first spikes."""

import warnings
from collections.abc import Iterable, Sequence
from typing import Annotated, Any

import numpy as np
import xarray as xr

from feeler.errors import Doubtful, InvalidInput
from feeler.records.checked import checked, is_array
from feeler.records.record import Ge, Record, Unit, freeze
from feeler.records.rules import show
from feeler.spikes.kernel import fire_touch
from feeler.spikes.population import find_step
from feeler.tensors.dataset import label_units
from feeler.tensors.scaling import label_like
from feeler.tensors.unit import in_unit


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
def draw_spikes(
    touches: xr.Dataset, firing: Firing = POISSON, *, seed: Annotated[int, "≥ 0"] = 0
) -> xr.Dataset:
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
    rates, time = _read_rates(touches)
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
    warnings.warn(f"no unit fired in any trial: {why}", Doubtful, stacklevel=4)


def _read_rates(touches: xr.Dataset) -> tuple[np.ndarray, np.ndarray]:
    """Rates (trial, time, unit) [Hz] and times [ms]."""
    if "rate" not in touches:
        raise InvalidInput("there are no rates; population.encode(touches) gives them.")
    rates = in_unit(touches["rate"], "Hz").transpose("trial", "time", "unit")
    values = np.ascontiguousarray(rates, dtype=float)
    if not np.all(values >= 0):
        raise InvalidInput("rates must be ≥ 0 Hz and finite; rectify them first.")
    return values, in_unit(touches["time"], "ms").values


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
    """How many spikes fall within each sample: a raster (trial, unit, time), as readers take it.

    A spike belongs to the first sample at or after it. Coordinates travel along, so that readers
    know the deadline (``time``, ``lead``).
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
def thin_spikes(raster: Any, keep: float, *, seed: Annotated[int, "≥ 0"] = 0) -> Any:
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
    if keep < 0:
        raise InvalidInput(f"keep must be ≥ 0 spikes, got {keep}.")
    counts = np.asarray(raster) if is_array(raster) else np.array(None)
    if counts.ndim == 0 or counts.dtype.kind not in "iub" or not np.all(counts >= 0):
        raise InvalidInput("raster must be counts (trial, unit, time): whole numbers ≥ 0.")
    share = min(1.0, keep * len(counts) / max(counts.sum(), 1))
    kept = np.random.default_rng(seed).binomial(counts, share)
    return label_like(kept, raster, ("trial", "unit", "time"), "spikes", units="1")
