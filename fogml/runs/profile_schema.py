"""What an import profile may say about a logger's files, and reading one from YAML.

Rows and columns are counted from 0 in a profile, and the end of a row range is excluded;
messages name lines of the file, which editors count from 1.
"""

from __future__ import annotations

import codecs
import re
from collections import Counter
from pathlib import Path
from typing import Any, Literal

from pydantic import Field, ValidationError, model_validator

from fogml.errors import InputError, known_are, quoted
from fogml.runs.columns import KNOWN, column_spec, is_accepted, parse_header
from fogml.runs.facts import NAMES, Facts
from fogml.runs.profile_parts import (
    STAMP,
    ImportColumn,
    JoinedLog,
    LeadingJump,
    Leg,
    LegByState,
    LegByTime,
    Reject,
    RowFilter,
    Source,
    TextLayout,
)
from fogml.strict import first_fault
from fogml.yaml_text import read_yaml

PROFILE_FOLDER = Path(__file__).parent / "import_profiles"

_PART_OF_A_NAME = re.compile(r"\w[\w.+-]{0,39}\Z")
_NO_TEXT = frozenset({"idna", "punycode", "unicode_escape", "raw_unicode_escape", "undefined", "utf_7"})
"""Codecs of Python that no logger writes; some take quadratic time."""


class ImportProfile(TextLayout):
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
    line_stamp
        What stands between the date and time of day that a terminal program writes before each line, with
        or without a bracket, and the line: the stamp is a field of its own then, the first.
    checksum
        Whether lines are frames of NMEA 0183, ``$…*HH``: the sum at their end is taken off; those where it is
        wrong or lost have no fields.
    skip_lines
        Lines left out at the top before anything else is looked at.
    comment
        Lines that begin with this are left out, blank lines are left out always.
    header_lines
        Lines of set-up numbers that follow, left out too.
    header_text
        Text of the header's line: the first line that holds it is the header, whatever stands above.
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
    where
        Which rows are kept, by the value of a column; the others are counted.
    legs
        Leg name to [first row, row after the last], to ``{from_s: …, to_s: …}`` by time, or to
        ``{source: …, equals: …}`` by a column of states; each leg becomes a run of its own.
    keep
        Other columns of the file that are kept under their own names.
    join
        Logs of another rate beside the recording, such as a thermometer's.
    repair
        Bring a faulty clock in order, as ``--repair`` does.
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
    axes: dict[str, Source] = {}
    legs: dict[str, Leg] = {}
    sample_s: float | None = Field(default=None, gt=0.0)
    keep: list[str] = []
    join: list[JoinedLog] = []
    repair: bool = False
    facts: Facts = Facts()
    axis_facts: dict[str, Facts] = {}
    notes: list[str] = []

    @model_validator(mode="after")
    def _consistent(self) -> ImportProfile:
        _check_columns(self)
        if ("time" in self.columns) == (self.sample_s is not None):
            raise ValueError(
                "give either a column 'time' or 'sample_s', the interval where no clock is recorded"
            )
        if not self.header:
            if self.fields is None:
                raise ValueError("key 'fields': without a header the number of fields must be stated")
            self._check_positions(self.fields)
        for leg, part in self.legs.items():
            if isinstance(part, tuple) and not 0 <= part[0] < part[1]:
                raise ValueError(f"key 'legs.{leg}': [first row, row after the last] was expected")
            if isinstance(part, LegByTime) and not part.from_s < part.to_s:
                raise ValueError(f"key 'legs.{leg}': 'to_s' must be later than 'from_s'")
            if isinstance(part, LegByState):
                _check_filter(f"legs.{leg}", part)
        for rule in self.where:
            _check_filter("where", rule)
        for log in self.join:
            check_joined(log)
        self._check_names()
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

    def _check_names(self) -> None:
        """Refuse two columns of one name, and those of the run format that no unit is stated for."""
        names = [*self.columns, *(name for log in self.join for name in log.columns if name != "time")]
        kept = [parse_header(source)[0] for source in self.keep]
        for name in kept:
            if column_spec(name) is not None:
                raise ValueError(f"key 'keep': {quoted(name)} is of the run format; state it under 'columns'")
        twice = next((name for name, count in Counter([*names, *kept]).items() if count > 1), None)
        if twice is not None:
            raise ValueError(f"column {quoted(twice)} is stated twice by 'columns', 'join' and 'keep'")

    def _check_positions(self, fields: int) -> None:
        for source in (*self.sources, *self.text_sources):
            if isinstance(source, str):
                raise ValueError(f"source {quoted(source)}: without a header, columns are given by position")
            if source >= fields:
                raise ValueError(f"source {source}: a row has only {fields} fields, counted from 0")

    @property
    def sources(self) -> tuple[Source, ...]:
        """The columns of numbers that the profile uses, each once."""
        states = [leg.source for leg in self.legs.values() if isinstance(leg, LegByState) and not leg.texts]
        return tuple(dict.fromkeys([*super().sources, *states, *self.keep]))

    def sources_of(self, name: str) -> tuple[Source, ...]:
        """The columns of numbers that a column of the run is read from, one of each axis."""
        return tuple(self.axes.values()) if name == "gyro" and self.axes else super().sources_of(name)

    @property
    def compared_texts(self) -> tuple[Source, ...]:
        """The columns that are compared with texts, each once."""
        states = [leg.source for leg in self.legs.values() if isinstance(leg, LegByState) and leg.texts]
        return tuple(dict.fromkeys([*super().compared_texts, *states]))


