"""Studies: opening or joining one, counting its trials, and trying again what a dead worker left."""

from __future__ import annotations

import json
import os
import socket
import time
import warnings
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from fogml.errors import InputError
from fogml.processes import process_is_alive, process_start
from fogml.runs.run import Run
from fogml.strict_json import parse_json
from fogml.tuning.plan import Plan
from fogml.tuning.sampling import PLACE, place_of
from fogml.tuning.storage import import_optuna, open_storage, shown
from fogml.tuning.trial_check import check_trials

if TYPE_CHECKING:
    import optuna
    from optuna.trial import FrozenTrial

IDENTITY, WORKER, BEAT = "fogml_identity", "worker", "beat"
_SILENT_BEATS = 3
"""Heartbeats that a worker may miss: one may be lost to a busy machine, two to one that writes a journal."""
_HOLDING = ("RUNNING", "COMPLETE", "PRUNED")


def open_study(plan: Plan, runs: Sequence[Run] | None = None) -> optuna.Study:
    """The plan's study, made where it is not there yet.

    Parameters
    ----------
    plan
        What to do.
    runs
        The training runs, to tell whether trials that are there already belong to them; None where
        that is known.

    Raises
    ------
    InputError
        If the storage does not answer, or holds a study of this name made for something else.
    """
    found = import_optuna()
    from fogml.tuning.sampling import SeededByTrial

    study = found.create_study(
        storage=open_storage(plan.storage, plan.folder),
        sampler=SeededByTrial(plan.sampler, plan.seed),
        pruner=found.pruners.NopPruner(),
        study_name=plan.name,
        directions=["minimize"] * len(plan.objectives),
        load_if_exists=True,
    )
    check_trials(study, plan)
    if runs is not None:
        _check_identity(study, plan, runs)
    return study


def _check_identity(study: optuna.Study, plan: Plan, runs: Sequence[Run]) -> None:
    wanted = plan.identity(runs)
    # In this order: whoever begins trials has stated what they are for.
    begun = bool(study.get_trials(deepcopy=False))
    stored = study.user_attrs.get(IDENTITY)
    if stored is None:
        if begun:
            raise InputError(f"study '{plan.name}' in {shown(plan.storage)}: was not made by fogml sweep")
        study.set_user_attr(IDENTITY, json.dumps(wanted))
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            study.set_metric_names(list(plan.objectives))
        return
    place = f"study '{plan.name}' in {shown(plan.storage)}"
    was = parse_json(str(stored), place, "state another --name, or another --out")
    if not isinstance(was, dict):
        raise InputError(f"{place}: was not made by fogml sweep")
    other = [key for key, value in wanted.items() if was.get(key) != value]
    if other:
        raise InputError(
            f"study '{plan.name}' in {shown(plan.storage)}: was made with another {' and '.join(other)}; "
            "its trials can't be gone on with; state another --name, or another --out"
        )


def is_finished(trial: FrozenTrial) -> bool:
    """Whether a trial counts towards those asked for: whole, or pruned."""
    return trial.state.name in ("COMPLETE", "PRUNED")


def finished_count(study: optuna.Study) -> int:
    """Number of trials that count."""
    return sum(is_finished(trial) for trial in study.get_trials(deepcopy=False))


def free_place(study: optuna.Study, count: int) -> int | None:
    """The first of so many places that no trial holds or has filled; None if there is none."""
    trials = study.get_trials(deepcopy=False)
    held = {place_of(trial) for trial in trials if trial.state.name in _HOLDING}
    return next((place for place in range(count) if place not in held), None)


def begin_trial(study: optuna.Study, place: int) -> optuna.Trial | None:
    """Begin the trial of a place; None if another worker was quicker.

    The trial is made together with its place and its worker: there is none without, whenever a
    worker is killed.
    """
    import optuna
    from optuna.trial import TrialState, create_trial

    pid = os.getpid()
    worker = {"host": socket.gethostname(), "pid": pid, "started": process_start(pid)}
    attributes: dict[str, Any] = {PLACE: place, WORKER: worker}
    failed = [t.number for t in study.get_trials(deepcopy=False) if _holds(t, place, ("FAIL",))]
    if failed:
        attributes["retry_of"] = failed[-1]
    # Optuna's ask makes a trial first and lets attributes be added.
    template = create_trial(state=TrialState.RUNNING, user_attrs=attributes)
    identity = study._storage.create_new_trial(study._study_id, template_trial=template)
    study._thread_local.cached_all_trials = None
    trial = optuna.Trial(study, identity)
    others = [t for t in study.get_trials(deepcopy=False) if _holds(t, place, _HOLDING)]
    if min(other.number for other in others) < trial.number:
        study.tell(trial, state=TrialState.FAIL)
        return None
    return trial


def _holds(trial: FrozenTrial, place: int, states: tuple[str, ...]) -> bool:
    return trial.state.name in states and place_of(trial) == place


class Recovery:
    """Finds trials whose worker is gone, and gives their places up, to be tried again.

    On this machine a worker is gone if its process is. Of another machine's workers a trial is
    given up once its heartbeat has not changed for three times the heartbeat's interval, by this
    machine's clock: clocks of machines differ.
    """

    def __init__(self, heartbeat_s: float) -> None:
        self._patience_s = _SILENT_BEATS * heartbeat_s
        self._heard: dict[int, tuple[Any, float]] = {}

    def __call__(self, study: optuna.Study) -> int:
        """Give up what dead workers left; how many trials."""
        running = [trial for trial in study.get_trials(deepcopy=False) if trial.state.name == "RUNNING"]
        return sum(_give_up(study, trial) for trial in running if self._is_dead(trial))

    def _is_dead(self, trial: FrozenTrial) -> bool:
        worker = trial.user_attrs.get(WORKER) or {"host": "", "started": ""}
        here = worker["host"] == socket.gethostname() and worker["started"]
        if here and not process_is_alive(worker["pid"], worker["started"]):
            return True
        now, beat = time.monotonic(), trial.user_attrs.get(BEAT)
        before = self._heard.get(trial.number)
        if before is None or before[0] != beat:
            self._heard[trial.number] = (beat, now)
            return False
        return now - before[1] > self._patience_s


def _give_up(study: optuna.Study, trial: FrozenTrial) -> bool:
    """Fail a trial; False if somebody else did."""
    from optuna.exceptions import UpdateFinishedTrialError
    from optuna.trial import TrialState

    try:
        return bool(study._storage.set_trial_state_values(trial._trial_id, TrialState.FAIL))
    except UpdateFinishedTrialError:
        return False
