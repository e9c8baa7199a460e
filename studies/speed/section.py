"""Speed against accuracy against energy, for the paper's antenna and its controls (no figure of the
paper).
"""

from typing import Any

import xarray as xr

from feeler.report import Section, make_interval, make_spread
from feeler.study import Study
from feeler.tradeoff import (
    TRADEOFF_LEAD,
    average_sets,
    fill_section,
    find_best,
    load_declared,
    split_measured,
)
from paper.context import Context
from paper.data import list_profiles

_WINDOWS = {
    "whole": "whole touch",
    "matched": "{matched_distance:g} mm, {matched_samples} samples",
    "early": "30 ms",
}


def compute(context: Context, study: Study) -> dict[str, xr.Dataset]:
    """What every profile of this scale tells at every speed."""
    asked = context.effort.trade_profiles
    antennas = {
        name: context.profiles[name]
        for name in list_profiles(context)
        if not asked or name in asked or not context.is_cockroach
    }
    return split_measured(study.run(antennas, **context.physics))


def _collect_values(measured: dict[str, xr.Dataset], study: Study) -> dict[str, Any]:
    """The numbers that claims are held against."""
    found, first = {}, next(iter(measured.values()))
    speeds = first["speed"].values
    named = {"slowest": speeds[0], "middle": speeds[len(speeds) // 2], "fastest": speeds[-1]}
    for kind, level in study.shown.items():
        for name, window in _WINDOWS.items():
            chosen = first["bits"].sel(level=level, window=window.format(**study.windows))
            for word, speed in named.items():
                found[f"tradeoff.{name}.{kind}.{word}"] = _spread(chosen.sel(speed=speed))
        for profile, data in measured.items():
            whole = data["bits"].sel(level=level, window=_WINDOWS["whole"], speed=speeds[0])
            found[f"tradeoff.profile.{kind}.{profile}"] = _spread(whole)
    best = find_best(first, study.shown["common"])
    for deadline in study.windows["deadlines"]:
        one = best.sel(window=f"{deadline:g} ms")
        found[f"tradeoff.best.{deadline:g}"] = make_spread(
            *(float(one[name]) for name in ("best", "least", "most")), n=study.sets
        )
        accuracy = make_interval(
            100 * float(one["mean"]), 100 * float(one["half"]), n=study.sets
        )
        found[f"tradeoff.accuracy.{deadline:g}"] = accuracy
    for word, speed in named.items():
        found[f"tradeoff.work.{word}"] = _spread(first["work"].sel(speed=speed))
        found[f"tradeoff.force.{word}"] = _spread(first["force"].sel(speed=speed))
    levels = {f"choices.{kind}": float(size) for kind, size in study.headline.items()}
    return found | levels | {"tradeoff.sets": study.sets}


def _spread(values: xr.DataArray) -> dict[str, float] | float:
    one = average_sets(values)
    return make_interval(float(one["mean"]), float(one["half"]), n=values.sizes["set"])


def show(context: Context, section: Section) -> None:
    """The figure, its tables, and the values."""
    study = load_declared(**context.effort.trade)
    measured = compute(context, study)
    section.text(TRADEOFF_LEAD)
    section.text(
        f"{study.sets} set(s) of thirty touches; every choice was written down before"
        " (feeler/tradeoff.toml). `feeler tradeoff` makes the same for any antenna."
    )
    fill_section(section, measured, study)
    section.values.update(_collect_values(measured, study))
    section.numbers("tradeoff", **{name: data.to_dict() for name, data in measured.items()})
