"""Loggers' recordings brought into the run format by an import profile."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from datetime import datetime, timedelta
from pathlib import Path

import numpy as np

from fogml.arrays import BoolArray, FloatArray
from fogml.errors import InputError, counted, quoted
from fogml.readers import plain_path
from fogml.runs.assemble import MOST_DROPPED, runs_of_columns
from fogml.runs.checks import check_run
from fogml.runs.columns import conversion, parse_header
from fogml.runs.facts import Facts, read_side_file
from fogml.runs.findings import Finding
from fogml.runs.logger_rows import (
    chosen_rows,
    internal,
    joined_columns,
    read_logger,
    rows_of_leg,
    seconds_from_first,
)
from fogml.runs.logger_text import LoggerTable
from fogml.runs.other_rate import held_beyond, interpolated, is_held
from fogml.runs.possible import Rows, small_shares
from fogml.runs.profile_parts import LeadingJump
from fogml.runs.profile_schema import ImportProfile, load_profile, profile_names
from fogml.runs.run import Run
from fogml.runs.sources import run_sources, unchanged
from fogml.signals import large

__all__ = ["import_recording", "load_profile", "profile_names", "run_names", "runs_from_table"]


def import_recording(
    path: str | Path,
    profile: str | Path | ImportProfile,
    axis: str | None = None,
    *,
    repair: bool = False,
    most_dropped: float = MOST_DROPPED,
) -> list[Run]:
    """Bring a logger's file into the run format.

    Parameters
    ----------
    path
        The file; a side file with set-up facts beside it is read too, and overrides the
        profile's facts.
    profile
        Name of a profile that ships, path of a YAML file, or a profile.
    axis
        One axis of the profile; all of them if None.
    repair, most_dropped
        As for `fogml.runs.reading.read_runs`.

    Returns
    -------
    list of Run
        One for each leg and axis, named ``STEM[-LEG][-AXIS]``, and with `repair` for each restart of the
        clock, in the internal units of the run format. Time begins at 0 in each; every row left out is
        counted in the findings, which also hold what `check_run` noticed.

    Raises
    ------
    InputError
        If the file does not fit the profile; the message names file, line or column.
    """
    path = Path(path)
    name = "given" if isinstance(profile, ImportProfile) else Path(profile).stem
    profile = profile if isinstance(profile, ImportProfile) else load_profile(profile)
    _check_axis(profile, axis)
    with unchanged(*run_sources(path)):
        table = read_logger(path, profile, name)
        joined = [joined_columns(path, log, table.stamps) for log in profile.join]
        facts = read_side_file(path)
    return runs_from_table(
        table,
        profile,
        plain_path(path).stem,
        path.name,
        axis,
        facts,
        joined=joined,
        repair=repair or profile.repair,
        most_dropped=most_dropped,
    )


def run_names(profile: ImportProfile, stem: str) -> dict[str, tuple[str | None, str | None]]:
    """Names of the runs that a profile makes of a file, each with its leg and axis."""
    names: dict[str, tuple[str | None, str | None]] = {}
    for leg in profile.legs or (None,):
        for axis in profile.axes or (None,):
            names["-".join(part for part in (stem, leg, axis) if part is not None)] = (leg, axis)
    return names


def runs_from_table(
    table: LoggerTable,
    profile: ImportProfile,
    stem: str,
    file: str,
    axis: str | None = None,
    facts: Facts | None = None,
    *,
    joined: Sequence[Mapping[str, FloatArray]] = (),
    repair: bool = False,
    most_dropped: float = MOST_DROPPED,
) -> list[Run]:
    """The runs that a profile makes of a logger's table: legs, axes, units, facts, notes.

    Parameters
    ----------
    table
        What was read from the file.
    profile
        The profile it was read by.
    stem
        What the runs' names begin with.
    file
        Name of the file for messages.
    axis
        One axis, or all.
    facts
        Facts that override the profile's.
    joined
        Columns of logs beside the recording with their ``time``, in internal units.
    repair, most_dropped
        As for `fogml.runs.reading.read_runs`.

    Raises
    ------
    InputError
        If a leg lies outside the file, the clock goes back, or the axis is unknown.
    """
    _check_axis(profile, axis)
    table = _without_leading_rows(table, profile.reject.leading_jump)
    table = chosen_rows(table, profile)
    runs = []
    for name, (leg, this_axis) in run_names(profile, stem).items():
        if axis is None or this_axis == axis:
            part, found = _leg(table, profile, leg, file)
            rows = large.chosen(table.rows, part)
            if not len(rows):
                what = "the profile rejects them all" if leg is None else f"no row is of the leg '{leg}'"
                raise InputError(f"{file}: no rows are left; {what}")
            findings = [*table.findings, *found]
            own = _facts(profile, this_axis, facts, table)
            if leg is not None and own.powered_on is not None:
                # It is told on the clock of the recording, of which the leg is a part.
                later = float(seconds_from_first(table, profile)[part][0])
                own = own.model_copy(update={"powered_on": own.powered_on - later})
            runs += runs_of_columns(
                _columns(table, part, profile, this_axis, file, joined, findings),
                Rows(file, lambda i, rows=rows: f"data row {int(rows[i]) + 1}"),  # type: ignore[misc]
                _with_losses(own, findings, len(rows), most_dropped),
                name,
                gyro_unit="count" if profile.columns["gyro"].unit == "count" else "deg/h",
                tick_s=_tick_s(profile),
                findings=findings,
                repair=repair,
                most_dropped=most_dropped,
            )
    begun = None if table.stamps is None else table.stamps.started
    runs = [_from_zero(run, begun) for run in runs]
    return [run.with_findings(check_run(run)) for run in runs]


def _tick_s(profile: ImportProfile) -> float:
    """One count of the logger's clock [s]."""
    clock = profile.columns.get("time")
    return (
        1.0
        if clock is None or clock.stamps
        else clock.scale * conversion("time", clock.unit, "import profile")[0]
    )


