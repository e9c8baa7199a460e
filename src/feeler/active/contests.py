"""Contests: does it pay to steer? Policies against each other under one ideal observer, as declared
beforehand in contests.toml; what an observer knows by each deadline, and what the way there costs.
"""

import json
import os
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from itertools import product
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from feeler.active.observer import Observer
from feeler.active.policies import parse_policy
from feeler.active.tasks import TouchTask
from feeler.antenna.segments import Antenna
from feeler.errors import InvalidInput
from feeler.files import read_shipped, write_text
from feeler.plotting.style import PALETTE
from feeler.progress import show_progress
from feeler.provenance import Journal, compute_digest, make_key, to_json
from feeler.records import Ge, Gt, Len, Record, Unit
from feeler.report import Section, write_page
from feeler.tradeoff import average_sets
from feeler.validation import checked

_FIELDS = ("accuracy", "hits", "work")


class Contest(Record):
    """What is compared, and how much of it; :func:`load_contest` reads what was declared.

    Attributes
    ----------
    sets : int
        Number of times all touches are resampled.
    known : int
        Touches of a set.
    copies : int
        How often each is felt.
    noise : str
        As text, such as ``"common:0.03"``; see :func:`feeler.objects.parse_noise`.
    duration : float
        Of an episode [ms].
    period : float
        Between two decisions [ms].
    deadlines : tuple[float, ...]
        [ms]
    fixed : tuple[str, ...]
        Policies that steering is held against.
    ahead : tuple[str, ...]
        Policies that look ahead, on ``ahead_sets`` sets with ``ahead_copies`` copies.
    gain : float
        Points that steering must gain to count.
    confirm : dict[str, Any]
        Fresh sets for the policies that were chosen.
    """

    sets: Annotated[int, Ge(1)]
    known: Annotated[int, Ge(2)]
    copies: Annotated[int, Ge(1)]
    seed: int
    noise: str
    duration: Annotated[float, Gt(0), Unit("ms")]
    period: Annotated[float, Gt(0), Unit("ms")]
    deadlines: Annotated[tuple[float, ...], Len(1)]
    fixed: tuple[str, ...]
    steered: tuple[str, ...]
    ahead: tuple[str, ...]
    ahead_sets: Annotated[int, Ge(1)]
    ahead_copies: Annotated[int, Ge(1)]
    gain: float
    confirm: dict[str, Any]

    def _check(self) -> None:
        if max(self.deadlines) > self.duration or any(d % self.period for d in self.deadlines):
            raise InvalidInput(
                f"deadlines must be multiples of {self.period:g} ms up to {self.duration:g} ms."
            )

    def make_task(self, antenna: Antenna, number: int) -> TouchTask:
        """Set ``number`` of touches; the same for all policies, and in place and size for all
        antennas.
        """
        return TouchTask(
            antenna,
            noise=self.noise,
            duration=self.duration,
            pool=self.known,
            seed=self.seed * 1000 + number,
        )

    def make_observer(self, antenna: Antenna, number: int) -> Observer:
        """Who knows set ``number`` of touches."""
        return Observer(
            self.make_task(antenna, number), period=self.period, random_state=number
        )

    @checked
    def run(
        self,
        antenna: Antenna,
        policies: Sequence[str] | None = None,
        *,
        journal: Path | None = None,
        progress: Callable[[int, int], None] | None = None,
    ) -> xr.Dataset:
        """What an ideal observer knows that moves by each policy, and the work on its antenna.

        Parameters
        ----------
        policies
            As :func:`feeler.active.parse_policy` takes them; default: all that are declared.
        journal
            File to which each policy and set is written as it finishes, and from which they are
            taken where they are there.
        progress
            Called with (policies and sets done, in all); default: a bar after 5 s.

        Returns
        -------
        xarray.Dataset
            ``accuracy`` (the observer's own expectation, which is unbiased), ``hits`` (share named
            right) and ``work`` [µJ] by (policy, set, deadline); NaN where a policy that looks ahead
            was not run on a set.

        Raises
        ------
        InvalidInput
            No policy, or the journal of another contest.
        """
        listed = (*self.fixed, *self.steered, *self.ahead)
        names = [*dict.fromkeys(listed if policies is None else policies)]
        if not names:
            raise InvalidInput("there is no policy to compare; name at least one.")
        for name in names:
            parse_policy(name)  # refuses what is no policy before anything is run
        found = np.full((len(_FIELDS), len(names), self.sets, len(self.deadlines)), np.nan)
        jobs = [
            (number, k)
            for number, k in product(range(self.sets), range(len(names)))
            if names[k] not in self.ahead or number < self.ahead_sets
        ]
        with (
            Journal(journal, self._make_key(antenna), of="contest") as kept,
            show_progress(progress, "policies and sets") as advance,
        ):
            for done, (number, k) in enumerate(jobs, start=1):
                name, copies = names[k], self._count_copies(names[k])
                measure = partial(self._measure, antenna, name, number)
                found[:, k, number] = kept.get_or(
                    measure, name, number, copies, _describe_own(name)
                )
                advance(done, len(jobs))
        return xr.Dataset(
            {
                field: (("policy", "set", "deadline"), values)
                for field, values in zip(_FIELDS, found, strict=True)
            },
            {"policy": names, "deadline": list(self.deadlines)},
            {"antenna": antenna.name},
        )

    def _make_key(self, antenna: Antenna) -> str:
        """What all results of a journal follow from; names of results say the rest."""
        task = self.make_task(antenna, 0)
        shared = ("known", "seed", "duration", "period", "deadlines")
        made_with = {name: getattr(self, name) for name in shared}
        made_with |= {"antenna": antenna, "noise": str(task.noise)}
        return make_key(made_with)

    def _count_copies(self, name: str) -> int:
        return self.ahead_copies if name in self.ahead else self.copies

    def _measure(self, antenna: Antenna, name: str, number: int) -> list[np.ndarray]:
        """Accuracy, hits and work [µJ] at each deadline, of one policy on one set."""
        observer = self.make_observer(antenna, number)
        episodes = observer.run(parse_policy(name), self._count_copies(name))
        rows = [round(deadline / self.period) for deadline in self.deadlines]
        columns = (episodes.accuracy, episodes.hits, episodes.work.mean(axis=1))
        return [column[rows] for column in columns]


