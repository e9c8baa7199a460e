"""Films of antennae that are released or hit: tracked points along the antenna as displacements
across it.
"""

import difflib
from collections.abc import Sequence
from functools import cached_property
from pathlib import Path
from typing import Annotated, Any

import numpy as np

from feeler.calibration.traces import MAX_GAP, Traces, _cut_at_release, bridge, find_rest
from feeler.errors import InvalidInput
from feeler.records import Gt, Record, Unit
from feeler.tracking import Tracks, load_tracks
from feeler.validation import checked

_STILL = 0.02  # [C] share of the antenna's length by which a base moves that is clamped


class Film(Record):
    """Points of one antenna in every frame of a film, and where it rests.

    Attributes
    ----------
    position : np.ndarray
        (frame, point, 2), y upwards, relative to the base where that was tracked [``unit``].
    bridged : np.ndarray
        Frames in which a point was lost and is filled in (frame, point).
    place : np.ndarray
        Places (point,) as fractions of the length; 0 is the base.
    interval : float
        Between frames [ms].
    origin : np.ndarray
        Where the base is in the film (2,) [``unit``].
    first : int
        Number of the first frame in the film.
    """

    position: Annotated[np.ndarray, "frame point axis"]
    bridged: Annotated[np.ndarray, "frame point"]
    place: Annotated[np.ndarray, "point"]
    interval: Annotated[float, Gt(0), Unit("ms")]
    origin: Annotated[np.ndarray, "axis"]
    name: str = "animal"
    unit: str = "px"
    first: int = 0
    source: str = "recorded"

    @property
    def time(self) -> np.ndarray:
        """Time (frame,) since the first frame [ms]."""
        return np.arange(len(self.position)) * self.interval

    @cached_property
    def rest(self) -> np.ndarray:
        """Where each point comes to rest (point, 2): the median of the last fifth."""
        return np.array(
            [[find_rest(row) for row in point.T] for point in self.position.swapaxes(0, 1)]
        )

    @cached_property
    def axes(self) -> np.ndarray:
        """Along the antenna at rest, and across it towards where it is at first (2, 2), unit rows.

        Across is the line through a single point's positions, where no base was tracked.
        """
        moved = self.position[:, -1] - self.rest[-1]
        if len(self.place) > 1 and self.place[0] == 0:
            along = self.rest[-1] - self.rest[0]
        else:
            across = np.linalg.svd(moved, full_matrices=False)[2][0]
            along = np.array([-across[1], across[0]])
        along = along / np.linalg.norm(along)
        across = np.array([along[1], -along[0]])
        first = float(np.median(moved[:5] @ across))
        peak = moved @ across
        side = first if abs(first) > 0.2 * np.abs(peak).max() else peak[np.abs(peak).argmax()]
        return np.array([along, across * (1.0 if side >= 0 else -1.0)])

    @property
    def displacement(self) -> np.ndarray:
        """Displacement across the resting antenna (point, frame) [``unit``], without the base."""
        moved = (self.position - self.rest) @ self.axes[1]
        return moved.T[self.place > 0]

    def make_traces(self, *, release: bool = True) -> Traces:
        """The displacements as traces of this animal, cut at the release where one is asked for."""
        keep = self.place > 0
        ends = ["" if place == 1 else f"@{place:.4g}" for place in self.place[keep]]
        names = tuple(f"{self.name}{end}" for end in ends)
        traces = Traces(
            time=self.time,
            displacement=self.displacement,
            names=names,
            source=self.source,
            bridged=self.bridged.T[keep],
        )
        return _cut_at_release(traces) if release else traces


@checked
def load_film(
    path: str | Path,
    points: Sequence[str],
    *,
    scale: Annotated[float, Gt(0)] | None = None,
    max_gap: int = MAX_GAP,
    name: str = "",
    **options: Any,
) -> Film:
    """Points along an antenna from any tracker's file that :func:`feeler.tracking.load_tracks`
    reads.

    Parameters
    ----------
    points
        Landmarks from base to tip, as in ``("base", "tip")``. The first is where the antenna is
        clamped, where there are several and no place is said for it. The last is the tip unless its
        place is said: ``mid@0.5`` is at half the length. Places that are not said are those of the
        resting antenna in the film.
    scale
        Pixels per mm; only shapes are fitted, so none is needed.
    max_gap
        Longest gap that is filled in [frames]; what is filled in does not count in a fit.
    name
        The animal's; default: the file's.
    options
        Of ``load_tracks``: frame_rate, individual, min_likelihood, origin, plane.

    Raises
    ------
    InvalidInput
        A landmark that there is not, a longer gap, or what ``load_tracks`` refuses.
    """
    tracks = load_tracks(path, **options)
    if scale is not None:
        tracks = tracks.scaled(scale)
    return make_film(tracks, points, max_gap=max_gap, name=name or Path(path).stem)


