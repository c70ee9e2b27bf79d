"""Outputs that appear whole or not at all: written beside, then renamed.

What is being written lies in a folder ``.partial-HOST-TOKEN``, locked by its process, which it names for
file systems without locks. Where several entries have to be renamed one by one it is first renamed itself,
to ``.commit-HOST-TOKEN``: from then on the next writer in the same place, should this one be killed, moves in
what is left. What a dead process of this host left otherwise, the next writer removes, locks of outputs too.
"""

from __future__ import annotations

import errno
import os
import re
import secrets
import shutil
import socket
import tempfile
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, suppress
from hashlib import sha256
from pathlib import Path

from fogml.errors import FogmlError, InputError, listed, printable
from fogml.folders import exchange_whole, has_to_stay, is_folder, nearest_folder, refuse_file
from fogml.locks import NO_ROOM, FileLock, remove_left_locks, sole_writer, unwritable

PARTIAL, COMMIT = ".partial-", ".commit-"
_CONTENT, _LOCK = "content", "lock"


@contextmanager
def whole_file(path: str | Path) -> Iterator[Path]:
    """Yield a temporary path; rename it to `path` if the block succeeds.

    The temporary name is that of `path`, so writers that look at it behave. Where `path` is a symbolic link
    it stays one, and what it leads to is written.

    Raises
    ------
    InputError
        If the folder is missing or can't be written, or `path` is a folder, a device or a pipe.
    OSError
        If the disk is full, naming `path`.
    """
    with whole_files(path) as (partial,):
        yield partial


@contextmanager
def whole_files(*paths: str | Path) -> Iterator[tuple[Path, ...]]:
    """As `whole_file`, for several files of one folder that appear together.

    Those that links lead to other folders appear one folder after the other.
    """
    outputs = [Path(path) for path in paths]
    for path in outputs:
        check_is_no_folder(path)
    places = [Path(os.path.realpath(path)) for path in outputs]
    if len(set(places)) < len(places):
        raise InputError(f"{listed([str(path) for path in outputs])}: links to one file; choose another name")
    with ExitStack() as stack:
        stagings: dict[Path, _Staging] = {}
        for path, place in zip(outputs, places):
            if place.parent not in stagings:
                shown = place.parent if path.is_symlink() else path.parent
                staging = stack.enter_context(_staging(place.parent, shown))
                stack.enter_context(staging.named(path, shown))
                stagings[place.parent] = staging
        partials = [stagings[place.parent].content / path.name for path, place in zip(outputs, places)]
        yield tuple(partials)
        for partial, place in zip(partials, places):
            if partial.name != place.name and partial.exists():
                os.rename(partial, partial.with_name(place.name))
        for home, staging in stagings.items():
            staging.move_in(home)


def check_is_no_folder(path: Path) -> None:
    """Raise `InputError` if a folder, a device or a pipe has the name of a file to write."""
    if path.is_dir():
        raise InputError(f"{path}: is a folder, a file was expected; choose another name")
    if path.exists() and not path.is_file():
        raise InputError(f"{path}: is no ordinary file; choose another name")


def check_room(path: Path, least_bytes: float, what: str, remedy: str) -> None:
    """Refuse an output that no disk room is left for, before hours are spent on it.

    Parameters
    ----------
    path
        Where it goes.
    least_bytes
        What it takes at the very least.
    what, remedy
        What it would hold, and what would make it smaller.

    Raises
    ------
    InputError
        With what is free.
    """
    free = shutil.disk_usage(nearest_folder(path.absolute().parent)).free
    if least_bytes > free:
        raise InputError(
            f"{printable(str(path))}: {what} do not fit into the {free / 1e9:.3g} GB free; {remedy}"
        )


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
    refuse_file(path)
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
            try:
                os.replace(staging.content, real)
                return
            except OSError as error:
                # Another who shares it may have made it at this moment.
                if not shared or error.errno not in (errno.ENOTEMPTY, errno.EEXIST):
                    raise
        if shared or home == real or not exchange_whole(staging.content, real):
            staging.move_in(real)


@contextmanager
def scratch_folder() -> Iterator[Path]:
    """A folder for what is needed in the block alone; that of a killed process the next one removes."""
    home = Path(tempfile.gettempdir())
    with _staging(home, home) as staging:
        yield staging.content


def settle(home: str | Path) -> None:
    """Finish or remove what dead processes of this host left half-written in a folder."""
    home = Path(home)
    try:
        names = sorted(entry.name for entry in os.scandir(home))
    except OSError:
        return
    remove_left_locks(home, names)
    for name in filter(_KIND.match, names):
        staging = _Staging(home / name)
        try:
            if not staging.lock.acquire(wait=False):
                continue
        except OSError:
            continue  # another settles it
        try:
            if staging.lock.is_ours:
                # Without content it was killed at the end, when all was in its place.
                if staging.is_committed and staging.content.is_dir():
                    staging.move_in(home)
                shutil.rmtree(staging.path, ignore_errors=True)
        finally:
            staging.lock.release()


@contextmanager
def settled(*homes: str | Path) -> Iterator[None]:
    """Around processes that write into folders: what is half-written when they are ended is settled."""
    try:
        yield
    finally:
        for home in homes:
            settle(home)


@contextmanager
def folder_to_fill(path: str | Path) -> Iterator[None]:
    """Make a folder with its parents; where the block fails, those made that hold nothing are removed."""
    path = Path(path)
    made = [place for place in (path, *path.parents) if not os.path.lexists(place)]
    try:
        path.mkdir(parents=True, exist_ok=True)
        yield
    except BaseException:
        with suppress(OSError):
            for place in made:
                place.rmdir()
        raise


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
            raise unwritable(shown, error) from error
        try:
            if not self.lock.acquire(wait=False):
                return False
            self.lock.sign()
            self.content.mkdir()
        except FileNotFoundError:
            return False
        return True

    def move_in(self, target: Path) -> None:
        """Rename the entries of the content into a folder; after a kill in between, `settle` goes on."""
        places = [home / name for name in os.listdir(self.content) for home in (target, self.content)]
        if not self.is_committed and (len(places) > 2 or any(map(is_folder, places))):
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
            if is_folder(place) or (is_folder(entry) and os.path.lexists(place)):
                # A folder that holds something, or for a folder a link or file, is not replaced by renaming.
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
            raise unwritable(Path(told(name)) if name is not None else output, error) from error


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
