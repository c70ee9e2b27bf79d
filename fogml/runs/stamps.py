"""Dates and times of day as loggers and spreadsheets write them, as seconds since the first one."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from typing import TYPE_CHECKING, Any

import numpy as np

from fogml.arrays import BoolArray, FloatArray, IntArray
from fogml.arrow_arrays import values_of
from fogml.errors import InputError
from fogml.runs.csv_source import number

if TYPE_CHECKING:
    from pyarrow import Array


_DATE = (
    r"(?P<a>\d{4}|\d{1,2})\s*[-/.年\s]\s*(?P<b>\d{1,2}|[A-Za-z]{3,9})\s*[-/.月\s]\s*"
    r"(?P<c>\d{4}|\d{1,2})日?"
)
_TIME = (
    r"(?P<H>\d{1,4}):(?P<M>\d{2})(?::(?P<S>\d{2})(?:[.,:](?P<F>\d{1,9}))?)?"
    r"\s*(?P<p>[AaPp][Mm])?\s*(?P<z>Z|UTC|GMT|[+-]\d{2}:?\d{2})?"
)
_FORMS = {
    "date and time": rf"^\s*{_DATE}(?:\s*T\s*|[\s_,;]+){_TIME}\s*$",
    "date": rf"^\s*{_DATE}\s*$",
    "time": rf"^\s*{_TIME}\s*$",
    "minutes and seconds": r"^\s*(?P<M>\d{1,3}):(?P<S>\d{2})[.,](?P<F>\d{1,9})\s*$",
    "date and time without marks": (
        r"^\s*(?P<a>\d{4})(?P<b>\d{2})(?P<c>\d{2})\s*[T_ -]\s*(?P<H>\d{2}):?(?P<M>\d{2}):?(?P<S>\d{2})"
        r"(?:[.,](?P<F>\d{1,9}))?\s*(?P<z>Z|UTC|GMT|[+-]\d{2}:?\d{2})?\s*$"
    ),
    "duration": r"^\s*(?P<N>\d+(?:[.,]\d+)?) (?P<U>sec|min|hr|days?)\s*$",
    "fraction of a second": r"^\s*(?P<F>\d{1,9})\s*$",
}
PARTS = 6
"""Columns of a clock that has one for each of year, month, day, hour, minute and second."""
FRACTION = "fraction of a second"
"""Digits in a field of their own, where a comma before them separates fields too."""
_MONTHS = ("jan", "feb", "mar", "apr", "may", "jun", "jul", "aug", "sep", "oct", "nov", "dec")
_HOURS_OR_MINUTES = "h?"
_NS = 1_000_000_000
_DAY_NS = 86_400 * _NS
_DURATIONS_NS = {"sec": _NS, "min": 60 * _NS, "hr": 3600 * _NS, "day": _DAY_NS, "days": _DAY_NS}
"""As MATLAB writes the times of a timetable."""
_GOES_ROUND_NS = {"time": _DAY_NS, "minutes and seconds": 3600 * _NS}


@dataclass(frozen=True)
class StampForm:
    """How the stamps of a column are written.

    Attributes
    ----------
    kind
        Key of the forms, such as ``date and time``, ``date`` or ``time``.
    order
        Order of year, month and day: ``ymd``, ``dmy``, ``mdy``; ``?`` where day and month can't be told
        apart. Of a time ``h?`` where hours and minutes may be minutes and seconds.
    """

    kind: str
    order: str = "ymd"

    def matches(self, text: str) -> bool:
        """Whether a text is such a stamp."""
        return re.match(_FORMS[self.kind], text) is not None

    def nanoseconds(self, texts: Array) -> tuple[IntArray, BoolArray]:
        """Nanoseconds since 1970 (of a time of day since midnight, of a duration its own); which are none.

        Parameters
        ----------
        texts
            Arrow's texts, n of them.

        Returns
        -------
        nanoseconds, wrong
            Shape (n,).
        """
        import pyarrow.compute as compute

        found = compute.extract_regex(texts, _FORMS[self.kind])
        wrong = values_of(found.is_null())
        parts = {field.name: found.field(field.name) for field in found.type}
        total = np.zeros(len(texts), dtype=np.int64)
        if "a" in parts:
            days, bad = self._days(_whole(parts["a"]), _month(parts["b"]), _whole(parts["c"]))
            total, wrong = total + days * _DAY_NS, wrong | bad
        if "F" in parts:
            seconds, bad = _seconds(parts)
            total, wrong = total + seconds, wrong | bad
        if "U" in parts:
            total = total + _durations(parts["N"], parts["U"])
        return total, wrong

    def _days(self, a: Any, b: Any, c: Any) -> tuple[IntArray, BoolArray]:
        by_order = {"ymd": (a, b, c), "dmy": (c, b, a), "mdy": (c, a, b)}
        year, month, day = by_order["dmy" if self.order == "?" else self.order]
        year = np.where(year < 100, year + 2000, year)
        wrong = (month < 1) | (month > 12) | (day < 1) | (day > 31) | (year < 1900) | (year > 2200)
        months = (np.where(wrong, 1970, year) - 1970) * 12 + np.where(wrong, 1, month) - 1
        first, after = (
            (months + more).astype("datetime64[M]").astype("datetime64[D]").astype(np.int64)
            for more in (0, 1)
        )
        wrong |= day > after - first
        return first + np.where(wrong, 1, day) - 1, wrong


@dataclass(frozen=True)
class Stamps:
    """The clock of a file whose times are written as dates and times of day.

    Attributes
    ----------
    columns
        Positions of the columns with their forms: one, or one of dates and one of times of day.
    first_ns
        The first stamp [ns], which becomes 0.
    zoned
        Whether stamps state their zone, so that they are in UTC.
    """

    columns: tuple[tuple[int, StampForm], ...]
    first_ns: int
    zoned: bool

    @property
    def started(self) -> datetime | None:
        """When the recording began, where the stamps state a date that can be told."""
        if all("date" not in form.kind for _, form in self.columns) or any(
            f.order == "?" for _, f in self.columns
        ):
            return None
        moment = datetime(1970, 1, 1, tzinfo=UTC) + timedelta(microseconds=self.first_ns / 1000)
        return moment if self.zoned else moment.replace(tzinfo=None)


class StampClock:
    """Turns stamps of consecutive blocks into seconds since the first; days are counted over midnight,
    hours where only minutes and seconds are shown."""

    def __init__(self, stamps: Stamps, file: str) -> None:
        self.stamps, self.file = stamps, file
        self.is_open = any(form.order == "?" for _, form in stamps.columns)
        self.last_ns, self.rounds = stamps.first_ns, 0
        rounds = [_GOES_ROUND_NS.get(form.kind, 0) for _, form in stamps.columns if form.kind != FRACTION]
        self.round_ns = 0 if 0 in rounds else min(rounds, default=0)
        if self.round_ns and any(form.order == _HOURS_OR_MINUTES for _, form in stamps.columns):
            raise InputError(
                f"{file}, column 'time': two numbers with a colon may be hours and minutes, or minutes and "
                "seconds; write them as HH:MM:SS"
            )

    def seconds(self, texts: Sequence[Array]) -> FloatArray:
        """Seconds of each row, shape (n,); NaN where the texts, one array for each column, are no stamps."""
        total = np.zeros(len(texts[0]), dtype=np.int64)
        wrong = np.zeros(len(texts[0]), dtype=np.bool_)
        for (_, form), column in zip(self.stamps.columns, texts, strict=True):
            found, bad = form.nanoseconds(column)
            total, wrong = total + found, wrong | bad
        if self.is_open and np.any(~wrong & (total // _DAY_NS != self.stamps.first_ns // _DAY_NS)):
            raise InputError(
                f"{self.file}, column 'time': day and month of the dates can't be told apart and the "
                "recording goes on over midnight; write them as year-month-day"
            )
        if self.round_ns and len(total):
            # In the place of what is no stamp the one before it.
            told = np.concatenate([[self.last_ns % self.round_ns], total])
            told = told[np.maximum.accumulate(np.append(0, np.where(wrong, 0, np.arange(1, len(told)))))]
            rounds = np.cumsum((np.diff(told) < -self.round_ns // 2).astype(np.int64))
            self.last_ns = int(told[-1])
            total = total + (self.rounds + rounds) * self.round_ns
            self.rounds += int(rounds[-1])
        return np.where(wrong, np.nan, (total - self.stamps.first_ns) / _NS)


def stamp_form(texts: Sequence[str]) -> StampForm | None:
    """The form of which texts are, the first of a column, or None where they are no stamps."""
    kinds = (kind for kind in _FORMS if kind != FRACTION)
    kind = next((kind for kind in kinds if texts and StampForm(kind).matches(texts[0])), None)
    if kind is None or kind not in ("date", "date and time"):
        is_open = kind == "time" and texts[0].count(":") == 1 and not re.search("[AaPp][Mm]", texts[0])
        return None if kind is None else StampForm(kind, _HOURS_OR_MINUTES if is_open else "ymd")
    found = [match for text in texts if (match := re.match(_FORMS[kind], text))]
    if any(len(match["a"]) == 4 for match in found):
        return StampForm(kind, "ymd")
    is_named = any(match["b"].isalpha() for match in found)
    if is_named or any(int(match["a"]) > 12 for match in found) or "." in texts[0].split()[0]:
        return StampForm(kind, "dmy")
    if any(int(match["b"]) > 12 for match in found) or found[0].groupdict().get("p"):
        return StampForm(kind, "mdy")
    return StampForm(kind, "?")


_FIRST_ROWS = 1000  # of which a clock's form is told


def stamps_of(columns: Sequence[tuple[int, Sequence[str]]], skip: bool = False) -> Stamps | None:
    """The clock of columns, given by position with their first texts; None where these are no stamps.

    With `skip` rows above the first of stamps, such as one of units, are left out.
    """
    import pyarrow as arrow

    columns = [(place, texts[:_FIRST_ROWS]) for place, texts in columns]
    if skip:
        rows = enumerate(zip(*(texts for _, texts in columns)))
        begin = next((i for i, row in rows if all(stamp_form([text]) for text in row)), 0)
        columns = [(place, texts[begin:]) for place, texts in columns]
    forms = [(place, stamp_form(texts)) for place, texts in columns]
    known = tuple((place, form) for place, form in forms if form is not None)
    dates = sum("date" in form.kind for _, form in known)
    times = sum(form.kind != "date" for _, form in known)
    # Two of a kind would be added up.
    if not known or len(known) < len(columns) or max(dates, times) > 1:
        return None
    first = 0
    for (_, form), (_, texts) in zip(known, columns, strict=True):
        found, wrong = form.nanoseconds(arrow.array([texts[0]], arrow.string()))
        if wrong[0]:
            return None
        first += int(found[0])
    shown = [re.match(_FORMS[form.kind], texts[0]) for (_, form), (_, texts) in zip(known, columns)]
    return Stamps(known, first, any(match is not None and match.groupdict().get("z") for match in shown))


def stamps_of_parts(parts: Sequence[Sequence[str]]) -> list[str]:
    """Dates and times of day from texts of year, month, day, hour, minute and second, n each.

    Empty where they are none, as of a month 13 or a part of a second before the last.
    """
    # What is no number becomes NaN.
    numbers = np.array([[number(text, ".") for text in column] for column in parts], dtype=np.float64)
    year, month, day, hour, minute, second = numbers
    low, high = np.array([[1900, 1, 1, 0, 0, 0], [2200, 12, 31, 23, 59, 60]], dtype=np.float64)[:, :, None]
    known = np.all((numbers >= low) & (numbers <= high), axis=0) & np.all(numbers[:5] % 1.0 == 0.0, axis=0)
    months = np.where(known, (year - 1970.0) * 12.0 + month - 1.0, 0.0).astype("datetime64[M]")
    days = months.astype("datetime64[D]") + np.where(known, day - 1.0, 0.0).astype(np.int64)
    known &= days.astype("datetime64[M]") == months
    of_day = np.where(known, np.rint(((hour * 60.0 + minute) * 60.0 + second) * _NS), 0.0).astype(np.int64)
    moments = days.astype("datetime64[ns]") + of_day.astype("timedelta64[ns]")
    return [str(text) if is_one else "" for text, is_one in zip(np.datetime_as_string(moments), known)]


def _whole(texts: Any) -> IntArray:
    """Digits as whole numbers, 0 where there are none."""
    import pyarrow as arrow
    import pyarrow.compute as compute

    digits = compute.if_else(compute.equal(texts, ""), None, texts)
    return values_of(compute.fill_null(digits.cast(arrow.int64()), 0))


def _month(texts: Any) -> IntArray:
    """Months from their numbers or English names, 0 where there is none."""
    import pyarrow as arrow
    import pyarrow.compute as compute

    if not compute.any(compute.match_substring_regex(texts, "[A-Za-z]")).as_py():
        return _whole(texts)
    names = compute.utf8_slice_codeunits(compute.utf8_lower(texts), 0, 3)
    places = compute.index_in(names, value_set=arrow.array(_MONTHS, arrow.string()))
    return values_of(compute.fill_null(places, -1)).astype(np.int64) + 1


def _durations(numbers: Any, units: Any) -> IntArray:
    """Nanoseconds of numbers with their units, 0 where there are none."""
    import pyarrow as arrow
    import pyarrow.compute as compute

    digits = compute.replace_substring(compute.fill_null(numbers, "0"), ",", ".")
    place = compute.index_in(units, value_set=arrow.array(list(_DURATIONS_NS), arrow.string()))
    scale = np.array(list(_DURATIONS_NS.values()))[values_of(compute.fill_null(place, 0)).astype(np.intp)]
    return np.rint(values_of(digits.cast(arrow.float64())) * scale).astype(np.int64)


def _seconds(parts: dict[str, Any]) -> tuple[IntArray, BoolArray]:
    """Nanoseconds of times of day, their zone taken off, and which are none."""
    import pyarrow.compute as compute

    none = compute.if_else(compute.is_valid(parts["F"]), "", "")
    of_hours = "H" in parts
    parts = dict.fromkeys("HMSpz", none) | parts
    hour, minute, second = (_whole(parts[key]) for key in "HMS")
    # Minutes without hours may go on beyond 59.
    wrong = ((minute > 59) & of_hours) | (second > 60)
    half = np.asarray(compute.utf8_lower(compute.fill_null(parts["p"], "")).to_numpy(zero_copy_only=False))
    hour = np.where(half == "pm", hour % 12 + 12, np.where(half == "am", hour % 12, hour))
    fraction = _whole(compute.utf8_rpad(compute.fill_null(parts["F"], ""), 9, "0"))
    zone = compute.replace_substring_regex(compute.fill_null(parts["z"], ""), "^(Z|UTC|GMT)$", "+0000")
    zone = _whole(compute.replace_substring(compute.replace_substring(zone, ":", ""), "+", ""))
    east = np.sign(zone) * (np.abs(zone) // 100 * 60 + np.abs(zone) % 100)
    return ((hour * 60 + minute - east) * 60 + second) * _NS + fraction, wrong
