"""Answers to blind cases: each by a sealed process that gets the case's files and nothing else."""

from __future__ import annotations

import queue
import shutil
import threading
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor, as_completed, wait
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any

import fogml
from fogml.blind.folders import (
    DIAGNOSIS,
    OUTCOME,
    OUTCOME_SCHEMA,
    BlindFolder,
    count_samples,
    not_answers,
    read_json,
)
from fogml.blind.methods import ORACLE, code_state, load_method
from fogml.blind.pool import Worker, WorkerLost
from fogml.blind.worker import own_roots, within
from fogml.errors import InputError
from fogml.json_files import write_json
from fogml.outputs import folder_to_fill, settled, whole_folder
from fogml.processes import in_processes
from fogml.runs.sources import sources_stamp
from fogml.settings_check import check_numbers

_FILES = "files"
LIMIT_S = 600.0
"""Time that a case may take unless told otherwise [s]."""
Progress = Callable[[str], None]
"""Told the number of each case that is done."""


@dataclass(frozen=True)
class RunPlan:
    """Which cases of a suite are to be answered, and how.

    Attributes
    ----------
    folder
        The suite.
    method
        Name of a method, or ``module:function``.
    name
        What its answers are called; the method's name unless told otherwise.
    code
        Folder of the method's own code, where that is not installed.
    workers, threads
        Processes, and threads of each.
    limit_s
        Time that a case may take [s].
    shard
        ``(i, n)``: every n-th case from the i-th on, i from 1; for n machines on one folder.
    retry
        Whether cases that failed before are tried again.
    only
        Numbers of the cases, where not all are wanted.
    into
        Folder of the answers, where it is not the method's.
    seed
        Of what a method draws.
    options
        What the method is asked besides, by name.
    answer
        The file that a method writes for a case.
    """

    folder: BlindFolder
    method: str = DIAGNOSIS
    name: str | None = None
    code: Path | None = None
    workers: int = 1
    threads: int = 1
    limit_s: float = LIMIT_S
    shard: tuple[int, int] = (1, 1)
    retry: bool = False
    only: tuple[str, ...] | None = None
    into: Path | None = None
    seed: int = 0
    options: dict[str, Any] = field(default_factory=dict)
    answer: str = "gap.json"

    def __post_init__(self) -> None:
        i, n = self.shard
        if not 1 <= i <= n:
            raise InputError(f"shard {i}/{n}: write i/n with i from 1 to n")
        if self.name is not None and (self.name in ("", "..") or Path(self.name).name != self.name):
            raise InputError(f"--name {self.name}: the name of a folder was expected, no path")
        check_numbers(self, may_be_0=("seed",))

    @property
    def afresh(self) -> bool:
        """Whether each case has a process of its own: anyone's method keeps nothing of another case."""
        return ":" in self.method

    @property
    def answers(self) -> Path:
        """Where the answers go."""
        return self.into or self.folder.answers(self.name or self.method)

    def left(self) -> tuple[str, ...]:
        """Numbers of the cases of the shard that have no answer yet."""
        i, n = self.shard
        names = self.folder.names() if self.only is None else self.only
        return tuple(name for name in names[i - 1 :: n] if not self._answered(name))

    def _answered(self, name: str) -> bool:
        outcome = self.answers / name / OUTCOME
        if not outcome.is_file():
            return False
        told = read_json(outcome)
        if _FILES in told and told[_FILES] != case_stamp(self.folder.cases / name):
            return False  # the case is another one by now
        return not self.retry or told.get("done") is True


@dataclass
class _Shared:
    """What the keepers of the workers share."""

    plan: RunPlan
    code: str
    waiting: queue.SimpleQueue[str]
    progress: Progress | None
    failed: int = 0
    workers: list[Worker] = field(default_factory=list)
    stop: threading.Event = field(default_factory=threading.Event)
    lock: threading.Lock = field(default_factory=threading.Lock)

    def begun(self, worker: Worker) -> None:
        """Note a worker whose process runs; one that begins after the stop is ended at once."""
        self.workers.append(worker)
        if self.stop.is_set():
            worker.kill()


def run_cases(plan: RunPlan, progress: Progress | None = None) -> tuple[int, int]:
    """Answer the cases that are left; returns how many were answered now, and how many of them failed.

    Each answer appears whole, so that an interrupted run goes on where it was. A case that crashes its
    process, exceeds its time or writes no ``gap.json`` is recorded as failed, and the process started anew.

    Raises
    ------
    InputError
        If a sealed process could read the truth where it lies, or the method does not load.
    """
    if ":" not in plan.method:
        load_method(plan.method)  # a name that is not known is told before any process begins
    check_out_of_reach(plan)
    left = plan.left()
    waiting: queue.SimpleQueue[str] = queue.SimpleQueue()
    for name in left:
        waiting.put(name)
    shared = _Shared(plan, code_state(plan.method, plan.code), waiting, progress)
    with ThreadPoolExecutor(max_workers=plan.workers) as pool:
        keepers = [pool.submit(_keep, shared) for _ in range(min(plan.workers, len(left)))]
        try:
            for keeper in as_completed(keepers):
                keeper.result()
        except BaseException:
            shared.stop.set()
            # Their keepers then leave what they are at, unwritten.
            for worker in list(shared.workers):
                worker.kill()
            # Of futures, not of threads: a join that a signal interrupts takes its thread for ended.
            wait(keepers)
            raise
    return len(left), shared.failed


