"""What an import profile says of a logger's rows: filters, values for none, legs, logs beside it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np

from fogml.arrays import BoolArray, FloatArray
from fogml.errors import InputError, counted, quoted
from fogml.readers import plain_path
from fogml.runs.columns import conversion, is_temperature
from fogml.runs.container_files import container_columns
from fogml.runs.logger_lines import FaultyFields
from fogml.runs.logger_text import LoggerTable, read_logger_text
from fogml.runs.opening import opened
from fogml.runs.other_rate import is_held
from fogml.runs.profile_parts import (
    ImportColumn,
    JoinedLog,
    LegByState,
    LegByTime,
    RowFilter,
    Source,
    TextLayout,
)
from fogml.runs.profile_schema import ImportProfile
from fogml.runs.stamps import Stamps
from fogml.signals import large


def read_logger(path: Path, layout: TextLayout, name: str) -> LoggerTable:
    """The source columns of a logger's file, a text or a container that a reader knows.

    Raises
    ------
    InputError
        If the file does not fit the layout.
    """
    file = opened(path)
    if file.kind == "csv":
        try:
            table = read_logger_text(file.path, layout, name)
        except FaultyFields as faulty:
            if file.within and faulty.filled < min(faulty.rows, 2):
                file.within.check_values(f", column '{faulty.column}'")
            raise
        return replace(table, findings=(*table.findings, *(file.within.findings if file.within else ())))
    if layout.text_sources:
        raise InputError(f"{path.name}: texts and stamps are read from text files; name columns of numbers")
    held = {column.number for name, column in layout.columns.items() if is_held(name)}
    columns, findings = container_columns(path, file.kind, layout.sources, layout.clock, held)
    count = len(next(iter(columns.values())))
    return LoggerTable(columns, np.arange(count), count, findings)


def internal(values: FloatArray, name: str, column: ImportColumn) -> FloatArray:
    """A source's values in the internal unit of a column of the run format."""
    factor, shift = conversion(name, column.unit, "import profile")
    with np.errstate(over="ignore", invalid="ignore"):
        return large.each(lambda x: (x * column.scale + column.offset) * factor + shift, values)


def chosen_rows(table: LoggerTable, profile: TextLayout) -> LoggerTable:
    """The rows that the profile's filters keep, without the values that stand for none."""
    for rule in profile.where:
        inside = matching(table, rule)
        if not inside.all():
            words = f"left out by 'where' of {quoted(str(rule.source))}"
            table = table.kept(inside, table.rejected(~inside, words))
    for name, column in profile.columns.items():
        for source in profile.sources_of(name) if column.missing else ():
            if source in table.columns:
                table = _without_none(table, profile, name, source)
    return table


def _without_none(table: LoggerTable, profile: TextLayout, name: str, source: Source) -> LoggerTable:
    """The table without the values of a source that stand for none in a column of the run."""
    values = table.columns[source]
    none = _is_one_of(values, profile.columns[name].missing)
    if not none.any():
        return table
    found = table.rejected(none, f"in which {quoted(str(source))} stands for none left out")
    if is_temperature(name) and not none.all():
        verb = "stands" if found.count == 1 else "stand"
        message = f"{counted(found.count, 'value')} of {quoted(str(source))} {verb} for none: interpolated"
        table = table.kept(slice(None), replace(found, code="sentinel", message=message, column=name))
        filled = _bridged(values, none, _clock(table, profile))
        return replace(table, columns={**table.columns, source: filled})
    return table.kept(~none, found)


def _is_one_of(values: FloatArray, numbers: Sequence[float]) -> BoolArray:
    return large.each(lambda part: np.isin(part, numbers), values, kind=bool)


def _clock(table: LoggerTable, profile: TextLayout) -> FloatArray:
    """What tells how far rows are apart: the clock in any unit, the row's number where that goes back."""
    time = table.seconds if profile.clock is None else table.columns[profile.clock]
    is_clock = time is not None and all(np.all(steps > 0.0) for _, steps in large.differences(time))
    return time if time is not None and is_clock else table.rows.astype(np.float64)


