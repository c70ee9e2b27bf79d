"""Reads files of `fogml.readers` for `fogml.runs.reader_process`, in a process of its own, as a script.

The libraries behind these formats are written for sound files: a damaged one may end the process, hang it
or take all memory. Here that ends no more than this process. It needs the standard library, NumPy, the module
of the format's reader and the package behind it alone, so that it starts quickly. Requests come as lines of
JSON on standard input; each is answered by a line of JSON on standard output, and for samples by their bytes
after it.
"""

from __future__ import annotations

import contextlib
import errno
import importlib
import json
import os
import sys
import warnings
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[2]
NO_ROOM = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)


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


def answer(request: dict[str, Any], files: dict[int, Any]) -> tuple[dict[str, Any], bytes | memoryview]:
    """The answer to a request, and the bytes after it."""
    number = int(request["file"])
    limit_time(request["cpu_s"])
    if request["do"] == "close":
        files.pop(number).close()
        return {}, b""
    if request["do"] == "open":
        # What a reader needs is loaded before memory is limited.
        kind = reader(request["reader"], request["package"])
        limit_memory(request["memory"])
        files[number] = kind(request["path"], request["keys"])
        return files[number].told, b""
    array = files[number].arrays[request["array"]]
    names: list[str] = []
    if request["do"] == "text":
        part = array.text(request["start"], request["stop"])
        return {"count": len(part), "names": names}, part.data
    if request["do"] == "marks":
        names, found = array.marks(request["most"])
    else:
        found = reader("fogml.readers.stored:samples", "numpy")(array, request["start"], request["stop"])
    return {"count": len(found), "names": names}, found.data.cast("B") if len(found) else b""


def main(parent: int) -> None:
    """Answer requests until the input ends."""
    end_with_parent(parent)
    warnings.simplefilter("ignore")
    files: dict[int, Any] = {}
    # The readers are found; nothing beside them hides another package.
    sys.path.append(str(ROOT))
    output = sys.stdout.buffer
    sys.stdout = sys.stderr  # whatever a library prints is no answer
    for line in sys.stdin.buffer:
        try:
            told, content = answer(json.loads(line), files)
        except MemoryError:
            told, content = {"memory": True}, b""
        except OSError as error:
            reason = error.strerror or str(error)
            key = "room" if error.errno in NO_ROOM else "fault"
            told, content = {key: reason[:500]}, b""
        except Exception as error:  # libraries raise whatever the damage leads to
            reason = next(iter(str(error).splitlines()), type(error).__name__)
            told, content = {"fault": reason[:500]}, b""
        output.write(json.dumps(told).encode() + b"\n")
        output.write(content)
        output.flush()


if __name__ == "__main__":
    main(int(sys.argv[1]))
