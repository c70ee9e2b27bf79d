"""The realities by name."""

from __future__ import annotations

from importlib import import_module

from fogml.blind.frame.reality import Reality
from fogml.errors import InputError, did_you_mean

FIRST = "first"
"""What is drawn from unless another one is chosen, so that a seed goes on giving the same files."""
MIX = "mix"
"""All of them in turn, case by case."""
SAME_TWIN = "same-twin"
"""No reality: a shipped twin's own runs, to be diagnosed against it."""
REALITIES = (FIRST, "second", "third")
"""Their names, each that of a package beside this module."""


def reality(name: str) -> Reality:
    """The reality of a name of `REALITIES`."""
    found: Reality = import_module(f"fogml.blind.{name}.catalogue").REALITY
    return found


def chosen(name: str) -> tuple[str, ...]:
    """Names of the realities that a choice means.

    Raises
    ------
    InputError
        If there is no such choice.
    """
    if name == MIX:
        return REALITIES
    if name not in (*REALITIES, SAME_TWIN):
        choices = (*REALITIES, MIX, SAME_TWIN)
        hint = did_you_mean(name, choices)
        raise InputError(f"there is no reality '{name}'; {hint}choose one of {', '.join(choices)}")
    return (name,)
