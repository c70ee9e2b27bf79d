"""Named columns in groups, read where they are asked for: what readers of container formats share."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fogml.readers.spool import Rows, Spool

Slice = Callable[[int, int], Any]
MOST_COLUMNS = 5000
"""Of a file: what is said of each is held and sent, 200 bytes or so, before anything is read."""


class Column:
    """A column of `count` numbers that a function reads from one row to another."""

    ndim = 1
    dtype = np.dtype(np.float64)

    def __init__(self, count: int, read: Slice) -> None:
        self.shape = (count,)
        self.read = read

    def __getitem__(self, part: tuple[slice]) -> NDArray[np.float64]:
        return np.asarray(self.read(part[0].start, part[0].stop), dtype=np.float64)


class Container:
    """Columns in groups, as `fogml.runs.reader_child` answers for them."""

    def __init__(self) -> None:
        self.arrays: list[Any] = []
        self.described: list[dict[str, Any]] = []
        self.origin_s: float | None = None
        """Seconds from 1970 to the time 0 of its columns, where the format has a date."""
        self.left_out: dict[str, tuple[int, int]] = {}
        """Groups of which columns are left out: how many there are, and how many of the first are given."""
        self._spool: Spool | None = None

    @property
    def told(self) -> dict[str, Any]:
        """What the parent hears."""
        return {"arrays": self.described, "origin_s": self.origin_s, "left_out": self.left_out}

    def add(self, group: str, name: str, unit: str | None, array: Any) -> None:
        """One more column."""
        if len(self.arrays) >= MOST_COLUMNS:
            raise ValueError(f"more than {MOST_COLUMNS} columns")
        self.arrays.append(array)
        self.described.append(
            {
                "group": str(group)[:200],
                "name": str(name)[:200],
                "unit": str(unit)[:60] if unit else None,
                "fault": None,
                "kind": "f",
                "type": "numbers",
                "shape": [int(array.shape[0])],
            }
        )

    @property
    def spool(self) -> Spool:
        """Where tables are kept that are unpacked as they are read."""
        if self._spool is None:
            self._spool = Spool()
        return self._spool

    def add_rows(
        self,
        group: str,
        name: str,
        unit: str | None,
        rows: Rows,
        field: str | None = None,
        change: Callable[[Any], Any] = np.asarray,
    ) -> None:
        """A field of a table, or the rows of a plain one, with what turns the values into numbers."""
        self.add(group, name, unit, Column(rows.count, lambda a, b: change(rows.read(field, a, b))))

    def close(self) -> None:
        """Let go of what is open."""
        self.arrays.clear()
        if self._spool is not None:
            self._spool.close()
