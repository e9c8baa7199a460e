"""Made-up tracks with a known answer, always labelled synthetic: for tests, examples and Fig. S2's
layout.
"""

import os
from typing import Annotated

import numpy as np

from feeler.disk.files import writing
from feeler.errors import InvalidInput
from feeler.physics.clock import MAX_SAMPLES
from feeler.records.checked import checked
from feeler.tracking.tracks import LANDMARKS, Tracks

_FRAME_RATE = (
    30.0  # [C] frames per second, an ordinary security camera; the paper does not state its own
)
_SCALE = 8.0  # [C] px/mm
_BODY_LENGTH = 28.0  # [B] mm, antenna about 1.5 times the body


@checked
def make_synthetic_tracks(
    rng: np.random.Generator,
    *,
    peak_speed: tuple[float, float] = (np.deg2rad(86.67e-3), np.deg2rad(86.67e-3)),
    sweep_rate: Annotated[float, "> 0"] = 0.5e-3,
    duration: Annotated[float, "> 0"] = 20_000.0,
    frame_rate: Annotated[float, "> 0"] = _FRAME_RATE,
    length: Annotated[float, "> 0"] = 42.0,
    noise: float = 0.5,
    gap_share: float = 0.0,
) -> Tracks:
    """A walking, turning body whose antennae sweep sinusoidally, so that every peak speed is known.

    ``θ(t) = θ₀ + A sin(2π f t + φ)`` with A = peak / (2π f): each peak of |dθ/dt| is ``peak_speed``
    (left, right) [rad/ms]. ``sweep_rate`` f [kHz], ``duration`` and ``length`` in ms and mm,
    ``noise`` sd of each coordinate [px], ``gap_share`` share of frames in which a random landmark
    is lost.
    """
    if not 0 <= gap_share < 1:
        raise InvalidInput(f"gap_share must lie in [0, 1), got {gap_share}.")
    if not 0 <= noise < np.inf:
        raise InvalidInput(f"noise must be ≥ 0 px, got {noise}.")
    interval = 1e3 / frame_rate
    if not duration / interval <= MAX_SAMPLES:
        raise InvalidInput(
            f"{duration:g} ms at {frame_rate:g} frames a second are more than {MAX_SAMPLES:,}"
            " frames; use a lower rate."
        )
    time = np.arange(round(duration / interval)) * interval
    heading = 0.6 * np.sin(2 * np.pi * time / 15_000.0) + rng.uniform(-np.pi, np.pi)
    forward = np.stack([np.cos(heading), np.sin(heading)], axis=1)
    abdomen = np.cumsum(forward, axis=0) * 0.01 * interval  # walks at 10 mm/s
    head = abdomen + _BODY_LENGTH * forward
    position = np.empty((time.size, len(LANDMARKS), 2))
    position[:, 2], position[:, 3] = head, abdomen
    for side, (peak, outward) in enumerate(zip(peak_speed, (1.0, -1.0), strict=True)):
        phase = rng.uniform(0, 2 * np.pi)
        swing = np.deg2rad(35.0) + peak / (2 * np.pi * sweep_rate) * np.sin(
            2 * np.pi * sweep_rate * time + phase
        )
        direction = heading + outward * swing
        position[:, side] = head + length * np.stack(
            [np.cos(direction), np.sin(direction)], axis=1
        )
    position = _SCALE * position + rng.normal(0.0, noise, position.shape)
    lost = rng.random(time.size) < gap_share
    position[lost, rng.integers(0, len(LANDMARKS), lost.sum())] = np.nan
    return Tracks(position=position, landmarks=LANDMARKS, interval=interval, source="synthetic")


@checked
def save_dltdv(tracks: Tracks, path: str | os.PathLike) -> None:
    """Write tracks as DLTdv8 would: pt1_cam1_X, …, first pixel 1, origin top-left, NaN where a
    point was lost.
    """
    header = ",".join(
        f"pt{point + 1}_cam1_{axis}" for point in range(len(tracks.landmarks)) for axis in "XY"
    )
    values = (tracks.position * (1.0, -1.0) + 1.0).reshape(tracks.n_frames, -1)
    with writing(path) as part, part.open("w", encoding="utf-8", newline="\n") as file:
        file.write(f"# source: {tracks.source}\n{header}\n")
        np.savetxt(file, values, fmt="%.3f", delimiter=",")
