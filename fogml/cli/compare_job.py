"""The job of ``fogml compare``."""

from __future__ import annotations

from functools import partial
from pathlib import Path

from fogml.cli.model_commands import CompareSettings
from fogml.cli.runs import Check, no_check
from fogml.cli.terminal import Terminal
from fogml.cli.train_job import check_settings, noise_run, split_runs
from fogml.errors import InputError
from fogml.json_files import write_json
from fogml.outputs import whole_folder
from fogml.validation.compare import Comparison, compare
from fogml.validation.limits import hold_strict
from fogml.validation.report_json import comparison_json

_OWN_CHOICE = ("auto", "polynomial", "rbf")


def compare_and_write(settings: CompareSettings, terminal: Terminal, check: Check = no_check) -> bool:
    """Fit and judge every model, write the results, print them; whether some model meets the limits.

    `check` is called with the runs before a model is fitted.
    """
    check_settings(settings)
    makers = _makers(settings)
    with whole_folder(settings.out) as folder:
        comparison = _compare(settings, makers, terminal, check)
        values = comparison_json(comparison)
        write_json(folder / "compare.json", values)
        with terminal.work("drawing"):
            from fogml.report.compare_page import compare_page

            page = compare_page(comparison.judgements, comparison.failed)
        (folder / "compare.html").write_text(page, encoding="utf-8")
        settings.write_into(folder, "compare")
    _print(comparison, terminal)
    terminal.result(values)
    terminal.say(f"Written to {settings.out}: open {Path(settings.out) / 'compare.html'}")
    return any(judgement.met for judgement in comparison.judgements.values())


def _makers(settings: CompareSettings) -> dict[str, partial]:
    """Name to the maker of each model; an unknown name is an error before any run is read."""
    from fogml.models.names import MODEL_NAMES, make_model, model_names

    names: list[str] = []
    for name in settings.models:
        names += model_names() if name == "all" else [name]
    makers = {}
    for name in names:
        # Models of a document's own form keep their columns; features are for the others.
        chosen = name in _OWN_CHOICE or name not in MODEL_NAMES
        features = settings.features if chosen else None
        makers[name] = partial(make_model, name, features, settings.seed)
        makers[name]()
    return makers


def _compare(
    settings: CompareSettings, makers: dict[str, partial], terminal: Terminal, check: Check
) -> Comparison:
    if settings.leave_one_out == bool(settings.test):
        raise InputError("give test runs after --test, or --leave-one-out without --test")
    train_runs, test_runs = split_runs(settings, terminal)
    check((*train_runs, *test_runs))
    noise = noise_run(settings, terminal, train_runs)
    fits = len(makers) * (1 if test_runs else len(train_runs) + 1)
    with terminal.work("comparing", total=fits) as work:
        begun: list[str] = []

        def step(name: str) -> None:
            work.advance(1.0 if begun else 0.0, f"fitting {name}")
            begun.append(name)

        comparison = compare(
            makers,
            train_runs,
            test_runs or None,
            averaging_s=settings.averaging,
            design_index=settings.design_index,
            limits=settings.limits,
            turn_on_band=settings.turn_on_band,
            any_unit=settings.any_unit,
            noise=noise,
            step=step,
        )
    if settings.strict:
        for judgement in comparison.judgements.values():
            hold_strict([(run.run, run.findings) for run in judgement.test])
    return comparison


def _print(comparison: Comparison, terminal: Terminal) -> None:
    from fogml.report.compare_page import doubts_of, models_table, ranked
    from fogml.report.verdict import own_noise_by, worst_run

    order = ranked(comparison.judgements)
    best = order[0]
    terminal.show(models_table(comparison.judgements, order))
    for text in doubts_of(comparison.judgements[best]):
        terminal.say(text)
    terminal.say(f"{best} leaves least. {own_noise_by(worst_run(comparison.judgements[best].test))}")
    for name, reason in comparison.failed.items():
        terminal.say(f"{name}: not fitted: {reason}")
