"""Regressors of other packages, known to the commands by the entry point group ``fogml.regressors``.

The entry point's name is the model's, ``--model NAME``; its class is as `fogml.models.regressors` says, with
``to_saved`` and ``from_saved``. Only what an installed package declares so is ever loaded, whatever a file
says.
"""

from __future__ import annotations

import inspect
from functools import cache
from importlib.metadata import EntryPoint, entry_points
from typing import Any

from fogml.entry_points import loaded, origin
from fogml.errors import InputError

GROUP = "fogml.regressors"
_NEEDED = ("fit", "predict", "to_saved", "from_saved")


@cache
def own_regressors() -> dict[str, EntryPoint]:
    """The entry points of regressors that installed packages declare, by name; nothing is loaded yet."""
    return {point.name: point for point in entry_points(group=GROUP)}


def own_regressor(name: str) -> Any:
    """The class of a regressor that an installed package declares.

    Raises
    ------
    InputError
        If it does not load, or is no regressor that can be saved.
    """
    point = own_regressors()[name]
    kind = loaded(point)
    lacking = [each for each in _NEEDED if not hasattr(kind, each)]
    if not inspect.isclass(kind) or lacking:
        place = f"{origin(point)} in group '{GROUP}'"
        raise InputError(
            f"{place}: {point.value} is no regressor; it lacks {', '.join(lacking) or 'a class'}"
        )
    return kind
