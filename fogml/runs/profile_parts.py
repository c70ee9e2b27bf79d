"""Parts of an import profile: columns, rows that are left out, legs, and a log of another rate beside it."""

from __future__ import annotations

import re
from fractions import Fraction
from typing import Annotated, Any, Literal

from pydantic import AfterValidator, BeforeValidator, Field

from fogml.runs.columns import canonical_unit
from fogml.strict import Strict

_DECIMAL = r"([-+]?\d{1,30}(?:\.\d{0,30})?(?:[eE][-+]?\d{1,3})?)"
_QUOTIENT = re.compile(rf"\s*{_DECIMAL}\s*/\s*{_DECIMAL}\s*\Z", re.ASCII)
SEPARATORS = {"comma": ",", "semicolon": ";", "tab": "\t", "whitespace": None}


def _number(value: Any) -> Any:
    """A number, or the quotient of two written as text ("1/340")."""
    if not isinstance(value, str):
        return value
    found = _QUOTIENT.match(value)
    try:
        return float(Fraction(found[1]) / Fraction(found[2])) if found else value
    except (OverflowError, ZeroDivisionError):
        raise ValueError("a number or a quotient such as '1/340' was expected") from None


Quotient = Annotated[float, BeforeValidator(_number), Field(allow_inf_nan=False)]
STAMP = "stamp"
"""The unit of a clock of dates and times of day."""
Source = str | Annotated[int, Field(ge=0, strict=True)]


class ImportColumn(Strict):
    """One column of the run: value = source * scale + offset, in `unit`, as its usual spellings go.

    `source` is the column's name in the file's header, or its position where there is none; of a container
    ``GROUP/FIELD``, or the field alone. The unit ``stamp`` of ``time`` says dates and times of day, in one
    column, a list of two, with one of milliseconds behind, or one of six: year, month, day, hour, minute,
    second. `missing` lists values that stand for none: a temperature is interpolated there, other rows are
    left out; both are counted. `hex_bits` says that the text's numbers are hexadecimal ones of so many bits,
    two's complement.
    """

    source: Source | list[Source] | None = None
    unit: Annotated[str, AfterValidator(canonical_unit)]
    scale: Quotient = 1.0
    offset: Quotient = 0.0
    missing: list[float] = []
    hex_bits: int | None = Field(default=None, ge=4, le=64)

    @property
    def stamps(self) -> tuple[Source, ...]:
        """The columns of dates and times of day that make the clock; none where it is one of numbers."""
        if self.unit != STAMP or self.source is None:
            return ()
        return tuple(self.source) if isinstance(self.source, list) else (self.source,)

    @property
    def number(self) -> Source | None:
        """The column of numbers."""
        return None if self.unit == STAMP or isinstance(self.source, list) else self.source


class LeadingJump(Strict):
    """Leading rows that do not belong to the recording, told by a jump that ends them.

    Rows are dropped up to the last step of more than `more_than` (in the source's unit) between
    neighbouring rows of `source`, looked for among the first `within` rows.
    """

    source: Source
    more_than: float = Field(gt=0.0)
    within: int = Field(default=50, ge=2)


class Reject(Strict):
    """Which rows are dropped (and counted) where otherwise they would be an error."""

    wrong_field_count: bool = False
    not_numbers: bool = False
    leading_jump: LeadingJump | None = None


class RowFilter(Strict):
    """Rows that are kept: those whose `source` lies in a range, or is one of some numbers or texts."""

    source: Source
    at_least: float | None = None
    at_most: float | None = None
    equals: list[float] | list[str] | float | str | None = None

    @property
    def texts(self) -> tuple[str, ...]:
        """The texts that it is compared with; none where these are numbers."""
        values = self.equals if isinstance(self.equals, list) else [self.equals]
        return tuple(value for value in values if isinstance(value, str))

    @property
    def numbers(self) -> tuple[float, ...]:
        """The numbers that it is compared with."""
        values = self.equals if isinstance(self.equals, list) else [self.equals]
        return tuple(value for value in values if isinstance(value, int | float))


class LegByTime(Strict):
    """A leg by time since the recording's first row [s], the end excluded."""

    from_s: float = Field(ge=0.0)
    to_s: float = Field(gt=0.0)


class LegByState(RowFilter):
    """A leg by a column of states: the rows whose `source` is one of the values `equals`, or in a range."""


Leg = Annotated[tuple[int, int], Field(strict=False)] | LegByTime | LegByState


class TextLayout(Strict):
    """How a logger writes its text: `ImportProfile` says what each key means."""

    encoding: str = "utf-8"
    separator: Literal["comma", "semicolon", "tab", "whitespace"] = "comma"
    decimal: Literal[".", ","] = "."
    signature: str | None = None
    line_stamp: str | None = Field(default=None, min_length=1)
    checksum: bool = False
    skip_lines: int = Field(default=0, ge=0)
    header_text: str | None = Field(default=None, min_length=1)
    comment: str | None = Field(default=None, min_length=1)
    header_lines: int = Field(default=0, ge=0)
    header: bool = True
    strip_names: bool = True
    fields: int | None = Field(default=None, ge=1)
    reject: Reject = Reject()
    columns: dict[str, ImportColumn]
    where: list[RowFilter] = []

    @property
    def sources(self) -> tuple[Source, ...]:
        """The columns of numbers that are read, each once."""
        wanted = [source for name in self.columns for source in self.sources_of(name)]
        wanted += [rule.source for rule in self.where if not rule.texts]
        wanted += [self.reject.leading_jump.source] if self.reject.leading_jump else []
        return tuple(dict.fromkeys(wanted))

    def sources_of(self, name: str) -> tuple[Source, ...]:
        """The columns of numbers that a column of the run is read from, one of each axis."""
        number = self.columns[name].number
        return () if number is None else (number,)

    def hex_bits(self, source: Source) -> int | None:
        """Bits of the hexadecimal numbers of a source; None where they are decimal."""
        found = (column.hex_bits for name, column in self.columns.items() if source in self.sources_of(name))
        return next(found, None)

    @property
    def text_sources(self) -> tuple[Source, ...]:
        """The columns of text that are read: stamps, and those that are compared with texts."""
        return tuple(dict.fromkeys([*self.stamps, *self.compared_texts]))

    @property
    def compared_texts(self) -> tuple[Source, ...]:
        """The columns that are compared with texts, each once."""
        return tuple(dict.fromkeys(rule.source for rule in self.where if rule.texts))

    @property
    def stamps(self) -> tuple[Source, ...]:
        """The columns of the clock's stamps."""
        return self.columns["time"].stamps if "time" in self.columns else ()

    @property
    def clock(self) -> str | int | None:
        """The source of the time where it is one of numbers."""
        return self.columns["time"].number if "time" in self.columns else None

    @property
    def text_separator(self) -> str | None:
        """The separating character; None for any run of blanks and tabs."""
        return SEPARATORS[self.separator]


class JoinedLog(TextLayout):
    """A log of another rate beside the recording, whose columns are interpolated at the recording's times.

    Attributes
    ----------
    file
        Its name in the recording's folder; ``{stem}`` stands for the recording's without its suffix.
    offset_s
        What its clock lacks to the recording's [s]; stamps with dates need none.
    """

    file: str
    offset_s: float = 0.0
