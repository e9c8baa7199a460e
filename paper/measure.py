"""Time of ``feeler reproduce`` by stage, and its verdicts: benchmarks/results/reproduce.json; at
paper scale its sections are kept in paper/kept, with their table of results.

    python -m paper.measure smoke quick        # paper needs the extra cnn
"""

import json
import os
import subprocess
import sys
import time
from pathlib import Path
from tempfile import TemporaryDirectory

from benchmarks.kept import write_kept
from paper.cache import find_kept
from paper.context import Context
from paper.kept import keep_sections
from paper.reproduce import STAGES

RESULTS = Path(__file__).parents[1] / "benchmarks" / "results" / "reproduce.json"


def run(
    scale: str, out: Path, *options: str
) -> tuple[float, list[dict], dict[str, dict[str, int]]]:
    """Seconds of one run as a user waits for them, its stages, and how many statements (paper,
    ours) got which verdict.
    """
    command = [
        sys.executable,
        "-m",
        "paper",
        "--scale",
        scale,
        "--out",
        str(out),
        "--log-json",
        *options,
    ]
    start = time.perf_counter()
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    seconds = time.perf_counter() - start
    events = [json.loads(line) for line in done.stderr.splitlines() if line.startswith("{")]
    counts = next(event["verdicts"] for event in events if event["event"] == "report")
    print(scale, *options, f"{seconds:.1f} s;", counts)
    return (
        seconds,
        [
            event
            for event in events
            if event["event"] == "stage" and event["seconds"] is not None
        ],
        counts,
    )


def measure(scale: str) -> dict[str, object]:
    """Warm run, second run from the cache, seconds of each stage, verdicts."""
    with TemporaryDirectory() as folder:
        out = Path(folder)
        first, stages, verdicts = run(scale, out, "--fresh")
        second, *_ = run(scale, out)
        if scale == "paper":
            _keep(out)
    return {
        "seconds": round(first, 1),
        "seconds_cached": round(second, 1),
        "cores": os.cpu_count(),
        "verdicts": verdicts,
        "stages": {stage["title"]: stage["seconds"] for stage in stages},
    }


def _keep(out: Path) -> None:
    """Ship the sections of this run, which runs at other scales show."""
    context = Context(scale="paper", out=out)
    found = ((stage, find_kept(stage, context)) for stage in STAGES)
    keep_sections(((stage, section) for stage, section in found if section), context)


def main() -> None:
    run("quick", Path(TemporaryDirectory().name))  # compiles, if need be
    results = json.loads(RESULTS.read_text()) if RESULTS.exists() else {}
    for scale in sys.argv[1:] or ("smoke", "quick"):
        results[scale] = measure(scale)
    write_kept(RESULTS, json.dumps(results, indent=1, sort_keys=True) + "\n")


if __name__ == "__main__":
    main()
