"""Outputs that appear whole or not at all: written beside, then renamed.

What is being written lies in a folder ``.partial-HOST-TOKEN``, locked by its process. Where several
entries have to be renamed one by one it is first renamed itself, to ``.commit-HOST-TOKEN``: from
then on the next writer in the same place, should this one be killed, moves in what is left. What a
dead process of this host left otherwise, the next writer removes.
"""

from __future__ import annotations

import errno
import json
import os
import re
import secrets
import shutil
import socket
import tempfile
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from hashlib import sha256
from pathlib import Path
from typing import Any

from fogml.errors import FogmlError, InputError
from fogml.folders import FileLock, exchange_whole, has_to_stay, is_folder, nearest_folder
from fogml.processes import process_is_alive, process_start

NO_ROOM = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EROFS)
"""Errors of a disk that takes no more."""
PARTIAL, COMMIT = ".partial-", ".commit-"
_CONTENT, _LOCK = "content", "lock"


@contextmanager
def whole_file(path: str | Path) -> Iterator[Path]:
    """Yield a temporary path; rename it to `path` if the block succeeds.

    The temporary name is that of `path`, so writers that look at it behave.

    Raises
    ------
    InputError
        If the folder is missing or can't be written, or `path` is a folder.
    OSError
        If the disk is full, naming `path`.
    """
    with whole_files(path) as (partial,):
        yield partial


@contextmanager
def whole_files(*paths: str | Path) -> Iterator[tuple[Path, ...]]:
    """As `whole_file`, for several files of one folder that appear together."""
    for path in map(Path, paths):
        check_is_no_folder(path)
    shown = Path(paths[0]).parent
    home = Path(os.path.realpath(shown))
    with _staging(home, shown) as staging:
        partials = tuple(staging.content / Path(path).name for path in paths)
        with staging.named(Path(paths[0]), shown):
            yield partials
            staging.move_in(home)


def check_is_no_folder(path: Path) -> None:
    """Raise `InputError` if a folder has the name of a file to write."""
    if path.is_dir():
        raise InputError(f"{path}: is a folder, a file was expected; choose another name")


@contextmanager
def whole_folder(path: str | Path, *, shared: bool = False) -> Iterator[Path]:
    """Yield an empty staging folder; its content is in `path` if the block succeeds.

    `path` is created, with its parents, only at the end. Entries of the same name that are there
    already are replaced; others stay. A folder that is there is exchanged for the new one in one
    step where the system can do that (Linux, not on a mount point or around the present folder);
    otherwise its entries are renamed one by one.

    Parameters
    ----------
    path
        The folder.
    shared
        Whether others write into the same folder at the same time; then it stays the folder it is.

    Raises
    ------
    InputError
        If `path` is a file, its nearest existing parent can't be written, or another process
        writes into it and it is not shared.
    OSError
        If the disk is full, naming `path`.
    """
    path = Path(path)
    if path.exists() and not path.is_dir():
        raise InputError(f"{path}: is a file, a folder was expected; choose another --out")
    real = Path(os.path.realpath(path))
    home = real if real.exists() and (shared or has_to_stay(real)) else nearest_folder(real.parent)
    with ExitStack() as stack:
        staging = stack.enter_context(_staging(home, nearest_folder(path)))
        if not shared:
            stack.enter_context(sole_writer(path))
        stack.enter_context(staging.named(path, path))
        yield staging.content
        if not real.exists():
            # In one step: on a full disk even a move may fail.
            real.parent.mkdir(parents=True, exist_ok=True)
            os.replace(staging.content, real)
        elif home == real or not exchange_whole(staging.content, real):
            staging.move_in(real)


@contextmanager
def scratch_folder() -> Iterator[Path]:
    """A folder for what is needed in the block alone; that of a killed process the next one removes."""
    home = Path(tempfile.gettempdir())
    with _staging(home, home) as staging:
        yield staging.content


@contextmanager
def sole_writer(path: str | Path) -> Iterator[None]:
    """Hold the lock on an output, a file ``.NAME.lock`` beside it that names process and host.

    The system takes the lock back from a process that has ended, on whichever host of a shared file
    system. Where the file system has no locks, what the file states counts: a process of this host by
    whether it lives, one of another host as living.
    """
    real = Path(os.path.realpath(path))
    home = real if real.is_dir() and has_to_stay(real) else nearest_folder(real.parent)
    name = "+".join(real.relative_to(home).parts)
    lock = FileLock(home / f".{name}.lock")
    try:
        free = lock.acquire(wait=False)
    except OSError as error:
        raise _unwritable(path, error) from error
    try:
        told = lock.read() if free else _read(lock.path)
        owner = _owner(told)
        if not free or (not lock.sure and _may_live(owner)):
            lock.release()
            who = f"process {owner['pid']} on {owner['host']}" if owner else "another process"
            raise InputError(
                f"{path}: {who} is writing it; wait for that to end, or choose another --out "
                f"(if no such process runs any more, remove {lock.path})"
            )
        pid = os.getpid()
        lock.write(json.dumps({"pid": pid, "host": socket.gethostname(), "started": process_start(pid)}))
        yield
    finally:
        lock.remove()


