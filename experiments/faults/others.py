"""Single workers killed, as a system out of memory does, and a database restarted."""

from __future__ import annotations

import contextlib
import hashlib
import json
import os
import signal
import time
from collections import Counter
from collections.abc import Mapping
from pathlib import Path
from random import Random

from experiments.faults.jobs import JOBS, TIMES, Job, prepare, results
from experiments.faults.kills import LONGEST_S, Killer
from experiments.faults.started import Started, processes


def worker_killed(home: Path, files: Mapping[str, bytes], times: int, rng: Random) -> str:
    killer = Killer(home, "fleet, 2 processes", files, 0, None, False)
    same, killed, faults = 0, 0, Counter[str]()
    for _ in range(times):
        prepare(killer.folder, killer.job, files)
        started = Started(killer.folder, killer.job.command)
        status = started.ends(rng.uniform(0.3, 1.0) * killer.reference.seconds)
        workers = [process for process in processes(started.process) if process != started.process]
        if status is None and workers:
            with contextlib.suppress(ProcessLookupError):
                os.kill(rng.choice(workers), signal.SIGKILL)
                killed += 1
        status = started.ends(LONGEST_S) if status is None else status
        if status not in (0, 1):
            faults[f"status {status}"] += 1
            continue
        found = results(killer.folder, killer.job)
        differ = [name for name, held in killer.reference.outputs.items() if found.get(name) != held]
        same += not differ
        if differ:
            faults["other results"] += 1
        if started.orphans():
            faults["processes left"] += 1
    wrong = ", ".join(f"{count} {name}" for name, count in faults.items()) or "nothing wrong"
    return (
        f"{killed} workers met, {same} of {times} fleets end with the results of one not disturbed; {wrong}."
    )


def database_restarted(home: Path, files: Mapping[str, bytes], times: int, rng: Random) -> str:
    from experiments.faults.postgres import postgres, program, restart

    if program("initdb") is None:
        return "not done, PostgreSQL is not installed."
    same, seconds, told = 0, 0.0, Counter[str]()
    with postgres(home / "server") as url:
        job = Job((*JOBS["sweep"].command, "--storage", url), ("swept",), needs=JOBS["sweep"].needs)
        folder = home / "job"
        wanted: dict[str, str] = {}
        for number in range(times + 1):
            prepare(folder, job, files)
            command = (*job.command, "--name", f"study-{number}")
            started = Started(folder, command)
            if number:
                time.sleep(rng.uniform(0.1, 0.9) * seconds)
                restart(home / "server")
            status = started.ends(LONGEST_S)
            told[f"exit {status}"] += bool(number)
            if status == 2:
                status = Started(folder, command).ends(LONGEST_S)
                told[f"exit {status} of the same command again"] += 1
            found = _named(results(folder, job), folder)
            if not number:
                wanted, seconds = found, time.monotonic() - started.began
            elif status == 0 and found == wanted:
                same += 1
    ends = ", ".join(f"{count} {name}" for name, count in told.items() if count)
    result = "the same command then gives the undisturbed sweep's result"
    return f"{times} times; {ends}; {result} {same} of {times} times."


def _named(found: Mapping[str, str], folder: Path) -> dict[str, str]:
    """The results of a sweep whatever its study is called: the trials, and the winner's settings."""
    values = (
        json.loads((folder / "swept/sweep.json").read_text())
        if (folder / "swept/sweep.json").is_file()
        else {}
    )
    for key in ("study", "storage", "counts"):
        values.pop(key, None)
    told = TIMES.sub("", json.dumps(values))
    return {"sweep": hashlib.sha256(told.encode()).hexdigest(), "best": found.get("swept/best.yaml", "")}
