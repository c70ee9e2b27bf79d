"""The files that make a run: which a reader would read, what they hold, and whether they stay as they are."""

from __future__ import annotations

import hashlib
import os
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path

from fogml.errors import InputError
from fogml.runs.facts import side_file

_PART_BYTES = 1 << 20


def run_sources(path: str | Path) -> tuple[Path, ...]:
    """Every file that is read for a run: its data and its side file.

    Parameters
    ----------
    path
        The run's file; it need not be there.

    Returns
    -------
    tuple of Path
        The data file first. A side file is among them if it is there.
    """
    side = side_file(Path(path))
    return (Path(path), *((side,) if side else ()))


def sources_stamp(paths: Iterable[Path]) -> str:
    """A hash of what files hold, under their base names; a file that is missing counts as that.

    Returns
    -------
    str
        64 hexadecimal digits of SHA-256. The same files at another place, or touched only, give the
        same.

    Raises
    ------
    InputError
        If a file is there and can't be read, or changes meanwhile.
    """
    stamp = hashlib.sha256()
    for path in paths:
        found = hashlib.sha256()
        try:
            with unchanged(path), path.open("rb") as file:
                while part := file.read(_PART_BYTES):
                    found.update(part)
            held = found.hexdigest()
        except FileNotFoundError:
            held = "missing"
        except OSError as error:
            raise InputError(f"{path}: cannot be read ({error.strerror or error})") from None
        stamp.update(f"{path.name}\0{held}\0".encode(errors="surrogateescape"))
    return stamp.hexdigest()


@contextmanager
def unchanged(*paths: Path) -> Iterator[None]:
    """Read files in the block; they have to be the same, of the same size and time, when it ends.

    A fault that the block meets in a file that changed is told as that change.

    Raises
    ------
    InputError
        If one was replaced, cut, added to or edited meanwhile.
    """
    before = [_state(path) for path in paths]

    def check() -> None:
        for path, was in zip(paths, before, strict=True):
            if _state(path) != was:
                raise InputError(
                    f"{path.name}: changed while it was read; run the command again once it is written"
                )

    try:
        yield
    except (GeneratorExit, KeyboardInterrupt):
        raise
    except Exception:
        check()
        raise
    check()


def _state(path: Path) -> tuple[int, ...] | None:
    """What tells a file from a later one: device, inode, size, time of change; None where there is none."""
    try:
        state = os.stat(path)
    except OSError:
        return None
    return state.st_dev, state.st_ino, state.st_size, state.st_mtime_ns
