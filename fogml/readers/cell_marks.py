"""What the XML of a workbook says of cells beside their values: shown in percent, hidden, never calculated.

SpreadsheetML (ECMA-376, part 1, chapter 18). Workbooks of other formats have no such marks here.
"""

from __future__ import annotations

import posixpath
import re
import zipfile
from collections.abc import Callable
from typing import Any
from xml.parsers import expat

_PERCENT_FORMATS = frozenset(("9", "10"))
_LITERAL = re.compile(r'"[^"]*"|\\.|\[[^]]*\]')
"""Of a number format (18.8.30): what is shown as it stands, and colours."""
_PART_BYTES = 1 << 20
_WORDS = re.compile(rb'hidden="(?:1|true)"|[<:]f[ />]')
Attributes = dict[str, str]


class CellMarks:
    """The marks of a worksheet's cells, by column and row from 0.

    Attributes
    ----------
    percent
        Cells that are shown in percent: 0.5 as 50 %.
    uncalculated
        Cells of formulas that nothing has calculated: without a value; or 0, as some libraries write it, in a
        column in which no formula has another, where the workbook asks to be calculated as it is loaded.
    hidden
        Rows that are not shown.
    """

    def __init__(self) -> None:
        self.percent: dict[int, bytearray] = {}
        self.uncalculated: dict[int, bytearray] = {}
        self.hidden: set[int] = set()


def is_marked(marks: dict[int, bytearray], column: int, row: int) -> bool:
    """Whether a cell has a mark."""
    held = marks.get(column, b"")
    return row < len(held) and bool(held[row])


def marks_of(path: str) -> dict[str, CellMarks]:
    """The marks of a workbook's sheets that have any, by the sheets' names."""
    if not zipfile.is_zipfile(path):
        return {}
    with zipfile.ZipFile(path) as archive:
        if "xl/workbook.xml" not in archive.namelist():
            return {}
        sheets: dict[str, str] = {}
        places: dict[str, str] = {}
        stale: list[bool] = []

        def start(tag: str, stated: Attributes) -> None:
            if tag == "sheet":
                sheets[stated["name"]] = next((v for k, v in stated.items() if k.endswith(":id")), "")
            elif tag == "calcPr":
                stale.append(stated.get("fullCalcOnLoad") in ("1", "true"))
            elif tag == "Relationship":
                places[stated["Id"]] = posixpath.join("/xl", stated["Target"]).lstrip("/")

        _parse(archive, "xl/workbook.xml", start)
        _parse(archive, "xl/_rels/workbook.xml.rels", start)
        percents = _percent_styles(archive)
        held = {name: places.get(key, "") for name, key in sheets.items()}
        return {
            name: _Sheet(archive, member, percents, any(stale)).marks
            for name, member in held.items()
            if member in archive.namelist() and (percents or _holds_words(archive, member))
        }


def _parse(
    archive: zipfile.ZipFile,
    member: str,
    start: Callable[[str, Attributes], None],
    end: Callable[[str], None] | None = None,
    text: Callable[[str], None] | None = None,
) -> None:
    """Tell the tags of a member of a workbook, without their prefixes; nothing of one that is not there."""
    if member not in archive.namelist():
        return
    parser = expat.ParserCreate()
    parser.buffer_text = True
    parser.StartElementHandler = lambda tag, stated: start(tag.rpartition(":")[2], stated)
    if end is not None:
        parser.EndElementHandler = lambda tag: end(tag.rpartition(":")[2])
    parser.CharacterDataHandler = text
    with archive.open(member) as file:
        parser.ParseFile(file)


def _holds_words(archive: zipfile.ZipFile, member: str) -> bool:
    """Whether a worksheet may have formulas or hidden rows: most have none, and a search is quick."""
    before = b""
    with archive.open(member) as file:
        while part := file.read(_PART_BYTES):
            if _WORDS.search(before + part):
                return True
            before = part[-16:]
    return False


def _percent_styles(archive: zipfile.ZipFile) -> frozenset[str]:
    """The places of cell formats, as cells state them, that show percent."""
    formats, found, above = set(_PERCENT_FORMATS), [], [""]

    def start(tag: str, stated: Attributes) -> None:
        if tag == "numFmt" and "%" in _LITERAL.sub("", stated.get("formatCode", "")):
            formats.add(stated["numFmtId"])
        elif tag == "xf" and above[-1] == "cellXfs":
            found.append(stated.get("numFmtId") in formats)
        above.append(tag)

    def end(tag: str) -> None:
        above.pop()

    _parse(archive, "xl/styles.xml", start, end)
    return frozenset(str(i) for i, is_percent in enumerate(found) if is_percent)


class _Sheet:
    """Reads a worksheet's marks."""

    def __init__(self, archive: zipfile.ZipFile, member: str, percents: frozenset[str], stale: bool) -> None:
        self.marks, self.percents, self.stale = CellMarks(), percents, stale
        self.calculated: set[int] = set()
        self.row = self.column = -1
        self.cell: Attributes = {}
        self.value, self.is_formula, self.is_value = "", False, False
        _parse(archive, member, self.start, self.end, self.text)
        for column in self.calculated & set(self.marks.uncalculated) if stale else ():
            del self.marks.uncalculated[column]

    def start(self, tag: str, stated: Attributes) -> None:
        if tag == "row":
            self.row, self.column = int(stated.get("r", self.row + 2)) - 1, -1
            if stated.get("hidden") in ("1", "true"):
                self.marks.hidden.add(self.row)
        elif tag == "c":
            self.column = _column(stated["r"]) if "r" in stated else self.column + 1
            self.cell, self.value, self.is_formula = stated, "", False
        elif tag in ("f", "v"):
            self.is_formula, self.is_value = self.is_formula or tag == "f", tag == "v"

    def text(self, content: str) -> None:
        if self.is_value:
            self.value += content

    def end(self, tag: str) -> None:
        self.is_value = False
        if tag != "c":
            return
        value, is_number = self.value.strip(), self.cell.get("t", "n") == "n"
        if is_number and value and self.cell.get("s") in self.percents:
            self.mark(self.marks.percent)
        if self.is_formula and self.cell.get("t") != "str":
            is_zero = self.stale and is_number and not value.strip("0.")
            if not value or is_zero:
                self.mark(self.marks.uncalculated)
            else:
                self.calculated.add(self.column)

    def mark(self, marks: dict[int, bytearray]) -> None:
        held: Any = marks.setdefault(self.column, bytearray())
        held.extend(bytes(max(self.row + 1 - len(held), 0)))
        held[self.row] = 1


def _column(reference: str) -> int:
    """The place from 0 of a cell's column, as ``AB12`` tells it."""
    place = 0
    for letter in reference.rstrip("0123456789"):
        place = 26 * place + ord(letter) - ord("A") + 1
    return place - 1


def letters(place: int) -> str:
    """What a spreadsheet program calls the column at a place from 0."""
    return (letters(place // 26 - 1) if place > 25 else "") + chr(ord("A") + place % 26)
