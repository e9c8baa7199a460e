"""The comparison of speeds as one page, with its numbers beside it as CSV and JSON."""

import json
import os
from collections.abc import Mapping
from pathlib import Path

import numpy as np
import xarray as xr

from feeler.errors import InvalidInput
from feeler.files import ensure_folder, write_text
from feeler.report import Section, write_page
from feeler.report.page import to_json
from feeler.studies.study import Study
from feeler.studies.tradeoff.best import average_sets, find_best
from feeler.studies.tradeoff.draw import UNITS_OF_NOISE, plot_tradeoff
from feeler.tensors.transforms import need
from feeler.validation import checked

_SHOWN = ("accuracy", "bits", "work", "force", "release", "speed", "level", "window", "kind")
_ASKED = (
    "How well an ideal observer, who knows every touch exactly, tells {} touches apart from the"
    " noisy tensor, by time, by distance and by number of samples since contact; and what the touch"
    " costs."
)
_SPREAD = "Intervals are 95 % over sets of touches that were drawn anew."
TRADEOFF_LEAD = f"{_ASKED.format('thirty')} {_SPREAD}"


@checked
def write_tradeoff(
    measured: Mapping[str, xr.Dataset], study: Study, out: os.PathLike, conditions: str = ""
) -> Path:
    """``tradeoff.html`` in the folder ``out``, with ``tradeoff.png``, ``tradeoff.csv`` and
    ``tradeoff.json``.

    Parameters
    ----------
    measured
        By name, what one reader tells of one antenna: parts of what
        :meth:`feeler.studies.study.Study.run` gave, as :func:`split_measured` gives them.
    """
    if not measured:
        raise InvalidInput("nothing is measured; run a study and split what it gives.")
    for data in measured.values():
        need(data, *_SHOWN)
    out = ensure_folder(out)
    section = Section(
        name="tradeoff", title="Speed, accuracy, energy", folder=out, vector=False
    )
    fill_section(section, measured, study)
    section.text(conditions)
    table = xr.concat([_tabulate(data) for data in measured.values()], "row", data_vars="all")
    table.to_dataframe().to_csv(out / "tradeoff.csv", index=False, float_format="%.6g")
    write_text(
        out / "tradeoff.json",
        json.dumps({name: to_json(data.to_dict()) for name, data in measured.items()}),
    )
    n = study.task.n_classes
    one = "One set of touches was drawn, so nothing says how far another one would differ."
    known = f"All {n} told apart are {np.log2(n):.2f} bits."
    lead = f"{_ASKED.format(n)} {known} {_SPREAD if study.sets > 1 else one}"
    return write_page(
        out / "tradeoff.html", "Speed against accuracy against energy", lead, section
    )


@checked
def split_measured(found: xr.Dataset) -> dict[str, xr.Dataset]:
    """Each antenna's part of a study, and each reader's if there are several, by name."""
    need(found, "antenna", "reader")
    parts = {}
    for antenna in found["antenna"].values:
        for reader in found["reader"].values:
            name = str(antenna) if found.sizes["reader"] == 1 else f"{antenna}, {reader}"
            one = found.sel(antenna=antenna, reader=reader, drop=True)
            parts[name] = one.assign_attrs(antenna=name)
    return parts


def fill_section(section: Section, measured: Mapping[str, xr.Dataset], study: Study) -> None:
    """The figure and its tables."""
    told = study.sets > 1
    bars = ", bars: speeds that the sets do not tell from it" * told
    brackets = ", in brackets the range that the sets do not tell from it" * told
    section.figure(
        "tradeoff",
        "Accuracy of an ideal observer at each speed, against time and distance since contact"
        f" (first antenna, one noise floor); the best speed for each deadline{bars}; bits of whole"
        " touches and (dashed) at equal distance and equal number of samples; work on the antenna"
        " and peak force.",
        lambda figure: plot_tradeoff(measured, study.shown, figure),
        height=4.8,
    )
    for name, data in measured.items():
        for kind, level in study.shown.items():
            section.table(
                ["window", *(f"{v:g} m/s" for v in data["speed"].values), "best"],
                _list_rows(data, study, level),
                f"{name}, noise {level} {UNITS_OF_NOISE.get(kind, '')}: bits, and accuracy in %."
                f" Best speed by accuracy [m/s]{brackets}.",
            )
    costs = [
        [name, cost, *(float(x) for x in data[field].mean("set"))]
        for name, data in measured.items()
        for field, cost in (
            ("work", "work [µJ]"),
            ("force", "peak force [mN]"),
            ("release", "last contact [ms]"),
        )
    ]
    speeds = next(iter(measured.values()))["speed"].values
    section.table(["antenna", "of a whole touch", *(f"{v:g} m/s" for v in speeds)], costs)


def _list_rows(data: xr.Dataset, study: Study, level: str) -> list[list[object]]:
    """Matched rows: the same time, the same distance, the same distance and samples, and the whole
    touch.
    """
    wanted = [f"{t:g} ms" for t in study.windows["matched_times"]]
    wanted.append(f"{study.windows['matched_distance']:g} mm")
    wanted += [
        str(w)
        for w in data["window"].values[
            np.isin(data["kind"].values, ("distance and samples", "whole touch"))
        ]
    ]
    bits, accuracy = (
        average_sets(data[field].sel(level=level))["mean"] for field in ("bits", "accuracy")
    )
    best = find_best(data, level)
    rows: list[list[object]] = []
    for window in wanted:
        cells = [
            f"{float(b):.2f} ({100 * float(a):.0f})"
            for b, a in zip(bits.sel(window=window), accuracy.sel(window=window), strict=True)
        ]
        found = best.sel(window=window)
        fastest = f"{float(found['best']):g}"
        if study.sets > 1 and len(cells) > 1:
            fastest += f" ({float(found['least']):g}…{float(found['most']):g})"
        rows.append([window, *cells, fastest])
    return rows


def _tabulate(data: xr.Dataset) -> xr.Dataset:
    """A row per speed, level and window: means over the sets, and half their interval."""
    found = {
        f"{field}{ending}": average_sets(data[field])[part]
        for field in ("accuracy", "bits")
        for ending, part in (("", "mean"), ("_half", "half"))
    }
    costs = {name: data[name].mean("set") for name in ("work", "force", "release")}
    names = ("antenna", "speed", "level", "window")
    table = (
        xr.Dataset(found | costs)
        .drop_vars(("kind", "value"))
        .assign(antenna=data.attrs["antenna"])
    )
    flat = table.stack(row=names[1:]).reset_index("row")
    return flat.reset_coords()[[*names, *found, *costs]]
