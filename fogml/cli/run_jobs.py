"""The jobs of ``fogml import``, ``inspect`` and ``noise``."""

from __future__ import annotations

import shlex
from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import Any

from fogml.cli.run_commands import ImportSettings, InspectSettings, NoiseSettings
from fogml.cli.runs import most_dropped, open_each, open_runs, tell
from fogml.cli.terminal import Terminal
from fogml.errors import InputError
from fogml.numerals import duration, number, percent
from fogml.outputs import scratch_folder, whole_file, whole_folder
from fogml.readers import plain_path
from fogml.runs.columns import header
from fogml.runs.findings import FIRST_OF_ALL
from fogml.runs.noise_of_run import moving_temperatures, noise_report
from fogml.runs.run import Run
from fogml.validation.floors import floors_over, settling_warning
from fogml.validation.inspection import STATISTICS, column_statistics, inspection_json
from fogml.validation.limits import hold_strict

_FIRST_ROWS = 5


def import_and_write(settings: ImportSettings, terminal: Terminal) -> None:
    """Import, write the runs into ``settings.out``, and say what was written."""
    from fogml.runs.profiles import import_recording
    from fogml.runs.writing import check_side_file, write_run

    assert settings.file
    if settings.draft:
        _draft(settings, terminal)
        return
    assert settings.profile
    assert settings.out
    written = []
    with whole_folder(settings.out, shared=True) as folder:
        with terminal.work(f"reading {settings.file}") as work:
            runs = import_recording(
                settings.file,
                settings.profile,
                settings.axis,
                repair=bool(settings.repair),
                most_dropped=most_dropped(settings.repair),
            )
            _check_apart(settings.file, settings.out, [run.name for run in runs])
            for run in runs:
                work.doing(f"writing {run.name}")
                check_side_file(Path(settings.out) / f"{run.name}.csv", run.facts)
                write_run(run, folder / f"{run.name}.csv")
        for run in runs:
            for finding in run.findings:
                terminal.note(f"{run.name}: {finding.message}")
            written.append(
                {
                    "run": f"{run.name}.csv",
                    "rows": len(run),
                    "span_s": run.span_s,
                    "facts": run.facts.as_dict(),
                    "findings": [finding.as_dict() for finding in run.findings],
                }
            )
        settings.write_into(folder, "import")
    rows = [[run.name, str(len(run)), duration(run.span_s)] for run in runs]
    terminal.table(f"Written to {settings.out}", ["run", "rows", "span"], rows)
    terminal.result({"schema": "fogml.import/1", "runs": written})


def _draft(settings: ImportSettings, terminal: Terminal) -> None:
    """Write or print a profile with guesses, and show the first rows that it reads."""
    from fogml.runs.profile_draft import draft_profile
    from fogml.runs.profiles import import_recording

    assert settings.file is not None
    path = Path(settings.file)
    text = draft_profile(path)
    shown: list[dict[str, object]] = []
    with scratch_folder() as folder:
        draft = folder / "profile.yaml"
        draft.write_text(text, encoding="utf-8")
        try:
            runs = import_recording(path, draft)
        except InputError as error:
            runs = []
            terminal.note(f"the draft does not read the file yet: {error}")
    if settings.out:
        with whole_file(settings.out) as file:
            file.write_text(text, encoding="utf-8")
        terminal.say(f"Written to {settings.out}; correct what it calls a guess, then")
        terminal.say(shlex.join(["fogml", "import", str(path), "--profile", settings.out, "-o", "FOLDER"]))
    else:
        terminal.say(text.rstrip())
    for run in runs:
        first = run[:_FIRST_ROWS]
        rows = [[f"{values[i]:.9g}" for values in first.columns.values()] for i in range(len(first))]
        heads = [header(name, run.gyro_unit if name == "gyro" else None) for name in run.columns]
        terminal.table(f"{run.name}: the first rows", heads, rows)
        shown.append({"run": run.name, "rows": len(run), "span_s": run.span_s})
    terminal.result({"schema": "fogml.import/1", "profile": text, "runs": shown})


def _check_apart(file: str, out: str, names: Sequence[str]) -> None:
    """Refuse to write a run, with its side file, over the recording that it comes from."""
    recording = plain_path(Path(file).resolve())
    if Path(out).resolve() == recording.parent and recording.stem in names:
        raise InputError(
            f"--out {out} is the recording's own folder, and '{recording.stem}.csv' with its side file would "
            "replace what is there; choose another --out"
        )


