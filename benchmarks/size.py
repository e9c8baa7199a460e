"""How large the house is: statements, nouns and files by room, and how that has gone.

  make size

Statements are nodes of Python's syntax tree, which no formatting hides. The totals of each version
and day are kept in ``benchmarks/results/size.json``.
"""

import ast
import json
import subprocess
import sys
from collections import Counter
from collections.abc import Iterator
from datetime import date
from importlib.metadata import version
from pathlib import Path

ROOT = Path(__file__).parents[1]
SOURCE = ROOT / "src" / "feeler"
RESULTS = Path(__file__).parent / "results" / "size.json"
GOALS = {"statements": 23_500, "classes": 180, "public": 850, "line": 44, "touch": 25}
TOUCH = """
import sys
import feeler
seen = set()
def note(frame, event, arg):
    seen.add(frame.f_code.co_filename)
antenna = feeler.presets.cockroach()
trial = feeler.Trial(feature=feeler.Ball(radius=1.5), location=0.5, speed=0.3)
feeler.touch(antenna, trial, duration=5, workers=1)
sys.setprofile(note)
feeler.touch(antenna, trial, duration=5, workers=1)
sys.setprofile(None)
print(sum(name.startswith(sys.argv[1]) for name in seen))
"""


def find_room(path: Path) -> str:
    """The folder in which a file lies; the ground where it lies in none."""
    first, *rest = path.relative_to(SOURCE).parts
    return first if rest else "ground"


def count_file(path: Path) -> Counter[str]:
    """Statements, classes, public definitions, code lines and their characters."""
    tree = ast.parse(path.read_text(encoding="utf-8"))
    kinds = ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef
    lines = [line for line in path.read_text(encoding="utf-8").splitlines() if line.strip()]
    code = [line for line in lines if not line.strip().startswith("#")]
    return Counter(
        files=1,
        statements=sum(isinstance(node, ast.stmt) for node in ast.walk(tree)),
        classes=sum(isinstance(node, ast.ClassDef) for node in ast.walk(tree)),
        public=sum(isinstance(n, kinds) and not n.name.startswith("_") for n in tree.body),
        lines=len(code),
        characters=sum(map(len, code)),
    )


def count_touch() -> int:
    """Files of feeler that one ``feeler.touch`` passes."""
    command = [sys.executable, "-c", TOUCH, str(SOURCE)]
    return int(subprocess.run(command, capture_output=True, text=True, check=True).stdout)


def list_rows(rooms: dict[str, Counter[str]]) -> Iterator[str]:
    """The table, largest room first."""
    yield f"{'room':14}{'files':>7}{'statements':>12}{'classes':>9}{'public':>8}{'line':>7}"
    for room, found in sorted(rooms.items(), key=lambda item: -item[1]["statements"]):
        line = found["characters"] / max(1, found["lines"])
        counts = f"{found['statements']:12}{found['classes']:9}{found['public']:8}"
        yield f"{room:14}{found['files']:7}{counts}{line:7.1f}"


def main() -> None:
    """Count, show, and keep the totals."""
    rooms: dict[str, Counter[str]] = {}
    for path in sorted(SOURCE.rglob("*.py")):
        rooms.setdefault(find_room(path), Counter()).update(count_file(path))
    total = sum(rooms.values(), Counter())
    now = {key: total[key] for key in ("files", "statements", "classes", "public")}
    now["line"] = round(total["characters"] / total["lines"], 1)
    now["touch"] = count_touch()
    kept = json.loads(RESULTS.read_text()) if RESULTS.exists() else {}
    kept[f"{version('feeler')} {date.today().isoformat()}"] = now
    RESULTS.write_text(json.dumps(kept, indent=1) + "\n")
    print("\n".join(list_rows(rooms)), "\n")
    print(f"{'':22}" + "".join(f"{key:>12}" for key in now))
    for name, values in [*kept.items(), ("goal, at most", GOALS)]:
        print(f"{name:22}" + "".join(f"{values.get(key, ''):>12}" for key in now))


if __name__ == "__main__":
    main()
