"""What a contest says: whether steering pays, at which work, and what learning gains."""

from itertools import product
from typing import Any

import numpy as np
import xarray as xr

from feeler.errors import InvalidInput
from feeler.studies.contests.contest import Contest
from feeler.studies.tradeoff import average_sets
from feeler.validation import checked


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
    data = {
        "learned": seeds.mean("seed"),
        "least": seeds.min("seed"),
        "most": seeds.max("seed"),
    }
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
