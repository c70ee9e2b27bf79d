"""The job of ``fogml train``, which ``fogml demo`` does too."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from fogml.cli.from_diagnosis import unfitted_model
from fogml.cli.model_commands import TrainSettings
from fogml.cli.runs import open_noise, open_runs
from fogml.cli.terminal import Terminal, Work
from fogml.errors import InputError
from fogml.json_files import finite_json, write_json
from fogml.numerals import against, number, percent, stated
from fogml.outputs import whole_folder
from fogml.runs.run import Run
from fogml.validation.certified import held_constant, of_10_s, over_temperature
from fogml.validation.judge import judge
from fogml.validation.limits import check_design_index, check_limits, hold_strict
from fogml.validation.metrics import check_turn_on_band
from fogml.validation.report_json import judgement_json
from fogml.validation.results import Judgement, RunJudgement
from fogml.validation.thermometer_lag import lag_note

if TYPE_CHECKING:
    from fogml.cli.compare_job import CompareSettings
    from fogml.models.base import DriftModel


def train(settings: TrainSettings, terminal: Terminal) -> bool:
    """Fit, judge, write the results into ``settings.out``, and print them; whether every limit is met."""
    check_settings(settings)
    # The folder is asked for first: nobody should train for an hour and then find it closed.
    with whole_folder(settings.out) as folder:
        train_runs, test_runs = split_runs(settings, terminal)
        model, judgement = fit_and_judge(settings, train_runs, test_runs, terminal)
        write_results(folder, settings, model, judgement, terminal)
    print_judgement(judgement, terminal)
    terminal.result(_report(settings, judgement))
    terminal.say(f"Written to {settings.out}: open {Path(settings.out) / 'report.html'}")
    return judgement.met


def check_settings(settings: TrainSettings | CompareSettings) -> None:
    """Check what can be checked before a run is read."""
    check_limits(settings.limits)
    check_design_index(settings.design_index)
    check_turn_on_band(settings.turn_on_band)
    if isinstance(settings, TrainSettings) and settings.navigation is not None:
        from fogml.lab.navigation import error_matrices

        error_matrices(settings.navigation, "north")
    if settings.features is not None:
        from fogml.features.parse import parse_features

        parse_features(settings.features)
    if isinstance(settings, TrainSettings):
        unfitted_model(settings)
        if settings.train_again and settings.design_index is None:
            raise InputError("--train-again needs a --design-index to reach")


def split_runs(settings: TrainSettings | CompareSettings, terminal: Terminal) -> tuple[list[Run], list[Run]]:
    """The training runs and the test runs, read and checked."""
    reading = partial(open_runs, terminal=terminal, repair=settings.repair, axis=settings.axis)
    train_runs = reading(settings.runs, beside=settings.test)
    test_runs = reading(settings.test, beside=settings.runs)
    check_turn_on_band(settings.turn_on_band, (*train_runs, *test_runs))
    if settings.strict:
        hold_strict([(run.name, run.findings) for run in (*train_runs, *test_runs)])
    return train_runs, test_runs


def noise_run(
    settings: TrainSettings | CompareSettings, terminal: Terminal, train_runs: Sequence[Run]
) -> Run | None:
    """The static run that makes the floor, read and checked; None where none is named."""
    run = open_noise(
        settings.noise,
        terminal,
        train_runs,
        repair=settings.repair,
        axis=settings.axis,
        any_unit=settings.any_unit,
    )
    if run is not None:
        from fogml.runs.turning import check_noise_run

        check_noise_run(run)
    return run


def fit_and_judge(
    settings: TrainSettings,
    train_runs: list[Run],
    test_runs: list[Run],
    terminal: Terminal,
    unfitted: DriftModel | None = None,
) -> tuple[DriftModel, Judgement]:
    """The fitted model and its judgement; of `unfitted` where given, else of what the settings name."""
    notes = [
        f"{test.name} is the training run {trained.name}: its figures say nothing of a run not trained on"
        for test in test_runs
        for trained in train_runs
        if len(test) == len(trained) and test.hash == trained.hash
    ]
    noise = noise_run(settings, terminal, train_runs)
    with terminal.work(f"fitting {settings.model}") as work:
        if settings.train_again:
            from fogml.validation.index_search import train_until_index

            assert settings.design_index is not None
            found = train_until_index(
                train_runs,
                settings.design_index,
                model=settings.model,
                features=settings.features,
                averaging_s=settings.averaging,
                seed=settings.seed,
                parameters=settings.parameters,
                step=work.doing,
            )
            model = found.model
            notes.append(found.summary())
        else:
            model = fit(unfitted or unfitted_model(settings), train_runs, work)
        others: dict[str, DriftModel] = {}
        if settings.from_diagnosis is not None:
            from fogml.cli.from_diagnosis import not_compensated, read_compensation
            from fogml.models.auto import AutoModel

            notes += not_compensated(read_compensation(settings.from_diagnosis), settings.causes)
            work.doing("fitting auto beside it")
            others["auto"] = fit(AutoModel(seed=settings.seed), train_runs, work)
        work.doing("judging")
        judging = partial(
            judge,
            train_runs=train_runs,
            test_runs=test_runs,
            averaging_s=settings.averaging,
            turn_on_band=settings.turn_on_band,
            any_unit=settings.any_unit,
            noise=noise,
        )
        judgement = judging(
            model,
            design_index=settings.design_index,
            limits=settings.limits,
            beside=list(others.values()),
            notes=notes,
        )
        beside = {name: judging(other, beside=[model]).test for name, other in others.items()}
        judgement = replace(judgement, beside=beside)
        asked = getattr(unfitted, "features", settings.features) or ""
        if "lag(" not in asked and (lag := lag_note(train_runs, test_runs)) is not None:
            judgement = replace(judgement, notes=(*judgement.notes, lag))
    if settings.strict:
        hold_strict([(run.run, run.findings) for run in judgement.test])
    return model, judgement


def fit(model: DriftModel, runs: list[Run], work: Work) -> DriftModel:
    """Fit a model; one that tries several things says how far it is."""
    if "progress" not in model.get_params(deep=False):
        return model.fit(runs)
    model.set_params(progress=lambda done, total, name: work.reached(done, total, f"tried {name}"))
    fitted = model.fit(runs)
    fitted.set_params(progress=None)
    return fitted


def write_results(
    folder: Path,
    settings: TrainSettings,
    model: DriftModel,
    judgement: Judgement,
    terminal: Terminal,
    *,
    again: bool = True,
) -> None:
    """Write model, report, pages, spreadsheet into a folder; settings, too, if they make it again."""
    from fogml.export.documentation import documentation_or_none
    from fogml.models.saved import save_model
    from fogml.report.certificate import certificate
    from fogml.report.spreadsheet import spreadsheet
    from fogml.report.train_page import train_page

    with terminal.work("writing"):
        save_model(model, folder / "model")
        report = _report(settings, judgement)
        write_json(folder / "report.json", report)
        page = train_page(judgement, report.get("navigation"), documentation_or_none(model))
        (folder / "report.html").write_text(page, encoding="utf-8")
        spreadsheet(judgement, folder / "report.xlsx")
        if judgement.limits or judgement.design_index:
            (folder / "certificate.html").write_text(certificate(judgement), encoding="utf-8")
        if again:
            settings.write_into(folder, "train")


def _report(settings: TrainSettings, judgement: Judgement) -> dict[str, Any]:
    """The values of ``report.json``, with the cost in navigation where it is asked for."""
    values = judgement_json(judgement)
    if settings.navigation is not None:
        from fogml.lab.navigation import navigation_costs

        values["navigation"] = finite_json(navigation_costs(judgement, settings.navigation))
    return values


def floor_words(run: RunJudgement) -> str:
    """A run's floor with its interval."""
    told = number(run.floor)
    if run.floor_ci90 is None:
        return told
    low, high = run.floor_ci90
    return f"{told} ({number(low)} to {number(high)})"


