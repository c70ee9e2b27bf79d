"""What the app holds: its folder's files and jobs, its token, and the commands that it offers."""

from __future__ import annotations

import secrets
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path, PurePosixPath
from typing import Any

from fogml.app.files import Files
from fogml.app.jobs import Jobs

OFFERED = ("model", "models", "twin", "file", "profile", "manifest", "fleet")
"""Kinds of inputs that the page offers as lists; runs are chosen beside their names."""
WordsOf = Callable[[str, Mapping[str, Any], Callable[[str], Sequence[str]], str], list[str]]


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
    limits
        Bounds.
    """

    def __init__(self, home: Path, forms: list[dict[str, Any]], words_of: WordsOf, limits: Limits) -> None:
        self.home, self.forms, self.limits = home, forms, limits
        self.files, self.jobs = Files(home), Jobs(home, limits.jobs_at_once)
        self.token = secrets.token_urlsafe(24)
        self.asked_at = time.monotonic()
        self.hosts: tuple[str, ...] = ()
        self.cookie = ""
        self._words_of = words_of

    def words(self, command: str, values: Mapping[str, Any], results: str) -> list[str]:
        """The words of a command line, with paths of this folder alone."""
        return self._words_of(command, values, self.offered, results)

    def files_told(self) -> list[dict[str, Any]]:
        """Files that were dropped, and runs that were imported."""
        return [*self.files.told(), *self.jobs.runs()]

    def offered(self, takes: str) -> list[str]:
        """Paths that an input of a kind may name."""
        others = self.files.paths(runs=False)
        match takes:
            case "run":
                return [one["path"] for one in self.files_told() if one["run"]]
            case "model":
                return _folders(self.jobs.written("**/model/model.json"))
            case "models":
                return [*self.offered("model"), *_folders(self.offered("fleet"))]
            case "fleet":
                return self.jobs.written("fleet.json")
            case "twin":
                return [*self.jobs.written("twin.yaml"), *others]
            case "manifest":
                return [*others, *self.files.paths(runs=True)]
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
