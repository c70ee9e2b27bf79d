"""Peers that may not be installed: what a job that lacks one says."""

from __future__ import annotations

from collections.abc import Callable
from importlib.util import find_spec


def needs(*packages: str) -> Callable[[], str | None]:
    """A function that says which of some packages are not installed; None where all are."""

    def missing() -> str | None:
        absent = [name for name in packages if find_spec(name) is None]
        if not absent:
            return None
        verb = "is" if len(absent) == 1 else "are"
        return f"{', '.join(absent)} {verb} not installed (pip install -e '.[benchmarks]')"

    return missing
