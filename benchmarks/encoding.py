"""Fit and speed of the encoder against torchnmf and seqnmf, in one run on the same tensors.

    pip install "feeler[bench]" && python benchmarks/encoding.py

Two parts. On tensors like touches all take turns at the same number of iterations. On planted ones
(benchmarks/planted.py) each encoder does what it does by default: ours several starts of one
restart each, torchnmf 200 iterations; and a fit of ours begins at the truth.

torchnmf's NMFD.sparse_fit constrains each component over all trials, so it is compared with
constraint="all"; the default, constraint="trial", is timed beside it. Ours and theirs take turns,
the best of each counts. seqnmf has no such constraint; it gets the trials in one row with silent
gaps between them.
"""

import argparse
import json
import time
import tracemalloc
import warnings
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from kept import write_kept
from planted import DEVELOPMENT, JUDGED, KINDS, STARTS, THEIR_STARTS, plant

import feeler
from feeler.encoding import ConvolutiveNMF, compute_stability
from feeler.encoding.factorise import (
    Data,
    Settings,
    factorise,
    make_generators,
    open_pool,
    start_bases,
)
from feeler.objects.trials import trials
from feeler.presets import cockroach
from feeler.tensors import rectify

N_COMPONENTS, N_LAGS, SPARSENESS = 3, 40, 0.8


read_clock = time.perf_counter


def make_tensors(
    n_trials: int, n_sensors: int = 56, n_times: int = 380, seed: int = 0
) -> np.ndarray:
    """Bumps that travel and swell along the sensors for 35, 65 or 310 ms, then ring out: (trial,
    sensor, time).
    """
    rng = np.random.default_rng(seed)
    place, time_ms = np.linspace(0, 1, n_sensors)[:, None], np.arange(n_times)[None, :]
    tensors = np.empty((n_trials, n_sensors, n_times))
    for trial, tensor in enumerate(tensors):
        lasting = (35, 65, 310)[trial % 3] * rng.uniform(1, 1.25)
        phase = np.clip((time_ms - rng.uniform(10, 13)) / lasting, 0, None)
        ringing = np.exp(-(phase - 1) * lasting / 6) * np.cos((phase - 1) * lasting / 9)
        envelope = np.where(phase < 1, phase**1.2, ringing)
        centre = rng.choice((0.5, 0.6, 0.7, 0.8, 0.9)) - 0.25 * np.minimum(phase, 1)
        tensor[:] = envelope * (
            np.exp(-0.5 * ((place - centre) / rng.uniform(0.05, 0.09)) ** 2)
        )
        tensor += 0.2 * envelope * np.exp(-0.5 * ((place - 0.1) / 0.1) ** 2)
    return np.maximum(0.15 * tensors, 0)


def fit_ours(
    tensors: np.ndarray,
    bases: np.ndarray,
    activations: np.ndarray,
    threads: int,
    **changes: object,
) -> tuple[np.ndarray, np.ndarray]:
    """(iteration, 2): seconds since the start, and the relative residual, after each iteration; and
    the bases.
    """
    model = ConvolutiveNMF(N_COMPONENTS, N_LAGS, SPARSENESS, **changes)
    curve = []
    with open_pool(threads) as run:
        start = read_clock()
        found = factorise(
            Data(tensors, N_LAGS),
            bases,
            activations,
            Settings.of(model),
            run,
            lambda iteration, residual: curve.append((read_clock() - start, residual)),
        )
    return np.array(curve), found.components


def run_ours(
    tensors: np.ndarray, constraint: str, n_iterations: int, threads: int
) -> np.ndarray:
    """The curve of a fit from random numbers, of as many iterations as asked."""
    rng = np.random.default_rng(1)
    bases = rng.random((N_COMPONENTS, tensors.shape[1], N_LAGS)) * tensors.mean()
    activations = rng.random((len(tensors), N_COMPONENTS, tensors.shape[2]))
    given = {"constraint": constraint, "max_iter": n_iterations, "tol": 0}
    return fit_ours(tensors, bases, activations, threads, **given)[0]


