"""What is claimed of speed and growth, in one table, made by one command.

    python benchmarks/claims.py [precision similarity encoder reference growth peers]

Processor time of one thread. What is compared takes turns in one process; a row is the median of
the turns' ratios, or of their exponents in a power law over four sizes, with the least and the
greatest turn. Peers that are not installed are left out, which is said (``pip install
'feeler[bench]'``; PyElastica and Pinocchio as ``make peers`` does).
"""

import os
import platform
import sys
import tempfile
import time
from collections.abc import Callable, Iterator, Mapping
from importlib.util import find_spec
from pathlib import Path

import encoding
import mujoco as mj
import numpy as np
import pandas as pd
from chain import Chain, make_antenna
from kept import write_kept
from scale import _make_touches
from scipy.ndimage import gaussian_filter
from skimage.metrics import structural_similarity
from sklearn.metrics import normalized_mutual_info_score
from workprecision import INTEGRATORS, REFERENCE, TIMESTEPS, run_feeler, run_mujoco

import feeler
from feeler.analysis import compute_mse, compute_nmi, compute_pearson, compute_ssim
from feeler.analysis.indices import digitise
from feeler.physics.run import run_scene
from feeler.physics.scene import Clock, Scene, make_scene
from feeler.physics.spec import compile_model
from feeler.tensors.store import _save_store

TURNS = 5
PAIRS = 30  # of 4,005, on which a peer's loop is timed
RESULT = Path(__file__).parent / "results" / "claims.csv"
MATLAB = {
    "gaussian_weights": True,
    "sigma": 1.5,
    "use_sample_covariance": False,
    "data_range": 1.0,
}
Rows = Iterator[tuple[str, np.ndarray, str]]  # a claim, its value in each turn, and a note


def take_turns(
    calls: Mapping[object, Callable[[], object]], turns: int = TURNS
) -> pd.DataFrame:
    """Processor seconds of each call, a row for each turn."""

    def spend(call: Callable[[], object]) -> float:
        start = time.process_time()
        call()
        return time.process_time() - start

    return pd.DataFrame(
        [{name: spend(call) for name, call in calls.items()} for _ in range(turns)]
    )


def fit_power(
    make: Callable[[int], Callable[[], object]], sizes: tuple[int, ...]
) -> np.ndarray:
    """The exponent with which the time of what ``make`` gives grows with a size, in each turn."""
    calls = {n: make(n) for n in sizes}
    take_turns(calls, 1)  # compiles
    return np.polyfit(np.log(sizes), np.log(take_turns(calls)).T, 1)[0]


def compare_precision() -> Rows:
    """A touch of 100 ms by a ball: bare MuJoCo at the largest timestep that is as near to the
    converged path as the default engine.
    """
    trial = feeler.Trial(feature=feeler.Ball(radius=1.5), location=0.7, speed=0.3)
    scene = make_scene(feeler.presets.cockroach(), trial)
    truth = run_feeler(scene, REFERENCE, "chain-consistent")

    def miss(path: np.ndarray) -> float:
        size = np.linalg.norm(truth - truth[0], axis=1).max()
        return float(np.linalg.norm(path - truth, axis=1).max() / size)

    euler, ours = INTEGRATORS["MuJoCo Euler"], miss(run_feeler(scene, 0.1, "chain-consistent"))
    for timestep in TIMESTEPS:
        theirs = miss(run_mujoco(scene, timestep, euler))
        if theirs <= ours:
            break
    calls = {
        "ours": lambda: run_feeler(scene, 0.1, "chain-consistent"),
        "theirs": lambda: run_mujoco(scene, timestep, euler),
    }
    found = take_turns(calls, 3)
    note = f"error of the tip {theirs:.2%} at {timestep:g} ms; ours {ours:.2%} at 0.1 ms"
    yield "touch to equal error, MuJoCo over feeler", found["theirs"] / found["ours"], note


def compare_similarity() -> Rows:
    """All pairs of 90 tensors, per pair, and how far the values are from the peer's."""
    rng = np.random.default_rng(0)
    tensors = np.maximum(gaussian_filter(rng.normal(size=(90, 56, 380)), (0, 4, 15)), 0.0)
    tensors /= tensors.max()  # about half zeros, as contacts leave them
    levels = digitise(tensors.reshape(90, -1), 256, 0.0, 1.0)
    pairs = rng.integers(90, size=(PAIRS, 2))
    peers = {
        "SSIM, scikit-image": (
            lambda: compute_ssim(tensors, border="interior"),
            lambda i, j: structural_similarity(tensors[i], tensors[j], **MATLAB),
        ),
        "NMI, scikit-learn": (
            lambda: compute_nmi(tensors),
            lambda i, j: normalized_mutual_info_score(levels[i], levels[j]),
        ),
        "Pearson r, numpy": (
            lambda: compute_pearson(tensors),
            lambda i, j: np.corrcoef(tensors[i].ravel(), tensors[j].ravel())[0, 1],
        ),
        "MSE, numpy": (
            lambda: compute_mse(tensors),
            lambda i, j: np.mean((tensors[i] - tensors[j]) ** 2),
        ),
    }
    for name, (ours, theirs) in peers.items():
        expected = np.array([theirs(i, j) for i, j in pairs])
        apart = float(np.abs(ours()[pairs[:, 0], pairs[:, 1]] - expected).max())
        calls = {"ours": ours, "theirs": lambda theirs=theirs: [theirs(*one) for one in pairs]}
        found = take_turns(calls, 3)
        per_pair = (found["theirs"] / PAIRS) / (found["ours"] / (90 * 89 / 2))
        yield f"{name} over feeler, per pair", per_pair, f"greatest difference {apart:.1g}"