def check_joined(log: JoinedLog) -> None:
    """Refuse a log beside the recording that is elsewhere, or holds no clock or nothing else."""
    if "/" in log.file or "\\" in log.file or log.file.startswith("."):
        raise ValueError(
            f"key 'join.file': {quoted(log.file)}: a name in the recording's folder was expected"
        )
    if "time" not in log.columns or "gyro" in log.columns or len(log.columns) < 2:
        raise ValueError("key 'join.columns': 'time' and columns beside 'gyro' were expected")
    _check_units(log.columns, "join.columns")
    for name, column in log.columns.items():
        if column.source is None:
            raise ValueError(f"key 'join.columns.{name}.source': missing")
    for rule in log.where:
        _check_filter("join.where", rule)


def _check_filter(key: str, rule: RowFilter) -> None:
    """Refuse a rule that keeps every row, or that orders texts."""
    in_range = rule.at_least is not None or rule.at_most is not None
    if rule.texts and in_range:
        raise ValueError(f"key '{key}': texts have no range; state 'equals', or 'at_least' and 'at_most'")
    if not in_range and not rule.texts and not rule.numbers:
        raise ValueError(f"key '{key}': 'equals', 'at_least' or 'at_most' was expected")


def _check_columns(profile: ImportProfile) -> None:
    if "gyro" not in profile.columns:
        raise ValueError("key 'columns': a run always needs 'gyro'")
    _check_units(profile.columns)
    for name, column in profile.columns.items():
        if column.source is None and not (name == "gyro" and profile.axes):
            raise ValueError(f"key 'columns.{name}.source': missing")
        if name == "gyro" and column.source is not None and profile.axes:
            raise ValueError("key 'columns.gyro.source': give it here or under 'axes', not both")


def _check_units(columns: dict[str, ImportColumn], key: str = "columns") -> None:
    for name, column in columns.items():
        spec = column_spec(name)
        if spec is None:
            known = known_are(name, [*KNOWN, "T1, T2 ..."], "those")
            raise ValueError(f"key '{key}.{name}': not a column of the run format; {known}")
        if column.scale == 0.0:
            raise ValueError(f"key '{key}.{name}.scale': 0 makes one value of all")
        is_stamp = name == "time" and column.unit == STAMP
        if isinstance(column.source, list) and not is_stamp:
            raise ValueError(f"key '{key}.{name}.source': one column was expected")
        if not is_stamp and not is_accepted(name, column.unit):
            units = [*spec.units, *([STAMP] if name == "time" else [])]
            told = known_are(str(column.unit), units, "accepted units")
            raise ValueError(f"key '{key}.{name}.unit': {quoted(column.unit)} is not accepted; {told}")


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
        known = known_are(text, profile_names(), "those that ship")
        raise InputError(f"{text}: no such import profile; {known}; or give a YAML file")
    values = read_yaml(path, NAMES, "fogml.import/1")
    if not isinstance(values, dict):
        raise InputError(f"{path.name}: an import profile must be 'key: value' lines")
    try:
        return ImportProfile.model_validate(values)
    except ValidationError as error:
        raise InputError(f"{path.name}: {_first_fault(error)}") from None


_HOMES: dict[str, Any] = {
    "reject": Reject, "leading_jump": LeadingJump, "columns": ImportColumn, "facts": Facts,
    "axis_facts": Facts, "where": RowFilter, "join": JoinedLog, "legs": LegByState,
}  # fmt: skip


def _first_fault(error: ValidationError) -> str:
    first = first_fault(error)
    key = ".".join(str(part) for part in first["loc"])
    if first["type"] == "extra_forbidden":
        home: Any = ImportProfile
        for part in first["loc"][:-1]:
            home = _HOMES.get(str(part), home)
        # What a profile begins with comes first, whichever class states it.
        fields = sorted(home.model_fields.items(), key=lambda item: item[0] not in ("schema_", "description"))
        known = [field.alias or name for name, field in fields]
        return f"unknown key {quoted(key)}; {known_are(str(first['loc'][-1]), known, 'known keys')}"
    if first["type"] == "missing":
        return f"key '{key}' is missing"
    message = str(first["msg"]).removeprefix("Value error, ")
    if not key:
        return message
    return f"key '{key}': {message} (found {quoted(first['input'])})"
