"""A lock: one writer at a time; it vanishes with its holder, however that ends."""

import contextlib
import os
import socket
from pathlib import Path

from filelock import FileLock, Timeout

from feeler.errors import StoreError


class Lock:
    """Holds a file locked until ``release``.

    Raises
    ------
    StoreError
        Another writer holds it (the message names it), or the file system has no locks.
    """

    def __init__(self, path: Path, what: str) -> None:
        self._lock, holder = (
            FileLock(path, thread_local=False),
            path.with_name(f"{path.name}.holder"),
        )
        try:
            self._lock.acquire(blocking=False)
        except Timeout:
            name = (
                holder.read_text(errors="replace")[:200].strip()
                if holder.is_file()
                else "another process"
            )
            if name.startswith(f"process {os.getpid()} "):
                raise StoreError(
                    f"{what} is already open for writing in this process. Close it first."
                ) from None
            raise StoreError(
                f"{what} is being written by {name}. Wait until it has finished, or use another"
                " one."
            ) from None
        except NotImplementedError as error:
            raise StoreError(
                f"{what} lies on a file system without locks. Use a folder on another one."
            ) from error
        with contextlib.suppress(
            OSError
        ):  # a full disk must not lock anyone out: the name is only for the message
            holder.write_text(f"process {os.getpid()} on {socket.gethostname()}\n")

    def release(self) -> None:
        """Let go; a second call does nothing."""
        self._lock.release()
