"""Cached results: each says when it was made, and under which version of feeler and its physics.

python benchmarks/kept.py        lists them, and names those that are stale
"""

import json
import sys
from datetime import date
from pathlib import Path
from typing import Any

from feeler.provenance import PHYSICS, name_release

ROOT = Path(__file__).parents[1]
STAMPS = ROOT / "benchmarks" / "results" / "made.json"
SHIPPED = ROOT / "paper" / "kept"


def write_kept(path: Path, text: str) -> None:
    """Write a result of the script that runs, and note when and with which code it was made."""
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text, encoding="utf-8")
    note_kept(path)


def note_kept(path: Path) -> None:
    """Note when, and under which versions, the script that runs has written this file."""
    stamps = read_stamps()
    stamps[path.resolve().relative_to(ROOT).as_posix()] = {
        "date": date.today().isoformat(),
        "script": Path(sys.argv[0]).resolve().relative_to(ROOT).as_posix(),
        "feeler": name_release(),
        "physics": PHYSICS,
    }
    STAMPS.write_text(json.dumps(stamps, indent=1, sort_keys=True) + "\n")


def read_stamps() -> dict[str, dict[str, Any]]:
    """What is noted of each result, by its path from the root of the repository."""
    return json.loads(STAMPS.read_text()) if STAMPS.exists() else {}


def describe(path: Path, stamp: dict[str, Any] | None) -> str:
    """One line about a result."""
    name = path.relative_to(ROOT).as_posix()
    if stamp is None:
        return f"{name}: nothing is noted of what made it; run its script again"
    same = (stamp["feeler"], stamp["physics"]) == (name_release(), PHYSICS)
    words = "current" if same else f"stale; run {stamp['script']} again"
    return f"{name}: {stamp['date']}, {words}"


def list_sections() -> list[str]:
    """The same about the cached sections of the report."""
    from paper.context import Context
    from paper.reproduce import STAGES

    lines, context = [], Context(scale="paper")
    for stage in STAGES:
        if (label := SHIPPED / stage.name / "kept.json").exists():
            found = json.loads(label.read_text())
            words = "current" if found["key"] == stage.key(context) else "stale"
            lines.append(f"section {stage.name}: {found['date']}, {words}")
    return lines


def main() -> None:
    stamps = read_stamps()
    results = sorted({*STAMPS.parent.glob("*.json"), *map(ROOT.joinpath, stamps)} - {STAMPS})
    for path in results:
        print(describe(path, stamps.get(path.relative_to(ROOT).as_posix())))
    print("\n".join(list_sections()))


if __name__ == "__main__":
    main()
