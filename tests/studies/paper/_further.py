"""What the smoke run leaves out, at the same size: sections of a scale of its own, kept as text.

``make golden`` keeps a meant change anew and prints what has changed, for review.
"""

import sys
from pathlib import Path
from tempfile import TemporaryDirectory

from feeler.report import Section
from feeler.studies.paper.context import Context
from feeler.studies.paper.reproduce import STAGES
from feeler.studies.paper.stage import run_stage
from feeler.studies.scale import SCALES
from tests import golden

from . import _golden

KEPT = Path(__file__).with_name("golden_further.txt")
SECTIONS = ("wall", "encoding", "robot", "calibration")
"""Those that are longer at other scales."""
LONGER = {
    "impact_speeds": (0.2, 0.6),
    "far_slides": 1,
    "followers": 1,
    "durations": (10, 40),
    "gaps": (0.0, 1.0),
    "variants": (2,),
    "shots": (0, 1),
    "shot_robots": 1,
    "robot_repeats": 1,
}
"""What smoke sets to nothing."""
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


def write_golden() -> list[str]:
    """The lines of these sections."""
    if "further" not in SCALES:
        SCALES.register("further", SCALES["smoke"].replace(name="further", **LONGER))
    with TemporaryDirectory() as folder:
        context = Context(scale="further", out=Path(folder), workers=1)
        stages = [stage for stage in STAGES if stage.name in SECTIONS]
        with golden.drawing(figures := {}):
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