def print_judgement(judgement: Judgement, terminal: Terminal) -> None:
    """The figures of the test runs as a table, then limits and notes."""
    from fogml.report.tables import beside_table, metrics_table, repeatability_table
    from fogml.report.verdict import own_noise_by, unsettled, worst_run

    synthetic = any(run.facts.synthetic for run in (*judgement.train, *judgement.test))
    for run in judgement.test:
        told = f"{judgement.model['kind']} on {run.run}, not trained on{' (synthetic data)' * synthetic}"
        terminal.say(f"{told}; noise floor {floor_words(run)} deg/h")
        terminal.show(metrics_table(run))
    if judgement.beside:
        from fogml.validation.advice import which_to_use

        terminal.show(beside_table(judgement), "Beside other models")
        terminal.say(which_to_use(judgement)[1])
    terminal.say(own_noise_by(worst_run(judgement.test)))
    for run in judgement.test:
        _say_stability(run, terminal)
        if run.outside_training:
            terminal.say(f"{run.run}: {percent(run.outside_training)} of the samples outside training")
        if told := unsettled(run):
            terminal.say(f"{run.run}: {told}")
    terminal.show(repeatability_table(judgement.repeatability))
    index = [judgement.design_index] if judgement.design_index is not None else []
    for outcome in (*index, *judgement.limits):
        verdict = "met" if outcome.met else "NOT met"
        name = "design index (rms)" if outcome is judgement.design_index else outcome.quantity
        reached = against(outcome.value, outcome.limit)
        terminal.say(f"{name}: {reached}, limit {stated(outcome.limit)}: {verdict}")
    for note in judgement.notes:
        terminal.say(note)
    say_advice(judgement, terminal)


def say_advice(judgement: Judgement, terminal: Terminal, lead: str = "") -> None:
    """The verdict, its reasons and what to do next."""
    from fogml.report.verdict import advice_words
    from fogml.validation.advice import advice_on

    told = advice_words(advice_on(judgement))
    terminal.say(f"{lead}{told['sign']} {told['words']}")
    for reason in told["reasons"]:
        terminal.say(f"  - {reason}")
    terminal.say(f"  Next: {told['next_step']}")


def _say_stability(run: RunJudgement, terminal: Terminal) -> None:
    """Bias stability over and at constant temperature, over n - 1, with 90 % intervals."""
    told = []
    for what, found in (
        ("over temperature", over_temperature(run)),
        ("at constant temperature", held_constant(run)),
        ("of 10 s averages", of_10_s(run)),
    ):
        if found is not None:
            low, high = (number(end) for end in found.ci90)
            told.append(f"{number(found.value)} ({low} to {high}) {what}")
    if told:
        terminal.say(f"{run.run}: Bias stability after, over n - 1: {'; '.join(told)} [deg/h]")
