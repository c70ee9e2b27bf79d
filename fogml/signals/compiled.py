"""Kernels compiled by numba, kept on disk where that is possible. Loads numba."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar

import numba

Function = TypeVar("Function", bound=Callable[..., Any])


def kernel(signature: Any = None, **options: Any) -> Callable[[Function], Function]:
    """Compile a function, without Python's lock; what was compiled is kept for the next process.

    It is kept beside the source, else in the user's cache folder (or NUMBA_CACHE_DIR). Where neither can
    be written, is full, or holds something damaged, the function is compiled in each process.

    Parameters
    ----------
    signature
        Types to compile for at once; None for those of the first call.
    options
        As `numba.njit` takes them.
    """

    def compiled(function: Function) -> Function:
        dispatcher = numba.njit(nogil=True, **options)(function)
        try:
            dispatcher.enable_caching()
        except RuntimeError:
            pass  # no folder for it
        else:
            cache = dispatcher._cache
            cache.load_overload = _or_none(cache.load_overload)
            cache.save_overload = _or_none(cache.save_overload)
        if signature is not None:
            dispatcher.compile(signature)
            dispatcher.disable_compile()
        return dispatcher

    return compiled


def _or_none(step: Callable[..., Any]) -> Callable[..., Any]:
    """A step of numba's cache that never stops the work: what it raises depends on what it finds on disk."""

    def tolerant(*words: Any) -> Any:
        try:
            return step(*words)
        except Exception:
            return None

    return tolerant
