"""Parquet files: columns named ``name [unit]``, set-up facts in the schema metadata.

Facts stand there as JSON under ``fogml.facts``, as `write_run` puts them, or one key per fact.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from fogml.errors import InputError
from fogml.runs.columns import column_spec, parse_header
from fogml.runs.facts import Facts
from fogml.runs.header_spelling import canonical_cells
from fogml.runs.raw_table import FACTS_KEY, RawTable, embedded_facts, moment, stored_blocks, text_column
from fogml.runs.reader_process import StoredArray, StoredFile, stored_file
from fogml.runs.reading_limits import DEFAULT_LIMITS, ReadingLimits


def parquet_blocks(
    path: Path,
    rows: int | None,
    columns: Collection[str] | None = None,
    limits: ReadingLimits = DEFAULT_LIMITS,
) -> Iterator[RawTable]:
    """The table of a Parquet file in blocks of at most `rows` rows, in bounded memory; whole for None.

    Only time, gyro and `columns` are read where these are given.
    """
    with stored_file(path, "parquet", (FACTS_KEY, *Facts.model_fields), limits) as stored:
        vectors, findings = [], []
        for array in stored.arrays:
            name = parse_header(array.name)[0]
            if array.kind == "f":
                vectors.append((array.name if array.unit is None else f"{name} [{array.unit}]", array))
            elif column_spec(name) is not None:
                raise InputError(
                    f"{path.name}, column '{name}': holds {array.type_name}, numbers were expected"
                )
            else:
                findings.append(text_column(name))
        facts = embedded_facts(stored.told["facts"], f"{path.name}, facts in the metadata")
        cells = canonical_cells([cell for cell, _ in vectors])
        vectors = [(cell, array) for cell, (_, array) in zip(cells, vectors, strict=True)]
        clock = next((array for cell, array in vectors if parse_header(cell)[0] == "time"), None)
        started = None if clock is None else moment(stored.told["origins_s"][clock.index])
        for table in stored_blocks(stored, vectors, tuple(findings), facts, rows, columns):
            yield replace(table, started=started)


def parquet_rows(path: Path) -> int:
    """Number of rows of a Parquet file."""
    with stored_file(path, "parquet", (), DEFAULT_LIMITS) as stored:
        return max((max(array.shape) for array in stored.arrays), default=0)


def parquet_values(path: Path) -> int:
    """Number of values of a Parquet file, in all its columns."""
    with stored_file(path, "parquet", (), DEFAULT_LIMITS) as stored:
        return sum(max(array.shape) for array in stored.arrays)


def parquet_marks(path: Path, cell: str) -> NDArray[np.str_]:
    """The texts of a column of marks, shape (n,), by its header cell."""
    with stored_file(path, "parquet", (), DEFAULT_LIMITS) as stored:
        return stored.marks(_named(stored, cell))


def _named(stored: StoredFile, cell: str) -> StoredArray:
    found = [array for array in stored.arrays if array.name == cell]
    if not found:
        raise InputError(f"{stored.path.name}: column '{cell}' is missing; export it again")
    return found[0]
