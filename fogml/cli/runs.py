"""Opening the runs that a command names, and what it does with the values that it tells."""

from __future__ import annotations

import os
import warnings
from collections import Counter, defaultdict
from collections.abc import Callable, Iterable, Sequence
from itertools import count
from pathlib import Path
from typing import TYPE_CHECKING, Any

from fogml.cli.given import load
from fogml.cli.options import Repairing
from fogml.cli.settings import SHIPPED, Settings
from fogml.cli.terminal import Terminal
from fogml.errors import InputError, listed
from fogml.json_files import finite_json, write_json
from fogml.outputs import whole_folder
from fogml.runs.findings import DEAD, FIRST_OF_ALL, Finding, beside_drift, first_of_all
from fogml.runs.names import renamed
from fogml.runs.run import Run

if TYPE_CHECKING:
    from fogml.models.base import DriftModel

Check = Callable[[Sequence[Run]], None]
"""Refuses runs that are not those a job is meant to have."""


def no_check(runs: Sequence[Run]) -> None:
    """A check that every run passes."""


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


def open_model(folder: str | Path, terminal: Terminal) -> DriftModel:
    """The saved model of a folder; what a user of it is warned of is a line on stderr."""
    from fogml.models.saved import load_model

    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("always", UserWarning)
        model = load_model(folder)
    for each in told:
        terminal.note(str(each.message))
    return model


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
    """Hold that no run is named twice, however its path is written."""
    named = Counter(map(os.path.abspath, paths))
    twice = dict.fromkeys(path for path in paths if named[os.path.abspath(path)] > 1)
    if twice:
        raise InputError(f"{', '.join(twice)}: named more than once; give each run once")


def folders_apart(paths: Sequence[str]) -> dict[str, str]:
    """Of each path the folders that tell it from other files of its name, as ``cold/``; empty where none are.

    Figures of runs are told by the runs' names, so that two of one name would be taken for each other.
    """
    by_name: dict[str, dict[str, tuple[str, ...]]] = defaultdict(dict)
    for path in paths:
        by_name[Path(path).name][path] = Path(os.path.abspath(path)).parts
    found = dict.fromkeys(paths, "")
    for parts in by_name.values():
        files = set(parts.values())
        depth = next(deep for deep in count(1) if len({file[-deep:] for file in files}) == len(files))
        if depth > 1:
            found |= {path: f"{Path(*own[-depth:-1]).as_posix()}/" for path, own in parts.items()}
    return found


def open_each(
    paths: Sequence[str],
    *,
    repair: Repairing = False,
    axis: str | None = None,
    doing: Callable[[str], None] = lambda words: None,
) -> list[Run]:
    """The one run in each of several files, as `open_run`; those of one name are told apart by folders."""
    check_named_once(paths)
    folders, runs = folders_apart(paths), []
    for path in paths:
        doing(f"reading {path}")
        run = open_run(path, repair=repair, axis=axis)
        runs.append(renamed(run, folders[path] + run.name))
    return runs


def open_runs(
    paths: Sequence[str],
    terminal: Terminal,
    *,
    repair: Repairing = False,
    axis: str | None = None,
    beside: Sequence[str] = (),
    drift: bool = True,
) -> list[Run]:
    """The runs in several files; findings are noted on stderr, those of a `drift` model where one is made.

    Runs of files of one name, those `beside` among them, are told apart by their folders.

    Raises
    ------
    InputError
        If a file is named twice.
    """
    check_named_once(paths)
    folders = folders_apart([*paths, *beside])
    runs: list[Run] = []
    with terminal.work("reading", total=len(paths)) as work:
        for path in paths:
            work.doing(f"reading {path}")
            legs = open_legs(path, repair=repair, axis=axis)
            runs += [renamed(leg, folders[path] + leg.name) for leg in legs]
            work.advance()
    note_findings(runs, terminal, drift=drift)
    return runs


def open_noise(
    path: str | None,
    terminal: Terminal,
    of: Sequence[Run],
    *,
    repair: Repairing = False,
    axis: str | None = None,
    any_unit: bool = False,
) -> Run | None:
    """The static run that tells the noise of the unit of other runs, where one is named.

    Findings are noted on stderr, and so is that it is of another unit or axis, where that is allowed.

    Raises
    ------
    InputError
        If it is of another unit or axis, and any is not allowed.
    """
    if path is None:
        return None
    run = open_run(path, repair=repair, axis=axis)
    for finding in first_of_all(beside_drift(run.findings)):
        terminal.note(f"{run.name}: {finding.message}")
    for fact in ("unit", "axis"):
        own = getattr(run.facts, fact)
        others = sorted({str(stated) for one in of if (stated := getattr(one.facts, fact))})
        if own and others and str(own) not in others:
            told = f"{run.name}: a static run of {fact} '{own}', beside runs of '{listed(others, 3)}'"
            if not any_unit:
                raise InputError(f"{told}; --noise takes one of the same {fact}")
            terminal.note(told)
    return run


def note_findings(runs: Sequence[Run], terminal: Terminal, *, drift: bool = True) -> None:
    """Note on stderr what was noticed in runs, first what makes every figure wrong."""
    told = [(run.name, run.findings if drift else beside_drift(run.findings)) for run in runs]
    noticed = [(name, finding) for name, findings in told for finding in findings]
    for name, finding in sorted(noticed, key=lambda one: one[1].code not in FIRST_OF_ALL):
        terminal.note(f"{name}: {finding.message}")


def note_wrong(name: str, findings: Iterable[Finding], terminal: Terminal) -> None:
    """Note on stderr what makes every figure of a run wrong.

    That an output has one value is told where the run is used.
    """
    for finding in findings:
        if finding.code in FIRST_OF_ALL and finding.code != DEAD:
            terminal.note(f"{name}: {finding.message}")


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
