"""A file's table before it is a run: header cells, values, and how to name its rows in messages."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from fogml.runs.facts import Facts
from fogml.runs.findings import Finding

FACTS_KEY = "fogml.facts"
"""Key of the set-up facts (JSON) in Parquet schema metadata, HDF5 attributes and MAT variables."""


def numbered_row(index: int) -> str:
    """A row by its number from 1."""
    return f"row {index + 1}"


def text_column(name: str) -> Finding:
    """What to say of a column that holds no numbers."""
    return Finding("text_column", f"column '{name}' holds text and is left out", column=name)


@dataclass(frozen=True)
class RawTable:
    """Columns as a file holds them.

    Attributes
    ----------
    file
        Base name, for messages.
    cells
        Header cells ``name [unit]`` in order.
    columns
        Header cell to values of shape (n,), float64, in the file's units; NaN where a value was
        missing.
    facts
        Set-up facts that the file itself states, if any.
    row_name
        Names the row at an index the way its user finds it.
    findings
        What was noticed so far.
    """

    file: str
    cells: tuple[str, ...]
    columns: Mapping[str, NDArray[np.float64]]
    facts: Facts | None = None
    row_name: Callable[[int], str] = numbered_row
    findings: tuple[Finding, ...] = field(default=())

    def __len__(self) -> int:
        return len(next(iter(self.columns.values()))) if self.columns else 0

    def blocks(self, rows: int) -> Iterator[RawTable]:
        """The table cut into blocks of at most `rows` rows, as views."""
        for start in range(0, len(self), rows):
            columns = {cell: values[start : start + rows] for cell, values in self.columns.items()}
            yield replace(self, columns=columns, row_name=_shifted(self.row_name, start))


def _shifted(row_name: Callable[[int], str], start: int) -> Callable[[int], str]:
    return lambda i: row_name(start + i)