def _from_zero(run: Run, begun: datetime | None) -> Run:
    """The run with a clock that begins at 0, where it was at the file's first stamp, `begun`."""
    columns = {**run.columns, "time": large.each(lambda time: time - run.time[:1], run.time)}
    facts = run.facts
    if begun is not None and facts.started == begun:
        started = begun + timedelta(seconds=float(run.time[0]))
        facts = facts.model_copy(update={"started": started})
    return Run.derived(run.name, columns, facts, run.gyro_unit, run.findings)


def _with_losses(facts: Facts, findings: Sequence[Finding], kept: int, most: float) -> Facts:
    """Facts whose notes say that more than a share `most` of the recording's rows was left out."""
    lost = {f.message: f.count for f in findings if f.code == "rejected_rows"}
    count = sum(lost.values())
    if count <= most * (kept + count):
        return facts
    told = f"On import {count} of {kept + count} rows were left out: {'; '.join(lost)}."
    return facts.model_copy(update={"notes": " ".join([*([facts.notes] if facts.notes else []), told])})


def _check_axis(profile: ImportProfile, axis: str | None) -> None:
    if axis is not None and axis not in profile.axes:
        known = ", ".join(profile.axes) or "none"
        raise InputError(f"axis {quoted(axis)} is not in the import profile; its axes are: {known}")


def _without_leading_rows(table: LoggerTable, rule: LeadingJump | None) -> LoggerTable:
    """The table without the leading rows that a jump sets apart."""
    if rule is None:
        return table
    steps = np.abs(np.diff(table.columns[rule.source][: rule.within])) > rule.more_than
    if not steps.any():
        return table
    count = int(np.flatnonzero(steps)[-1]) + 1
    finding = Finding(
        "rejected_rows",
        f"{counted(count, 'leading row')} left out: {quoted(str(rule.source))} then jumps by more than "
        f"{rule.more_than:g}",
        row=int(table.rows[0]) + 1,
        count=count,
    )
    return table.kept(slice(count, None), finding)


