"""How touching scales: rate, memory, files and disk over the number of touches; random touches of 100 ms at 1 % accuracy.

    python benchmarks/scale.py [n …]

Each n runs in a process of its own, so that its peak of memory is its own. Rates are given by the wall clock and by processor
time, as machines have other work to do. Then the finished store is opened, resumed and read.
"""

import json
import os
import resource
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path

RESULTS = Path(__file__).parent / "results" / "scale.json"
DURATION, ACCURACY = 100.0, 0.01


def measure(n: int, folder: Path) -> dict[str, float]:
    """One run of n touches into a store in ``folder``."""
    import feeler

    antenna, path = feeler.presets.cockroach(), folder / "set.zarr"
    options = {"duration": DURATION, "accuracy": ACCURACY, "save": ("angle",), "dtype": "float32", "load": False}
    feeler.touch(antenna, feeler.sample_trials(16), **{**options, "duration": 5.0})  # compiles
    found: dict[str, float] = {"n": n, "load_before": os.getloadavg()[0]}
    found |= _time("draw", lambda: feeler.sample_trials(n))
    trials = feeler.sample_trials(n)
    found |= _time("touch", lambda: feeler.touch(antenna, trials, store=path, **options))
    found["peak_MB"] = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e3
    found["touches_per_s"] = n / found["touch_s"]
    found["touches_per_cpu_s"] = n / found["touch_cpu_s"]
    files = [file for file in path.rglob("*") if file.is_file()]
    found["files"], found["MB"] = len(files), sum(file.stat().st_size for file in files) / 1e6
    found |= _time("open", lambda: feeler.load(path))
    found |= _time("resume", lambda: feeler.touch(antenna, trials, store=path, **options))
    found["load_after"] = os.getloadavg()[0]
    return found


def _time(name: str, work) -> dict[str, float]:
    wall, cpu = time.perf_counter(), time.process_time()
    work()
    return {f"{name}_s": time.perf_counter() - wall, f"{name}_cpu_s": time.process_time() - cpu}


def main(sizes: list[int]) -> None:
    """Every n, one line each; all numbers go to results/scale.json."""
    rows = []
    for n in sizes:
        folder = Path(tempfile.mkdtemp(dir=os.environ.get("FEELER_SCALE_DIR")))
        try:
            here = str(Path(__file__).parent)
            code = f"import sys; sys.path.insert(0, {here!r}); import scale; scale.tell({n}, {str(folder)!r})"
            done = subprocess.run([sys.executable, "-c", code], check=True, stdout=subprocess.PIPE, text=True)
        finally:
            shutil.rmtree(folder)
        rows.append(json.loads(done.stdout.splitlines()[-1]))
        row = rows[-1]
        print(
            f"{n:>9,}: {row['touches_per_s']:.0f}/s ({row['touches_per_cpu_s']:.0f} per processor second), "
            f"{row['peak_MB']:.0f} MB, "
            f"{row['files']} files, {row['MB']:.0f} MB on disk, open {row['open_s']:.2f} s, resume {row['resume_s']:.1f} s",
            flush=True,
        )
        RESULTS.write_text(json.dumps(rows, indent=1))


def tell(n: int, folder: str) -> None:
    """What :func:`measure` found, as a line of JSON."""
    print(json.dumps(measure(n, Path(folder))))


if __name__ == "__main__":
    main([int(n) for n in sys.argv[1:]] or [100, 1_000, 10_000])
