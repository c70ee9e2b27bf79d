"""Opening the runs that a command names, and what it does with the values that it tells."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import Any

from fogml.cli.given import load
from fogml.cli.options import Repairing
from fogml.cli.settings import SHIPPED, Settings
from fogml.cli.terminal import Terminal
from fogml.errors import InputError
from fogml.json_files import finite_json, write_json
from fogml.outputs import whole_folder
from fogml.runs.findings import DEAD, FIRST_OF_ALL
from fogml.runs.run import Run


def shipped_places() -> list[str]:
    """The shipped runs as a command names them."""
    from fogml.runs.shipped import shipped_names

    return [SHIPPED + name for name in shipped_names()]


def open_run(path: str, *, repair: Repairing = False, axis: str | None = None) -> Run:
    """The run in a file, or ``shipped:NAME``, checked: what is noticed is in its findings."""
    from fogml.runs.reading import read_run
    from fogml.runs.shipped import shipped_run
    from fogml.runs.three_axes import OneAxis

    if not path.startswith(SHIPPED):
        return read_run(path, repair=bool(repair), axis=axis, most_dropped=most_dropped(repair))
    return OneAxis(axis).run(shipped_run(path.removeprefix(SHIPPED)))


def open_legs(path: str, *, repair: Repairing = False, axis: str | None = None) -> list[Run]:
    """The runs in a file, or ``shipped:NAME``: several where its clock restarts and it is repaired."""
    from fogml.runs.reading import read_runs

    if path.startswith(SHIPPED):
        return [open_run(path, axis=axis)]
    return read_runs(path, repair=bool(repair), axis=axis, most_dropped=most_dropped(repair))


def open_blocks(path: str, *, repair: Repairing = False, axis: str | None = None) -> Iterable[Run]:
    """The run in a file in blocks of bounded size, or ``shipped:NAME`` whole."""
    from fogml.runs.reading import read_blocks

    if path.startswith(SHIPPED):
        return [open_run(path, axis=axis)]
    return read_blocks(path, repair=bool(repair), axis=axis, most_dropped=most_dropped(repair))


def most_dropped(repair: Repairing) -> float:
    """Share of the rows that the setting ``repair`` lets go."""
    from fogml.runs.assemble import MOST_DROPPED

    return 1.0 if repair == "anyway" else MOST_DROPPED


def check_named_once(paths: Sequence[str]) -> None:
    """Hold that no run is named twice."""
    twice = sorted({path for path in paths if list(paths).count(path) > 1})
    if twice:
        raise InputError(f"{', '.join(twice)}: named more than once; give each run once")


def open_runs(
    paths: Sequence[str], terminal: Terminal, *, repair: Repairing = False, axis: str | None = None
) -> list[Run]:
    """The runs in several files; findings are noted on stderr.

    Raises
    ------
    InputError
        If a file is named twice.
    """
    check_named_once(paths)
    runs: list[Run] = []
    with terminal.work("reading", total=len(paths)) as work:
        for path in paths:
            work.doing(f"reading {path}")
            runs += open_legs(path, repair=repair, axis=axis)
            work.advance()
    noticed = [(run.name, finding) for run in runs for finding in run.findings]
    for name, finding in sorted(noticed, key=lambda one: one[1].code not in FIRST_OF_ALL):
        terminal.note(f"{name}: {finding.message}")
    return runs


def note_wrong(first: Run, terminal: Terminal) -> None:
    """Note on stderr what makes every figure wrong, by the first block of a run that is read in blocks.

    That an output has one value is told of the whole run, where its blocks are used.
    """
    from fogml.runs.checks import check_run

    for finding in check_run(first):
        if finding.code in FIRST_OF_ALL and finding.code != DEAD:
            terminal.note(f"{first.name}: {finding.message}")


Values = dict[str, Any]


def tell(
    command: str,
    settings: Settings,
    terminal: Terminal,
    make: Callable[[], Values],
    page: str | Callable[[Values], str],
    show: Callable[[Values, Terminal], None],
    beside: Callable[[Values, Path], None] | None = None,
) -> Values:
    """Make values, write them as file and page with the settings where a folder is named, and print them.

    Parameters
    ----------
    command
        Its last word names ``NAME.json`` and ``NAME.html``.
    settings
        Its settings, with ``out``.
    terminal
        Where to print.
    make
        Gives the values.
    page
        What draws the page of the values, or where it is, ``module:name``.
    show
        Prints the values for people.
    beside
        Writes further files of the values into the folder.
    """
    name, out = command.split()[-1], settings.out  # type: ignore[attr-defined]
    if out is None:
        values = finite_json(make())
    else:
        with whole_folder(out) as folder:
            values = finite_json(make())
            write_json(folder / f"{name}.json", values)
            with terminal.work("drawing"):
                text = (load(page) if isinstance(page, str) else page)(values)
                (folder / f"{name}.html").write_text(text, encoding="utf-8")
            if beside is not None:
                beside(values, folder)
            settings.write_into(folder, command)
    show(values, terminal)
    terminal.result(values)
    if out is not None:
        terminal.say(f"Written to {out}: open {Path(out) / f'{name}.html'}")
    return values
