"""Files of `fogml.readers`, read in a process of its own with limits on time and memory.

What a file holds is parsed by `fogml.runs.reader_child`; here come its names and samples, and where it ends
without an answer, a message that names the file.
"""

from __future__ import annotations

import contextlib
import importlib.util
import json
import os
import signal
import subprocess
import sys
import tempfile
import threading
import weakref
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import count
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fogml.errors import InputError, printable
from fogml.readers import extra_hint, reader_of
from fogml.readers.stored import MOST_NAMES
from fogml.runs.reading_limits import DEFAULT_LIMITS, ReadingLimits

__all__ = [
    "CHILD", "DEFAULT_LIMITS", "ReaderProcess", "ReadingLimits", "StoredArray", "StoredFile", "stored_file",
]  # fmt: skip

CHILD = Path(__file__).with_name("reader_child.py")
_LONGEST_ANSWER = 1 << 26
_PIPE_BYTES = 1 << 20
"""Of samples on their way: the most that Linux lets any user have."""


@dataclass(frozen=True)
class StoredArray:
    """An array of a file: its place in the catalogue, name, unit if one is stated beside it, and shape.

    `fault` says why it can't be read, if so.
    """

    index: int
    name: str
    unit: str | None
    kind: str
    type_name: str
    shape: tuple[int, ...]
    fault: str | None
    group: str = ""

    @property
    def is_vector(self) -> bool:
        """Whether it has one axis alone that is longer than 1."""
        return bool(self.shape) and sum(size != 1 for size in self.shape) <= 1


class StoredFile:
    """A file that is open in the other process.

    Attributes
    ----------
    arrays
        What it holds.
    told
        Facts and units beside the arrays, plain values.
    """

    def __init__(self, path: Path, process: ReaderProcess, number: int, limits: ReadingLimits) -> None:
        self.path, self._process, self._number, self.limits = path, process, number, limits
        self.arrays: tuple[StoredArray, ...] = ()
        self.told: Mapping[str, Any] = {}

    def read(self, array: StoredArray, start: int, stop: int) -> NDArray[np.float64]:
        """Samples `start` to `stop` of a vector, shape (stop - start,).

        Raises
        ------
        InputError
            If the file is damaged there.
        """
        values = np.empty(stop - start, dtype=np.float64)
        if len(values):
            self.ask({"do": "read", "array": array.index, "start": start, "stop": stop}, values)
        return values

    def marks(self, array: StoredArray, most: int = MOST_NAMES) -> NDArray[np.str_]:
        """The texts of a column of marks, shape (n,), of which at most so many differ.

        Raises
        ------
        InputError
            If the file is damaged there.
        """
        codes = np.empty(max(array.shape), dtype=np.float64)
        bounds = {"most": most, "longest": self.limits.mark_characters}
        names = self.ask({"do": "marks", "array": array.index, **bounds}, codes)["names"]
        return np.array(names, dtype=np.str_)[codes.astype(np.intp)] if len(codes) else np.empty(0, np.str_)

    def text(self, array: StoredArray, block: int = 1 << 20) -> Iterator[bytes]:
        """The text of a worksheet, as of a CSV file, in blocks of so many bytes.

        Raises
        ------
        InputError
            If the file is damaged.
        """
        self.limits.check_size(self.path, max(array.shape) / 8)
        for start in range(0, max(array.shape), block):
            content = np.empty(min(block, max(array.shape) - start), dtype=np.uint8)
            stop = start + len(content)
            self.ask({"do": "text", "array": array.index, "start": start, "stop": stop}, content)
            yield content.tobytes()

    def ask(self, request: Mapping[str, Any], into: NDArray[Any] | None = None) -> dict[str, Any]:
        """The answer to a request."""
        megabytes = self.path.stat().st_size / 1e6 if self.path.exists() else 0.0
        for_size = self.limits.cpu_s_per_mb * megabytes
        request = {**request, "file": self._number, "cpu_s": self.limits.cpu_s + for_size}
        # Several files may be read at once, each ahead of where its blocks are used.
        with self._process.one_at_a_time:
            told = self._process.ask(request, into, self.limits.wall_s + 2.0 * for_size)
        if told is None:
            raise InputError(f"{self.path.name}: damaged: {self._process.end()}; copy or export it again")
        if "memory" in told:
            more = f"more than {self.memory / 1e6:.0f} MB, or than a program may have here"
            raise InputError(
                f"{self.path.name}: damaged, or too large: reading it takes {more}; copy or export it again"
            )
        if "size" in told:
            raise InputError(
                f"{self.path.name}: damaged: it unpacks to over {self.limits.unpacked(self.path) / 1e6:.0f} "
                "MB, which no recording of its size does; copy or export it again"
            )
        if "room" in told:
            raise InputError(
                f"{self.path.name}: its columns are unpacked into {tempfile.gettempdir()}, which takes no "
                f"more ({told['room']}); make room there, or let TMPDIR name another folder"
            )
        if "fault" in told:
            raise _Fault(_one_line(told["fault"]))
        return told

    @property
    def memory(self) -> int:
        """Bytes that reading it may take."""
        size = self.path.stat().st_size if self.path.exists() else 0
        return int(1e6 * self.limits.memory_mb + self.limits.memory_per_byte * size)


class _Fault(Exception):
    """What the format's library says of a file."""


