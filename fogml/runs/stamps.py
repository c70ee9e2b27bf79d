"""Clocks of dates and times of day, as seconds since the first one."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from typing import TYPE_CHECKING

import numpy as np

from fogml.arrays import FloatArray, IntArray
from fogml.errors import InputError
from fogml.runs.csv_source import number
from fogml.runs.stamp_forms import (
    DATES,
    DAY_NS,
    FORMS,
    FRACTION,
    GOES_ROUND_NS,
    NS,
    OPEN,
    StampForm,
    stamp_form,
)

if TYPE_CHECKING:
    from pyarrow import Array


_OPEN_DATES = {"?": "day and month", "y?": "day and year"}
_MILLISECONDS, _DECIMALS = r"\d{1,3}", r"\.\d{1,9}"
_OF_MILLISECONDS = {"ms", "msec", "millis", "millisecond", "milliseconds", "millisekunden", "毫秒"}
_OF_DECIMALS = re.compile(r"sec|frac|milli|part|^ms|秒", re.IGNORECASE)
"""In names of columns of parts of a second beside times of day."""
PARTS = 6
"""Columns of a clock that has one for each of year, month, day, hour, minute and second."""


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
            "?" in f.order for _, f in self.columns
        ):
            return None
        moment = datetime(1970, 1, 1, tzinfo=UTC) + timedelta(microseconds=self.first_ns / 1000)
        return moment if self.zoned else moment.replace(tzinfo=None)


class StampClock:
    """Turns stamps of consecutive blocks into seconds since the first; days are counted over midnight,
    hours where only minutes and seconds are shown."""

    def __init__(self, stamps: Stamps, file: str) -> None:
        self.stamps, self.file = stamps, file
        self.open = next((form.order for _, form in stamps.columns if form.order in _OPEN_DATES), "")
        self.last_ns, self.rounds = stamps.first_ns, 0
        rounds = [GOES_ROUND_NS.get(form.kind, 0) for _, form in stamps.columns if form.kind != FRACTION]
        self.round_ns = 0 if 0 in rounds else min(rounds, default=0)
        for order in (form.order for _, form in stamps.columns if form.order in OPEN):
            if order == "f?" or self.round_ns:
                raise InputError(f"{file}, column 'time': {OPEN[order]}")

    def seconds(self, texts: Sequence[Array]) -> FloatArray:
        """Seconds of each row, shape (n,); NaN where the texts, one array for each column, are no stamps."""
        total = np.zeros(len(texts[0]), dtype=np.int64)
        wrong = np.zeros(len(texts[0]), dtype=np.bool_)
        for (_, form), column in zip(self.stamps.columns, texts, strict=True):
            found, bad = form.nanoseconds(column)
            total, wrong = total + found, wrong | bad
        self._check_dates(total[~wrong] // DAY_NS if self.open else total[:0])
        if self.round_ns and len(total):
            # In the place of what is no stamp the one before it.
            told = np.concatenate([[self.last_ns % self.round_ns], total])
            told = told[np.maximum.accumulate(np.append(0, np.where(wrong, 0, np.arange(1, len(told)))))]
            rounds = np.cumsum((np.diff(told) < -self.round_ns // 2).astype(np.int64))
            self.last_ns = int(told[-1])
            total = total + (self.rounds + rounds) * self.round_ns
            self.rounds += int(rounds[-1])
        return np.where(wrong, np.nan, (total - self.stamps.first_ns) / NS)

    def _check_dates(self, days: IntArray) -> None:
        """Refuse dates whose order can't be told once they change; a change by one day tells it."""
        changed = days[days != self.stamps.first_ns // DAY_NS][:1]
        if not len(changed):
            return
        if self.open == "?" or changed[0] != self.stamps.first_ns // DAY_NS + 1:
            what = _OPEN_DATES[self.open]
            raise InputError(
                f"{self.file}, column 'time': {what} of the dates can't be told apart and the recording goes "
                "on over midnight; write them as year-month-day, the year with four digits"
            )
        self.open = ""


_FIRST_ROWS = 1000  # of which a clock's form is told


def stamps_of(
    columns: Sequence[tuple[int, Sequence[str]]], skip: bool = False, digits: bool = False
) -> Stamps | None:
    """The clock of columns, given by position with their first texts; None where these are no stamps.

    With `skip` rows above the first of stamps, such as one of units, are left out; `digits` as `stamp_form`.
    """
    import pyarrow as arrow

    columns = [(place, texts[:_FIRST_ROWS]) for place, texts in columns]
    if skip:
        rows = enumerate(zip(*(texts for _, texts in columns)))
        begin = next((i for i, row in rows if all(stamp_form([text], digits) for text in row)), 0)
        columns = [(place, texts[begin:]) for place, texts in columns]
    forms = [(place, stamp_form(texts, digits)) for place, texts in columns]
    known = tuple((place, form) for place, form in forms if form is not None)
    dates = sum("date" in form.kind for _, form in known)
    times = sum(form.kind not in DATES for _, form in known)
    # Two of a kind would be added up.
    if not known or len(known) < len(columns) or max(dates, times) > 1:
        return None
    first = 0
    for (_, form), (_, texts) in zip(known, columns, strict=True):
        found, wrong = form.nanoseconds(arrow.array([texts[0]], arrow.string()))
        if wrong[0]:
            return None
        first += int(found[0])
    shown = [re.match(FORMS[form.kind], texts[0]) for (_, form), (_, texts) in zip(known, columns)]
    return Stamps(known, first, any(match is not None and match.groupdict().get("z") for match in shown))


def part_of_a_second(name: str, texts: Sequence[str]) -> tuple[int, int] | None:
    """The first part of a second [ns] of a column beside times of day; None where it holds none.

    Also how many digits all have with zeros before them: 3 of whole milliseconds, where its name says so, and
    0 of decimals behind a point, which need none.
    """
    is_millisecond, is_part = name.lower() in _OF_MILLISECONDS, _OF_DECIMALS.search(name)
    for form, digits, is_named in ((_MILLISECONDS, 3, is_millisecond), (_DECIMALS, 0, is_part)):
        fits = [bool(re.fullmatch(form, text.strip(' "'))) for text in texts]
        if is_named and fits and fits[0] and 2 * sum(fits) > len(fits):
            return round(float(texts[0].strip(' "')) * (1e6 if digits else 1e9)), digits
    return None


def whole_stamps(columns: list[list[str]]) -> list[list[str]]:
    """Texts of stamps, n of each column: of six their parts, of up to three the last may be milliseconds."""
    if len(columns) == PARTS:
        return [stamps_of_parts(columns)]
    *before, last = columns
    first = [text.strip() for text in last[:_FIRST_ROWS]]
    fits = {
        kind: sum(bool(re.fullmatch(kind, text)) for text in first) for kind in (_MILLISECONDS, _DECIMALS)
    }
    kind = max(fits, key=lambda one: fits[one])
    if not before or 2 * fits[kind] <= len(first):
        return columns
    # What is no part of a second makes no stamp.
    parts = (part.strip().lstrip(".") if re.fullmatch(kind, part.strip()) else "?" for part in last)
    digits = 3 if kind == _MILLISECONDS else 0
    stamps = [f"{text.strip()}.{part.zfill(digits)}" for text, part in zip(before[-1], parts, strict=True)]
    return [*before[:-1], stamps]


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
    of_day = np.where(known, np.rint(((hour * 60.0 + minute) * 60.0 + second) * NS), 0.0).astype(np.int64)
    moments = days.astype("datetime64[ns]") + of_day.astype("timedelta64[ns]")
    return [str(text) if is_one else "" for text, is_one in zip(np.datetime_as_string(moments), known)]
