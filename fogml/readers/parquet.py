"""The reader of Parquet files: one array per column, read forward in batches."""

from __future__ import annotations

import os
from collections.abc import Iterator
from typing import Any

import numpy as np

from fogml.arrow_arrays import values_of
from fogml.readers.stored import Refused, text_of

_BUFFER_BYTES = 1 << 20  # read at once from a column's chunk
_BATCH_ROWS = 1 << 16
_UNITS_S = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9}


class Parquet:
    """A Parquet file: one array per column."""

    def __init__(self, path: str, keys: list[str]) -> None:
        from pyarrow import OSFile
        from pyarrow.parquet import ParquetFile

        # Without a buffer, streaming would hold a column's whole row group, however large.
        self.file = ParquetFile(
            OSFile(os.fsencode(path)),  # a name need not be text
            pre_buffer=False,
            memory_map=False,
            buffer_size=_BUFFER_BYTES,
            page_checksum_verification=True,
        )
        schema = self.file.schema_arrow
        self.arrays = [ParquetColumn(self.file, i) for i in range(len(schema.names))]
        metadata = {text_of(key): text_of(value) for key, value in (schema.metadata or {}).items()}
        self.told = {
            "arrays": [array.told for array in self.arrays],
            "facts": {key: metadata[key] for key in keys if key in metadata},
            "origins_s": [array.first_ns / 1e9 if array.is_stamp else None for array in self.arrays],
        }

    def close(self) -> None:
        self.arrays.clear()
        self.file.close()


def nanoseconds(stamps: Any) -> Any:
    """Arrow's stamps as nanoseconds since 1970."""
    import pyarrow as arrow

    return stamps.cast(arrow.timestamp("ns", stamps.type.tz)).cast(arrow.int64())


class ParquetColumn:
    """A column, read forward in batches: a slice that begins where the last one ended costs its own rows."""

    ndim = 1

    def __init__(self, file: Any, index: int) -> None:
        import pyarrow.types as types

        names, held = file.schema_arrow.names, file.schema_arrow.types[index]
        self.file, self.name = file, names[index]
        self.same = names[:index].count(self.name)
        self.shape = (file.metadata.num_rows,)
        kinds = (types.is_floating, types.is_integer, types.is_boolean, types.is_decimal, types.is_null)
        self.is_stamp = types.is_timestamp(held)
        self.is_span = types.is_duration(held) or types.is_time(held)
        kind = "f" if self.is_stamp or self.is_span or any(is_kind(held) for is_kind in kinds) else "O"
        unit = "s" if self.is_stamp or self.is_span else None
        self.told = {"name": self.name[:1000], "unit": unit, "fault": None, "kind": kind}
        self.told |= {"type": str(held)[:60], "shape": list(self.shape)}
        self.at, self.ahead, self.batches = 0, None, iter(())
        self.first_ns = 0
        if self.is_stamp and self.shape[0]:
            first = next(self.parts(0, 1))
            self.first_ns = (nanoseconds(first).to_pylist() or [0])[0] or 0
            self.at = self.shape[0]

    def parts(self, start: int, stop: int) -> Iterator[Any]:
        """The rows from `start` to `stop`, as Arrow holds them, in pieces."""
        if start == 0 or start < self.at:
            rows = min(max(stop - start, 1), _BATCH_ROWS)
            batches = self.file.iter_batches(batch_size=rows, columns=[self.name], use_threads=False)
            self.at, self.ahead, self.batches = 0, None, (batch.column(self.same) for batch in batches)
        while self.at < stop:
            part = self.ahead if self.ahead is not None else next(self.batches, None)
            if part is None:
                raise Refused(f"row {self.at + 1} of column {self.name} is missing")
            self.ahead = None
            if len(part) > stop - self.at:
                part, self.ahead = part[: stop - self.at], part[stop - self.at :]
            skipped = min(max(start - self.at, 0), len(part))
            self.at += len(part)
            if self.at == self.shape[0]:
                self.batches = iter(())  # what it took is there for the next column
            yield part[skipped:]

    def samples(self, start: int, stop: int) -> Iterator[np.ndarray[Any, Any]]:
        """The rows from `start` to `stop` as numbers, piece by piece."""
        for piece in self.parts(start, stop):
            if self.is_stamp:
                since = values_of(nanoseconds(piece).fill_null(self.first_ns))
                held = np.where(values_of(piece.is_null()), np.nan, since - self.first_ns)
                yield held / 1e9
            elif self.is_span:
                yield (
                    values_of(piece.cast(f"int{piece.type.bit_width}").cast("float64", safe=False))
                    * _UNITS_S[piece.type.unit]
                )
            else:
                # Integers beyond 2^53, such as nanoseconds since 1970, are rounded to the nearest number.
                yield values_of(piece.cast("float64", safe=False))

    def marks(self, most: int, longest: int) -> tuple[list[str], np.ndarray[Any, Any]]:
        """The different texts of a column, at most so many and so long, and each row's place among them."""
        found: dict[str, int] = {}
        codes = np.empty(self.shape[0])
        at = 0
        for piece in self.parts(0, self.shape[0]):
            for value in piece.to_pylist():
                mark = text_of(value)
                if len(mark) > longest:  # cut, two that differ behind it would be one
                    raise Refused(f"a mark of more than {longest} characters")
                codes[at] = found.setdefault(mark, len(found))
                at += 1
            if len(found) > most:
                raise Refused(f"more than {most} different marks")
        return list(found), codes