@contextlib.contextmanager
def stored_file(path: Path, kind: str, keys: Sequence[str], limits: ReadingLimits) -> Iterator[StoredFile]:
    """A file opened in the other process; `keys` are the attributes that are read."""
    reader = reader_of(kind)
    if reader.extra is not None and importlib.util.find_spec(reader.package.partition(".")[0]) is None:
        raise InputError(extra_hint(reader, path))
    limits = limits.at_least(reader.cpu_s_per_mb, reader.memory_per_byte)
    process = _processes.of_thread()
    stored = StoredFile(path, process, next(_numbers), limits)
    try:
        request = {"do": "open", "path": os.path.abspath(path), "keys": list(keys)}
        request |= {"reader": reader.place, "package": reader.package}
        stored.told = stored.ask({**request, "memory": stored.memory, "unpacked": limits.unpacked(path)})
        stored.arrays = tuple(_array(i, told) for i, told in enumerate(stored.told["arrays"]))
        yield stored
    except _Fault as fault:
        told = printable(str(fault), 120)
        raise InputError(
            f"{path.name}: damaged or no {reader.label} file ({told}); copy or export it again"
        ) from None
    finally:
        if process.is_alive and not sys.is_finalizing():  # then no thread begins, to time the answer
            with contextlib.suppress(_Fault, InputError):
                stored.ask({"do": "close"})


def _one_line(told: object) -> str:
    """What a library says, some of it over several lines, in one."""
    return " ".join(str(told).split())


def _array(index: int, told: Mapping[str, Any]) -> StoredArray:
    unit = told["unit"]
    return StoredArray(
        index,
        str(told["name"]),
        None if unit is None else str(unit),
        str(told.get("kind", "O")),
        str(told.get("type", "")),
        tuple(int(size) for size in told.get("shape", ())),
        None if told["fault"] is None else _one_line(told["fault"]),
        str(told.get("group", "")),
    )


class ReaderProcess:
    """The other process: it answers one request after another until one ends it."""

    def __init__(self, script: Path = CHILD) -> None:
        # Plug-ins of HDF5 are other people's code; arithmetic in several threads is of no use here.
        environment = {**os.environ, "HDF5_PLUGIN_PRELOAD": "::", "OPENBLAS_NUM_THREADS": "1"}
        # Other allocators reserve more than a limited process may have.
        environment |= {"ARROW_DEFAULT_MEMORY_POOL": "system"}
        environment.pop("HDF5_PLUGIN_PATH", None)
        self._process = subprocess.Popen(
            [sys.executable, "-P", "-W", "ignore", str(script), str(os.getpid())],
            stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, env=environment,
            pipesize=_PIPE_BYTES,
        )  # fmt: skip
        self.is_alive = True
        self._timed_out = False
        self.one_at_a_time = threading.Lock()
        self._finish = weakref.finalize(self, _finish, self._process, os.getpid())

    def is_ready(self) -> bool:
        """Whether it can be asked."""
        return self.is_alive and self._process.poll() is None

    def ask(
        self, request: Mapping[str, Any], into: NDArray[Any] | None, wall_s: float
    ) -> dict[str, Any] | None:
        """The answer to a request, its samples read into `into`; None where the process ended."""
        assert self._process.stdin is not None and self._process.stdout is not None
        self._timed_out = False
        clock = threading.Timer(wall_s, self._give_up)
        clock.daemon = True
        clock.start()
        done = False
        try:
            self._process.stdin.write(json.dumps(request).encode() + b"\n")
            self._process.stdin.flush()
            told, filled = self._told(), 0
            while into is not None and "count" in told:
                part = into[filled : filled + told["count"]]
                filled += len(part)
                if len(part) != told["count"] or not self._fill(part):
                    return None
                if filled == len(into):
                    break
                told = self._told()
            done = True
            return told
        except (OSError, ValueError, TypeError, RecursionError):
            return None
        finally:
            clock.cancel()
            self.is_alive = done
            if not done:
                self._end_now()

    def _told(self) -> dict[str, Any]:
        assert self._process.stdout is not None
        line = self._process.stdout.readline(_LONGEST_ANSWER)
        if not line.endswith(b"\n"):
            raise ValueError("no whole answer")
        told: dict[str, Any] = json.loads(line)
        return told

    def _fill(self, into: NDArray[Any]) -> bool:
        assert self._process.stdout is not None
        rest = into.data.cast("B") if len(into) else memoryview(b"")
        while len(rest) and (got := self._process.stdout.readinto(rest)):  # type: ignore[attr-defined]
            rest = rest[got:]
        return not len(rest)

    def _end_now(self) -> None:
        """End it: an interrupt leaves half an answer in the pipe. One that ended by itself says how."""
        with contextlib.suppress(subprocess.TimeoutExpired):
            self._process.wait(0.2)
        self._process.kill()

    def _give_up(self) -> None:
        self._timed_out = True
        self._process.kill()

    def end(self) -> str:
        """How it ended, in words."""
        code = -self._process.wait()
        name = signal.Signals(code).name if code in set(signal.Signals) else f"status {-code}"
        if self._timed_out or name == "SIGXCPU":
            return "reading it came to no end and was stopped"
        likely = ": for want of memory? A workbook may have a lone cell far from its table"
        return f"its reader crashed ({name}{likely if name == 'SIGABRT' else ''})"


def _finish(process: subprocess.Popen[bytes], owner: int) -> None:
    for pipe in (process.stdin, process.stdout):
        if pipe is not None:
            with contextlib.suppress(OSError):
                pipe.close()
    # A process forked from the owner has no say in it.
    if os.getpid() == owner:
        process.kill()
        process.wait()
    else:
        process.returncode = 0


class _Processes(threading.local):
    """One process for each thread: it ends with the thread that began it."""

    process: ReaderProcess | None = None
    owner = 0

    def of_thread(self) -> ReaderProcess:
        """The thread's process, a new one if the last one ended."""
        if self.process is None or not self.process.is_ready() or self.owner != os.getpid():
            self.process, self.owner = ReaderProcess(), os.getpid()
        return self.process


_processes = _Processes()
_numbers = count()
