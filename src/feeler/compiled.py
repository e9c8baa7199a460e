"""``@compiled``: numba with a cache on disk that notices a change in any file of the function's room.

Numba alone looks only at the file of the function itself. But machine code holds whatever it calls, and the constants
it reads: after a change in a neighbouring file, numba's own cache would go on giving the old numbers.
"""

from collections.abc import Callable
from functools import cache, partial
from pathlib import Path

from numba import njit


def compiled(function: Callable | None = None, **options: object) -> Callable:
    """``function`` compiled at its first call, without Python's lock, errors as in NumPy; ``options`` are numba's."""
    if function is None:
        return partial(compiled, **options)
    dispatcher = njit(cache=True, nogil=True, error_model="numpy", **options)(function)
    if hasattr(dispatcher, "_cache"):  # absent under NUMBA_DISABLE_JIT
        file = dispatcher._cache._cache_file
        file._source_stamp = (file._source_stamp, stamp_folder(Path(function.__code__.co_filename).parent))
    return dispatcher


@cache
def stamp_folder(folder: Path) -> tuple[tuple[str, int, int], ...]:
    """Name, time of change [ns] and size of each Python file in a folder."""
    files = sorted(folder.glob("*.py"))
    return tuple((file.name, file.stat().st_mtime_ns, file.stat().st_size) for file in files)
