"""Processes forked from one that has the modules of other makers loaded: tests then cost only their own time.

Nothing of the project is loaded there, so that each process reads the code as it is by then.
"""

from __future__ import annotations

import multiprocessing
import os
import resource
import sys
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

_CONTEXT = multiprocessing.get_context("forkserver")


def loaded_before(*modules: str) -> None:
    """Modules that processes from now on begin with."""
    _CONTEXT.set_forkserver_preload(list(modules))


def ended(
    tree: Path,
    main: Callable[[list[str]], Any],
    words: Sequence[str],
    log: Path,
    *,
    variables: Mapping[str, str] | None = None,
    cpu_s: float | None = None,
) -> int:
    """With what a program of a tree ends; negative for a signal, which the limit of its time is too."""
    told = (tree, main, list(words), log, dict(variables or {}), cpu_s)
    process = _CONTEXT.Process(target=_begun, args=told)
    process.start()
    try:
        process.join()
    finally:
        process.kill()
    assert process.exitcode is not None
    return process.exitcode


def _begun(
    tree: Path,
    main: Callable[[list[str]], Any],
    words: list[str],
    log: Path,
    variables: dict[str, str],
    cpu_s: float | None,
) -> None:
    """Only that tree's code, and nothing that is compiled of a change left for the next process."""
    path = [str(tree), *filter(None, [os.environ.get("PYTHONPATH")])]
    os.environ.update(PYTHONPATH=os.pathsep.join(path), PYTHONDONTWRITEBYTECODE="1", **variables)
    os.chdir(tree)
    sys.path.insert(0, str(tree))
    sys.dont_write_bytecode = True
    if cpu_s is not None:
        resource.setrlimit(resource.RLIMIT_CPU, (int(cpu_s), int(cpu_s) + 5))
    for stream, place in enumerate((os.devnull, log, log)):
        os.dup2(os.open(place, os.O_RDWR | os.O_CREAT | os.O_APPEND), stream)
    from numba.core.config import reload_config

    reload_config()  # its variables were read when it was loaded
    os._exit(int(main(words) or 0))
