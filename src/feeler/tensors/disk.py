"""Writing so that it lasts: a file is complete under its name or absent, and a finished one survives a power cut."""

import contextlib
import os
import secrets
from pathlib import Path

TEMPORARY = ".tmp"


def write_synced(path: Path, data: bytes) -> None:
    """Write ``data`` to ``path`` and wait until the disk has it; a crash may leave a part."""
    with open(path, "wb") as file:
        file.write(data)
        file.flush()
        os.fsync(file.fileno())


def write_atomic(path: Path, data: bytes, *, durable: bool = True) -> None:
    """Write ``data`` under another name, wait for the disk, rename, wait again: whole or absent at any moment.

    ``durable=False`` does not wait: whole or absent still if the process is killed, but not if the power fails.
    """
    path = Path(path)
    temporary = path.with_name(f".{path.name}.{secrets.token_hex(4)}{TEMPORARY}")
    try:
        if durable:
            write_synced(temporary, data)
        else:
            temporary.write_bytes(data)
        os.replace(temporary, path)
    except BaseException:
        temporary.unlink(missing_ok=True)
        raise
    if durable:
        sync_folder(path.parent)


def sync_folder(folder: Path) -> None:
    """Wait until the disk has the folder's list of names."""
    descriptor = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


def sweep_old(folder: Path, pattern: str, keep: int = 0) -> None:
    """Remove what matches in a folder, but the ``keep`` newest; what cannot be removed stays."""
    for path in sorted(folder.glob(pattern), key=_find_age)[keep:]:
        with contextlib.suppress(OSError):
            path.unlink()


def _find_age(path: Path) -> float:
    try:
        return -path.stat().st_mtime
    except OSError:  # somebody else removed it
        return 0.0
