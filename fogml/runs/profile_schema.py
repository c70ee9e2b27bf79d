"""What an import profile may say about a logger's files, and reading one from YAML.

Rows and columns are counted from 0 in a profile, and the end of a row range is excluded;
messages name lines of the file, which editors count from 1.
"""

from __future__ import annotations

import codecs
import re
from fractions import Fraction
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, ValidationError, model_validator

from fogml.errors import InputError, quoted
from fogml.runs.columns import KNOWN, column_spec
from fogml.runs.facts import NAMES, Facts
from fogml.yaml_text import read_yaml

PROFILE_FOLDER = Path(__file__).parent / "import_profiles"

_DECIMAL = r"([-+]?\d{1,30}(?:\.\d{0,30})?(?:[eE][-+]?\d{1,3})?)"
_QUOTIENT = re.compile(rf"\s*{_DECIMAL}\s*/\s*{_DECIMAL}\s*\Z", re.ASCII)
_PART_OF_A_NAME = re.compile(r"\w[\w.+-]{0,39}\Z")
_NO_TEXT = frozenset({"idna", "punycode", "unicode_escape", "raw_unicode_escape", "undefined", "utf_7"})
"""Codecs of Python that no logger writes; some take quadratic time."""

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
Source = str | Annotated[int, Field(ge=0, strict=True)]


class _Strict(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True, strict=True)


class ImportColumn(_Strict):
    """One column of the run: value = source * scale + offset, in `unit`.

    `source` is the column's name in the file's header, or its position where there is none.
    """

    source: Source | None = None
    unit: str
    scale: Quotient = 1.0
    offset: Quotient = 0.0


class LeadingJump(_Strict):
    """Leading rows that do not belong to the recording, told by a jump that ends them.

    Rows are dropped up to the last step of more than `more_than` (in the source's unit) between
    neighbouring rows of `source`, looked for among the first `within` rows.
    """

    source: Source
    more_than: float = Field(gt=0.0)
    within: int = Field(default=50, ge=2)


class Reject(_Strict):
    """Which rows are dropped (and counted) where otherwise they would be an error."""

    wrong_field_count: bool = False
    not_numbers: bool = False
    leading_jump: LeadingJump | None = None


class ImportProfile(_Strict):
    """How a logger writes its files, and what of it becomes a run.

    Attributes
    ----------
    description
        One line for lists of profiles.
    encoding
        Python's name of the text encoding.
    separator
        ``comma``, ``semicolon``, ``tab`` or ``whitespace`` (any run of blanks and tabs).
    decimal
        The decimal mark.
    signature
        Text that the first 20 lines hold; another file is refused.
    skip_lines
        Lines left out at the top before anything else is looked at.
    comment
        Lines that begin with this are left out, blank lines are left out always.
    header_lines
        Lines of set-up numbers that follow, left out too.
    header
        Whether the next line holds the names of the columns.
    strip_names
        Whether blanks around those names are cut off.
    fields
        How many fields a row has; with a header, its number of names unless stated.
    reject
        Which faulty rows are dropped and counted.
    columns
        Columns of the run by name.
    axes
        Axis name to the source column of the gyro; without it ``gyro`` states its source.
    legs
        Leg name to [first row, row after the last]; each leg becomes a run of its own.
    sample_s
        Sample interval [s] where there is no clock, or none to trust.
    facts
        Set-up facts of every run; a side file beside the recording overrides them.
    axis_facts
        Set-up facts by axis.
    notes
        Sentences stated with every run that comes out.
    """

    schema_: Literal["fogml.import/1"] = Field(alias="schema")
    description: str
    encoding: str = "utf-8"
    separator: Literal["comma", "semicolon", "tab", "whitespace"] = "comma"
    decimal: Literal[".", ","] = "."
    signature: str | None = None
    skip_lines: int = Field(default=0, ge=0)
    comment: str | None = Field(default=None, min_length=1)
    header_lines: int = Field(default=0, ge=0)
    header: bool = True
    strip_names: bool = True
    fields: int | None = Field(default=None, ge=1)
    reject: Reject = Reject()
    columns: dict[str, ImportColumn]
    axes: dict[str, Source] = {}
    legs: dict[str, Annotated[tuple[int, int], Field(strict=False)]] = {}
    sample_s: float | None = Field(default=None, gt=0.0)
    facts: Facts = Facts()
    axis_facts: dict[str, Facts] = {}
    notes: list[str] = []

    @model_validator(mode="after")
    def _consistent(self) -> ImportProfile:
        _check_columns(self)
        _check_clock(self)
        if not self.header:
            if self.fields is None:
                raise ValueError("key 'fields': without a header the number of fields must be stated")
            self._check_positions(self.fields)
        for leg, (first, end) in self.legs.items():
            if not 0 <= first < end:
                raise ValueError(f"key 'legs.{leg}': [first row, row after the last] was expected")
        for key, names in (("axes", self.axes), ("legs", self.legs)):
            for name in names:
                # Files are named after them.
                if not _PART_OF_A_NAME.match(name):
                    raise ValueError(
                        f"key '{key}': {quoted(name)}: letters, digits, '.', '+' and '-' were expected"
                    )
        for axis in self.axis_facts:
            if axis not in self.axes:
                raise ValueError(f"key 'axis_facts.{axis}': no such axis under 'axes'")
        try:
            "".encode(self.encoding)
            known = codecs.lookup(self.encoding).name.replace("-", "_") not in _NO_TEXT
        except (LookupError, ValueError):
            known = False
        if not known:
            raise ValueError(f"key 'encoding': no text encoding is called {quoted(self.encoding)}")
        return self

    def _check_positions(self, fields: int) -> None:
        for source in self.sources:
            if isinstance(source, str):
                raise ValueError(f"source {quoted(source)}: without a header, columns are given by position")
            if source >= fields:
                raise ValueError(f"source {source}: a row has only {fields} fields, counted from 0")

    @property
    def sources(self) -> tuple[str | int, ...]:
        """The source columns that the profile uses, each once."""
        wanted = [column.source for column in self.columns.values() if column.source is not None]
        jump = self.reject.leading_jump
        wanted += [*self.axes.values(), *([jump.source] if jump else [])]
        return tuple(dict.fromkeys(wanted))

    @property
    def text_separator(self) -> str | None:
        """The separating character; None for any run of blanks and tabs."""
        return SEPARATORS[self.separator]


