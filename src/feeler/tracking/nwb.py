"""Tracked landmarks as poses in Neurodata Without Borders (ndx-pose), one clock for all films;
needs the extra ``nwb``.
"""

import json
import os
from collections.abc import Mapping, Sequence
from datetime import datetime
from typing import Any

import numpy as np

from feeler.errors import InvalidInput
from feeler.records.checked import checked
from feeler.tensors.nwb import PAUSE, make_nwb, make_subject, require_pynwb, write_nwb
from feeler.tensors.poses import name_series
from feeler.tracking.tracks import Tracks


@checked
def save_poses(
    trials: Sequence[Tracks],
    path: str | os.PathLike,
    *,
    session_start: datetime | str,
    identifier: str,
    edges: Sequence[tuple[str, str]] = (),
    subject: str = "",
    settings: Mapping[str, Any] | None = None,
) -> None:
    """Write films of one animal as NWB: a table of trials, and for each a ``PoseEstimation`` with a
    series per landmark, its places as the tracker gave them (``Tracks.unfiltered``) and, where it
    gave one, its likelihood as ``confidence``.

    All films share the session's clock: each begins 1 s after the one before has ended, because
    tracks do not hold when they were filmed. ``load_tracks(path, individual="trial_000000")`` reads
    one again.

    Parameters
    ----------
    trials
        With the same landmarks, in px or mm (stored in mm, with the factor to metres).
    session_start, identifier, subject
        As :func:`feeler.tensors.nwb.save_nwb` has them.
    edges
        Which landmarks are joined, for instance neighbours along a flagellum.
    settings
        What the films were measured with (plain data), kept as JSON in ``data_collection``;
        ``load_tracks`` gives it back as ``Tracks.settings``.

    Raises
    ------
    MissingExtra
        pynwb or ndx-pose is not installed.
    InvalidInput
        No trial, other landmarks in one of them, an edge to an unknown one, or no time zone.
    """
    require_pynwb()
    names = trials[0].landmarks if trials else ()
    if not names or any(one.landmarks != names for one in trials):
        raise InvalidInput(
            "poses need at least one film, and in all of them the same landmarks in the same order."
        )
    if unknown := [name for edge in edges for name in edge if name not in names]:
        raise InvalidInput(f"an edge joins {unknown[0]!r}; the tracks hold {', '.join(names)}.")
    file = make_nwb(
        identifier,
        session_start,
        words=f"feeler: {', '.join(sorted({one.source for one in trials}))} landmarks",
        about=f"{len(trials)} films of tracked landmarks; missing places are NaN",
        subject=make_subject(subject),
        data_collection=json.dumps({"feeler tracks": dict(settings)}) if settings else None,
    )
    from ndx_pose import Skeleton, Skeletons

    places = np.array(
        [[names.index(name) for name in edge] for edge in edges], dtype=np.uint8
    ).reshape(-1, 2)
    skeleton = Skeleton(name="skeleton", nodes=list(names), edges=places)
    module = file.create_processing_module("behavior", "tracked landmarks")
    module.add(Skeletons(skeletons=[skeleton]))
    begin = 0.0
    for number, one in enumerate(trials):
        poses = _make_poses(one, f"trial_{number:06d}", skeleton, begin)
        module.add(poses)
        end = begin + float(one.time[-1]) * 1e-3
        file.add_trial(
            start_time=begin,
            stop_time=end,
            timeseries=list(poses.pose_estimation_series.values()),
        )
        begin = end + PAUSE
    write_nwb(file, path)


def _make_poses(tracks: Tracks, title: str, skeleton: Any, begin: float) -> Any:
    """One film; a series per landmark."""
    from ndx_pose import PoseEstimation, PoseEstimationSeries

    unit: dict[str, Any] = {"unit": "pixels" if tracks.unit == "px" else "unknown"}
    if tracks.unit == "mm":
        unit = {"unit": "meters", "conversion": 1e-3}
    whole = tracks.position if tracks.unfiltered is None else tracks.unfiltered
    flat = whole.shape[2] == 2
    frame = "(0, 0) is the centre of the film's first pixel; x to the right, y downwards"
    series = [
        PoseEstimationSeries(
            name=title,
            data=place * ((1.0, -1.0) if flat else 1.0),
            reference_frame=frame if flat else "that of the cameras' calibration",
            description=f"place of {name}; NaN where it was not seen",
            starting_time=begin,
            rate=float(np.round(1e3 / tracks.interval, 6)),
            **unit,
            **sure,
        )
        for name, title, place, sure in zip(
            tracks.landmarks,
            name_series(tracks.landmarks),
            np.moveaxis(whole, 1, 0),
            _list_confidence(tracks),
            strict=True,
        )
    ]
    return PoseEstimation(
        name=title,
        pose_estimation_series=series,
        description=f"{tracks.source} landmarks, as feeler read them",
        source_software=tracks.notes.get("software", "unknown"),
        skeleton=skeleton,
    )


def _list_confidence(tracks: Tracks) -> list[dict[str, Any]]:
    """What a series says of its landmark's likelihood."""
    if tracks.likelihood is None:
        return [{} for _ in tracks.landmarks]
    words = "likelihood by the tracker; NaN where it gave none"
    return [{"confidence": row, "confidence_definition": words} for row in tracks.likelihood.T]
