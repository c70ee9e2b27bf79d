"""What the app holds: its folder's files, each whole or not there, jobs, token, commands that it offers."""

from __future__ import annotations

import secrets
import time
from collections.abc import Callable, Mapping, Sequence
from contextlib import chdir
from dataclasses import dataclass
from pathlib import Path, PurePosixPath
from typing import Any

from fogml.app.jobs import Jobs, command_line
from fogml.errors import FogmlError, InputError, quoted
from fogml.folders import give_name

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
            give_name(partial, self.place(name))
        except FileExistsError:
            raise InputError(
                f"{quoted(name)} is here already; remove it first, or rename the new one"
            ) from None
        except OSError as error:
            raise InputError(f"{quoted(name)} cannot be kept ({error.strerror})") from None
        finally:
            partial.unlink(missing_ok=True)

    def remove(self, name: str) -> None:
        """Remove a file."""
        try:
            self.place(name).unlink()
        except FileNotFoundError:
            raise InputError(f"{quoted(name)} is not here any more") from None
        except OSError as error:
            raise InputError(f"{quoted(name)} cannot be removed ({error.strerror})") from None


OFFERED = ("model", "models", "twin", "file", "profile", "manifest", "fleet")
"""Kinds of inputs that the page offers as lists; runs are chosen beside their names."""
WordsOf = Callable[[str, Mapping[str, Any], Callable[[str], Sequence[str]], str], list[str]]
Check = Callable[[str, Mapping[str, Any], list[str]], None]


@dataclass(frozen=True)
class Limits:
    """Bounds: greatest upload [byte], jobs at a time, when an idle server ends [s] (None: never)."""

    upload_bytes: int
    jobs_at_once: int
    idle_s: float | None = None


class App:
    """The app of a folder.

    Parameters
    ----------
    home
        Its folder, in full.
    forms
        Commands with inputs and settings, as the page draws them.
    words_of
        Gives the words of a command line of command, values, known paths and folder of results.
    check
        Holds that a job can begin with command, values and their words.
    limits
        Bounds.
    """

    def __init__(
        self, home: Path, forms: list[dict[str, Any]], words_of: WordsOf, check: Check, limits: Limits
    ) -> None:
        self.home, self.forms, self.limits = home, forms, limits
        self.files, self.jobs = Files(home), Jobs(home, limits.jobs_at_once)
        self.token = secrets.token_urlsafe(24)
        self.asked_at = time.monotonic()
        self.hosts: tuple[str, ...] = ()
        self.cookie = ""
        self._words_of, self._check = words_of, check

    def words(self, command: str, values: Mapping[str, Any], results: str = "jobs/NEW/results") -> list[str]:
        """The words of a command line, with paths of this folder alone."""
        return self._words_of(command, values, self.offered, results)

    def check(self, command: str, values: Mapping[str, Any]) -> None:
        """Hold that a job can begin with what was filled in.

        Raises
        ------
        InputError
            With what is missing or wrong.
        """
        with chdir(self.home):
            self._check(command, values, self.words(command, values))

    def line(self, command: str, values: Mapping[str, Any]) -> dict[str, str]:
        """The command line of a form, as far as there is one, and what is missing or wrong (`fault`)."""
        told: dict[str, str] = {}
        try:
            told["line"] = command_line(self.words(command, values))
            self.check(command, values)
        except FogmlError as error:
            told["fault"] = str(error)
        return told

    def files_told(self) -> list[dict[str, Any]]:
        """Files that were dropped, and runs that were imported."""
        return [*self.files.told(), *self.jobs.runs()]

    def offered(self, takes: str, files: Sequence[Mapping[str, Any]] | None = None) -> list[str]:
        """Paths that an input of a kind may name; `files` are those of `files_told`, where they are known."""
        files = self.files_told() if files is None else files
        others = [one["path"] for one in files if not one["run"]]
        match takes:
            case "run":
                return [one["path"] for one in files if one["run"]]
            case "model":
                return _folders(self.jobs.written("**/model/model.json"))
            case "models":
                return [*self.offered("model", files), *_folders(self.offered("fleet", files))]
            case "fleet":
                return self.jobs.written("fleet.json")
            case "twin":
                return [*self.jobs.written("twin.yaml"), *others]
            case "manifest":
                return [*others, *(one["path"] for one in files if one["run"] and "/" not in one["name"])]
            case _:
                return others

    def idle(self) -> bool:
        """Whether no page has asked for as long as allowed, and no job runs or waits."""
        idle = self.limits.idle_s
        if idle is None or time.monotonic() - self.asked_at < idle:
            return False
        return all(self.jobs.state(name) not in ("waiting", "running") for name in self.jobs.names())


def _folders(paths: Sequence[str]) -> list[str]:
    return [str(PurePosixPath(path).parent) for path in paths]
