"""Reading runs: any of the file formats, units converted, every fault named or repaired and counted."""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable, Iterator
from dataclasses import replace
from pathlib import Path

from fogml.errors import InputError, listed, quoted
from fogml.processes import made_ahead
from fogml.readers import READERS, reader_of, reader_of_content
from fogml.runs.assemble import MOST_DROPPED, Assembler, needs_whole, runs_of_table, too_short
from fogml.runs.checks import check_run
from fogml.runs.columns import parse_header
from fogml.runs.findings import Finding
from fogml.runs.raw_table import RawTable, empty_file
from fogml.runs.reading_limits import DEFAULT_LIMITS, ReadingLimits
from fogml.runs.run import Run
from fogml.runs.sources import run_sources, unchanged
from fogml.runs.three_axes import OneAxis
from fogml.signals.large import Growing

BLOCK_ROWS = 1_000_000
_HEAD_BYTES = 1024
_CSV_SUFFIXES = (".csv", ".tsv")
_FOREIGN = {
    b"PK\x03\x04": "a zip archive; unpack it first",
    b"\x1f\x8b": "compressed by gzip; unpack it first",
    b"BZh": "compressed by bzip2; unpack it first",
    b"\xfd7zXZ": "compressed by xz; unpack it first",
    b"\x28\xb5\x2f\xfd": "compressed by zstd; unpack it first",
    b"7z\xbc\xaf": "a 7-Zip archive; unpack it first",
    b"%PDF": "a PDF; export the table as CSV",
    b"ARROW1": "a Feather (Arrow) file; write it as Parquet",
    b"\x93NUMPY": "one NumPy array, whose columns have no names; write it with names, as numpy.savez does",
}


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

    Legs are named ``FILE leg 1`` and so on; a stated time of power-on belongs to the first.
    """
    path = Path(path)
    with unchanged(*run_sources(path)):
        one = OneAxis(axis)
        kind = file_format(path)
        size_mb = _size_mb(path, kind)
        limits.check_repair(path, size_mb if repair else 0.0)
        if not repair and size_mb > limits.long_mb:
            long = _joined(path, read_blocks(path, axis=axis, limits=limits), name)
            return [long.with_findings(check_run(long))]
        table = one.table(_read_table(path, kind, repair, limits))
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
        assembler = Assembler(path)
        one = OneAxis(axis)
        blocks = _table_blocks(path, file_format(path), block_rows, one.columns(columns), limits)
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


def _size_mb(path: Path, kind: str) -> float:
    """What a file holds, unpacked where it tells [MB]."""
    size = float(path.stat().st_size)
    if kind == "parquet":
        from fogml.runs.parquet_files import parquet_values

        size = max(size, 8.0 * parquet_values(path))
    return size / 1e6


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
        return _read_table(path, file_format(path), False, DEFAULT_LIMITS)


def file_format(path: Path) -> str:
    """Which of the formats a file has, told by its first bytes: ``csv`` or the name of a reader.

    Raises
    ------
    InputError
        If it is missing, no file, not readable, empty, of a known format that holds no run, or
        of another format than its suffix says.
    """
    kind = _format_of_content(path)
    suffix = path.suffix.lower()
    stated = [reader for reader in READERS if suffix in reader.suffixes]
    if (kind == "csv" and (suffix in _CSV_SUFFIXES or not stated)) or kind in [r.name for r in stated]:
        return kind
    if kind == "csv":
        label = stated[0].label
        raise InputError(f"{path.name}: damaged or no {label} file (its first bytes are not {label}'s)")
    reader = reader_of(kind)
    if not stated and suffix not in _CSV_SUFFIXES:
        return kind
    label = stated[0].label if stated else "CSV"
    raise InputError(
        f"{path.name}: is a {reader.label} file by its content, and named as {label}; "
        f"rename it to '{path.stem}{reader.suffixes[0]}'"
    )


def _format_of_content(path: Path) -> str:
    try:
        if not path.exists():
            raise InputError(f"{path}: no such file")
        if path.is_dir() and (path / "metadata.yaml").is_file():
            raise InputError(f"{path}: is the folder of a ROS 2 bag; name its .db3 or .mcap file")
        if path.is_dir():
            raise InputError(f"{path}: is a folder; name a file")
        if not path.is_file():
            raise InputError(f"{path}: is no ordinary file; save the recording to one first")
        with path.open("rb") as file:
            head = file.read(_HEAD_BYTES)
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror or error})") from None
    if not head:
        raise empty_file(path.name)
    if (reader := reader_of_content(head, path.suffix)) is not None:
        return reader.name
    for magic, what in _FOREIGN.items():
        if head.startswith(magic):
            raise InputError(f"{path.name}: is {what}")
    return "csv"


def _read_table(path: Path, kind: str, repair: bool, limits: ReadingLimits) -> RawTable:
    if kind == "csv":
        from fogml.runs.csv_files import read_csv

        return read_csv(path, repair=repair)
    if kind == "workbook":
        from fogml.runs.container_files import sheet_table

        return sheet_table(path, repair=repair, limits=limits)
    (table,) = _table_blocks(path, kind, None, None, limits)
    return table


def _table_blocks(
    path: Path, kind: str, rows: int | None, columns: Collection[str] | None, limits: ReadingLimits
) -> Iterator[RawTable]:
    # Each format's reader, and the package behind it, is loaded only where it is used.
    if kind == "csv":
        from fogml.runs.csv_files import csv_blocks

        return csv_blocks(path, rows or BLOCK_ROWS, columns)
    if kind == "parquet":
        from fogml.runs.parquet_files import parquet_blocks

        return parquet_blocks(path, rows, columns, limits)
    if kind == "hdf5":
        from fogml.runs.hdf5_files import hdf5_blocks

        return hdf5_blocks(path, rows, columns, limits)
    if kind == "mat":
        from fogml.runs.mat_files import mat_blocks

        return mat_blocks(path, rows, columns, limits)
    from fogml.runs.container_files import container_blocks, sheet_blocks

    if kind == "workbook":
        return sheet_blocks(path, rows or BLOCK_ROWS, columns, limits)
    return container_blocks(path, kind, rows, columns, limits)
