"""The job of ``fogml import``."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from tempfile import TemporaryDirectory

from fogml.cli.run_commands import ImportSettings
from fogml.cli.runs import most_dropped
from fogml.cli.terminal import Terminal, span
from fogml.errors import InputError
from fogml.outputs import whole_file, whole_folder
from fogml.runs.columns import header

_FIRST_ROWS = 5


def import_and_write(settings: ImportSettings, terminal: Terminal) -> None:
    """Import, write the runs into ``settings.out``, and say what was written."""
    from fogml.runs.profiles import import_recording, profile_names
    from fogml.runs.writing import check_side_file, write_run

    if not settings.file:
        raise InputError("no file is given; name the logger's file")
    if settings.draft:
        _draft(settings, terminal)
        return
    if not settings.profile:
        raise InputError(
            f"no --profile is given; those that ship are {', '.join(profile_names())}, and "
            f"'fogml import {Path(settings.file).name} --draft -o profile.yaml' writes a first one"
        )
    if not settings.out:
        raise InputError("no --out is given; name the folder for the runs")
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
    rows = [[run.name, str(len(run)), span(run.span_s)] for run in runs]
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
    with TemporaryDirectory(prefix="fogml-draft-") as folder:
        draft = Path(folder) / "profile.yaml"
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
        terminal.say(f"fogml import {path.name} --profile {Path(settings.out).name} -o FOLDER")
    else:
        terminal.say(text.rstrip())
    for run in runs:
        first = run[:_FIRST_ROWS]
        rows = [[f"{values[i]:.9g}" for values in first.columns.values()] for i in range(len(first))]
        terminal.table(f"{run.name}: the first rows", [header(name) for name in run.columns], rows)
        shown.append({"run": run.name, "rows": len(run), "span_s": run.span_s})
    terminal.result({"schema": "fogml.import/1", "profile": text, "runs": shown})


def _check_apart(file: str, out: str, names: Sequence[str]) -> None:
    """Refuse to write a run, with its side file, over the recording that it comes from."""
    recording = Path(file).resolve()
    if Path(out).resolve() == recording.parent and recording.stem in names:
        raise InputError(
            f"--out {out} is the recording's own folder, and '{recording.stem}.csv' with its side file would "
            "replace what is there; choose another --out"
        )
