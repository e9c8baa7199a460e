"""What ``feeler info`` says of a tracker's file."""

import re
from pathlib import Path

from feeler.errors import InvalidInput
from feeler.guard import Limits
from feeler.tensors.formats import Format
from feeler.tensors.table import Table
from feeler.tracking.trackers import HDF5_ENDINGS, read_tracker
from feeler.tracking.tracks import load_tracks

_HEADER = re.compile(rb"(?m)^\s*scorer[,;\t]|pt1_cam1_X|[_. ]x[,;\t][^,;\t\n]*[_. ]y\b|_ncams")


def _load(path: Path, limits: Limits, trusted: bool) -> list[str]:
    try:
        found = read_tracker(path, None, None)
    except InvalidInput as error:  # several individuals, or places in space: it says which
        if not re.search("individual=|plane=", str(error)):
            raise
        return [str(error)]
    rate = None if isinstance(found, Table) else found.frame_rate
    tracks = load_tracks(path, frame_rate=rate or 1.0)
    told = "not in the file (--frame-rate)" if rate is None else f"{rate:g} frames/s"
    lines = [
        f"landmarks   {', '.join(tracks.landmarks)}",
        f"frames      {tracks.n_frames}, frame rate {told}",
        f"unit        {tracks.unit}",
    ]
    doubted = ", ".join(f"{name} in {n}" for name, n in tracks.doubted.items())
    lines += [f"doubted     {doubted} frames"] if doubted else []
    return lines + [f"{name:12}{text}" for name, text in tracks.notes.items()]


TRACK_FILES = {
    "tracks": Format(
        words="tracks of landmarks",
        kind="tracks",
        detect=lambda path, start: (
            path.suffix.lower() in HDF5_ENDINGS or _HEADER.search(start) is not None
        ),
        load=_load,
        tell=list,
    ),
}
