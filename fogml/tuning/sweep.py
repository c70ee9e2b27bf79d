"""Runs a sweep in one worker, or in processes that are started again when they die; its ``sweep.json``."""

from __future__ import annotations

import multiprocessing
import os
import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from multiprocessing.connection import Connection
from multiprocessing.process import BaseProcess
from pathlib import Path
from typing import TYPE_CHECKING, Any

from fogml.errors import FogmlError, InputError
from fogml.json_files import finite_json
from fogml.processes import begin_worker, one_thread
from fogml.settings_check import check_whole
from fogml.tuning.held_out import HeldOut
from fogml.tuning.plan import OBJECTIVES, Plan
from fogml.tuning.storage import journal_to_fill, shown, storage_errors
from fogml.tuning.study import Recovery, finished_count, is_finished, open_study, place_of
from fogml.tuning.winner import (
    against_references,
    command_line,
    figure,
    importance,
    pareto,
    reference_choices,
    winner,
)
from fogml.validation.report_json import judgement_json

if TYPE_CHECKING:
    import optuna
    from optuna.trial import FrozenTrial

    from fogml.validation.results import Judgement


STUDY_SCHEMA = "fogml.study/1"


def study_json(
    study: optuna.Study,
    *,
    objectives: Sequence[str],
    runs: Sequence[str],
    test: Sequence[str],
    seed: int,
    averaging_s: float,
    storage: str | None,
    judgement: Judgement | None,
) -> dict[str, Any]:
    """A study's trials, Pareto set and winner.

    Parameters
    ----------
    study
        With its trials finished.
    objectives
        What it minimised.
    runs, test
        Paths of the training runs and of the test runs.
    seed, averaging_s
        As the winner's command takes them.
    storage
        URL of the database; None for a journal.
    judgement
        The winner on the test runs; None where there are none.
    """
    finished = [trial for trial in study.get_trials(deepcopy=False) if is_finished(trial)]
    trials = sorted(finished, key=place_of)
    place = {trial.number: index for index, trial in enumerate(trials)}
    best = winner(trials)
    # Means of held-out parts are told where these are whole runs.
    by_run = any(best.user_attrs.get("fold_means", ()))
    chosen = dict(_trial(best))
    chosen["against"] = against_references(trials, best)
    chosen["command"] = command_line(best, runs, test, seed, averaging_s)
    if judgement is not None:
        chosen["judged"] = judgement_json(judgement)
    values = {
        "schema": STUDY_SCHEMA,
        "study": study.study_name,
        "storage": shown(storage),
        "objectives": [{"name": name, "unit": OBJECTIVES[name]} for name in objectives],
        "folds": "runs" if by_run else "blocks of time",
        "held_out_averaging_s": best.user_attrs.get("averaging_s"),
        "train": [Path(run).name for run in runs],
        "test": [Path(run).name for run in test],
        "seed": seed,
        "counts": {
            "complete": sum(trial.state.name == "COMPLETE" for trial in trials),
            "pruned": sum(trial.state.name == "PRUNED" for trial in trials),
            "retried": sum("retry_of" in trial.user_attrs for trial in trials),
        },
        "trials": [_trial(trial) for trial in trials],
        "pareto": [place[trial.number] for trial in pareto(trials)],
        "importance": importance(trials, seed),
        "winner": chosen,
    }
    return dict(finite_json(values))


def _trial(trial: FrozenTrial) -> dict[str, Any]:
    attributes = trial.user_attrs
    whole = trial.state.name == "COMPLETE"
    return {
        "number": place_of(trial),
        "state": "complete" if whole else "pruned",
        "model": attributes.get("model", ""),
        "features": attributes.get("features", ""),
        "parameters": attributes.get("parameters", {}),
        "rms": figure(trial, "rms") if whole else None,
        "bias_stability": figure(trial, "bias_stability") if whole else None,
        "reference": attributes.get("reference", ""),
        "bytes": attributes.get("bytes"),
        "operations": attributes.get("operations"),
        "folds": len(attributes.get("fold_errors", [])),
        "reason": attributes.get("reason", ""),
    }


