"""Readers of HDF5, MATLAB and Parquet files: their arrays, and what stands beside them.

Each format is a class with `arrays`, `told` (what the parent hears of them) and `close`.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from fogml.readers.columns import MOST_COLUMNS

_PLAIN_FILTERS = frozenset({1, 2, 3, 4, 5, 6, 32000})  # deflate ... scale-offset, and h5py's own lzf
_MOST_NAMES = 10_000
_MOST_TEXT = 1 << 20
_DEEPEST = 4  # of groups that HDF5 makes of a unit with slashes
_HDF5_MAGIC = b"\x89HDF\r\n\x1a\n"
_USER_BLOCK = 512
_BUFFER_BYTES = 1 << 20  # read at once from a column's chunk
_BATCH_ROWS = 1 << 16
_LONGEST_MARK = 100
_RESERVED = ("units", "facts")


class Refused(Exception):
    """What a file may not hold."""


def described(name: str, array: Any, unit: Any = None, fault: str | None = None) -> dict[str, Any]:
    """What the parent is told of an array."""
    told: dict[str, Any] = {"name": name[:1000], "unit": unit, "fault": fault}
    if fault is None:
        told |= {"kind": array.dtype.kind, "type": str(array.dtype)[:60]}
        told |= {"shape": [int(size) for size in array.shape]}
    return told


class Hdf5:
    """An HDF5 file: datasets of its root or of the group ``run``."""

    def __init__(self, path: str, keys: list[str]) -> None:
        import h5py

        self.h5py = h5py
        self.file = h5py.File(path, "r")
        self.seen = 0
        link = self.file.get("run", getlink=True)
        is_group = isinstance(link, h5py.HardLink) and isinstance(self.file["run"], h5py.Group)
        group = self.file["run"] if is_group else self.file
        self.arrays: list[Any] = []
        told = []
        for name, item, fault in self.datasets(group):
            unit = None if fault else item.attrs.get("unit")
            self.arrays.append(item)
            told.append(described(name, item, None if unit is None else text_of(unit), fault))
        stated = {key: plain(group.attrs[key]) for key in keys if key in group.attrs}
        self.told = {"arrays": told, "facts": stated}

    def datasets(self, group: Any, above: str = "", depth: int = 0) -> Iterator[tuple[str, Any, str | None]]:
        """Datasets by name, also where the unit holds a slash, with what keeps them from being read."""
        for name in group:
            self.seen += 1
            if self.seen > _MOST_NAMES:
                raise Refused(f"more than {_MOST_NAMES} names")
            full = above + name
            if not isinstance(group.get(name, getlink=True), self.h5py.HardLink):
                yield full, None, "is a link to another place"
                continue
            item = group[name]
            if isinstance(item, self.h5py.Dataset):
                yield full, item, self.fault_of(item)
            elif isinstance(item, self.h5py.Group) and "[" in full and depth < _DEEPEST:
                yield from self.datasets(item, full + "/", depth + 1)

    def fault_of(self, dataset: Any) -> str | None:
        """Why a dataset is not read: its samples lie elsewhere, or other code would unpack them."""
        if dataset.is_virtual or dataset.external:
            return "refers to samples in another file"
        if dataset.dtype.kind not in "fiub":
            return None
        creation = dataset.id.get_create_plist()
        filters = [creation.get_filter(i)[0] for i in range(creation.get_nfilters())]
        strange = [number for number in filters if number not in _PLAIN_FILTERS]
        return f"is packed by a plug-in (filter {strange[0]})" if strange else None

    def close(self) -> None:
        self.file.close()


class Mat:
    """A MATLAB file: variables at the top or in the struct ``run``."""

    def __init__(self, path: str, keys: list[str]) -> None:
        with open(path, "rb") as file:
            head = file.read(_USER_BLOCK + len(_HDF5_MAGIC))
        is_hdf5 = head.startswith(_HDF5_MAGIC) or head[_USER_BLOCK:].startswith(_HDF5_MAGIC)
        self.opened = Hdf5(path, []) if is_hdf5 else None
        variables = self.members(self.opened.file) if self.opened else self.loaded(path)
        run = variables.get("run")
        structs = [v for v in variables.values() if isinstance(v, dict) and "time" in map(str.lower, v)]
        if not isinstance(run, dict) and "time" not in map(str.lower, variables) and len(structs) == 1:
            run = structs[0]
        held: Mapping[str, Any] = run if isinstance(run, dict) else variables
        units = held.get("units", variables.get("units", {}))
        facts = held.get("facts", variables.get("facts"))
        columns = [
            column
            for name in held
            if name not in _RESERVED
            for column in columns_of(name, self.array(held[name]))
        ]
        names, self.arrays = [name for name, _ in columns], [array for _, array in columns]
        told = [
            described(name, array, fault=self.fault_of(array))
            for name, array in zip(names, self.arrays, strict=True)
        ]
        self.told = {
            "arrays": told,
            "units": {str(k): text_of(v) for k, v in units.items()} if isinstance(units, dict) else None,
            "facts": plain_struct(facts),
        }

    @staticmethod
    def loaded(path: str) -> dict[str, Any]:
        from scipy.io import loadmat

        found = loadmat(path, simplify_cells=True, mat_dtype=False, chars_as_strings=True)
        return {name: value for name, value in found.items() if not name.startswith("__")}

    def fault_of(self, array: Any) -> str | None:
        """As `Hdf5.fault_of`; what is in memory has none."""
        array = getattr(array, "matrix", array)
        return self.opened.fault_of(array) if self.opened and is_dataset(array) else None

    def members(self, group: Any, depth: int = 0) -> dict[str, Any]:
        """Variables of a version 7.3 file: groups are structs, text is read, samples are not yet."""
        assert self.opened is not None
        h5py = self.opened.h5py
        found: dict[str, Any] = {}
        for name in group:
            is_member = isinstance(group.get(name, getlink=True), h5py.HardLink) and not name.startswith("#")
            item = group[name] if is_member else None
            if isinstance(item, h5py.Group) and depth < _DEEPEST:
                found[name] = self.members(item, depth + 1)
            elif isinstance(item, h5py.Dataset):
                is_text = text_of(item.attrs.get("MATLAB_class", b"")) == "char"
                found[name] = self.text(item) if is_text else item
        return found

    def text(self, item: Any) -> str:
        if item.size > _MOST_TEXT or self.opened is None or self.opened.fault_of(item):
            raise Refused("a text that is too long, or stands elsewhere")
        return "".join(chr(int(code)) for code in np.asarray(item).T.reshape(-1))

    @staticmethod
    def array(value: Any) -> Any:
        return value if is_dataset(value) else np.asarray(value)

    def close(self) -> None:
        self.arrays.clear()
        if self.opened:
            self.opened.close()


class Parquet:
    """A Parquet file: one array per column."""

    def __init__(self, path: str, keys: list[str]) -> None:
        from pyarrow.parquet import ParquetFile

        # Without a buffer, streaming would hold a column's whole row group, however large.
        self.file = ParquetFile(
            path,
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
            "origin_s": next((array.first_ns / 1e9 for array in self.arrays if array.is_stamp), None),
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
        kind = "f" if self.is_stamp or any(is_kind(held) for is_kind in kinds) else "O"
        unit = "s" if self.is_stamp else None
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
            yield part[skipped:]

    def __getitem__(self, part: tuple[slice]) -> np.ndarray[Any, Any]:
        start, stop = part[0].start, part[0].stop
        found, at = np.empty(stop - start), 0
        for piece in self.parts(start, stop):
            if self.is_stamp:
                since = nanoseconds(piece).fill_null(self.first_ns).to_numpy(zero_copy_only=False)
                held = np.where(piece.is_null().to_numpy(zero_copy_only=False), np.nan, since - self.first_ns)
                found[at : at + len(piece)] = held / 1e9
            else:
                # Integers beyond 2^53, such as nanoseconds since 1970, are rounded to the nearest number.
                found[at : at + len(piece)] = piece.cast("float64", safe=False).to_numpy(zero_copy_only=False)
            at += len(piece)
        return found

    def marks(self) -> tuple[list[str], np.ndarray[Any, Any]]:
        """The different texts of a column of marks, and the place of each row's among them."""
        found: dict[str, int] = {}
        codes = np.empty(self.shape[0])
        at = 0
        for piece in self.parts(0, self.shape[0]):
            for value in piece.to_pylist():
                codes[at] = found.setdefault(text_of(value)[:_LONGEST_MARK], len(found))
                at += 1
            if len(found) > _MOST_NAMES:
                raise Refused(f"more than {_MOST_NAMES} different marks")
        return list(found), codes


