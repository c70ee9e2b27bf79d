"""A study's journal file that survives killed writers and full disks."""

from __future__ import annotations

import json
import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from optuna.storages.journal import JournalFileBackend, JournalFileOpenLock

from fogml.locks import FileLock


class WholeLines(JournalFileBackend):
    """Optuna's journal file, of which every line is whole.

    A line that could not be written to its end is taken back, so the file stays readable when the
    disk fills; what a writer that was killed left of a line is dropped by the next one.
    """

    def __init__(self, file_path: str) -> None:
        path = Path(file_path)
        # The journal itself is locked: it is only ever added to, and no other file is left.
        lock: Any = FileLock(path)
        lock.acquire()
        lock.release()
        if not lock.sure:
            # Without such locks, as on some shares: a file of Optuna's, which others take away from a process
            # that was killed after half a minute.
            lock = JournalFileOpenLock(file_path)
        self._journal, self._guard = path, lock
        super().__init__(file_path, lock_obj=lock)

    def append_logs(self, logs: list[dict[str, Any]]) -> None:
        """Append entries, all or none."""
        text = "".join(json.dumps(log, separators=(",", ":")) + "\n" for log in logs)
        with self._locked(), self._journal.open("r+b", buffering=0) as file:
            end = _end_of_lines(file)
            file.seek(end)
            try:
                _write_all(file, text.encode())
                os.fsync(file.fileno())
            except OSError:
                file.truncate(end)
                raise

    @contextmanager
    def _locked(self) -> Iterator[None]:
        self._guard.acquire()
        try:
            yield
        finally:
            self._guard.release()


def _write_all(file: Any, data: bytes) -> None:
    """Write every byte: a disk that fills takes some of them first, and says so only on the next."""
    while data:
        data = data[file.write(data) :]


def _end_of_lines(file: Any) -> int:
    """Where the last whole line ends; what follows it is cut off."""
    end = file.seek(0, os.SEEK_END)
    if end == 0:
        return 0
    file.seek(end - 1)
    if file.read(1) == b"\n":
        return int(end)
    whole = end
    while whole > 0:
        start = max(0, whole - 65536)
        file.seek(start)
        piece = file.read(whole - start)
        found = piece.rfind(b"\n")
        if found >= 0:
            whole = start + found + 1
            break
        whole = start
    file.truncate(whole)
    return int(whole)
