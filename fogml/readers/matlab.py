"""The reader of MATLAB files, of version 5 and, as HDF5, 7.3."""

from __future__ import annotations

import tempfile
import weakref
from collections.abc import Iterator, Mapping
from typing import Any, Literal

import numpy as np

from fogml.readers.beside import MOST_TEXT, interval_of, text_of
from fogml.readers.stored import (
    DEEPEST,
    MOST_NAMES,
    Hdf5File,
    Refused,
    columns_of,
    described,
    is_dataset,
    plain_struct,
)

_LONG_BYTES = 1 << 20  # of an array that is put away; a file of shorter ones takes little memory
_HDF5_MAGIC = b"\x89HDF\r\n\x1a\n"
USER_BLOCK = 512
"""Bytes of MATLAB's own before what is HDF5 in a file of version 7.3."""
RESERVED = ("units", "facts")
"""Variables that are no columns."""


class Mat:
    """A MATLAB file: variables at the top or in the struct ``run``."""

    def __init__(self, path: str, keys: list[str]) -> None:
        with open(path, "rb") as file:
            head = file.read(USER_BLOCK + len(_HDF5_MAGIC))
        is_hdf5 = head.startswith(_HDF5_MAGIC) or head[USER_BLOCK:].startswith(_HDF5_MAGIC)
        self.opened = Hdf5File(path) if is_hdf5 else None
        variables = self.members(self.opened.file) if self.opened else self.loaded(path)
        run = variables.get("run")
        held: Mapping[str, Any] = run if isinstance(run, dict) else variables
        units = held.get("units", variables.get("units", {}))
        facts = held.get("facts", variables.get("facts"))
        columns = [column for group in self.groups(held) for column in group]
        self.arrays = [array for *_, array in columns]
        told = [
            described(name, array, unit, self.fault_of(array)) | {"group": group}
            for group, name, unit, array in columns
        ]
        self.told = {
            "arrays": told,
            "units": {str(k): text_of(v) for k, v in units.items()} if isinstance(units, dict) else None,
            "facts": plain_struct(facts),
            "interval": interval_of({**self.numbers(variables), **self.numbers(held)}),
        }

    @staticmethod
    def numbers(held: Mapping[str, Any]) -> dict[str, Any]:
        """The single numbers of a struct."""
        found = {name: np.asarray(value) for name, value in held.items() if getattr(value, "size", 1) == 1}
        return {name: value for name, value in found.items() if value.dtype.kind in "fiu"}

    def groups(self, held: Mapping[str, Any], above: str = "") -> Iterator[list[tuple[str, str, Any, Any]]]:
        """Group, name, unit and array of each column, of the structs within a struct too."""
        own = held.get("units")
        units = own if isinstance(own, dict) else {}
        # As a `timeseries` has them, made a struct.
        units |= {"Data": held["Units"]} if isinstance(held.get("Units"), str) else {}
        held = apart(held)
        names = [name for name in held if name not in RESERVED]
        plain = [name for name in names if not isinstance(held[name], dict)]
        yield [
            (above, column, units.get(name) and text_of(units[name]), array)
            for name in plain
            for column, array in columns_of(name, self.array(held[name]))
        ]
        for name in names:
            if isinstance(held[name], dict):
                yield from self.groups(held[name], f"{above}.{name}" if above else name)

    @staticmethod
    def loaded(path: str) -> dict[str, Any]:
        """Variables of a version 5 file: one at a time is held, its long arrays go into temporary files."""
        from scipy.io import loadmat, whosmat

        found = {}
        for name in dict.fromkeys(name for name, *_ in whosmat(path)):
            held = loadmat(path, simplify_cells=True, chars_as_strings=True, variable_names=[name])
            found[name] = put_away(held.pop(name))
        return found

    def fault_of(self, array: Any) -> str | None:
        """As `Hdf5File.fault_of`; what is in memory has none."""
        array = getattr(array, "matrix", array)
        return self.opened.fault_of(array) if self.opened and is_dataset(array) else None

    def members(self, group: Any, depth: int = 0) -> dict[str, Any]:
        """Variables of a version 7.3 file: groups are structs, text is read, samples are not yet."""
        assert self.opened is not None
        h5py = self.opened.h5py
        found: dict[str, Any] = {}
        for name in group:
            is_member = isinstance(group.get(name, getlink=True), h5py.HardLink) and not name.startswith("#")
            if is_member and (value := self.member(group[name], depth)) is not None:
                found[name] = value
        return found

    def member(self, item: Any, depth: int) -> Any:
        """A struct, a list of structs, a text, or samples that are not read yet; None for what is none."""
        assert self.opened is not None
        self.opened.count()
        if isinstance(item, self.opened.h5py.Group) and depth < DEEPEST:
            held = self.members(item, depth + 1)
            return self.each_struct(held, depth) if held and all(map(self.refers, held.values())) else held
        if is_dataset(item):
            return self.text(item) if _class_of(item) == "char" else item
        return None

    def refers(self, value: Any) -> bool:
        """Whether it is a field of an array of structs: references to what each of them holds."""
        assert self.opened is not None
        is_reference = is_dataset(value) and value.dtype == self.opened.h5py.ref_dtype
        return is_reference and not _class_of(value) and self.opened.fault_of(value) is None

    def each_struct(self, fields: Mapping[str, Any], depth: int) -> list[dict[str, Any]]:
        """The structs of an array of structs, as MATLAB counts them."""
        assert self.opened is not None
        count = max(field.size for field in fields.values())
        if count > MOST_NAMES:
            raise Refused(f"an array of more than {MOST_NAMES} structs")
        found: list[dict[str, Any]] = [{} for _ in range(count)]
        for name, field in fields.items():
            # MATLAB counts down the columns, and HDF5 holds its arrays turned over.
            for struct, reference in zip(found, np.asarray(field).reshape(-1)):
                value = self.member(self.opened.file[reference], depth + 1) if reference else None
                if value is not None:
                    struct[name] = value
        return found

    def text(self, item: Any) -> str:
        if item.shape is None:
            return ""
        if item.size > MOST_TEXT or self.opened is None or self.opened.fault_of(item):
            raise Refused("a text that is too long, or stands elsewhere")
        return "".join(chr(int(code)) for code in np.asarray(item).T.reshape(-1))

    @staticmethod
    def array(value: Any) -> Any:
        return value if is_dataset(value) or isinstance(value, PutAway) else np.asarray(value)

    def close(self) -> None:
        self.arrays.clear()
        if self.opened:
            self.opened.close()


