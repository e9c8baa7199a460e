"""Slope: the derivative of the score with respect to every angle, and so, by the engine run
backwards, to every hinge.
"""

from typing import Annotated, Any

import numpy as np

from feeler.antenna.antenna import Antenna
from feeler.checked import checked
from feeler.design.scoring import (
    compute_logits,
    draw_noise,
    fit_class,
    make_clock,
    make_scenes,
    scale,
    take_own,
    touch_classes,
)
from feeler.design.task import Task
from feeler.execute.threads import hold_blas
from feeler.physics.gradient import FIELDS, pull_back
from feeler.stimulus.trial import LEAD


@checked
def differentiate_score(
    antenna: Antenna, task: Task, purpose: str = "optimiser", **options: Any
) -> tuple[float, float, dict[str, np.ndarray]]:
    """Bits, peak angle [rad], and ∂bits/∂ stiffness, damping and segment mass (segment,) of an
    antenna.

    Bits are those of :func:`feeler.design.score`, their derivative exact for the steps and the
    noise that were taken. It costs about as much as six scores, however many hinges there are.
    """
    bits, peak = 0.0, 0.0
    slopes = {name: np.zeros(antenna.n_segments) for name in FIELDS}
    for speed in task.speeds:
        angles = touch_classes(antenna, task, purpose, speed, **options)
        with hold_blas():
            own, slope = differentiate_bits(scale(angles, task.noise), task.train, task.level)
        bits, peak = bits + own / len(task.speeds), max(peak, float(np.abs(angles).max()))
        slope = (
            unscale(slope.reshape(angles.shape), angles)
            if task.noise == "relative"
            else slope.reshape(angles.shape)
        )
        weights = np.zeros(
            (angles.shape[0] * angles.shape[1], make_clock(task).n_samples, antenna.n_segments)
        )
        flat = slope.reshape(-1, *angles.shape[2:]).transpose(0, 2, 1)
        weights[:, round(LEAD) + 1 :, antenna.sensors - 1] = flat / len(task.speeds)
        for name, values in pull_back(
            make_scenes(antenna, task, purpose, speed), make_clock(task), weights
        ).items():
            slopes[name] += values.sum(axis=0)
    return bits, peak, slopes


@checked
def differentiate_bits(
    tensors: Annotated[np.ndarray, "class touch entry"],
    train: Annotated[int, "> 0"],
    sd: Annotated[float, "> 0"],
) -> tuple[float, np.ndarray]:
    """Mean bits of :func:`feeler.design.scoring.decode`, and ∂bits/∂ each entry (class, touch,
    entry).

    With v = Σ_k⁻¹ u: ∂logit/∂y = −v, ∂/∂m = v, ∂/∂B = (B v) vᵀ − S⁻¹ B, and B v = S⁻¹ B u.
    """
    known, tests = tensors[:, :train], tensors[:, train:]
    count, entries = len(tests), tests.shape[2]
    noise = draw_noise(entries, sd)
    own, posterior = take_own(compute_logits(tensors, train, sd))
    share = -posterior / (own.size * np.log(2))
    share[:, np.arange(count), :, np.arange(count)] += 1 / (own.size * np.log(2))
    slope = np.zeros_like(tensors)
    for k in range(count):
        mean, scatter, inverse, _ = fit_class(known[k], sd)
        far, w = tests - mean, share[..., k]  # (class, touch, entry), (noise, class, touch)
        flat = w.reshape(len(noise), -1)
        pulled = flat.sum(axis=0)[:, None] * far.reshape(-1, entries) + flat.T @ noise
        solved = (pulled - pulled @ scatter.T @ inverse @ scatter) / sd**2
        slope[:, train:] -= solved.reshape(tests.shape)
        seen = ((noise @ scatter.T)[:, None, None] + far @ scatter.T).reshape(
            len(noise), -1, len(scatter)
        )
        turned = (flat[..., None] * seen) @ inverse  # w S⁻¹ B u
        outer = (
            np.einsum("nar,ae->re", turned, far.reshape(-1, entries), optimize=True)
            + turned.sum(axis=1).T @ noise
        )
        outer -= np.einsum("nar,nas->rs", turned, seen) @ inverse @ scatter
        rows = outer / sd**2 - flat.sum() * inverse @ scatter
        slope[k, :train] += (rows - rows.mean(axis=0)) / np.sqrt(train - 1) + solved.sum(
            axis=0
        ) / train
    return float(np.log2(count) + own.mean() / np.log(2)), slope


def unscale(slope: np.ndarray, angles: np.ndarray) -> np.ndarray:
    """∂/∂ angle from ∂/∂ (angle / its tensor's peak); the peak is taken to stay where it is."""
    flat, values = slope.reshape(-1, angles[0, 0].size), angles.reshape(-1, angles[0, 0].size)
    top = np.abs(values).argmax(axis=1)
    rows = np.arange(len(values))
    peak = values[rows, top]  # with its sign
    made = flat / np.abs(peak)[:, None]
    made[rows, top] -= np.einsum("te,te->t", flat, values) / (np.abs(peak) * peak)
    return made.reshape(angles.shape)
