"""The reader of HDF5 files, and what others share with it: their arrays, and what stands beside them.

Each format is a class with `arrays`, `told` (what the parent hears of them) and `close`.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from fogml.readers.beside import interval_of, plain, tells_interval, text_of, unused
from fogml.readers.columns import LONGEST_ARRAY, MOST_COLUMNS

_PLAIN_FILTERS = frozenset({1, 2, 3, 4, 5, 6, 32000})  # deflate ... scale-offset, and h5py's own lzf
MOST_NAMES = 10_000
DEEPEST = 4  # of groups within groups, as HDF5 makes them of a unit with slashes, too


class Refused(Exception):
    """What a file may not hold."""


def described(name: str, array: Any, unit: Any = None, fault: str | None = None) -> dict[str, Any]:
    """What the parent is told of an array."""
    told: dict[str, Any] = {"name": name[:1000], "unit": unit, "fault": fault}
    if fault is None:
        told |= {"kind": array.dtype.kind, "type": str(array.dtype)[:60]}
        told |= {"shape": [int(size) for size in array.shape]}
    return told


class Hdf5File:
    """An HDF5 file, and what of it is not read."""

    def __init__(self, path: str) -> None:
        import h5py

        self.h5py = h5py
        self.file = h5py.File(path, "r")
        self.seen = 0

    def count(self) -> None:
        """Count a name, or what is referred to.

        Raises
        ------
        Refused
            If there are more than any recording holds.
        """
        self.seen += 1
        if self.seen > MOST_NAMES:
            raise Refused(f"more than {MOST_NAMES} names")

    def fault_of(self, dataset: Any) -> str | None:
        """Why a dataset is not read: its samples lie elsewhere, or other code would unpack them."""
        if dataset.shape is None:
            return "holds nothing"
        if dataset.is_virtual or dataset.external:
            return "refers to samples in another file"
        creation = dataset.id.get_create_plist()
        filters = [creation.get_filter(i)[0] for i in range(creation.get_nfilters())]
        strange = [number for number in filters if number not in _PLAIN_FILTERS]
        return f"is packed by a plug-in (filter {strange[0]})" if strange else None

    def close(self) -> None:
        self.file.close()


class Hdf5(Hdf5File):
    """An HDF5 file: datasets of its root or of the group ``run``, and those of groups within."""

    def __init__(self, path: str, keys: list[str]) -> None:
        super().__init__(path)
        link = self.file.get("run", getlink=True)
        is_group = isinstance(link, self.h5py.HardLink) and isinstance(self.file["run"], self.h5py.Group)
        top = self.file["run"] if is_group else self.only_group(self.file)
        self.arrays: list[Any] = []
        told, changing = [], []
        beside = {key: top.attrs[key] for key in top.attrs if tells_interval(key)}
        for group, name, item, fault in self.within(top):
            if not fault and item.size == 1 and item.dtype.kind in "fiu":
                beside[name] = np.asarray(item)
            changing += [] if fault else unused(name, item.attrs)
            columns = [(group, name, item)] if fault else fields_of(group, name, item)
            unit = None if fault else unit_of(item.attrs)
            for place, column, array in columns:
                if len(self.arrays) >= MOST_NAMES:
                    raise Refused(f"more than {MOST_NAMES} columns")
                self.arrays.append(array if fault else scaled(array, item.attrs))
                told.append(described(column, array, unit, fault) | {"group": place[:200]})
        stated = {key: plain(top.attrs[key]) for key in keys if key in top.attrs}
        self.told = {"arrays": told, "facts": stated, "unused": changing, "interval": interval_of(beside)}

    def within(self, group: Any, above: str = "") -> Iterator[tuple[str, str, Any, str | None]]:
        """Group, name and fault of each dataset of a group and of those within it."""
        yield from ((above, *found) for found in self.datasets(group))
        for name in group if above.count("/") < DEEPEST - 1 else ():
            is_hard = isinstance(group.get(name, getlink=True), self.h5py.HardLink)
            if is_hard and "[" not in name and isinstance(group[name], self.h5py.Group):
                yield from self.within(group[name], f"{above}/{name}" if above else name)

    def only_group(self, group: Any) -> Any:
        """The group that holds the datasets, where it is all that the one above it holds."""
        for _ in range(DEEPEST):
            names = list(group) if len(group) == 1 else []
            is_hard = names and isinstance(group.get(names[0], getlink=True), self.h5py.HardLink)
            if not is_hard or "[" in names[0] or not isinstance(group[names[0]], self.h5py.Group):
                break
            group = group[names[0]]
        return group

    def datasets(self, group: Any, above: str = "", depth: int = 0) -> Iterator[tuple[str, Any, str | None]]:
        """Datasets by name, also where the unit holds a slash, with what keeps them from being read."""
        for name in group:
            self.count()
            full = above + name
            if not isinstance(group.get(name, getlink=True), self.h5py.HardLink):
                yield full, None, "is a link to another place"
                continue
            item = group[name]
            if isinstance(item, self.h5py.Dataset):
                yield full, item, self.fault_of(item)
            elif isinstance(item, self.h5py.Group) and "[" in full and depth < DEEPEST:
                yield from self.datasets(item, full + "/", depth + 1)


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


class FieldColumn:
    """A field of a table whose rows still lie in the file."""

    ndim = 1

    def __init__(self, table: Any, field: str) -> None:
        self.table, self.field = table, field
        self.shape, self.dtype = (table.size,), table.dtype[field]

    def __getitem__(self, part: tuple[slice]) -> Any:
        return self.table[(self.field, *part)]


def fields_of(group: str, name: str, array: Any) -> list[tuple[str, str, Any]]:
    """Group, name and array of each column of a dataset: fields of a table, columns of a narrow matrix."""
    if array.dtype.names and array.ndim == 1:
        kinds = {field: array.dtype[field] for field in array.dtype.names}
        held = [field for field, kind in kinds.items() if kind.kind in "fiub" and not kind.shape]
        return [(f"{group}/{name}" if group else name, field, FieldColumn(array, field)) for field in held]
    is_long = array.ndim == 2 and min(array.shape) <= min(max(array.shape) - 1, LONGEST_ARRAY)
    return [(group, *column) for column in (columns_of(name, array) if is_long else [(name, array)])]


class Scaled:
    """Numbers that are held packed: a factor times what lies in the file, and an offset; NaN for `none`."""

    def __init__(self, array: Any, factor: float, offset: float, none: list[float]) -> None:
        self.array, self.factor, self.offset, self.none = array, factor, offset, none
        self.ndim, self.shape = array.ndim, array.shape

    def __getitem__(self, part: Any) -> Any:
        held = np.asarray(self.array[part])
        found = held.astype(np.float64) * self.factor + self.offset
        # What the type can't hold stands nowhere.
        found[np.isin(held, [v for v in self.none if np.array(v).astype(held.dtype) == v])] = np.nan
        return found


def scaled(array: Any, attributes: Any) -> Any:
    """An array, unpacked as the conventions of netCDF (CF, 2.5.1 and 8.1) say where it has attributes."""
    stated = [plain(attributes.get(key, none)) for key, none in (("scale_factor", 1.0), ("add_offset", 0.0))]
    none = [plain(attributes[key]) for key in ("_FillValue", "missing_value") if key in attributes]
    none = [value for value in none if isinstance(value, int | float)]
    if (stated == [1.0, 0.0] and not none) or not all(isinstance(value, int | float) for value in stated):
        return array
    return Scaled(array, stated[0], stated[1], none)


def unit_of(attributes: Any) -> str | None:
    """The unit that stands beside a dataset; of ``seconds since 2026-03-02`` that before the date."""
    found = {key.lower(): key for key in attributes if key.lower() in ("unit", "units")}
    stated = text_of(attributes[found.get("unit") or found["units"]]) if found else None
    return stated and stated.partition(" since ")[0]


def is_dataset(value: Any) -> bool:
    """Whether samples still lie in the file."""
    return hasattr(value, "is_virtual")


def samples(array: Any, start: int, stop: int) -> Iterator[np.ndarray[Any, Any]]:
    """Samples of a vector along its only long axis, float64, in pieces as they are read."""
    if hasattr(array, "samples"):
        yield from array.samples(start, stop)
        return
    along = max(range(array.ndim), key=lambda axis: array.shape[axis])
    part = tuple(slice(start, stop) if axis == along else 0 for axis in range(array.ndim))
    yield np.ascontiguousarray(array[part], dtype=np.float64)


def plain_struct(value: Any) -> Any:
    """A text, or a struct of plain values; others as what they are called."""
    if isinstance(value, dict):
        return {str(key): plain_struct(item) for key, item in value.items()}
    if is_dataset(value):
        return plain(np.asarray(value)) if value.size == 1 else None
    return None if value is None else plain(value)
