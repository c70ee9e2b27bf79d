"""Jobs of the app: a folder each, so that they outlive the server and are found again.

``python -m fogml.app.jobs FOLDER``: runs a job's command to its end, whatever becomes of who started it.

The process has a session of its own. ``process.json`` says that it runs and cannot be made twice, so that a
job never runs twice; ``ended.json`` says how it ended.
"""

from __future__ import annotations

import contextlib
import json
import os
import shlex
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from fogml.errors import InputError
from fogml.folders import give_name
from fogml.json_files import write_json
from fogml.outputs import whole_file
from fogml.processes import of_this_package, process_is_alive, process_start

PROCESS, ENDED, CANCELLED = "process.json", "ended.json", "cancelled"


def tell(path: Path, values: Any) -> None:
    """Write JSON that is there whole or not at all."""
    with whole_file(path) as partial:
        write_json(partial, values)


def _claim(folder: Path, process: Any) -> bool:
    """Say that a job runs; False if that was said before."""
    partial = folder / f"{PROCESS}.{os.getpid()}"
    write_json(partial, process)
    try:
        give_name(partial, folder / PROCESS)
    except FileExistsError:
        return False
    finally:
        partial.unlink(missing_ok=True)
    return True


def begin(folder: Path) -> None:
    """Begin the job of a folder in a process of its own, unless it was begun before."""
    heard, told = os.pipe()
    pid = os.fork()
    if pid:
        process = {"pid": pid, "started": process_start(pid), "child": None, "child_started": ""}
        os.write(told, b"1" if _claim(folder, process) else b"0")
        return
    os.setsid()
    # Should the other fail, the pipe has an end.
    os.close(told)
    if os.read(heard, 1) == b"1":
        run(folder)


def run(folder: Path) -> None:
    """Run the job of a folder, from the folder two above it, to its end."""
    words = json.loads((folder / "job.json").read_text(encoding="utf-8"))["words"]
    process = json.loads((folder / PROCESS).read_text(encoding="utf-8"))
    # Only what is told to the command ends it; with a handler rather than ignored, it hears of that itself.
    for name in (signal.SIGTERM, signal.SIGHUP, signal.SIGINT):
        signal.signal(name, lambda number, frame: None)
    began = time.monotonic()
    # Without the folder on the path: what lies there is data.
    command = [sys.executable, "-P", "-m", "fogml", *words]
    with open(folder / "stdout", "wb") as out, open(folder / "stderr", "wb") as err:
        child = subprocess.Popen(
            command,
            cwd=folder.parents[1],
            stdin=subprocess.DEVNULL,
            stdout=out,
            stderr=err,
            env=of_this_package(),
        )
        held = {"child": child.pid, "child_started": process_start(child.pid)}
        tell(folder / PROCESS, {**process, **held})
        if (folder / CANCELLED).exists():
            with contextlib.suppress(ProcessLookupError):
                child.terminate()
        status = child.wait()
    tell(folder / ENDED, {"status": status, "seconds": time.monotonic() - began})


TAIL_BYTES = 20_000
"""How much of what a job printed is shown: its end."""
STATES = {0: "done", 1: "limit", 2: "refused", 130: "cancelled", 143: "cancelled"}
"""What an exit status says: done, done and a limit was not met, bad input, interrupted; else it failed."""


