"""The guard: a file from outside is opened by its library in a process of its own, with limits on
memory and time.

``function(path)`` runs there and gives JSON and arrays (anything with shape, dtype and ``[...]``).
A line of JSON with the arrays' types comes back through one pipe, then their numbers; what is wrong
comes through another. Whatever a hostile file does to its library happens in that process, which
can write no file and is ended at the limits.
"""

import contextlib
import json
import math
import os
import re
import signal
import subprocess
import sys
import threading
from collections.abc import Iterable, Iterator
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
_TYPE = re.compile(r"[<>|=]?(?:b1|[iu][1248]|f[248])")
_ENVIRONMENT = {
    "OPENBLAS_NUM_THREADS": "1",
    "HDF5_PLUGIN_PRELOAD": "::",
    "HDF5_USE_FILE_LOCKING": "FALSE",
}
MAX_TEXT = 64 * 2**20  # [C] bytes of JSON and other text in one file
_Answer = tuple[Any, dict[str, Any]]


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
) -> _Answer:
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
    return _ask(function, os.fspath(path), find_limits(limits), Path(path).name, words)


def _ask(
    function: str, path: str, limits: Limits, name: str, words: tuple[str, ...]
) -> _Answer:
    """What a process that runs :func:`main` answers."""
    import numpy as np  # slow to load, and not needed for TOML

    files = (os.path.join(folder, file) for folder, _, names in os.walk(path) for file in names)
    size = sum(os.lstat(file).st_size for file in [path, *islice(files, 10_000)])
    seconds = limits.max_seconds + 30 * size / 2**30
    command = [sys.executable, "-P", "-m", "feeler.sandbox", function, path]
    command += [str(limits.max_bytes), str(seconds), *words]
    paths = os.pathsep.join(filter(None, sys.path))
    pipe = subprocess.PIPE
    with subprocess.Popen(
        command,
        env={**os.environ, **_ENVIRONMENT, "PYTHONPATH": paths},
        stdin=subprocess.DEVNULL,
        stdout=pipe,
        stderr=pipe,
    ) as process:
        clock = threading.Timer(
            seconds if resource is None else 6 * seconds + 30, process.kill
        )  # others want the CPU
        clock.start()
        try:
            head = process.stdout.readline(MAX_TEXT + 2)  # type: ignore[union-attr]
            content, plan = json.loads(head) if head.endswith(b"\n") else (None, [])
            _check_bytes(limits, plan, name)  # before memory is taken
            arrays = {key: np.empty(shape, kind) for key, kind, shape in plan}
            for values in arrays.values():
                process.stdout.readinto(values.reshape(-1).view(np.uint8))  # type: ignore[union-attr]
            said = process.stderr.read(1000).decode("utf-8", "replace")  # type: ignore[union-attr]
            code = process.wait()
        finally:
            clock.cancel()
            process.kill()
    if code:
        slow = code in (-signal.SIGKILL, -getattr(signal, "SIGXCPU", 0))
        fate = (
            f"took longer than {seconds:.3g} s (Limits.max_seconds)"
            if slow
            else f"broke down (code {code})"
        )
        raise InvalidInput(f"{name} is damaged or hostile: its reader {fate} over it.")
    if said or content is None:
        raise InvalidInput(f"{name}: {said or 'is damaged: its reader ended early.'}")
    return content, arrays


def _check_bytes(limits: Limits, plan: Iterable[tuple[str, str, list[int]]], what: str) -> None:
    """Raise where arrays are no plain numbers, or take too many bytes."""
    n_bytes = 0
    for name, kind, shape in plan:
        if not _TYPE.fullmatch(kind):
            raise InvalidInput(
                f"{name[:60]!r} has the type {kind}; readable are numbers and texts."
            )
        import numpy as np  # slow to load, and not needed for TOML

        n_bytes += math.prod(shape) * np.dtype(kind).itemsize
    limits.check_bytes(n_bytes, what)


def answer(function: str, path: str, max_bytes: int, *words: str) -> Iterator[Any]:
    """The line of JSON, then each array; any failure becomes an InvalidInput about the file."""
    try:
        content, arrays = resolve_name(function)(path, *words)
        plan = [
            (name, item.dtype.str, list(map(int, item.shape))) for name, item in arrays.items()
        ]
        _check_bytes(Limits(max_bytes=max_bytes), plan, "it")
        text = json.dumps([content, plan], default=str)
        if len(text) > MAX_TEXT:
            raise InvalidInput(
                f"it holds {len(text) >> 20} MiB of text, over the limit of {MAX_TEXT >> 20} MiB."
            )
        yield text.encode() + b"\n"
        yield from (item[...] for item in arrays.values())
    except InvalidInput:
        raise
    except MemoryError as error:
        raise InvalidInput(
            f"it needs more memory than the limit of {max_bytes / 2**30:.4g} GiB (FEELER_MAX_GIB)."
        ) from error
    # whatever a library says of a damaged file is news about the file, not about us
    except Exception as error:
        said = " ".join(f"{type(error).__name__}: {error}".split())[:200]
        raise InvalidInput(f"is damaged or of another kind ({said}).") from error


def main() -> None:
    """Answer on standard output and error; what libraries print goes nowhere."""
    function, path, max_bytes, seconds, *words = sys.argv[1:]
    out, wrong = os.fdopen(os.dup(1), "wb"), os.dup(2)
    for number in (1, 2):
        os.dup2(os.open(os.devnull, os.O_WRONLY), number)
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
    try:
        for part in answer(function, path, int(max_bytes), *words):
            plain = isinstance(part, bytes) or part.flags.c_contiguous
            out.write(part if plain else part.copy())
        out.flush()
    except InvalidInput as error:
        os.write(wrong, str(error).encode("utf-8", "replace"))


if __name__ == "__main__":
    main()
