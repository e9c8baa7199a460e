"""The best of a family of rates, with intervals over sets of touches; see declared.toml."""

from typing import Any

import numpy as np
import xarray as xr

from feeler.report import make_interval
from feeler.tradeoff import average_sets

PUBLISHED_RATE = -0.0827  # 1/joint [P]
_SHARE = 0.95
_SEED = 0


def find_best(data: xr.Dataset, resamples: int) -> dict[str, np.ndarray]:
    """``value`` (bend,) of the best rate and the ``ends`` (2, bend) of its bootstrap interval."""
    drawn = _resample(data, resamples)
    margin = (1 - _SHARE) / 2
    return {
        "value": _find_peak(*_sort(data, data["accuracy"].mean("set").values)),
        "ends": np.quantile(drawn, (margin, 1 - margin), axis=0),
    }


def find_jump(data: xr.Dataset) -> tuple[float, float] | None:
    """The two bends [rad] between which the best rate first becomes as steep as the published one,
    or steeper; None: it never does.
    """
    steep = _find_peak(*_sort(data, data["accuracy"].mean("set").values)) <= PUBLISHED_RATE
    falls = np.flatnonzero(~steep[:-1] & steep[1:])
    bends = data["bend"].values
    return (float(bends[falls[0]]), float(bends[falls[0] + 1])) if falls.size else None


def find_lag(data: xr.Dataset) -> xr.Dataset:
    """Points that the published rate is behind the best, ± half of 95 % (bend,): chosen on sets of
    even number, judged on the others.
    """
    accuracy = 100 * data["accuracy"]
    chosen = accuracy.isel(set=slice(0, None, 2)).mean("set").argmax("rate")
    judged = accuracy.isel(set=slice(1, None, 2))
    return average_sets(judged.isel(rate=chosen) - judged.sel(rate=PUBLISHED_RATE))


def find_lead(data: xr.Dataset) -> dict[str, Any]:
    """Points that the published rate is ahead of all others, for the mixture where that is most;
    mixture and rival are chosen on sets of even number, judged on the others.
    """
    accuracy = 100 * data["accuracy"]
    lead = accuracy.sel(rate=PUBLISHED_RATE) - accuracy.drop_sel(rate=PUBLISHED_RATE)
    chosen = lead.isel(set=slice(0, None, 2)).mean("set")
    place = chosen.min("rate").argmax("bend")
    judged = lead.isel(set=slice(1, None, 2), bend=place)
    found = average_sets(judged.isel(rate=chosen.isel(bend=place).argmin("rate")))
    bend, n = float(data["bend"][place]), judged.sizes["set"]
    return {"bend": bend} | make_interval(float(found["mean"]), float(found["half"]), n=n)


def _resample(data: xr.Dataset, resamples: int) -> np.ndarray:
    """Best rates (resample, bend) of sets drawn with replacement."""
    accuracy = data["accuracy"].transpose("set", "bend", "rate").values
    rng, count = np.random.default_rng(_SEED), len(accuracy)
    weight = rng.multinomial(count, np.full(count, 1 / count), size=resamples) / count
    return _find_peak(*_sort(data, np.einsum("ns,sbr->nbr", weight, accuracy)))


def _sort(data: xr.Dataset, mean: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    order = np.argsort(data["rate"].values)
    return data["rate"].values[order], mean[..., order]


def _find_peak(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Where y (…, place) over rising x is greatest: a parabola through three places, or an end."""
    best = y.argmax(axis=-1)
    middle = np.clip(best, 1, len(x) - 2)
    near = [np.take_along_axis(y, (middle + k)[..., None], axis=-1)[..., 0] for k in (-1, 0, 1)]
    back, on = x[middle] - x[middle - 1], x[middle] - x[middle + 1]
    fall, rise = near[1] - near[2], near[1] - near[0]
    below = back * fall - on * rise
    top = x[middle] - 0.5 * (back**2 * fall - on**2 * rise) / np.where(
        below == 0, np.inf, below
    )
    return np.where(best == middle, top, x[best])
