"""The job of ``fogml lab batch``."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from fogml.cli.lab import BatchSettings
from fogml.cli.lab_outputs import say_where, tell
from fogml.cli.terminal import Terminal, number
from fogml.errors import InputError


def batch_and_write(settings: BatchSettings, terminal: Terminal) -> bool:
    """Gather reports, write the batch where a folder is named, print it; whether all are accepted."""
    from fogml.lab.acceptance import ACCEPTED
    from fogml.lab.batch import batch_json, read_reports

    if not settings.reports:
        raise InputError("no report is given; name files acceptance.json, or the folders that hold them")

    def make() -> dict[str, Any]:
        home = None if settings.out is None else Path(settings.out)
        return batch_json(read_reports(settings.reports), home)

    def page(values: dict[str, Any]) -> str:
        from fogml.report.acceptance_page import batch_page

        return batch_page(values, settings.title)

    def sheets(values: dict[str, Any], path: Path) -> None:
        from fogml.report.spreadsheets import batch_spreadsheet

        batch_spreadsheet(values, path)

    values = tell("batch", make, page, settings, settings.out, terminal, sheets)
    _print(values, terminal)
    terminal.result(values)
    say_where("batch", settings.out, terminal)
    return values["counts"][ACCEPTED] == len(values["units"])


def _print(values: dict[str, Any], terminal: Terminal) -> None:
    from fogml.report.acceptance_page import limit_words, verdict_sentences

    rows = [
        [
            one["name"],
            str(one["tested"]),
            *(number(one["distribution"][part]) for part in ("median", "largest")),
            one["unit"],
            limit_words(one["limit"]),
            str(one["over"]),
        ]
        for one in values["quantities"]
    ]
    heads = ["quantity", "units", "median", "largest", "unit", "limit", "over"]
    terminal.table("Acceptance of a batch", heads, rows)
    for sentence in verdict_sentences(values):
        terminal.say(sentence)
