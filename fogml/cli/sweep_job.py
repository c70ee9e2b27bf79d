"""The job of ``fogml sweep``."""

from __future__ import annotations

import hashlib
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from fogml.cli.model_commands import SweepSettings
from fogml.cli.options import Repairing
from fogml.cli.runs import open_legs, open_runs
from fogml.cli.terminal import Terminal
from fogml.errors import InputError
from fogml.json_files import write_json
from fogml.outputs import whole_folder
from fogml.runs.run import Run
from fogml.tracking import Tracker
from fogml.tuning.plan import Plan, run_identity
from fogml.tuning.study import IDENTITY
from fogml.yaml_text import parse_yaml

if TYPE_CHECKING:
    import optuna

    from fogml.validation.results import Judgement


def plan_of(settings: SweepSettings, runs: list[Run]) -> Plan:
    """What workers are told."""
    return Plan(
        name=settings.name,
        read=partial(_read, tuple(settings.runs), settings.repair, [run_identity(run) for run in runs]),
        space=settings.space,
        objectives=tuple(settings.objectives),
        folds=settings.folds,
        fold_count=settings.fold_count,
        trials=settings.trials,
        sampler=settings.sampler,
        prune=settings.prune,
        seed=settings.seed,
        storage=settings.storage,
        folder=settings.out,
        heartbeat_s=settings.heartbeat_s,
    )


def _read(paths: tuple[str, ...], repair: Repairing, identities: list[Any]) -> list[Run]:
    """The training runs, which have to be those that the sweep began with."""
    runs = [run for path in paths for run in open_legs(path, repair=repair)]
    for run, wanted in zip(runs, identities, strict=True):
        if run_identity(run) != wanted:
            raise InputError(f"{run.name}: has changed since the sweep began; finished trials are kept")
    return runs


def _check_same_gyro(runs: list[Run], test_runs: list[Run]) -> None:
    """Refuse test runs of another gyro before the trials: the winner could not be judged on them."""
    for fact in ("unit", "axis"):
        trained = next((held for run in runs if (held := getattr(run.facts, fact)) is not None), None)
        for run in test_runs:
            found = getattr(run.facts, fact)
            if None not in (found, trained) and found != trained:
                raise InputError(
                    f"{run.name}: {fact} '{found}', but the training runs are of {fact} '{trained}'; "
                    f"name test runs of this {fact}"
                )


def sweep_and_write(settings: SweepSettings, terminal: Terminal) -> None:
    """Run the trials that are missing, judge the winner once on the test runs, write the results."""
    from fogml.report.sweep_page import pareto_table, sweep_page, verdict_sentences
    from fogml.tuning.sweep import run_sweep, study_json

    tracker = None if settings.track is None else Tracker(settings.track, "fogml sweep", terminal.note)
    runs = open_runs(settings.runs, terminal, repair=settings.repair, beside=settings.test)
    test_runs = open_runs(settings.test, terminal, repair=settings.repair, beside=settings.runs)
    _check_same_gyro(runs, test_runs)
    with terminal.work("sweeping", total=settings.trials) as work:
        study = run_sweep(
            plan_of(settings, runs),
            settings.workers,
            lambda done, what: work.reached(done, settings.trials, f"tried {what}"),
        )
    with whole_folder(settings.out, shared=True) as folder:
        best = best_settings(settings, study)
        judgement = _judge(settings, best, runs, test_runs, terminal)
        values = study_json(
            study,
            objectives=settings.objectives,
            runs=settings.runs,
            test=settings.test,
            seed=settings.seed,
            averaging_s=settings.averaging,
            storage=settings.storage,
            judgement=judgement,
        )
        write_json(folder / "sweep.json", values)
        (folder / "best.yaml").write_text(best, encoding="utf-8")
        settings.write_into(folder, "sweep")
        with terminal.work("drawing"):
            page = sweep_page(values, judgement)
        (folder / "sweep.html").write_text(page, encoding="utf-8")
    if tracker is not None:
        _track(tracker, values, str(study.user_attrs.get(IDENTITY)))
    terminal.say(" ".join(verdict_sentences(values, judgement)))
    terminal.show(pareto_table(values))
    terminal.say(values["winner"]["command"])
    terminal.result(values)
    terminal.say(f"Written to {settings.out}: open {Path(settings.out) / 'sweep.html'}")


def _track(tracker: Tracker, values: dict[str, Any], identity: str) -> None:
    """Tell a tracker of the finished trials."""
    chosen = values["winner"]["number"]
    for trial in values["trials"]:
        told = f"{values['study']}\n{identity}\n{trial['number']}"
        tracker.log(
            hashlib.sha256(told.encode()).hexdigest(),
            f"{values['study']} trial {trial['number']}",
            {"model": trial["model"], "features": trial["features"], **trial["parameters"]},
            {name: trial[name] for name in ("rms", "bias_stability", "bytes", "operations")},
            {"state": trial["state"], "study": values["study"], "winner": str(trial["number"] == chosen)},
        )


def best_settings(settings: SweepSettings, study: optuna.Study) -> str:
    """The winner as the text of a configuration of ``fogml train``."""
    from fogml.cli.train_job import TrainSettings
    from fogml.tuning.winner import train_settings, winner

    chosen = winner(study.get_trials(deepcopy=False))
    train = TrainSettings(
        runs=settings.runs,
        test=settings.test,
        averaging=settings.averaging,
        repair=settings.repair,
        seed=settings.seed,
        out=str(Path(settings.out) / "best"),
        **train_settings(chosen),
    )
    return train.in_full().yaml("train", "best.yaml")


def _judge(
    settings: SweepSettings, best: str, runs: list[Run], test_runs: list[Run], terminal: Terminal
) -> Judgement | None:
    """The winner, fitted to all training runs and judged on the test runs; None where there are none."""
    if not test_runs:
        return None
    from fogml.cli.train_job import TrainSettings, fit_and_judge

    train = TrainSettings.model_validate(parse_yaml(best, "best.yaml"))
    return fit_and_judge(train, runs, test_runs, terminal)[1]
