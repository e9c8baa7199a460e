"""The comparison of policies as one page, with its numbers beside it as CSV and JSON."""

import json
import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from feeler.files import write_text
from feeler.plotting.style import PALETTE
from feeler.report import Section, write_page
from feeler.report.page import to_json
from feeler.studies.contests.contest import Contest
from feeler.studies.contests.judge import judge_energy, judge_learned, judge_steering
from feeler.studies.tradeoff import average_sets
from feeler.validation import checked

CONTEST_LEAD = (
    "Which of six objects is it? A body moves its antenna towards one of thirty touches, all of"
    " them known to an ideal observer that also knows what its own body did, so that its answers"
    " are Bayes' own. Time is counted from the beginning, the way to the object included. Intervals"
    " are 95 % over sets of touches that were drawn anew."
)

_NEAR = (
    2.0,
    4.0,
)  # µJ, %, as large as a name: of policies nearer than this only one is named in the picture


@checked
def write_active(
    measured: xr.Dataset,
    comparison: Contest,
    out: os.PathLike,
    movies: Mapping[str, Path] | None = None,
    conditions: str = "",
) -> Path:
    """``active.html`` in the folder ``out``, with ``active.png``, ``active.csv`` and
    ``active.json``; ``movies`` by the name of their policy.
    """
    out = Path(out)
    out.mkdir(parents=True, exist_ok=True)
    section = Section(name="active", title="Move, feel, decide", folder=out, vector=False)
    fill_comparison(section, measured, comparison)
    for name, path in (movies or {}).items():
        section.movie(
            path,
            f"One touch under the policy {name}: the antenna and the object from above, the speed"
            " at which the body moves, and how probable it takes each object to be.",
        )
    section.text(conditions)
    measured.to_dataframe().reset_index().to_csv(
        out / "active.csv", index=False, float_format="%.6g"
    )
    write_text(out / "active.json", json.dumps(to_json(measured.to_dict())))
    return write_page(
        out / "active.html", "How to move in order to know", CONTEST_LEAD, section
    )


def fill_comparison(
    section: Section,
    measured: xr.Dataset,
    comparison: Contest,
    learned: xr.Dataset | None = None,
) -> None:
    """The figure, the verdict, the tables; ``learned`` as ``feeler.studies.contests.judge_learned``
    takes it, with ``work``.
    """
    section.figure(
        "active",
        "Left: how often the ideal observer names the object right, by the deadline; a line for"
        " each policy. Right: the same at the second deadline, against the work on the antenna"
        " until then. A policy is a rule for moving: fixed:0.6 keeps 0.6 m/s; fast-then-slow:1.2,"
        "0.3,10 slows down from 1.2 to 0.3 m/s 10 ms after the beginning, slow-after-contact:1.2,"
        "0.3 as soon as contact is probable. Bars: 95 % over sets, cut at 0 and 100 %"
        + (
            "."
            if learned is None
            else (
                f"; the learned policy on sets {learned['set'].values.tolist()} of those on which"
                " policies are judged."
            )
        ),
        lambda figure: plot_comparison(measured, comparison, figure, learned),
        height=3.2,
    )
    deadlines = [f"{d:g} ms" for d in measured["deadline"].values]
    names = [str(name) for name in measured["policy"].values]
    found = average_sets(100 * measured["accuracy"])
    rows = [
        [name, *(_say(found, name, d) for d in measured["deadline"].values)] for name in names
    ]
    section.table(
        ["policy", *deadlines], rows, "Right answers [%] ± half the interval, by deadline."
    )
    work = measured["work"].mean("set")
    section.table(
        ["policy", *deadlines],
        [[name, *(float(w) for w in work.sel(policy=name))] for name in names],
        "Work on the antenna until then [µJ].",
    )
    steered = {*names} & {*comparison.steered, *comparison.ahead}
    if measured.sizes["set"] < 2 or not steered or not {*names} & {*comparison.fixed}:
        return
    verdict = judge_steering(measured, comparison)
    rows = [
        [label, *_say_verdict(verdict.isel(deadline=k))] for k, label in enumerate(deadlines)
    ]
    section.table(
        ["deadline", "best fixed", "%", "best steered", "%", "gain", "±", "pays"],
        rows,
        "Chosen on sets of even number, judged on the others. Steering pays where it gains at"
        f" least {comparison.gain:g} points and the interval excludes 0. One set to judge on gives"
        " no interval, and so no verdict: ask for four sets or more.",
    )
    section.table(
        ["deadline [ms]", "budget [µJ]", "best fixed", "%", "best steered", "%"],
        [
            ["no policy" if cell == "none" else cell for cell in map(_say_missing, row)]
            for row in judge_energy(measured, comparison)
        ],
        "Among policies whose mean work until then keeps to the budget; “no policy”: all need"
        " more.",
    )
    if learned is not None:
        _fill_learned(section, learned, measured, comparison)