class Jobs:
    """The jobs of a folder.

    Parameters
    ----------
    home
        Folder of the app; jobs lie in ``jobs/NNNN``.
    at_once
        How many may run at a time; others wait.
    """

    def __init__(self, home: Path, at_once: int) -> None:
        self.home, self.at_once = home, at_once
        self.folder = home / "jobs"
        self.folder.mkdir(exist_ok=True)
        self._written: dict[tuple[str, int, int, str], list[str]] = {}

    def names(self) -> list[str]:
        """Numbers of the jobs, in the order in which they were asked for."""
        held = [p.name for p in self.folder.iterdir() if p.name.isdecimal() and (p / "job.json").exists()]
        return sorted(held, key=int)

    def add(self, words_of: Callable[[str], list[str]]) -> str:
        """A new job; `words_of` gives its command from the folder of its results. Its number."""
        number = max([int(name) for name in os.listdir(self.folder) if name.isdecimal()], default=0) + 1
        while True:
            name = f"{number:04d}"
            try:
                (self.folder / name).mkdir()
                # Some commands write a file rather than a folder.
                (self.folder / name / "results").mkdir()
                break
            except FileExistsError:
                number += 1
        words = words_of(f"jobs/{name}/results")
        made = datetime.now(UTC).isoformat(timespec="seconds")
        tell(self.folder / name / "job.json", {"words": words, "made": made})
        self.start_waiting()
        return name

    def start_waiting(self) -> None:
        """Start what waits, as far as may run at once."""
        states = {name: self.state(name) for name in self.names()}
        free = self.at_once - sum(state == "running" for state in states.values())
        for name in [name for name, state in states.items() if state == "waiting"][: max(free, 0)]:
            # It returns once the job is under way, in a session of its own. One that can't be begun, as on a
            # disk that is full, waits on.
            subprocess.run(
                [sys.executable, "-P", "-m", "fogml.app.jobs", str(self.folder / name)],
                stdin=subprocess.DEVNULL,
                stdout=subprocess.DEVNULL,
                stderr=subprocess.DEVNULL,
                check=False,
                env=of_this_package(),
            )

    def state(self, name: str) -> str:
        """``waiting``, ``running``, ``done``, ``limit``, ``refused``, ``cancelled`` or ``failed``."""
        folder = self.folder / name
        ended = _read(folder / ENDED)
        if ended is not None:
            return STATES.get(ended["status"]) or self._broken_off(name)
        process = _read(folder / PROCESS)
        if process is None:
            return "waiting"
        if _lives(process):
            return "running"
        # It may have ended between the two looks.
        return self.state(name) if (folder / ENDED).exists() else self._broken_off(name)

    def _broken_off(self, name: str) -> str:
        """State of a job that says of itself neither how it ended nor that it was asked to."""
        return "cancelled" if (self.folder / name / CANCELLED).exists() else "failed"

    def told(self, name: str) -> dict[str, Any]:
        """A job in short: number, command line, state, when it was asked for, its progress."""
        folder = self.folder / name
        job = _read(folder / "job.json") or {"words": [], "made": ""}
        state = self.state(name)
        last = _tail(folder / "stderr", 400).strip().rpartition("\n")[2] if state == "running" else ""
        ended = _read(folder / ENDED) or {}
        return {
            "name": name,
            "command": job["words"][0] if job["words"] else "",
            "line": command_line(job["words"]),
            "made": job["made"],
            "state": state,
            "status": ended.get("status"),
            "seconds": ended.get("seconds"),
            "progress": last,
        }

    def in_full(self, name: str) -> dict[str, Any]:
        """A job with what it printed and the files that it wrote."""
        folder = self.folder / name
        results = folder / "results"
        files = [str(p.relative_to(results)) for p in sorted(results.rglob("*")) if p.is_file()]
        shown = [path for path in files if not any(part.startswith(".") for part in Path(path).parts)]
        return {
            **self.told(name),
            "stdout": _tail(folder / "stdout", TAIL_BYTES),
            "stderr": _tail(folder / "stderr", TAIL_BYTES),
            "files": sorted(shown, key=lambda path: (not path.endswith(".html"), path.count("/"), path)),
        }

    def written(self, pattern: str) -> list[str]:
        """Paths from the app's folder of what jobs that have ended wrote by a pattern of names, newest first.

        Looked for once: pages ask each second, and a fleet's results are thousands of folders.
        """
        found = []
        for name in reversed(self.names()):
            if self.state(name) in ("waiting", "running"):
                continue
            job = (self.folder / name / "job.json").stat()
            key = name, job.st_ino, job.st_mtime_ns, pattern
            if key not in self._written:
                paths = sorted((self.folder / name / "results").glob(pattern))
                self._written[key] = [str(path.relative_to(self.home)) for path in paths]
            found += self._written[key]
        return found

    def runs(self) -> list[dict[str, Any]]:
        """Runs that were imported, as `fogml.app.state.Files.told` tells of files."""
        jobs = [(self.folder / name, _read(self.folder / name / "job.json") or {}) for name in self.names()]
        found = [
            place
            for folder, job in jobs
            if "import" in job.get("words", [])[:1]
            for place in sorted((folder / "results").glob("*.csv"))
        ]
        paths = [str(place.relative_to(self.home)) for place in found]
        return [
            {"name": path, "path": path, "bytes": place.stat().st_size, "run": True}
            for path, place in zip(paths, found)
        ]

    def cancel(self, name: str) -> None:
        """End a job: at first by asking its command, which leaves nothing half written; again: at once."""
        folder = self.folder / name
        again = (folder / CANCELLED).exists()
        state = self.state(name)
        if state not in ("waiting", "running"):
            return
        (folder / CANCELLED).touch()
        if state == "waiting":
            tell(folder / ENDED, {"status": 130, "seconds": 0.0})
            return
        process = _read(folder / PROCESS)
        if process is None:
            return
        with contextlib.suppress(ProcessLookupError):
            if again:
                os.killpg(process["pid"], signal.SIGKILL)
            elif process["child"] is not None:
                os.kill(process["child"], signal.SIGTERM)

    def remove(self, name: str) -> None:
        """Remove a job that has ended, and its results.

        Raises
        ------
        InputError
            If it runs or waits.
        """
        if self.state(name) in ("waiting", "running"):
            raise InputError(f"job {name} has not ended; cancel it first")
        shutil.rmtree(self.folder / name)

    def folder_of(self, name: str) -> Path | None:
        """A job's folder by its number; None if there is no such job."""
        return self.folder / name if name in self.names() else None


def command_line(words: list[str]) -> str:
    """The command line of a job, to be run in the app's folder."""
    return shlex.join(["fogml", *words])


def _lives(process: dict[str, Any]) -> bool:
    """Whether a job's process runs, or its command, which goes on should the process be killed."""
    if process_is_alive(process["pid"], process["started"]):
        return True
    child = process["child"]
    return child is not None and process_is_alive(child, process.get("child_started", ""))


def _read(path: Path) -> dict[str, Any] | None:
    try:
        values = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return None
    return values if isinstance(values, dict) else None


def _tail(path: Path, count: int) -> str:
    """The last bytes of a file as text; empty if there is none."""
    try:
        with open(path, "rb") as file:
            file.seek(0, os.SEEK_END)
            size = file.tell()
            file.seek(max(size - count, 0))
            return file.read().decode("utf-8", "replace")
    except OSError:
        return ""


if __name__ == "__main__":
    begin(Path(sys.argv[1]))
