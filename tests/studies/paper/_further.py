"""What the smoke run leaves out, as small: every section at a scale of its own, kept as text.

``make golden`` keeps a meant change anew and prints what has changed, for review.
"""

import sys
from collections.abc import Iterable
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any
from unittest.mock import patch

import xarray as xr

from feeler.antenna.antenna import Antenna
from feeler.report import Section
from feeler.studies.paper import open_receptor
from feeler.studies.paper.context import Context
from feeler.studies.paper.open_receptor import compute_run
from feeler.studies.paper.reproduce import STAGES
from feeler.studies.paper.stage import Stage, run_stage
from feeler.studies.scale import SCALES
from tests import golden

from . import _golden

KEPT = Path(__file__).with_name("golden_further.txt")
LONGER = {
    "controls": ("linear", "constant", "matched"),
    "speeds": ("fast", "medium", "slow"),
    "control_speeds": ("fast", "slow"),
    "shapes": ("ball", "box", "triangle"),
    "movie_speeds": ("fast",),
    "fit_starts": 1,
    "control_starts": 1,
    "error_places": 3,
    "refits": 1,
    "impact_speeds": (0.2, 0.6),
    "far_slides": 1,
    "followers": 1,
    "durations": (10, 40),
    "restarts": 2,
    "side_restarts": 2,
    "sweep": {
        "ratios": (0.1, 0.3),
        "n_repeats": 2,
        "n_copies": 3,
        "other_repeats": 2,
        "other_copies": (4,),
        "before_repeats": 1,
        "before_copies": 3,
        "n_restarts": 1,
        "null_iter": 5,
        "twins": "ends",
    },
    "jitters": True,
    "choices": True,
    "network": {"ratios": (0.2,), "n_repeats": 2, "n_copies": 1, "max_epochs": 1},
    "questions": ("main",),
    "gaps": (0.0, 1.0),
    "variants": (2,),
    "shots": (0, 1),
    "shot_robots": 1,
    "robot_repeats": 1,
}
"""What smoke sets to nothing, or to one."""
SHORTER = {"sets": 3, "calibrating": 2, "draws": 10, "bends": [0.003, 0.03, 1.0]}
"""What open_receptor.toml declares, made small."""
TOLERANCES = _golden.TOLERANCES


def read_section(section: Section) -> list[str]:
    """Words, rows, captions and values; its figures are seen as they are drawn."""
    lines = [f"# {section.name}"]
    for block in section.blocks:
        told = {key: part for key, part in block.items() if key not in ("rows", "kind")}
        lines.append(f"{block['kind']} {[golden.write(part) for part in told.values()]}")
        lines += [f"| {' | '.join(map(golden.write, row))}" for row in block.get("rows", ())]
    leaves = golden.list_leaves(section.values)
    return lines + [f"{name} = {golden.write(leaf)}" for name, leaf in leaves]


def _compute(reference: Antenna, asked: dict[str, Any], **options: Any) -> xr.Dataset:
    return compute_run(reference, asked | SHORTER, **options)


def write_golden(stages: Iterable[Stage] = STAGES) -> list[str]:
    """The lines of these sections."""
    if "further" not in SCALES:
        SCALES.register("further", SCALES["smoke"].replace(name="further", **LONGER))
    with TemporaryDirectory() as folder:
        context = Context(scale="further", out=Path(folder), workers=1)
        with (
            golden.drawing(figures := {}),
            patch.object(open_receptor, "compute_run", _compute),
        ):
            lines = [
                line for stage in stages for line in read_section(run_stage(stage, context))
            ]
        lines += [f"{name}: {line}" for name, found in figures.items() for line in found]
        return [" ".join(line.replace(folder, "FOLDER").split()) for line in lines]


def main() -> None:
    """Make the sections; keep and print what has changed."""
    golden.keep(KEPT, write_golden(), TOLERANCES)


if __name__ == "__main__":
    sys.exit(main())
