"""Hashes over every truth of a suite, in the form that ``sha256sum -c`` takes."""

from __future__ import annotations

import hashlib
from pathlib import Path

from fogml.errors import InputError
from fogml.outputs import whole_file

SUMS = "SHA256SUMS"


def write_sums(folder: Path) -> None:
    """Write ``SHA256SUMS`` over every truth in the folder."""
    files = sorted(path for path in folder.iterdir() if path.suffix in (".json", ".npz"))
    with whole_file(folder / SUMS) as partial:
        lines = [f"{_digest(path)}  {path.name}\n" for path in files]
        partial.write_text("".join(lines), encoding="ascii")


def check_sums(folder: Path) -> int:
    """How many truths there are, once all of them have the hashes that were written.

    Raises
    ------
    InputError
        If the list is missing, a file changed, is missing, or is not listed.
    """
    path = folder / SUMS
    if not path.is_file():
        raise InputError(f"{path}: no such file; the truth must be hashed when it is made")
    lines = [line.partition("  ") for line in path.read_text(encoding="utf-8", errors="replace").splitlines()]
    stated = {name: digest for digest, _, name in lines}
    held = {file.name for file in folder.iterdir() if file.suffix in (".json", ".npz")}
    for name in sorted(held ^ set(stated)):
        what = "is not listed" if name in held else "is listed, but missing"
        raise InputError(f"{folder / name}: {what} in {SUMS}; make the cases anew")
    for name, digest in stated.items():
        if _digest(folder / name) != digest:
            raise InputError(f"{folder / name}: changed since it was hashed; make the cases anew")
    return sum(name.endswith(".json") for name in held)


def _digest(path: Path) -> str:
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()
