"""The cached run: sections of a whole run at paper scale, in kept/. They are shown where a run does
not compute them, or not yet.
"""

import json
import shutil
from collections.abc import Iterable
from dataclasses import replace
from datetime import date
from pathlib import Path

from PIL import Image

from feeler.report import MARKER, Section
from paper.cache import Stage
from paper.context import KEYED, Context
from paper.report import OPENING_MOVIE
from paper.table import RESULTS, Results

SHIPPED = Path(__file__).parent / "kept"
_SCALE = "paper"
KEPT_LABEL = "kept.json"
_WIDTH, _QUALITY = 1400, 72  # of a kept picture: enough to read at the width of a page


def find_shipped(stage: Stage, context: Context, folder: Path = SHIPPED) -> Section | None:
    """The kept section of a stage, labelled as such; None where this run asks something else."""
    path = folder / stage.name
    reads = [name for name in stage.reads if name in KEYED and name != "scale"]
    same = context.describe(reads) == Context(scale=context.scale).describe(reads)
    if not (same and context.is_cockroach and (path / MARKER).exists()):
        return None
    label = json.loads((path / KEPT_LABEL).read_text())
    words = (
        f"Precomputed at {_SCALE} scale on {label['date']} (seed {label['seed']},"
        f" {label['seconds']} s)."
    )
    if label["key"] != stage.key(replace(context, scale=_SCALE)):
        words += " Its settings or the physics have changed since."
    return replace(Section.load(path), kept=words, scale=_SCALE)


def keep_sections(
    sections: Iterable[tuple[Stage, Section]], context: Context, folder: Path = SHIPPED
) -> None:
    """Keep these sections of a run, with the day, the seed and the key of what they were made with.

    Pictures become small, a movie its still, but the first screen's stays a movie; their numbers
    stay with the run that made them. The folder's table of results is that of all its sections.
    """
    for stage, section in sections:
        shutil.rmtree(target := folder / stage.name, ignore_errors=True)
        target.mkdir(parents=True)
        blocks = [_keep_block(block, section.folder, target) for block in section.blocks]
        replace(section, folder=target, blocks=blocks, vector=False).save()
        label = {
            "date": date.today().isoformat(),
            "seed": context.seed,
            "seconds": round(section.seconds),
            "key": stage.key(context),
        }
        (target / KEPT_LABEL).write_text(json.dumps(label, sort_keys=True) + "\n")
    write_table(folder)


def write_table(folder: Path = SHIPPED) -> None:
    """Write the table of the cached run, of which README's and the docs' numbers are views."""
    found = (Section.load(path.parent) for path in sorted(folder.glob(f"*/{MARKER}")))
    Results.collect(found).write(folder / RESULTS)


def _keep_block(block: dict[str, object], source: Path, target: Path) -> dict[str, object]:
    if block.get("name") == OPENING_MOVIE:
        for name in (block["name"], block["still"]):
            shutil.copy(source / str(name), target)
        return block
    name = {"figure": f"{block.get('name')}.png", "movie": block.get("still")}.get(
        str(block["kind"])
    )
    if not name:
        return block
    picture = Image.open(source / str(name)).convert("RGB")
    picture.thumbnail((_WIDTH, 10 * _WIDTH))
    file = f"{Path(str(name)).stem}.webp"
    picture.save(target / file, quality=_QUALITY, method=6)
    size = block.get("size") or [picture.width // 2, picture.height // 2]
    shown = {key: block[key] for key in ("name", "caption") if key in block}
    return {"kind": "figure", "size": size, "hover": [], "file": file} | shown
