"""Parquet files: columns named ``name [unit]``, set-up facts in the schema metadata.

Facts stand there as JSON under ``fogml.facts``, as `write_run` puts them, or one key per fact.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from fogml.errors import InputError
from fogml.runs.columns import column_spec, parse_header
from fogml.runs.facts import Facts
from fogml.runs.raw_table import (
    RawTable,
    embedded_facts,
    first_line,
    named_from,
    text_column,
    wanted_cells,
)
from fogml.runs.reader_process import DEFAULT_LIMITS, ReadingLimits

if TYPE_CHECKING:
    from pyarrow import ChunkedArray, Schema, Table
    from pyarrow.parquet import ParquetFile

_BUFFER_BYTES = 1 << 20


def parquet_blocks(
    path: Path,
    rows: int | None,
    columns: Collection[str] | None = None,
    limits: ReadingLimits = DEFAULT_LIMITS,
) -> Iterator[RawTable]:
    """The table of a Parquet file in blocks of at most `rows` rows, in bounded memory; whole for None.

    Only time, gyro and `columns` are read where these are given.

    Raises
    ------
    InputError
        If the file is damaged or states more than it can hold, or a column of the run format holds no
        numbers.
    """
    import pyarrow as arrow

    start = 0
    # Buffering ahead would hold whole row groups of every column: memory grows with the file.
    with _opened(path) as file:
        try:
            _check_sizes(path, file, limits)
            wanted = wanted_cells(file.schema_arrow.names, columns)
            if rows is None:
                yield _raw(path.name, file.read(columns=wanted), 0)
                return
            for batch in file.iter_batches(batch_size=rows, columns=wanted):
                table = arrow.Table.from_batches([batch])
                yield _raw(path.name, table, start)
                start += len(batch)
        except _failures() as error:
            raise _damaged(path, error) from None


def _check_sizes(path: Path, file: ParquetFile, limits: ReadingLimits) -> None:
    """Refuse a file whose catalogue states more than it can hold, before memory is taken for it."""
    held = file.metadata
    limits.check_size(path, float(held.num_rows) * held.num_columns)
    for group in range(held.num_row_groups):
        columns = [held.row_group(group).column(i) for i in range(held.num_columns)]
        limits.check_size(path, sum(max(column.total_uncompressed_size, 0) for column in columns) / 8.0)


def _opened(path: Path) -> ParquetFile:
    import pyarrow.parquet as parquet

    try:
        # Without a buffer, streaming would hold a column's whole row group, however large.
        return parquet.ParquetFile(
            path,
            pre_buffer=False,
            memory_map=False,
            buffer_size=_BUFFER_BYTES,
            page_checksum_verification=True,
        )
    except _failures() as error:
        raise _damaged(path, error) from None


def _damaged(path: Path, error: Exception) -> InputError:
    return InputError(
        f"{path.name}: damaged or no Parquet file ({first_line(error)}); copy or export it again"
    )


def _failures() -> tuple[type[Exception], ...]:
    import pyarrow as arrow

    # A ValueError is a name that is not UTF-8.
    return (arrow.ArrowException, OSError, ValueError, MemoryError)


def _raw(file: str, table: Table, start: int) -> RawTable:
    columns: dict[str, NDArray[np.float64]] = {}
    findings = []
    for cell, values in zip(table.column_names, table.columns, strict=True):
        numbers = _numbers(values)
        name = parse_header(cell)[0]
        if numbers is None and column_spec(name) is not None:
            raise InputError(f"{file}, column '{name}': holds {values.type}, numbers were expected")
        if numbers is None:
            findings.append(text_column(name))
        else:
            columns[cell] = numbers
    return RawTable(
        file,
        tuple(table.column_names),
        columns,
        facts_of_schema(table.schema, file),
        named_from(start),
        tuple(findings),
    )


def _numbers(values: ChunkedArray) -> NDArray[np.float64] | None:
    import pyarrow as arrow
    import pyarrow.types as types

    kind = values.type
    numeric = (types.is_floating, types.is_integer, types.is_boolean, types.is_decimal, types.is_null)
    if not any(is_kind(kind) for is_kind in numeric):
        return None
    if values.null_count == 0 and types.is_float64(kind) and values.num_chunks == 1:
        return np.asarray(values.chunk(0))
    # Integers beyond 2^53, such as nanoseconds since 1970, are rounded to the nearest number.
    return np.asarray(values.cast(arrow.float64(), safe=False).to_numpy())


def facts_of_schema(schema: Schema, file: str) -> Facts | None:
    """Set-up facts in a schema's metadata, or None."""
    metadata = {key.decode("utf-8", errors="replace"): text for key, text in (schema.metadata or {}).items()}
    return embedded_facts(metadata, f"{file}, facts in the metadata")
