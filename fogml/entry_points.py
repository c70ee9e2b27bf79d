"""What other packages declare by entry points."""

from __future__ import annotations

from importlib.metadata import EntryPoint, entry_points
from typing import Any

from fogml.errors import InputError

EFFECTS, OPERATORS, REGRESSORS = "fogml.effects", "fogml.operators", "fogml.regressors"
"""Groups in which packages declare what they add."""


def others() -> dict[str, str]:
    """Name of each package that adds to fogml, by that of its module."""
    points = [point for group in (EFFECTS, OPERATORS, REGRESSORS) for point in entry_points(group=group)]
    return {p.module.partition(".")[0]: p.dist.name if p.dist else p.module for p in points}


def origin(point: EntryPoint) -> str:
    """An entry point and its package, in words."""
    return f"entry point '{point.name}' of {point.dist.name if point.dist else 'a package'}"


def loaded(point: EntryPoint) -> Any:
    """What an entry point declares."""
    try:
        return point.load()
    except Exception as error:  # others' code raises whatever it likes
        raise InputError(f"{origin(point)} in group '{point.group}' does not load: {error}") from error
