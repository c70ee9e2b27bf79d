"""A worker: takes trials of a study until those asked for are done."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

import numpy as np

from fogml.arrays import FloatArray
from fogml.errors import FogmlError
from fogml.models.candidates import Candidate, Score
from fogml.tuning.held_out import FoldResult, HeldOut
from fogml.tuning.plan import Choice, Plan
from fogml.tuning.study import BEAT, Recovery, begin_trial, finished_count, free_place, place_of

if TYPE_CHECKING:
    import optuna
    from optuna.trial import FrozenTrial

_LEAST_FOLDS = 2
# Folds before a trial may be pruned.
_WAIT_S = 0.2
_REFUSALS = (FogmlError, ValueError, ArithmeticError, np.linalg.LinAlgError)


def work(
    study: optuna.Study,
    plan: Plan,
    held_out: HeldOut,
    progress: Callable[[int, str], None] | None = None,
) -> None:
    """Run trials until those asked for are finished, by this worker and others."""
    recover = Recovery(plan.heartbeat_s)
    while True:
        recover(study)
        place = free_place(study, plan.trials)
        if place is None:
            if finished_count(study) >= plan.trials:
                return
            # Others run what is left: one of them may die.
            time.sleep(_WAIT_S)
            continue
        _one_trial(study, plan, held_out, place)
        if progress is not None:
            latest = study.get_trials(deepcopy=False)[-1]
            progress(finished_count(study), str(latest.user_attrs.get("model", "")))


def _one_trial(study: optuna.Study, plan: Plan, held_out: HeldOut, place: int) -> None:
    from optuna.trial import TrialState

    trial = begin_trial(study, place)
    if trial is None:
        return
    with _heartbeat(trial, plan.heartbeat_s):
        values = _evaluate(study, plan, held_out, trial)
    if values is None:
        study.tell(trial, state=TrialState.PRUNED, skip_if_finished=True)
    else:
        # A worker taken for dead finds its trial given to another.
        study.tell(trial, values, skip_if_finished=True)


def _evaluate(study: optuna.Study, plan: Plan, held_out: HeldOut, trial: optuna.Trial) -> list[float] | None:
    """Values of the objectives; None for a trial that is pruned or that can't be fitted."""
    references = dict(enumerate((plan.references or {}).items()))
    reference, choice = references.get(place_of(trial)) or (None, plan.space.suggest(trial))
    told: dict[str, Any] = {
        **({} if reference is None else {"reference": reference}),
        "model": choice.model,
        "features": choice.features,
        "parameters": choice.parameters,
        "averaging_s": held_out.averaging_s,
    }
    for name, value in told.items():
        trial.set_user_attr(name, value)
    folds: list[FoldResult] = []
    try:
        for result in held_out.judged(choice):
            folds.append(result)
            _note(trial, folds)
            if len(plan.objectives) == 1:
                error = bias_stability_of if "bias_stability" in plan.objectives else rms_of
                trial.report(error(folds), len(folds) - 1)
            if plan.prune and reference is None and _LEAST_FOLDS <= len(folds) < len(held_out.folds):
                better = _beaten_by(study, plan, choice, folds)
                if better is not None:
                    trial.set_user_attr("reason", f"beaten by trial {better} on {len(folds)} folds")
                    return None
    except _REFUSALS as error:
        known = isinstance(error, FogmlError)
        trial.set_user_attr("reason", str(error) if known else f"{type(error).__name__}: {error}")
        return None
    figures = {
        "rms": rms_of(folds),
        "bias_stability": bias_stability_of(folds),
        "bytes": float(size_of(folds)),
        "operations": float(work_of(folds)),
    }
    return [figures[name] for name in plan.objectives]


def _note(trial: optuna.Trial, folds: list[FoldResult]) -> None:
    trial.set_user_attr("fold_errors", [fold.squared_errors for fold in folds])
    trial.set_user_attr("fold_means", [fold.mean_errors for fold in folds])
    trial.set_user_attr("fold_rows", [fold.rows for fold in folds])
    trial.set_user_attr("bytes", size_of(folds))
    trial.set_user_attr("operations", work_of(folds))


def rms_of(folds: list[FoldResult]) -> float:
    """Root mean square of the errors on all rows held out [deg/h]."""
    squares = np.concatenate([fold.squared_errors for fold in folds])
    rows = np.concatenate([fold.rows for fold in folds])
    return float(np.sqrt(np.average(squares, weights=rows)))


def bias_stability_of(folds: list[FoldResult]) -> float:
    """As `rms_of`, each held-out run's mean error apart [deg/h]."""
    squares = [about_mean(fold.squared_errors, fold.mean_errors, fold.rows) for fold in folds]
    rows = np.concatenate([fold.rows for fold in folds])
    return float(np.sqrt(np.average(np.concatenate(squares), weights=rows)))


def about_mean(squares: Sequence[float], means: Sequence[float], rows: Sequence[int]) -> FloatArray:
    """Mean squared errors of a held-out run's blocks about the run's mean error; as they are without means.

    How far the bias of a run lies from that of another no model of temperature tells.
    """
    if not len(means):
        return np.asarray(squares, dtype=np.float64)
    own = np.asarray(means)
    mean = float(np.average(own, weights=rows))
    return np.maximum(np.asarray(squares) - 2.0 * mean * own + mean**2, 0.0)


def size_of(folds: list[FoldResult]) -> int:
    """Bytes of the largest fit."""
    return max(fold.size_bytes for fold in folds)


def work_of(folds: list[FoldResult]) -> int:
    """Operations per sample of the largest fit."""
    return max(fold.operations for fold in folds)


def score_of(trial: FrozenTrial, folds: int | None = None) -> Score:
    """How a finished trial did on its first folds, each held-out run's mean apart.

    On all where `folds` is None.
    """
    attributes = trial.user_attrs
    candidate = Candidate(attributes["features"], attributes["model"].startswith("rbf"))
    errors, rows = attributes["fold_errors"][:folds], attributes["fold_rows"][:folds]
    means = attributes.get("fold_means", [[]] * len(errors))[:folds]
    squares = [about_mean(*fold) for fold in zip(errors, means, rows, strict=True)]
    return Score(candidate, 0, np.concatenate(squares), np.concatenate(rows))


def _beaten_by(study: optuna.Study, plan: Plan, choice: Choice, folds: list[FoldResult]) -> int | None:
    """Place of a finished trial that is no larger, and better beyond noise on the folds so far."""
    mine = Score(
        Candidate(choice.features),
        0,
        np.concatenate([about_mean(fold.squared_errors, fold.mean_errors, fold.rows) for fold in folds]),
        np.concatenate([fold.rows for fold in folds]),
    )
    sizes = {"bytes": size_of(folds), "operations": work_of(folds)}
    for trial in sorted(study.get_trials(deepcopy=False), key=place_of):
        if trial.state.name != "COMPLETE":
            continue
        if any(trial.user_attrs[name] > sizes[name] for name in plan.objectives if name in sizes):
            continue
        if score_of(trial, len(folds)).beats(mine):
            return place_of(trial)
    return None


@contextmanager
def _heartbeat(trial: optuna.Trial, every_s: float) -> Iterator[None]:
    """Let other machines see that the trial's worker lives."""
    done = threading.Event()

    def beat() -> None:
        count = 0
        while not done.wait(every_s):
            count += 1
            try:
                trial.set_user_attr(BEAT, count)
            except Exception:  # the trial itself meets a storage that has failed
                return

    thread = threading.Thread(target=beat, daemon=True)
    thread.start()
    try:
        yield
    finally:
        done.set()
        thread.join()
