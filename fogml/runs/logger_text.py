"""A logger's text file as a table of numbers, by an import profile."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fogml.errors import InputError, listed, quoted
from fogml.runs.csv_end import cut_error, cut_line
from fogml.runs.csv_source import CsvSource
from fogml.runs.findings import Finding
from fogml.runs.logger_lines import Lines, single_blanks
from fogml.runs.other_rate import is_of_another_rate
from fogml.runs.profile_parts import TextLayout
from fogml.runs.raw_table import empty_file
from fogml.runs.stamps import StampClock, Stamps, stamps_of

FloatArray = NDArray[np.float64]
IndexArray = NDArray[np.intp]

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

    def kept(self, rows: NDArray[np.bool_] | slice, finding: Finding) -> LoggerTable:
        """The table of some of its rows, with what is said of the others."""
        return replace(
            self,
            columns={source: values[rows] for source, values in self.columns.items()},
            texts={source: values[rows] for source, values in self.texts.items()},
            seconds=None if self.seconds is None else self.seconds[rows],
            rows=self.rows[rows],
            findings=(*self.findings, finding),
        )


def read_logger_text(path: str | Path, profile: TextLayout, profile_name: str) -> LoggerTable:
    """Read the source columns of a logger's text file.

    Raises
    ------
    InputError
        If the file is missing, is no text of that encoding, is not of the profile's form, or
        holds faulty rows that the profile does not reject; the message names file and line.
    """
    path = Path(path)
    content = _content(path, profile)
    cut = cut_line(CsvSource(path), profile.text_separator, profile.decimal)
    if cut is not None and not profile.reject.not_numbers:
        raise cut_error(path, cut, "'reject: {not_numbers: true}' in the profile leaves the row out")
    return _Reader(path.name, profile, profile_name, is_cut=cut is not None).read(content)


def _content(path: Path, profile: TextLayout) -> bytes:
    try:
        raw = path.read_bytes()
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror}); check the path") from None
    if not raw.strip():
        raise empty_file(path.name)
    try:
        text = raw.decode(profile.encoding).removeprefix("\ufeff").encode()
    except UnicodeError as error:
        place = f"byte {error.start}" if isinstance(error, UnicodeDecodeError) else "it"
        raise InputError(
            f"{path.name}: {place} is no {profile.encoding} text; "
            "give the file's encoding in the profile (key 'encoding')"
        ) from None
    if b"\0" in text[:4096]:
        raise InputError(f"{path.name}: this is a binary file, a text file was expected")
    return text


class _Reader:
    def __init__(self, file: str, profile: TextLayout, profile_name: str, is_cut: bool) -> None:
        self.file = file
        self.is_cut = is_cut
        self.profile = profile
        self.hint = f"is this a file for the profile {quoted(profile_name)}?"

    def read(self, content: bytes) -> LoggerTable:
        profile = self.profile
        lines = Lines.of(content)
        signature = profile.signature
        if signature is not None:
            head = [lines.line(number) for number in range(min(_SIGNATURE_LINES, len(lines.starts)))]
            if not any(signature in line for line in head):
                raise InputError(
                    f"{self.file}: {quoted(signature)} was expected in its first lines; {self.hint}"
                )
        first = lines.first_bytes()
        used = first != 0
        used[: profile.skip_lines] = False
        if profile.header_text is not None:
            found = (n for n in np.flatnonzero(used).tolist() if profile.header_text in lines.line(n))
            header = next(found, None)
            if header is None:
                raise InputError(
                    f"{self.file}: no line holds the header's text {quoted(profile.header_text)}; {self.hint}"
                )
            used[:header] = False
        if profile.comment is not None:
            for number in np.flatnonzero(
                used & (first == profile.comment.encode(errors="replace")[0])
            ).tolist():
                if lines.line(number).lstrip(" \t").startswith(profile.comment):
                    used[number] = False
        numbers = np.flatnonzero(used)[profile.header_lines :]
        names: list[str] | None = None
        if profile.header and len(numbers):
            names = self._names(lines.line(int(numbers[0])))
            numbers = numbers[1:]
        if len(numbers) == 0:
            raise InputError(f"{self.file}: no data rows; {self.hint}")
        fields = profile.fields or (len(names) if names else 0)
        places = self._places(names, fields)
        return self._table(lines, numbers, fields, places)

    def _names(self, line: str) -> list[str]:
        separator = self.profile.text_separator
        names = line.split(separator)
        return [name.strip().strip('"') for name in names] if self.profile.strip_names else names

    def _places(self, names: list[str] | None, fields: int) -> dict[str | int, int]:
        """Position of each source column."""
        places: dict[str | int, int] = {}
        for source in (*self.profile.sources, *self.profile.text_sources):
            if isinstance(source, int):
                places[source] = source
                continue
            found = [place for place, name in enumerate(names or []) if name == source]
            if len(found) != 1:
                fault = "no column" if not found else "more than one column"
                raise InputError(
                    f"{self.file}: {fault} {quoted(source)}; the header holds {listed(names or [])}; "
                    f"{self.hint}"
                )
            places[source] = found[0]
        for source, place in places.items():
            if place >= fields:
                raise InputError(
                    f"{self.file}: source {quoted(source)} is column {place} counted from 0, and a row has "
                    f"{fields} fields; {self.hint}"
                )
        return places

    def _table(
        self, lines: Lines, numbers: IndexArray, fields: int, places: dict[str | int, int]
    ) -> LoggerTable:
        counts = lines.field_counts(self.profile.text_separator)[numbers]
        short = counts != fields
        findings = []
        if short.any():
            line = int(numbers[np.argmax(short)])
            fault = f"{fields} fields were expected, line {line + 1} has {int(counts[np.argmax(short)])}"
            if not self.profile.reject.wrong_field_count or 2 * np.count_nonzero(short) > len(numbers):
                raise InputError(f"{self.file}: {fault} ({int(short.sum())} such rows); {self.hint}")
            findings.append(_rejected(f"without {fields} fields", short))
        rows = np.flatnonzero(~short)
        content = lines.keep(numbers[rows])
        sources = {source: place for source, place in places.items() if source in self.profile.sources}
        values = self._values(content, fields, list(sources.values()))
        texts = {s: self._texts(content, fields, places[s]) for s in self.profile.text_sources}
        seconds, stamps = self._seconds(texts)
        faulty = np.any(~np.isfinite(values[self._filled(sources, values)]), axis=0)
        if seconds is not None:
            faulty = (faulty if len(sources) else np.zeros(len(rows), dtype=bool)) | np.isnan(seconds)
        if self.is_cut and len(rows) and rows[-1] == len(numbers) - 1:
            faulty[-1] = True
        if faulty.any():
            line = int(numbers[rows[np.argmax(faulty)]])
            if not self.profile.reject.not_numbers or 2 * np.count_nonzero(faulty) > len(rows):
                raise InputError(
                    f"{self.file}: line {line + 1} holds text or nothing in a number's place "
                    f"({int(faulty.sum())} such rows): {quoted(lines.line(line))}; {self.hint}"
                )
            bad = np.zeros(len(numbers), dtype=bool)
            bad[rows[faulty]] = True
            findings.append(_rejected("with text or nothing in a number's place", bad))
            rows, values = rows[~faulty], values[:, ~faulty]
            texts = {source: held[~faulty] for source, held in texts.items()}
            seconds = None if seconds is None else seconds[~faulty]
        columns = dict(zip(sources, values))
        return LoggerTable(columns, rows, len(numbers), tuple(findings), texts, seconds, stamps)

    def _seconds(
        self, texts: Mapping[str | int, NDArray[np.str_]]
    ) -> tuple[FloatArray | None, Stamps | None]:
        """Times since the first stamp [s], NaN where a text is none; nothing without a clock of stamps."""
        import pyarrow as pa

        places = self.profile.stamps
        if not places:
            return None, None
        columns = [texts[place] for place in places]
        stamps = stamps_of([(i, column[:1000].tolist()) for i, column in enumerate(columns)])
        if stamps is None:
            raise InputError(
                f"{self.file}: {quoted(str(columns[0][:1].tolist()))} is no date or time of day; {self.hint}"
            )
        clock = StampClock(stamps, self.file)
        return clock.seconds([pa.array(column, pa.string()) for column in columns]), stamps

    def _filled(self, places: dict[str | int, int], values: NDArray[np.float64]) -> NDArray[np.bool_]:
        """Which sources have a value in every row: those of another rate are empty in most, evenly so."""
        clock = self.profile.columns["time"].number if "time" in self.profile.columns else None
        kinds = zip(places, values, strict=True)
        return np.array([source == clock or not is_of_another_rate(column) for source, column in kinds])

    def _texts(self, content: bytes, fields: int, position: int) -> NDArray[np.str_]:
        """A source column as texts without blanks and quotation marks about them, shape (rows,)."""
        import pyarrow as pa

        (column,) = self._fields(content, fields, [position], pa.string(), []).columns
        return np.char.strip(np.array(column.to_pylist(), dtype=np.str_), ' \t"')

    def _fields(
        self, content: bytes, fields: int, positions: list[int], kind: Any, nulls: list[str] | None
    ) -> Any:
        """Fields by position, as Arrow reads them."""
        import pyarrow as pa
        from pyarrow import csv

        separator = self.profile.text_separator
        if separator is None:
            content, separator = single_blanks(content), " "
        names = [str(position) for position in range(fields)]
        wanted = [names[position] for position in positions]
        return csv.read_csv(
            pa.BufferReader(content),
            csv.ReadOptions(column_names=names),
            # A mark that is not closed must not swallow the lines below it.
            csv.ParseOptions(delimiter=separator, quote_char=False, ignore_empty_lines=False),
            csv.ConvertOptions(
                column_types=dict.fromkeys(wanted, kind),
                include_columns=sorted(set(wanted)),
                decimal_point=self.profile.decimal,
                null_values=nulls,
                strings_can_be_null=nulls is not None,
            ),
        )

    def _values(self, content: bytes, fields: int, positions: list[int]) -> NDArray[np.float64]:
        """The source columns as numbers, shape (columns, rows); NaN where there is none."""
        import pyarrow as pa

        if not positions:
            return np.empty((0, content.count(b"\n")))
        wanted = [str(position) for position in positions]
        try:
            columns = self._fields(content, fields, positions, pa.float64(), None)
        except pa.ArrowInvalid:
            # Some field is no plain number: read text, and let what is none become NaN.
            text = self._fields(content, fields, positions, pa.string(), [""])
            numbers = [_numbers(text[name], self.profile.decimal) for name in text.column_names]
            columns = pa.table(numbers, names=text.column_names)
        return np.stack([columns[name].to_numpy() for name in wanted])


def _numbers(text: Any, decimal: str) -> Any:
    """Text as float64, null where it is no number."""
    import pyarrow as pa
    import pyarrow.compute as compute

    plain = compute.replace_substring_regex(compute.utf8_trim_whitespace(text), r'^"(.*)"$', r"\1")
    plain = compute.utf8_trim_whitespace(plain)
    if decimal == ",":
        plain = compute.replace_substring(plain, ",", ".")
    plain = compute.replace_substring_regex(plain, r"^\+", "")
    valid = compute.match_substring_regex(plain, r"^-?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?$")
    return compute.cast(compute.if_else(valid, plain, pa.scalar(None, pa.string())), pa.float64())


def _rejected(what: str, rows: NDArray[np.bool_]) -> Finding:
    """A finding that counts rejected rows; `rows` (n,) marks them among the data rows."""
    count = int(np.count_nonzero(rows))
    plural = "row" if count == 1 else "rows"
    return Finding(
        "rejected_rows", f"{count} {plural} {what} left out", row=int(np.argmax(rows)) + 1, count=count
    )
