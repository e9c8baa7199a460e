"""What spikes tell of a touch, by when, from which antenna (no figure of the paper)."""

from collections.abc import Mapping, Sequence
from itertools import pairwise
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from feeler.plotting.look import PALETTE
from feeler.report import Section, make_interval
from feeler.studies.paper.context import Context
from feeler.studies.paper.declared import CLAIMED
from feeler.studies.spiking import load_measured
from feeler.studies.tradeoff import average_sets

PACES = ("slow", "medium", "fast")
READ_BY = {
    "ideal": "ideal observer",
    "counts": "counts in 10 ms",
    "first": "first spike of each unit",
    "onset": "first spike of all",
}
DEADLINES = ("20 ms", "50 ms", "100 ms", "200 ms", "whole touch")
CHANGES = {
    "own": "Poisson trains of 56 places",
    "shared": "gain of the exponential antenna",
    "100 spikes": "100 spikes a touch",
    "200 spikes": "200 spikes a touch",
    "regular": "regular trains (gamma of order 4, 1 ms of rest)",
    "spread 3 ms": "latency spread by 3 ms",
    "receptor 0.003 rad": "receptor noise of 0.003 rad",
    "phasic": "phasic part alone",
    "tonic": "tonic part alone",
    "hair": "hair sensilla, by rate of bending",
    "28 places": "28 places",
    "14 places": "14 places",
    "7 places": "7 places",
    "4 places": "4 places",
    "null": "one touch repeated",
}
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


def judge_orders(found: Found) -> dict[str, Any]:
    """What is claimed of speeds and profiles."""
    values = {}
    for code in ("counts", "ideal"):

        def read(speed: str, profile: str = "exponential", code: str = code, **rest: str) -> dict:
            return {"profile": profile, "speed": speed, "code": code, **rest}

        for variant, name in (("own", "whole"), ("200 spikes", "200")):
            rising = [read(speed, variant=variant) for speed in ("fast", "medium", "slow")]
            values[f"spikes.slower.{name}.{code}"] = found.order(*rising)
        rising = [read(speed, window="50 ms") for speed in PACES]
        values[f"spikes.faster.50.{code}"] = found.order(*rising)
        for gain in ("own", "shared"):
            rising = [read("slow", profile, variant=gain) for profile in reversed(CLAIMED)]
            values[f"spikes.profile.{gain}.{code}"] = found.order(*rising)
        slow, fast = (read(speed, "constant") for speed in ("slow", "fast"))
        values[f"spikes.constant.{code}"] = found.compare(fast, slow)
    return values


def judge_rest(found: Found) -> dict[str, Any]:
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
        for profile in ("exponential", "constant")
        for speed in PACES
        for code in ("counts", "first")
    ]
    values["spikes.null"] = max(null, key=lambda one: one.get("value", -np.inf))
    return values


def collect_values(cells: Mapping[str, Any]) -> dict[str, Any]:
    """The numbers that claims are held against, and percent named right of all that was asked."""
    found = Found(cells)
    values: dict[str, Any] = judge_orders(found) | judge_rest(found)
    for key in cells:
        profile, speed, code, variant, window = key.split("/")
        whole = window == "whole touch" and variant in ("own", "shared")
        if whole or (profile == "exponential" and variant == "own"):
            name = ".".join((profile, speed, code, variant, window)).replace(" ", "_")
            values[f"spikes.right.{name}"] = average(
                found.get(profile, speed, code, variant, window)
            )
    for code in ("counts", "ideal"):
        values[f"spikes.sets.{code}"] = len(found.get("exponential", "slow", code))
    return values


def plot(cells: Mapping[str, Any], figure: Figure) -> None:
    """By deadline and code; by profile and gain; by number of places; by what is changed."""
    found = Found(cells)
    (by_time, by_profile), (by_place, by_change) = figure.subplots(2, 2)
    for speed, colour in zip(PACES, PALETTE, strict=False):
        for code, style in (("ideal", "-o"), ("counts", "--s"), ("first", ":^")):
            spreads = [average(found.get("exponential", speed, code, "own", w)) for w in DEADLINES]
            label = speed if code == "ideal" else ""
            _draw(by_time, range(len(DEADLINES)), spreads, style, colour, label)
    by_time.set_xticks(range(len(DEADLINES)), [*DEADLINES[:-1], "whole"])
    by_time.set(xlabel="deadline since contact", ylabel="named right [%]", ylim=(0, 102))
    for speed, colour in zip(PACES, PALETTE, strict=False):
        for gain, style in (("own", "-o"), ("shared", "--s")):
            spreads = [average(found.get(p, speed, "counts", gain)) for p in CLAIMED]
            _draw(by_profile, range(3), spreads, style, colour, "")
    by_profile.set_xticks(range(3), CLAIMED)
    by_profile.set(ylabel="named right [%]", ylim=(0, 102))
    _plot_places(found, by_place)
    _plot_changes(found, by_change)
    by_time.legend(title="speed")


def _draw(
    ax: Axes, x: Any, spreads: Sequence[dict], style: str, colour: str, label: str = ""
) -> None:
    """Points with their intervals; what is undefined is left out."""
    known = [(at, one) for at, one in zip(x, spreads, strict=True) if "value" in one]
    values = [one["value"] for _, one in known]
    half = [one["high"] - one["value"] for _, one in known]
    ax.errorbar(
        [at for at, _ in known], values, half, fmt=style, color=colour, ms=3, capsize=2, label=label
    )


