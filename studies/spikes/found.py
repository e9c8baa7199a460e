"""What the study of spikes found, as numbers by set, and what its claims are held against."""

from collections.abc import Mapping, Sequence
from itertools import pairwise, product
from typing import Any

import numpy as np
import xarray as xr

from feeler.report import make_interval
from feeler.tradeoff import average_sets
from paper.data import CLAIMED

PACES = ("slow", "medium", "fast")
_KEPT = 95.0  # % of the accuracy that fewer places are to keep
_FEWEST = 2  # sets of an interval


class Found:
    """The study's results; percent, one number for each set."""

    def __init__(self, cells: Mapping[str, Mapping[str, Sequence[float]]]) -> None:
        self.cells = cells

    def get(
        self,
        profile: str,
        speed: str,
        code: str,
        variant: str = "own",
        window: str = "whole touch",
        field: str = "accuracy",
    ) -> np.ndarray:
        """By set; none where the code was not asked, NaN in sets where it could not be."""
        cell = self.cells.get("/".join((profile, speed, code, variant, window)), {})
        values = np.asarray(cell.get(field, ()), dtype=float)
        return values if field in ("bits", "spikes") else 100 * values

    def compare(self, better: Mapping[str, Any], worse: Mapping[str, Any]) -> dict[str, Any]:
        """Points between two, in pairs over the sets that both have."""
        first, second = self.get(**better), self.get(**worse)
        count = min(len(first), len(second))
        return average(first[:count] - second[:count])

    def keep(self, code: str, variant: str) -> np.ndarray:
        """Percent of the accuracy that slow whole touches keep in a variant, set by set."""
        whole, left = (self.get("exponential", "slow", code, name) for name in ("own", variant))
        count = min(len(whole), len(left))
        return 100 * left[:count] / whole[:count]

    def per_thousand(self, profile: str, pace: str) -> np.ndarray:
        """Bits that the ideal observer gets of a thousand spikes of whole touches, set by set."""
        bits, spikes = (self.get(profile, pace, "ideal", field=f) for f in ("bits", "spikes"))
        return 1000 * bits / spikes

    def order(self, *rising: Mapping[str, Any]) -> dict[str, Any]:
        """Points between neighbours of an order; of several the one that is least sure."""
        return find_least([self.compare(high, low) for low, high in pairwise(rising)])


def average(values: np.ndarray) -> dict[str, Any]:
    """Mean over sets with its 95 % interval; undefined for fewer than two."""
    known = values[np.isfinite(values)]
    if len(known) < _FEWEST:
        return {"undefined": "not read in two sets"}
    found = average_sets(xr.DataArray(known, dims="set"))
    return make_interval(float(found["mean"]), float(found["half"]), n=len(known))


def find_least(found: Sequence[dict[str, Any]]) -> dict[str, Any]:
    """The one whose interval reaches lowest; undefined where one of them is."""
    undefined = [one for one in found if "undefined" in one]
    return undefined[0] if undefined else min(found, key=lambda one: one["low"])


def say_mean(spread: Mapping[str, Any], digits: int = 1) -> str:
    """A mean ± half its interval."""
    if "undefined" in spread:
        return "not read"
    half = spread["high"] - spread["value"]
    return f"{spread['value']:.{digits}f} ± {half:.{digits}f}"


def _judge_orders(found: Found) -> dict[str, Any]:
    """What is claimed of speeds and profiles."""
    values = {}
    for code in ("counts", "ideal"):

        def read(
            speed: str, profile: str = "exponential", code: str = code, **rest: str
        ) -> dict:
            return {"profile": profile, "speed": speed, "code": code, **rest}

        for variant, name in (("own", "whole"), ("200 spikes", "200")):
            rising = [read(speed, variant=variant) for speed in ("fast", "medium", "slow")]
            values[f"spikes.slower.{name}.{code}"] = found.order(*rising)
        rising = [read(speed, window="50 ms") for speed in PACES]
        values[f"spikes.faster.50.{code}"] = found.order(*rising)
        for gain in ("own", "shared"):
            rising = [read("slow", profile, variant=gain) for profile in reversed(CLAIMED)]
            values[f"spikes.profile.{gain}.{code}"] = found.order(*rising)
        slow, fast = (read(speed, "uniform") for speed in ("slow", "fast"))
        values[f"spikes.uniform.{code}"] = found.compare(fast, slow)
    return values


def _judge_rest(found: Found) -> dict[str, Any]:
    """What is claimed of slow whole touches of the exponential antenna, and of nothing."""
    slow = ("exponential", "slow")
    counts = {"profile": slow[0], "speed": slow[1], "code": "counts"}
    values = {
        f"spikes.place.{code}": average(found.get(*slow, code, field="place"))
        for code in ("first", "onset")
    }
    values["spikes.cost.receptor"] = found.compare(
        counts, counts | {"variant": "receptor 0.003 rad"}
    )
    values["spikes.gain.regular"] = found.compare(counts | {"variant": "regular"}, counts)
    for code in ("counts", "ideal"):
        kept = {n: found.keep(code, f"{n} places") for n in (28, 14, 7, 4)}
        enough, too_few = average(kept[14] - _KEPT), average(_KEPT - kept[7])
        values[f"spikes.units.{code}"] = find_least([enough, too_few])
        values |= {f"spikes.kept.{n}.{code}": average(share) for n, share in kept.items()}
    null = [
        average(found.get(profile, speed, code, "null"))
        for profile in ("exponential", "uniform")
        for speed in PACES
        for code in ("counts", "first")
    ]
    values["spikes.null"] = max(null, key=lambda one: one.get("value", -np.inf))
    return values


def collect_values(cells: Mapping[str, Any]) -> dict[str, Any]:
    """The numbers that claims are held against, and percent classified correctly of all that
    was asked.
    """
    found = Found(cells)
    values: dict[str, Any] = _judge_orders(found) | _judge_rest(found)
    for key in cells:
        profile, speed, code, variant, window = key.split("/")
        whole = window == "whole touch" and variant in ("own", "shared")
        if whole or (profile == "exponential" and variant == "own"):
            name = ".".join((profile, speed, code, variant, window)).replace(" ", "_")
            values[f"spikes.right.{name}"] = average(
                found.get(profile, speed, code, variant, window)
            )
    for profile, pace in product(CLAIMED, PACES):
        values[f"spikes.per_thousand.{profile}.{pace}"] = average(
            found.per_thousand(profile, pace)
        )
    for code in ("counts", "ideal"):
        values[f"spikes.sets.{code}"] = len(found.get("exponential", "slow", code))
    return values