def _fill_learned(
    section: Section, learned: xr.Dataset, measured: xr.Dataset, comparison: Contest
) -> None:
    found = judge_learned(learned, measured, comparison)
    columns = (
        "learned",
        "least",
        "most",
        "fixed_gain",
        "fixed_half",
        "steered_gain",
        "steered_half",
    )
    rows = [
        [f"{d:g} ms", *(float(found[c].sel(deadline=d)) for c in columns)]
        for d in found["deadline"].values
    ]
    head = [
        "deadline",
        "learned [%]",
        "least seed",
        "greatest",
        "over the best fixed",
        "±",
        "over the best steered",
        "±",
    ]
    section.table(
        head,
        rows,
        f"Recurrent PPO on what the observer believes, the mean of {learned.sizes['seed']} seeds;"
        " points gained over the policies above, on the same sets and noise.",
    )


def _say_verdict(one: xr.Dataset) -> list[Any]:
    """Both policies, their accuracies, the gain with its interval, and whether steering pays."""
    columns = ("fixed", "fixed_accuracy", "steered", "steered_accuracy", "gain")
    cells = [one[column].values.item() for column in columns]
    if not np.isfinite(one["half"]):
        return [*cells, "one set", "cannot be said"]
    return [*cells, float(one["half"]), "yes" if one["pays"] else "no"]


def _say_missing(cell: Any) -> Any:
    """A dash for what is not a number."""
    return "–" if isinstance(cell, float) and not np.isfinite(cell) else cell


def _say(found: xr.Dataset, name: str, deadline: float) -> str:
    one = found.sel(policy=name, deadline=deadline)
    mean, half = float(one["mean"]), float(one["half"])
    return f"{mean:.1f} ± {half:.1f}" if np.isfinite(half) else f"{mean:.1f}"


def plot_comparison(
    measured: xr.Dataset, comparison: Contest, figure: Figure, learned: xr.Dataset | None = None
) -> None:
    """Accuracy against deadline, and against work at the second one; needs about 7.2 × 3.2
    inches.
    """
    left, right = figure.subplots(1, 2)
    at = min(1, measured.sizes["deadline"] - 1)
    found, work = average_sets(100 * measured["accuracy"]), measured["work"].mean("set")
    at_work, at_mean = work.isel(deadline=at).values, found["mean"].isel(deadline=at).values
    groups = {
        "fixed speed": comparison.fixed,
        "steered": comparison.steered,
        "looks ahead": comparison.ahead,
    }
    listed = {name for names in groups.values() for name in names}
    groups["own"] = tuple(str(name) for name in measured["policy"].values if name not in listed)
    for colour, (label, names) in zip(PALETTE, groups.items(), strict=False):
        for k, name in enumerate(n for n in names if n in measured["policy"].values):
            one = found.sel(policy=name)
            left.errorbar(
                measured["deadline"],
                one["mean"],
                _cut(one),
                color=colour,
                lw=0.8,
                capsize=1.5,
                alpha=0.75,
                label=label if k == 0 else None,
            )
            last, spent = one.isel(deadline=at), float(work.sel(policy=name)[at])
            right.errorbar(spent, last["mean"], _cut(last), fmt="o", ms=3, color=colour)
    if learned is not None:
        mean = average_sets(100 * learned["accuracy"].mean("seed"))
        style: dict[str, Any] = {
            "color": "black",
            "fmt": "s",
            "ms": 3,
            "capsize": 1.5,
            "lw": 0.8,
        }
        left.errorbar(learned["deadline"], mean["mean"], _cut(mean), label="learned", **style)
        last = mean.isel(deadline=at)
        right.errorbar(
            float(learned["work"].mean(("seed", "set"))[at]), last["mean"], _cut(last), **style
        )
    _name_best([str(name) for name in measured["policy"].values], at_work, at_mean, right)
    left.set(xlabel="deadline [ms since the beginning]", ylabel="right answers [%]")
    left.legend(fontsize=6.5)
    right.set(
        xlabel="work on the antenna [µJ]",
        ylabel=f"right at {measured['deadline'].values[at]:g} ms [%]",
    )


def _cut(found: xr.Dataset) -> np.ndarray:
    """How far the bars of a mean [%] reach down and up: no share is below 0 or above 100 %."""
    mean, half = (np.atleast_1d(found[name].values) for name in ("mean", "half"))
    return np.stack([np.minimum(half, mean), np.minimum(half, 100.0 - mean)])


def _name_best(names: Sequence[str], work: np.ndarray, right: np.ndarray, ax: Axes) -> None:
    """Names beside the policies that none does better for less work, the best first, as far as
    there is room.
    """
    named: list[tuple[float, float]] = []
    for k in np.argsort(-right):
        place = float(work[k]), float(right[k])
        beaten = np.any((work <= place[0]) & (right > place[1]))
        if not beaten and all(
            abs(place[0] - x) > _NEAR[0] or abs(place[1] - y) > _NEAR[1] for x, y in named
        ):
            named.append(place)
            line = {"arrowstyle": "-", "lw": 0.4, "color": "grey", "relpos": (0, 0.5)}
            at = (
                0.5,
                0.62 - 0.07 * len(named),
            )  # below the front, where no policy of these lies
            ax.annotate(
                names[k],
                place,
                fontsize=6.5,
                xytext=at,
                textcoords="axes fraction",
                va="center",
                arrowprops=line,
            )
