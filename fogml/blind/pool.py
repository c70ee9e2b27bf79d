"""A sealed worker process as its keeper sees it: start, ask with a time limit, end."""

from __future__ import annotations

import json
import os
import queue
import subprocess
import sys
import threading
from collections.abc import Callable, Mapping
from contextlib import ExitStack
from pathlib import Path
from typing import IO, Any

from fogml.blind.worker import ANSWERED, STARTED
from fogml.errors import InputError, printable
from fogml.outputs import scratch_folder
from fogml.processes import of_this_package

_KEPT = ("PATH", "LANG", "LC_ALL", "LD_LIBRARY_PATH", "PYTHONPATH", "SYSTEMROOT")
_THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS")
_START_S = 300.0
_LOG = "log.txt"
_LONGEST, _SHOWN = 1 << 20, 80
# Characters of a line that a worker says, and of one that a message shows.


class WorkerLost(Exception):
    """The worker ended, or took too long; its message says which."""

    def __init__(self, reason: str, message: str) -> None:
        super().__init__(message)
        self.reason = reason


class Worker:
    """One sealed process with a folder of its own, away from the suite.

    Parameters
    ----------
    method
        Name of a method, or ``module:function``.
    code
        Folder of the method's own code, where that is not installed.
    threads
        Threads that it may use.
    begun
        Called with the worker once its process runs, before the method has loaded.

    Raises
    ------
    InputError
        If the method does not load.
    """

    def __init__(
        self,
        method: str,
        code: Path | None = None,
        threads: int = 1,
        begun: Callable[[Worker], None] | None = None,
    ) -> None:
        self._folder = ExitStack()
        self.home = Path(os.path.realpath(self._folder.enter_context(scratch_folder())))
        environment = of_this_package({name: os.environ[name] for name in _KEPT if name in os.environ})
        environment |= dict.fromkeys(_THREADS, str(threads))
        environment |= {"HOME": str(self.home), "TMPDIR": str(self.home), "PYTHONUNBUFFERED": "1"}
        command = [sys.executable, "-m", "fogml.blind.worker", method]
        self._log = (self.home / _LOG).open("w+b")
        self._process = subprocess.Popen(
            command + ([str(code.absolute())] if code else []),
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=self._log,
            cwd=self.home,
            env=environment,
            encoding="utf-8",
        )
        self._lines: queue.Queue[str | None] = queue.Queue()
        assert self._process.stdout is not None
        threading.Thread(target=_read, args=(self._process.stdout, self._lines), daemon=True).start()
        if begun is not None:
            begun(self)
        try:
            told = self._next(_START_S, STARTED)
            self.locks, self.code = str(told["locks"]), str(told["code"])
        except WorkerLost as lost:
            self.end()
            raise InputError(f"method '{method}' did not start: {lost}") from None

    def ask(self, values: dict[str, Any], limit_s: float) -> dict[str, Any]:
        """The answer to one line.

        Raises
        ------
        WorkerLost
            If it ended or took longer than `limit_s` [s]; it is of no use then.
        """
        assert self._process.stdin is not None
        try:
            self._process.stdin.write(json.dumps(values) + "\n")
            self._process.stdin.flush()
        except OSError:
            pass  # it has ended, which the reading below tells
        return self._next(limit_s, ANSWERED)

    def kill(self) -> None:
        """End the process: whoever waits for its answer meets `WorkerLost`."""
        self._process.kill()

    def end(self) -> None:
        """End the process and remove its folder."""
        self.kill()
        self._process.wait()
        for stream in (self._process.stdin, self._process.stdout, self._log):
            if stream is not None:
                stream.close()
        self._folder.close()

    def _next(self, limit_s: float, told: Mapping[str, Any]) -> dict[str, Any]:
        try:
            line = self._lines.get(timeout=limit_s)
        except queue.Empty:
            raise WorkerLost("timed out", f"no answer within {limit_s:g} s") from None
        if line is None:
            status = self._process.wait()
            raise WorkerLost("crashed", f"the process ended with status {status}{self._last_words()}")
        try:
            answer = json.loads(line)
        except (ValueError, RecursionError):
            answer = None
        if not isinstance(answer, dict) or any(not isinstance(answer.get(k), t) for k, t in told.items()):
            raise WorkerLost("crashed", f"it said what is no answer: {printable(line.strip(), _SHOWN)}")
        return answer

    def _last_words(self) -> str:
        self._log.seek(0)
        lines = self._log.read().decode("utf-8", "replace").strip().splitlines()
        return f": {lines[-1]}" if lines else ""


def _read(stream: IO[str], lines: queue.Queue[str | None]) -> None:
    try:
        while line := stream.readline(_LONGEST):
            lines.put(line)
    except ValueError:
        pass  # closed by `end`
    lines.put(None)
