"""Counting work: calls within fogml, bytes at the peak, modules loaded, instructions of exported C."""

from __future__ import annotations

import json
import subprocess
import sys
import tracemalloc
from collections.abc import Callable
from pathlib import Path
from types import FrameType
from typing import Any

import fogml

PACKAGE = str(Path(fogml.__file__).parent)
_CALLS = ("call", "c_call")


def calls(job: Callable[[], Any]) -> int:
    """Calls of fogml's own functions, and those of compiled code that they make, while a job runs.

    What other libraries do within themselves does not count: it changes with their versions.
    """
    count = 0

    def count_call(frame: FrameType, event: str, argument: Any) -> None:
        nonlocal count
        count += event in _CALLS and frame.f_code.co_filename.startswith(PACKAGE)

    before = sys.getprofile()
    sys.setprofile(count_call)
    try:
        job()
    finally:
        sys.setprofile(before)
    return count


def peak_bytes(job: Callable[[], Any]) -> int:
    """Bytes that a job holds at its peak, above what was held before; for a process of its own.

    Tracing goes on afterwards: Python 3.11 may crash where it is stopped while a library's thread frees
    memory (https://github.com/python/cpython/issues/128679).
    """
    if not tracemalloc.is_tracing():
        tracemalloc.start()
    tracemalloc.reset_peak()
    before = tracemalloc.get_traced_memory()[0]
    job()
    return tracemalloc.get_traced_memory()[1] - before


def in_own_process(expression: str) -> Any:
    """The value of an expression as JSON tells it, such as ``experiments.watch.figures.measured()``."""
    module = expression.partition("(")[0].rpartition(".")[0]
    code = f"import json, os, {module}\nprint(json.dumps({expression}), flush=True)\nos._exit(0)"
    told = subprocess.run([sys.executable, "-c", code], stdout=subprocess.PIPE, text=True, check=True)
    return json.loads(told.stdout.splitlines()[-1])


def modules_loaded(statement: str) -> int:
    """Modules of fogml that a statement loads in a new interpreter, and all others."""
    code = f"import sys\nbefore = set(sys.modules)\n{statement}\nprint(len(set(sys.modules) - before))"
    told = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    return int(told.stdout.split()[-1])
