"""Parquet files: columns named ``name [unit]``, set-up facts as JSON in the schema metadata."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from fogml.errors import InputError
from fogml.runs.columns import column_spec, parse_header
from fogml.runs.facts import Facts, facts_from
from fogml.runs.raw_table import FACTS_KEY, RawTable, numbered_row, text_column

if TYPE_CHECKING:
    from pyarrow import ChunkedArray, Schema, Table
    from pyarrow.parquet import ParquetFile


def read_parquet(path: Path) -> RawTable:
    """The table of a Parquet file.

    Raises
    ------
    InputError
        If the file is damaged, or a column of the run format holds no numbers.
    """
    import pyarrow as arrow

    with _opened(path) as file:
        try:
            return _raw(path.name, file.read(), 0)
        except (arrow.ArrowException, OSError) as error:
            raise _damaged(path, error) from None


def parquet_blocks(path: Path, rows: int) -> Iterator[RawTable]:
    """The table of a Parquet file in blocks of at most `rows` rows, in bounded memory.

    Raises
    ------
    InputError
        As `read_parquet`.
    """
    import pyarrow as arrow

    start = 0
    # Buffering ahead would hold whole row groups of every column: memory grows with the file.
    with _opened(path) as file:
        try:
            for batch in file.iter_batches(batch_size=rows):
                table = arrow.Table.from_batches([batch])
                yield _raw(path.name, table, start)
                start += len(batch)
        except (arrow.ArrowException, OSError) as error:
            raise _damaged(path, error) from None


def _opened(path: Path) -> ParquetFile:
    import pyarrow as arrow
    import pyarrow.parquet as parquet

    try:
        return parquet.ParquetFile(path, pre_buffer=False, memory_map=False)
    except (arrow.ArrowException, OSError) as error:
        raise _damaged(path, error) from None


def _damaged(path: Path, error: Exception) -> InputError:
    reason = str(error).splitlines()[0] if str(error) else type(error).__name__
    return InputError(f"{path.name}: damaged or no Parquet file ({reason}); copy or export it again")


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
        lambda i: numbered_row(start + i),
        tuple(findings),
    )


def _numbers(values: ChunkedArray) -> NDArray[np.float64] | None:
    import pyarrow as arrow
    import pyarrow.types as types

    kind = values.type
    if not (types.is_floating(kind) or types.is_integer(kind) or types.is_null(kind)):
        return None
    if values.null_count == 0 and types.is_float64(kind) and values.num_chunks == 1:
        return np.asarray(values.chunk(0))
    return np.asarray(values.cast(arrow.float64()).to_numpy())


def facts_of_schema(schema: Schema, file: str) -> Facts | None:
    """Set-up facts in a schema's metadata, or None."""
    text = (schema.metadata or {}).get(FACTS_KEY.encode())
    if text is None:
        return None
    return facts_from(json_value(text, file), f"{file}, facts in the metadata")


def json_value(text: str | bytes, file: str) -> Any:
    """The value of JSON text.

    Raises
    ------
    InputError
        If it is not JSON.
    """
    try:
        return json.loads(text)
    except ValueError:
        raise InputError(f"{file}: the set-up facts in it are not JSON; write the file again") from None
