"""Programs run without a shell, within limits on time, memory and output that `fogml.limited_child` sets."""

from __future__ import annotations

import os
import select
import signal
import subprocess
import sys
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryFile

from fogml.errors import InputError
from fogml.outputs import scratch_folder
from fogml.processes import needs_posix

_CHILD = Path(__file__).with_name("limited_child.py")


@dataclass(frozen=True)
class ProgramLimits:
    """What a program may take.

    Attributes
    ----------
    cpu_s
        Processor time of each of its processes [s].
    wall_s
        Time until it is ended [s].
    memory_bytes
        Data that each of its processes may hold [bytes]; None for what the machine has.
    output_bytes
        Size of each file that it writes, standard output among them [bytes].
    """

    cpu_s: int = 120
    wall_s: float = 300.0
    memory_bytes: int | None = 4 << 30
    output_bytes: int = 256 << 20


class LimitExceededError(Exception):
    """A program took more than it may; the message says of what."""


@dataclass(frozen=True)
class Finished:
    """What a program that ended by itself leaves: its exit status and what it wrote."""

    status: int
    output: bytes
    errors: str


def run_limited(words: Sequence[str], limits: ProgramLimits, data: bytes = b"") -> Finished:
    """Run a program; its words go to it as they are, and no shell reads them.

    Raises
    ------
    LimitExceededError
        If it took more; whatever it had started is ended.
    InputError
        If the system has no such limits, or does not let the program run.
    """
    needs_posix(f"{Path(words[0]).name}, which runs within limits,")
    from fogml.limited_child import CANNOT_RUN

    memory = -1 if limits.memory_bytes is None else limits.memory_bytes
    stated = (limits.cpu_s, memory, limits.output_bytes)
    launcher = [sys.executable, "-I", "-S", str(_CHILD), *map(str, stated), *words]
    with (
        TemporaryFile() as given,
        TemporaryFile() as output,
        TemporaryFile() as errors,
        scratch_folder() as scratch,
    ):
        given.write(data)
        given.seek(0)
        process = subprocess.Popen(
            launcher,
            stdin=given,
            stdout=output,
            stderr=errors,
            start_new_session=True,
            # A compiler that is ended leaves its temporary files.
            env={**os.environ, "TMPDIR": str(scratch)},
        )
        try:
            status = _status(process, limits.wall_s)
        except subprocess.TimeoutExpired:
            raise LimitExceededError(f"took more than {limits.wall_s:g} s") from None
        finally:
            # What it started may outlive it.
            _end_group(process)
        output.seek(0)
        errors.seek(0)
        told = errors.read().decode("utf-8", errors="replace")
        if status == -signal.SIGXCPU:
            raise LimitExceededError(f"took more than {limits.cpu_s} s of processor time")
        if status == -signal.SIGXFSZ:
            raise LimitExceededError(f"wrote more than {limits.output_bytes >> 20} MB")
        if told.startswith(CANNOT_RUN):
            raise InputError(
                f"{words[0]}: cannot be run ({told.removeprefix(CANNOT_RUN)}); where programs among "
                "temporary files may not run, let TMPDIR name a folder where they may"
            )
        return Finished(status, output.read(), told)


def _status(process: subprocess.Popen[bytes], wall_s: float) -> int:
    """The exit status, waited for; `Popen.wait` with a limit looks every 50 ms, and Linux tells at once."""
    with suppress(AttributeError, OSError):
        told = os.pidfd_open(process.pid)
        try:
            ended = select.poll()
            ended.register(told, select.POLLIN)
            ended.poll(1e3 * wall_s)
        finally:
            os.close(told)
        wall_s = 0.0
    return process.wait(wall_s)


def _end_group(process: subprocess.Popen[bytes]) -> None:
    with suppress(ProcessLookupError, PermissionError):
        os.killpg(process.pid, signal.SIGKILL)
    process.wait()
