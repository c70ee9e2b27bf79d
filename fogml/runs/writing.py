"""Writing runs: CSV, Parquet, HDF5 and MATLAB, with set-up facts, whole or not at all."""

from __future__ import annotations

import json
from collections.abc import Collection, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, Any, Literal, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fogml.arrow_arrays import table_of
from fogml.errors import InputError
from fogml.json_files import FAR_OFF
from fogml.outputs import whole_file, whole_files
from fogml.runs.columns import column_spec, header
from fogml.runs.exchange import one_run
from fogml.runs.facts import SIDE_SUFFIXES, Facts, side_file, side_file_text, stated_facts
from fogml.runs.raw_table import FACTS_KEY
from fogml.runs.run import Run
from fogml.signals import large

if TYPE_CHECKING:
    from pyarrow import Schema, Table

SUFFIXES = (".csv", ".parquet", ".h5", ".hdf5", ".mat")
IN_BLOCKS = (".csv", ".parquet")
"""Of formats that are written block by block."""
_ROW_GROUP = 1 << 20


def write_run(run: Run, path: str | Path, *, mat_version: Literal["5", "7.3"] | None = None) -> None:
    """Write a run in the format that the suffix of `path` names; floats keep every digit.

    Facts go into a side file of the same stem where there are any, and into the file itself
    where its format can hold them (Parquet, HDF5, MATLAB). A side file that is there already
    is treated as :func:`check_side_file` says.

    Raises
    ------
    InputError
        If the suffix is not known, the place can't be written, or a side file of that stem
        states other facts, or a value of a known column is not finite.
    """
    path, run = Path(path), one_run(run)
    suffix = checked_suffix(path)
    cells = header_cells(run)
    if suffix in (".csv", ".parquet"):
        with BlockWriter(path, run.facts) as writer:
            for part in large.pieces(run.time, least=_ROW_GROUP):
                writer.write(run[part])
        return
    _check_finite(path, {cell: run.columns[name] for name, cell in cells.items()}, carried_cells(run))
    with _with_side_file(path, run.facts) as partial:
        if suffix == ".mat":
            from fogml.runs.column_files import write_mat

            write_mat(run, cells, partial, mat_version)
        else:
            from fogml.runs.column_files import write_hdf5

            write_hdf5(run, cells, partial)


def _check_finite(
    path: Path, block: Mapping[str, NDArray[np.generic]], carried: Collection[str], first: int = 0
) -> None:
    """Refuse a block from row `first` on with a value that is no result, but in columns that are carried."""
    for cell, values in block.items():
        sound = np.isfinite(values) if cell not in carried else np.ones(0, dtype=np.bool_)
        if not sound.all():
            row = int(np.argmin(sound))
            raise InputError(
                f"{path.name}, column '{cell}', row {first + row + 1}: comes out as {values[row]}, which is "
                f"no result; {FAR_OFF}"
            )


def header_cells(run: Run) -> dict[str, str]:
    """Column name to header cell, internal units; the gyro in counts where it was recorded so."""
    return {name: header(name, run.gyro_unit if name == "gyro" else None) for name in run.columns}


def carried_cells(run: Run) -> set[str]:
    """Header cells of a run's columns that the run format does not know: kept as they are."""
    return {cell for name, cell in header_cells(run).items() if column_spec(name) is None}


