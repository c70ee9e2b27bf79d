"""How dates and times of day are written: the forms, told from a column's first texts, and their parts."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from fogml.arrays import BoolArray, IntArray
from fogml.arrow_arrays import values_of

if TYPE_CHECKING:
    from pyarrow import Array


_DATE = (
    r"(?P<a>\d{4}|\d{1,2})(?:\s*[-/.年\s]\s*|\.\s)(?P<b>\d{1,2}|[A-Za-zä]{3,9})\s*[-/.月\s]\s*"
    r"(?P<c>\d{4}|\d{1,2})日?"
)
_GAP = "[\\s\u00a0\u202f]*"
_ZONE = "(?P<z>Z|(?:UTC|GMT)?[+-]\\d{2}(?::?\\d{2})?|UTC|GMT|CES?T|MES?Z|EES?T|MSK|JST)?"
"""Offsets, and the names of zones that are used for one alone."""
_TIME = (
    rf"(?P<q>上午|下午|午前|午後|오전|오후)?{_GAP}"
    r"(?P<H>\d{1,4})[:时時](?P<M>\d{2})(?:[:分](?P<S>\d{2})(?:[.,:](?P<F>\d{1,9}))?)?[分秒]?"
    rf"(?:{_GAP}Uhr)?{_GAP}(?P<p>[AaPp]\.?{_GAP}[Mm]\.?)?{_GAP}{_ZONE}"
)
FORMS = {
    "date and time": rf"^\s*{_DATE}(?:\s*T\s*|[\s_,;]+){_TIME}\s*$",
    "date and time in words": (
        rf"^\s*(?:[A-Za-z]{{3,9}},?\s+)?(?P<b>[A-Za-z]{{3,9}})\s+(?P<c>\d{{1,2}}),?\s+(?P<a>\d{{4}})[\s,]+{_TIME}\s*$"
    ),
    "date and time as C writes it": (
        r"^\s*[A-Za-z]{3} (?P<b>[A-Za-z]{3}) +(?P<c>\d{1,2}) (?P<H>\d{2}):(?P<M>\d{2}):(?P<S>\d{2}) "
        r"(?P<a>\d{4})\s*$"
    ),
    "date": rf"^\s*{_DATE}\s*$",
    "time": rf"^\s*{_TIME}\s*$",
    "minutes and seconds": r"^\s*(?P<M>\d{1,3}):(?P<S>\d{2})[.,](?P<F>\d{1,9})\s*$",
    "date and time without marks": (
        r"^\s*(?P<a>\d{4})(?P<b>\d{2})(?P<c>\d{2})\s*[T_ -]\s*(?P<H>\d{2}):?(?P<M>\d{2}):?(?P<S>\d{2})"
        rf"(?:[.,](?P<F>\d{{1,9}}))?\s*{_ZONE}\s*$"
    ),
    "date and time by day of year": (
        r"^\s*(?P<a>\d{4})[-:/ ](?P<d>\d{3})[T: ](?P<H>\d{2}):(?P<M>\d{2}):(?P<S>\d{2})"
        rf"(?:[.,](?P<F>\d{{1,9}}))?\s*{_ZONE}\s*$"
    ),
    "days and time": (
        r"^\s*(?P<N>\d+) (?P<U>days?),? (?P<H>\d{1,2}):(?P<M>\d{2}):(?P<S>\d{2})(?:[.,](?P<F>\d{1,9}))?\s*$"
    ),
    "duration": r"^\s*(?P<N>\d+(?:[.,]\d+)?) (?P<U>sec|min|hr|days?)\s*$",
    "fraction of a second": r"^\s*[.,]?(?P<F>\d{1,9})\s*$",
    "time in digits": r"^\s*(?P<H>\d{1,2})(?P<M>\d{2})(?P<S>\d{2})(?:[.,](?P<F>\d{1,9}))?\s*$",
    "date in digits": r"^\s*(?P<a>\d{4})(?P<b>\d{2})(?P<c>\d{2})\s*$",
    "date and time in digits": (
        r"^\s*(?P<a>\d{4})(?P<b>\d{2})(?P<c>\d{2})(?P<H>\d{2})(?P<M>\d{2})(?P<S>\d{2})"
        r"(?:[.,](?P<F>\d{1,9}))?\s*$"
    ),
}
DATES = ("date", "date in digits")
"""Forms of a date alone."""
FRACTION = "fraction of a second"
"""Digits in a field of their own, where a comma before them separates fields too."""
_GERMAN_MONTHS = {"mrz": "mar", "mär": "mar", "mai": "may", "okt": "oct", "dez": "dec"}
_MONTHS = ("jan", "feb", "mar", "apr", "may", "jun", "jul", "aug", "sep", "oct", "nov", "dec")
OPEN = {
    "h?": "two numbers with a colon may be hours and minutes, or minutes and seconds; write them as HH:MM:SS",
    "d?": "four numbers with colons may be days, hours, minutes and seconds, or hours, minutes, seconds and "
    "a part of one; write days as hours, a part behind a point",
    "f?": "parts of a second such as .5 and .50 are of unlike length, and nobody can tell of what; write as "
    "many digits in each",
}
"""What can't be told of times, by `StampForm.order`."""
_MERIDIANS = "^(?:下午|午後|오후|[Pp]).*$"
_OFFSETS = {"UTC": "+00", "GMT": "+00", "Z": "+00", "CET": "+01", "MEZ": "+01", "CEST": "+02", "MESZ": "+02",
            "EET": "+02", "EEST": "+03", "MSK": "+03", "JST": "+09"}  # fmt: skip
