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

from feeler.active.observer import Episodes, Observer, Policy
from feeler.active.policies import parse_policy
from feeler.antenna.antenna import Antenna
from feeler.checked import checked
from feeler.errors import InvalidInput
from feeler.experiment.job import fingerprint_code
from feeler.provenance import compute_digest
from feeler.studies.contests.contest import Contest

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
