"""The jobs of ``fogml lab acceptance`` and ``fogml lab batch``."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

from fogml.cli.lab import AcceptanceSettings, BatchSettings
from fogml.cli.runs import Check, no_check, open_noise, open_runs, tell
from fogml.cli.terminal import Terminal

if TYPE_CHECKING:
    from fogml.models.base import DriftModel


def acceptance_and_write(settings: AcceptanceSettings, terminal: Terminal) -> bool:
    """Test a gyro's runs, write the report where a folder is named, print it; whether all limits are met."""
    from fogml.lab.acceptance import ACCEPTED, NO_LIMITS
    from fogml.models.saved import load_model

    values = write_report(
        settings, terminal, lambda: None if settings.model is None else load_model(settings.model)
    )
    return values["verdict"] in (ACCEPTED, NO_LIMITS)


def write_report(
    settings: AcceptanceSettings,
    terminal: Terminal,
    model_of: Callable[[], DriftModel | None],
    check: Check = no_check,
) -> dict[str, Any]:
    """The report of the runs that are named, written where a folder is named, and printed.

    Parameters
    ----------
    settings, terminal
        As of the command.
    model_of
        Gives the drift model that the unit is used with, once limits are read.
    check
        Called with the runs before they are tested.
    """
    from fogml.lab.acceptance import acceptance_json
    from fogml.lab.acceptance_rows import read_limits

    def make() -> dict[str, Any]:
        limits = None if settings.limits is None else read_limits(settings.limits)
        # Runs of three gyros are told by reading them, before one model is looked for.
        runs = open_runs(settings.runs, terminal, repair=settings.repair, axis=settings.axis)
        model = model_of()
        check(runs)
        noise = open_noise(settings.noise, terminal, runs, repair=settings.repair, axis=settings.axis)
        with terminal.work("testing"):
            return acceptance_json(
                runs,
                model,
                limits,
                averaging_s=settings.averaging,
                turn_on_band=settings.turn_on_band,
                noise=noise,
                date=settings.date,
            )

    def sheets(values: dict[str, Any], folder: Path) -> None:
        from fogml.report.spreadsheets import acceptance_spreadsheet

        acceptance_spreadsheet(values, folder / "acceptance.xlsx")

    page = "fogml.report.acceptance_page:acceptance_page"
    return tell("lab acceptance", settings, terminal, make, page, _print, sheets)


def _print(values: dict[str, Any], terminal: Terminal) -> None:
    from fogml.report.acceptance_page import VERDICTS, figure_words, limit_words, named

    rows = []
    for row in values["rows"]:
        if row["tested"]:
            met = {True: "met", False: "NOT met", None: ""}[row["met"]]
            figures = [figure_words(row, "before"), figure_words(row, "after")]
            rows.append([row["name"], *figures, row["unit"], limit_words(row["limit"]), met])
    terminal.table(
        f"{named(values)}: acceptance", ["quantity", "before", "after", "unit", "limit", "outcome"], rows
    )
    lacking = [row["name"] for row in values["rows"] if not row["tested"]]
    if lacking:
        terminal.say(f"Not tested: {', '.join(lacking)}")
    _, sign, words = VERDICTS[values["verdict"]]
    terminal.say(f"{sign} {words}: {'; '.join(values['reasons'])}")


def batch_and_write(settings: BatchSettings, terminal: Terminal) -> bool:
    """Gather reports, write the batch where a folder is named, print it; whether all are accepted."""
    from fogml.lab.acceptance import ACCEPTED
    from fogml.lab.batch import batch_json, read_reports

    def make() -> dict[str, Any]:
        home = None if settings.out is None else Path(settings.out)
        return batch_json(read_reports(settings.reports), home)

    def page(values: dict[str, Any]) -> str:
        from fogml.report.acceptance_page import batch_page

        return batch_page(values, settings.title)

    def sheets(values: dict[str, Any], folder: Path) -> None:
        from fogml.report.spreadsheets import batch_spreadsheet

        batch_spreadsheet(values, folder / "batch.xlsx")

    values = tell("lab batch", settings, terminal, make, page, _print_batch, sheets)
    return values["counts"][ACCEPTED] == len(values["units"])


def _print_batch(values: dict[str, Any], terminal: Terminal) -> None:
    from fogml.report.acceptance_page import distribution_table, verdict_sentences

    terminal.show(distribution_table(values))
    for sentence in verdict_sentences(values):
        terminal.say(sentence)
