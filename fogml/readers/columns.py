"""Named columns in groups, read where they are asked for: what readers of container formats share.

Tables that are unpacked block by block into a file of no name, column by column within each block.

Formats whose messages of all kinds lie mixed are read once from first to last; what is held of them is one
block of each kind. The file lies where the system keeps temporary ones (``TMPDIR``);
it goes with the process.

The numbers of a robot's message: their paths, and what gives the values of some of them.
"""

from __future__ import annotations

import math
import os
import tempfile
from collections.abc import Callable, Iterator, Sequence
from operator import attrgetter, itemgetter
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fogml.readers.beside import interval_of

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

    Its `layout` has fields by name, or is one plain type.
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
        self.beside: dict[str, Any] = {}
        """Numbers beside the columns, by their names."""
        self.left_out: dict[str, tuple[int, int]] = {}
        """Groups of which columns are left out: how many there are, and how many of the first are given."""
        self._spool: Spool | None = None

    @property
    def told(self) -> dict[str, Any]:
        """What the parent hears."""
        interval = interval_of(self.beside)
        more = {"origin_s": self.origin_s, "left_out": self.left_out, "interval": interval}
        return {"arrays": self.described, **more}

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

    def refuse(self, name: str, fault: str) -> None:
        """Tell of a column at the top why it is not read."""
        self.add("", name, None, np.empty(0))
        self.described[-1] |= {"fault": fault, "kind": "O"}

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


ToFloats = Callable[[Any], Sequence[float]]
_NUMBER = (bool, int, float, np.number)
_DEEPEST = 5
"""Levels of a message; those that ROS 2 ships have three, results of ROS 1 actions six."""
LONGEST_ARRAY = 16
"""Numbers of an array that are columns: vectors, and matrices up to 3 by 4; scans and images are longer."""
_STAMPS = {("sec", "nanosec"), ("secs", "nsecs"), ("sec", "nsec")}


def leaves(message: Any, above: str = "", depth: int = 0) -> Iterator[tuple[str, Any, ToFloats]]:
    """What holds the numbers of a message: path, value, and what makes numbers of it.

    It is a number, a short array of numbers, or a stamp.
    """
    if isinstance(message, _NUMBER):
        yield above, message, _one
    elif isinstance(message, list | tuple | np.ndarray):
        if len(message) <= LONGEST_ARRAY:
            if all(isinstance(item, _NUMBER) for item in message):
                yield above, message, list
            else:
                for i, item in enumerate(message):
                    yield from leaves(item, f"{above}.{i}", depth + 1)
    elif not isinstance(message, str | bytes | None.__class__):
        fields = message if isinstance(message, dict) else _fields(message)
        if tuple(fields) in _STAMPS:
            yield above, message, _stamp_of(fields, isinstance(message, dict))
        elif depth < _DEEPEST:
            for name, item in fields.items():
                yield from leaves(item, f"{above}.{name}" if above else str(name), depth + 1)


def _fields(message: Any) -> dict[str, Any]:
    known: Any = getattr(message, "__dataclass_fields__", None)
    names = tuple(known or getattr(message, "__slots__", ()))
    return {name: getattr(message, name) for name in names if not name.startswith("__")}


def _one(value: Any) -> tuple[float]:
    return (float(value),)


def _stamp_of(fields: dict[str, Any], is_dict: bool) -> ToFloats:
    """What gives the seconds of a stamp."""
    got = (itemgetter if is_dict else attrgetter)(*fields)

    def seconds(stamp: Any) -> tuple[float]:
        whole, parts = got(stamp)
        return (float(whole) + 1e-9 * float(parts),)

    return seconds


def numbers(message: Any) -> Iterator[tuple[str, float]]:
    """The numbers of a message by their paths, those of short arrays by place; stamps as seconds."""
    for path, value, to_floats in leaves(message):
        found = to_floats(value)
        if to_floats is list:
            yield from ((f"{path}.{i}", float(each)) for i, each in enumerate(found))
        else:
            yield path, found[0]


def stamps_in(message: Any) -> frozenset[str]:
    """Paths of the times that a message holds as seconds and their parts."""
    return frozenset(path for path, _, to_floats in leaves(message) if to_floats not in (_one, list))


def values_of(first: Any, names: Sequence[str]) -> Callable[[Any], Sequence[float]]:
    """What gives the numbers of these paths of a message, NaN where it has none.

    Messages of a topic are mostly of the shape of the first, whose attributes are got at once; what is of
    another, or no object, is searched through.
    """

    def search(message: Any) -> Sequence[float]:
        found = dict(numbers(message))
        return [found.get(name, math.nan) for name in names]

    held = [(path, to_floats, len(to_floats(value))) for path, value, to_floats in leaves(first)]
    paths = [path for path, _ in numbers(first)]
    is_listed = any(part.isdigit() for path, *_ in held for part in path.split("."))
    if isinstance(first, dict) or is_listed or list(names) != paths[: len(names)]:
        return search
    attributes = attrgetter(*(path for path, *_ in held))
    parts = [(to_floats, count) for _, to_floats, count in held]

    def get(message: Any) -> Sequence[float]:
        try:
            found: list[float] = []
            together = attributes(message) if len(parts) > 1 else (attributes(message),)
            for value, (to_floats, count) in zip(together, parts, strict=True):
                floats = to_floats(value)
                if len(floats) != count:
                    return search(message)
                found.extend(floats)
            return found[: len(names)]
        except (AttributeError, TypeError, ValueError):
            return search(message)

    return get
