"""What the app holds: its folder's files and jobs, its token, and the commands that it offers."""

from __future__ import annotations

import secrets
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from fogml.app.files import Files
from fogml.app.jobs import Jobs

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
        known = {
            "run": lambda: self.files.paths(runs=True),
            "file": lambda: self.files.paths(runs=False),
            "model": self.jobs.models,
            "twin": lambda: [*self.jobs.twins(), *self.files.paths(runs=False)],
        }
        return self._words_of(command, values, lambda takes: known[takes](), results)

    def idle(self) -> bool:
        """Whether no page has asked for as long as allowed, and no job runs or waits."""
        idle = self.limits.idle_s
        if idle is None or time.monotonic() - self.asked_at < idle:
            return False
        return all(self.jobs.state(name) not in ("waiting", "running") for name in self.jobs.names())
