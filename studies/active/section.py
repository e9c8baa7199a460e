"""Does it pay to steer? Stored results, one of them made anew (no figure of the paper)."""

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
from feeler.presets import cockroach
from feeler.report import Section, make_interval
from paper.context import Context
from studies.stored import load_stored

_AGAIN = "fixed:1.2"  # the stored policy that is run again, on the first set


def load_found(contest: Contest) -> tuple[xr.Dataset, xr.Dataset]:
    """What was measured, kept because it takes too long for every report; and the pairs that were
    chosen, on fresh sets.

    Raises
    ------
    InvalidInput
        They were made with other choices than are declared now.
    """
    found, _ = load_stored("active")
    for name in ("sets", "known", "copies", "seed", "noise", "duration", "period"):
        if found["declared"][name] != getattr(contest, name):
            raise InvalidInput(
                f"the stored results were made with {name} {found['declared'][name]}, declared is"
                f" {getattr(contest, name)}. Run: python -m studies.active.measure"
            )
    measured = xr.Dataset.from_dict(found["measured"]).map(
        lambda v: v.astype(float)
    )  # null: NaN
    return measured, xr.Dataset.from_dict(found["confirmed"])


def show(context: Context, section: Section) -> None:
    """The verdict, its figure, and what else was measured."""
    if not context.is_cockroach:
        return  # stored for the published antenna
    contest = load_contest()
    measured, confirmed = load_found(contest)
    section.heading("How to move in order to know")
    section.text(CONTEST_LEAD)
    observer = contest.make_observer(cockroach(), 0)
    seen = observer.run(parse_policy(_AGAIN), contest.copies, contest.deadlines[0])
    kept = float(measured["accuracy"].sel(policy=_AGAIN).isel(set=0, deadline=0))
    section.text(
        "These numbers are stored: they take minutes (studies/active/measure.py), for the published"
        " antenna and the engine's own choices, whatever this report was asked for. One was made"
        f" anew: {_AGAIN}, first set, {contest.deadlines[0]:g} ms: {100 * seen.accuracy[-1]:.3f}"
        f" % now, {100 * kept:.3f} % stored. `feeler active` makes the same for any antenna and for"
        " policies of your own."
    )
    fill_comparison(section, measured, contest)
    drawn = {name: measured[name] for name in ("policy", "deadline", "accuracy", "work")}
    section.numbers("active", **drawn)
    verdict = judge_steering(measured, contest)
    paying = int(verdict["pays"].sum())
    surely = int((verdict["gain"] - verdict["half"] >= contest.gain).sum())
    section.text(
        f"Steering gains at least {contest.gain:g} points over the best fixed speed at {paying}"
        f" of {verdict.sizes['deadline']} deadlines; at {surely} of them the interval excludes a"
        " smaller gain. What was changed after first results were seen stands in"
        " feeler/active/contests.toml."
    )
    _show_confirmed(section, confirmed, verdict)
    for deadline in verdict["deadline"].values:
        one = verdict.sel(deadline=deadline)
        gain = make_interval(float(one["gain"]), float(one["half"]), n=measured.sizes["set"])
        section.values[f"active.gain.{deadline:g}"] = gain
    section.values |= {
        "active.pays": paying,
        "active.again": 100 * (float(seen.accuracy[-1]) - kept),
    }


def _show_confirmed(section: Section, found: xr.Dataset, verdict: xr.Dataset) -> None:
    """The same pairs on fresh sets."""
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
