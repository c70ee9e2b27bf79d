"""The reader of workbooks: the text of their worksheets."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterable, Iterator, Sequence
from datetime import date, datetime, time, timedelta
from itertools import chain, pairwise
from typing import Any

import numpy as np

from fogml.readers.cell_marks import CellMarks, is_marked, letters, marks_of
from fogml.readers.columns import BLOCK_BYTES, Container, Rows, Spool

_SHOWN_AS_HELD = "[1]"
"""What the header of a column says whose cells are shown in percent and held as a share, as they are read."""


def _with_midnights(rows: Iterable[Sequence[Any]]) -> Iterator[list[Any]]:
    """Rows whose dates are midnights where the cell above or below is a date with a time of day."""
    above: list[Any] = []
    for row, below in pairwise(chain(map(list, rows), [[]])):
        for place, value in enumerate(row):
            beside = (other[place] for other in (above, below) if place < len(other))
            if type(value) is date and any(isinstance(other, datetime) for other in beside):
                row[place] = datetime.combine(value, time())
        yield row
        above = row


class Sheet:
    """A worksheet as the text of a CSV file.

    Cells that are shown in percent are so where a text above them says %, and else as they are held. Formulas
    that nothing has calculated are empty.

    Attributes
    ----------
    told
        What the parent hears: columns of durations [s]; of TRUE or FALSE with their first lines; letters of
        columns of shares that are shown in percent, and of formulas without values; of rows that are not
        shown how many hold something, and the line of the first.
    """

    ndim = 1
    dtype = np.dtype("S")

    def __init__(self, spool: Spool, rows: Any, marks: CellMarks) -> None:
        self.content = Rows(spool, np.uint8)
        self.is_empty = True
        durations: set[int] = set()
        switches: dict[int, int] = {}
        shares: set[int] = set()
        hidden: list[int] = []
        above: dict[int, str] = {}
        text = io.StringIO()
        writer = csv.writer(text, lineterminator="\n")
        for line, row in enumerate(_with_midnights(rows), start=1):
            for place, value in enumerate(row):
                if isinstance(value, timedelta):
                    durations.add(place)
                elif isinstance(value, bool):
                    switches.setdefault(place, line)
                elif isinstance(value, str) and value and marks.percent:
                    above[place] = above.get(place, "") + value
            for place in marks.uncalculated:
                if place < len(row) and is_marked(marks.uncalculated, place, line - 1):
                    row[place] = None
            for place in marks.percent:
                if place < len(row) and is_marked(marks.percent, place, line - 1):
                    if "%" in above.get(place, ""):
                        row[place] = float(f"{100.0 * row[place]:.15g}")
                    elif _SHOWN_AS_HELD not in above.get(place, ""):
                        shares.add(place)
            if line - 1 in marks.hidden and any(value not in (None, "") for value in row):
                hidden.append(line)
            writer.writerow([_cell(value) for value in row])
            if text.tell() > BLOCK_BYTES:
                self.flush(text)
        self.flush(text)
        self.shape = (self.content.count,)
        self.told = {
            "durations": sorted(durations),
            "switches": sorted(switches.items()),
            "shares": [letters(place) for place in sorted(shares)],
            "uncalculated": [letters(place) for place in sorted(marks.uncalculated)],
            "hidden_rows": (len(hidden), *hidden[:1]),
        }

    def flush(self, text: io.StringIO) -> None:
        """Put what was written so far away."""
        part = text.getvalue()
        self.is_empty = self.is_empty and not part.strip(",\n")
        self.content += part.encode()
        text.seek(0)
        text.truncate()

    def text(self, start: int, stop: int) -> Any:
        """Bytes of the text from one place to another."""
        return self.content.read(None, start, stop)


class Workbook(Container):
    """A workbook: the text of each worksheet that is not empty, under its name; hidden ones come last."""

    def __init__(self, path: str, keys: list[str]) -> None:
        from python_calamine import CalamineWorkbook, SheetVisibleEnum

        super().__init__()
        self.sheets: dict[str, Any] = {}
        marks = marks_of(path)
        self.is_uncalculated = any(one.uncalculated for one in marks.values())
        with CalamineWorkbook.from_path(path) as book:
            self.hidden = [s.name for s in book.sheets_metadata if s.visible != SheetVisibleEnum.Visible]
            for name in sorted(book.sheet_names, key=self.hidden.__contains__):
                held = book.get_sheet_by_name(name)
                # From the first row, as in the program that shows them, though nothing stands in it.
                sheet = Sheet(self.spool, held.iter_rows(), marks.get(name, CellMarks()))
                if not sheet.is_empty:
                    self.add("", name, None, sheet)
                    self.sheets[name] = sheet.told

    @property
    def told(self) -> dict[str, Any]:
        """What the parent hears: also hidden sheets, what each tells, and of formulas without values."""
        more = {"hidden": self.hidden, "sheets": self.sheets, "is_uncalculated": self.is_uncalculated}
        return {**super().told, **more}


def _cell(value: Any) -> str:
    """A cell as a line of text, dates by ISO 8601, whole numbers without decimals."""
    if value is None or isinstance(value, str):
        return " ".join((value or "").replace("\0", "").splitlines())
    if isinstance(value, bool) or (isinstance(value, float) and value.is_integer() and abs(value) < 1e15):
        return str(int(value))
    if isinstance(value, date) and value.year == 1900:
        return _hours(value)
    if isinstance(value, datetime):
        return value.isoformat(" ")
    if isinstance(value, timedelta):
        return repr(value.total_seconds())
    return value.isoformat() if isinstance(value, date | time) else str(value)


def _hours(value: date) -> str:
    """A date of 1900, which a cell of hours becomes from a day on, as hours, minutes and seconds."""
    moment = value if isinstance(value, datetime) else datetime.combine(value, time())
    minutes, rest = divmod(moment - datetime(1899, 12, 31), timedelta(minutes=1))
    return f"{minutes // 60}:{minutes % 60:02}:{rest.seconds:02}.{rest.microseconds:06}"
