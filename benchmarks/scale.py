"""How touching scales: rate, memory, files and disk over the number of touches; random touches of
100 ms at 1 % accuracy.

    python benchmarks/scale.py [n …]
    python benchmarks/scale.py --cluster [n]    # two Dask processes against two plain workers, in
    turns; n of 2,600 and more python benchmarks/scale.py --read [n]       # TouchBatches from a
    warm cache; feeler info of n small made-up touches

Each n runs in a process of its own, so that its peak of memory is its own. Rates are given by the
wall clock and by processor time, as machines have other work to do. Then the finished store is
opened, resumed and read.
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

from kept import write_kept

RESULTS = Path(__file__).parent / "results" / "scale.json"
DURATION, ACCURACY = 100.0, 0.01


def measure(n: int, folder: Path) -> dict[str, float]:
    """One run of n touches into a store in ``folder``."""
    import feeler

    antenna, path = feeler.presets.cockroach(), folder / "set.zarr"
    options = {
        "duration": DURATION,
        "accuracy": ACCURACY,
        "save": ("angle",),
        "dtype": "float32",
        "load": False,
    }
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
            code = (
                f"import sys; sys.path.insert(0, {here!r}); import scale; scale.tell({n},"
                f" {str(folder)!r})"
            )
            done = subprocess.run(
                [sys.executable, "-c", code], check=True, stdout=subprocess.PIPE, text=True
            )
        finally:
            shutil.rmtree(folder)
        rows.append(json.loads(done.stdout.splitlines()[-1]))
        row = rows[-1]
        print(
            f"{n:>9,}: {row['touches_per_s']:.0f}/s ({row['touches_per_cpu_s']:.0f} per processor"
            f" second), {row['peak_MB']:.0f} MB, {row['files']} files, {row['MB']:.0f} MB on disk,"
            f" open {row['open_s']:.2f} s, resume {row['resume_s']:.1f} s",
            flush=True,
        )
        write_kept(RESULTS, json.dumps(rows, indent=1))


def compare_cluster(n: int, rounds: int = 2) -> dict[str, float]:
    """The same n touches into new stores by two Dask processes, two threads and two processes of
    ours, in turns.

    A Dask cluster that is as good has efficiency 1: the wall time of the best plain workers over
    its own. Where the machine has other work to do, look at processor time.
    """
    from dask.distributed import Client, LocalCluster

    import feeler
    from feeler.execute import ProcessExecutor, ThreadExecutor

    antenna, trials = feeler.presets.cockroach(), feeler.sample_trials(n)
    options = {
        "duration": DURATION,
        "accuracy": ACCURACY,
        "save": ("angle",),
        "dtype": "float32",
        "load": False,
    }
    walls: dict[str, list[float]] = {}
    two = {"n_workers": 2, "threads_per_worker": 1, "dashboard_address": None}
    with (
        ProcessExecutor(2) as processes,
        ThreadExecutor(2) as threads,
        LocalCluster(**two) as cluster,
        Client(cluster) as client,
    ):
        executors = {"cluster": client, "threads": threads, "processes": processes}
        for executor in executors.values():  # compiles, imports
            feeler.touch(
                antenna, trials[:16], executor=executor, **{**options, "duration": 5.0}
            )
        for _ in range(rounds):
            for name, executor in executors.items():
                folder = Path(tempfile.mkdtemp(dir=os.environ.get("FEELER_SCALE_DIR")))
                began, cpu = (
                    time.perf_counter(),
                    sum(client.run(time.process_time).values()) + time.process_time(),
                )
                feeler.touch(
                    antenna, trials, store=folder / "set.zarr", executor=executor, **options
                )
                walls.setdefault(f"{name}_s", []).append(time.perf_counter() - began)
                spent = sum(client.run(time.process_time).values()) + time.process_time() - cpu
                walls.setdefault(f"{name}_cpu_s", []).append(spent)
                group = json.loads((folder / "set.zarr/progress/store.json").read_text())[
                    "group"
                ]
                shutil.rmtree(folder)
    found: dict[str, float] = {name: min(values) for name, values in walls.items()}
    found |= {
        "n": n,
        "load": os.getloadavg()[0],
        "group_s": 2 * found["cluster_s"] / (n / group),
    }
    found["efficiency"] = min(found["threads_s"], found["processes_s"]) / found["cluster_s"]
    found["efficiency_cpu"] = found["threads_cpu_s"] / found["cluster_cpu_s"]
    return found


def measure_reading(n: int) -> dict[str, float]:
    """Touches of 56 × 100 that a training set hands out per second of processor time, and what
    opening n touches takes.
    """
    import torch

    from feeler.learn import TouchBatches
    from feeler.tensors.store import _save_store

    torch.set_num_threads(1)
    found: dict[str, float] = {"load": os.getloadavg()[0]}
    folder = Path(tempfile.mkdtemp(dir=os.environ.get("FEELER_SCALE_DIR")))
    try:
        _save_store(_make_touches(5_120, 56, 100), folder / "read.zarr", group_size=256)
        ways = {
            "batches": {"batch_size": 256},
            "noisy batches": {"batch_size": 256, "noise": 0.01},
            "one by one": {"batch_size": 1},
        }
        for name, options in ways.items():
            dataset = TouchBatches(folder / "read.zarr", "feature", **options)
            for _ in dataset:  # the files are in memory now
                pass
            cpu, count = time.process_time(), 0
            for tensors, _ in dataset:
                count += len(tensors)
            found[f"{name} per cpu s"] = count / (time.process_time() - cpu)
        _save_store(_make_touches(n, 2, 2), folder / "many.zarr", group_size=256)
        opening = {"info": "feeler.tensors.formats.describe_file", "load": "feeler.load"}
        for name, function in opening.items():
            found |= {
                f"{name} of {n:,} {part}": value
                for part, value in _time_alone(
                    function, folder / "many.zarr", folder / "read.zarr"
                ).items()
            }
    finally:
        shutil.rmtree(folder)
    return found


def _time_alone(function: str, path: Path, small: Path) -> dict[str, float]:
    """Wall and processor time [s] of a function of a path, in a process of its own that has opened
    a small store before.

    That one has the libraries imported (zarr, and Dask where it is installed, which xarray then
    loads): 0.9 s, whatever n.
    """
    code = (
        f"import time, feeler, feeler.tensors.formats; work = {function}; work({str(small)!r});"
        "wall, cpu = time.perf_counter(), time.process_time();"
        f"work({str(path)!r}); print(time.perf_counter() - wall, time.process_time() - cpu)"
    )
    wall, cpu = subprocess.check_output([sys.executable, "-c", code], text=True).split()
    return {"s": float(wall), "cpu_s": float(cpu)}


def _make_touches(n: int, sensors: int, samples: int):
    """Made-up touches: swinging sensors, as hard to compress as simulated ones."""
    import numpy as np

    from feeler.tensors import make_tensors

    rng = np.random.default_rng(0)
    size, phase = 0.2 * rng.standard_normal((n, sensors, 1)), rng.uniform(0, 6, (n, sensors, 1))
    trials = {
        "feature": [("ball", "box", "triangle")[k % 3] for k in range(n)],
        "size": rng.uniform(1, 3, n),
        "location": rng.uniform(0.4, 0.9, n),
        "speed": rng.uniform(0.06, 0.6, n),
        "antenna": ["exponential"] * n,
        "source": ["simulation"] * n,
        "seed": range(n),
    }
    place = {
        "segment": range(1, sensors + 1),
        "position": np.arange(sensors) / sensors,
        "segment_length": np.ones(sensors),
    }
    angle = (size * np.sin(np.arange(samples) / 20 + phase)).astype("f4")
    made = make_tensors(
        time=np.arange(float(samples)), angle=angle, trials=trials, dtype="float32", **place
    )
    return made.drop_vars("curvature")


def tell(n: int, folder: str) -> None:
    """What :func:`measure` found, as a line of JSON."""
    print(json.dumps(measure(n, Path(folder))))


if __name__ == "__main__":
    modes = {"--cluster": (compare_cluster, 2_600), "--read": (measure_reading, 1_000_000)}
    if sys.argv[1:2] and sys.argv[1] in modes:
        work, usual = modes[sys.argv[1]]
        for name, value in work(int(sys.argv[2]) if sys.argv[2:] else usual).items():
            print(f"{name:24} {value:,.3g}")
    else:
        main([int(n) for n in sys.argv[1:]] or [100, 1_000, 10_000])