@checked
def make_film(
    tracks: Tracks, points: Sequence[str], *, max_gap: int = MAX_GAP, name: str = "animal"
) -> Film:
    """As :func:`load_film`, from tracks that are read already."""
    if not points:
        raise InvalidInput(
            "points must name the landmarks along the antenna, base to tip: base,tip."
        )
    names = [point.partition("@")[0].strip() for point in points]
    for one in names:
        _require_landmark(tracks, one)
    said = [_read_place(point) for point in points]
    position = np.stack([tracks.of(one)[:, :2] for one in names], axis=1)
    lost = np.isnan(position).any(axis=2)
    whole = np.flatnonzero(~lost.any(axis=1))
    if whole.size < 10:
        raise InvalidInput(
            f"{name}: {', '.join(names)} are seen together in {whole.size} frames, 10 or more are"
            " needed. Lower min_likelihood=, or choose other points."
        )
    part = slice(whole[0], whole[-1] + 1)
    position, lost = position[part], lost[part]
    flat = np.where(lost[..., None], np.nan, position).reshape(len(position), -1)
    filled = bridge(flat, max_gap, [one for one in names for _ in "xy"], name, int(whole[0]))
    position, origin = filled.reshape(position.shape), np.zeros(2)
    if len(names) > 1 and said[0] in (None, 0.0):
        said[0] = 0.0
        base = position[:, 0]
        origin = np.median(base, axis=0)
        length = np.linalg.norm(np.median(position[-1:, -1], axis=0) - origin)
        wander = np.linalg.norm(base - origin, axis=1)
        if np.ptp(position[:, 0], axis=0).max() > 2 * np.ptp(position[:, -1], axis=0).max():
            raise InvalidInput(
                f"{name}: {names[0]} moves more than {names[-1]}, but points go from the clamped"
                f" base to the tip. Give {','.join(reversed(names))}?"
            )
        still = np.percentile(wander, 90) < _STILL * length
        position = position - (origin if still else base[:, None])
    if said[-1] is None:
        said[-1] = 1.0
    film = Film(
        position=position,
        bridged=lost,
        place=np.ones(len(names)),
        interval=tracks.interval,
        origin=origin,
        name=name,
        unit=tracks.unit,
        first=int(whole[0]),
        source="synthetic" if tracks.source == "synthetic" else "recorded",
    )
    return film.replace(place=_find_places(said, film.rest))


def _find_places(said: Sequence[float | None], rest: np.ndarray) -> np.ndarray:
    """Places (point,) where not all are said: by the distance along the resting points."""
    arc = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(rest, axis=0), axis=1))])
    known = [k for k, place in enumerate(said) if place is not None]
    step = np.diff(rest, axis=0)
    turn = np.sum(step[1:] * step[:-1], axis=1)
    back = turn < -0.5 * np.prod(
        [np.linalg.norm(part, axis=1) for part in (step[1:], step[:-1])], 0
    )
    if known[0] != 0:
        raise InvalidInput(
            "without a tracked base the places of points are not known: say them, as in mid@0.5."
        )
    place = np.interp(arc, arc[known], [float(said[k] or 0.0) for k in known])
    if np.any(np.diff(place) <= 0) or np.any(back):
        raise InvalidInput(
            "points must go from base to tip, each farther out than the one before; one of these"
            " goes back."
        )
    return place


def _read_place(point: str) -> float | None:
    _, at, text = point.partition("@")
    if not at:
        return None
    try:
        place = float(text)
    except ValueError:
        place = float("nan")
    if not 0 <= place <= 1:
        raise InvalidInput(
            f"point {point!r}: what follows @ is a fraction of the length, from 0 to 1."
        )
    return place


def _require_landmark(tracks: Tracks, name: str) -> None:
    """Raise InvalidInput, with the nearest names, where the tracks have no such landmark."""
    if name in tracks.landmarks:
        return
    near = difflib.get_close_matches(name, tracks.landmarks, n=2, cutoff=0.5)
    words = f"did you mean {' or '.join(near)}?" if near else "choose one of these."
    raise InvalidInput(
        f"no landmark {name!r}; {words} There are {', '.join(tracks.landmarks[:24])}."
    )


@checked
def join_films(films: Sequence[Film]) -> Traces:
    """The releases of several animals as one set of traces, as long as the shortest.

    Raises
    ------
    InvalidInput
        Two films of one animal, or films of different frame rates.
    """
    parts = [film.make_traces() for film in films]
    steps = {round(film.interval, 6) for film in films}
    if len(steps) > 1:
        rates = ", ".join(f"{film.name} {1e3 / film.interval:.4g}" for film in films)
        raise InvalidInput(
            f"films of different frame rates cannot be fitted together ({rates} frames/s); fit them"
            " one by one, or in feeler animal."
        )
    names = [name for part in parts for name in part.names]
    if len({*names}) < len(names):
        raise InvalidInput(f"each animal needs a name of its own, got {', '.join(names)}.")
    count = min(part.time.size for part in parts)
    return parts[0].replace(
        time=parts[0].time[:count],
        displacement=np.concatenate([part.displacement[:, :count] for part in parts]),
        bridged=np.concatenate([part.bridged[:, :count] for part in parts]),
        names=tuple(names),
    )
