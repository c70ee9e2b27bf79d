"""Outputs that appear whole or not at all: written beside, then renamed."""

from __future__ import annotations

import errno
import os
import secrets
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from fogml.errors import InputError

NO_ROOM = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EROFS)
"""Errors of a disk that takes no more."""


@contextmanager
def whole_file(path: str | Path) -> Iterator[Path]:
    """Yield a temporary path beside `path`; rename it to `path` if the block succeeds.

    The temporary name keeps the suffix of `path`, so writers that look at it behave.

    Raises
    ------
    InputError
        If the folder is missing or can't be written.
    OSError
        If the disk is full, naming `path`.
    """
    path = Path(path)
    staging = _staging_folder(path.parent)
    try:
        # Made within: an interrupt right after must find what cleans up.
        _make(staging)
        partial = staging / path.name
        yield partial
        os.replace(partial, path)
    except PermissionError as error:
        raise InputError(f"{path}: cannot be written ({error.strerror}); choose another place") from error
    except OSError as error:
        raise _named(error, path) from error
    finally:
        shutil.rmtree(staging, ignore_errors=True)


@contextmanager
def whole_folder(path: str | Path) -> Iterator[Path]:
    """Yield an empty staging folder; move its content into `path` if the block succeeds.

    `path` is created, with its parents, only at the end. Entries of the same name that
    are there already are replaced; others stay.

    Raises
    ------
    InputError
        If `path` is a file or its nearest existing parent can't be written.
    OSError
        If the disk is full, naming `path`.
    """
    path = Path(path)
    if path.exists() and not path.is_dir():
        raise InputError(f"{path}: is a file, a folder was expected; choose another --out")
    home = path
    while not home.exists():
        home = home.parent
    staging = _staging_folder(home)
    content = staging / "content"
    try:
        _make(staging)
        content.mkdir()
        yield content
        if not path.exists():
            # In one step: on a full disk even a move may fail.
            path.parent.mkdir(parents=True, exist_ok=True)
            os.replace(content, path)
            return
        for entry in sorted(content.iterdir()):
            target = path / entry.name
            if target.is_dir() and not target.is_symlink():
                shutil.rmtree(target)
            os.replace(entry, target)
    except OSError as error:
        raise _named(error, path) from error
    finally:
        shutil.rmtree(staging, ignore_errors=True)


def _staging_folder(home: Path) -> Path:
    """A folder to be made beside an output."""
    if not home.is_dir():
        raise InputError(f"{home}: no such folder; create it first")
    if not os.access(home, os.W_OK | os.X_OK):
        raise InputError(f"{home}: no permission to write here; choose another place")
    return home / f".partial-{secrets.token_hex(8)}"


def _make(staging: Path) -> None:
    try:
        staging.mkdir(mode=0o700)
    except OSError as error:
        if error.errno in NO_ROOM:
            raise
        raise InputError(
            f"{staging.parent}: cannot be written ({error.strerror}); choose another place"
        ) from error


def _named(error: OSError, path: Path) -> OSError:
    """The error of a full disk with the output's name: that of writing to an open file has none."""
    return OSError(error.errno, error.strerror, str(path)) if error.errno in NO_ROOM else error
