"""Where a tracked antenna is: its posture; its contacts with an object, a wall or a region; and a
tracked body as the motion of its base.
"""

from collections.abc import Sequence
from itertools import pairwise
from typing import Annotated, Any

import numpy as np
import pandas as pd
import xarray as xr

from feeler.errors import InvalidInput
from feeler.objects.motion import BaseMotion
from feeler.records import Choice, Gt
from feeler.tracking.kinematics import MAX_GAP, _MotionSpectrum, smooth
from feeler.tracking.tracks import Tracks
from feeler.validation import checked

# Posture of a tracked flagellum: headings of its pieces and bends between them, from any number
# of points.


@checked
def measure_posture(tracks: Tracks, points: Sequence[str]) -> xr.Dataset:
    """Posture in every frame from landmarks along a flagellum, base to tip; NaN where a landmark is
    missing.

    Parameters
    ----------
    tracks
        In px, or in mm after ``Tracks.scaled``.
    points
        At least three landmarks, base first.

    Returns
    -------
    Dataset
        ``position`` (time, point, axis) [px or mm] relative to the base; ``heading`` (time, piece)
        [rad] of each piece, anticlockwise from +x; ``bend`` (time, joint) [rad] in (−π, π] between
        neighbouring pieces (of places in space there is no heading, and bends lie in [0, π]);
        ``curvature`` (time, joint) [1/px or 1/mm], bend over the mean length of the two pieces;
        ``piece_length`` (piece,), the median over frames.

    Raises
    ------
    InvalidInput
        Fewer than three points, an unknown one, one twice, or no frame that holds two neighbours.
    """
    names = tuple(points)
    if len(names) < 3 or len(set(names)) < len(names):
        raise InvalidInput(
            "a posture needs at least 3 different landmarks from base to tip, got"
            f" {', '.join(names) or 'none'}."
        )
    position = np.stack([tracks.of(name) for name in names], axis=1)
    piece = np.diff(position, axis=1)
    length = np.linalg.norm(piece, axis=2)
    if not np.isfinite(length).any(axis=0).all():
        raise InvalidInput(
            "two neighbouring landmarks are never seen in one frame: there is no posture to"
            " measure."
        )
    median = np.nanmedian(length, axis=0)
    unit, joint = tracks.unit, 0.5 * (median[1:] + median[:-1])
    headings, bend = _measure_bends(piece, length)
    return xr.Dataset(
        {
            "position": (
                ("time", "point", "axis"),
                position - position[:, :1],
                {"units": unit},
            ),
            **headings,
            "bend": (("time", "joint"), bend, {"units": "rad"}),
            "curvature": (("time", "joint"), bend / joint, {"units": f"1/{unit}"}),
            "piece_length": (("piece",), median, {"units": unit}),
        },
        coords={
            "time": ("time", tracks.time, {"units": "ms"}),
            "point": list(names),
            "joint": list(names[1:-1]),
            "axis": list("xyz"[: position.shape[2]]),
        },
        attrs={"source": tracks.source},
    )


def _measure_bends(piece: np.ndarray, length: np.ndarray) -> tuple[dict[str, Any], np.ndarray]:
    """Headings of pieces (time, piece, axis) as a variable, in a plane, and the bends between."""
    if piece.shape[2] == 2:
        heading = np.where(length > 0, np.arctan2(piece[:, :, 1], piece[:, :, 0]), np.nan)
        bend = np.angle(np.exp(1j * np.diff(heading, axis=1)))
        return {"heading": (("time", "piece"), heading, {"units": "rad"})}, bend
    one, next_one = piece[:, :-1], piece[:, 1:]
    cross = np.linalg.norm(np.cross(one, next_one), axis=2)
    bend = np.arctan2(cross, np.sum(one * next_one, axis=2))
    return {}, np.where((length[:, :-1] > 0) & (length[:, 1:] > 0), bend, np.nan)


# Contacts: when, how long, and where along the antenna.

_N_PLACES = 101  # places along an antenna at which its distance is measured
_SPREADS = 5.0  # [C] median absolute deviations by which an antenna bends more than when free