def inspect_and_write(settings: InspectSettings, terminal: Terminal) -> None:
    """Look into the runs, write what was found where an output folder is named, and print it."""
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

    tell("inspect", settings, terminal, make, page, _print_inspection)


def _print_inspection(values: dict[str, Any], terminal: Terminal) -> None:
    for run in values["runs"]:
        _print_run(run, terminal)


def _print_run(run: dict[str, Any], terminal: Terminal) -> None:
    first = [finding for finding in run["findings"] if finding["code"] in FIRST_OF_ALL]
    for finding in first:
        terminal.say(f"{run['run']}: {finding['code'].replace('_', ' ')}: {finding['message']}")
    rows = [[column["name"], column["unit"] or "–", *column_statistics(column)] for column in run["columns"]]
    title = f"{run['run']}: {run['rows']} rows, {duration(run['span_s'])}, one in {duration(run['sample_s'])}"
    terminal.table(title, ["column", "unit", *(key.replace("_", " ") for key in STATISTICS)], rows)
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
    # Without temperatures no stay is known to be a soak.
    stay = "soak" if run["temperatures"] else "at rest"
    spent = [
        f"{stay if name == 'soak' else name.replace('_', ' ')} {duration(time)}"
        for name, time in run["regimes"]["seconds"].items()
        if time
    ]
    terminal.say("regimes: " + ", ".join(spent))
    for finding in run["findings"][len(first) :]:
        terminal.say(f"{finding['code'].replace('_', ' ')}: {finding['message']}")


def noise_and_write(settings: NoiseSettings, terminal: Terminal) -> None:
    """Tell the noise of a run, write it where an output folder is named, and print it."""
    assert settings.run
    if settings.to is not None:
        from fogml.export.noise_parameters import check_target

        check_target(settings.to)

    def beside(values: dict[str, Any], folder: Path) -> None:
        for name, text in _for_others(settings, values):
            (folder / name).write_text(text, encoding="utf-8")

    def show(values: dict[str, Any], terminal: Terminal) -> None:
        _print_noise(values, terminal)
        for name, text in _for_others(settings, values):
            terminal.say(f"{name}:\n{text}")

    make = partial(_noise, settings, terminal)
    tell("noise", settings, terminal, make, "fogml.report.noise_page:noise_page", show, beside)


def _for_others(settings: NoiseSettings, values: dict[str, Any]) -> list[tuple[str, str]]:
    """File name and text for the program that is asked for, if any is."""
    from fogml.export.noise_parameters import noise_text

    return [] if settings.to is None else [noise_text(values, settings.to)]


def _noise(settings: NoiseSettings, terminal: Terminal) -> dict[str, Any]:
    paths = [settings.run] if isinstance(settings.run, str) else list(settings.run or ())
    with terminal.work(f"reading {paths[0]}") as work:
        runs = open_each(paths, repair=settings.repair, axis=settings.axis, doing=work.doing)
        work.doing("averaging")
        values = noise_report(runs, overlapping=settings.overlapping)
        told = [
            w for run in runs if not moving_temperatures(run) and (w := settling_warning(run)) is not None
        ]
        values["warnings"] += told
        values["notes"] += [warning["message"] for warning in told]
        if len(runs) == 1:
            values["floor"] = _floor(runs[0], values["taus_s"])
        return values


def _floor(run: Run, taus_s: Sequence[float]) -> dict[str, Any] | None:
    """The noise floor as drift models are held against, from their usual averaging time on."""
    from fogml.signals.averages import AVERAGING_S

    longest = 0.5 * run.span_s
    times = [AVERAGING_S, *(tau for tau in taus_s if AVERAGING_S < tau <= longest)]
    found = floors_over(run, AVERAGING_S, times)
    if not found:
        return None
    return {
        "averaging_s": times,
        "value": [floor.value for floor in found],
        "ci": [[floor.lower, floor.upper] for floor in found],
        "unit": "deg/h",
        "source": found[0].source,
    }


def _print_noise(values: dict[str, Any], terminal: Terminal) -> None:
    from fogml.report.noise_page import deviations_table, headline_tiles, replicates_table, terms_table

    kind = "overlapping" if values["overlapping"] else "not overlapping"
    level = percent(values["level"], 0)
    terminal.show(deviations_table(values), f"{values['run']}: Allan deviation, {kind}, {level} intervals")
    terminal.show(terms_table(values), "IEEE 952 terms")
    terminal.show(replicates_table(values))
    terminal.tiles(headline_tiles(values))
    for text in (*values["notes"], *(finding["message"] for finding in values["findings"])):
        terminal.say(text)