def _check_columns(profile: ImportProfile) -> None:
    if "gyro" not in profile.columns:
        raise ValueError("key 'columns': a run always needs 'gyro'")
    for name, column in profile.columns.items():
        spec = column_spec(name)
        if spec is None:
            known = ", ".join([*KNOWN, "T1, T2 ..."])
            raise ValueError(f"key 'columns.{name}': not a column of the run format; use one of {known}")
        if column.unit not in spec.units:
            accepted = ", ".join(spec.units)
            raise ValueError(f"key 'columns.{name}.unit': {quoted(column.unit)} is not one of {accepted}")
        if column.source is None and not (name == "gyro" and profile.axes):
            raise ValueError(f"key 'columns.{name}.source': missing")
        if name == "gyro" and column.source is not None and profile.axes:
            raise ValueError("key 'columns.gyro.source': give it here or under 'axes', not both")


def _check_clock(profile: ImportProfile) -> None:
    if ("time" in profile.columns) == (profile.sample_s is not None):
        raise ValueError("give either a column 'time' or 'sample_s', the interval where no clock is recorded")


def profile_names() -> tuple[str, ...]:
    """Names of the import profiles that ship."""
    return tuple(sorted(path.stem for path in PROFILE_FOLDER.glob("*.yaml")))


def load_profile(name_or_path: str | Path) -> ImportProfile:
    """An import profile by its name, or from a YAML file of one's own.

    Raises
    ------
    InputError
        If there is no such profile, or it is not valid; the message names file and key.
    """
    text = str(name_or_path)
    path = PROFILE_FOLDER / f"{text}.yaml" if text in profile_names() else Path(text)
    if not path.is_file():
        raise InputError(
            f"{text}: no such import profile; give a YAML file or one of {', '.join(profile_names())}"
        )
    values = read_yaml(path, NAMES)
    if not isinstance(values, dict):
        raise InputError(f"{path.name}: an import profile must be 'key: value' lines")
    try:
        return ImportProfile.model_validate(values)
    except ValidationError as error:
        raise InputError(f"{path.name}: {_first_fault(error)}") from None


def _first_fault(error: ValidationError) -> str:
    first = error.errors()[0]
    key = ".".join(str(part) for part in first["loc"])
    if first["type"] == "extra_forbidden":
        home: Any = ImportProfile
        for part in first["loc"][:-1]:
            home = {"reject": Reject, "leading_jump": LeadingJump, "columns": ImportColumn,
                    "facts": Facts, "axis_facts": Facts}.get(str(part), home)  # fmt: skip
        known = ", ".join(field.alias or name for name, field in home.model_fields.items())
        return f"unknown key {quoted(key)}; known keys are {known}"
    if first["type"] == "missing":
        return f"key '{key}' is missing"
    message = str(first["msg"]).removeprefix("Value error, ")
    if not key:
        return message
    return f"key '{key}': {message} (found {quoted(first['input'])})"