@checked
def measure_clearance(
    tracks: Tracks, points: Sequence[str], target: str | Sequence[Sequence[float]]
) -> tuple[np.ndarray, np.ndarray]:
    """Distance of an antenna from a target, and where along the antenna it is nearest.

    Parameters
    ----------
    tracks
        In px, or in mm after ``Tracks.scaled``; in a plane.
    points
        Landmarks along the antenna, base to tip, at least one; between them it is straight.
    target
        A landmark by name; or places (corner, 2) in the tracks' own coordinates (y upwards): one is
        a point, two are the ends of a wall, and more are the corners of a region, within which the
        distance is 0.

    Returns
    -------
    distance, place : np.ndarray
        (frame,) in the tracks' unit, and as a share of the antenna's length from base 0 to tip 1;
        NaN where a landmark is missing. Of a single point the place is 1.

    Raises
    ------
    InvalidInput
        Unknown landmarks, places in space, or a target without corners.
    """
    line = np.stack([tracks.of(name) for name in points], axis=1)
    if line.shape[2] != 2:
        raise InvalidInput("contacts are found in a plane; give plane='xy' to load_tracks.")
    shares, places = _spread(line)
    if isinstance(target, str):
        away = np.linalg.norm(places - tracks.of(target)[:, None], axis=2)
    else:
        corners = np.asarray(target, dtype=float)
        if corners.ndim != 2 or corners.shape[1:] != (2,) or not np.isfinite(corners).all():
            raise InvalidInput(
                "a target is a landmark, or places (corner, 2): one for a point, two for a wall,"
                f" three or more for a region; got shape {corners.shape}."
            )
        away = _measure_away(places, corners)
    lost = ~np.isfinite(away).all(axis=1)
    nearest = np.where(lost[:, None], 0.0, away).argmin(axis=1)
    row = np.arange(len(away))
    return np.where(lost, np.nan, away[row, nearest]), np.where(lost, np.nan, shares[nearest])


