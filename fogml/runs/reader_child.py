"""Reads files of `fogml.readers` for `fogml.runs.reader_process`, in a process of its own, as a script.

The libraries behind these formats are written for sound files: a damaged one may end the process, hang it
or take all memory. Here that ends no more than this process. It needs the standard library, NumPy, the module
of the format's reader and the package behind it alone, so that it starts quickly. Requests come as lines of
JSON on standard input; each is answered by a line of JSON on standard output, and samples by several lines,
each with the bytes of some of them after it.
"""

from __future__ import annotations

import contextlib
import errno
import importlib
import json
import os
import sys
import threading
import warnings
from collections.abc import Iterator
from pathlib import Path
from queue import Queue
from typing import Any

ROOT = Path(__file__).resolve().parents[2]
NO_ROOM = (errno.ENOSPC, errno.EDQUOT)


def reader(place: str, package: str) -> Any:
    """The class of a reader, ``module:Class``, once the package that it needs is loaded."""
    importlib.import_module(package)
    module, _, name = place.partition(":")
    return getattr(importlib.import_module(module), name)


def limit_memory(more: int) -> None:
    """Let the process take so many bytes more than it has, where the system can tell."""
    with contextlib.suppress(ImportError, OSError, ValueError):
        import resource

        with open("/proc/self/statm", encoding="ascii") as file:
            held = int(file.read().split()[0]) * resource.getpagesize()
        hard = resource.getrlimit(resource.RLIMIT_AS)[1]
        resource.setrlimit(resource.RLIMIT_AS, (held + more, hard))


def limit_files(most: int | None) -> None:
    """Let a file that the process writes grow to so many bytes, where the system can tell; None for any."""
    with contextlib.suppress(ImportError, OSError, ValueError):
        import resource

        hard = resource.getrlimit(resource.RLIMIT_FSIZE)[1]
        resource.setrlimit(resource.RLIMIT_FSIZE, (hard if most is None else most, hard))


def limit_time(more_s: float) -> None:
    """Let the process compute so much longer; the system ends it then, whatever it is in."""
    with contextlib.suppress(ImportError, OSError, ValueError):
        import resource

        used = sum(os.times()[:2])
        hard = resource.getrlimit(resource.RLIMIT_CPU)[1]
        resource.setrlimit(resource.RLIMIT_CPU, (int(used + more_s) + 1, hard))


def end_with_parent(parent: int) -> None:
    """Be ended by the system when the parent is gone; elsewhere than on Linux the closed input ends it."""
    if sys.platform == "linux":
        import ctypes
        import signal

        with contextlib.suppress(OSError, AttributeError):
            ctypes.CDLL(None).prctl(1, signal.SIGKILL)  # PR_SET_PDEATHSIG
        if os.getppid() != parent:
            raise SystemExit
    with contextlib.suppress(ImportError, OSError, ValueError):
        import resource

        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))


def answers(
    request: dict[str, Any], files: dict[int, Any]
) -> Iterator[tuple[dict[str, Any], bytes | memoryview]]:
    """The answer to a request, and the bytes after it; samples in several parts, sent as they are read."""
    number = int(request["file"])
    limit_time(request["cpu_s"])
    if request["do"] == "close":
        files.pop(number).close()
        yield {}, b""
    elif request["do"] == "open":
        # What a reader needs is loaded before memory is limited.
        kind = reader(request["reader"], request["package"])
        limit_memory(request["memory"])
        limit_files(request["unpacked"])
        try:
            files[number] = kind(request["path"], request["keys"])
        finally:
            limit_files(None)
        yield files[number].told, b""
    else:
        array = files[number].arrays[request["array"]]
        names: list[str] = []
        if request["do"] == "text":
            parts = [array.text(request["start"], request["stop"])]
        elif request["do"] == "marks":
            names, codes = array.marks(request["most"], request["longest"])
            parts = [codes]
        else:
            samples = reader("fogml.readers.stored:samples", "numpy")
            parts = samples(array, request["start"], request["stop"])
        for part in parts:
            yield {"count": len(part), "names": names}, part.data.cast("B") if len(part) else b""


def main(parent: int) -> None:
    """Answer requests until the input ends."""
    end_with_parent(parent)
    warnings.simplefilter("ignore")
    files: dict[int, Any] = {}
    # The readers are found; nothing beside them hides another package.
    sys.path.append(str(ROOT))
    output = sys.stdout.buffer
    sys.stdout = sys.stderr  # whatever a library prints is no answer
    ready: Queue[tuple[bytes, bytes | memoryview]] = Queue(1)

    def write() -> None:
        try:
            while True:
                output.writelines(ready.get())
                output.flush()
        finally:
            os._exit(1)  # nobody listens any more

    # What is read next is read while this is written.
    threading.Thread(target=write, daemon=True).start()

    def send(told: dict[str, Any], content: bytes | memoryview = b"") -> None:
        ready.put((json.dumps(told).encode() + b"\n", content))

    for line in sys.stdin.buffer:
        try:
            for told, content in answers(json.loads(line), files):
                send(told, content)
        except MemoryError:
            send({"memory": True})
        except OSError as error:
            reason = error.strerror or str(error)
            kind = "size" if error.errno == errno.EFBIG else "room" if error.errno in NO_ROOM else "fault"
            send({kind: reason[:500]})
        except Exception as error:  # libraries raise whatever the damage leads to
            reason = next(iter(str(error).splitlines()), type(error).__name__)
            send({"fault": reason[:500]})


if __name__ == "__main__":
    main(int(sys.argv[1]))
