"""Folders as a whole, exchanged for another in one step; locks that go with the process that holds them."""

from __future__ import annotations

import ctypes
import os
import shutil
import sys
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


_AT_CWD, _RENAME_EXCHANGE = -100, 2  # of Linux


def nearest_folder(path: Path) -> Path:
    """The folder itself, or the nearest parent that is there."""
    while not path.exists():
        path = path.parent
    return path


def is_folder(path: Path) -> bool:
    """Whether a folder is there itself, not a link to one."""
    return path.is_dir() and not path.is_symlink()


def has_to_stay(real: Path) -> bool:
    """Whether a folder can't be exchanged for another one: a mount point, or one that people are in."""
    parent = real.parent
    if os.path.ismount(real) or not os.access(parent, os.W_OK | os.X_OK):
        return True
    here = Path(os.path.realpath(os.curdir))
    return real == here or real in here.parents


def exchange_whole(content: Path, real: Path) -> bool:
    """Put a folder in another's place in one step, with what only the other holds; False if impossible."""
    carried = [entry for entry in real.iterdir() if not os.path.lexists(content / entry.name)]
    for entry in carried:
        _carry_over(entry, content / entry.name)
    shutil.copymode(real, content)
    if not _exchange(content, real):
        for entry in carried:
            place = content / entry.name
            if is_folder(place):
                shutil.rmtree(place)
            else:
                place.unlink()
        return False
    # What somebody put there at this moment.
    for entry in content.iterdir():
        if not os.path.lexists(real / entry.name):
            os.rename(entry, real / entry.name)
    return True


def _carry_over(entry: Path, target: Path) -> None:
    if is_folder(entry):
        shutil.copytree(entry, target, symlinks=True, copy_function=_link)
    else:
        _link(entry, target)


def _link(source: str | Path, target: str | Path) -> None:
    """The same file under a second name; a copy where there are no hard links."""
    try:
        os.link(source, target, follow_symlinks=False)
    except OSError:
        shutil.copy2(source, target, follow_symlinks=False)


def _exchange(one: Path, other: Path) -> bool:
    """Exchange two entries of a file system in one step (renameat2); False where that can't be done."""
    if not sys.platform.startswith("linux"):
        return False
    try:
        rename = ctypes.CDLL(None, use_errno=True).renameat2
    except (AttributeError, OSError):
        return False
    names = os.fsencode(one), os.fsencode(other)
    return bool(rename(_AT_CWD, names[0], _AT_CWD, names[1], ctypes.c_uint(_RENAME_EXCHANGE)) == 0)