def _spread(line: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Shares of the length (place,) and places (frame, place, 2) along lines (frame, point, 2)."""
    if line.shape[1] == 1:
        return np.ones(1), line
    piece = np.nanmedian(np.linalg.norm(np.diff(line, axis=1), axis=2), axis=0)
    arc = np.concatenate([[0.0], np.cumsum(piece)]) / piece.sum()
    shares = np.linspace(0.0, 1.0, _N_PLACES)
    after = np.clip(np.searchsorted(arc, shares), 1, len(arc) - 1)
    part = (shares - arc[after - 1]) / (arc[after] - arc[after - 1])
    start, end = line[:, after - 1], line[:, after]
    return shares, start + part[:, None] * (end - start)


def _measure_away(places: np.ndarray, corners: np.ndarray) -> np.ndarray:
    """Distances (frame, place) from a point, a wall or a region."""
    closed = np.concatenate([corners, corners[:1]]) if len(corners) > 2 else corners
    if len(closed) == 1:
        return np.linalg.norm(places - closed[0], axis=2)
    found = np.full(places.shape[:2], np.inf)
    inside = np.zeros(places.shape[:2], dtype=bool)
    for start, end in pairwise(closed):
        along = end - start
        share = np.clip((places - start) @ along / max(along @ along, 1e-300), 0.0, 1.0)
        foot = start + share[..., None] * along
        found = np.minimum(found, np.linalg.norm(places - foot, axis=2))
        x, y = places[..., 0], places[..., 1]
        crossed = (start[1] > y) != (end[1] > y)
        with np.errstate(divide="ignore", invalid="ignore"):
            inside ^= crossed & (x < start[0] + (y - start[1]) * along[0] / along[1])
    found = np.where(np.isfinite(places).all(axis=2), found, np.nan)
    return np.where(inside, 0.0, found) if len(corners) > 2 else found


@checked
def find_contacts(
    tracks: Tracks,
    points: Sequence[str],
    target: str | Sequence[Sequence[float]] | None = None,
    *,
    within: Annotated[float, Gt(0)] | None = None,
    min_duration: float = 0.0,
    max_gap: int = 0,
) -> pd.DataFrame:
    """Contacts of one antenna, one a row: by its distance from a target, or by how it bends.

    Parameters
    ----------
    tracks
        In px, or in mm after ``Tracks.scaled``.
    points
        Landmarks along the antenna, base to tip; three or more where contact is seen from bending.
    target
        As for :func:`measure_clearance`; None: contact is where the antenna bends, in sum over its
        joints, by more than ``within`` [rad] beyond its median posture, by default by five median
        absolute deviations [C].
    within
        Greatest distance that counts as contact, in the tracks' unit.
    min_duration
        Shorter contacts [ms] are left out.
    max_gap
        A contact goes on over at most so many frames without contact, or that are missing.

    Returns
    -------
    DataFrame
        ``on_ms``, ``off_ms`` (the end of the last frame in contact), ``duration_ms``,
        ``first_frame``, ``last_frame``, ``place`` (share of the length, median over the contact),
        and ``whole``: False where the film, or a gap in it, begins or ends during the contact, so
        that the duration is too short. ``attrs`` hold the threshold.

    Raises
    ------
    InvalidInput
        A target without ``within``, too few points, or an antenna that is never seen.
    """
    if target is None:
        strength, place, least = _measure_bending(tracks, points, within)
    else:
        if within is None:
            raise InvalidInput(
                f"contact by distance needs within=, the greatest distance [{tracks.unit}] that"
                " counts as contact."
            )
        distance, place = measure_clearance(tracks, points, target)
        strength, least = -distance, -within
    if not np.isfinite(strength).any():
        raise InvalidInput(f"{', '.join(points)} are never seen together: there is no contact.")
    table = tabulate_contacts(
        strength, least, place, tracks.interval, min_duration=min_duration, max_gap=max_gap
    )
    table.attrs = {"within": abs(least), "unit": "rad" if target is None else tracks.unit}
    return table


def tabulate_contacts(
    strength: np.ndarray,
    least: float,
    place: np.ndarray,
    interval: float,
    *,
    min_duration: float = 0.0,
    max_gap: int = 0,
) -> pd.DataFrame:
    """Contacts, one a row as of :func:`find_contacts`: where a signal (sample,), ``interval`` ms
    apart and NaN where it is not known, is at least ``least``.
    """
    touching = strength >= least  # False where it is not known
    edges = np.flatnonzero(np.diff(np.concatenate([[0], touching, [0]])))
    joined: list[list[int]] = []
    for start, stop in edges.reshape(-1, 2).tolist():
        if joined and start - joined[-1][1] <= max_gap:
            joined[-1][1] = stop
        else:
            joined.append([start, stop])
    known, n = np.isfinite(strength), len(strength)
    rows: list[dict[str, Any]] = []
    for start, stop in joined:
        if (stop - start) * interval < min_duration:
            continue
        whole = start > 0 and stop < n and bool(known[start - 1] and known[stop])
        rows.append(
            {
                "on_ms": start * interval,
                "off_ms": stop * interval,
                "duration_ms": (stop - start) * interval,
                "first_frame": start,
                "last_frame": stop - 1,
                "place": float(np.nanmedian(place[start:stop])),
                "whole": whole,
            }
        )
    names = ["on_ms", "off_ms", "duration_ms", "first_frame", "last_frame", "place", "whole"]
    return pd.DataFrame(rows, columns=names)


def _measure_bending(
    tracks: Tracks, points: Sequence[str], within: float | None
) -> tuple[np.ndarray, np.ndarray, float]:
    """Bend beyond the median posture (frame,) [rad], where it is greatest, and the threshold."""
    posture = measure_posture(tracks, points)
    bend = posture["bend"].values
    off = np.abs(bend - np.nanmedian(bend, axis=0))
    strength = off.sum(axis=1)
    length = posture["piece_length"].values
    joints = np.cumsum(length)[:-1] / length.sum()
    lost = ~np.isfinite(strength)
    place = np.where(lost, np.nan, joints[np.where(lost[:, None], 0.0, off).argmax(axis=1)])
    if within is None:
        middle = np.nanmedian(strength)
        within = float(middle + _SPREADS * np.nanmedian(np.abs(strength - middle)))
    return strength, place, within


# A tracked body as the motion of an antenna's base.


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
    pose = pd.DataFrame(pose).interpolate(method="cubicspline").to_numpy(copy=True)
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
