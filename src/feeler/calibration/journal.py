"""Journal: every simulated antenna of a search on disk, so that an interrupted search replays it
and goes on.
"""

import json
from pathlib import Path

import numpy as np

from feeler.calibration.hinges import Hinges
from feeler.calibration.protocol import Protocol
from feeler.calibration.targets import Targets
from feeler.errors import InvalidInput
from feeler.provenance import make_key
from feeler.tensors.lock import Lock
from feeler.tensors.reading import parse_json, read_bytes

MAX_BYTES = 256 * 2**20  # [C] a million antennas
BEGINNING = b'{"key": "'
Entry = tuple[np.ndarray, float]
"""Residuals (target,) and the processor time [s] that they took."""


class Journal:
    """Searched vectors with what they gave, one line of JSON each, written as soon as it is known;
    ``of`` a fit or a search.

    The optimisers are deterministic: run again on the same journal they ask for the same vectors,
    get them from it bit by bit, and simulate from where the earlier run was stopped. A line that
    was cut while being written is dropped.

    Raises
    ------
    InvalidInput
        The file is something else (it is left alone), or belongs to another problem (``key``).
    StoreError
        Another process writes to it.
    """

    def __init__(self, path: str | Path, key: str, of: str = "fit") -> None:
        path = Path(path)
        self._lock = Lock(path.with_name(f".{path.name}.lock"), f"the checkpoint {path}")
        try:
            self._entries, whole = read_journal(path, key, of) if path.exists() else ({}, 0)
            self._file = path.open("ab")
        except BaseException:
            self._lock.release()
            raise
        self._file.truncate(whole)
        if not whole:
            self._write({"key": key})

    def __len__(self) -> int:
        return len(self._entries)

    def find(self, x: np.ndarray) -> Entry | None:
        """What is known of the vector ``x``."""
        return self._entries.get(_name(x))

    def add(self, x: np.ndarray, entry: Entry) -> None:
        """Remember ``x`` here and on disk."""
        self._entries[_name(x)] = entry
        self._write({"x": x.tolist(), "residuals": entry[0].tolist(), "seconds": entry[1]})

    def _write(self, line: dict[str, object]) -> None:
        self._file.write(json.dumps(line).encode() + b"\n")
        self._file.flush()

    def close(self) -> None:
        """Let go of the file."""
        self._file.close()
        self._lock.release()

    def __enter__(self) -> "Journal":
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


def read_journal(path: Path, key: str, of: str = "fit") -> tuple[dict[bytes, Entry], int]:
    """Entries of a journal by vector, and how many bytes of the file are whole lines."""
    raw = read_bytes(path, MAX_BYTES)
    whole = raw.rfind(b"\n") + 1
    if (
        not whole and raw and not BEGINNING.startswith(raw[: len(BEGINNING)])
    ):  # not even the torn first line of one
        raise InvalidInput(
            f"{path} is no checkpoint of a {of}. Name another; this file is left as it is."
        )
    lines = raw[:whole].splitlines()
    try:
        if lines and parse_json(lines[0], "its first line")["key"] != key:
            raise InvalidInput(
                f"{path} belongs to another {of}: antenna, family, bounds, targets, task, protocol"
                " or versions differ. Remove it, or name another."
            )
        return dict(_read_line(line) for line in lines[1:]), whole
    except (KeyError, TypeError, ValueError, OverflowError) as error:
        if isinstance(error, InvalidInput) and "belongs" in str(error):
            raise
        raise InvalidInput(
            f"{path} is no checkpoint of a {of} ({error}). Remove it or name another."
        ) from error


def _read_line(line: bytes) -> tuple[bytes, Entry]:
    data = parse_json(line, "a line")
    x, residuals = (np.array(data[name], dtype=float) for name in ("x", "residuals"))
    seconds = float(data["seconds"])
    if x.ndim != 1 or residuals.ndim != 1 or not np.all(np.isfinite([*x, *residuals, seconds])):
        raise ValueError("x and residuals must be rows of finite numbers")
    return _name(x), (residuals, seconds)


def _name(x: np.ndarray) -> bytes:
    return np.ascontiguousarray(x, dtype=float).tobytes()


def describe_problem(hinges: Hinges, targets: Targets, protocol: Protocol) -> str:
    """A short text that changes with anything that changes a residual."""
    made_with = {
        "hinges": hinges.name,
        "bounds": hinges.bounds,
        "antenna": hinges.build(hinges.start),
    }
    return make_key(
        made_with | {"protocol": protocol, "targets": targets}, "feeler.calibration.problem"
    )
