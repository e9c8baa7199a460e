"""Posture of a tracked flagellum: headings of its pieces and bends between them, from any number of
points.
"""

from collections.abc import Sequence
from typing import Any

import numpy as np
import xarray as xr

from feeler.errors import InvalidInput
from feeler.records.checked import checked
from feeler.tracking.tracks import Tracks


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
