"""Files that were dropped on the app: by their bare names in one folder, each whole or not there."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

from fogml.errors import InputError, quoted

LONGEST_NAME_BYTES = 180
"""Of a file's name: with what outputs add to it, it stays below the 255 bytes that systems allow."""
NO_RUNS = (".yaml", ".yml")
"""Endings of side files, profiles and twins, which are no runs themselves."""


class Files:
    """The files of a folder."""

    def __init__(self, home: Path) -> None:
        self.folder = home / "files"
        self.folder.mkdir(exist_ok=True)
        for left in self.folder.glob(".upload-*"):
            left.unlink()

    def told(self) -> list[dict[str, Any]]:
        """Name, path from the app's folder and size of each, and whether it is a run or a side file."""
        found = [p for p in self.folder.iterdir() if p.is_file() and not p.name.startswith(".")]
        return [
            {
                "name": p.name,
                "path": f"files/{p.name}",
                "bytes": p.stat().st_size,
                "run": p.suffix.lower() not in NO_RUNS,
            }
            for p in sorted(found, key=lambda p: p.name)
        ]

    def paths(self, runs: bool) -> list[str]:
        """Paths from the app's folder: of runs, or of the other files."""
        return [one["path"] for one in self.told() if one["run"] is runs]

    def place(self, name: str) -> Path:
        """Where a file of a name lies.

        Raises
        ------
        InputError
            If the name is none of a file in this folder.
        """
        bare = name not in ("", ".", "..") and "/" not in name and "\\" not in name
        if not (bare and name.isprintable() and not name.startswith((".", "-"))):
            raise InputError(f"{quoted(name)} is no name of a file; rename it")
        if len(name.encode()) > LONGEST_NAME_BYTES:
            raise InputError(f"{quoted(name)}: the name is longer than {LONGEST_NAME_BYTES} bytes; rename it")
        return self.folder / name

    def keep(self, partial: Path, name: str) -> None:
        """Let an upload become the file of its name.

        Raises
        ------
        InputError
            If there is one of that name: jobs may be reading it.
        """
        try:
            os.link(partial, self.place(name))
        except FileExistsError:
            raise InputError(
                f"{quoted(name)} is here already; remove it first, or rename the new one"
            ) from None
        finally:
            partial.unlink()

    def remove(self, name: str) -> None:
        """Remove a file.

        Raises
        ------
        InputError
            If there is none of that name.
        """
        try:
            self.place(name).unlink()
        except FileNotFoundError:
            raise InputError(f"{quoted(name)} is not here any more") from None
