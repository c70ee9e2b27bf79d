"""Programs run without a shell and within limits on time, memory and output.

Run as a program itself, this file sets its limits and becomes the program named: limits set in
the child of a process with threads would need a fork of those threads.
"""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryFile


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

    Parameters
    ----------
    words
        The program and its arguments.
    limits
        What it may take.
    data
        Its standard input.

    Raises
    ------
    LimitExceededError
        If it took more; whatever it had started is ended.
    """
    memory = -1 if limits.memory_bytes is None else limits.memory_bytes
    stated = (limits.cpu_s, memory, limits.output_bytes)
    launcher = [sys.executable, "-I", "-S", str(Path(__file__)), *map(str, stated), *words]
    with TemporaryFile() as given, TemporaryFile() as output, TemporaryFile() as errors:
        given.write(data)
        given.seek(0)
        process = subprocess.Popen(
            launcher, stdin=given, stdout=output, stderr=errors, start_new_session=True
        )
        try:
            status = process.wait(limits.wall_s)
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
        return Finished(status, output.read(), told)


def _end_group(process: subprocess.Popen[bytes]) -> None:
    with suppress(ProcessLookupError, PermissionError):
        os.killpg(process.pid, signal.SIGKILL)
    process.wait()


def _become(cpu_s: str, memory_bytes: str, output_bytes: str, *words: str) -> None:
    import resource

    for kind, limit in (
        (resource.RLIMIT_CPU, int(cpu_s)),
        # Not the address space, of which an emulator reserves more than it uses.
        (resource.RLIMIT_DATA, int(memory_bytes)),
        (resource.RLIMIT_FSIZE, int(output_bytes)),
        (resource.RLIMIT_CORE, 0),
    ):
        _, most = resource.getrlimit(kind)
        if limit == resource.RLIM_INFINITY:
            continue
        # Of processor time the first limit tells itself apart by its signal; none survives the second.
        last = limit + 1 if kind == resource.RLIMIT_CPU else limit
        if most != resource.RLIM_INFINITY:
            limit, last = min(limit, most), min(last, most)
        resource.setrlimit(kind, (limit, last))
    os.execvp(words[0], words)


if __name__ == "__main__":
    _become(*sys.argv[1:])
