"""cosseratbench's scores as one small table: benchmarks/results/cosseratbench.json, and Markdown on
the screen.

python benchmarks/peers/table.py FOLDER
"""

import json
import sys
from pathlib import Path

KEPT = ("outcome", "missing", "failure", "n_elements", "wall_time", "metrics", "settings")


def read(folder: Path) -> list[dict]:
    """One entry per experiment and solver."""
    entries = []
    for path in sorted(folder.glob("*/default/*/result.json")):
        result = json.loads(path.read_text())
        names = {"experiment": result["experiment"], "solver": result["solver"]}
        entries.append(names | {key: result[key] for key in KEPT if result[key]})
    return entries


def main() -> None:
    entries = read(Path(sys.argv[1]))
    path = Path(__file__).parents[1] / "results" / "cosseratbench.json"
    path.write_text(json.dumps(entries, indent=1) + "\n")
    print("| experiment | solver | outcome | metrics | seconds |\n|---|---|---|---|---|")
    for entry in entries:
        outcome = "; ".join([entry["outcome"], *entry.get("missing", [])])
        metrics = ", ".join(
            f"{name} {value:.1e}" for name, value in entry.get("metrics", {}).items()
        )
        print(
            f"| {entry['experiment']} | {entry['solver']} | {outcome} | {metrics} |"
            f" {entry.get('wall_time', 0):.1f} |"
        )


if __name__ == "__main__":
    main()
