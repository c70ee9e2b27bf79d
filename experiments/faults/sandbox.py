"""One command in this process, through the program's own entry point, and what it must and must not do.

Every fault is told by a word of `FAULTS`. Limits are arguments of `Limits`.
"""

from __future__ import annotations

import contextlib
import functools
import hashlib
import io
import json
import math
import os
import re
import resource
import shutil
import sys
import tempfile
import time
import traceback
import warnings
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from experiments.faults.case import Case
from experiments.faults.entries import COMMAND, NAME
from experiments.faults.mutate import MARKER

FAULTS = {
    "traceback": "an exception that nobody expected, or exit 3",
    "crash": "the process was ended by a signal",
    "hang": "over a limit of time, and killed if it still ran",
    "memory": "more memory than the limit",
    "message": "not exactly one message at exit 2",
    "noise": "text of a library on stderr",
    "left": "something left behind: an output after an error, a partial file, a lock, a process",
    "input changed": "a file that was only to be read is another",
    "not finite": "a number that is not finite in a result at exit 0 or 1",
    "silent change": "a value that differs from that of the independent reader, with nothing said",
    "ran code": "code in the input ran",
}


@dataclass(frozen=True)
class Limits:
    """What one input of at most some hundred kilobytes may take.

    Attributes
    ----------
    cpu_s
        Processor time of the process and of its children [s]; the sound inputs take less than a
        tenth of it. A process that passes it is killed.
    wall_s
        Time after which a process that waits is killed [s]; on a busy machine all takes longer.
    memory_bytes
        Growth of the process's memory [bytes].
    """

    cpu_s: float = 10.0
    wall_s: float = 120.0
    memory_bytes: int = 1 << 30


@dataclass
class Outcome:
    """What came of a case.

    Attributes
    ----------
    status
        Exit status; None where the process did not get so far.
    faults
        Word of `FAULTS` to what was seen.
    compared
        Whether the values read were compared with an independent reader's.
    seconds
        How long it took.
    told
        The beginning of what it wrote to stderr.
    """

    status: int | None
    faults: dict[str, str] = field(default_factory=dict)
    compared: bool = False
    seconds: float = 0.0
    told: str = ""


