"""Which format a file has, and where it is read: a worksheet or a packed log is unpacked as a CSV file."""

from __future__ import annotations

import weakref
from collections.abc import Collection, Iterator, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, replace
from itertools import chain
from pathlib import Path
from typing import Any

import numpy as np

from fogml.errors import InputError, counted, listed, quoted
from fogml.folders import with_slashes
from fogml.outputs import scratch_folder
from fogml.readers import READERS, reader_of, reader_of_content
from fogml.runs.columns import DUTY, column_spec, parse_header
from fogml.runs.csv_dialect import has_rows, is_sure
from fogml.runs.findings import Finding
from fogml.runs.raw_table import RawTable, empty_file
from fogml.runs.reader_process import StoredArray, StoredFile, stored_file
from fogml.runs.reading_limits import DEFAULT_LIMITS, ReadingLimits
from fogml.signals.large import no_room

HOLDING = ("workbook", "packed")
"""Formats that hold the text of a CSV file."""


class HeldText:
    """That text as a file of the same name, in a folder that is there as long as this object is.

    `path` is the file that holds it, of a format of `HOLDING`.

    Raises
    ------
    InputError
        If it holds none or several, another format, or is damaged.
    """

    def __init__(self, path: Path, kind: str, limits: ReadingLimits) -> None:
        held = ExitStack()
        away = weakref.finalize(self, held.close)
        self.path = held.enter_context(scratch_folder()) / path.name
        self.findings: tuple[Finding, ...] = ()
        self.durations: Collection[int] = ()
        self._switches: dict[int, int] = {}
        self._file = path.name
        self._is_uncalculated = False
        try:
            self._unpack(path, kind, limits)
        except BaseException:
            away()
            raise

    def _unpack(self, path: Path, kind: str, limits: ReadingLimits) -> None:
        with stored_file(path, kind, (), limits) as stored:
            array, *others = (_sheets if kind == "workbook" else _member)(path, stored)
            parts = stored.text(array)
            first = next(parts, b"")
            self._is_uncalculated = stored.told.get("is_uncalculated", False)
            if kind == "packed":
                _check_text(path, first)
            elif not has_rows(first):
                self.check_values("")
            sheet = stored.told.get("sheets", {}).get(array.name, {})
            self.durations = sheet.get("durations", ())
            self._switches = dict(sheet.get("switches", ()))
            self.findings = tuple(_of_cells(sheet))
            if array.name in stored.told.get("hidden", ()):
                message = (
                    f"the hidden sheet {quoted(array.name)} is read, as no sheet that is shown holds a run"
                )
                self.findings += (Finding("hidden_sheet", message),)
            if unread := [sheet.name for sheet in others if sheet.name not in stored.told.get("hidden", ())]:
                message = (
                    f"the sheet {quoted(array.name)} is read, and {listed(map(quoted, unread))} not, which "
                    "may hold a run too; save it as a file of its own to read it"
                )
                self.findings += (Finding("other_sheets", message),)
            try:
                with self.path.open("wb") as text:
                    text.writelines(chain((first,), parts))
            except OSError as error:
                raise no_room(max(array.shape), error) from None

    def keeping(self, table: RawTable) -> RawTable:
        """The table, with its file kept as long as it may be asked for the name of a row.

        Raises
        ------
        InputError
            If a column of the run format is empty, save one row perhaps from which formulas go on, and the
            workbook has formulas without values; or if one that is no switch holds TRUE or FALSE.
        """
        for place, name in enumerate(parse_header(cell)[0] for cell in table.cells):
            spec = column_spec(name)
            if place in self._switches and spec is not None and spec.internal != DUTY:
                where = f"{self._file}, line {self._switches[place]}, column '{name}'"
                raise InputError(
                    f"{where}: holds TRUE or FALSE, where a number was expected; correct the cell"
                )
        for cell, values in table.columns.items():
            self.check_column(parse_header(cell)[0], int(np.isfinite(values).sum()), len(values))
        named = table.row_name
        return replace(table.noting(self.findings), row_name=lambda i: named(i) if self else "")

    def check_column(self, name: str, filled: int, rows: int) -> None:
        """As `keeping`, of one column by its name and how many of its rows hold something."""
        is_known = column_spec(name) is not None or name.startswith("gyro_")
        if is_known and filled < min(rows, 2):
            self.check_values(f", column '{name}'")

    def check_values(self, place: str) -> None:
        """Refuse a workbook of formulas without values."""
        if self._is_uncalculated:
            raise InputError(
                f"{self._file}{place}: empty, and the workbook holds formulas without values; open the "
                "file in a spreadsheet program and save it"
            )


