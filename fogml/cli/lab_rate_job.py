"""The job of ``fogml lab rate``."""

from __future__ import annotations

from typing import Any

from fogml.cli.lab import RateSettings
from fogml.cli.lab_outputs import say_where, tell
from fogml.cli.runs import open_run
from fogml.cli.terminal import Terminal, number
from fogml.errors import InputError
from fogml.json_files import finite_json
from fogml.lab.rate_json import rate_json
from fogml.lab.rate_tests import Criteria
from fogml.lab.rate_words import result_rows


def rate_and_write(settings: RateSettings, terminal: Terminal) -> None:
    """Read the tests on a rate table, write them where a folder is named, and print them."""
    if bool(settings.runs) == bool(settings.twin):
        raise InputError("give recorded runs, or --twin to test a twin; one of the two")

    def make() -> dict[str, Any]:
        return finite_json(_values(settings, terminal))

    def page(values: dict[str, Any]) -> str:
        from fogml.report.rate_page import rate_page

        return rate_page(values)

    values = tell("rate", make, page, settings.in_full(), settings.out, terminal)
    _print(values, terminal)
    terminal.result(values)
    say_where("rate", settings.out, terminal)


def _values(settings: RateSettings, terminal: Terminal) -> dict[str, Any]:
    criteria = Criteria(
        answers=settings.answers,
        dead=settings.dead,
        range_error=settings.range_error,
        small=settings.small,
    )
    if settings.twin is None:
        with terminal.work("reading"):
            runs = [open_run(path, repair=settings.repair) for path in settings.runs]
        source = ", ".join(run.name for run in runs)
        return rate_json(runs, source=source, settle_s=settings.settle, criteria=criteria)
    from fogml.lab.rate_programmes import rate_runs
    from fogml.twin.twin_file import load_twin

    twin = load_twin(settings.twin)
    with terminal.work(f"testing {twin.name}"):
        runs = rate_runs(twin, greatest_deg_s=settings.greatest, noise=settings.noise, seed=settings.seed)
        return rate_json(
            runs, source=f"Twin {twin.name}", settle_s=settings.settle, criteria=criteria, twin=twin
        )


def _print(values: dict[str, Any], terminal: Terminal) -> None:
    rows = [[row.quantity, row.value, row.se, row.unit, row.remark] for row in result_rows(values, number)]
    title = f"{values['source']}: tests on a rate table" + (
        " (synthetic data)" if values["synthetic"] else ""
    )
    terminal.table(title, ["quantity", "value", "standard error", "unit", "remark"], rows)
    for note in values["notes"]:
        terminal.say(note)
