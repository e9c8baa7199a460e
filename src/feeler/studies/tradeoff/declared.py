"""The study of speed against accuracy against energy, as declared.toml says."""

import tomllib
from importlib.resources import files
from typing import Any

from feeler.studies.study import Study
from feeler.task import Task


def load_declared(**changes: Any) -> Study:
    """The study that was written down beforehand, less what ``changes`` replace.

    Parameters
    ----------
    **changes
        Fields of :class:`feeler.studies.study.Study` or of its task; ``seed`` of the touches.
    """
    text = files("feeler.studies.tradeoff").joinpath("declared.toml").read_text(encoding="utf-8")
    found = tomllib.loads(text) | changes
    seed, speeds = found.pop("seed"), found.pop("speeds")
    task = Task(
        nuisances=found.pop("nuisances"),
        speeds=tuple(sorted(speeds)),
        seeds={"test": seed, "train": seed + 1_000_000},
    )
    own = {name: value for name, value in found.items() if name in Study.__dataclass_fields__}
    rest = {name: value for name, value in found.items() if name not in own}
    return Study(task=task.replace(**rest), **own)