class PutAway:
    """An array of numbers in a temporary file; what is read of it is held no longer than it is used."""

    def __init__(self, values: np.ndarray[Any, Any]) -> None:
        self.ndim, self.shape, self.dtype = values.ndim, values.shape, values.dtype
        # Column by column, as they are read.
        self.order: Literal["F", "C"] = "F" if values.flags.f_contiguous else "C"
        self.file = tempfile.TemporaryFile(prefix="fogml-")  # noqa: SIM115  closed with the object
        weakref.finalize(self, self.file.close)
        values.ravel(self.order).tofile(self.file)

    def __getitem__(self, part: Any) -> np.ndarray[Any, Any]:
        return np.array(np.memmap(self.file, self.dtype, "r", shape=self.shape, order=self.order)[part])


def _class_of(dataset: Any) -> str:
    """What MATLAB calls a dataset; nothing for a field of an array of structs."""
    return text_of(dataset.attrs.get("MATLAB_class", b""))


def apart(held: Mapping[str, Any]) -> dict[str, Any]:
    """The members of a struct; of an array of structs each under its place, as MATLAB counts."""
    found: dict[str, Any] = {}
    for name, value in held.items():
        is_array = isinstance(value, list) or (isinstance(value, np.ndarray) and value.dtype == object)
        items = list(np.ravel(np.asarray(value, dtype=object))) if is_array else []
        if items and all(isinstance(item, dict) for item in items[:MOST_NAMES]):
            found |= {f"{name}({i})": item for i, item in enumerate(items[:MOST_NAMES], start=1)}
        else:
            found[name] = value
    return found


def put_away(value: Any) -> Any:
    """A variable whose long arrays of numbers lie in temporary files."""
    if isinstance(value, dict):
        return {name: put_away(item) for name, item in value.items()}
    is_long = isinstance(value, np.ndarray) and value.dtype.kind in "fiub" and value.nbytes >= _LONG_BYTES
    return PutAway(value) if is_long else value
