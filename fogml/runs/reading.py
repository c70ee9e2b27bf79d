"""Reading runs: any of the file formats, units converted, every fault named or repaired and counted."""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable, Iterator
from dataclasses import replace
from pathlib import Path

from fogml.errors import InputError, listed, quoted
from fogml.processes import made_ahead
from fogml.runs.assemble import (
    MOST_DROPPED,
    Assembler,
    needs_whole,
    runs_of_table,
    told_by_the_whole,
    too_short,
)
from fogml.runs.checks import check_run
from fogml.runs.columns import parse_header
from fogml.runs.findings import Finding
from fogml.runs.opening import Opened, opened
from fogml.runs.raw_table import RawTable
from fogml.runs.reading_limits import DEFAULT_LIMITS, ReadingLimits
from fogml.runs.run import Run
from fogml.runs.sources import run_sources, unchanged
from fogml.runs.three_axes import OneAxis
from fogml.signals.large import Growing

BLOCK_ROWS = 1_000_000


def read_run(
    path: str | Path,
    *,
    repair: bool = False,
    name: str | None = None,
    axis: str | None = None,
    most_dropped: float = MOST_DROPPED,
    limits: ReadingLimits = DEFAULT_LIMITS,
) -> Run:
    """Read a run from CSV or a format of `fogml.readers`, told by content and suffix.

    Set-up facts come from the side file of the same stem, else from the file itself.

    Parameters
    ----------
    path
        The file.
    repair
        Bring times that go back in order: rows out of place are sorted, a wrapped counter is
        unwrapped, coarse stamps are spread, repeated rows are dropped, and so are rows that can't be
        read or hold missing or infinite values; what was done is counted in the run's findings.
    name
        Name of the run; the file's base name by default.
    axis
        Of a file with ``gyro_x``, ``gyro_y``, ``gyro_z``: which of them is the run's gyro.
    most_dropped
        Share of the rows that repair may drop.
    limits
        What reading may take before the file counts as damaged.

    Returns
    -------
    Run
        In internal units, with what `check_run` noticed among its findings.

    Raises
    ------
    InputError
        Naming file, column, first bad row, and what to do; also if the file changes while it is read,
        and if the clock restarts, so that the file holds several runs (`read_runs`).
    """
    runs = read_runs(path, repair=repair, name=name, axis=axis, most_dropped=most_dropped, limits=limits)
    if len(runs) > 1:
        restart = next(f for f in runs[0].findings if f.code == "repaired_restart")
        raise InputError(
            f"{Path(path).name}, column 'time': {restart.message.partition(':')[0]}, and one run is needed "
            "here; save the rows of one leg as a file of its own, or name them as 'legs' in an import profile"
        )
    return runs[0]


def read_runs(
    path: str | Path,
    *,
    repair: bool = False,
    name: str | None = None,
    axis: str | None = None,
    most_dropped: float = MOST_DROPPED,
    limits: ReadingLimits = DEFAULT_LIMITS,
) -> list[Run]:
    """Read the runs in a file, as `read_run`: one, or with `repair` one for each restart of its clock.

    Legs are named ``FILE leg 1`` and so on; stated times of power-on and of the beginning are the first's.
    """
    path = Path(path)
    with unchanged(*run_sources(path)):
        one = OneAxis(axis)
        file = opened(path, limits)
        limits.check_repair(path, file.size_mb if repair else 0.0)
        if not repair and file.size_mb > limits.long_mb:
            assembler = Assembler(path)
            long = _joined(path, _blocks(assembler, file, None, BLOCK_ROWS, axis, limits), name)
            told = told_by_the_whole(assembler.cells, long.columns)
            return [long.with_findings((*told, *check_run(long)))]
        table = one.table(_read_table(file, repair, limits))
        runs = runs_of_table(table, path, repair=repair, name=name, most_dropped=most_dropped)
    return [run.with_findings(check_run(run)) for run in map(one.run, runs)]


