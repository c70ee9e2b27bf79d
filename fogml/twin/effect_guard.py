"""Effects of other packages: what they end in, or give that is no series, is told by their name."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from traceback import extract_tb
from typing import Any

import numpy as np

from fogml.arrays import FloatArray
from fogml.errors import InputError
from fogml.twin.effect import Effect
from fogml.twin.inputs import Inputs

HOOKS = (
    *("signature", "in_hindsight", "change", "apply", "record", "sense", "change_chamber", "added_rate"),
    "draw",
)
"""What an effect may define that simulator and diagnosis call for a series."""


def guard(declared: Effect) -> None:
    """Make the hooks that an effect has from another package refuse by name what is no series."""
    for name in HOOKS:
        hook = getattr(type(declared), name, None)
        if hook is not None and hook.__module__.partition(".")[0] != "fogml":
            vars(declared)[name] = _Guarded(declared, name)


def unguard(declared: Effect) -> Effect:
    """The effect, with its hooks as its package has them again."""
    for name in HOOKS:
        if isinstance(vars(declared).get(name), _Guarded):
            del vars(declared)[name]
    return declared


@dataclass(frozen=True, eq=False)
class _Guarded:
    """A hook of an effect; an object of its own, so that effects are pickled and copied."""

    declared: Effect
    name: str

    def __call__(self, *args: Any, **more: Any) -> Any:
        kind = type(self.declared)
        owner = f"effect '{self.declared.id}' ({kind.__module__}): its {self.name}"
        inputs = next((given for given in args if isinstance(given, Inputs)), None)
        lent = [] if inputs is None else [*inputs.temperatures.values(), *inputs.drives.values()]
        # Others are driven by the same arrays.
        locked = [values for values in lent if values.flags.writeable]
        for values in locked:
            values.flags.writeable = False
        try:
            found = getattr(kind, self.name)(self.declared, *args, **more)
        except InputError:
            raise
        except Exception as error:
            at = extract_tb(error.__traceback__)[-1]
            told = f"{type(error).__name__}: {error} ({Path(at.filename).name}, line {at.lineno})"
            raise InputError(f"{owner} ends in {told}") from error
        finally:
            for values in 2 * locked:  # a view only after what it is a view of
                with suppress(ValueError):
                    values.flags.writeable = True
        return as_series(found, None if inputs is None else len(inputs.time), owner)


def as_series(found: Any, count: int | None, what: str) -> FloatArray:
    """What foreign code gave, as finite numbers, one a sample or one for all; refused by `what` otherwise."""
    values = np.asarray(found)
    if values.dtype.kind not in "biuf":
        raise InputError(f"{what} gives {type(found).__name__} of {values.dtype}; real numbers are needed")
    if count is not None and values.shape not in ((), (1,), (count,)):
        raise InputError(f"{what} gives shape {values.shape}; ({count},), one number a sample, is needed")
    if not np.isfinite(values).all():
        at = int(np.argmin(np.isfinite(values.ravel())))
        raise InputError(f"{what} gives {values.ravel()[at]} at sample {at + 1}; finite numbers are needed")
    return np.asarray(values, dtype=np.float64)
