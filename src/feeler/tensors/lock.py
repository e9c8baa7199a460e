"""A lock on a folder: one writing process at a time; it vanishes with its holder, however that ends."""

import contextlib
import fcntl
import os
import socket
from pathlib import Path

from feeler.errors import StoreError

# POSIX locks do not bind the process that holds them, and closing any descriptor of the file drops them: so a file that
# this process holds is never opened a second time.
_held: set[tuple[int, int]] = set()


class Lock:
    """Holds ``path`` (a file) locked until ``release``; raises StoreError naming the holder where another has it."""

    def __init__(self, path: Path) -> None:
        store = path.parents[1]
        if path.exists() and _identify(os.stat(path)) in _held:
            raise StoreError(f"the store {store} is already open for writing in this process. Close it first.")
        flags = os.O_RDWR | os.O_CREAT | os.O_CLOEXEC | os.O_NOFOLLOW
        self._file = os.fdopen(os.open(path, flags, 0o644), "r+")
        try:
            fcntl.lockf(self._file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError as error:
            holder = self._file.read(200).strip() or "another process"
            self._file.close()
            raise StoreError(
                f"the store {store} is being written by {holder}. Wait until it has finished, or use another store."
            ) from error
        self._key = _identify(os.fstat(self._file.fileno()))
        _held.add(self._key)
        os.ftruncate(self._file.fileno(), 0)
        with contextlib.suppress(OSError):  # a full disk must not lock anyone out: the name is only for the message
            os.write(self._file.fileno(), f"process {os.getpid()} on {socket.gethostname()}\n".encode())

    def release(self) -> None:
        """Let go; a second call does nothing."""
        if not self._file.closed:
            _held.discard(self._key)
            self._file.close()


def _identify(info: os.stat_result) -> tuple[int, int]:
    return info.st_dev, info.st_ino
