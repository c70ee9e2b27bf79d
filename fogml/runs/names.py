"""Names of runs that are used together."""

from __future__ import annotations

from collections.abc import Sequence

from fogml.runs.run import Run


def renamed(run: Run, name: str) -> Run:
    """The run under another name; itself where that is its own."""
    if name == run.name:
        return run
    return Run.derived(name, run.columns, run.facts, run.gyro_unit, run.findings)


def named_apart(*groups: Sequence[Run]) -> tuple[list[Run], ...]:
    """The groups of runs, each under a name of its own: the second ``run.csv`` is ``run.csv (2)``.

    Files of one name in several folders are usual, and what is told of runs is told by their names.
    """
    taken: set[str] = set()

    def named(run: Run) -> Run:
        name, count = run.name, 1
        while name in taken:
            count += 1
            name = f"{run.name} ({count})"
        taken.add(name)
        return renamed(run, name)

    return tuple([named(run) for run in group] for group in groups)