class Sandbox:
    """Runs commands in this process with its output caught at the level of the system.

    Parameters
    ----------
    home
        Folder to work in; each case gets an empty one below it.
    limits
        What a case may take.
    compare
        Compares what was read with an independent reading: gives whether it could, and raises
        `SilentChange`. Told the runs by the path they were read from.
    """

    def __init__(
        self, home: Path, limits: Limits, compare: Callable[[Mapping[Path, Any]], bool] | None = None
    ) -> None:
        self.home, self.limits, self.compare = home, limits, compare
        home.mkdir(parents=True, exist_ok=True)
        self.reports = home / "reports"
        self.runs: dict[Path, Any] = {}
        self.stack = contextlib.ExitStack()
        self._streams: dict[int, int] = {}

    @contextlib.contextmanager
    def catching(self) -> Iterator[None]:
        """Catch what is written to the standard streams, by whatever library."""
        import fogml.cli.main as main
        import fogml.runs.reading as reading

        own = sys.stdout, sys.stderr
        saved = {number: os.dup(number) for number in (1, 2)}
        read_runs, get_command, place = reading.read_runs, main.Group.get_command, tempfile.tempdir

        main.COMMANDS |= COMMAND
        # Commands are declared anew for each process: here they are once for all.
        main.Group.get_command = functools.cache(get_command)
        # Where reports of what nobody expected go.
        self.reports.mkdir(exist_ok=True)
        tempfile.tempdir = str(self.reports)
        for own_stream in own:
            own_stream.flush()
        for number in saved:
            self._streams[number] = os.open(
                self.home / f"stream-{number}", os.O_RDWR | os.O_CREAT | os.O_APPEND
            )
            os.dup2(self._streams[number], number)
        sys.stdout = io.TextIOWrapper(os.fdopen(1, "wb", 0, closefd=False), "utf-8", write_through=True)
        sys.stderr = io.TextIOWrapper(os.fdopen(2, "wb", 0, closefd=False), "utf-8", write_through=True)
        reading.read_runs = self.noted(read_runs)
        try:
            yield
        finally:
            reading.read_runs, main.Group.get_command = read_runs, get_command
            tempfile.tempdir = place
            del main.COMMANDS[NAME]
            sys.stdout, sys.stderr = own
            for number, was in saved.items():
                os.dup2(was, number)
                os.close(was)
                os.close(self._streams.pop(number))

    def noted(self, read_runs: Callable[..., Any]) -> Callable[..., Any]:
        """The reader of runs, which notes what it gave."""

        @functools.wraps(read_runs)
        def read(path: str | Path, *arguments: Any, **options: Any) -> Any:
            runs = read_runs(path, *arguments, **options)
            if len(runs) == 1:
                # Of a clock that restarts several runs are made, in other times than the file's.
                self.runs[Path(path).absolute()] = runs[0]
            return runs

        return read

    def command(self, arguments: tuple[str, ...]) -> tuple[int | None, str, str]:
        """Exit status and output of ``fogml`` with these arguments; None where an exception escaped."""
        from fogml.cli.main import main

        for descriptor in self._streams.values():
            os.ftruncate(descriptor, 0)
        sys.argv = ["fogml", *arguments]
        status: int | None = 0
        try:
            with warnings.catch_warnings():
                warnings.showwarning = _show
                warnings.simplefilter("always")
                for kind in (DeprecationWarning, PendingDeprecationWarning, ImportWarning, ResourceWarning):
                    warnings.simplefilter("ignore", kind)
                main()
        except SystemExit as end:
            status = end.code if isinstance(end.code, int) else 0 if end.code is None else 1
        except BaseException:
            traceback.print_exc()
            status = None
        return status, *(self._written(number) for number in (1, 2))

    def _written(self, number: int) -> str:
        with contextlib.suppress(Exception):
            (sys.stdout if number == 1 else sys.stderr).flush()
        size = os.fstat(self._streams[number]).st_size
        return os.pread(self._streams[number], size, 0).decode("utf-8", errors="replace")

    def judged(self, case: Case) -> Outcome:
        """Run a case in a folder of its own and check all that holds for every input."""
        folder = self.home / "case"
        shutil.rmtree(folder, ignore_errors=True)
        for name, content in case.files.items():
            (folder / name).parent.mkdir(parents=True, exist_ok=True)
            (folder / name).write_bytes(content)
        folder.mkdir(exist_ok=True)
        before = _held(folder)
        os.chdir(folder)
        self.runs.clear()
        began, used, peak = time.monotonic(), _cpu_s(), _peak_bytes()
        status, stdout, stderr = self.command(case.command)
        outcome = Outcome(status, seconds=time.monotonic() - began, told=stderr.strip()[:_SHOWN])
        cpu, grown = _cpu_s() - used, _peak_bytes() - peak
        os.chdir(self.home)
        faults = outcome.faults
        if status is None or status not in (0, 1, 2) or "Traceback (most recent call last)" in stderr:
            faults["traceback"] = _tail(self._report(stderr) or stderr)
        elif status == 2:
            told = [line for line in stderr.splitlines() if line.startswith(("fogml: ", "Error: "))]
            if len(told) != 1 or stdout.strip():
                faults["message"] = _tail(stderr) or f"nothing on stderr; {_tail(stdout)}"
            if "Warning:" in stderr:
                faults["noise"] = _tail(stderr)
        elif stderr.strip():
            faults["noise"] = _tail(stderr)
        if cpu > self.limits.cpu_s:
            faults["hang"] = f"{cpu:.1f} s of processor time"
        if grown > self.limits.memory_bytes or "not enough memory" in stderr:
            faults["memory"] = f"{grown / 2**20:.0f} MiB; {_tail(stderr)}"
        after = _held(folder)
        if any(Path(name).name == MARKER for name in after) or (self.home / MARKER).exists():
            faults["ran code"] = "the marker is there"
        _check_left(status, before, after, faults)
        if status in (0, 1):
            _check_finite(folder, sorted(set(after) - set(before)), stdout, faults)
            self._compare(outcome)
        return outcome

    @staticmethod
    def _report(stderr: str) -> str:
        """What the report of an error says that nobody expected; it is removed."""
        named = re.search(r"report written to (.+?\.txt)", stderr)
        if named is None or not Path(named[1]).is_file():
            return ""
        told = Path(named[1]).read_text(encoding="utf-8", errors="replace")
        Path(named[1]).unlink()
        return told

    def _compare(self, outcome: Outcome) -> None:
        if self.compare is None or not self.runs:
            return
        try:
            outcome.compared = self.compare(self.runs)
        except SilentChange as change:
            outcome.faults["silent change"] = str(change)


