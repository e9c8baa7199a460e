"""The eight-segment model in the paper's comparison of speeds and stiffness profiles."""

from collections.abc import Sequence
from typing import Annotated

import numpy as np

from feeler.antenna import Antenna
from feeler.physics.engine import DEFAULT_ENGINE
from feeler.records.checked import checked
from feeler.robot.preset import make_robot
from feeler.robot.touches import (
    ROBOT_LOCATIONS,
    ROBOT_SPEEDS,
    get_label,
    make_touches,
    simulate_touches,
)
from feeler.stimulus import Trial
from feeler.tensors.scaling import rectify

_PROFILES = ("exponential", "linear", "constant")
# [C] exponential control: stiffness of hinge 8 over hinge 1; the insect's 1e-5 leaves no tip here
_TIP_SHARE = 0.1
_DURATION = 2600.0  # ms, the longest slow touch
_STRIDE = 4  # every fourth sample is kept: nothing in the motion is faster than 100 Hz


@checked
def make_profiles() -> dict[str, Antenna]:
    """The robot, whose widths fall linearly, and two controls.

    All have the same compliance Σ 1/k_n and the same damping time c/k.
    """
    linear = make_robot()
    steps = np.linspace(0, 1, linear.n_segments)
    shapes = {
        "exponential": _TIP_SHARE**steps,
        "linear": linear.stiffness,
        "constant": np.ones(linear.n_segments),
    }
    time = linear.damping[0] / linear.stiffness[0]
    profiles = {}
    for name in _PROFILES:
        stiffness = shapes[name] * np.sum(1 / shapes[name]) / np.sum(1 / linear.stiffness)
        profiles[name] = linear.replace(
            stiffness=stiffness, damping=time * stiffness, name=f"robot {name}"
        )
    return profiles


def simulate_comparison(
    antenna: Antenna, *, speeds: Sequence[float] = ROBOT_SPEEDS, engine: str = DEFAULT_ENGINE
) -> tuple[np.ndarray, list[Trial]]:
    """Rectified tensors (trial, sensor, time) [rad], 4 ms apart, and their trials: 10 per speed.

    All have one duration; they are not aligned.
    """
    trials = make_touches(speeds=speeds, locations=ROBOT_LOCATIONS)
    motions = simulate_touches(antenna, trials, duration=_DURATION, engine=engine)
    return rectify(np.stack(motions)[:, :, ::_STRIDE]), trials


@checked
def compute_comparison(
    *, n_repeats: int = 3, random_state: Annotated[int, "≥ 0"] = 0, engine: str = DEFAULT_ENGINE
) -> dict[str, dict]:
    """Dispersion and accuracy by speed (the robot) and by profile (slow touches).

    Tensors are rectified as those of the 140-link model.

    Returns
    -------
    dict
        ``speed`` and ``profile``: each group's name → ``pearson``, ``ssim``, ``mse``, ``nmi``
        (closest match, averaged: :class:`~feeler.dispersion.Interval` over the ten touches) and
        ``accuracy`` (10 classes, LDA, noise of 20 % of each tensor's maximum on raw tensors).
    """
    profiles = make_profiles()
    robot, trials = simulate_comparison(profiles["linear"], engine=engine)
    speeds = np.array([trial.speed for trial in trials])
    slow = {
        name: simulate_comparison(profiles[name], speeds=ROBOT_SPEEDS[-1:], engine=engine)[0]
        for name in ("exponential", "constant")
    }
    slow["linear"] = robot[speeds == ROBOT_SPEEDS[-1]]
    labels = [get_label(trial)[:2] for trial in trials]
    by_speed = _compare(
        {f"{s:g} m/s": robot[speeds == s] for s in ROBOT_SPEEDS},
        labels[:10],
        n_repeats,
        random_state,
    )
    by_profile = _compare(
        {name: slow[name] for name in _PROFILES}, labels[:10], n_repeats, random_state
    )
    return {"speed": by_speed, "profile": by_profile}


def _compare(
    groups: dict[str, np.ndarray], labels: list[tuple], n_repeats: int, random_state: int
) -> dict:
    from feeler.decoding import Relative, compute_sweep
    from feeler.dispersion import compute_dispersion

    names = np.repeat(list(groups), [len(tensors) for tensors in groups.values()])
    dispersion = compute_dispersion(np.concatenate(list(groups.values())), list(names))
    classes = [f"{feature} {location:g}" for feature, location in labels]
    result = {}
    for name, tensors in groups.items():
        sweep = compute_sweep(
            tensors,
            classes,
            ratios=(0.2,),
            n_repeats=n_repeats,
            noise=Relative(),
            random_state=random_state,
        )
        averages = {index: average[name] for index, average in dispersion.average.items()}
        result[name] = {**averages, "accuracy": float(sweep.noisy.mean())}
    return result