def read_blocks(
    path: str | Path,
    *,
    columns: Collection[str] | None = None,
    block_rows: int = BLOCK_ROWS,
    axis: str | None = None,
    repair: bool = False,
    most_dropped: float = MOST_DROPPED,
    limits: ReadingLimits = DEFAULT_LIMITS,
) -> Iterator[Run]:
    """Read a run in blocks of at most `block_rows` rows, in bounded memory, one ahead of their use.

    Blocks share name and facts. Order of time is checked across their borders. A variable of a MATLAB
    file of version 5 is held whole while it is unpacked; so is a file to repair, and one whose first
    block shows columns of another rate or times of arrival, which only the whole tells.

    Parameters
    ----------
    path
        The file.
    columns
        Names of the columns to read beside time and gyro; all by default. Faults of others are
        not met.
    block_rows
        Most rows of a block.
    axis, repair, most_dropped
        As `read_run`.
    limits
        What reading may take before the file counts as damaged.

    Yields
    ------
    Run
        The next rows.

    Raises
    ------
    InputError
        As `read_run`, and if a column of `columns` is not there; a fault in a later block is met
        when that block is asked for, and so is a file that changed when the last one was.
    """
    path = Path(path)
    if block_rows < 1:
        raise InputError(f"{block_rows} rows a block: at least 1 is needed")
    if repair:
        yield from _cut(
            read_run(path, repair=True, axis=axis, most_dropped=most_dropped, limits=limits),
            columns,
            block_rows,
        )
        return
    with unchanged(*run_sources(path)):
        yield from _blocks(Assembler(path), opened(path, limits), columns, block_rows, axis, limits)


def _blocks(
    assembler: Assembler,
    file: Opened,
    columns: Collection[str] | None,
    block_rows: int,
    axis: str | None,
    limits: ReadingLimits,
) -> Iterator[Run]:
    """As `read_blocks`, of a file that is opened."""
    path, one = assembler.path, OneAxis(axis)
    blocks = _table_blocks(file, block_rows, one.columns(columns), limits)
    for table in map(one.table, made_ahead(blocks)):
        held = [parse_header(cell)[0] for cell in table.columns]
        missing = [column for column in columns or () if column not in held]
        if missing:
            raise InputError(
                f"{path.name}: no column {quoted(missing[0])} of numbers; it holds {listed(held)}"
            )
        if assembler.samples == 0 and needs_whole(table):
            whole = replace(limits, long_mb=math.inf)
            yield from _cut(read_run(path, axis=axis, limits=whole), columns, block_rows)
            return
        yield one.run(assembler.block(table))
    if assembler.samples < 2:
        raise too_short(path.name, assembler.samples)


def _joined(path: Path, blocks: Iterable[Run], name: str | None) -> Run:
    """Blocks of a run as one, whose columns lie in temporary files where they are long."""
    columns: dict[str, Growing] = {}
    findings: dict[Finding, None] = {}
    for block in blocks:
        for column, values in block.columns.items():
            columns.setdefault(column, Growing()).append(values)
        findings.update(dict.fromkeys(block.findings))
    held = {column: values.array() for column, values in columns.items()}
    return Run.derived(name or path.name, held, block.facts, block.gyro_unit, tuple(findings))


def _cut(run: Run, columns: Collection[str] | None, block_rows: int) -> Iterator[Run]:
    """A run in blocks."""
    kept = None if columns is None else {"time", "gyro", *columns}
    held = {name: values for name, values in run.columns.items() if kept is None or name in kept}
    if missing := [column for column in columns or () if column not in held]:
        raise InputError(
            f"{run.name}: no column {quoted(missing[0])} of numbers; it holds {listed(run.columns)}"
        )
    whole = Run.derived(run.name, held, run.facts, run.gyro_unit, run.findings)
    for start in range(0, len(whole), block_rows):
        yield whole[start : start + block_rows]


def read_table(path: Path) -> RawTable:
    """The table in a file of any format as it stands, whatever its columns; nothing is repaired."""
    with unchanged(path):
        return _read_table(opened(path), False, DEFAULT_LIMITS)


def _read_table(file: Opened, repair: bool, limits: ReadingLimits) -> RawTable:
    if file.kind == "csv":
        from fogml.runs.csv_files import read_csv

        return file.keeping(read_csv(file.path, repair=repair, seconds=file.durations))
    (table,) = _table_blocks(file, None, None, limits)
    return table


def _table_blocks(
    file: Opened, rows: int | None, columns: Collection[str] | None, limits: ReadingLimits
) -> Iterator[RawTable]:
    path, kind = file.path, file.kind
    # Each format's reader, and the package behind it, is loaded only where it is used.
    if kind == "csv":
        from fogml.runs.csv_files import csv_blocks

        return map(file.keeping, csv_blocks(path, rows or BLOCK_ROWS, columns, file.durations))
    if kind in ("parquet", "hdf5", "mat"):
        from fogml.runs.column_files import BLOCKS

        return BLOCKS[kind](path, rows, columns, limits)
    from fogml.runs.container_files import container_blocks

    return container_blocks(path, kind, rows, columns, limits)
