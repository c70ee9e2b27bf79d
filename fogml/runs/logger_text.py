"""A logger's text file as a table of numbers, by an import profile."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from itertools import chain
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from fogml.arrays import BoolArray, FloatArray, IndexArray
from fogml.errors import InputError, counted, listed, quoted
from fogml.runs.csv_header import another_header, names_others
from fogml.runs.csv_lines import cut_error, cut_line
from fogml.runs.csv_source import CsvSource
from fogml.runs.findings import Finding
from fogml.runs.logger_lines import (
    PART_BYTES,
    FaultyFields,
    Lines,
    cell_words,
    field_numbers,
    field_texts,
    hex_numbers,
    hide_quoted,
    plain_lines,
    shown,
    text_parts,
)
from fogml.runs.other_rate import is_of_another_rate
from fogml.runs.profile_parts import TextLayout
from fogml.runs.stamps import StampClock, Stamps, stamps_of, whole_stamps
from fogml.signals import large

_SIGNATURE_LINES = 20


@dataclass(frozen=True)
class LoggerTable:
    """The source columns that a profile uses, as numbers in the source's own units.

    Attributes
    ----------
    columns
        Source (name or position) to values, shape (n,); NaN in rows of which a source of another rate
        has none.
    rows
        Number of each row among all data rows of the file, shape (n,), counted from 0, so that
        rejected rows keep their place.
    total_rows
        Data rows of the file, rejected ones included.
    findings
        The rejected rows, counted.
    texts
        Source to texts, shape (n,).
    seconds
        Times since the first stamp [s], shape (n,), where the clock is one of stamps.
    stamps
        That clock.
    """

    columns: Mapping[str | int, FloatArray]
    rows: IndexArray
    total_rows: int
    findings: tuple[Finding, ...] = ()
    texts: Mapping[str | int, NDArray[np.str_]] = field(default_factory=dict)
    seconds: FloatArray | None = None
    stamps: Stamps | None = None

    def rejected(self, rows: BoolArray, words: str) -> Finding:
        """What is said of rows that are left out, shape (n,): how many they are, and words of why."""
        count = int(np.count_nonzero(rows))
        row = int(self.rows[np.argmax(rows)]) + 1
        return Finding("rejected_rows", f"{counted(count, 'row')} {words}", row=row, count=count)

    def kept(self, rows: BoolArray | slice, finding: Finding) -> LoggerTable:
        """The table of some of its rows, with what is said of the others."""
        return replace(
            self,
            columns={source: large.chosen(values, rows) for source, values in self.columns.items()},
            texts={source: values[rows] for source, values in self.texts.items()},
            seconds=None if self.seconds is None else large.chosen(self.seconds, rows),
            rows=large.chosen(self.rows, rows),
            findings=(*self.findings, finding),
        )


def read_logger_text(
    path: Path, profile: TextLayout, profile_name: str, part_bytes: int = PART_BYTES
) -> LoggerTable:
    """Read the source columns of a logger's text file.

    A long file is read part by part, its columns kept in temporary files; whether a column is one of another
    rate is told by the first part, and no part may be one of which most is left out.

    Raises
    ------
    InputError
        If the file is missing, is no text of that encoding, is not of the profile's form, or
        holds faulty rows that the profile does not reject; the message names file and line.
    """
    parts = text_parts(path, profile.encoding, part_bytes)
    first = next(parts)
    cut = cut_line(CsvSource(path), profile.text_separator, profile.decimal)
    if cut is not None and not profile.reject.not_numbers:
        raise cut_error(path, cut, "'reject: {not_numbers: true}' in the profile leaves the row out")
    reader = _Reader(path.name, profile, profile_name, is_cut=cut is not None)
    return reader.read(chain([first], parts))


class _Reader:
    def __init__(self, file: str, profile: TextLayout, profile_name: str, is_cut: bool) -> None:
        self.file = file
        self.is_cut = is_cut
        self.profile = profile
        self.hint = f"is this a file for the profile {quoted(profile_name)}?"
        self.lines_before = self.rows_before = 0
        self.clock: StampClock | None = None
        self.filled: BoolArray | None = None
        self.names: list[str] = []
        self.rejected: dict[str, Finding] = {}

    def read(self, parts: Iterator[tuple[bytes, bool]]) -> LoggerTable:
        columns: dict[str | int, large.Growing] = {}
        rows, seconds = large.Growing(np.intp), large.Growing()
        texts: dict[str | int, list[NDArray[np.str_]]] = {}
        fields, places = 0, dict[str | int, int]()
        separator = self.profile.text_separator
        for content, is_last in parts:
            content = plain_lines(content, self.profile.line_stamp, separator, self.profile.checksum)
            lines = Lines.of(hide_quoted(content, separator))
            is_first = self.lines_before == 0
            numbers = np.flatnonzero(self._used(lines, is_first))
            if is_first:
                numbers, fields, places = self._head(lines, numbers)
            part = self._table(lines, numbers, fields, places, is_last)
            for source, values in part.columns.items():
                columns.setdefault(source, large.Growing()).append(values)
            for source, held in part.texts.items():
                texts.setdefault(source, []).append(held)
            rows.append(part.rows + self.rows_before)
            if part.seconds is not None:
                seconds.append(part.seconds)
            self.lines_before += len(lines.starts)
            self.rows_before += len(numbers)
        return LoggerTable(
            {source: values.array() for source, values in columns.items()},
            rows.array(),
            self.rows_before,
            tuple(self.rejected.values()),
            {source: np.concatenate(held) for source, held in texts.items()},
            None if self.clock is None else seconds.array(),
            None if self.clock is None else self.clock.stamps,
        )

    def _refused(self, told: str) -> InputError:
        return InputError(f"{self.file}: {told}; {self.hint}")

    def _line(self, lines: Lines, number: int) -> str:
        """A line as it stands in the file."""
        return shown(lines.line(number), self.profile.text_separator)

    def _used(self, lines: Lines, first: bool) -> BoolArray:
        """Which lines of a part are neither blank, nor comments, nor above the header."""
        profile = self.profile
        mark = lines.first_bytes()
        used = mark != 0
        if first:
            self._check_signature(lines)
            used[: profile.skip_lines] = False
            if (text := profile.header_text) is not None:
                found = (n for n in np.flatnonzero(used).tolist() if text in self._line(lines, n))
                header = next(found, None)
                if header is None:
                    raise self._refused(f"no line holds the header's text {quoted(text)}")
                used[:header] = False
        if profile.comment is not None:
            begins = mark == profile.comment.encode(errors="replace")[0]
            for number in np.flatnonzero(used & begins).tolist():
                if lines.line(number).lstrip(" \t").startswith(profile.comment):
                    used[number] = False
        return used

    def _check_signature(self, lines: Lines) -> None:
        signature = self.profile.signature
        if signature is not None:
            head = [self._line(lines, number) for number in range(min(_SIGNATURE_LINES, len(lines.starts)))]
            if not any(signature in line for line in head):
                raise self._refused(f"{quoted(signature)} was expected in its first lines")

    def _head(self, lines: Lines, numbers: IndexArray) -> tuple[IndexArray, int, dict[str | int, int]]:
        """The lines of data below the header, the fields of a row, and where each source stands."""
        numbers = numbers[self.profile.header_lines :]
        if self.profile.header and len(numbers):
            self.names = self._names(lines.line(int(numbers[0])))
            numbers = numbers[1:]
        if len(numbers) == 0:
            raise self._refused("no data rows")
        fields = self.profile.fields or len(self.names)
        return numbers, fields, self._places(fields)

    def _names(self, line: str) -> list[str]:
        separator = self.profile.text_separator
        names = [shown(name, separator) for name in line.split(separator)]
        return [name.strip().strip('"') for name in names] if self.profile.strip_names else names

    def _places(self, fields: int) -> dict[str | int, int]:
        """Position of each source column."""
        places: dict[str | int, int] = {}
        for source in (*self.profile.sources, *self.profile.text_sources):
            if isinstance(source, int):
                places[source] = source
                continue
            found = [place for place, name in enumerate(self.names) if name == source]
            if len(found) != 1:
                fault = "no column" if not found else "more than one column"
                raise self._refused(f"{fault} {quoted(source)}; the header holds {listed(self.names)}")
            places[source] = found[0]
        for source, place in places.items():
            if place >= fields:
                told = f"source {quoted(source)} is column {place} counted from 0"
                raise self._refused(f"{told}, and a row has {fields} fields")
        return places

    def _table(
        self, lines: Lines, numbers: IndexArray, fields: int, places: dict[str | int, int], is_last: bool
    ) -> LoggerTable:
        """The table of a part's lines of data; its rows are counted from the part's first."""
        counts = lines.field_counts(self.profile.text_separator)[numbers]
        short = counts != fields
        if short.any():
            line = self.lines_before + int(numbers[np.argmax(short)])
            if not self.profile.reject.wrong_field_count or 2 * np.count_nonzero(short) > len(numbers):
                held = f"has {int(counts[np.argmax(short)])} ({counted(int(short.sum()), 'such row')})"
                cure = "correct it, or leave such rows out by 'reject: {wrong_field_count: true}'"
                told = f"{fields} fields were expected, line {line + 1} {held}"
                raise self._refused(f"{told}; {cure} in the profile")
            self._reject(f"without {fields} fields", short, lines, numbers)
        rows = np.flatnonzero(~short)
        content = lines.keep(numbers[rows])
        sources = {s: place for s, place in places.items() if s in self.profile.sources}
        values = field_numbers(content, self.profile, fields, list(sources.values()))
        for values_of_it, (source, place) in zip(values, sources.items(), strict=True):
            if bits := self.profile.hex_bits(source):
                values_of_it[:] = hex_numbers(field_texts(content, self.profile, fields, place), bits)
        texts = {s: field_texts(content, self.profile, fields, places[s]) for s in self.profile.text_sources}
        seconds = self._seconds(texts)
        if self.filled is None:
            self.filled = self._filled(sources, values)
        faulty = np.any(~np.isfinite(values[self.filled]), axis=0)
        if seconds is not None:
            faulty = (faulty if len(sources) else np.zeros(len(rows), dtype=bool)) | np.isnan(seconds)
        if self.is_cut and is_last and len(rows) and rows[-1] == len(numbers) - 1:
            faulty[-1] = True
        if faulty.any():
            if not self.profile.reject.not_numbers or 2 * np.count_nonzero(faulty) > len(rows):
                row = int(np.argmax(faulty))
                wrong = {s: ~np.isfinite(v) for s, v, used in zip(sources, values, self.filled) if used}
                if seconds is not None:
                    wrong = dict.fromkeys(self.profile.stamps, np.isnan(seconds)) | wrong
                raise self._faulty_fields(lines, int(numbers[rows[row]]), row, places, wrong, texts)
            bad = np.zeros(len(numbers), dtype=bool)
            bad[rows[faulty]] = True
            self._reject("with text or nothing in a number's place", bad, lines, numbers)
            rows, values = rows[~faulty], values[:, ~faulty]
            texts = {source: held[~faulty] for source, held in texts.items()}
            seconds = None if seconds is None else seconds[~faulty]
        compared = {source: texts[source] for source in self.profile.compared_texts}
        return LoggerTable(dict(zip(sources, values)), rows, len(numbers), (), compared, seconds)

    def _faulty_fields(
        self,
        lines: Lines,
        line: int,
        row: int,
        places: dict[str | int, int],
        wrong: Mapping[str | int, BoolArray],
        texts: Mapping[str | int, NDArray[np.str_]],
    ) -> FaultyFields:
        """What to say of the first row of a part with a wrong field; `wrong` marks each source's by row."""
        source = next((source for source, bad in wrong.items() if bad[row]), next(iter(places)))
        if source in texts:
            cell, first = (" ".join(texts[s][i] for s in self.profile.stamps) for i in (row, 0))
        else:
            fields = lines.line(line).split(self.profile.text_separator)
            cell, first = shown(fields[places[source]], self.profile.text_separator).strip(), ""
        told = cell_words(cell, first, source == self.profile.clock)
        place = f"{self.file}, line {self.lines_before + line + 1}"
        count, rows = int(np.count_nonzero(wrong[source])), len(wrong[source])
        return FaultyFields(place, str(source), told, count, rows, self.hint)

    def _reject(self, what: str, rows: BoolArray, lines: Lines, numbers: IndexArray) -> None:
        """Count rejected rows; `rows` (n,) marks them among lines of a part. Another header is refused."""
        for number in numbers[rows].tolist() if self.names else ():
            if names_others(self._names(lines.line(number)), self.names):
                raise another_header(self.file, self.lines_before + number + 1, self._line(lines, number))
        before, count = self.rejected.get(what), int(np.count_nonzero(rows))
        count += before.count if before else 0
        row = before.row if before else self.rows_before + int(np.argmax(rows)) + 1
        told = f"{counted(count, 'row')} {what} left out"
        self.rejected[what] = Finding("rejected_rows", told, row=row, count=count)

    def _seconds(self, texts: Mapping[str | int, NDArray[np.str_]]) -> FloatArray | None:
        """Times since the first stamp [s], NaN where a text is none; nothing without a clock of stamps."""
        import pyarrow as pa

        if not (places := self.profile.stamps):
            return None
        columns = whole_stamps([texts[place].tolist() for place in places])
        if self.clock is None:
            stamps = stamps_of(list(enumerate(columns)), self.profile.reject.not_numbers, digits=True)
            if stamps is None:
                first = " ".join(str(texts[place][0]) for place in places if len(texts[place]))
                named = listed([quoted(str(p)) for p in places])
                what = "date or time of day" if len(places) == 1 else "date in one, time of day in the other"
                raise InputError(
                    f"{self.file}, column {named}: {quoted(first)} in the first row is no {what}; {self.hint}"
                )
            self.clock = StampClock(stamps, self.file)
        return self.clock.seconds([pa.array(column, pa.string()) for column in columns])

    def _filled(self, places: dict[str | int, int], values: FloatArray) -> BoolArray:
        """Which sources have a value in every row: those of another rate are empty in most, evenly so."""
        clock = self.profile.clock
        kinds = zip(places, values, strict=True)
        return np.array([source == clock or not is_of_another_rate(column) for source, column in kinds])
