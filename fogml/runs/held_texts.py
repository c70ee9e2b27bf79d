"""The text of a CSV file that lies within another one: a worksheet of a workbook, a compressed log."""

from __future__ import annotations

import weakref
from contextlib import ExitStack
from dataclasses import replace
from itertools import chain
from pathlib import Path

import numpy as np

from fogml.errors import InputError, listed, quoted
from fogml.outputs import scratch_folder
from fogml.readers import UNCALCULATED, reader_of_content
from fogml.runs.columns import column_spec, parse_header
from fogml.runs.csv_dialect import has_rows, is_sure
from fogml.runs.findings import Finding
from fogml.runs.raw_table import RawTable, empty_file
from fogml.runs.reader_process import StoredArray, StoredFile, stored_file
from fogml.runs.reading_limits import ReadingLimits
from fogml.signals.large import no_room

HOLDING = ("workbook", "packed")
"""Formats that hold the text of a CSV file."""


class HeldText:
    """That text as a file of the same name, in a folder that is there as long as this object is.

    Parameters
    ----------
    path
        The file that holds it.
    kind
        Its format, one of `HOLDING`.
    limits
        What unpacking may take.

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
        self._of = path, kind, limits
        try:
            self._unpack(path, kind, limits)
        except BaseException:
            away()
            raise

    def _unpack(self, path: Path, kind: str, limits: ReadingLimits) -> None:
        with stored_file(path, kind, (), limits) as stored:
            array = (_sheet if kind == "workbook" else _member)(path, stored)
            parts = stored.text(array)
            first = next(parts, b"")
            if kind == "packed":
                _check(path, first)
            elif not has_rows(first):
                self._check_values("")
            if array.name in stored.told.get("hidden", ()):
                message = (
                    f"the hidden sheet {quoted(array.name)} is read, as no sheet that is shown holds a run"
                )
                self.findings = (Finding("hidden_sheet", message),)
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
            workbook has formulas without values.
        """
        for cell, values in table.columns.items():
            name = parse_header(cell)[0]
            is_known = column_spec(name) is not None or name.startswith("gyro_")
            if is_known and np.count_nonzero(np.isfinite(values)) < min(len(values), 2):
                self._check_values(f", column '{name}'")
        named = table.row_name
        return replace(table.noting(self.findings), row_name=lambda i: named(i) if self else "")

    def _check_values(self, place: str) -> None:
        """Refuse a workbook of formulas without values."""
        path, kind, limits = self._of
        if kind != "workbook":
            return
        with stored_file(path, kind, (UNCALCULATED,), limits) as stored:
            if stored.told[UNCALCULATED]:
                raise InputError(
                    f"{path.name}{place}: empty, and the workbook holds formulas without values; open the "
                    "file in a spreadsheet program and save it"
                )


def _sheet(path: Path, stored: StoredFile) -> StoredArray:
    """The first worksheet with a clock and a gyro, else the first; hidden ones come last."""
    if not stored.arrays:
        raise InputError(f"{path.name}: holds no cells; a header and samples were expected")
    sure = (sheet for sheet in stored.arrays if is_sure(next(stored.text(sheet))))
    return next(sure, stored.arrays[0])


def _member(path: Path, stored: StoredFile) -> StoredArray:
    """The only file in an archive."""
    if len(stored.arrays) != 1:
        names = listed(array.name for array in stored.arrays)
        held = f"{len(stored.arrays)} files ({names})" if stored.arrays else "no file"
        raise InputError(f"{path.name}: holds {held}, where one CSV file was expected; unpack it first")
    return stored.arrays[0]


def _check(path: Path, head: bytes) -> None:
    """Refuse what is no text by its first bytes."""
    if not head:
        raise empty_file(path.name)
    if (reader := reader_of_content(head, "")) is not None:
        raise InputError(
            f"{path.name}: holds a {reader.label} file, where a CSV file was expected; unpack it first"
        )
