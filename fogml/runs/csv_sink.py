"""A CSV file being written: plain decimal numbers by a compiled writer, all others by Arrow's; same text."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from fogml.runs.compiling import pays_by_now

if TYPE_CHECKING:
    from pyarrow import Schema, Table

_BATCH_ROWS = 1 << 16
_SAVED_S_PER_NUMBER = 3.5e-8
"""Time [s] that the compiled writer saves."""


class CsvSink:
    """Writes tables of one schema below a header.

    Parameters
    ----------
    path
        The file, replaced if it is there.
    schema
        Names and types of the columns.
    """

    def __init__(self, path: Path, schema: Schema) -> None:
        import pyarrow as arrow
        from pyarrow import csv

        plain = not any(mark in name for name in schema.names for mark in ',"\r\n')
        quoting = "none" if plain else "needed"
        options = csv.WriteOptions(
            quoting_style=quoting, quoting_header=quoting, batch_size=_BATCH_ROWS, eol="\n"
        )
        self._file = arrow.OSFile(str(path), "wb")
        self._writer = csv.CSVWriter(self._file, schema, write_options=options)
        self._floats = all(kind == arrow.float64() for kind in schema.types)
        self._decimals = np.zeros(len(schema), dtype=np.intp)

    def write_table(self, table: Table) -> None:
        """Append the rows of a table."""
        saving_s = _SAVED_S_PER_NUMBER * table.num_rows * table.num_columns
        if not self._floats or not pays_by_now(saving_s):
            self._writer.write_table(table)
            return
        from fogml.runs.csv_text_kernel import plain_lines

        for start in range(0, table.num_rows, _BATCH_ROWS):
            batch = table.slice(start, _BATCH_ROWS)
            lines = plain_lines(np.stack([column.to_numpy() for column in batch.columns]), self._decimals)
            if lines is None:
                self._writer.write_table(batch)
            else:
                self._file.write(lines)

    def close(self) -> None:
        """Finish the file."""
        try:
            self._writer.close()
        finally:
            self._file.close()