NS = 1_000_000_000
DAY_NS = 86_400 * NS
_DURATIONS_NS = {"sec": NS, "min": 60 * NS, "hr": 3600 * NS, "day": DAY_NS, "days": DAY_NS}
"""As MATLAB writes the times of a timetable; pandas writes ``0 days 00:00:00.5``."""
GOES_ROUND_NS = {"time": DAY_NS, "time in digits": DAY_NS, "minutes and seconds": 3600 * NS}


@dataclass(frozen=True)
class StampForm:
    """How the stamps of a column are written.

    Attributes
    ----------
    kind
        Key of the forms, such as ``date and time``, ``date`` or ``time``.
    order
        Order of year, month and day: ``ymd``, ``dmy``, ``mdy``; ``?`` where day and month can't be told
        apart, ``y?`` where day and a year of two digits can't. Of a time a key of `OPEN`.
    part_digits
        Digits that parts of a second have with zeros before them, where the text leaves these out.
    """

    kind: str
    order: str = "ymd"
    part_digits: int = 0

    def matches(self, text: str) -> bool:
        """Whether a text is such a stamp."""
        return re.match(FORMS[self.kind], text) is not None

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

        found = compute.extract_regex(texts, FORMS[self.kind])
        wrong = values_of(found.is_null())
        parts = {field.name: found.field(field.name) for field in found.type}
        total = np.zeros(len(texts), dtype=np.int64)
        if "d" in parts:
            days, bad = _days_of_year(_whole(parts["a"]), _whole(parts["d"]))
            total, wrong = total + days * DAY_NS, wrong | bad
        elif "a" in parts:
            days, bad = self._days(_whole(parts["a"]), _month(parts["b"]), _whole(parts["c"]))
            total, wrong = total + days * DAY_NS, wrong | bad
        if "S" in parts or "F" in parts:
            seconds, bad = _seconds(parts, self.part_digits)
            total, wrong = total + seconds, wrong | bad
        if "U" in parts:
            total = total + _durations(parts["N"], parts["U"])
        return total, wrong

    def _days(self, a: Any, b: Any, c: Any) -> tuple[IntArray, BoolArray]:
        by_order = {"ymd": (a, b, c), "dmy": (c, b, a), "mdy": (c, a, b)}
        year, month, day = by_order["dmy" if "?" in self.order else self.order]
        year = np.where(year < 100, year + 2000, year)
        wrong = (month < 1) | (month > 12) | (day < 1) | (day > 31) | (year < 1900) | (year > 2200)
        months = (np.where(wrong, 1970, year) - 1970) * 12 + np.where(wrong, 1, month) - 1
        first, after = (
            (months + more).astype("datetime64[M]").astype("datetime64[D]").astype(np.int64)
            for more in (0, 1)
        )
        wrong |= day > after - first
        return first + np.where(wrong, 1, day) - 1, wrong


def stamp_form(texts: Sequence[str], digits: bool = False) -> StampForm | None:
    """The form of which texts are, the first of a column, or None where they are no stamps.

    With `digits` also that of bare digits: ``095959.5``, ``20260311``, ``20260311095959``.
    """
    kinds = (kind for kind in FORMS if kind != FRACTION and (digits or "digits" not in kind))
    kind = next((kind for kind in kinds if texts and StampForm(kind).matches(texts[0])), None)
    if kind is None:
        return None
    found = [match for text in texts if (match := re.match(FORMS[kind], text))]
    parts = [part for match in found if (part := match.groupdict().get("F"))]
    order, part_digits = _order_of_parts(parts)
    if kind == "time":
        order = order or _order_of_time(texts, found)
    if kind in ("date", "date and time"):
        order = order or _order_of_dates(texts[0], found)
    return StampForm(kind, order or "ymd", part_digits)


def _order_of_time(texts: Sequence[str], found: Sequence[re.Match[str]]) -> str:
    """What can't be told of times of day with colons; nothing where all can."""
    if texts[0].count(":") == 1 and not (found[0]["p"] or found[0]["q"]):
        return "h?"
    four = [match for match in found if match["F"] and match.string[match.start("F") - 1] == ":"]
    is_clock = [int(m["M"]) < 24 and len(m["F"]) == 2 and int(m["F"]) < 60 for m in four]
    return "d?" if four and all(is_clock) else ""


