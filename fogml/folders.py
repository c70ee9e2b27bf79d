"""Folders as a whole, exchanged for another in one step; paths that are spelled as on another system."""

from __future__ import annotations

import ctypes
import os
import re
import shutil
import sys
import unicodedata
from pathlib import Path

from fogml.errors import InputError, printable

_AT_CWD, _RENAME_EXCHANGE = -100, 2  # of Linux
_UNSAFE = re.compile(r"[^\w.+-]+")


def refuse_file(path: Path, option: str = "--out") -> None:
    """Refuse a file where a folder is to be made; `option` is what names another."""
    if path.exists() and not path.is_dir():
        raise InputError(f"{path}: is a file, a folder was expected; choose another {option}")


def safe_name(text: str, mark: str, longest_bytes: int) -> str:
    """What a file or folder may be called on any system: letters and digits of any script, and ``_.+-``.

    Parameters
    ----------
    text
        A name, such as a unit's.
    mark
        What stands for other characters.
    longest_bytes
        How much of it is kept at most [bytes of UTF-8].

    Examples
    --------
    >>> safe_name("陀螺 7/b", "_", 100)
    '陀螺_7_b'
    """
    text = unicodedata.normalize("NFC", text)
    try:
        os.fsencode(text)
    except UnicodeEncodeError:  # of a system whose files have no such names
        text = re.sub(r"[^\x00-\x7f]", "/", text)
    plain = _UNSAFE.sub(mark, text).strip(".") or "unit"
    return plain.encode()[:longest_bytes].decode(errors="ignore")


def with_slashes(path: str | Path, *folders: Path) -> str:
    r"""``; did you mean a/b.csv?`` where a path that is not there has backslashes and is there with slashes.

    Parameters
    ----------
    path
        As it was written, e.g. ``..\in\a.csv``.
    folders
        Where it may be meant from beside the one that one is in.
    """
    slashed = str(path).replace("\\", "/")
    if slashed == str(path) or os.path.exists(path):
        return ""
    found = any(os.path.exists(folder / slashed) for folder in (Path(), *folders))
    return f"; did you mean {printable(slashed)}?" if found else ""


def not_there(path: str | Path) -> bool:
    """Whether a path is known to lead to nothing; not of one that can't be looked for."""
    try:
        os.stat(path)
    except (FileNotFoundError, NotADirectoryError):
        return True
    except (OSError, ValueError):
        pass
    return False


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
    """Put a folder in another's place in one step, with what only the other holds; False if impossible.

    What is carried over stays the file that it is, under a second name: it is impossible where files have
    no second names, and where they or folders can't be given the mode that they have, as on some shares.
    """
    carried = [entry for entry in real.iterdir() if not os.path.lexists(content / entry.name)]
    try:
        for entry in carried:
            target = content / entry.name
            if is_folder(entry):
                shutil.copytree(entry, target, symlinks=True, copy_function=_link)
            else:
                _link(entry, target)
        shutil.copymode(real, content)
        exchanged = _exchange(content, real)
    except OSError:
        exchanged = False
    if not exchanged:
        for entry in carried:
            place = content / entry.name
            if is_folder(place):
                shutil.rmtree(place)
            else:
                place.unlink(missing_ok=True)
        return False
    # What somebody put there at this moment.
    for entry in content.iterdir():
        if not os.path.lexists(real / entry.name):
            os.rename(entry, real / entry.name)
    return True


def _link(source: str | Path, target: str | Path) -> None:
    """The same file under a second name."""
    os.link(source, target, follow_symlinks=False)


def link_or_copy(source: Path, target: Path) -> None:
    """The same file under a second name, or a copy of it where files have one name alone."""
    try:
        os.link(source, target)
    except OSError:
        shutil.copyfile(source, target)


def give_name(source: Path, name: Path) -> None:
    """Let a whole file have a name that nothing else has, in one step where the file system has hard links.

    Raises
    ------
    FileExistsError
        If something of that name is there; the source stays.
    """
    try:
        os.link(source, name)
    except FileExistsError:
        raise
    except OSError:
        # Without hard links, as on exFAT and many shares, an empty file takes the name before all others.
        os.close(os.open(name, os.O_CREAT | os.O_EXCL | os.O_WRONLY, 0o600))
        os.replace(source, name)
    else:
        os.unlink(source)


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
