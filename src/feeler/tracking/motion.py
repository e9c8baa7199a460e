"""A tracked body as the motion of an antenna's base."""

from typing import Annotated

import numpy as np

from feeler.errors import InvalidInput
from feeler.objects.motion import BaseMotion
from feeler.records import Choice
from feeler.tracking.kinematics import MAX_GAP, _MotionSpectrum, smooth
from feeler.tracking.tracks import Tracks
from feeler.validation import checked


@checked
def make_base_motion(
    tracks: Tracks,
    *,
    base: str = "head",
    towards: tuple[str, str] = ("abdomen", "head"),
    angle: float = 0.0,
    cutoff: float | None = None,
    max_gap: int = MAX_GAP,
    origin: Annotated[str, Choice(("first", "film"))] = "first",
) -> BaseMotion:
    """How an antenna's base moves that sits on a tracked body, from the first frame in which all
    landmarks are seen to the last.

    The antenna at rest points from the first landmark of ``towards`` to the second, turned by
    ``angle``. Places are those of ``base``, y upwards. Gaps are filled by a cubic spline; then x, y
    and heading each pass a zero-phase low-pass.

    Parameters
    ----------
    tracks
        In mm: ``tracks.scaled(pixels_per_mm)``.
    base
        Landmark at the antenna's base.
    towards
        Two landmarks that say where the body points; or two on the antenna near its base.
    angle
        Of the antenna to that direction [rad], positive to the right as seen from above.
    cutoff
        Of the low-pass [kHz]; default: from the spectrum of each.
    max_gap
        Longest gap that is filled in [frames].
    origin
        ``first``: the base begins at (0, 0), and the antenna points up (heading 0), as simulations
        begin. ``film``: places and headings of the film, so that what else was tracked has its
        place there.

    Raises
    ------
    InvalidInput
        Tracks in px, no such landmark, fewer than ten frames, or a longer gap.
    """
    if tracks.unit != "mm":
        raise InvalidInput(
            f"a base moves in mm, but these tracks are in {tracks.unit}: say how many px are 1 mm,"
            " as in tracks.scaled(8.0)."
        )
    body = tracks.of(towards[1])[:, :2] - tracks.of(towards[0])[:, :2]
    pose = np.column_stack([tracks.of(base)[:, :2], np.arctan2(body[:, 0], body[:, 1]) + angle])
    seen = np.isfinite(pose).all(axis=1)
    known = np.flatnonzero(seen)
    if known.size < 10:
        raise InvalidInput(
            f"{base}, {towards[0]} and {towards[1]} are seen together in {known.size} frames; 10 or"
            " more are needed."
        )
    pose, seen = pose[known[0] : known[-1] + 1], seen[known[0] : known[-1] + 1]
    gaps = np.diff(known) - 1
    if gaps.max() > max_gap:
        first = int(known[np.argmax(gaps)]) + 1
        raise InvalidInput(
            f"the base is lost in frames {first} to {first + gaps.max() - 1}; gaps of up to"
            f" {max_gap} frames are filled in. Take a part of the film without such a gap, or"
            f" max_gap={gaps.max()}."
        )
    pose[seen, 2] = np.unwrap(pose[seen, 2])
    from pandas import DataFrame

    pose = DataFrame(pose).interpolate(method="cubicspline").to_numpy(copy=True)
    for k, row in enumerate(pose.T):
        highest = _MotionSpectrum([row - row[0]], tracks.interval).best_cutoff
        pose[:, k] = smooth(row, tracks.interval, cutoff=cutoff or highest)
    if origin == "first":
        turn = pose[0, 2]
        moved = pose[:, :2] - pose[0, :2]
        pose = np.column_stack(
            [
                moved[:, 0] * np.cos(turn) - moved[:, 1] * np.sin(turn),
                moved[:, 0] * np.sin(turn) + moved[:, 1] * np.cos(turn),
                pose[:, 2] - turn,
            ]
        )
    return BaseMotion(time=np.arange(len(pose)) * tracks.interval, pose=pose)
