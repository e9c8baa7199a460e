"""Keep sections of a run at paper scale: they ship with feeler, which shows them where a run does
not compute them.
"""

import json
import shutil
from collections.abc import Iterable
from dataclasses import replace
from datetime import date
from pathlib import Path

from PIL import Image

from feeler.report.page import Section
from feeler.studies.paper.context import Context
from feeler.studies.paper.kept import KEPT_LABEL, SHIPPED
from feeler.studies.paper.stage import Stage
from feeler.studies.paper.story import OPENING_MOVIE

_WIDTH, _QUALITY = 1400, 72  # of a kept picture: enough to read at the width of a page


def keep_sections(
    sections: Iterable[tuple[Stage, Section]], context: Context, folder: Path = SHIPPED
) -> None:
    """Keep these sections of a run, with the day, the seed and the key of what they were made with.

    Pictures become small, a movie its still, but the first screen's stays a movie; their numbers
    stay with the run that made them.
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
    shown = {key: block[key] for key in ("name", "caption", "words") if key in block}
    return {"kind": "figure", "size": size, "hover": [], "file": file} | shown
