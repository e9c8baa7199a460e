"""Writing so that it lasts: a file is complete under its name or absent, and a finished one
survives a power cut.
"""

import contextlib
import os
import secrets
import shutil
from collections.abc import Iterator
from pathlib import Path

from feeler.disk.files import FULL
from feeler.errors import FeelerError, StoreError

TEMPORARY = ".tmp"
_LEAST_SHARE = (
    0.7  # [C] of their size in memory that tensors take at least when they are compressed
)


def write_atomic(path: Path, data: bytes, *, durable: bool = True) -> None:
    """Write ``data`` under another name, wait for the disk, rename, wait again: whole or absent at
    any moment.

    ``durable=False`` does not wait: whole or absent still if the process is killed, but not if the
    power fails.
    """
    path = Path(path)
    temporary = path.with_name(f".{path.name}.{secrets.token_hex(4)}{TEMPORARY}")
    try:
        with open(temporary, "wb") as file:
            file.write(data)
            if durable:
                file.flush()
                os.fsync(file.fileno())
        os.replace(temporary, path)
    except BaseException:
        temporary.unlink(missing_ok=True)
        raise
    if durable:
        sync_folder(path.parent)


def check_room(path: Path, n_bytes: int, what: str) -> None:
    """Refuse what will not find room on the disk; numbers of touches shrink by a tenth or more when
    they are compressed.

    Raises
    ------
    StoreError
        With the estimate, and what is free.
    """
    free = shutil.disk_usage(path if path.exists() else path.absolute().parent).free
    if _LEAST_SHARE * n_bytes > free:
        raise StoreError(
            f"{what} need about {n_bytes / 2**30:.3g} GiB at {path}, where {free / 2**30:.3g} GiB"
            ' are free. Free some space, or ask for fewer trials, for save=("angle",) or for'
            ' dtype="float32".'
        )


def measure_folder(folder: Path) -> int:
    """Bytes of all files in a folder and in those within it."""
    entries = [*os.scandir(folder)]
    files = sum(
        entry.stat().st_size for entry in entries if entry.is_file(follow_symlinks=False)
    )
    return files + sum(
        measure_folder(Path(entry.path))
        for entry in entries
        if entry.is_dir(follow_symlinks=False)
    )


def sync_folder(folder: Path) -> None:
    """Wait until the disk has the folder's list of names."""
    descriptor = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


@contextlib.contextmanager
def explain(path: Path, state: str = "nothing is lost") -> Iterator[None]:
    """Turn the system's errors into a StoreError that says what is safe and what to do."""
    try:
        yield
    except FeelerError:
        raise
    except OSError as error:
        if error.errno in FULL:
            room = shutil.disk_usage(path if path.exists() else path.absolute().parent).free
            raise StoreError(
                f"no room left for the store {path} ({room / 2**20:.1f} MiB free): {state}. "
                "Free some space and run the same command again; it goes on where it stopped."
            ) from error
        raise StoreError(
            f"cannot write the store {path}: {error.strerror or error}; {state}."
        ) from error
