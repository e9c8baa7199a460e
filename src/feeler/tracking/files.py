"""What ``feeler info`` says of a tracker's file."""

import re
from pathlib import Path

import numpy as np

from feeler.disk.guard import Limits
from feeler.errors import InvalidInput
from feeler.tensors.formats import Format
from feeler.tensors.heading import find_heading
from feeler.tensors.kinds import HDF5
from feeler.tensors.table import Table
from feeler.tracking.trackers import PLACEHOLDER, Found, read_tracker
from feeler.tracking.tracks import MIN_LIKELIHOOD, read_landmarks

_SCORER = re.compile(rb"(?m)^\s*\"?scorer\"?[,;\t]")
_MAX_NAMES = 12


def _is_tracks(path: Path, start: bytes) -> bool:
    """Whether a file may hold landmarks: HDF5, or a table with a column x and y of one point."""
    if start.startswith(HDF5) or _SCORER.search(start.removeprefix(b"\xef\xbb\xbf")):
        return True
    if b"\0" in start:
        return False
    heading = find_heading(enumerate(start.decode("utf-8-sig", "ignore").split("\n"), 1))
    names = [] if heading is None else [name.lower() for name in heading.names]
    points = [name[:-1] for name in names if re.search(r"[_. ]x$", name)]
    return any(f"{point}y" in names for point in points)


def _load(path: Path, limits: Limits, trusted: bool) -> list[str]:
    found = read_tracker(path, None, first=True)
    if isinstance(found, Table):
        found = read_landmarks(found)
    if not len(found.position):
        raise InvalidInput(
            f"{path.name} names {_list(found.names)}, but holds no frame of a film."
        )
    rate = "not in the file (--frame-rate)"
    if found.frame_rate is not None:
        rate = f"{found.frame_rate:g} frames/s, as the file claims (--frame-rate mends it)"
    if found.timed:
        rate = f"{found.frame_rate:.4g} frames/s, by {found.timed}"
    lines = [
        f"by          {found.software or 'no tracker that is named'}",
        f"landmarks   {_list(found.names)}",
        f"frames      {found.position.shape[0]}, frame rate {rate}",
        *_describe_animals(found),
        *_describe_spans(found),
    ]
    lines += [f"{name:12}{text}" for name, text in found.notes.items()]
    return [*lines, f"next        {_suggest(path, found)}"]


def _list(names: tuple[str, ...]) -> str:
    more = f", … ({len(names)} in all)" if len(names) > _MAX_NAMES else ""
    return ", ".join(names[:_MAX_NAMES]) + more


def _describe_animals(found: Found) -> list[str]:
    if len(found.individuals) < 2:
        return []
    animals = _list(found.individuals)
    return [f"animals     {animals} (--individual chooses); said of {found.individuals[0]}:"]


def _describe_spans(found: Found) -> list[str]:
    """Where the landmarks are, by axis, and how many of them were not seen or are doubted."""
    seen = np.isfinite(found.position).any(axis=2)
    lines = []
    for axis, values in zip("xyz", np.moveaxis(found.position, 2, 0), strict=False):
        if np.isfinite(values).any():
            low, high = np.nanmin(values), np.nanmax(values)
            lines.append(f"{axis:12}{low:.4g} … {high:.4g} [{found.unit}]")
    lines.append(f"seen        {seen.mean():.1%} of places")
    if found.likelihood is not None and seen.any():
        share = np.mean(found.likelihood[seen] < MIN_LIKELIHOOD)
        lines.append(f"doubted     {share:.1%} of them (likelihood below {MIN_LIKELIHOOD:g})")
    return lines


def _suggest(path: Path, found: Found) -> str:
    """The command that measures with these landmarks; those that it needs are to be named."""
    words = ["feeler tracks", path.name]
    tips = [name if name in found.names else "" for name in ("left_tip", "right_tip")]
    if not all(tips):
        words.append(f"--tips {','.join(tips) if any(tips) else 'LEFT,RIGHT'}")
    if not {"head", "abdomen"} <= {*found.names}:
        words.append("--body HEAD,ABDOMEN")
    if found.frame_rate is None or found.frame_rate <= PLACEHOLDER:
        words.append("--frame-rate RATE")
    if found.position.shape[2] == 3:
        words.append("--plane space")
    if len(found.individuals) > 1:
        words.append(f"--individual {found.individuals[0]}")
    if len(found.names) < 3:
        words.append(
            f"(which needs a tip, head and abdomen, or three --points; here are {len(found.names)}"
            " landmarks. feeler calibrate --data takes a column frame and how far tips are aside)"
        )
    return " ".join(words)


TRACK_FILES = {
    "tracks": Format(
        words="tracks of landmarks",
        kind="tracks",
        detect=_is_tracks,
        load=_load,
        tell=list,
    ),
}
