"""Studies: measurements that give a table of their own rather than a pair of times."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any


@dataclass(frozen=True)
class Study:
    """A measurement with its own section of the page.

    Attributes
    ----------
    name, title
        Short name for ``--only``, and the heading of its section.
    measure
        ``measure(quick, repeats, folder)`` gives JSON-ready figures; quick: small enough for a test.
    page
        The section's text, in Markdown, made of them.
    missing
        Says what it lacks to run on this machine; None where it lacks nothing.
    """

    name: str
    title: str
    measure: Callable[[bool, int, Path], dict[str, Any]]
    page: Callable[[Mapping[str, Any]], str]
    missing: Callable[[], str | None] = lambda: None
    big: bool = False


def carried_out(study: Study, folder: Path, *, quick: bool, repeats: int) -> dict[str, Any]:
    """A study's figures with its name, as ``results.json`` holds them."""
    load = os.getloadavg()[0]
    found = study.measure(quick, repeats, folder)
    return {"name": study.name, "title": study.title, "quick": quick, "load": load, **found}
