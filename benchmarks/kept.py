"""Kept results: each says when it was made, and carries the fingerprint of the code that made it.

python benchmarks/kept.py        lists them, and names those whose code has changed since
"""

import hashlib
import json
import sys
from datetime import date
from pathlib import Path

from feeler import provenance as sources

ROOT = Path(__file__).parents[1]
STAMPS = ROOT / "benchmarks" / "results" / "made.json"
SHIPPED = ROOT / "src" / "feeler" / "studies" / "paper" / "kept"


def write_kept(path: Path, text: str) -> None:
    """Write a result of the script that runs, and note when and with which code it was made."""
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text, encoding="utf-8")
    note_kept(path)


def note_kept(path: Path) -> None:
    """Note when, and with which code, the script that runs has written this file."""
    script = Path(sys.argv[0]).resolve()
    stamps = read_stamps()
    stamps[path.resolve().relative_to(ROOT).as_posix()] = {
        "date": date.today().isoformat(),
        "script": script.relative_to(ROOT).as_posix(),
        "code": fingerprint(script),
    }
    STAMPS.write_text(json.dumps(stamps, indent=1, sort_keys=True) + "\n")


def read_stamps() -> dict[str, dict[str, str]]:
    """What is noted of each result, by its path from the root of the repository."""
    return json.loads(STAMPS.read_text()) if STAMPS.exists() else {}


def fingerprint(script: Path) -> str:
    """Of a script with all of feeler that it can run and the data files that this reads, but not
    what scripts keep; comments and documentation do not count.
    """
    own = sources.parse_module("script", script)
    found = sources.find_modules(
        *{home for home, _ in own.imports if home.startswith("feeler")}
    )
    digests = [own.digest, *(f"{name} {module.digest}" for name, module in found.items())]
    read = sources.find_data({"script": own, **found})
    data = sorted(path for path in read if path.suffix != ".json")
    digests += [f"{path.name} {sources.compute_hash(path.read_bytes())}" for path in data]
    return hashlib.sha256("\n".join(digests).encode()).hexdigest()[:16]


def describe(path: Path, stamp: dict[str, str] | None) -> str:
    """One line about a result."""
    name = path.relative_to(ROOT).as_posix()
    if stamp is None:
        return f"{name}: nothing is noted of the code that made it; run its script again"
    script = ROOT / stamp["script"]
    if script.exists() and fingerprint(script) == stamp["code"]:
        return f"{name}: {stamp['date']}, by today's code"
    return f"{name}: {stamp['date']}, by other code than today's; run {stamp['script']} again"


def list_sections() -> list[str]:
    """The same about the sections that ship with feeler."""
    from feeler.studies.paper.kept import fingerprint
    from feeler.studies.paper.reproduce import STAGES

    lines = []
    for stage in STAGES:
        if (label := SHIPPED / stage.name / "kept.json").exists():
            found = json.loads(label.read_text())
            same = found["code"] == fingerprint(stage)
            words = "by today's code" if same else "by other code than today's"
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
