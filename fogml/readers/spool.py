"""Tables that are unpacked block by block into a file of no name, column by column within each block.

Formats whose messages of all kinds lie mixed are read once from first to last; what is held of them is one
block of each kind. The file lies where the system keeps temporary ones (``TMPDIR``);
it goes with the process.
"""

from __future__ import annotations

import os
import tempfile
from typing import Any

import numpy as np
from numpy.typing import NDArray

BLOCK_BYTES = 1 << 18
"""Held of each table before it is written; files of vehicles hold a hundred tables."""


class Spool:
    """The file behind some tables."""

    def __init__(self) -> None:
        self.file = tempfile.TemporaryFile(prefix="fogml-")  # noqa: SIM115  closed by `close`

    def write(self, content: bytes) -> int:
        """Put a block at the end; where it begins."""
        start = self.file.seek(0, os.SEEK_END)
        self.file.write(content)
        self.file.flush()
        return start

    def read(self, start: int, size: int) -> bytes:
        """Bytes from a place on."""
        found = os.pread(self.file.fileno(), size, start)
        if len(found) < size:
            raise ValueError("its unpacked columns were cut off")
        return found

    def close(self) -> None:
        """Let go of the file."""
        self.file.close()


class Rows:
    """A table's rows, added as bytes in order and read back by column.

    Parameters
    ----------
    spool
        Where they are kept.
    layout
        Of a row; fields by name, or one plain type.
    """

    def __init__(self, spool: Spool, layout: Any) -> None:
        self.spool, self.layout = spool, np.dtype(layout)
        self.size = self.layout.itemsize
        self.block = max(BLOCK_BYTES // max(self.size, 1), 1)
        self.ahead = bytearray()
        self.starts: list[int] = []

    def __iadd__(self, content: Any) -> Rows:
        """Add rows by their bytes."""
        self.ahead += content
        whole = self.block * self.size
        while len(self.ahead) >= whole:
            held = self._by_field(bytes(self.ahead[:whole]))
            self.starts.append(self.spool.write(held))
            del self.ahead[:whole]
        return self

    def add(self, rows: NDArray[Any]) -> None:
        """Add rows of the layout."""
        self += np.ascontiguousarray(rows).tobytes()

    @property
    def count(self) -> int:
        """Whole rows so far."""
        return len(self.starts) * self.block + len(self.ahead) // max(self.size, 1)

    def read(self, name: str | None, start: int, stop: int) -> NDArray[Any]:
        """Values `start` to `stop` of a field, of the rows themselves for None."""
        kind, place = (self.layout, 0) if name is None else self.layout.fields[name][:2]
        parts = []
        while start < stop:
            number, first = divmod(start, self.block)
            last = min(stop - number * self.block, self.block)
            if number < len(self.starts):
                at = self.starts[number] + place * self.block + first * kind.itemsize
                parts.append(np.frombuffer(self.spool.read(at, (last - first) * kind.itemsize), kind))
            else:
                rows = np.frombuffer(bytes(self.ahead), self.layout, len(self.ahead) // self.size)[first:last]
                parts.append(rows if name is None else rows[name])
            start += last - first
        return np.concatenate(parts) if parts else np.empty(0, kind)

    def _by_field(self, content: bytes) -> bytes:
        """A block of rows with the values of each field side by side, at the field's place times the rows."""
        if self.layout.fields is None:
            return content
        rows = np.frombuffer(content, self.layout)
        held = bytearray(len(content))
        for name in self.layout.names or ():
            kind, place = self.layout.fields[name][:2]
            values = np.ascontiguousarray(rows[name]).tobytes()
            held[place * len(rows) : place * len(rows) + kind.itemsize * len(rows)] = values
        return bytes(held)
