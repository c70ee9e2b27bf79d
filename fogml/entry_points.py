"""What other packages declare by entry points."""

from __future__ import annotations

from importlib.metadata import EntryPoint
from typing import Any

from fogml.errors import InputError


def origin(point: EntryPoint) -> str:
    """An entry point and its package, in words."""
    return f"entry point '{point.name}' of {point.dist.name if point.dist else 'a package'}"


def loaded(point: EntryPoint) -> Any:
    """What an entry point declares."""
    try:
        return point.load()
    except Exception as error:  # others' code raises whatever it likes
        raise InputError(f"{origin(point)} in group '{point.group}' does not load: {error}") from error
