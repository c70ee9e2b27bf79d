"""Jobs killed at random moments: what is there afterwards, and whether the same command makes it good.

A job is forked from a process in which every library is loaded. After each kill: outputs are absent,
as before, or whole; no process of the job is alive; after SIGTERM and SIGINT no partial file is there.
The same command is then run again, ends well, leaves nothing partial and gives what a run gives that
was never killed.
"""

from __future__ import annotations

import json
import os
import shutil
import signal
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from random import Random
from typing import Any

from experiments.faults.jobs import JOBS, prepare, results, sound_files, unfinished, whole_unit
from experiments.faults.started import ORPHANS_S, Started

SIGNALS = (signal.SIGKILL, signal.SIGTERM, signal.SIGINT)
_ENDS_S = 30.0
"""Time in which a job has to end after a signal [s]."""
LONGEST_S = 300.0
"""Time in which a job has to end that is not killed [s]."""
_AGAIN_EVERY = 5
"""Jobs that begin anew are run again after every so many kills; those that go on, after each."""


@dataclass
class Reference:
    """What a job gives that is never killed, and how long it takes."""

    outputs: dict[str, str]
    seconds: float


@dataclass
class Count:
    """What was found after the kills of one kind of job."""

    kills: int = 0
    ended: int = 0
    absent: int = 0
    old: int = 0
    whole: int = 0
    resumed: int = 0
    failed: int = 0
    reasons: Counter[str] = field(default_factory=Counter)

    def values(self) -> dict[str, Any]:
        """JSON-ready."""
        return {**self.__dict__, "reasons": dict(self.reasons)}


OTHERS = "others"
"""Name in `only` for single workers that are ended and a database that restarts."""