def compare_encoder() -> Rows:
    """torchnmf's 60 iterations on 30 trials over our time to the residual that it reaches."""
    name = "convolutive NMF, torchnmf over feeler, to its residual"
    if find_spec("torchnmf") is None:
        yield name, np.array([np.nan]), "left out: torchnmf is not installed"
        return
    encoding.read_clock = time.process_time
    tensors, ratios = encoding.make_tensors(30), []
    encoding.run_ours(tensors[:3], "all", 8, 1)  # compiles
    for turn in range(3):
        curve = encoding.run_ours(tensors, "all", 60, 1)
        seconds, residual = encoding.run_torchnmf(tensors, 60, 1, turn)
        ratios.append(seconds / encoding._find_when(curve, residual))
    yield name, np.array(ratios), f"residual {residual:.3f}, ours ends at {curve[-1, 1]:.3f}"


def compare_reference() -> Rows:
    """The engine ``mujoco`` over bare ``mj_step`` on the same model: what we add around it."""
    trial = feeler.Trial(feature=feeler.Ball(radius=1.53), location=0.5, speed=0.6)
    scene = make_scene(feeler.presets.cockroach(), trial)
    model, n = compile_model(scene, 0.02), scene.antenna.n_segments

    def step() -> None:
        data = mj.MjData(model)
        data.qvel[n : n + 2] = scene.objects[0].velocity
        mj.mj_step(model, data, nstep=round(39 / 0.02))

    calls = {
        "compiling": lambda: compile_model(scene, 0.02),
        "ours": lambda: run_scene(scene, Clock(duration=40.0, timestep=0.02), "mujoco"),
        "bare": step,
    }
    found = take_turns(calls, 3)
    ratios = (found["ours"] - found["compiling"]) / found["bare"]
    yield "engine mujoco over bare mj_step", ratios, "40 ms at 0.02 ms, ball in contact"


def measure_growth() -> Rows:
    """Exponents; 1 is in proportion."""
    rng, antenna = np.random.default_rng(0), feeler.presets.cockroach()

    def step(n: int) -> Callable[[], object]:
        scene = Scene(antenna=make_antenna(n), angle=rng.normal(0, 1e-3, n))
        chain = Chain(scene, 1, "consistent", 1)
        return lambda: chain.step(400)

    def touch(n: int) -> Callable[[], object]:
        trials = feeler.sample_trials(n)
        return lambda: feeler.touch(antenna, trials, duration=60.0, workers=1)

    def fit(trials: int = 30, sensors: int = 56, bases: int = 3, lags: int = 40):
        tensors = encoding.make_tensors(trials, sensors)
        model = feeler.ConvolutiveNMF(
            bases, lags, 0.8, n_restarts=1, max_iter=4, tol=0, n_jobs=1, warn=False
        )
        return lambda: model.fit(tensors)

    yield "step, with segments", fit_power(step, (50, 100, 200, 400)), "50 to 400"
    yield "touch, with trials", fit_power(touch, (8, 16, 32, 64)), "8 to 64"
    for name, sizes in {
        "trials": (15, 30, 60, 120),
        "sensors": (14, 28, 56, 112),
        "bases": (2, 4, 8, 16),
        "lags": (10, 20, 40, 80),
    }.items():
        grown = fit_power(lambda n, name=name: fit(**{name: n}), sizes)
        yield f"encoder's fit, with {name}", grown, f"{sizes[0]} to {sizes[-1]}"
    with tempfile.TemporaryDirectory() as folder:

        def write(n: int) -> Callable[[], object]:
            made = _make_touches(n, 56, 100)
            return lambda: _save_store(made, tempfile.mkdtemp(dir=folder), group_size=256)

        grown = fit_power(write, (256, 512, 1024, 2048))
        yield "store, with touches on disk", grown, "256 to 2048"


def compare_peers() -> Rows:
    """A step of a free chain of 140 links; a peer does more, see docs/benchmarks.md."""
    if missing := [name for name in ("pinocchio", "elastica") if find_spec(name) is None]:
        words = f"left out: {' and '.join(missing)} not installed"
        yield "free step, peers over feeler", np.array([np.nan]), words
        return
    sys.path.append(str(Path(__file__).parent / "peers"))
    import speed

    ours = speed.make_chain(140, 1)
    for name, make in {
        "Pinocchio's aba": speed.make_pinocchio,
        "a PyElastica step": speed.make_elastica,
    }.items():
        step = make(140)
        calls = {"ours": lambda: ours(2000), "theirs": lambda step=step: step(2000)}
        take_turns(calls, 1)  # compiles
        found = take_turns(calls)
        yield f"{name} over a free step", found["theirs"] / found["ours"], "140 links"


CLAIMS = {
    "precision": compare_precision,
    "similarity": compare_similarity,
    "encoder": compare_encoder,
    "reference": compare_reference,
    "growth": measure_growth,
    "peers": compare_peers,
}


def main() -> None:
    """The claims that are asked for, or all; all are written to results/claims.csv."""
    rows = []
    for compare in (CLAIMS[name] for name in sys.argv[1:] or CLAIMS):
        for says, values, note in compare():
            value, low, high = (float(f(values)) for f in (np.median, np.min, np.max))
            row = {"claim": says, "median": value, "least": low, "greatest": high}
            rows.append(row | {"turns": len(values), "load": os.getloadavg()[0], "note": note})
            print(f"{says:58} {value:9.3g} ({low:.3g} to {high:.3g})  {note}", flush=True)
    print(f"{platform.machine()}, {os.cpu_count()} cores, Python {platform.python_version()}")
    if not sys.argv[1:]:
        write_kept(RESULT, pd.DataFrame(rows).to_csv(index=False, float_format="%.4g"))


if __name__ == "__main__":
    main()
