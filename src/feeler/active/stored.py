"""What benchmarks/active.py measured, kept with the package because it takes too long to be made
with every report.
"""

import json
from importlib.resources import files
from typing import Any

import xarray as xr

from feeler.active.declared import Contest
from feeler.errors import InvalidInput

FILE = "measured.json"


def load_stored(comparison: Contest) -> dict[str, Any]:
    """The stored results: ``measured`` and ``learned`` as Datasets, and what else there is, as
    plain data.

    Raises
    ------
    InvalidInput
        They were made with other choices than are declared now.
    """
    found = json.loads(files("feeler.active").joinpath(FILE).read_text(encoding="utf-8"))
    for name in ("sets", "known", "copies", "seed", "noise", "duration", "period"):
        if found["declared"][name] != getattr(comparison, name):
            raise InvalidInput(
                f"the stored results were made with {name} {found['declared'][name]}, declared is"
                f" {getattr(comparison, name)}. Run: python benchmarks/active.py compare write"
            )
    datasets = {
        name: xr.Dataset.from_dict(found[name]) for name in ("measured", "learned") if name in found
    }
    return found | {
        name: one.map(lambda values: values.astype(float)) for name, one in datasets.items()
    }  # null is NaN