Progress = Callable[[int, str], None]
_POLL_S = 0.2
_MOST_DEATHS = 5
# Workers that end by themselves without a trial finished in between, before the sweep gives up.


def run_sweep(plan: Plan, workers: int = 1, progress: Progress | None = None) -> optuna.Study:
    """Run the plan's trials, or those that are still missing, and give the study.

    Several processes, here or on other machines, may run the same plan at once; each ends when
    the trials asked for are finished.

    Raises
    ------
    InputError
        If the plan can't be run, or the storage fails; finished trials are kept.
    """
    check_whole("workers", workers, 1)
    plan.check()
    if plan.references is None:
        plan = replace(plan, references=reference_choices(plan.read(), plan.seed))
    held_out = _held_out(plan)
    with storage_errors(plan.storage), journal_to_fill(plan.storage, plan.folder):
        study = open_study(plan, held_out.runs)
        Recovery(plan.heartbeat_s)(study)
        if workers == 1:
            _work_alone(study, plan, held_out, progress)
        elif finished_count(study) < plan.trials:
            del held_out
            _Crew(study, plan, min(workers, plan.trials), progress).run()
    return study


def _held_out(plan: Plan) -> HeldOut:
    references = (plan.references or {}).values()
    return HeldOut(
        plan.read(), plan.space, references, folds=plan.folds, count=plan.fold_count, seed=plan.seed
    )


def _work_alone(study: optuna.Study, plan: Plan, held_out: HeldOut, progress: Progress | None) -> None:
    from fogml.tuning.worker import work

    with one_thread():
        work(study, plan, held_out, progress)


def _worker_process(plan: Plan, told: Connection, parent: int) -> None:
    """What a worker's process does; bad input is told to the one that started it."""
    begin_worker(parent)
    try:
        with storage_errors(plan.storage):
            _work_alone(open_study(plan), plan, _held_out(plan), None)
    except FogmlError as error:
        told.send(str(error))
    finally:
        told.close()


class _Crew:
    """Worker processes; one that dies is replaced, and its trial tried again."""

    def __init__(self, study: optuna.Study, plan: Plan, count: int, progress: Progress | None) -> None:
        self._study, self._plan, self._progress = study, plan, progress
        # Forked processes would share threads and locks of numerical libraries that don't survive it.
        self._context = multiprocessing.get_context("spawn")
        self._members = [self._start() for _ in range(count)]
        self._recover = Recovery(plan.heartbeat_s)
        self._deaths = 0
        self._done = finished_count(study)

    def run(self) -> None:
        """Watch until the trials asked for are finished."""
        try:
            while self._members:
                time.sleep(_POLL_S)
                self._count()
                self._members = [member for old in self._members for member in self._look_after(old)]
        finally:
            for process, _ in self._members:
                process.kill()
                process.join()

    def _count(self) -> None:
        done = finished_count(self._study)
        if done > self._done:
            self._done, self._deaths = done, 0
        if self._progress is not None:
            self._progress(min(done, self._plan.trials), f"trial {done} of {self._plan.trials}")

    def _look_after(self, member: tuple[BaseProcess, Connection]) -> list[tuple[BaseProcess, Connection]]:
        process, told = member
        if process.is_alive():
            return [member]
        process.join()
        message = _said(told)
        if message is not None:
            raise InputError(message)
        if process.exitcode == 0:
            return []
        self._deaths += 1
        if self._deaths > _MOST_DEATHS:
            raise InputError(
                f"{self._deaths} workers in a row ended without finishing a trial (exit {process.exitcode}); "
                "finished trials are kept; is there enough memory? Try fewer --workers"
            )
        self._recover(self._study)
        return [self._start()]

    def _start(self) -> tuple[BaseProcess, Connection]:
        receiver, sender = self._context.Pipe(duplex=False)
        process = self._context.Process(
            target=_worker_process, args=(self._plan, sender, os.getpid()), daemon=True
        )
        process.start()
        sender.close()
        return process, receiver


def _said(told: Connection) -> str | None:
    try:
        return str(told.recv()) if told.poll() else None
    except EOFError:
        return None