class MatrixColumn:
    """A column of a matrix whose samples still lie in the file, along its longer axis."""

    ndim = 1

    def __init__(self, matrix: Any, place: int) -> None:
        self.matrix, self.place = matrix, place
        self.along = int(matrix.shape[1] > matrix.shape[0])
        self.shape = (matrix.shape[self.along],)
        self.dtype = matrix.dtype

    def __getitem__(self, part: tuple[slice]) -> Any:
        return self.matrix[(self.place, part[0]) if self.along else (part[0], self.place)]


def columns_of(name: str, array: Any) -> list[tuple[str, Any]]:
    """An array under its name; a matrix as its columns along the longer side, counted from 1."""
    is_numeric = getattr(array, "ndim", 0) == 2 and array.dtype.kind in "fiub"
    if not is_numeric or not 1 < min(array.shape) <= MOST_COLUMNS:
        return [(name, array)]
    return [(f"{name} column {i + 1}", MatrixColumn(array, i)) for i in range(min(array.shape))]


def is_dataset(value: Any) -> bool:
    """Whether samples still lie in the file."""
    return hasattr(value, "is_virtual")


def samples(array: Any, start: int, stop: int) -> np.ndarray[Any, Any]:
    """Samples of a vector along its only long axis, float64."""
    along = max(range(array.ndim), key=lambda axis: array.shape[axis])
    part = tuple(slice(start, stop) if axis == along else 0 for axis in range(array.ndim))
    return np.ascontiguousarray(array[part], dtype=np.float64)


def text_of(value: Any) -> str:
    """A text of an attribute or a variable."""
    text = value.decode("utf-8", errors="replace") if isinstance(value, bytes) else str(value)
    return text[:_MOST_TEXT]


def plain(value: Any) -> Any:
    """A value of one element as Python's own type, None for an array."""
    if isinstance(value, str | bytes):
        return text_of(value)
    if getattr(value, "size", 1) != 1:
        return None
    value = value.item() if hasattr(value, "item") else value
    return value if isinstance(value, bool | int | float) else text_of(value)


def plain_struct(value: Any) -> Any:
    """A text, or a struct of plain values; others as what they are called."""
    if isinstance(value, dict):
        return {str(key): plain_struct(item) for key, item in value.items()}
    if is_dataset(value):
        return plain(np.asarray(value)) if value.size == 1 else None
    return None if value is None else plain(value)