def _bridged(values: FloatArray, none: BoolArray, at: FloatArray) -> FloatArray:
    """Values, in the place of those that are none the line from the one before to the one behind."""
    filled = large.each(np.copy, values)
    changes = np.flatnonzero(none[1:] != none[:-1]) + 1
    edges = np.concatenate([[0], changes, [len(values)]]).tolist()
    for first, end in pairwise(edges):
        if none[first]:
            around = [place for place in (first - 1, end) if 0 <= place < len(values)]
            filled[first:end] = np.interp(at[first:end], at[around], values[around])
    return filled


def matching(table: LoggerTable, rule: RowFilter) -> BoolArray:
    """Which rows a filter keeps, shape (n,)."""
    if rule.texts:
        return np.isin(table.texts[rule.source], rule.texts)
    values = table.columns[rule.source]
    inside = np.ones(len(values), dtype=np.bool_)
    if rule.at_least is not None:
        inside &= values >= rule.at_least
    if rule.at_most is not None:
        inside &= values <= rule.at_most
    if rule.numbers:
        inside &= _is_one_of(values, rule.numbers)
    return inside


def rows_of_leg(table: LoggerTable, profile: ImportProfile, name: str, file: str) -> BoolArray:
    """Which rows belong to a leg, shape (n,).

    Raises
    ------
    InputError
        If it ends beyond the file.
    """
    leg = profile.legs[name]
    if isinstance(leg, LegByState):
        return matching(table, leg)
    if isinstance(leg, LegByTime):
        seconds = seconds_from_first(table, profile)
        return (seconds >= leg.from_s) & (seconds < leg.to_s)
    first, end = leg
    if end > table.total_rows:
        raise InputError(
            f"{file}: leg {quoted(name)} ends at row {end}, the file has only {table.total_rows} rows; "
            "the profile's 'legs' belong to another recording"
        )
    return (table.rows >= first) & (table.rows < end)


def seconds_from_first(table: LoggerTable, profile: ImportProfile) -> FloatArray:
    """Time of each row since the first [s]."""
    if table.seconds is not None:
        return table.seconds - table.seconds[:1]
    clock = profile.clock
    if clock is None:
        assert profile.sample_s is not None
        return np.asarray((table.rows - table.rows[:1]) * profile.sample_s)
    seconds = internal(table.columns[clock], "time", profile.columns["time"])
    return large.each(lambda time: time - seconds[:1], seconds)


def joined_columns(path: Path, log: JoinedLog, stamps: Stamps | None) -> Mapping[str, FloatArray]:
    """Columns of a log beside a recording in internal units, its ``time`` on the recording's clock [s].

    Raises
    ------
    InputError
        If it is missing or does not fit, or one of the two states the zone of its stamps and the other none.
    """
    beside = path.parent / log.file.replace("{stem}", plain_path(path).stem)
    if not beside.is_file():
        raise InputError(
            f"{beside.name}: no such file beside {path.name}, which the profile joins; copy it there"
        )
    table = chosen_rows(read_logger(beside, log, f"join of {path.name}"), log)
    columns = {
        name: internal(table.columns[column.number], name, column)
        for name, column in log.columns.items()
        if column.number is not None
    }
    if table.seconds is not None:
        apart = 0.0
        if stamps is not None and table.stamps is not None:
            if stamps.zoned != table.stamps.zoned and "offset_s" not in log.model_fields_set:
                with_zone, without = (path, beside) if stamps.zoned else (beside, path)
                raise InputError(
                    f"{beside.name}: stamps of {with_zone.name} state their zone and those of {without.name} "
                    "none; write 'offset_s' under 'join' in the profile: 0 where they are UTC, else what is "
                    "added to the joined log's clock, as -3600 for one that shows Central European Time"
                )
            apart = (table.stamps.first_ns - stamps.first_ns) / 1e9
        columns["time"] = table.seconds + apart
    columns["time"] = columns["time"] + log.offset_s
    return columns
