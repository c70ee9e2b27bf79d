"""Jobs as processes forked from this one, in which every library is loaded."""

from __future__ import annotations

import atexit
import contextlib
import os
import signal
import sys
import threading
import time
import traceback
from pathlib import Path

_NO_STATUS = 99
_SIGNALS = (signal.SIGINT, signal.SIGTERM)
ORPHANS_S = 2.0
"""Time after which no process of a killed job may be alive [s]."""


class Started:
    """A job forked from this process, in a session of its own."""

    def __init__(self, folder: Path, command: tuple[str, ...]) -> None:
        self.log = folder.with_suffix(".log")
        sys.stdout.flush()
        sys.stderr.flush()
        # Signals wait until the child is the job: before, it would be this process once more.
        signal.pthread_sigmask(signal.SIG_BLOCK, _SIGNALS)
        self.process = os.fork()
        if self.process == 0:
            _become(folder, command, self.log)
        signal.pthread_sigmask(signal.SIG_UNBLOCK, _SIGNALS)
        self.began = time.monotonic()

    def ends(self, within_s: float) -> int | None:
        """Its status as `subprocess` gives it; None if it goes on."""
        until = time.monotonic() + within_s
        while True:
            process, status = os.waitpid(self.process, os.WNOHANG)
            if process:
                return os.waitstatus_to_exitcode(status)
            if time.monotonic() > until:
                return None
            time.sleep(0.002)

    def orphans(self) -> list[int]:
        """Processes of its session, or that carry its mark, that are still alive after a while."""
        until = time.monotonic() + ORPHANS_S
        while alive := processes(self.process):
            if time.monotonic() > until:
                for process in alive:
                    with contextlib.suppress(ProcessLookupError):
                        os.kill(process, signal.SIGKILL)
                return alive
            time.sleep(0.02)
        return []


def _become(folder: Path, command: tuple[str, ...], log: Path) -> None:
    """The job itself, in the forked process; never returns."""
    status = _NO_STATUS
    try:
        os.setsid()
        signal.signal(signal.SIGTERM, signal.SIG_DFL)
        os.chdir(folder)
        stream = os.open(log, os.O_WRONLY | os.O_CREAT | os.O_TRUNC)
        for number in (1, 2):
            os.dup2(stream, number)
        signal.signal(signal.SIGINT, signal.default_int_handler)
        signal.pthread_sigmask(signal.SIG_UNBLOCK, _SIGNALS)
        status = _status(command)
        # As an interpreter does at its end: processes and threads of libraries are told.
        threading._shutdown()
        atexit._run_exitfuncs()
    except KeyboardInterrupt as interrupt:
        # Before the program began, or after its end.
        status = getattr(interrupt, "status", 128 + signal.SIGINT)
    finally:
        os._exit(status)


def _status(command: tuple[str, ...]) -> int:
    from fogml.cli.main import main

    sys.argv = ["fogml", *command, "--quiet"]
    try:
        main()
    except SystemExit as end:
        return end.code if isinstance(end.code, int) else 0
    except Exception:
        traceback.print_exc()
        return _NO_STATUS
    return 0


def processes(session: int) -> list[int]:
    """Processes of a session that are alive."""
    found = []
    for entry in Path("/proc").iterdir():
        if entry.name.isdigit():
            with contextlib.suppress(OSError, IndexError):
                fields = (entry / "stat").read_text().rpartition(")")[2].split()
                if int(fields[3]) == session and fields[0] not in "ZX":
                    found.append(int(entry.name))
    return found