def touch_ninety() -> np.ndarray:
    """The paper's ninety tensors (trial, sensor, time), which have no planted truth."""
    touched = feeler.touch(cockroach(), trials(), duration=380.0)
    return rectify(touched["angle"].transpose("trial", "sensor", "time").values)


def judge(
    name: str,
    tensors: np.ndarray,
    truth: tuple[np.ndarray, np.ndarray] | None,
    seed: int,
    threads: int,
    starts: int,
    theirs: int,
) -> dict[str, object]:
    """One set: residuals of single starts of ours, of torchnmf's, and from the truth, if there is
    one.
    """
    n_trials, _, n_times = tensors.shape
    curves, found = [], []
    for rng in make_generators(seed, starts):
        begun = start_bases(tensors, N_COMPONENTS, N_LAGS, "random", rng)
        activations = rng.random((n_trials, N_COMPONENTS, n_times))
        curve, components = fit_ours(tensors, begun, activations, threads, constraint="all")
        curves.append(curve)
        found.append(components)
    peers = [run_torchnmf(tensors, 200, threads, seed) for seed in range(theirs)]
    ours = [curve[-1, 1] for curve in curves]
    row = {
        "set": name,
        "ours": ours,
        "torchnmf": [residual for _, residual in peers],
        "stability, over shifts": compute_stability(found),
        "stability, in place": compute_stability(found, shift=False),
        "seconds of ours": [curve[-1, 0] for curve in curves],
        "seconds of torchnmf": [seconds for seconds, _ in peers],
        "speed-up to torchnmf's residual": [
            [seconds / _find_when(curve, residual) for curve in curves]
            for seconds, residual in peers
        ],
    }
    if truth is not None:
        bases, activations = truth
        curve, _ = fit_ours(tensors, bases + 1e-4, activations, threads, constraint="all")
        row["from the truth"] = curve[-1, 1]
        row["best of the first three / from the truth"] = min(ours[:3]) / curve[-1, 1]
    print(json.dumps(row, default=lambda value: float(value)), flush=True)
    return row


def list_sets(seeds: tuple[int, ...]) -> Iterator[tuple[str, np.ndarray, tuple | None, int]]:
    """Name, tensors, truth and seed of each set that is judged: planted ones, and the ninety."""
    for kind in KINDS:
        for seed in seeds:
            tensors, *truth = plant(kind, seed)
            yield f"{kind} {seed}", tensors, tuple(truth), seed
    yield "the ninety touches", touch_ninety(), None, 0


def _find_when(curve: np.ndarray, residual: float) -> float:
    """Seconds to this residual; infinitely many where it is never reached."""
    reached = curve[:, 1] <= residual
    return curve[np.argmax(reached), 0] if reached.any() else np.inf


def run_torchnmf(
    tensors: np.ndarray, n_iterations: int, threads: int, seed: int = 1
) -> tuple[float, float]:
    """Seconds, and the relative residual reached."""
    import torch
    from torchnmf.nmf import NMFD

    torch.set_num_threads(threads)
    torch.manual_seed(seed)
    target = torch.tensor(tensors, dtype=torch.float32)
    net = NMFD(target.shape, rank=N_COMPONENTS, T=N_LAGS)
    start = read_clock()
    net.sparse_fit(target, beta=2, max_iter=n_iterations, sH=SPARSENESS)
    seconds = read_clock() - start
    with torch.no_grad():
        rest = net() - target
    return seconds, float(rest.norm() / target.norm())


def run_seqnmf(tensors: np.ndarray, n_iterations: int) -> float:
    """Seconds for n_iterations."""
    import seqnmf

    row = np.concatenate(
        [np.pad(tensor, ((0, 0), (0, N_LAGS - 1))) for tensor in tensors], axis=1
    )
    start = read_clock()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        seqnmf.seqnmf(
            row,
            K=N_COMPONENTS,
            L=N_LAGS,
            Lambda=0,
            max_iter=n_iterations,
            tol=-1,
            plot_it=False,
        )
    return read_clock() - start


