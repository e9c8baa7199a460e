"""The kept run: sections of a whole run at paper scale that ship with feeler, shown where a run
does not compute them, or not yet.
"""

import json
from dataclasses import replace
from importlib.resources import files
from pathlib import Path

from feeler.provenance import compute_digest, describe_code
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
    if label["code"] != fingerprint(stage):
        words += " The code that made it has changed since."
    return replace(Section.load(path), kept=words, scale=_SCALE)


def fingerprint(stage: Stage) -> str:
    """Of the code that makes a stage's section and of the data files that it reads, whatever
    versions of packages it runs with.
    """
    code = describe_code(*stage.modules)
    own = {name: d for name, d in code.items() if name.startswith("feeler") or "/" in name}
    return compute_digest(own)[:16]
