"""What a turnable view of a touch in space draws: the antenna at every moment and the object's
edges, as numbers for ``report/turn.js``.
"""

from collections.abc import Iterator
from typing import Any

import matplotlib as mpl
import numpy as np
import xarray as xr
from scipy.spatial import ConvexHull

from feeler.antenna.antenna import Antenna
from feeler.errors import InvalidInput
from feeler.plotting.look import TENSOR_COLOURS
from feeler.plotting.posture import OBJECT_COLOUR
from feeler.plotting.space import make_sheet, make_surface
from feeler.records.checked import checked
from feeler.stimulus import Trial, place
from feeler.stimulus.feature import Feature
from feeler.stimulus.solid import list_solids
from feeler.tensors.posture import compute_bend, reconstruct_posture
from feeler.tensors.sides import measure_peak
from feeler.tensors.unit import in_unit

_FRAMES = 100  # [C] moments at most
_LEVELS = 32  # [C] colours of a bend
_EVERY = 4  # [C] of the lines around a ball or a peg, one is drawn


@checked
def describe_turnable(antenna: Antenna, trial: Trial, tensors: xr.Dataset) -> dict[str, Any]:
    """The first touch of a Dataset with all hinges of an antenna in space, for
    :meth:`feeler.report.Section.turnable`.

    Returns
    -------
    dict
        ``time`` (frame,) [ms]; ``points`` (frame, joint, 3) [mm]; ``bend`` (frame, segment), which
        of the ``colours``; ``top`` [1/mm], the curvature of the last; ``lines`` of the object
        (line)(corner)(3) [mm] at time 0; ``shift`` (frame, 3) [mm] of them; ``reach`` [mm].

    Raises
    ------
    InvalidInput
        An antenna in the plane.
    """
    placed = place(antenna, trial)
    if placed.left is None:
        raise InvalidInput(
            f"{antenna.name!r} lies in a plane, which there is nothing to turn: take an antenna in"
            " space (docs/space.md), or write_touch_movie."
        )
    time = in_unit(tensors["time"], "ms").values
    frames = np.unique(
        np.linspace(0, len(time) - 1, min(_FRAMES, len(time))).round().astype(int)
    )
    bend = compute_bend(tensors, antenna)[frames]
    top = measure_peak(bend) or 1.0
    edges = _list_lines(trial.shape, np.asarray(placed.origin), placed.axes, antenna.length)
    return {
        "time": time[frames].round(2).tolist(),
        "points": reconstruct_posture(tensors, antenna).values[0][frames].round(3).tolist(),
        "bend": np.floor(bend / top * (_LEVELS - 1e-9)).astype(int).tolist(),
        "colours": [mpl.colors.to_hex(c) for c in _sample_colours()],
        "top": top,
        "lines": [line.round(3).tolist() for line in edges],
        "object": OBJECT_COLOUR,
        "shift": (placed.velocity * time[frames, None]).round(3).tolist(),
        "reach": float(antenna.length),
    }


def _sample_colours() -> np.ndarray:
    return mpl.colormaps[TENSOR_COLOURS](np.linspace(0, 1, _LEVELS))


def _list_lines(
    feature: Feature, origin: np.ndarray, axes: np.ndarray, reach: float
) -> Iterator[np.ndarray]:
    """Edges (corner, 3) [mm] of a feature whose frame stands at ``origin`` with ``axes``."""
    if feature.unbounded:
        sheet = np.moveaxis(make_sheet(origin, axes, reach), 0, -1)
        yield sheet[[0, 0, 1, 1, 0], [0, 1, 1, 0, 0]]
        return
    for corners in list_solids(feature):
        own = origin + corners @ axes
        if len(own) > 2:
            for triangle in ConvexHull(own).simplices:
                yield own[[*triangle, triangle[0]]]
            continue
        skin = np.moveaxis(make_surface(own[0], own[-1], feature.rounding), 0, -1)
        yield from skin[:, ::_EVERY]
        yield from np.swapaxes(skin, 0, 1)[:, ::_EVERY]
