"""A fleet of 500 synthetic units on two workers, killed again and again, beside one that is left alone.

``python -m experiments.benchmarks.fleet_run DIR`` makes the runs in DIR, trains and judges every unit with
``fogml fleet --workers 2`` while workers and the program are killed at random moments and the same command is
given again, then once without kills, and holds every file of the one against the other. It writes
``fleet_run.json`` beside itself and ``scale.md`` anew. About 20 core-minutes.
"""

from __future__ import annotations

import argparse
import contextlib
import hashlib
import json
import os
import resource
import shutil
import signal
import subprocess
import sys
import time
import zipfile
from collections import Counter
from pathlib import Path
from random import Random
from typing import Any

from experiments.faults.started import processes
from experiments.shared_knowledge.units import unit
from experiments.synthetic_world import cycle
from fogml import __version__
from fogml.json_files import write_json
from fogml.outputs import whole_file
from fogml.processes import of_this_package
from fogml.runs.facts import Facts
from fogml.runs.run import Run
from fogml.runs.writing import write_run

HERE = Path(__file__).parent
FOUND = HERE / "fleet_run.json"
SAMPLE_S = 120.0
COMMAND = ("--model", "polynomial", "--features", "T^1..3", "--averaging", "300", "--workers", "2", "--quiet")
WORKER, PROGRAM = "worker", "program"
_ENDS_S = 60.0
_NEXT_S = (8.0, 40.0)
"""Time from one kill to the next [s], even between these."""


def make_units(home: Path, units: int) -> Path:
    """A training and a test run of each unit, and their manifest."""
    home.mkdir(parents=True, exist_ok=True)
    lines = ["unit,job,train,test"]
    for number in range(units):
        world, name = unit(number), f"U{number:03d}"
        for what, rate, seed in (("train", 1.0, 2 * number), ("test", 0.8, 2 * number + 1)):
            made, _ = world.run(cycle(rate, SAMPLE_S), SAMPLE_S, seed, name)
            columns = {"time": made.time, "gyro": made.gyro, "T": made.columns["T_in"]}
            facts = Facts(unit=name, notes="synthetic: made by experiments/synthetic_world.py")
            write_run(Run(name, columns, facts), home / f"{name}-{what}.csv")
        lines.append(f"{name},train,{name}-train.csv,{name}-test.csv")
    manifest = home / "units.csv"
    manifest.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return manifest


def started(manifest: Path, out: Path) -> subprocess.Popen[bytes]:
    """The fleet's command, in a session of its own."""
    words = [sys.executable, "-m", "fogml", "fleet", manifest.name, *COMMAND, "-o", out.name]
    with out.with_suffix(".log").open("ab") as log:
        return subprocess.Popen(
            words, cwd=manifest.parent, stdout=log, stderr=log, start_new_session=True, env=of_this_package()
        )


def killed(manifest: Path, out: Path, kills: int, rng: Random) -> dict[str, Any]:
    """Run the fleet with so many kills, the same command again after each end; what was met."""
    met, ends, starts, left = Counter[str](), Counter[str](), 1, kills
    process = started(manifest, out)
    while True:
        try:
            status = process.wait(rng.uniform(*_NEXT_S) if left else None)
        except subprocess.TimeoutExpired:
            status = None
        if status is None:
            met[_kill(process, rng, WORKER if left % 2 else PROGRAM)] += 1
            left -= 1
            if left % 2 == 0:
                continue  # a worker alone: the program goes on by itself
            status = process.wait(_ENDS_S)
        ends[str(status)] += 1
        if status == 0:
            break
        if starts > kills + 3:
            raise RuntimeError(f"the fleet does not end: {dict(ends)}; {out.with_suffix('.log')}")
        _alone(process.pid)
        process, starts = started(manifest, out), starts + 1
    return {"kills": dict(met), "starts": starts, "ends": dict(ends), "not_met": left}


def _kill(process: subprocess.Popen[bytes], rng: Random, what: str) -> str:
    """Kill one worker as a system out of memory does, or the program by one of three signals."""
    if what == WORKER:
        workers = [pid for pid in processes(process.pid) if pid != process.pid]
        if workers:
            with contextlib.suppress(ProcessLookupError):
                os.kill(rng.choice(workers), signal.SIGKILL)
        return WORKER
    how = rng.choice([signal.SIGKILL, signal.SIGTERM, signal.SIGINT])
    process.send_signal(how)
    return f"{PROGRAM}, {how.name}"


def _alone(session: int) -> None:
    """Wait until nothing of a killed program lives."""
    until = time.monotonic() + _ENDS_S
    while processes(session) and time.monotonic() < until:
        time.sleep(0.1)


def results(out: Path) -> dict[str, str]:
    """A hash of every file below a fleet's folder, by its path; of workbooks, of what is in them."""
    return {str(p.relative_to(out)): _hash(p, out.name) for p in sorted(out.rglob("*")) if p.is_file()}


def _hash(path: Path, name: str) -> str:
    found = hashlib.sha256()
    if path.suffix == ".xlsx":
        # A zip file states when it was written.
        with zipfile.ZipFile(path) as book:
            for part in sorted(book.namelist()):
                if part != "docProps/core.xml":
                    found.update(book.read(part))
    else:
        # The settings name the folder that they are in.
        found.update(path.read_bytes().replace(f"/{name}".encode(), b"/OUT"))
    return found.hexdigest()


def main() -> None:
    """Make, kill, compare, write."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("directory", type=Path, help="where runs and results go: 3 GB")
    parser.add_argument("--units", type=int, default=500, help="units (500)")
    parser.add_argument("--kills", type=int, default=16, help="kills, of worker and program in turn (16)")
    parser.add_argument("--seed", type=int, default=46, help="of the moments (46)")
    parser.add_argument("--keep", action="store_true", help="keep the results")
    given = parser.parse_args()
    # Where this was started in the background SIGINT is ignored, and children would inherit that.
    signal.signal(signal.SIGINT, signal.default_int_handler)
    manifest = make_units(given.directory, given.units)
    found: dict[str, Any] = {}
    spent: dict[str, float] = {}
    for label, kills in (("killed", given.kills), ("alone", 0)):
        out = given.directory / label
        before = _children_s()
        told = killed(manifest, out, kills, Random(given.seed))
        spent[label] = _children_s() - before
        found[label] = {**told, "files": results(out)}
        print(label, told, f"{spent[label]:.0f} s of processors", flush=True)
        partial = [p for p in found[label]["files"] if Path(p).name.startswith(".")]
        found[label]["partial"] = partial
        if label == "killed":
            held = json.loads((out / "fleet.json").read_text(encoding="utf-8"))
            found["done"] = sum(one["status"] == "done" for one in held["units"])
        if not given.keep:
            shutil.rmtree(out)
    one, other = (found[label].pop("files") for label in ("killed", "alone"))
    differ = sorted(name for name in {*one, *other} if one.get(name) != other.get(name))
    values = {
        "schema": "fogml.fleet_run/1",
        "version": __version__,
        "date": time.strftime("%Y-%m-%d"),
        "units": given.units,
        "seed": given.seed,
        "files": len(other),
        "differ": differ,
        "core_s": spent,
        **found,
    }
    with whole_file(FOUND) as partial_file:
        write_json(partial_file, values, indent=1)
    from experiments.benchmarks.scale import main as write_page

    write_page()


def _children_s() -> float:
    """Processor time of all that was started and has ended [s]."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


if __name__ == "__main__":
    main()