def _order_of_parts(parts: Sequence[str]) -> tuple[str, int]:
    """What can't be told of parts of a second, and the digits of those that lack zeros before them.

    They do where they are of unlike length and zeros stand at an end, which whole milliseconds do and
    decimals whose zeros are left out don't. Groups of three digits are decimals, as Java writes them.
    """
    lengths = {len(part) for part in parts}
    is_whole = any(part[-1] == "0" for part in parts if len(part) > 1)
    if len(lengths) < 2 or not is_whole or all(length % 3 == 0 for length in lengths):
        return "", 0
    if any(part[0] == "0" and len(part) > 1 for part in parts):
        return "", 0
    return ("f?", 0) if max(lengths) % 3 else ("", max(lengths))


def _order_of_dates(first: str, found: Sequence[re.Match[str]]) -> str:
    """The order of year, month and day."""
    if any(len(match["a"]) == 4 for match in found):
        return "ymd"
    if any(match["b"].isalpha() for match in found) or "." in first.split()[0]:
        return "dmy"
    if any(int(match["a"]) > 12 for match in found):
        # 26-03-11 may be of 2026 or 2011: what changes is the day.
        firsts, lasts = ({match[key] for match in found} for key in "ac")
        if any(len(last) == 4 or int(last) > 31 for last in lasts) or len(firsts) > 1:
            return "dmy"
        return "ymd" if len(lasts) > 1 else "y?"
    if any(int(match["b"]) > 12 for match in found) or found[0].groupdict().get("p"):
        return "mdy"
    return "?"


def _whole(texts: Any) -> IntArray:
    """Digits as whole numbers, 0 where there are none."""
    import pyarrow as arrow
    import pyarrow.compute as compute

    digits = compute.if_else(compute.equal(texts, ""), None, texts)
    return values_of(compute.fill_null(digits.cast(arrow.int64()), 0))


def _month(texts: Any) -> IntArray:
    """Months from their numbers or English or German names, 0 where there is none."""
    import pyarrow as arrow
    import pyarrow.compute as compute

    if not compute.any(compute.match_substring_regex(texts, "[A-Za-z]")).as_py():
        return _whole(texts)
    names = compute.utf8_slice_codeunits(compute.utf8_lower(texts), 0, 3)
    for german, english in _GERMAN_MONTHS.items():
        names = compute.replace_substring(names, german, english)
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


def _days_of_year(year: IntArray, day: IntArray) -> tuple[IntArray, BoolArray]:
    """Days since 1970 of days of a year, from 1, and which are none."""
    first, after = (
        (year - 1970 + more).astype("datetime64[Y]").astype("datetime64[D]").astype(np.int64)
        for more in (0, 1)
    )
    return first + day - 1, (day < 1) | (day > after - first) | (year < 1900) | (year > 2200)


def _seconds(parts: dict[str, Any], part_digits: int) -> tuple[IntArray, BoolArray]:
    """Nanoseconds of times of day, their zone taken off, and which are none."""
    import pyarrow.compute as compute

    none = compute.if_else(compute.is_valid(next(iter(parts.values()))), "", "")
    of_hours = "H" in parts
    parts = dict.fromkeys("HMSFpqz", none) | parts
    hour, minute, second = (_whole(parts[key]) for key in "HMS")
    # Minutes without hours may go on beyond 59.
    wrong = ((minute > 59) & of_hours) | (second > 60)
    half = compute.binary_join_element_wise(
        compute.fill_null(parts["q"], ""), compute.fill_null(parts["p"], ""), ""
    )
    is_late = values_of(compute.match_substring_regex(half, _MERIDIANS))
    hour = np.where(values_of(compute.equal(half, "")), hour, hour % 12 + 12 * is_late)
    fraction = compute.fill_null(parts["F"], "")
    if part_digits:
        wrong |= values_of(compute.greater(compute.utf8_length(fraction), part_digits))
        fraction = compute.utf8_lpad(fraction, part_digits, "0")
    fraction = _whole(compute.utf8_rpad(fraction, 9, "0"))
    return (
        (hour * 60 + minute - _east(compute.fill_null(parts["z"], ""))) * 60 + second
    ) * NS + fraction, wrong


def _east(zone: Any) -> IntArray:
    """Minutes that clocks of zones are before UTC."""
    import pyarrow.compute as compute

    for name, offset in _OFFSETS.items():
        zone = compute.replace_substring_regex(zone, f"^{name}$", offset)
    digits = compute.replace_substring_regex(zone, "[A-Z:]", "")
    digits = compute.replace_substring_regex(digits, r"^([+-]\d\d)$", r"\100")
    east = _whole(compute.replace_substring(digits, "+", ""))
    return np.asarray(np.sign(east) * (np.abs(east) // 100 * 60 + np.abs(east) % 100))
