"""Which state of the code an answer was given by: a hash over the sources that it depends on."""

from __future__ import annotations

import hashlib
from collections.abc import Iterator
from pathlib import Path

import fogml

_REALITIES = ("blind/frame", "blind/first", "blind/second", "blind/third")
APART = ("cli", "report", "blind/scoring", *_REALITIES)
"""Folders of the package that no answer depends on."""
_DIGITS = 16
_SUFFIXES = (".py", ".yaml")


def code_state(method: str, code: Path | None = None, package: Path | None = None) -> str:
    """The first digits of a hash over the paths and bytes of the sources.

    Parameters
    ----------
    method
        Name of a method, or ``module:function``.
    code
        Folder of the method's own code: the module or package that the method names there counts too.
    package
        The package ``fogml``; the one that runs unless told otherwise.
    """
    package = package or Path(fogml.__file__).parent
    found = hashlib.sha256()
    for name, path in (*_of_package(package), *_own(method, code)):
        content = path.read_bytes()
        found.update(f"{name}\0{len(content)}\0".encode())
        found.update(content)
    return found.hexdigest()[:_DIGITS]


def _of_package(package: Path) -> Iterator[tuple[str, Path]]:
    for name, path in _sources(package):
        if not any(name.startswith(f"{folder}/") for folder in APART):
            yield name, path


def _own(method: str, code: Path | None) -> Iterator[tuple[str, Path]]:
    """The sources of a method that lies in a folder of its own."""
    top = method.partition(":")[0].partition(".")[0]
    if code is None or ":" not in method:
        return
    if (code / f"{top}.py").is_file():
        yield f"{top}.py", code / f"{top}.py"
    for name, path in _sources(code / top):
        yield f"{top}/{name}", path


def _sources(folder: Path) -> list[tuple[str, Path]]:
    paths = (path for path in folder.rglob("*") if path.suffix in _SUFFIXES and path.is_file())
    return sorted((path.relative_to(folder).as_posix(), path) for path in paths)
