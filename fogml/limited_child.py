"""A program of its own: sets its limits and becomes the program named.

Limits set in the child of a process with threads would need a fork of those threads. It loads next to
nothing, as an export starts it for each run of a compiler and of a program.
"""

from __future__ import annotations

import os
import resource
import signal
import sys

CANNOT_RUN = "fogml cannot run it: "
"""What is said, with the system's reason, of a program that can't be begun."""


def become(cpu_s: str, memory_bytes: str, output_bytes: str, *words: str) -> None:
    """Set the limits of `fogml.limited.ProgramLimits` and become a program."""
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
    # Python ignores it, and so would what it becomes: writes beyond the limit would fail one by one.
    signal.signal(signal.SIGXFSZ, signal.SIG_DFL)
    try:
        os.execvp(words[0], words)
    except OSError as error:
        sys.stderr.write(f"{CANNOT_RUN}{error.strerror}")
        sys.exit(1)


if __name__ == "__main__":
    become(*sys.argv[1:])
