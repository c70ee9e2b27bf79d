"""What models take from scikit-learn.

It loads `scipy.stats` and pandas for functions of which nothing here calls any: most of its own time.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from importlib import import_module
from importlib.util import find_spec
from threading import Lock
from types import ModuleType
from typing import Any

_EXCHANGE = Lock()


class _PutOff(ModuleType):
    """Stands for a module: what is asked of it is asked of the module itself."""

    def __getattr__(self, attribute: str) -> Any:
        _forget(self)
        return getattr(import_module(self.__name__), attribute)


def _forget(stand_in: _PutOff) -> None:
    with _EXCHANGE:
        if sys.modules.get(stand_in.__name__) is stand_in:
            del sys.modules[stand_in.__name__]


@contextmanager
def put_off(*names: str) -> Iterator[None]:
    """Within it, imports of these modules that are not loaded yet get what stands for them.

    Afterwards they are imported as ever; who got a stand-in has the module through it.
    """
    held = []
    for name in names:
        spec = None if name in sys.modules else find_spec(name)
        if spec is not None:
            stand_in = _PutOff(name)
            stand_in.__spec__ = spec
            sys.modules[name] = stand_in
            held.append(stand_in)
    try:
        yield
    finally:
        for stand_in in held:
            _forget(stand_in)


with put_off("scipy.stats", "pandas"):
    from sklearn.base import BaseEstimator, RegressorMixin, clone, is_regressor
    from sklearn.exceptions import NotFittedError
    from sklearn.utils._param_validation import Interval, StrOptions, make_constraint
    from sklearn.utils.validation import check_is_fitted, validate_data

__all__ = [
    "BaseEstimator",
    "Interval",
    "NotFittedError",
    "RegressorMixin",
    "StrOptions",
    "check_is_fitted",
    "clone",
    "is_regressor",
    "make_constraint",
    "validate_data",
]
