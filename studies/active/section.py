"""Does it pay to steer? Stored results, one of them made anew, and the wall loop's stability (no
figure of the paper).
"""

from collections.abc import Mapping
from typing import Any

import numpy as np
import xarray as xr

from feeler.active import parse_policy
from feeler.active.contests import (
    CONTEST_LEAD,
    Contest,
    fill_comparison,
    judge_steering,
    load_contest,
)
from feeler.errors import InvalidInput
from feeler.files import read_shipped
from feeler.presets import cockroach
from feeler.report import Section, make_interval
from paper.context import Context

_AGAIN = "fixed:1.2"  # the stored policy that is run again, on the first set


def load_stored(contest: Contest) -> dict[str, Any]:
    """What was measured, kept because it takes too long for every report.

    Returns
    -------
    dict
        ``measured`` and ``learned`` as Datasets, and what else there is, as plain data.

    Raises
    ------
    InvalidInput
        They were made with other choices than are declared now.
    """
    found = read_shipped("studies.active", "results.json")
    for name in ("sets", "known", "copies", "seed", "noise", "duration", "period"):
        if found["declared"][name] != getattr(contest, name):
            raise InvalidInput(
                f"the stored results were made with {name} {found['declared'][name]}, declared is"
                f" {getattr(contest, name)}. Run: python -m studies.active.measure compare write"
            )
    for name in {"measured", "learned"} & {*found}:
        found[name] = xr.Dataset.from_dict(found[name]).map(
            lambda v: v.astype(float)
        )  # null is NaN
    return found


def show(context: Context, section: Section) -> None:
    """The verdict, its figure, and what else was measured."""
    if not context.is_cockroach:
        return  # stored for the published antenna
    contest = load_contest()
    stored = load_stored(contest)
    section.heading("How to move in order to know")
    section.text(CONTEST_LEAD)
    observer = contest.make_observer(cockroach(), 0)
    seen = observer.run(parse_policy(_AGAIN), contest.copies, contest.deadlines[0])
    kept = float(stored["measured"]["accuracy"].sel(policy=_AGAIN).isel(set=0, deadline=0))
    section.text(
        "These numbers are stored: they take minutes (studies/active/measure.py), for the published"
        " antenna and the engine's own choices, whatever this report was asked for. One was made"
        f" anew: {_AGAIN}, first set, {contest.deadlines[0]:g} ms: {100 * seen.accuracy[-1]:.3f}"
        f" % now, {100 * kept:.3f} % stored. `feeler active` makes the same for any antenna and for"
        " policies of your own."
    )
    fill_comparison(section, stored["measured"], contest, stored.get("learned"))
    drawn = {
        name: stored["measured"][name] for name in ("policy", "deadline", "accuracy", "work")
    }
    section.numbers("active", **drawn)
    verdict = judge_steering(stored["measured"], contest)
    paying = int(verdict["pays"].sum())
    surely = int((verdict["gain"] - verdict["half"] >= contest.gain).sum())
    section.text(
        f"Steering gains at least {contest.gain:g} points over the best fixed speed at {paying}"
        f" of {verdict.sizes['deadline']} deadlines; at {surely} of them the interval excludes a"
        " smaller gain. What was changed after first results were seen stands in"
        " feeler/active/contests.toml."
    )
    if confirmed := stored.get("confirmed"):
        _show_confirmed(
            section, xr.Dataset.from_dict(confirmed), verdict, stored.get("confirmed_learned")
        )
    for deadline in verdict["deadline"].values:
        one = verdict.sel(deadline=deadline)
        gain = make_interval(
            float(one["gain"]), float(one["half"]), n=stored["measured"].sizes["set"]
        )
        section.values[f"active.gain.{deadline:g}"] = gain
    section.values |= {
        "active.pays": paying,
        "active.again": 100 * (float(seen.accuracy[-1]) - kept),
    }
    _show_rest(section, stored)


def _show_confirmed(
    section: Section, found: xr.Dataset, verdict: xr.Dataset, learned: Mapping[str, Any] | None
) -> None:
    """The same pairs on fresh sets, and the learned policies where they met them."""
    columns = ("fixed_accuracy", "steered_accuracy", "gain", "half")
    pairs = zip(
        found["deadline"].values,
        verdict["fixed"].values,
        verdict["steered"].values,
        strict=True,
    )
    rows = [
        [
            f"{d:g} ms",
            str(fixed),
            str(steered),
            *(float(found[name].sel(deadline=d)) for name in columns),
        ]
        for d, fixed, steered in pairs
    ]
    section.table(
        ["deadline", "fixed", "steered", "fixed [%]", "steered [%]", "gain", "±"],
        rows,
        f"The pairs chosen above on {found.attrs['sets']} fresh sets, declared after those results"
        " and before these; nothing is chosen anew.",
    )
    least = load_contest().gain
    paying = int(((found["gain"] >= least) & (found["gain"] - found["half"] > 0)).sum())
    section.text(
        f"On fresh sets the gain is at least {least:g} points at {paying} of"
        f" {found.sizes['deadline']} deadlines: what is chosen as the best of many on four sets"
        " looks better there than it is."
    )
    section.values["active.confirmed"] = paying
    for deadline, one in (learned or {}).items():
        section.text(
            f"The learned policy on the same fresh sets, at {deadline} ms: right in"
            f" {one['learned']:.1f} %, {one['fixed_gain']:+.1f} ± {one['fixed_half']:.1f} points"
            f" over the fixed speed, {one['steered_gain']:+.1f} ± {one['steered_half']:.1f} over"
            " the steered one."
        )


def _show_rest(section: Section, stored: Mapping[str, Any]) -> None:
    """What was measured beside the policies, where it was."""
    if places := stored.get("places"):
        rows = [
            [name, one["touches"], one["half"], 100 * one["right"], 100 * one["sure"]]
            for name, one in places.items()
        ]
        section.table(
            ["chosen by, noise [rad]", "touches", "±", "right [%]", "sure within 12 [%]"],
            rows,
            "Where to touch next: touches until one of two near shapes is 95 % sure.",
        )
    if walls := stored.get("wall"):
        rows = []
        for name, one in walls.items():
            held = one.get("stable", [])
            rows.append([name, f"{np.sum(held)} of {np.size(held)}" if held else "no map"])
        section.table(
            ["profile, speed [m/s]", "comes to rest"],
            rows,
            "Wall following on the full dynamics: at how many of the delays and gains that were"
            " tried a body that begins 2 mm off comes to rest.",
        )
