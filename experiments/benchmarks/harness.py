"""Jobs in pairs: ours and the plain alternative, alternating, medians with their spread."""

from __future__ import annotations

import json
import os
import statistics
import subprocess
import sys
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

LEAST_REPEATS = 5
REPOSITORY = Path(__file__).parents[2]


@dataclass(frozen=True)
class Timed:
    """What a side returns where it keeps its own time, as a command does, and perhaps its memory [MB]."""

    seconds: float
    value: Any = None
    peak_mb: float | None = None


@dataclass(frozen=True)
class Work:
    """A job made ready: its data are there, its sides can run any number of times.

    Attributes
    ----------
    ours, plain
        Do the whole work once and return its result, or a `Timed`.
    check
        Takes both results and raises AssertionError unless they agree; returns in words what
        was compared.
    """

    ours: Callable[[], Any]
    plain: Callable[[], Any]
    check: Callable[[Any, Any], str]


@dataclass(frozen=True)
class Job:
    """A thing to measure.

    Attributes
    ----------
    name
        Short name for ``--only``.
    title
        What is done, in words, with its size.
    ours, plain
        What each side is.
    prepare
        ``prepare(quick, folder)`` makes the work ready; quick: small enough for a test.
    limit_s, least_ratio, limit_mb
        What must be held: seconds of ours, plain over ours, peak memory of ours.
    memory
        Whether the peak memory of ours is measured, in a process of its own.
    big
        Whether it needs ``--big``: minutes and gigabytes.
    missing
        Says what it lacks to run on this machine; None where it lacks nothing.
    """

    name: str
    title: str
    ours: str
    plain: str
    prepare: Callable[[bool, Path], Work]
    limit_s: float | None = None
    least_ratio: float | None = None
    limit_mb: float | None = None
    memory: bool = False
    big: bool = False
    missing: Callable[[], str | None] = lambda: None


def measure(job: Job, folder: Path, *, quick: bool = False, repeats: int = LEAST_REPEATS) -> dict[str, Any]:
    """Time a job's two sides, alternating, after one run of each that is not counted.

    Returns
    -------
    dict
        JSON-ready: ``name, title, ours, plain, checked, ours_s, plain_s`` (median, least,
        greatest, all), ``ratio`` (median over the pairs, plain over ours, and its spread),
        ``peak_mb``, ``load`` before, and ``held``: each limit with the figure and whether it is
        met.
    """
    work = job.prepare(quick, folder)
    load = os.getloadavg()[0]
    # The first run loads libraries and compiles; its results are the ones compared.
    first = [_timed(work.ours), _timed(work.plain)]
    checked = work.check(first[0].value, first[1].value)
    ours: list[Timed] = []
    plain: list[Timed] = []
    for turn in range(repeats):
        sides = [(work.ours, ours), (work.plain, plain)]
        # Turn about, so that neither side always finds the caches as the other left them.
        for side, runs in sides if turn % 2 == 0 else sides[::-1]:
            # Without its result: kept, it would have each run pay for memory that is new to the process.
            runs.append(replace(_timed(side), value=None))
    result: dict[str, Any] = {
        "name": job.name,
        "title": job.title,
        "ours": job.ours,
        "plain": job.plain,
        "checked": checked,
        "quick": quick,
        "load": load,
        "ours_s": _spread([run.seconds for run in ours]),
        "plain_s": _spread([run.seconds for run in plain]),
        "ratio": _spread([b.seconds / a.seconds for a, b in zip(ours, plain)]),
        "peak_mb": _peak_mb(job, ours, quick) if job.memory else None,
    }
    # Limits are for the full size.
    result["held"] = [] if quick else _held(job, result)
    return result


def _timed(side: Callable[[], Any]) -> Timed:
    begin = time.perf_counter()
    value = side()
    spent = time.perf_counter() - begin
    return value if isinstance(value, Timed) else Timed(spent, value)


def _spread(values: Sequence[float]) -> dict[str, Any]:
    return {
        "median": statistics.median(values),
        "least": min(values),
        "greatest": max(values),
        "all": list(values),
    }


def _held(job: Job, result: dict[str, Any]) -> list[dict[str, Any]]:
    held = []
    for quantity, limit, value, met in (
        ("seconds", job.limit_s, result["ours_s"]["median"], lambda v, limit: v <= limit),
        ("ratio", job.least_ratio, result["ratio"]["median"], lambda v, limit: v >= limit),
        ("peak_mb", job.limit_mb, result["peak_mb"], lambda v, limit: v <= limit),
    ):
        if limit is not None and value is not None:
            held.append(
                {"quantity": quantity, "limit": limit, "value": value, "met": bool(met(value, limit))}
            )
    return held


def _peak_mb(job: Job, runs: Sequence[Timed], quick: bool) -> float:
    told = [run.peak_mb for run in runs if run.peak_mb is not None]
    if told:
        return max(told)
    # A process keeps the memory of all that it did before, so the job gets one of its own.
    arguments = ["-m", "experiments.benchmarks", "--peak", job.name, *(["--quick"] if quick else [])]
    return float(json.loads(run_python(arguments).output)["peak_mb"])


@dataclass(frozen=True)
class Ran:
    """A finished process: its standard output, wall time [s] and greatest resident memory [MB]."""

    output: str
    seconds: float
    peak_mb: float


def run_python(arguments: Sequence[str], *, watch_memory: bool = False) -> Ran:
    """Run this Python with arguments and wait; RuntimeError with its words if it fails."""
    begin = time.perf_counter()
    process = subprocess.Popen(
        [sys.executable, *arguments],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        cwd=REPOSITORY,
    )
    peak = 0.0
    while watch_memory:
        # The kernel keeps the high-water mark only as long as the process lives.
        peak = max(peak, high_water_mb(process.pid))
        try:
            process.wait(0.02)
            break
        except subprocess.TimeoutExpired:
            continue
    output, problem = process.communicate()
    seconds = time.perf_counter() - begin
    if process.returncode != 0:
        raise RuntimeError(f"python {' '.join(arguments)}: exit {process.returncode}\n{problem[-2000:]}")
    return Ran(output, seconds, peak)


def high_water_mb(pid: int) -> float:
    """Greatest resident memory of a living process so far [MB]; 0 where the system does not tell."""
    try:
        text = Path(f"/proc/{pid}/status").read_text(encoding="ascii")
    except (FileNotFoundError, ProcessLookupError):
        return 0.0
    marks = [line.split()[1] for line in text.splitlines() if line.startswith("VmHWM:")]
    return float(marks[0]) / 1024.0 if marks else 0.0
