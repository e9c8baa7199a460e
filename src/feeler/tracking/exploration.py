"""The speed of active touch: from tracked trials to the average maximum angular speed."""

import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Annotated, Any

import numpy as np

from feeler.errors import Doubtful, InvalidInput
from feeler.records.checked import checked
from feeler.records.record import OneOf
from feeler.tracking.angle import SIDES, compute_antenna_angle
from feeler.tracking.plausible import find_doubts, leave_out_errors
from feeler.tracking.speed import MAX_GAP, MIN_PROMINENCE, Sweeps, find_sweeps
from feeler.tracking.tracks import Tracks

_MAX_LOSS = 0.05  # [C] of the speed that a chosen low-pass may take away without a remark
_MIN_FRAMES = 3.0  # [C] frames in a cycle, below which peak speeds come out too low
_MAX_MISSING = 0.2  # [C] of an antenna's frames, beyond which no mean over trials is given
_LONGEST = 1000.0  # [C] ms for which a landmark of the body may be lost
_SHIFT = 0.1  # [C] of the body's length, by which it may have moved meanwhile


@dataclass(frozen=True, kw_only=True, eq=False)
class Exploration:
    """Average maximum angular speeds of several trials.

    Attributes
    ----------
    mean_peak : np.ndarray
        (trial, side) [rad/ms]; NaN where a side made no sweep.
    n_peaks : np.ndarray
        (trial, side).
    sweeps : tuple[tuple[Sweeps, Sweeps], ...]
        Motion of (left, right) in each trial.
    length : float | None
        Antenna length [mm], where it was given.
    error : np.ndarray
        (trial, side) one standard error of ``mean_peak`` [rad/ms]: the peaks' spread over √n, and
        the noise of one speed, by about which a peak, the largest of several noisy values, comes
        out too high; NaN with fewer than two peaks.
    source : str
        ``tracked``, or ``synthetic`` if any trial is made up.
    left_out : tuple[dict[str, int], ...]
        Per trial: what is wrong with places that were left out → in how many frames.
    remarks : tuple[tuple[str, ...], ...]
        Per trial: what makes its numbers invalid or is to be asked about.
    missing : np.ndarray
        (trial, side) share of frames without an angle; NaN of a side that was not asked for.
    """

    mean_peak: np.ndarray
    n_peaks: np.ndarray
    sweeps: tuple[tuple[Sweeps, Sweeps], ...]
    length: float | None
    error: np.ndarray
    source: str
    left_out: tuple[dict[str, int], ...]
    remarks: tuple[tuple[str, ...], ...]
    missing: np.ndarray

    @property
    def mean(self) -> float:
        """Average over trials and sides [rad/ms]; NaN where more than a fifth of an antenna's
        frames are missing, because it would be an average over the frames that are easy to track.
        """
        if np.nanmax(self.missing) > _MAX_MISSING:
            return float("nan")
        return float(np.nanmean(self.mean_peak))

    @property
    def lateral_speed(self) -> float:
        """Equivalent lateral speed of the tip, mean · length [mm/ms = m/s]; NaN without a
        length.
        """
        return self.mean * (float("nan") if self.length is None else self.length)


