"""Regressors of other packages, known to the commands by the entry point group ``fogml.regressors``.

The entry point's name is the model's, ``--model NAME``; its class is as `fogml.models.regressors` says, with
``to_saved`` and ``from_saved``. Only what an installed package declares so is ever loaded, whatever a file
says.
"""

from __future__ import annotations

import inspect
from functools import cache
from importlib import import_module
from importlib.metadata import entry_points
from typing import Any

from fogml.errors import InputError

GROUP = "fogml.regressors"


@cache
def own_regressors() -> dict[str, str]:
    """Names of the regressors that installed packages declare, and their classes, ``module:Class``."""
    return {point.name: point.value for point in entry_points(group=GROUP)}


def own_regressor(name: str) -> Any:
    """The class of a regressor that an installed package declares.

    Raises
    ------
    InputError
        If it does not load, or is no regressor that can be saved.
    """
    home = own_regressors()[name]
    place = f"entry point '{name}' in group '{GROUP}'"
    module, _, attribute = home.partition(":")
    try:
        kind = getattr(import_module(module), attribute)
    except Exception as error:
        raise InputError(f"{place} does not load: {error}") from error
    lacking = [each for each in ("fit", "predict", "to_saved", "from_saved") if not hasattr(kind, each)]
    if not inspect.isclass(kind) or lacking:
        raise InputError(f"{place}: {home} is no regressor; it lacks {', '.join(lacking) or 'a class'}")
    return kind
