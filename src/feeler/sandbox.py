"""The guard: a file from outside is opened by its library in a process of its own, with limits on
memory and time.

``function(path)`` runs there and gives JSON and arrays (anything with shape, dtype and slices).
They come back through a pipe in frames: ``j`` the JSON and the arrays' types, ``d`` a block of
numbers, ``e`` what is wrong. Whatever a hostile file does to its library happens in that process,
which can write no file and is ended at the limits.
"""

import contextlib
import json
import math
import os
import re
import signal
import struct
import subprocess
import sys
import threading
from collections.abc import Iterator
from dataclasses import dataclass
from importlib.util import find_spec
from itertools import islice
from pathlib import Path
from pkgutil import resolve_name
from typing import Any

from feeler.errors import InvalidInput

resource: Any = (
    resolve_name("resource") if find_spec("resource") else None
)  # where there is none, the clock ends it
_BASE = 512 * 2**20  # bytes for the interpreter and the libraries, beside the numbers
_BLOCK = 16 * 2**20  # bytes sent together
_TYPE = re.compile(r"[<>|=]?(?:b1|[iu][1248]|f[248])")
_ENVIRONMENT = {
    "OPENBLAS_NUM_THREADS": "1",
    "HDF5_PLUGIN_PRELOAD": "::",
    "HDF5_USE_FILE_LOCKING": "FALSE",
}
MAX_TEXT = 64 * 2**20  # [C] bytes of JSON and other text in one file
_FRAME = struct.Struct(">cQ")
_Frames = Iterator[tuple[bytes, bytes]]


@dataclass(frozen=True, kw_only=True)
class Limits:
    """What one file from outside may cost; [C], also by FEELER_MAX_GIB and FEELER_MAX_SECONDS.

    Attributes
    ----------
    max_bytes : int
        Bytes of numbers once unpacked; the process that reads may take 512 MiB more.
    max_seconds : float
        Processor time [s], and 30 s more for each GiB that the file has on disk.
    """

    max_bytes: int = 4 * 2**30
    max_seconds: float = 10.0

    def __post_init__(self) -> None:
        for name, value in vars(self).items():
            if not value > 0:
                raise InvalidInput(f"Limits.{name} must be > 0, got {value!r}.")

    def check_bytes(self, n_bytes: int, what: str) -> None:
        """Raise where ``n_bytes`` exceeds ``max_bytes``."""
        if n_bytes > self.max_bytes:
            raise InvalidInput(
                f"{what} asks for {n_bytes / 2**30:.4g} GiB, over the limit of"
                f" {self.max_bytes / 2**30:.4g} GiB. If you trust the file, raise the limit:"
                " Limits(max_bytes=…), or FEELER_MAX_GIB in the environment."
            )


def find_limits(limits: Limits | None = None) -> Limits:
    """The limits given, or the defaults with what the environment says."""
    if limits is not None:
        return limits
    values: dict[str, float] = {}
    for name, field, factor in (
        ("FEELER_MAX_GIB", "max_bytes", 2**30),
        ("FEELER_MAX_SECONDS", "max_seconds", 1.0),
    ):
        if text := os.environ.get(name):
            try:
                values[field] = type(factor)(float(text) * factor)
            except (ValueError, OverflowError):
                raise InvalidInput(f"{name} must be a number > 0, got {text[:40]!r}.") from None
    return Limits(**values)  # type: ignore[arg-type]


def open_guarded(
    function: str,
    path: str | os.PathLike,
    limits: Limits | None = None,
    *,
    trusted: bool = False,
    words: tuple[str, ...] = (),
) -> tuple[Any, dict[str, Any]]:
    """What ``function`` (``"module:name"``) makes of a file or folder: JSON, arrays by name;
    ``trusted``: here, without limits.

    ``words`` are given to the function after the path.

    Raises
    ------
    InvalidInput
        Damaged, of another kind, over the limits, or its library crashed or hung over it.
    """
    if trusted:
        content, arrays = resolve_name(function)(os.fspath(path), *words)
        return content, {key: item[...] for key, item in arrays.items()}
    limits, name = find_limits(limits), Path(path).name
    frames = _ask(function, os.fspath(path), limits, name, words)
    content, plan = json.loads(_take(frames, b"j", name))
    limits.check_bytes(
        sum(math.prod(shape) * int(kind[-1]) for _, kind, shape in plan), name
    )  # before memory is taken
    return content, {key: _fill(frames, kind, shape, name) for key, kind, shape in plan}


def _fill(frames: _Frames, kind: str, shape: list[int], name: str) -> Any:
    import numpy as np  # whoever reads TOML does without

    values, place = np.empty(math.prod(shape) * int(kind[-1]), np.uint8), 0
    while place < values.size:
        part = np.frombuffer(_take(frames, b"d", name), np.uint8)
        values[place : place + part.size] = part
        place += part.size
    return values.view(kind).reshape(shape)


def _take(frames: _Frames, wanted: bytes, name: str) -> bytes:
    kind, part = next(frames, (b"e", b"is damaged: its reader ended early."))
    if kind != wanted or (wanted == b"d" and not part):
        raise InvalidInput(f"{name}: {part[:1000].decode('utf-8', 'replace')}")
    return part