def check_out_of_reach(plan: RunPlan) -> None:
    """Refuse a suite whose truth lies among what a sealed process may read."""
    roots = (*own_roots(), *([plan.code.resolve()] if plan.code else []))
    if within(plan.folder.truth, roots):
        raise InputError(
            f"{plan.folder.truth}: lies in a folder that every process may read (Python's, the system's or "
            "the method's own code); move the suite elsewhere"
        )


def outcome_of(
    case: str, method: str, answer: dict[str, Any], locks: str, samples: int, code: str, files: str
) -> dict[str, Any]:
    """The values of ``outcome.json``, schema ``fogml.blind_outcome/1``; `files` is the case's stamp."""
    return {
        "schema": OUTCOME_SCHEMA,
        "case": case,
        "method": method,
        "done": answer["done"],
        "reason": answer["reason"],
        "message": answer["message"],
        "seconds": answer["seconds"],
        "samples": samples,
        "sealed_by": locks,
        "version": fogml.__version__,
        "code": code,
        _FILES: files,
    }


def case_stamp(folder: Path) -> str:
    """A hash of all files of a case: an answer is to these."""
    return sources_stamp(sorted(path for path in folder.iterdir() if path.is_file()))


def check_answers_to(answer: Path, case: Path) -> None:
    """Refuse an answer to other files than a case has by now.

    Raises
    ------
    InputError
        If its ``outcome.json`` says so; one that states none, as written by hand, is taken as it is.
    """
    path = answer / OUTCOME
    told = read_json(path) if path.is_file() else {}
    if _FILES in told and told[_FILES] != case_stamp(case):
        raise InputError(f"{path}: answers other files than {case} holds by now; answer the case again")


def _keep(shared: _Shared) -> None:
    """Take cases from the queue until none is left, with one worker after another."""
    worker: Worker | None = None
    plan = shared.plan
    try:
        while not shared.stop.is_set():
            try:
                name = shared.waiting.get_nowait()
            except queue.Empty:
                return
            if worker is None:
                worker = Worker(plan.method, plan.code, plan.threads, shared.begun)
                if worker.code != shared.code:
                    raise InputError(
                        f"the sources of '{plan.method}' or of fogml changed while cases were answered; "
                        "answers of this code would stand beside those of another: run it again"
                    )
            if not _one(shared, worker, name) or plan.afresh:
                worker.end()
                worker = None
    finally:
        if worker is not None:
            worker.end()


def _one(shared: _Shared, worker: Worker, name: str) -> bool:
    """Answer one case; False where the worker is lost."""
    plan, usable = shared.plan, True
    source, case, out = plan.folder.cases / name, worker.home / name, worker.home / "answer"
    # A copy, not a link: nothing in it leads back to the suite.
    shutil.copytree(source, case)
    files = case_stamp(case)
    out.mkdir()
    try:
        answer = worker.ask(
            {"case": name, "out": out.name, "seed": plan.seed, "options": plan.options}, plan.limit_s
        )
        written = out / plan.answer
        if answer["done"] and (written.is_symlink() or not written.is_file()):
            answer |= {"done": False, "reason": "no answer", "message": f"no {plan.answer} was written"}
    except WorkerLost as lost:
        usable = False
        seconds = plan.limit_s if lost.reason == "timed out" else None
        answer = {"done": False, "reason": lost.reason, "message": str(lost), "seconds": seconds}
    if shared.stop.is_set():
        return False
    method, samples = plan.name or plan.method, count_samples(source)
    values = outcome_of(name, method, answer, worker.locks, samples, shared.code, files)
    with folder_to_fill(plan.answers), whole_folder(plan.answers, shared=True) as staging:
        try:
            if out.is_dir() and not out.is_symlink():
                shutil.copytree(out, staging / name, ignore=not_answers)
        except OSError as error:
            shutil.rmtree(staging / name, ignore_errors=True)
            values |= {"done": False, "reason": "no answer", "message": f"it can't be read: {error}"}
        (staging / name).mkdir(exist_ok=True)
        write_json(staging / name / OUTCOME, values, indent=1)
    shutil.rmtree(case, ignore_errors=True)
    shutil.rmtree(out, ignore_errors=True)
    with shared.lock:
        shared.failed += not values["done"]
        if shared.progress:
            shared.progress(name)
    return usable


def run_oracle(plan: RunPlan, progress: Progress | None = None) -> tuple[int, int]:
    """Answer the cases that are left; returns how many were answered now, and how many failed."""
    left = plan.left()
    if not left:
        return 0, 0
    failed, code = 0, code_state(ORACLE)
    answer = partial(_by_oracle, plan.folder.path, plan.answers, code)
    with folder_to_fill(plan.answers), settled(plan.answers):
        for name, done in in_processes(answer, left, plan.workers):
            failed += not done
            if progress:
                progress(name)
    return len(left), failed


def _by_oracle(path: Path, answers: Path, code: str, name: str) -> tuple[str, bool]:
    from fogml.blind.baselines.learners import oracle
    from fogml.blind.truth import read_truth

    folder = BlindFolder(path)
    began = time.perf_counter()
    answer: dict[str, Any] = {"done": True, "reason": None, "message": ""}
    with whole_folder(answers, shared=True) as staging:
        out = staging / name
        out.mkdir()
        try:
            oracle(folder, read_truth(folder.truth / f"{name}.json"), out)
        except Exception as error:
            answer = {"done": False, "reason": "error", "message": f"{type(error).__name__}: {error}"}
        answer["seconds"] = time.perf_counter() - began
        samples = count_samples(folder.cases / name)
        files = case_stamp(folder.cases / name)
        values = outcome_of(name, ORACLE, answer, "not sealed: it is given the truth", samples, code, files)
        write_json(out / OUTCOME, values, indent=1)
    return name, bool(answer["done"])