@checked
def measure_exploration(
    trials: Sequence[Tracks],
    *,
    length: float | None = None,
    cutoff: float | str = "auto",
    max_gap: int = MAX_GAP,
    min_prominence: float = MIN_PROMINENCE,
    landmarks: Mapping[str, Any] | None = None,
    outliers: Annotated[str, OneOf(("remove", "keep"))] = "remove",
) -> Exploration:
    """Average maximum angular speed per trial and side, and the lateral speed that it amounts to.

    Per trial and side: places that cannot be are left out, short gaps bridged; angle between
    antenna and body, second-order zero-phase Butterworth low-pass, derivative, peaks of the
    absolute speed, their mean (Supplementary Methods, antenna slow exploration speed).

    Parameters
    ----------
    trials
        Tracks with the landmarks left_tip, right_tip, head, abdomen.
    length
        Antenna length [mm], for the lateral speed.
    cutoff, max_gap, min_prominence
        As :func:`find_sweeps` takes them: low-pass [kHz], ``auto`` or ``paper``; longest gap
        bridged [frames]; least prominence of a peak [rad/ms]. None is stated in the paper. A
        landmark of the body that comes back within 1 s and within a tenth of the body's length
        is bridged by a straight line, however many frames that are.
    landmarks
        What the landmarks are called, as for :func:`compute_antenna_angle`: ``tips``, ``bases``,
        ``head``, ``abdomen``.
    outliers
        ``remove`` leaves out what :func:`~feeler.tracking.plausible.leave_out_errors` finds
        (jumps, exchanged landmarks); ``keep`` takes every place as it is.

    Returns
    -------
    Exploration
        A trial's remarks are warned of as well.

    Raises
    ------
    InvalidInput
        No trial, or not one peak in any of them.
    """
    if not trials:
        raise InvalidInput("measure_exploration needs at least one trial, got none.")
    if length is not None and not (np.isfinite(length) and length > 0):
        raise InvalidInput(f"length must be > 0 mm, got {length}.")
    options: dict[str, Any] = {
        "cutoff": cutoff,
        "max_gap": max_gap,
        "min_prominence": min_prominence,
    }
    found = [_measure_trial(trial, landmarks or {}, outliers, options) for trial in trials]
    sweeps = tuple(pair for pair, _, _ in found)
    mean_peak = np.array([[side.mean_peak for side in pair] for pair in sweeps])
    if np.isnan(mean_peak).all():
        raise InvalidInput(_explain_nothing(trials, sweeps, min_prominence))
    remarks = tuple(tuple(words) for _, _, words in found)
    for words in dict.fromkeys(words for trial in remarks for words in trial):
        warnings.warn(words, Doubtful, stacklevel=3)
    tips = (landmarks or {}).get("tips", ("left", "right"))
    missing = [
        [
            side.missing / side.angle.size if tip else np.nan
            for tip, side in zip(tips, pair, strict=True)
        ]
        for pair in sweeps
    ]
    return Exploration(
        mean_peak=mean_peak,
        n_peaks=np.array([[side.peak_speed.size for side in pair] for pair in sweeps]),
        sweeps=sweeps,
        length=length,
        error=np.array([[side.error for side in pair] for pair in sweeps]),
        source="synthetic"
        if any(tracks.source == "synthetic" for tracks in trials)
        else "tracked",
        left_out=tuple(left_out for _, left_out, _ in found),
        remarks=remarks,
        missing=np.array(missing),
    )


def _measure_trial(
    tracks: Tracks, landmarks: Mapping[str, Any], outliers: str, options: dict[str, Any]
) -> tuple[tuple[Sweeps, Sweeps], dict[str, int], list[str]]:
    """Sweeps of (left, right), frames that were left out, and remarks."""
    names = {"tips": ("left_tip", "right_tip"), "head": "head", "abdomen": "abdomen"} | {
        name: value for name, value in landmarks.items() if value is not None
    }
    bases = names.get("bases", (names["head"],) * 2)
    left_out: dict[str, int] = {}
    if outliers == "remove":
        tracks, left_out = leave_out_errors(tracks, **names | {"bases": bases})
    tracks, is_bridged = _bridge_body(
        tracks, names["head"], names["abdomen"], bases, options["max_gap"]
    )
    angle = compute_antenna_angle(tracks, **names)
    remarks = find_doubts(
        angle,
        tips=names["tips"],
        head=names["head"],
        abdomen=names["abdomen"],
        flat=tracks.position.shape[2] == 2,
    )
    pair = []
    for tip, row in zip(names["tips"], angle, strict=True):
        side = find_sweeps(row, tracks.interval, **options)
        side = replace(
            side, is_bridged=(side.is_bridged | is_bridged) & np.isfinite(side.angle)
        )
        remarks += _list_remarks(tip, side, tracks, options["cutoff"]) if tip else []
        pair.append(side)
    return (pair[0], pair[1]), left_out, remarks