def compare(
    n_trials: int, n_iterations: int, rounds: int, threads: int, with_seqnmf: bool
) -> dict[str, float]:
    """One row of the table."""
    tensors = make_tensors(n_trials)
    ours, trial, theirs = [], [], []
    for _ in range(rounds):
        ours.append(run_ours(tensors, "all", n_iterations, threads))
        theirs.append(run_torchnmf(tensors, n_iterations, threads))
        trial.append(run_ours(tensors, "trial", n_iterations, threads))
    seconds, residual = min(theirs)
    reached = [
        curve[np.argmax(curve[:, 1] <= residual), 0]
        for curve in ours
        if curve[-1, 1] <= residual
    ]
    row = {
        "trials": n_trials,
        "torchnmf ms/iteration": 1e3 * seconds / n_iterations,
        "ours (all) ms/iteration": 1e3 * min(np.diff(curve[:, 0]).mean() for curve in ours),
        "ours (trial) ms/iteration": 1e3 * min(np.diff(curve[:, 0]).mean() for curve in trial),
        "residual of torchnmf": residual,
        "residual of ours (all)": ours[0][-1, 1],
        "residual of ours (trial)": trial[0][-1, 1],
        "speed-up to torchnmf's residual": seconds / min(reached) if reached else float("nan"),
    }
    if with_seqnmf:
        row["seqnmf ms/iteration"] = 1e3 * run_seqnmf(tensors, 3) / 3
    return row


def measure_memory(n_trials: int = 90) -> float:
    """Most memory a fit of one restart takes beyond its input, in units of the input."""
    tensors = make_tensors(n_trials)
    model = ConvolutiveNMF(n_restarts=1, max_iter=2, n_jobs=-1, warn=False)
    model.fit(tensors[:2])  # compile
    tracemalloc.start()
    model.fit(tensors)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    return peak / tensors.nbytes


def main() -> None:
    """Print the table and write it down."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--iterations", type=int, default=60)
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument("--no-seqnmf", action="store_true")
    parser.add_argument(
        "--planted", choices=("judged", "development", "none"), default="judged"
    )
    parser.add_argument("--starts", type=int, default=STARTS)
    parser.add_argument("--torchnmf-starts", type=int, default=THEIR_STARTS)
    parser.add_argument("--no-touches", action="store_true")
    parser.add_argument(
        "--cpu",
        action="store_true",
        help="count processor time, on one thread: for a busy machine",
    )
    given = parser.parse_args()
    if given.cpu:
        global read_clock
        given.threads, read_clock = 1, time.process_time
    seeds = {"judged": JUDGED, "development": DEVELOPMENT, "none": ()}[given.planted]
    path = Path(__file__).parent / "results" / "encoding.json"
    result = {"clock": "processor" if given.cpu else "wall", "threads": given.threads}
    warm = make_tensors(3)
    (
        run_ours(warm, "all", 8, given.threads),
        run_ours(warm, "trial", 8, given.threads),
    )  # compile
    if seeds:
        result["sets"] = [
            judge(*one, given.threads, given.starts, given.torchnmf_starts)
            for one in list_sets(seeds)
        ]
    if not given.no_touches:
        rows = [
            compare(n, given.iterations, given.rounds, given.threads, not given.no_seqnmf)
            for n in (30, 90)
        ]
        result |= {"iterations": given.iterations, "rows": rows, "memory": measure_memory()}
        for name in rows[0]:
            print(f"{name:34s}" + "".join(f"{row[name]:12.4g}" for row in rows))
        print(f"{'memory beside the input, × input':34s}{result['memory']:24.3g}")
    path.parent.mkdir(exist_ok=True)
    write_kept(path, json.dumps(result, indent=1, default=float) + "\n")


if __name__ == "__main__":
    main()
