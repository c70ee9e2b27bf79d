"""Studies: opening or joining one, sampling, checking and counting its trials, trying again what was left."""

from __future__ import annotations

import json
import os
import socket
import time
import warnings
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any
from zlib import crc32

import numpy as np
import optuna
from optuna.distributions import BaseDistribution
from optuna.samplers import BaseSampler, RandomSampler, TPESampler
from optuna.trial import FrozenTrial
from pydantic import BaseModel, ConfigDict, FiniteFloat, ValidationError, model_validator

from fogml.errors import InputError
from fogml.json_files import parse_json
from fogml.processes import process_is_alive, process_start
from fogml.runs.run import Run
from fogml.tuning.plan import Plan
from fogml.tuning.storage import import_optuna, open_storage, shown

if TYPE_CHECKING:
    import optuna
    from optuna.trial import FrozenTrial

PLACE = "place"
"""Attribute of a trial: which of the trials asked for it is, from 0; a trial tried again keeps it."""


class SeededByTrial(BaseSampler):
    """A sampler whose random numbers follow from the seed and the trial's place alone.

    What a trial draws follows from the seed, the trial's place and, with ``tpe``, the trials that have
    finished. So one worker, killed anywhere and started again on its machine, goes on as it would have
    gone, bit for bit. Several workers try the same with ``random``; with ``tpe`` what they try depends on
    the order in which they finish.

    Parameters
    ----------
    name
        ``tpe`` (tree-structured Parzen estimator) or ``random``.
    seed
        The sweep's seed.
    """

    def __init__(self, name: str, seed: int) -> None:
        self._name, self._seed = name, seed

    def infer_relative_search_space(
        self, study: optuna.Study, trial: FrozenTrial
    ) -> dict[str, BaseDistribution]:
        """Nothing: which parameters there are depends on what is chosen first."""
        return {}

    def sample_relative(
        self, study: optuna.Study, trial: FrozenTrial, search_space: dict[str, BaseDistribution]
    ) -> dict[str, Any]:
        """Nothing: each parameter is drawn by itself."""
        return {}

    def sample_independent(
        self, study: optuna.Study, trial: FrozenTrial, param_name: str, param_distribution: BaseDistribution
    ) -> Any:
        """A parameter's value; it follows from seed, place and name, whatever was drawn before."""
        key = [self._seed, place_of(trial), crc32(param_name.encode())]
        seed = int(np.random.SeedSequence(key).generate_state(1)[0])
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            kind: Any = TPESampler if self._name == "tpe" else RandomSampler
            return kind(seed=seed).sample_independent(study, trial, param_name, param_distribution)


def place_of(trial: FrozenTrial | optuna.Trial) -> int:
    """Which of the trials asked for one is."""
    return int(trial.user_attrs.get(PLACE, trial.number))


class _Worker(BaseModel):
    model_config = ConfigDict(strict=True)
    host: str
    pid: int = 0
    started: str


class _Attributes(BaseModel):
    """What is told of a trial, where it is told."""

    model_config = ConfigDict(strict=True, protected_namespaces=())
    model: str = ""
    features: str | None = None
    parameters: dict[str, Any] = {}
    fold_errors: list[list[FiniteFloat]] = []
    fold_rows: list[list[FiniteFloat]] = []
    fold_means: list[list[FiniteFloat]] | None = None
    averaging_s: FiniteFloat | None = None
    bytes: FiniteFloat | None = None
    operations: FiniteFloat | None = None
    reason: str = ""
    place: int = 0
    worker: _Worker | None = None
    reference: str | None = None

    @model_validator(mode="after")
    def _of_one_length(self) -> _Attributes:
        if [len(fold) for fold in self.fold_errors] != [len(fold) for fold in self.fold_rows]:
            raise ValueError("each fold needs as many errors as numbers of rows")
        lengths = [(len(errors), 0) for errors in self.fold_errors]
        if self.fold_means is not None and (
            len(self.fold_means) != len(lengths)
            or any(len(means) not in kinds for means, kinds in zip(self.fold_means, lengths))
        ):
            raise ValueError("each fold needs as many means as errors, or none")
        if any(rows <= 0.0 for fold in self.fold_rows for rows in fold):
            raise ValueError("numbers of rows are positive")
        return self


class _Drawn(BaseModel):
    """What was drawn and found."""

    model_config = ConfigDict(strict=True)
    params: dict[str, FiniteFloat | int | str | bool | None]
    values: list[FiniteFloat] | None


def check_trials(study: optuna.Study, plan: Plan) -> None:
    """Check every trial that is there."""
    for trial in study.get_trials(deepcopy=False):
        fault = _fault(trial, len(plan.objectives))
        if fault:
            raise InputError(
                f"study '{plan.name}' in {shown(plan.storage)}: trial {trial.number} is damaged ({fault}); "
                "move the study away, or choose another --out or --name"
            )


def _fault(trial: FrozenTrial, objectives: int) -> str:
    try:
        told = _Attributes.model_validate(trial.user_attrs)
        drawn = _Drawn.model_validate({"params": trial.params, "values": trial.values})
    except ValidationError as error:
        first = error.errors()[0]
        return f"{'.'.join(str(part) for part in first['loc'][:2])}: {first['msg']}".lstrip(": ")
    if trial.state.name != "COMPLETE":
        return ""
    if not told.model_fields_set >= {"model", "parameters"} or told.features is None:
        return "it names no model, features and parameters"
    if len(drawn.values or ()) != objectives:
        return f"{objectives} values were expected"
    if not (told.fold_errors and all(told.fold_errors)) or told.bytes is None or told.operations is None:
        return "it holds no figures"
    return ""


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