def _describe_own(policy: str) -> str:
    """What the code of a policy from outside says now: another text, another result."""
    name = policy.partition(":")[0]
    if name.endswith(".py"):
        return compute_digest(Path(name).read_text(encoding="utf-8"))[:16]
    return ""


def load_contest(**changes: Any) -> Contest:
    """The choices of contests.toml, less what ``changes`` replace."""
    return Contest(**read_shipped("feeler.active", "contests.toml") | changes)


@checked
def judge_steering(measured: xr.Dataset, comparison: Contest) -> xr.Dataset:
    """Does steering pay? By deadline, the best fixed and the best steered policy, chosen on sets of
    even number and judged on the others.

    Returns
    -------
    xarray.Dataset
        ``fixed`` and ``steered`` (names), ``fixed_accuracy``, ``steered_accuracy`` [%], their
        ``gain`` ± ``half`` [points] with its 95 % interval over sets, and ``pays`` (deadline,).
    """
    held = np.arange(measured.sizes["set"]) % 2 == 1
    if not held.any():
        raise InvalidInput(
            "to judge, at least two sets are needed: one to choose on and one to judge on."
        )
    chosen, judged = measured.isel(set=~held)["accuracy"], measured.isel(set=held)["accuracy"]
    names = {
        kind: [name for name in measured["policy"].values if name in listed]
        for kind, listed in (
            ("fixed", comparison.fixed),
            ("steered", (*comparison.steered, *comparison.ahead)),
        )
    }
    if not all(names.values()):
        raise InvalidInput(
            "to judge, both fixed and steered policies of the comparison must have been run."
        )
    columns: dict[str, list[Any]] = {"fixed": [], "steered": []}
    values, found = [], []
    for deadline in measured["deadline"].values:
        pair: list[xr.DataArray] = []
        for kind, some in names.items():
            mean = chosen.sel(policy=some, deadline=deadline).mean("set")
            best = some[int(np.argmax(mean.values))]
            columns[kind].append(best)
            pair.append(judged.sel(policy=best, deadline=deadline, drop=True))
        both = xr.concat(pair, "kind").dropna("set")
        values.append([100 * float(both[0].mean()), 100 * float(both[1].mean())])
        found.append(average_sets(100 * (both[1] - both[0])))
    gain, half = (np.array([float(one[name]) for one in found]) for name in ("mean", "half"))
    data = {
        **columns,
        "fixed_accuracy": [row[0] for row in values],
        "steered_accuracy": [row[1] for row in values],
        "gain": gain,
        "half": half,
        "pays": (gain >= comparison.gain) & (gain - half > 0),
    }
    return xr.Dataset(
        {name: ("deadline", value) for name, value in data.items()},
        {"deadline": measured["deadline"].values},
    )


