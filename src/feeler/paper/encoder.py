"""The encoder as the paper sets it, and how much work each scale gives it."""

from typing import Any

import numpy as np

from feeler.encoding import ConvolutiveNMF
from feeler.encoding.inputs import check_choice
from feeler.errors import InvalidInput
from feeler.tensors.scaling import rectify

QUANTITIES = ("angle", "curvature")
# restarts, iterations, tolerance. Ten restarts [P] (Fig. 4B); the rest is cost against accuracy [C].
EFFORT = {"smoke": (1, 5, 1e-3), "quick": (2, 20, 1e-3), "paper": (10, 200, 1e-4)}
SIDE_RESTARTS = {"smoke": 1, "quick": 1, "paper": 2}
"""Restarts where the paper states none: other durations (Fig. S5) and profiles (Fig. 5F–G) [C]."""


def make_encoder(scale: str = "quick", **changes: Any) -> ConvolutiveNMF:
    """An unfitted encoder with the paper's M = 3, T = 40 and sparseness 0.8, for this scale; `changes` override.

    Below paper scale a fit stops early on purpose, so it does not warn of it: the effort is part of the scale.
    """
    if scale not in EFFORT:
        raise InvalidInput(f"unknown scale {scale!r}; valid: {', '.join(EFFORT)}.")
    n_restarts, max_iter, tol = EFFORT[scale]
    settings = {"n_restarts": n_restarts, "max_iter": max_iter, "tol": tol, "warn": scale == "paper", "random_state": 0}
    return ConvolutiveNMF(**(settings | changes))


def prepare(tensors: Any, quantity: str = "angle") -> np.ndarray:
    """What is encoded: one quantity of a Dataset as (trial, sensor, time), negatives set to 0 [D: as in the video]."""
    check_choice("quantity", quantity, QUANTITIES)
    return rectify(tensors[quantity].transpose("trial", "sensor", "time").values)
