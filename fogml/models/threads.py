"""How many cores there are, and contexts in which libraries use one thread."""

from __future__ import annotations

import os
from functools import cache
from typing import Any, Literal


def available_cores() -> int:
    """Cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def one_thread(api: Literal["blas", "openmp"]) -> Any:
    """A context in which calls of BLAS, or OpenMP, use one thread each.

    It knows the libraries that were loaded when it was first asked for.
    """
    return _controller(api).limit(limits=1, user_api=api)


@cache
def _controller(api: str) -> Any:
    # Looking the libraries up takes milliseconds; they stay where they are.
    from threadpoolctl import ThreadpoolController

    return ThreadpoolController()
