"""Processes that fogml starts, which end with the one that started them and print no warnings; threads."""

from __future__ import annotations

import logging
import os
import signal
import sys
import threading
import time
import warnings
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from functools import cache
from pathlib import Path
from types import FrameType
from typing import Any, Literal, NoReturn, TypeVar

from fogml.errors import InputError

Item = TypeVar("Item")
Result = TypeVar("Result")
THREADS = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), "1")
"""Environment of workers: one thread for linear algebra, so that sums come out the same on any machine."""
_LOOK_EVERY_S = 0.2


class Terminated(KeyboardInterrupt):
    """The process was asked to end by a signal other than that of the keyboard.

    Attributes
    ----------
    status
        Exit status: 128 plus the signal's number.
    """

    def __init__(self, number: int) -> None:
        super().__init__(signal.Signals(number).name)
        self.status = 128 + number


def end_as_interrupted() -> None:
    """Let SIGTERM and SIGHUP do what the keyboard's interrupt does, unless the caller had them ignored."""
    for name in ("SIGINT", "SIGTERM", "SIGHUP"):
        number = getattr(signal, name, None)
        if number is not None and signal.getsignal(number) in (signal.SIG_DFL, signal.default_int_handler):
            signal.signal(number, _interrupt)


def heed_interrupt() -> None:
    """Raise the interrupt that this process was sent, if any, once more.

    A library may have made another error of it, or none: one that is raised while an extension module loads
    comes out as an error of that import.
    """
    if _asked is not None:
        raise _asked


_asked: KeyboardInterrupt | None = None


def _interrupt(number: int, frame: FrameType | None) -> NoReturn:
    global _asked
    _asked = KeyboardInterrupt() if number == signal.SIGINT else Terminated(number)
    raise _asked


def open_closed_streams() -> None:
    """Open what takes and gives nothing in place of a standard stream that the caller closed.

    Else the next file opened has its number, and what a library or a child process prints stands in it.
    """
    for number, name in enumerate(("stdin", "stdout", "stderr")):
        try:
            os.fstat(number)
        except OSError:
            os.set_inheritable(os.open(os.devnull, os.O_RDWR), True)  # of numbers the lowest that is free
            setattr(sys, name, os.fdopen(number, "w" if number else "r", encoding="utf-8", closefd=False))


def quiet_libraries() -> None:
    """Keep warnings of libraries from stderr, unless Python was started with some asked for.

    What is wrong with a result is found in the result, see `fogml.json_files`.
    """
    if not sys.warnoptions:
        warnings.simplefilter("ignore")
    logging.getLogger().addHandler(logging.NullHandler())


def begin_worker(parent: int | None = None) -> None:
    """What a process that fogml started does first: it ends once its parent is gone.

    Asked of the system again and again by a thread: the kernel's own message of a parent's death
    (PR_SET_PDEATHSIG) comes with the end of the thread that started the process.

    Parameters
    ----------
    parent
        Number of the process that started this one; None for the present parent.
    """
    quiet_libraries()
    # The keyboard's interrupt goes to all processes of a terminal: the parent ends its workers.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    expected = os.getppid() if parent is None else parent

    def watch() -> None:
        while os.getppid() == expected:
            time.sleep(_LOOK_EVERY_S)
        os._exit(1)

    threading.Thread(target=watch, name="fogml parent watch", daemon=True).start()


def of_this_package(environment: Mapping[str, str] = os.environ) -> dict[str, str]:
    """An environment in which a new Python loads the package that runs here, whatever is installed."""
    kept = environment.get("PYTHONPATH")
    places = [str(Path(__file__).resolve().parents[1]), *([kept] if kept else [])]
    return {**environment, "PYTHONPATH": os.pathsep.join(places)}


@contextmanager
def worker_pool(count: int) -> Iterator[Any]:
    """An executor of so many processes, with one thread of linear algebra each.

    On an error or an interrupt the workers are ended at once, and what they were writing is removed on the
    next start or by `fogml.outputs.settle`.
    """
    from joblib.externals.loky import ProcessPoolExecutor

    pool = ProcessPoolExecutor(
        max_workers=count, env=THREADS, initializer=begin_worker, initargs=(os.getpid(),)
    )
    try:
        yield pool
    except BaseException:
        pool.shutdown(wait=True, kill_workers=True)
        raise
    pool.shutdown(wait=True)


def in_processes(
    function: Callable[[Item], Result], items: Iterable[Item], workers: int, *, ordered: bool = False
) -> Iterator[Result]:
    """Results of a function for each item, by so many processes; with one, in this process.

    Parameters
    ----------
    function
        Importable by name, or a `functools.partial` of such.
    items
        Its arguments.
    workers
        Processes.
    ordered
        Results in the order of the items; otherwise as they come.

    Raises
    ------
    Exception
        What the function raised; the rest is given up.
    """
    items = list(items)
    if workers == 1 or len(items) < 2:
        yield from map(function, items)
        return
    from concurrent.futures import as_completed

    with worker_pool(min(workers, len(items))) as pool:
        futures = [pool.submit(function, item) for item in items]
        for future in futures if ordered else as_completed(futures):
            yield future.result()


def made_ahead(items: Iterator[Item]) -> Iterator[Item]:
    """Items in order, each made in a thread while the one before it is worked on.

    The first is made in the caller's own thread, and what it opens belongs to that.
    """
    from concurrent.futures import ThreadPoolExecutor

    end: Any = object()
    item = next(items, end)
    with ThreadPoolExecutor(max_workers=1) as beside:
        while item is not end:
            coming = beside.submit(next, items, end)
            yield item
            item = coming.result()


def process_is_alive(pid: int, started: str) -> bool:
    """Whether a process of this machine still runs, and is the one that was meant."""
    try:
        os.kill(pid, 0)
    except (ProcessLookupError, OverflowError):  # no such number
        return False
    except PermissionError:
        pass
    return process_start(pid) == started


def process_start(pid: int) -> str:
    """What tells a process from a later one of the same number; empty where the system does not say."""
    try:
        with open(f"/proc/{pid}/stat", encoding="ascii", errors="replace") as file:
            fields = file.read().rpartition(")")[2]
    except OSError:
        return ""
    state, *rest = fields.split()
    # A process that has ended but was not waited for runs no trial.
    return "ended" if state == "Z" else rest[18]


def needs_posix(what: str) -> None:
    """Hold that the system has processes in groups, with limits.

    Raises
    ------
    InputError
        If it has none, as Windows.
    """
    if not (hasattr(os, "fork") and hasattr(os, "killpg")):
        raise InputError(f"{what} needs Linux; on Windows it works in WSL 2: fogml docs install")


def available_cores() -> int:
    """Cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def one_thread(api: Literal["blas", "openmp"] | None = None) -> Any:
    """A context in which calls of BLAS, or OpenMP, or both, use one thread each.

    As workers do: sums come out the same however many cores or workers there are.
    """
    return _controller(frozenset(filter(sys.modules.__contains__, _POOLED))).limit(limits=1, user_api=api)


_POOLED = frozenset(("numpy", "scipy.linalg", "sklearn", "torch"))
"""Libraries that bring pools of threads of their own."""


@cache
def _controller(loaded: frozenset[str]) -> Any:
    # Looking the libraries up takes milliseconds; they stay where they are.
    from threadpoolctl import ThreadpoolController

    return ThreadpoolController()