def _of_cells(sheet: Mapping[str, Any]) -> Iterator[Finding]:
    """What is to be said of cells that a spreadsheet program shows otherwise than they are read."""
    count, *lines = sheet.get("hidden_rows", (0,))
    if count:
        message = (
            f"{counted(count, 'row')} that the sheet does not show, the first line {lines[0]}, read as any "
            "other; delete them, or copy those that are shown to a file of their own, if they are not meant"
        )
        yield Finding("hidden_rows", message, row=lines[0], count=count)
    if empty := sheet.get("uncalculated"):
        message = (
            f"column {listed(empty)} holds formulas without values, which are missing; open the file in a "
            "spreadsheet program and save it"
        )
        yield Finding("uncalculated", message, count=len(empty))
    if shares := sheet.get("shares"):
        message = (
            f"cells shown in percent in column {listed(shares)} are read as shares, 50 % as 0.5; write "
            "'[%]' in the header where percent are meant, '[1]' where not"
        )
        yield Finding("percent_cells", message, count=len(shares))


def _sheets(path: Path, stored: StoredFile) -> list[StoredArray]:
    """The worksheets with a clock and a gyro, else the first of all; hidden ones come last."""
    if not stored.arrays:
        raise InputError(f"{path.name}: holds no cells; a header and samples were expected")
    sure = [sheet for sheet in stored.arrays if is_sure(next(stored.text(sheet), b""))]
    return sure or list(stored.arrays[:1])


def _member(path: Path, stored: StoredFile) -> Sequence[StoredArray]:
    """The only file in an archive."""
    if len(stored.arrays) != 1:
        names = listed(array.name for array in stored.arrays)
        held = f"{len(stored.arrays)} files ({names})" if stored.arrays else "no file"
        raise InputError(f"{path.name}: holds {held}, where one CSV file was expected; unpack it first")
    return stored.arrays


def _check_text(path: Path, head: bytes) -> None:
    """Refuse what is no text by its first bytes."""
    if not head:
        raise empty_file(path.name)
    if (reader := reader_of_content(head, "")) is not None:
        raise InputError(
            f"{path.name}: holds a {reader.label} file, where a CSV file was expected; unpack it first"
        )


_HEAD_BYTES = 1024
_CSV_SUFFIXES = (".csv", ".tsv")
_JSON_SUFFIXES = (".json", ".jsonl", ".ndjson")
_FOREIGN = {
    b"7z\xbc\xaf": "a 7-Zip archive; unpack it first",
    b"%PDF": "a PDF; export the table as CSV",
    b"ARROW1": "a Feather (Arrow) file; write it as Parquet",
    b"ORC": "an ORC file; write it as Parquet",
    b"<stata_dta>": "a Stata file; write it as Parquet or CSV",
    b"$FL": "an SPSS file; write it as Parquet or CSV",
    bytes(12) + b"\xc2\xea\x81\x60": "a SAS file; write it as Parquet or CSV",
    b"\x80\x04\x95": "a pickle, which would run what it holds; write it as Parquet",
    b"\x80\x05\x95": "a pickle, which would run what it holds; write it as Parquet",
    b"CDF\x01": "a netCDF 3 file; write it as netCDF 4, which is HDF5, or as CSV",
    b"CDF\x02": "a netCDF 3 file; write it as netCDF 4, which is HDF5, or as CSV",
    b"r\x02\x01\0": "a Stata file; write it as Parquet or CSV",
    b"SQLite format 3\0": "an SQLite database; write its table as CSV or Parquet",
    **dict.fromkeys((b"<html", b"<!doctype", b"<table", b"<?xml"), "a page or XML; save its table as CSV"),
}


