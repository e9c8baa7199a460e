"""Accuracy on touches that no training copy was made of: a shifted place, another speed;
``fig5_new`` has sizes and places.
"""

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from feeler.decoding import compute_sweep, make_labels
from feeler.decoding.classifiers import make_fitting_lda
from feeler.decoding.curves import Group
from feeler.decoding.noise import Relative
from feeler.decoding.plan import Plan
from feeler.tensors.scaling import rectify

JITTERS = {
    "place shifted by up to 2 % of the length": (0.02, 0.0),
    "speed changed by up to 10 %": (0.0, 0.1),
}  # [C]


def compute_splits(
    groups: Mapping[str, Mapping[str, Group]],
    tensors: Mapping[str, Any],
    plan: Plan,
    *,
    quantity: str = "angle",
    jitter: Callable[[str, float, float], Any] | None = None,
    random_state: int = 0,
) -> dict[str, dict[str, float]]:
    """Accuracy on clean touches that no training copy was made of; nothing without ``jitter``."""
    options: dict[str, Any] = {
        "ratios": (plan.probe,),
        "n_copies": plan.n_copies,
        "n_repeats": plan.other_repeats,
    }
    options |= {"noise": Relative(each="tensor"), "rotate": True, "random_state": random_state}
    found: dict[str, dict[str, float]] = {}
    if jitter is None or "profile" not in groups:
        return found
    peak = max(float(data[quantity].max()) for data in tensors.values())
    for title, shift in JITTERS.items():
        accuracies = {}
        for name, group in groups["profile"].items():
            speed = np.asarray(tensors[name]["speed"])
            labels = make_labels(tensors[name])[speed == speed.min()]
            shifted = rectify(jitter(name, *shift)[quantity].values) / peak
            lda = make_fitting_lda(len(group.labels), plan.n_copies)
            sweep = compute_sweep(
                group.tensors, group.labels, held_out=(shifted, labels), estimator=lda, **options
            )
            accuracies[name] = float(sweep.clean.mean())
        found[f"by profile, {title}, tensors"] = accuracies
    return found
