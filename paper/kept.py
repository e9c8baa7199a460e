"""The kept run: sections of a whole run at paper scale that ship with feeler, shown where a run
does not compute them, or not yet.
"""

import json
from dataclasses import replace
from importlib.resources import files
from pathlib import Path

from feeler.report.page import MARKER, Section
from feeler.studies.paper.context import KEYED, Context
from feeler.studies.paper.stage import Stage

SHIPPED = Path(str(files("feeler.studies.paper") / "kept"))
_SCALE = "paper"
KEPT_LABEL = "kept.json"


def find_shipped(stage: Stage, context: Context, folder: Path = SHIPPED) -> Section | None:
    """The kept section of a stage, labelled as such; None where this run asks something else."""
    path = folder / stage.name
    reads = [name for name in stage.reads if name in KEYED and name != "scale"]
    same = context.describe(reads) == Context(scale=context.scale).describe(reads)
    if not (same and context.is_cockroach and (path / MARKER).exists()):
        return None
    label = json.loads((path / KEPT_LABEL).read_text())
    words = (
        f"Kept from a run at {_SCALE} scale of {label['date']} (seed {label['seed']},"
        f" {label['seconds']} s)."
    )
    if label["key"] != stage.key(replace(context, scale=_SCALE)):
        words += " Its settings or the physics have changed since."
    return replace(Section.load(path), kept=words, scale=_SCALE)