@dataclass(frozen=True)
class Opened:
    """A file as it is read: its format and its place, of text within another file where it lies unpacked."""

    kind: str
    path: Path
    within: HeldText | None = None

    @property
    def durations(self) -> Collection[int]:
        """Places of columns that are durations, in seconds whatever their header says."""
        return self.within.durations if self.within else ()

    @property
    def size_mb(self) -> float:
        """What it holds, unpacked where it tells [MB]."""
        size = float(self.path.stat().st_size)
        if self.kind == "parquet":
            from fogml.runs.column_files import parquet_values

            size = max(size, 8.0 * parquet_values(self.path))
        return size / 1e6

    def keeping(self, table: RawTable) -> RawTable:
        """A table of the file, which is kept as long as the table."""
        return self.within.keeping(table) if self.within else table


def opened(path: Path, limits: ReadingLimits = DEFAULT_LIMITS) -> Opened:
    """A file of any format; text within another file is unpacked, and is CSV then."""
    kind = file_format(path)
    if kind not in HOLDING:
        return Opened(kind, path)
    text = HeldText(path, kind, limits)
    return Opened("csv", text.path, text)


def file_format(path: Path) -> str:
    """Which of the formats a file has, told by its first bytes: ``csv`` or the name of a reader.

    Raises
    ------
    InputError
        If it is missing, no file, not readable, empty, of a known format that holds no run, or
        of another format than its suffix says.
    """
    kind = _format_of_content(path)
    suffix = path.suffix.lower()
    stated = [reader for reader in READERS if suffix in reader.suffixes]
    # Programs that load pages leave a packed file under the name that its text has.
    is_text = kind in ("csv", "packed") and (suffix in _CSV_SUFFIXES or not stated)
    if is_text or kind in [r.name for r in stated]:
        return kind
    if kind == "csv":
        label = stated[0].label
        told = f"damaged or no {label} file (its first bytes are not {label}'s)"
        raise InputError(f"{path.name}: {told}; if it is text, rename it to '{path.stem}.csv'")
    reader = reader_of(kind)
    if not stated and suffix not in _CSV_SUFFIXES:
        return kind
    label = stated[0].label if stated else "CSV"
    do = "unpack it first" if kind == "packed" else f"rename it to '{path.stem}{reader.suffixes[0]}'"
    raise InputError(
        f"{path.name}: its content is of the format {reader.label}, and it is named as {label}; {do}"
    )


def _of_shipped(path: Path) -> str:
    name = str(path).removeprefix("shipped:")
    return "" if name == str(path) else f"; in Python a recording that ships is fogml.shipped_run('{name}')"


def _format_of_content(path: Path) -> str:
    try:
        if not path.exists():
            raise InputError(f"{path}: no such file{with_slashes(path)}{_of_shipped(path)}")
        if path.is_dir() and (path / "metadata.yaml").is_file():
            raise InputError(f"{path}: is the folder of a ROS 2 bag; name its .db3 or .mcap file")
        if path.is_dir():
            raise InputError(f"{path}: is a folder; name a file")
        if not path.is_file():
            raise InputError(f"{path}: is no ordinary file; save the recording to one first")
        with path.open("rb") as file:
            head = file.read(_HEAD_BYTES)
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror or error})") from None
    if not head:
        raise empty_file(path.name)
    if (reader := reader_of_content(head, path.suffix)) is not None:
        return reader.name
    for magic, what in _FOREIGN.items():
        if head.startswith(magic) or head.lower().lstrip().startswith(magic):
            raise InputError(f"{path.name}: is {what}")
    if path.suffix.lower() in _JSON_SUFFIXES and head.lstrip().startswith((b"{", b"[")):
        raise InputError(f"{path.name}: is JSON; write its columns as CSV or Parquet")
    return "csv"
