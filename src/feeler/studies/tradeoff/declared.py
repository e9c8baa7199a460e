"""The study of speed against accuracy against energy, as declared.toml says."""

from typing import Any

from feeler.objects import Task
from feeler.studies.shipped import read_shipped
from feeler.studies.study import Study


def load_declared(**changes: Any) -> Study:
    """The study that was written down beforehand, less what ``changes`` replace.

    Parameters
    ----------
    **changes
        Fields of :class:`feeler.studies.study.Study` or of its task; ``seed`` of the touches.
    """
    found = read_shipped("tradeoff", "declared.toml")
    asked: dict[str, Any] = {
        name: tuple(sorted(value)) if name == "speeds" else value
        for name, value in (found | changes).items()
    }
    seed = asked.pop("seed")
    task: dict[str, Any] = {name: asked.pop(name) for name in ("speeds", "nuisances")}
    seeds = {"test": seed, "train": seed + 1_000_000}
    study = Study(
        task=Task(**task, seeds=seeds), **{n: asked.pop(n) for n in found if n in asked}
    )
    return study.replace(**asked)