class SilentChange(Exception):
    """A value was read that the file does not hold, and nothing was said."""


def _show(
    message: Any, category: Any, place: str, line: int, file: Any = None, text: str | None = None
) -> None:
    """A warning on stderr, as an interpreter shows it that runs nothing else."""
    sys.stderr.write(warnings.formatwarning(message, category, place, line, text))


def _held(folder: Path) -> dict[str, str]:
    """Relative name of everything in a folder to a hash of its content."""
    found = {}
    for path in folder.rglob("*"):
        name = str(path.relative_to(folder))
        found[name] = hashlib.md5(path.read_bytes()).hexdigest() if path.is_file() else "folder"
    return found


def _check_left(
    status: int | None, before: Mapping[str, str], after: Mapping[str, str], faults: dict[str, str]
) -> None:
    new = sorted(set(after) - set(before))
    changed = sorted(name for name, held in before.items() if after.get(name) != held)
    # A study's journal is written to as trials come, also where the sweep then ends with an error.
    growing = {name.rpartition("/")[0] for name in new if name.endswith(_GROW)}
    new = [name for name in new if not name.endswith(_GROW) and name not in growing]
    changed = [name for name in changed if not name.endswith(_GROW)]
    hidden = [name for name in new if name.rpartition("/")[2].startswith((".partial-", ".commit-"))]
    if hidden or (new and status not in (0, 1)):
        faults["left"] = ", ".join((hidden or new)[:3])
    if changed and status not in (0, 1):
        faults["input changed"] = ", ".join(changed[:3])


_GROW = (".journal", ".journal.lock")


def _check_finite(folder: Path, new: list[str], stdout: str, faults: dict[str, str]) -> None:
    def refuse(text: str) -> float:
        raise ValueError(f"{text} in JSON")

    for name in new:
        path = folder / name
        try:
            if path.is_dir():
                continue
            if name.endswith(".json"):
                json.loads(path.read_text(encoding="utf-8"), parse_constant=refuse)
            elif name.endswith(".csv"):
                _check_columns(path)
        except ValueError as error:
            faults["not finite"] = f"{name}: {error}"
    if stdout.startswith("{"):
        try:
            json.loads(stdout, parse_constant=refuse)
        except ValueError as error:
            faults["not finite"] = f"stdout: {error}"


_COLUMNS = ("time", "gyro", "drift", "gyro_compensated", "replayed", "T", "T_in", "T_out", "rate")


def _check_columns(path: Path) -> None:
    """Columns that fogml itself makes hold finite numbers."""
    head, *rows = path.read_text(encoding="utf-8", errors="replace").splitlines()
    names = [cell.strip('"').partition(" [")[0] for cell in head.split(",")]
    wanted = [place for place, name in enumerate(names) if name in _COLUMNS]
    for line, row in enumerate(rows, start=2):
        cells = row.split(",")
        for place in wanted:
            if place < len(cells) and not math.isfinite(float(cells[place] or "nan")):
                raise ValueError(f"line {line}, column '{names[place]}': '{cells[place]}'")


_SHOWN = 200


def _tail(text: str, length: int = 400) -> str:
    return text.strip()[-length:]


def _cpu_s() -> float:
    own, children = resource.getrusage(resource.RUSAGE_SELF), resource.getrusage(resource.RUSAGE_CHILDREN)
    return own.ru_utime + own.ru_stime + children.ru_utime + children.ru_stime


def _peak_bytes() -> int:
    return 1024 * resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
