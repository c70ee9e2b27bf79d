"""Locks that go with the process that holds them: of any file, and of an output that one process writes."""

from __future__ import annotations

import errno
import json
import os
import re
import socket
from collections.abc import Iterable, Iterator
from contextlib import contextmanager, suppress
from hashlib import sha256
from pathlib import Path
from typing import Any

from fogml.errors import InputError
from fogml.folders import has_to_stay, nearest_folder
from fogml.processes import process_is_alive, process_start

try:
    import fcntl
except ImportError:  # not a POSIX system
    fcntl = None  # type: ignore[assignment]


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

    def sign(self) -> None:
        """Write into the file of a lock that is held which process holds it."""
        assert self._held is not None
        os.ftruncate(self._held, 0)
        os.pwrite(self._held, this_process().encode(), 0)

    @property
    def is_ours(self) -> bool:
        """Whether nobody else holds it: by the system, or as the process that signed it last has ended."""
        return self.sure or has_ended(self.read())

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


_LONGEST_NAME = 240
"""Bytes of a lock's name: file systems hold 255, its dot and suffix among them."""
NO_ROOM = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EROFS)
"""Errors of a disk that takes no more."""
REMEDIES = {
    **dict.fromkeys(NO_ROOM, "make room and run the command again"),
    errno.EROFS: "choose another place",
    errno.ENAMETOOLONG: "choose a shorter name",
    errno.ENOMEM: "close other programs or use a shorter run",
}
"""What to do where something can't be written, or begun for want of memory."""


class Held(InputError):
    """An output is another's that still runs.

    Attributes
    ----------
    who
        Process and host, as far as the lock states them.
    """

    def __init__(self, path: str | Path, who: str, lock: Path) -> None:
        self.who = who
        super().__init__(
            f"{path}: {who} is writing it; wait for that to end, or choose another --out "
            f"(if no such process runs any more, remove {lock})"
        )


@contextmanager
def sole_writer(path: str | Path) -> Iterator[None]:
    """Hold the lock on an output, a file ``.NAME.lock`` beside it that names process and host.

    The system takes the lock back from a process that has ended, on whichever host of a shared file
    system. Where the file system has no locks, what the file states counts: a process of this host by
    whether it lives, one of another host as living.

    Raises
    ------
    Held
        If another process has it.
    """
    real = Path(os.path.realpath(path))
    home = real if real.is_dir() and has_to_stay(real) else nearest_folder(real.parent)
    name = "+".join(real.relative_to(home).parts)
    if len(os.fsencode(name)) > _LONGEST_NAME:
        name = sha256(os.fsencode(name)).hexdigest()
    lock = FileLock(home / f".{name}.lock")
    try:
        free = lock.acquire(wait=False)
    except OSError as error:
        raise unwritable(path, error) from error
    try:
        told = lock.read() if free else _read(lock.path)
        owner = _owner(told)
        if not free or (not lock.sure and _may_live(owner)):
            lock.release()
            raise Held(
                path, f"process {owner['pid']} on {owner['host']}" if owner else "another process", lock.path
            )
        try:
            lock.sign()
        except OSError as error:  # of a full disk, without a name
            raise unwritable(path, error) from error
        yield
    finally:
        lock.remove()


def remove_left_locks(home: Path, names: Iterable[str]) -> None:
    """Remove the locks of outputs, among the files of a folder, whose processes of this host have ended."""
    for name in names:
        owner = _owner(_read(home / name)) if _LOCK_OF_OUTPUT.match(name) else {}
        if not owner or owner["host"] != socket.gethostname() or _may_live(owner):
            continue
        lock = FileLock(home / name)
        with suppress(OSError):
            if lock.acquire(wait=False) and lock.is_ours:
                # Whoever waits for it sees that its file is gone, and makes another.
                lock.remove()
            lock.release()


_LOCK_OF_OUTPUT = re.compile(r"\..+\.lock\Z")


def unwritable(path: str | Path, error: OSError) -> Exception:
    """The error of a full disk with the output's name; of anything else that forbids writing, one message."""
    if error.errno in NO_ROOM:
        # What libraries say of it may be longer.
        return OSError(error.errno, os.strerror(error.errno or 0), str(path))
    return InputError(f"{path}: cannot be written ({error.strerror or error}); choose another place")


def _read(path: Path) -> str:
    try:
        return path.read_text(encoding="utf-8", errors="replace")
    except OSError:
        return ""


def _owner(told: str) -> dict[str, Any]:
    """Process and host as a lock file states them; nothing where it does not."""
    try:
        values = json.loads(told)
        started = str(values.get("started", ""))
        return {"pid": int(values["pid"]), "host": str(values["host"]), "started": started}
    except (ValueError, TypeError, KeyError, AttributeError, OverflowError, RecursionError):
        return {}


def this_process() -> str:
    """What a lock's file says of the process that holds it."""
    pid = os.getpid()
    return json.dumps({"pid": pid, "host": socket.gethostname(), "started": process_start(pid)})


def has_ended(told: str) -> bool:
    """Whether a lock's file names a process of this host that has ended."""
    owner = _owner(told)
    return bool(owner) and not _may_live(owner)


def _may_live(owner: dict[str, Any]) -> bool:
    """Whether the process that a lock file states may still run, as far as this host can tell."""
    if not owner:
        return False
    return owner["host"] != socket.gethostname() or process_is_alive(owner["pid"], owner["started"])