def _leg(
    table: LoggerTable, profile: ImportProfile, leg: str | None, file: str
) -> tuple[BoolArray | slice, tuple[Finding, ...]]:
    """The rows of a leg, and how many rows of the file belong to none."""
    if leg is None:
        return slice(None), ()
    inside = {name: rows_of_leg(table, profile, name, file) for name in profile.legs}
    outside = ~np.any(list(inside.values()), axis=0)
    found = (table.rejected(outside, "of the file in no leg left out"),) if outside.any() else ()
    return inside[leg], found


def _columns(
    table: LoggerTable,
    part: BoolArray | slice,
    profile: ImportProfile,
    axis: str | None,
    file: str,
    joined: Sequence[Mapping[str, FloatArray]],
    findings: list[Finding],
) -> dict[str, FloatArray]:
    """The columns of a run in internal units; what is noticed of joined ones is added to `findings`."""
    columns: dict[str, FloatArray] = {}
    for name, column in profile.columns.items():
        source = profile.axes[axis] if name == "gyro" and axis is not None else column.number
        if source is not None:
            columns[name] = internal(large.chosen(table.columns[source], part), name, column)
            findings += small_shares(name, column.unit, columns[name])
    rows = large.chosen(table.rows, part)
    if profile.sample_s is not None:
        sample_s = np.float64(profile.sample_s)
        with np.errstate(over="ignore", invalid="ignore"):
            columns["time"] = large.each(lambda row: (row - rows[:1]) * sample_s, rows)
    elif table.seconds is not None:
        columns["time"] = large.chosen(table.seconds, part)
    for name, values in columns.items():
        large.release()
        lost = np.isinf(values)
        if lost.any():
            raise InputError(
                f"{file}: column '{name}' is no finite number at data row {int(rows[np.argmax(lost)]) + 1} "
                "once it is scaled; correct 'scale', 'offset' or 'sample_s' in the profile"
            )
    start = 0.0 if profile.sample_s is None or not len(rows) else float(rows[0]) * profile.sample_s
    for log, held in zip(profile.join, joined):
        at, time = held["time"] - start, columns["time"]
        begin, end = float(np.nanmin(at)), float(np.nanmax(at))
        first, last = float(np.nanmin(time)), float(np.nanmax(time))
        if not (begin <= last and first <= end):
            name = log.file.replace("{stem}", plain_path(Path(file)).stem)
            raise InputError(
                f"{file}: the joined {name} covers {begin:.10g} to {end:.10g} s of the recording's clock, "
                f"which shows {first:.10g} to {last:.10g} s; it needs dates in both, "
                "or 'offset_s' in the profile"
            )
        for name in held:
            if name != "time":
                columns[name] = interpolated(time, at, held[name], is_held(name))
                findings += held_beyond(name, (first, last), (begin, end), len(at))
    for source in profile.keep:
        columns[parse_header(source)[0]] = large.chosen(table.columns[source], part)
    order = ["time", "gyro", *(name for name in columns if name not in ("time", "gyro"))]
    return {name: columns[name] for name in order}


def _facts(profile: ImportProfile, axis: str | None, overriding: Facts | None, table: LoggerTable) -> Facts:
    """Facts of the profile, then of the axis, then of the side file; notes are joined."""
    layers = [profile.facts, profile.axis_facts.get(axis or "", Facts()), overriding or Facts()]
    values: dict[str, object] = {"axis": axis}
    if table.stamps is not None and table.stamps.started is not None:
        values["started"] = table.stamps.started
    for layer in layers:
        values.update({key: getattr(layer, key) for key in layer.model_fields_set})
    notes = [*profile.notes, *(layer.notes for layer in layers if layer.notes)]
    values["notes"] = " ".join(notes) or None
    return Facts(**values)