def _plot_places(found: Found, ax: Axes) -> None:
    """Slow whole touches from fewer places."""
    places = {"4 places": 4, "7 places": 7, "14 places": 14, "28 places": 28, "own": 56}
    for code, style in (("ideal", "-o"), ("counts", "--s"), ("first", ":^")):
        spreads = [average(found.get("exponential", "slow", code, name)) for name in places]
        _draw(ax, places.values(), spreads, style, "black", READ_BY[code])
    ax.set_xscale("log")
    ax.set_xticks([*places.values()], [str(n) for n in places.values()], minor=False)
    ax.minorticks_off()
    ax.set(xlabel="places with sensilla", ylabel="slow touches named right [%]")
    ax.legend()


def _plot_changes(found: Found, ax: Axes) -> None:
    """Whole touches by what is changed, read by counts."""
    shown = [name for name in CHANGES if "places" not in name and name not in ("shared", "null")]
    for speed, colour in zip(PACES, PALETTE, strict=False):
        spreads = [average(found.get("exponential", speed, "counts", name)) for name in shown]
        known = [(k, one) for k, one in enumerate(spreads) if "value" in one]
        half = [one["high"] - one["value"] for _, one in known]
        rows = [k for k, _ in known]
        values = [one["value"] for _, one in known]
        ax.errorbar(values, rows, xerr=half, fmt="o", color=colour, ms=3, capsize=2)
    words = ["Poisson" if name == "own" else name for name in shown]
    ax.set_yticks(range(len(shown)), words, fontsize=6)
    ax.invert_yaxis()
    ax.set(xlabel="named right by counts [%]")


def show(_context: Context, section: Section) -> None:
    """The question, what was found, and the values."""
    cells, about = load_measured()
    values = collect_values(cells)
    section.text(
        "A brain sees spikes, not angles. Sensilla after Szczecinski et al. 2021 sit on both sides"
        " of the antenna at 56 places; thirty touches, each drawn anew in every set, are read from"
        " their trains. How strongly an antenna drives them is not known: each antenna has a gain"
        " of its own, or all have the exponential antenna's. Every choice and every expectation"
        " was written down before (studies/spiking/declared.toml)."
    )
    section.text(
        f"Measured on {about['date']} with seed {about['seed']}: {values['spikes.sets.ideal']} sets"
        f" for the ideal observer, {values['spikes.sets.counts']} for readers that learn, of 20"
        " that were declared at most; the clock ended the runs. benchmarks/spikes.py makes them"
        " anew."
    )
    section.figure(
        "spikes",
        "Touches named right, of thirty kinds. Above left: exponential antenna, by deadline; solid:"
        " ideal observer, dashed: counts, dotted: first spikes. Above right: counts over whole"
        " touches; solid: each antenna's own gain, dashed: one gain. Below left: slow whole touches"
        " from fewer places. Below right: whole touches by what is changed. Colours are speeds"
        " throughout. Bars: 95 % over sets.",
        lambda figure: plot(cells, figure),
        height=5.5,
        numbers={name: one["value"] for name, one in values.items() if _is_known(one)},
    )
    _write_tables(section, Found(cells))
    section.values.update(values)


def _is_known(value: Any) -> bool:
    return isinstance(value, dict) and "value" in value


def _write_tables(section: Section, found: Found) -> None:
    """Named right by profile, gain and speed; by what is changed; spikes and bits."""
    rows = [
        [profile, gain, READ_BY[code]]
        + [_say(average(found.get(profile, speed, code, gain))) for speed in PACES]
        for profile in CLAIMED
        for gain in ("own", "shared")
        for code in ("ideal", "counts", "first")
    ]
    section.table(
        ["antenna", "gain", "read by", *PACES], rows, "Whole touches named right [%], 95 %."
    )
    rows = [
        [
            CHANGES[name],
            *(_say(average(found.get("exponential", speed, "counts", name))) for speed in PACES),
        ]
        for name in CHANGES
    ]
    section.table(
        ["exponential antenna, counts", *PACES], rows, "Whole touches named right [%], 95 %."
    )
    rows = [
        [profile, speed, *_count(found, profile, speed)] for profile in CLAIMED for speed in PACES
    ]
    section.table(
        ["antenna", "speed", "spikes a touch", "bits", "bits per thousand spikes"],
        rows,
        "Whole touches at the antenna's own gain, by the ideal observer (log₂ 30 = 4.9 bits).",
    )


def _count(found: Found, profile: str, speed: str) -> list[str]:
    spikes = found.get(profile, speed, "ideal", field="spikes")
    bits = found.get(profile, speed, "ideal", field="bits")
    return [
        f"{spikes.mean():.0f}",
        _say(average(bits), 2),
        _say(average(1000 * bits / spikes), 1),
    ]


def _say(spread: Mapping[str, Any], digits: int = 1) -> str:
    if "undefined" in spread:
        return "not read"
    half = spread["high"] - spread["value"]
    return f"{spread['value']:.{digits}f} ± {half:.{digits}f}"