def _ask(function: str, path: str, limits: Limits, name: str, more: tuple[str, ...]) -> _Frames:
    """Frames from a process that runs :func:`main`."""
    files = (os.path.join(folder, file) for folder, _, names in os.walk(path) for file in names)
    size = sum(os.lstat(file).st_size for file in [path, *islice(files, 10_000)])
    seconds = limits.max_seconds + 30 * size / 2**30
    command = [
        sys.executable,
        "-P",
        "-m",
        "feeler.sandbox",
        function,
        path,
        str(limits.max_bytes),
        str(seconds),
    ]
    command += more
    environment = {
        **os.environ,
        **_ENVIRONMENT,
        "PYTHONPATH": os.pathsep.join(filter(None, sys.path)),
    }
    pipes = {
        "stdin": subprocess.DEVNULL,
        "stdout": subprocess.PIPE,
        "stderr": subprocess.DEVNULL,
    }
    with subprocess.Popen(command, env=environment, **pipes) as process:  # type: ignore[call-overload]
        clock = threading.Timer(
            seconds if resource is None else 6 * seconds + 30, process.kill
        )  # others want the CPU
        clock.start()
        try:
            while len(head := process.stdout.read(_FRAME.size)) == _FRAME.size:
                kind, length = _FRAME.unpack(head)
                yield kind, process.stdout.read(min(length, MAX_TEXT))
            if code := process.wait():
                slow = code in (-signal.SIGKILL, -getattr(signal, "SIGXCPU", 0))
                fate = (
                    f"took longer than {seconds:.3g} s (Limits.max_seconds)"
                    if slow
                    else f"broke down (code {code})"
                )
                raise InvalidInput(f"{name} is damaged or hostile: its reader {fate} over it.")
        finally:
            clock.cancel()
            process.kill()


def answer(function: str, path: str, max_bytes: int, *words: str) -> _Frames:
    """The frames of one file; any failure becomes the last of them."""
    try:
        content, arrays = resolve_name(function)(path, *words)
        plan = [
            [name, item.dtype.str, list(map(int, item.shape))] for name, item in arrays.items()
        ]
        for name, kind, _ in plan:
            if not _TYPE.fullmatch(kind):
                raise InvalidInput(
                    f"{name[:60]!r} has the type {kind}; readable are numbers and texts."
                )
        text = json.dumps([content, plan], default=str).encode()
        if len(text) > MAX_TEXT:
            raise InvalidInput(
                f"it holds {len(text) >> 20} MiB of text, over the limit of {MAX_TEXT >> 20} MiB."
            )
        Limits(max_bytes=max_bytes).check_bytes(
            sum(math.prod(shape) * int(kind[-1]) for _, kind, shape in plan), "it"
        )
        yield b"j", text
        yield from ((b"d", block) for item in arrays.values() for block in _cut(item))
    except InvalidInput as error:
        yield b"e", str(error).encode("utf-8", "replace")
    except MemoryError:
        yield (
            b"e",
            (
                f"it needs more memory than the limit of {max_bytes / 2**30:.4g} GiB"
                " (FEELER_MAX_GIB)."
            ).encode(),
        )
    # whatever a library says of a damaged file is news about the file, not about us
    except Exception as error:
        said = " ".join(f"{type(error).__name__}: {error}".split())[:200]
        yield b"e", f"is damaged or of another kind ({said}).".encode("utf-8", "replace")


def _cut(item: Any) -> Iterator[bytes]:
    """An array's bytes in blocks; read by whole rows, and by whole chunks of the file."""
    n_bytes, n_rows, rows = math.prod(item.shape) * item.dtype.itemsize, 1, 1
    if whole := bool(item.shape and n_bytes):
        n_rows, chunk = item.shape[0], (getattr(item, "chunks", None) or (1,))[0]
        rows = chunk * max(1, _BLOCK * n_rows // (chunk * n_bytes))
    for start in range(0, n_rows, rows):
        raw = (item[start : start + rows] if whole else item[()]).tobytes()
        yield from (raw[place : place + _BLOCK] for place in range(0, len(raw), _BLOCK))


def main() -> None:
    """Answer on standard output; what libraries print goes elsewhere."""
    function, path, max_bytes, seconds, *words = sys.argv[1:]
    out = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)
    limits = {
        "DATA": int(max_bytes) + _BASE,
        "CPU": math.ceil(float(seconds)),
        "CORE": 0,
        "FSIZE": 0,
    }
    for name, wanted in limits.items():
        with contextlib.suppress(AttributeError, ValueError, OSError):  # what this system has
            kind = getattr(resource, f"RLIMIT_{name}")
            resource.setrlimit(
                kind, (min(wanted, resource.getrlimit(kind)[1] % (1 << 64)),) * 2
            )  # -1: without limit
    for kind, part in answer(function, path, int(max_bytes), *words):
        out.writelines((_FRAME.pack(kind, len(part)), part))
    out.flush()


if __name__ == "__main__":
    main()