@checked
def confirm_steering(measured: xr.Dataset, verdict: xr.Dataset, first: int) -> xr.Dataset:
    """The policies that :func:`judge_steering` chose, on sets from number ``first`` on: nothing is
    chosen anew.

    Returns
    -------
    xarray.Dataset
        ``fixed_accuracy``, ``steered_accuracy`` [%] and their ``gain`` ± ``half`` [points], its 95
        % interval over sets, by deadline.
    """
    if not 0 <= first < measured.sizes["set"] - 1:
        raise InvalidInput(
            f"at least two sets from number {first} on are needed, got {measured.sizes['set']} in"
            " all."
        )
    fresh = 100 * measured["accuracy"].isel(set=slice(first, None))
    own = {
        kind: (
            fresh.sel(policy=verdict[kind].astype(str), deadline=verdict["deadline"]).drop_vars(
                "policy"
            )
        )
        for kind in ("fixed", "steered")
    }
    gains = average_sets(own["steered"] - own["fixed"])
    return xr.Dataset(
        {f"{kind}_accuracy": found.mean("set") for kind, found in own.items()}
        | {"gain": gains["mean"], "half": gains["half"]}
    )


CONTEST_LEAD = (
    "Which of six objects is it? A body moves its antenna towards one of thirty touches, all of"
    " them known to an ideal observer that also knows what its own body did, so that its answers"
    " are Bayes' own. Time is counted from the beginning, the way to the object included. Intervals"
    " are 95 % over sets of touches that were resampled."
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
    section.text(CONTEST_LEAD)
    mean = 100 * measured["accuracy"].mean("set")
    best = ", ".join(
        f"{one.idxmax('policy').values!s} at {float(one['deadline']):g} ms"
        f" ({float(one.max()):.0f} %)"
        for one in (mean.sel(deadline=d) for d in mean["deadline"].values)
    )
    return write_page(
        out / "active.html",
        "Policies of active touch",
        f"Most accurate of {mean.sizes['policy']} policies at each deadline: {best}.",
        section,
    )


def fill_comparison(section: Section, measured: xr.Dataset, comparison: Contest) -> None:
    """The figure, the verdict, the tables."""
    section.figure(
        "active",
        "Left: how often the ideal observer names the object right, by the deadline; a line for"
        " each policy. Right: the same at the second deadline, against the work on the antenna"
        " until then. A policy is a rule for moving: fixed:0.6 keeps 0.6 m/s; fast-then-slow:1.2,"
        "0.3,10 slows down from 1.2 to 0.3 m/s 10 ms after the beginning, slow-after-contact:1.2,"
        "0.3 as soon as contact is probable. Bars: 95 % over sets, cut at 0 and 100 %.",
        lambda figure: _plot_comparison(measured, comparison, figure),
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


def _say_verdict(one: xr.Dataset) -> list[Any]:
    """Both policies, their accuracies, the gain with its interval, and whether steering pays."""
    columns = ("fixed", "fixed_accuracy", "steered", "steered_accuracy", "gain")
    cells = [one[column].values.item() for column in columns]
    if not np.isfinite(one["half"]):
        return [*cells, "one set", "cannot be said"]
    return [*cells, float(one["half"]), "yes" if one["pays"] else "no"]


def _say(found: xr.Dataset, name: str, deadline: float) -> str:
    one = found.sel(policy=name, deadline=deadline)
    mean, half = float(one["mean"]), float(one["half"])
    return f"{mean:.1f} ± {half:.1f}" if np.isfinite(half) else f"{mean:.1f}"


def _plot_comparison(measured: xr.Dataset, comparison: Contest, figure: Figure) -> None:
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