def _list_remarks(tip: str, side: Sweeps, tracks: Tracks, cutoff: float | str) -> list[str]:
    """What the low-pass and the frame rate do to the speeds of one antenna."""
    remarks = []
    lost, at = side.lost
    if cutoff != "auto" and lost > _MAX_LOSS:
        remarks.append(
            f"the low-pass of {side.cutoff * 1e3:.3g} Hz takes away {lost:.0%} of the speed of"
            f" {tip}, whose angle moves at {at * 1e3:.3g} Hz. Give cutoff='auto', or a higher"
            " one."
        )
    frames = 1 / (side.frequency * tracks.interval) if side.frequency > 0 else np.inf
    if side.peak_speed.size and frames < _MIN_FRAMES:
        remarks.append(
            f"{tip} moves at {side.frequency * 1e3:.3g} Hz, which the film shows in"
            f" {frames:.2g} frames a cycle: its peak speeds come out too low. Film at"
            f" {4e3 * side.frequency:.0f} frames/s or more."
        )
    return remarks


def _bridge_body(
    tracks: Tracks, head: str, abdomen: str, bases: tuple[str, str], max_gap: int
) -> tuple[Tracks, np.ndarray]:
    """Tracks in which the landmarks of the body are bridged, and where (frame,) they are."""
    is_bridged = np.zeros(tracks.n_frames, dtype=bool)
    if max_gap == 0:
        return tracks, is_bridged
    body = np.linalg.norm(tracks.of(head) - tracks.of(abdomen), axis=1)
    if not np.isfinite(body).any():
        return tracks, is_bridged
    near, longest = _SHIFT * float(np.nanmedian(body)), int(_LONGEST / tracks.interval)
    position = tracks.position.copy()
    for name in {head, abdomen, *bases} - {""}:
        place = position[:, tracks.landmarks.index(name)]
        seen = np.flatnonzero(np.isfinite(place).all(axis=1))
        for start, stop in pairwise(seen):
            lost = stop - start - 1
            moved = np.linalg.norm(place[stop] - place[start])
            if lost and (lost <= max_gap or (lost <= longest and moved <= near)):
                share = np.arange(1, lost + 1)[:, None] / (lost + 1)
                place[start + 1 : stop] = place[start] + share * (place[stop] - place[start])
                is_bridged[start + 1 : stop] = True
    return tracks.replace(position=position) if is_bridged.any() else tracks, is_bridged


def _explain_nothing(
    trials: Sequence[Tracks], sweeps: tuple[tuple[Sweeps, Sweeps], ...], least: float
) -> str:
    """Why no trial has a peak."""
    frames = sum(2 * trial.n_frames for trial in trials)
    missing = sum(side.missing for pair in sweeps for side in pair)
    lost: dict[str, int] = {}
    for trial in trials:
        for name, place in zip(trial.landmarks, np.moveaxis(trial.position, 1, 0), strict=True):
            lost[name] = lost.get(name, 0) + int(np.isnan(place).any(axis=1).sum())
    said = f"no sweep in {len(trials)} trials × {len(SIDES)} sides: "
    if missing > 0.5 * frames:
        worst = ", ".join(
            f"{name} {n}" for name, n in sorted(lost.items(), key=lambda item: -item[1]) if n
        )
        return (
            f"{said}{missing / frames:.0%} of the frames have no angle. Frames in which a landmark"
            f" is lost or its likelihood too low: {worst or 'none'}. Bridge longer gaps (max_gap=),"
            " or lower the threshold (min_likelihood=)."
        )
    return (
        f"{said}no peak of angular speed rises {np.rad2deg(least) * 1e3:.3g} °/s, or three times"
        " the tracking noise, above its neighbourhood. Is the frame rate right, and do the tips"
        " move?"
    )