class BlockWriter:
    """Writes a run block by block to CSV or Parquet; the file appears when the block ends well.

    Use as a context manager. The first block's columns are those of the file.

    Parameters
    ----------
    path
        Ends in ``.csv`` or ``.parquet``.
    facts
        Set-up facts of a run: into the side file, and into a Parquet file's metadata. None for a table that
        is no run: no side file is written or looked at.

    Raises
    ------
    InputError
        As `write_run`, or if the suffix is another one.
    """

    def __init__(self, path: str | Path, facts: Facts | None = None) -> None:
        self.path = Path(path)
        self.facts = facts
        checked_suffix(self.path, IN_BLOCKS)
        self._stack = ExitStack()
        self._sink: Any = None
        self._schema: Schema | None = None
        self._rows = 0

    def __enter__(self) -> Self:
        self._partial = self._stack.enter_context(_with_side_file(self.path, self.facts))
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        try:
            if self._sink is not None:
                self._sink.close()
            elif kind is None:
                raise InputError(f"{self.path.name}: there is nothing to write")
        except BaseException as failure:
            self._stack.__exit__(type(failure), failure, failure.__traceback__)
            raise
        self._stack.__exit__(kind, error, trace)

    def write(self, block: Run | Mapping[str, ArrayLike], carried: Collection[str] = ()) -> None:
        """Append a block: a run, or header cell to values of shape (n,).

        Parameters
        ----------
        block
            What is appended.
        carried
            Header cells of columns that are written as they were recorded, whatever they hold; of a run
            those that the run format does not know.

        Raises
        ------
        InputError
            If its columns are not those of the first block, or a value is not finite.
        """
        if isinstance(block, Run):
            carried = carried_cells(block)
            block = {cell: block.columns[name] for name, cell in header_cells(block).items()}
        arrays = {cell: np.asarray(values) for cell, values in block.items()}
        _check_finite(self.path, arrays, carried, self._rows)
        table = table_of(arrays)
        self._rows += len(table)
        if self._schema is None:
            self._schema = table.schema
            if self.facts is not None:
                metadata = {FACTS_KEY: json.dumps(self.facts.as_dict(), ensure_ascii=False)}
                self._schema = table.schema.with_metadata(metadata)
            self._sink = self._opened(self._schema)
        elif not table.schema.equals(self._schema, check_metadata=False):
            raise InputError(
                f"{self.path.name}: a block's columns {table.column_names} are not the first block's"
            )
        self._append(table)

    def _opened(self, schema: Schema) -> Any:
        if self.path.suffix.lower() == ".parquet":
            import pyarrow.parquet as parquet

            # Byte streams compress recorded floats in less time than writing them plainly takes.
            # Snappy is read by all other programs; checksums tell damage that reads as a number.
            return parquet.ParquetWriter(
                self._partial,
                schema,
                compression="snappy",
                use_dictionary=False,
                use_byte_stream_split=True,
                write_page_checksum=True,
            )
        from pyarrow import csv

        plain = not any(mark in name for name in schema.names for mark in ',"\r\n')
        quoting = "none" if plain else "needed"
        options = csv.WriteOptions(quoting_style=quoting, quoting_header=quoting, batch_size=1 << 16)
        return csv.CSVWriter(self._partial, schema, write_options=options)

    def _append(self, table: Table) -> None:
        if self.path.suffix.lower() == ".parquet":
            self._sink.write_table(table.cast(self._schema), row_group_size=_ROW_GROUP)
        else:
            self._sink.write_table(table.cast(self._schema))


@contextmanager
def _with_side_file(path: Path, facts: Facts | None) -> Iterator[Path]:
    """A partial file for `path`; the side file, where one is needed, appears with it."""
    side = None if facts is None else check_side_file(path, facts)
    if facts is None or side is None:
        with whole_file(path) as partial:
            yield partial
        return
    with whole_files(path, side) as (partial, beside):
        beside.write_text(side_file_text(facts), encoding="utf-8")
        yield partial


def check_side_file(path: str | Path, facts: Facts) -> Path | None:
    """Where the side file of a run has to be written, if at all; facts that are there are never lost.

    A side file that states just these facts stays as it is, with its comments. One that states fewer, or
    another note, is replaced with the run that it belongs to. One that states another fact, or one that this
    run lacks, is an error, and so is one that would state more of another file of the stem.

    Raises
    ------
    InputError
        Naming the side file and the facts that would be lost.
    """
    path = Path(path)
    beside = side_file(path)
    if beside is None:
        return None if facts == Facts() else path.with_suffix(SIDE_SUFFIXES[0])
    try:
        there = stated_facts(beside)
    except InputError:
        raise InputError(
            f"{path.name}: beside it would stand {beside.name}, which is there already and states no facts "
            "of a run; choose another name, or move that file"
        ) from None
    if there == facts:
        return None
    old, new = there.as_dict(), facts.as_dict()
    lost = [f"{key}: {value}" for key, value in old.items() if new.get(key) != value]
    lost = [text for text in lost if not (text.startswith("notes: ") and "notes" in new)]
    others = [path.with_suffix(suffix) for suffix in SUFFIXES if suffix != path.suffix.lower()]
    # A note is about one file: another file of the stem loses nothing by it.
    gained = set(new) - set(old) - {"notes"}
    sharing = [other.name for other in others if other.is_file() and (gained or lost)]
    if lost or sharing or not path.exists():
        what = f"states {'; '.join(lost)}" if lost else "does not state the facts of this run"
        whose = f", and holds for {sharing[0]} too" if sharing else ""
        raise InputError(
            f"{path.name}: beside it would stand {beside.name}, which is there already and {what}{whose}; "
            "choose another name, or move that file and what it belongs to"
        )
    return beside


def checked_suffix(path: Path, taken: Sequence[str] = SUFFIXES) -> str:
    """The suffix that tells the format of a file to write.

    Raises
    ------
    InputError
        If it is none of those that are taken.
    """
    suffix = path.suffix.lower()
    if suffix not in taken:
        what = "is not written block by block" if suffix in SUFFIXES else "is not known"
        raise InputError(f"{path.name or path}: format '{suffix}' {what}; use one of {', '.join(taken)}")
    return suffix
