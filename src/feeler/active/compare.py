"""Compare policies: what an ideal observer knows by each deadline, and what the way there costs,
over sets of touches.
"""

import json
import os
from collections.abc import Callable, Mapping, Sequence
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from feeler.active.declared import Contest
from feeler.active.observer import Episodes, Observer, Policy
from feeler.active.policies import parse_policy
from feeler.antenna.antenna import Antenna
from feeler.checked import checked
from feeler.errors import InvalidInput
from feeler.experiment.job import fingerprint_code
from feeler.provenance import compute_digest
from feeler.studies.tradeoff import average_sets

BEGINNING = b'{"key": "'
CODE = (
    "feeler.active.observer",
    "feeler.active.policies",
    "feeler.active.learned",
)  # what a journal's numbers follow from


@checked
def compare_policies(
    antenna: Antenna,
    comparison: Contest,
    policies: Sequence[str] | None = None,
    *,
    own: Mapping[str, Policy] | None = None,
    journal: Path | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> xr.Dataset:
    """Accuracy of an ideal observer that moves by each policy, and the work on its antenna, at
    every deadline.

    Parameters
    ----------
    policies
        As :func:`feeler.active.parse_policy` takes them; default: all that the comparison declares.
    own
        Policies of your own by name, beside these.
    journal
        File to which each policy and set is written as it finishes, and from which they are taken
        where they are there.

    Returns
    -------
    xarray.Dataset
        ``accuracy`` (the observer's own expectation, which is unbiased), ``hits`` (share named
        right) and ``work`` [µJ] by (policy, set, deadline); NaN where a policy that looks ahead was
        not run on a set.
    """
    wanted = (
        [*comparison.fixed, *comparison.steered, *comparison.ahead]
        if policies is None
        else [*policies]
    )
    known = {name: parse_policy(name) for name in wanted} | dict(own or {})
    if not known:
        raise InvalidInput("there is no policy to compare; name at least one.")
    kept, code = _read(journal), fingerprint_code(CODE) if journal is not None else ""
    jobs = [
        (name, number)
        for number, name in product(range(comparison.sets), known)
        if _counts(comparison, name, number)
    ]
    rows: dict[tuple[str, int], dict[str, list[float]]] = {}
    observer, at = None, -1
    for done, (name, number) in enumerate(jobs, start=1):
        key = json.dumps(
            [
                compute_digest(antenna)[:16],
                name,
                number,
                _describe(comparison, name),
                code,
                _digest_file(name),
            ]
        )
        if key not in kept:
            if at != number:
                task = comparison.make_task(antenna, number)
                observer, at = Observer(task, period=comparison.period, random_state=number), number
            assert observer is not None
            copies = comparison.ahead_copies if name in comparison.ahead else comparison.copies
            policy = known[name] if own and name in own else parse_policy(name)
            kept[key] = _summarise(observer.run(policy, copies), comparison)
            if journal is not None and not (own and name in own):
                with journal.open("a", encoding="utf-8") as file:
                    file.write(json.dumps({"key": key, "value": kept[key]}) + "\n")
        rows[name, number] = kept[key]
        if progress:
            progress(done, len(jobs))
    nothing = {
        field: [np.nan] * len(comparison.deadlines) for field in ("accuracy", "hits", "work")
    }
    fields = {
        field: np.array(
            [[rows.get((n, s), nothing)[field] for s in range(comparison.sets)] for n in known]
        )
        for field in nothing
    }
    dims = ("policy", "set", "deadline")
    coords = {"policy": list(known), "deadline": list(comparison.deadlines)}
    return xr.Dataset(
        {field: (dims, values) for field, values in fields.items()},
        coords,
        {"antenna": antenna.name},
    )


def _counts(comparison: Contest, name: str, number: int) -> bool:
    return name not in comparison.ahead or number < comparison.ahead_sets


def _describe(comparison: Contest, name: str) -> list[Any]:
    """What one result depends on."""
    copies = comparison.ahead_copies if name in comparison.ahead else comparison.copies
    shared = ("known", "seed", "noise", "duration", "period", "deadlines")
    return [copies, *(getattr(comparison, field) for field in shared)]


def _digest_file(name: str) -> str:
    """What a policy of one's own says now: another text, another result."""
    path = Path(name.partition(":")[0])
    return (
        compute_digest(path.read_text(encoding="utf-8"))[:16]
        if path.suffix == ".py" and path.is_file()
        else ""
    )


def _read(journal: Path | None) -> dict[str, dict[str, list[float]]]:
    """What a journal holds, by key; a last line that was cut while it was written is taken off."""
    if journal is None or not journal.exists():
        return {}
    raw = journal.read_bytes()
    whole = raw.rfind(b"\n") + 1
    try:
        entries = [json.loads(line) for line in raw[:whole].splitlines()]
        found = {entry["key"]: entry["value"] for entry in entries}
        if not raw[whole:].startswith(BEGINNING[: len(raw) - whole]):
            raise ValueError("its last line is none of a journal")
    except (ValueError, KeyError, TypeError) as error:
        raise InvalidInput(
            f"{journal} is no journal of policies ({error}). Name another; this file is left as"
            " it is."
        ) from error
    os.truncate(journal, whole)
    return found


def _summarise(episodes: Episodes, comparison: Contest) -> dict[str, list[float]]:
    rows = [round(deadline / comparison.period) for deadline in comparison.deadlines]
    work = episodes.work.mean(axis=1)
    return {
        "accuracy": episodes.accuracy[rows].tolist(),
        "hits": episodes.hits[rows].tolist(),
        "work": work[rows].tolist(),
    }


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


@checked
def judge_learned(learned: xr.Dataset, measured: xr.Dataset, comparison: Contest) -> xr.Dataset:
    """What learning gains over the policies that :func:`judge_steering` chose, on the sets it
    judges on.

    Parameters
    ----------
    learned
        ``accuracy`` (seed, set, deadline), the numbers of the sets being its coordinate ``set``.

    Returns
    -------
    xarray.Dataset
        ``learned`` [%], the mean over seeds, ``least`` and ``most`` being the extremes;
        ``fixed_gain`` ± ``fixed_half`` and ``steered_gain`` ± ``steered_half`` [points] over the
        best fixed and the best steered policy (deadline,).
    """
    verdict, accuracy = judge_steering(measured, comparison), 100 * learned["accuracy"]
    seeds = accuracy.mean("set")
    data = {"learned": seeds.mean("seed"), "least": seeds.min("seed"), "most": seeds.max("seed")}
    for kind in ("fixed", "steered"):
        best = xr.DataArray([str(name) for name in verdict[kind].values], dims="deadline")
        other = 100 * measured["accuracy"].sel(policy=best, deadline=measured["deadline"]).isel(
            set=learned["set"].values
        )
        gains = average_sets(accuracy.mean("seed").drop_vars("set") - other.drop_vars("policy"))
        data |= {f"{kind}_gain": gains["mean"], f"{kind}_half": gains["half"]}
    return xr.Dataset(data)


@checked
def judge_energy(measured: xr.Dataset, comparison: Contest) -> list[list[Any]]:
    """For each deadline [ms] and budget of work [µJ]: the best fixed and the best steered policy
    that keep to it, in %.
    """
    rows = []
    for deadline, budget in product(measured["deadline"].values, comparison.budgets):
        one = measured.sel(deadline=deadline)
        mean, work = 100 * one["accuracy"].mean("set"), one["work"].mean("set")
        row: list[Any] = [float(deadline), budget]
        for listed in (comparison.fixed, (*comparison.steered, *comparison.ahead)):
            names = [str(name) for name in measured["policy"].values if name in listed]
            right = {
                name: float(mean.sel(policy=name))
                for name in names
                if float(work.sel(policy=name)) <= budget
            }
            best = max(right, key=right.__getitem__, default="none")
            row += [best, right.get(best, np.nan)]
        rows.append(row)
    return rows
