"""The job of ``fogml inspect``."""

from __future__ import annotations

from typing import Any

from fogml.cli.results import tell
from fogml.cli.run_commands import InspectSettings
from fogml.cli.runs import open_runs
from fogml.cli.terminal import Terminal, number
from fogml.errors import InputError
from fogml.report.words import duration
from fogml.runs.findings import FIRST_OF_ALL
from fogml.runs.run import Run
from fogml.validation.inspection import inspection_json
from fogml.validation.limits import hold_strict


def inspect_and_write(settings: InspectSettings, terminal: Terminal) -> None:
    """Look into the runs, write what was found where an output folder is named, and print it."""
    if not settings.runs:
        raise InputError("no run is given; name at least one")
    runs: list[Run] = []

    def make() -> dict[str, Any]:
        # Findings are part of the result here, so they are not noted on stderr as well.
        runs.extend(
            open_runs(settings.runs, Terminal(quiet=True), repair=settings.repair, axis=settings.axis)
        )
        if settings.strict:
            hold_strict([(run.name, run.findings) for run in runs])
        with terminal.work("looking into the runs"):
            return inspection_json(runs)

    def page(values: dict[str, Any]) -> str:
        from fogml.report.inspect_page import inspect_page

        return inspect_page(runs, values)

    tell("inspect", settings, terminal, make, page, _print)


def _print(values: dict[str, Any], terminal: Terminal) -> None:
    for run in values["runs"]:
        _print_run(run, terminal)


def _print_run(run: dict[str, Any], terminal: Terminal) -> None:
    first = [finding for finding in run["findings"] if finding["code"] in FIRST_OF_ALL]
    for finding in first:
        terminal.say(f"{run['run']}: {finding['code'].replace('_', ' ')}: {finding['message']}")
    rows = [
        [column["name"], column["unit"] or "–", *(number(column[key]) for key in _STATISTICS)]
        for column in run["columns"]
    ]
    title = f"{run['run']}: {run['rows']} rows, {duration(run['span_s'])}, one in {duration(run['sample_s'])}"
    terminal.table(title, ["column", "unit", *(key.replace("_", " ") for key in _STATISTICS)], rows)
    if run["earth_rate_deg_h"] is not None:
        terminal.say(f"Earth rate along the input axis: {number(run['earth_rate_deg_h'])} deg/h")
    else:
        terminal.say("Earth rate along the input axis: not known (state latitude and input_axis)")
    for name, found in run["temperatures"].items():
        terminal.say(
            f"{name}: span {number(found['span'])} degC, fastest rise {number(found['fastest_rise'])}, "
            f"fastest fall {number(found['fastest_fall'])} degC/min"
        )
    gaps = run["gaps"]
    if gaps["count"]:
        terminal.say(
            f"gaps: {gaps['count']}, the longest {duration(gaps['longest_s'])}, {gaps['stretches']} stretches"
        )
    spent = [
        f"{name.replace('_', ' ')} {duration(time)}"
        for name, time in run["regimes"]["seconds"].items()
        if time
    ]
    terminal.say("regimes: " + ", ".join(spent))
    for finding in run["findings"][len(first) :]:
        terminal.say(f"{finding['code'].replace('_', ' ')}: {finding['message']}")


_STATISTICS = ("least", "greatest", "mean", "standard_deviation")