def settle(home: str | Path) -> None:
    """Finish or remove what dead processes of this host left half-written in a folder."""
    home = Path(home)
    try:
        left = [entry.name for entry in os.scandir(home) if _KIND.match(entry.name)]
    except OSError:
        return
    for name in sorted(left):
        staging = _Staging(home / name)
        try:
            if not staging.lock.acquire(wait=False):
                continue
        except OSError:
            continue  # another settles it
        try:
            if staging.lock.sure:
                # Without content it was killed at the end, when all was in its place.
                if staging.is_committed and staging.content.is_dir():
                    staging.move_in(home)
                shutil.rmtree(staging.path, ignore_errors=True)
        finally:
            staging.lock.release()


_HOST = sha256(socket.gethostname().encode()).hexdigest()[:8]
_KIND = re.compile(rf"({re.escape(PARTIAL)}|{re.escape(COMMIT)}){_HOST}-")


class _Staging:
    """A folder that holds what is not yet in its place."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self.lock = FileLock(path / _LOCK)

    @property
    def content(self) -> Path:
        """The folder of what is to be moved."""
        return self.path / _CONTENT

    def make(self, shown: Path) -> bool:
        """Make and lock it; False if another, who found it not yet locked, took it for left behind."""
        try:
            self.path.mkdir(mode=0o700)
        except OSError as error:
            raise _unwritable(shown, error) from error
        try:
            if not self.lock.acquire(wait=False):
                return False
            self.content.mkdir()
        except FileNotFoundError:
            return False
        return True

    def move_in(self, target: Path) -> None:
        """Rename the entries of the content into a folder; after a kill in between, `settle` goes on."""
        names = os.listdir(self.content)
        if not self.is_committed and (len(names) > 1 or any(is_folder(target / name) for name in names)):
            committed = target / self.path.name.replace(PARTIAL, COMMIT, 1)
            os.rename(self.path, committed)
            self.path = committed
        try:
            self._move_entries(target)
        except KeyboardInterrupt:
            self._move_entries(target)
            raise

    def end(self) -> None:
        """Remove the folder, unless what is left in it belongs in its place; again after an interrupt."""
        if not (self.is_committed and self.content.is_dir() and os.listdir(self.content)):
            shutil.rmtree(self.path, ignore_errors=True)
        self.lock.release()

    @property
    def is_committed(self) -> bool:
        """Whether what is left of the content belongs in its place."""
        return self.path.name.startswith(COMMIT)

    def _move_entries(self, target: Path) -> None:
        for entry in sorted(self.content.iterdir()):
            place = target / entry.name
            if is_folder(place):
                # A folder that holds something is not replaced by renaming another over it.
                os.rename(place, self.path / secrets.token_hex(8))
            os.replace(entry, place)

    @contextmanager
    def named(self, output: Path, shown: Path) -> Iterator[None]:
        """Let errors of what is written name its place to be, not where it lies meanwhile.

        Parameters
        ----------
        output
            What an error names that has no name: that of writing to an open file on a full disk.
        shown
            The folder that the content goes to.
        """
        here, there = os.path.join(self.content, ""), "" if str(shown) == "." else os.path.join(shown, "")

        def told(text: str) -> str:
            return text.replace(here, there).replace(str(self.content), str(shown))

        try:
            yield
        except FogmlError as error:
            if str(self.path) not in str(error):
                raise
            raise type(error)(told(str(error))) from error
        except OSError as error:
            name = None if error.filename is None else os.fsdecode(error.filename)
            elsewhere = error.errno not in NO_ROOM if name is None else str(self.path) not in name
            if elsewhere:
                raise
            raise _unwritable(Path(told(name)) if name is not None else output, error) from error


@contextmanager
def _staging(home: Path, shown: Path) -> Iterator[_Staging]:
    """A locked staging folder in `home`, which messages call `shown`; removed at the end."""
    if not home.is_dir():
        missing = "is a file, a folder was expected" if home.exists() else "no such folder; create it first"
        raise InputError(f"{shown}: {missing}")
    if not os.access(home, os.W_OK | os.X_OK):
        raise InputError(f"{shown}: no permission to write here; choose another place")
    settle(home)
    staging = _Staging(home / f"{PARTIAL}{_HOST}-{secrets.token_hex(8)}")
    try:
        # Made within: an interrupt right after must find what cleans up.
        while not staging.make(shown):
            staging = _Staging(home / f"{PARTIAL}{_HOST}-{secrets.token_hex(8)}")
        yield staging
    finally:
        try:
            staging.end()
        except KeyboardInterrupt:
            staging.end()
            raise


def _unwritable(path: str | Path, error: OSError) -> Exception:
    """The error of a full disk with the output's name; of anything else that forbids writing, one message."""
    if error.errno in NO_ROOM:
        return OSError(error.errno, error.strerror, str(path))
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
    except (ValueError, TypeError, KeyError, AttributeError):
        return {}


def _may_live(owner: dict[str, Any]) -> bool:
    """Whether the process that a lock file states may still run, as far as this host can tell."""
    if not owner:
        return False
    return owner["host"] != socket.gethostname() or process_is_alive(owner["pid"], owner["started"])