def kill_jobs(
    each: int,
    seed: int,
    *,
    only: Sequence[str] = (),
    kept: Path | None = None,
    progress: bool = False,
    others: bool = True,
) -> dict[str, Any]:
    """Kill every kind of job so many times, and count what is there afterwards.

    Parameters
    ----------
    each
        Kills of each kind.
    seed
        Of the moments.
    only
        Names of `JOBS`, and `OTHERS`; all by default.
    kept
        Folder for what was found wrong.
    progress
        Say how far it is, on stderr.
    others
        Also end single workers, and restart a database.
    """
    began = time.monotonic()
    names = [name for name in JOBS if not only or name in only]
    # Not one that removes itself at an interpreter's end: every forked job comes to such an end.
    home = Path(tempfile.mkdtemp(prefix="fogml-kills-"))
    try:
        home.chmod(0o755)
        files = sound_files(home, names)
        rows = {job: Killer(home, job, files, seed, kept, progress).kill(each) for job in names}
        notes = (
            _others(home, files, max(1, each // 10), seed) if others and (not only or OTHERS in only) else []
        )
    finally:
        shutil.rmtree(home, ignore_errors=True)
    return {
        "each": each,
        "seed": seed,
        "seconds": round(time.monotonic() - began),
        "jobs": {job: count.values() for job, count in rows.items()},
        "notes": notes,
    }


class Killer:
    """Kills one kind of job."""

    def __init__(
        self, home: Path, name: str, files: Mapping[str, bytes], seed: int, kept: Path | None, progress: bool
    ) -> None:
        self.name, self.job, self.files, self.kept, self.progress = name, JOBS[name], files, kept, progress
        self.folder = home / "job"
        self.rng = Random(f"{seed}/{name}")
        self.count = Count()
        made = [self._unkilled() for _ in range(2)]
        differ = {name for name in made[0].outputs if made[0].outputs[name] != made[1].outputs.get(name)}
        if differ or made[0].outputs.keys() != made[1].outputs.keys():
            raise RuntimeError(f"{self.name} gives other results when run again: {sorted(differ)}")
        self.reference = Reference(made[0].outputs, min(one.seconds for one in made))

    def _unkilled(self) -> Reference:
        prepare(self.folder, self.job, self.files)
        began = time.monotonic()
        status, _ = self._finish()
        if status not in (0, 1):
            raise RuntimeError(f"{self.name}: status {status}: {self.folder.with_suffix('.log').read_text()}")
        return Reference(results(self.folder, self.job), time.monotonic() - began)

    def _finish(self) -> tuple[int | None, Started]:
        started = Started(self.folder, self.job.command)
        status = started.ends(LONGEST_S)
        if status is None:
            os.killpg(started.process, signal.SIGKILL)
            started.ends(_ENDS_S)
        return status, started

    def kill(self, times: int) -> Count:
        """Kill it so many times."""
        for number in range(times):
            faults = self._once(number)
            self.count.kills += 1
            if faults:
                self.count.failed += 1
                self.count.reasons.update(dict.fromkeys(faults, 1))
                self._keep(number, faults)
            if self.progress and (number + 1) % 20 == 0:
                print(
                    f"{self.name}: {number + 1} kills, {self.count.failed} wrong", file=sys.stderr, flush=True
                )
        return self.count

    def _once(self, number: int) -> dict[str, str]:
        """What was wrong after one kill, by reason."""
        how = SIGNALS[number % len(SIGNALS)]
        has_old = not self.job.resumes and self.rng.random() < 0.5
        prepare(self.folder, self.job, self.files)
        old = self._old() if has_old else {}
        moment = self.rng.uniform(0.0, self.reference.seconds)
        started = Started(self.folder, self.job.command)
        status = started.ends(moment)
        if status is None:
            os.kill(started.process, how)
            status = started.ends(_ENDS_S)
        else:
            self.count.ended += 1
        faults: dict[str, str] = {}
        if status is None:
            os.killpg(started.process, signal.SIGKILL)
            started.ends(_ENDS_S)
            faults["did not end"] = f"{how.name}: still there after {_ENDS_S:g} s"
        elif status not in (0, 1, -how, 128 + how, 128 + signal.SIGINT):
            faults["other exit"] = f"{how.name}: status {status}"
        orphans = started.orphans()
        if orphans:
            faults["processes left"] = f"{how.name}: {len(orphans)} alive after {ORPHANS_S:g} s"
        partial = unfinished(self.folder)
        if partial and how != signal.SIGKILL:
            faults["partial files left"] = f"{how.name}: {partial[:3]}"
        if any(".commit-" in name for name in partial):
            # Half moved in, and the next start moves in the rest: told below by its result.
            self.count.whole += 1
        else:
            self._state(old, faults, how)
        if self.job.resumes or number % _AGAIN_EVERY == 0 or partial:
            self._again(faults)
        return faults

    def _old(self) -> dict[str, str]:
        """What stands where the outputs go: an older result, told by its content."""
        for name in self.job.outputs:
            path = self.folder / name
            # A side file that states other facts would be another run's, and the job refused.
            if path.suffix != ".yaml":
                inside = path / "report.json" if not path.suffix else path
                inside.parent.mkdir(parents=True, exist_ok=True)
                inside.write_text("old\n", encoding="utf-8")
        return results(self.folder, self.job)

    def _state(self, old: dict[str, str], faults: dict[str, str], how: signal.Signals) -> None:
        """Whether outputs are absent, as before, or whole."""
        found = results(self.folder, self.job)
        if found == old:
            self.count.absent += not old
            self.count.old += bool(old)
            return
        wanted = self.reference.outputs
        if all(found.get(name) == held for name, held in wanted.items()):
            self.count.whole += 1
            return
        if self.job.units:
            homes = {
                path
                for path in self.folder.glob(self.job.units)
                if path.is_dir() and not path.name.startswith(".")
            }
            units = {str(path.relative_to(self.folder)) for path in homes}
            halves = [unit for unit in units if not whole_unit(unit, found, wanted)]
            rest = {name for name in found if not any(name.startswith(unit + "/") for unit in units)}
            if not halves and all(found[name] == wanted.get(name) for name in rest):
                self.count.absent += 1
                return
            faults["half written"] = f"{how.name}: {halves or sorted(rest)[:3]}"
            return
        if self.job.resumes and all(found[name] == wanted.get(name) for name in found):
            self.count.absent += 1
            return
        if all(
            self._apart(stem, found, old) for stem in {name.partition(".")[0] for name in (*found, *wanted)}
        ):
            # Of two outputs, one is whole and the other not there yet.
            self.count.absent += 1
            return
        mixed = sorted(
            name for name in found if found[name] != wanted.get(name) and found[name] != old.get(name)
        )
        gone = sorted(name for name in wanted if name not in found)
        faults["half written"] = f"{how.name}: other {mixed[:3]}, missing {gone[:3]}"

    def _apart(self, stem: str, found: Mapping[str, str], old: Mapping[str, str]) -> bool:
        """Whether an output, with its side file, is absent, as before or whole."""
        is_whole, is_old = (
            all(found.get(name) == held.get(name) for name in (*found, *held) if name.startswith(stem + "."))
            for held in (self.reference.outputs, old)
        )
        return is_whole or is_old

    def _again(self, faults: dict[str, str]) -> None:
        """Whether the same command makes it good."""
        status, started = self._finish()
        if status not in (0, 1):
            log = started.log.read_text(errors="replace").strip()[-300:]
            faults["did not go on"] = f"status {status}: {log}"
            return
        found = results(self.folder, self.job)
        differ = sorted(name for name, held in self.reference.outputs.items() if found.get(name) != held)
        if differ:
            faults["another result"] = ", ".join(differ[:5])
        partial = unfinished(self.folder)
        if partial:
            faults["partial files stay"] = ", ".join(partial[:3])
        if not differ and not partial:
            self.count.resumed += 1

    def _keep(self, number: int, faults: dict[str, str]) -> None:
        if self.kept is None:
            return
        place = self.kept / f"kill-{self.name.replace(' ', '-')}-{number}"
        shutil.rmtree(place, ignore_errors=True)
        shutil.copytree(self.folder, place)
        log = self.folder.with_suffix(".log")
        log_text = log.read_text(errors="replace") if log.exists() else ""
        (place / "faults.json").write_text(
            json.dumps({**faults, "log": log_text}, indent=1) + "\n", encoding="utf-8"
        )


def _others(home: Path, files: Mapping[str, bytes], times: int, seed: int) -> list[str]:
    from experiments.faults.others import database_restarted, worker_killed

    rng = Random(f"{seed}/others")
    told = worker_killed(home, files, times, rng)
    database = database_restarted(home, files, max(1, times // 3), rng)
    return [
        f"- A worker of a fleet killed {times} times, as a system out of memory does: {told}",
        f"- PostgreSQL restarted in the middle of a sweep: {database}",
    ]
