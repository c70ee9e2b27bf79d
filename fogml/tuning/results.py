"""``sweep.json``: a study as JSON-ready values, schema ``fogml.study/1``."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from fogml.json_files import finite_json
from fogml.tuning.plan import OBJECTIVES
from fogml.tuning.storage import shown
from fogml.tuning.study import is_finished, place_of
from fogml.tuning.winner import against_references, command_line, figure, importance, pareto, winner
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
        "folds": "runs" if len(runs) > 1 else "blocks of time",
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
