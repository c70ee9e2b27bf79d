"""Locks on files that the system takes back from a process that ends, however it ends."""

from __future__ import annotations

import os
from pathlib import Path

try:
    import fcntl
except ImportError:  # not a POSIX system
    fcntl = None  # type: ignore[assignment]

ARE_KNOWN = fcntl is not None
"""Whether the system has such locks."""


class FileLock:
    """A lock held by whoever has locked a file, made if it is missing.

    Where the system or the file system has no such locks it is always given, and not `sure`.

    Parameters
    ----------
    path
        File that is locked.
    """

    def __init__(self, path: str | Path) -> None:
        self.path = Path(path)
        self.sure = False
        """Whether nobody else can hold it."""
        self._held: int | None = None

    def acquire(self, wait: bool = True) -> bool:
        """Take the lock; False if another has it and `wait` is not asked for.

        Raises
        ------
        OSError
            If the file can't be made.
        """
        while True:
            handle = os.open(self.path, os.O_RDWR | os.O_CREAT, 0o666)
            try:
                self.sure = _locked(handle, wait)
                # Another may have removed the file between the opening and the locking.
                if self._is_file_of(handle):
                    self._held, handle = handle, -1
                    return True
            except BlockingIOError:
                return False
            finally:
                if handle >= 0:
                    os.close(handle)

    def release(self) -> None:
        """Give the lock to the next one that waits."""
        if self._held is not None:
            os.close(self._held)
            self._held = None

    def remove(self) -> None:
        """Give the lock back together with its file."""
        if self._held is not None:
            self.path.unlink(missing_ok=True)
            self.release()

    def read(self) -> str:
        """What is written in the file of a lock that is held."""
        assert self._held is not None
        return os.pread(self._held, 4096, 0).decode("utf-8", "replace")

    def write(self, text: str) -> None:
        """Write into the file of a lock that is held."""
        assert self._held is not None
        os.ftruncate(self._held, 0)
        os.pwrite(self._held, text.encode(), 0)

    def _is_file_of(self, handle: int) -> bool:
        try:
            return os.path.samestat(os.fstat(handle), os.stat(self.path))
        except FileNotFoundError:
            return False


def _locked(handle: int, wait: bool) -> bool:
    """Lock an open file; False where there are no locks."""
    if fcntl is None:
        return False
    try:
        fcntl.flock(handle, fcntl.LOCK_EX | (0 if wait else fcntl.LOCK_NB))
    except BlockingIOError:
        raise
    except OSError:
        return False
    return True
