"""What the contest found, as benchmarks/active.py keeps it."""

from typing import Any

import xarray as xr

from feeler.errors import InvalidInput
from feeler.studies.contests.contest import Contest
from feeler.studies.shipped import read_shipped


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
    found = read_shipped("contests", "measured.json")
    for name in ("sets", "known", "copies", "seed", "noise", "duration", "period"):
        if found["declared"][name] != getattr(contest, name):
            raise InvalidInput(
                f"the stored results were made with {name} {found['declared'][name]}, declared is"
                f" {getattr(contest, name)}. Run: python benchmarks/active.py compare write"
            )
    for name in {"measured", "learned"} & {*found}:
        found[name] = xr.Dataset.from_dict(found[name]).map(
            lambda v: v.astype(float)
        )  # null is NaN
    return found
