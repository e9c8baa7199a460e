"""All pairs of 90 tensors, four indices: feeler against a loop over the library functions, in one
run.

    python benchmarks/dispersion.py [--pairs 200]

The loop is timed on a random sample of the 4,005 pairs and scaled up. Results go to
benchmarks/results/dispersion.json.
"""

import argparse
import json
import time
from pathlib import Path

import numpy as np
from kept import write_kept
from scipy.ndimage import gaussian_filter
from skimage.metrics import structural_similarity
from sklearn.metrics import normalized_mutual_info_score

from feeler.analysis import (
    compute_mse,
    compute_nmi,
    compute_pearson,
    compute_ssim,
    search_closest,
)
from feeler.analysis.indices import digitise

SHAPE = (90, 56, 380)
MATLAB = {
    "gaussian_weights": True,
    "sigma": 1.5,
    "use_sample_covariance": False,
    "data_range": 1.0,
}


def make_tensors(rng: np.random.Generator, shape: tuple[int, int, int] = SHAPE) -> np.ndarray:
    """Rectified smooth noise in [0, 1]: about half zeros, as contacts leave them."""
    tensors = np.maximum(gaussian_filter(rng.normal(size=shape), (0, 4, 15)), 0.0)
    return tensors / tensors.max()


def time_best(call, repeats: int = 3) -> float:
    """Shortest of some runs [s]."""
    times = []
    for _ in range(repeats):
        start = time.perf_counter()
        call()
        times.append(time.perf_counter() - start)
    return min(times)


def main() -> None:
    """Time, check agreement on the sampled pairs, print a table, write the JSON."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--pairs", type=int, default=200)
    rng = np.random.default_rng(0)
    tensors = make_tensors(rng)
    levels = digitise(tensors.reshape(len(tensors), -1), 256, tensors.min(), tensors.max())
    peers = {
        "pearson": (
            compute_pearson,
            lambda i, j: np.corrcoef(tensors[i].ravel(), tensors[j].ravel())[0, 1],
        ),
        "ssim": (
            lambda x: compute_ssim(x, border="interior"),
            lambda i, j: structural_similarity(tensors[i], tensors[j], **MATLAB),
        ),
        "mse": (compute_mse, lambda i, j: np.mean((tensors[i] - tensors[j]) ** 2)),
        "nmi": (compute_nmi, lambda i, j: normalized_mutual_info_score(levels[i], levels[j])),
    }
    n_pairs = len(tensors) * (len(tensors) - 1) // 2
    chosen = rng.integers(len(tensors), size=(parser.parse_args().pairs, 2))
    results = {}
    for name, (ours, theirs) in peers.items():
        matrix = ours(tensors)  # compiles
        bulk = time_best(lambda ours=ours: ours(tensors))
        start = time.perf_counter()
        expected = np.array([theirs(i, j) for i, j in chosen])
        loop = (time.perf_counter() - start) * n_pairs / len(chosen)
        worst = float(np.abs(matrix[chosen[:, 0], chosen[:, 1]] - expected).max())
        results[name] = {
            "feeler_s": bulk,
            "loop_s": loop,
            "ratio": loop / bulk,
            "largest_difference": worst,
        }
    total = {key: sum(r[key] for r in results.values()) for key in ("feeler_s", "loop_s")}
    results["all four"] = total | {"ratio": total["loop_s"] / total["feeler_s"]}
    results["blocks of 16 / one block (closest, nmi)"] = {
        "ratio": (
            time_best(lambda: search_closest(tensors, "nmi", block=16))
            / results["nmi"]["feeler_s"]
        )
    }
    for name, row in results.items():
        print(f"{name:40}" + "".join(f"  {key} {value:10.3g}" for key, value in row.items()))
    path = Path(__file__).parent / "results" / "dispersion.json"
    path.parent.mkdir(exist_ok=True)
    write_kept(
        path,
        json.dumps({"shape": SHAPE, "pairs": n_pairs, "results": results}, indent=1) + "\n",
    )


if __name__ == "__main__":
    main()
