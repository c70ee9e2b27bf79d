"""Files whose columns stand in groups of one rate each: logs of vehicles and test benches.

The group that holds a clock and a gyro is the run; columns of the run format in other groups, of another
rate, are brought to its times. Fields that a format's own documents name are known by these names.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from fogml.arrays import FloatArray
from fogml.errors import InputError, listed, printable, quoted
from fogml.readers import reader_of
from fogml.runs.columns import column_spec, parse_header, stated_cell
from fogml.runs.findings import Finding
from fogml.runs.header_spelling import canonical_cells
from fogml.runs.other_rate import Beside, clock_ends, clock_s, held_beyond, interpolated, is_held
from fogml.runs.raw_table import RawTable, choose_vectors, moment, stored_blocks, vector_fault
from fogml.runs.reader_process import StoredArray, StoredFile, stored_file
from fogml.runs.reading_limits import DEFAULT_LIMITS, ReadingLimits
from fogml.signals import large

_INSTANCE = r"(\.\d+)?"
_XYZ = ("x", "y", "z")
_ROS = {
    **{f"angular_velocity.{axis}": f"gyro_{axis} [rad/s]" for axis in _XYZ},
    **{f"magnetic_field.{axis}": f"B_{axis} [tesla]" for axis in _XYZ},
    "temperature": "T [degC]",
}
# Reader, its groups, and what their fields are: units as PX4's msg/ folder, ArduPilot's log messages and the
# sensor_msgs of ROS state them; an instrument code J of SEED is a rotation sensor's.
_KNOWN_FIELDS: tuple[tuple[str, str, dict[str, str]], ...] = (
    ("ulog", rf"sensor_gyro{_INSTANCE}", {"timestamp_sample": "time [us]", "temperature": "T [degC]",
                                          **{axis: f"gyro_{axis} [rad/s]" for axis in _XYZ}}),
    ("ulog", "sensor_combined", {"timestamp": "time [us]",
                                 **{f"gyro_rad.{i}": f"gyro_{axis} [rad/s]" for i, axis in enumerate(_XYZ)}}),
    ("dataflash", rf"IMU{_INSTANCE}", {"TimeUS": "time [us]", "T": "T [degC]",
                                       **{f"Gyr{axis.upper()}": f"gyro_{axis} [rad/s]" for axis in _XYZ}}),
    ("dataflash", rf"GYR{_INSTANCE}", {"SampleUS": "time [us]",
                                       **{f"Gyr{axis.upper()}": f"gyro_{axis} [rad/s]" for axis in _XYZ}}),
    ("rosbag", r".*", _ROS),
    ("mcap", r".*", _ROS),
)  # fmt: skip
_ROTATION = re.compile(r"[A-Z]J(.)\Z")
_AXIS_OF_CODE = {"X": "x", "E": "x", "1": "x", "Y": "y", "N": "y", "2": "y", "Z": "z", "3": "z"}


@dataclass(frozen=True)
class Group:
    """Columns of one rate: header cells, spelled as in the run format, with their arrays."""

    name: str
    columns: tuple[tuple[str, StoredArray], ...]

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the columns."""
        return tuple(parse_header(cell)[0] for cell, _ in self.columns)

    @property
    def is_timed(self) -> bool:
        """Whether it holds a clock."""
        return "time" in self.names

    @property
    def is_run(self) -> bool:
        """Whether it holds a clock and a gyro."""
        return self.is_timed and any(n == "gyro" or n.startswith("gyro_") for n in self.names)

    def column(self, name: str) -> tuple[str, StoredArray]:
        """Header cell and array of a column."""
        return self.columns[self.names.index(name)]


def grouped(stored: StoredFile) -> dict[str, list[StoredArray]]:
    """The arrays of a file by their groups."""
    found: dict[str, list[StoredArray]] = {}
    for array in stored.arrays:
        found.setdefault(array.group, []).append(array)
    return found


def groups_of(stored: StoredFile, kind: str) -> list[Group]:
    """The groups of a file, in its order; what has no clock and is as long as one group's goes with that."""
    rotations = [array.name for array in stored.arrays if kind == "miniseed" and _ROTATION.search(array.name)]
    groups = [
        Group(
            name, tuple(zip(canonical_cells(_cells(kind, name, arrays, len(rotations))), arrays, strict=True))
        )
        for name, arrays in grouped(stored).items()
    ]
    clocks = {group.name: max(group.column("time")[1].shape, default=0) for group in groups if group.is_timed}
    home = {group.name: group.name for group in groups}
    for group in groups:
        counts = {max(array.shape, default=0) for _, array in group.columns if vector_fault(array) is None}
        alike = [name for name, count in clocks.items() if counts == {count}]
        if not group.is_timed and len(alike) == 1:
            home[group.name] = alike[0]
    return [
        replace(
            group, columns=tuple(c for one in groups if home[one.name] == group.name for c in one.columns)
        )
        for group in groups
        if home[group.name] == group.name
    ]


def _cells(kind: str, group: str, arrays: Sequence[StoredArray], rotations: int) -> list[str]:
    known: dict[str, str] = {}
    for reader, pattern, fields in _KNOWN_FIELDS:
        if reader == kind and re.fullmatch(pattern, group):
            known = known or fields
    names = {array.name for array in arrays}
    is_vehicle = kind in ("ulog", "dataflash")
    if known and is_vehicle and not any(c == "time [us]" and name in names for name, c in known.items()):
        known = known | {"timestamp": "time [us]"}
    cells = []
    for array in arrays:
        code = _ROTATION.search(array.name) if kind == "miniseed" else None
        if code is not None:
            axis = _AXIS_OF_CODE.get(code[1])
            cells.append("gyro [count]" if rotations == 1 or axis is None else f"gyro_{axis} [count]")
        else:
            cells.append(known.get(array.name, stated_cell(array.name, array.unit)))
    return cells


def container_blocks(
    path: Path,
    kind: str,
    rows: int | None,
    columns: Collection[str] | None = None,
    limits: ReadingLimits = DEFAULT_LIMITS,
) -> Iterator[RawTable]:
    """The table of a file of groups in blocks of at most `rows` rows; whole for None.

    Only time, gyro and `columns` are read where these are given.
    """
    with stored_file(path, kind, (), limits) as stored:
        groups = groups_of(stored, kind)
        runs = [group for group in groups if group.is_run]
        if not runs:
            raise unknown_fields(path, kind, groups)
        main, findings = runs[0], []
        gyros = {name for name in main.names if name.startswith("gyro")}
        if others := [group.name for group in runs[1:] if gyros & set(group.names)]:
            message = f"the gyro of {quoted(main.name)} is read; an import profile reads {listed(others)}"
            findings.append(Finding("other_gyros", message, count=len(others)))
        vectors, left_out = choose_vectors(path.name, main.columns)
        joined = [
            (cell, group, array)
            for group in groups
            if group is not main and group.is_timed and group.name not in others
            for cell, array in group.columns
            if _is_joined(cell, main) and (columns is None or parse_header(cell)[0] in columns)
        ]
        joined, others_of = _one_of_each(joined)
        findings += [*left_out, *_joined_findings(joined), *others_of, *_fields_left_out(stored)]
        timed = {group.name: group for group in (main, *(group for _, group, _ in joined)) if joined}
        ends = {name: _clock_ends(path, stored, group) for name, group in timed.items()}
        for cell, group, array in joined:
            findings += held_beyond(
                parse_header(cell)[0], ends[main.name], ends[group.name], max(array.shape)
            )
        started = moment(stored.told.get("origin_s"))
        beside = [Beside(cell, group.column("time"), array) for cell, group, array in joined]
        for table in stored_blocks(stored, vectors, tuple(findings), None, rows, columns):
            yield replace(_with_joined(table, stored, beside), started=started)


def _is_joined(cell: str, main: Group) -> bool:
    name = parse_header(cell)[0]
    is_known = column_spec(name) is not None or re.fullmatch("gyro_[xyz]", name) is not None
    return is_known and name not in ("time", "gyro") and name not in main.names


def _one_of_each(
    joined: Sequence[tuple[str, Group, StoredArray]],
) -> tuple[list[tuple[str, Group, StoredArray]], list[Finding]]:
    """The first of the columns of a name, and a finding where other groups hold one too."""
    of_name: dict[str, list[tuple[str, Group, StoredArray]]] = {}
    for one in joined:
        of_name.setdefault(parse_header(one[0])[0], []).append(one)
    findings = []
    for name, (first, *others) in of_name.items():
        if others:
            groups = listed([quoted(group.name) for _, group, _ in others])
            message = f"'{name}' of {quoted(first[1].name)} is read; an import profile reads that of {groups}"
            findings.append(Finding("other_columns", message, column=name, count=len(others)))
    return [held[0] for held in of_name.values()], findings


def _joined_findings(joined: Sequence[tuple[str, Group, StoredArray]]) -> Iterator[Finding]:
    for cell, group, array in joined:
        name = parse_header(cell)[0]
        how = "held" if is_held(name) else "interpolated"
        message = f"'{name}' of {quoted(group.name)}, {max(array.shape)} values, {how} at its true times"
        yield Finding("other_rate", message, column=name, count=max(array.shape))


def _fields_left_out(stored: StoredFile) -> Iterator[Finding]:
    for group, (held, given) in stored.told.get("left_out", {}).items():
        message = (
            f"{quoted(group)} holds {held} numbers a message, of which the first {given} are columns; an "
            f"import profile reads any other by its name, 'source: {printable(group)}/NAME'"
        )
        yield Finding("fields_left_out", message, count=held - given)


def unused_attributes(stored: StoredFile) -> Iterator[Finding]:
    """What is said of numbers beside columns that may change them, by no convention that is known."""
    if unused := stored.told.get("unused"):
        told = f"attributes that change nothing: {listed(unused)}; where they do, a profile states a scale"
        yield Finding("unused_attributes", told, count=len(unused))


def _with_joined(table: RawTable, stored: StoredFile, joined: Sequence[Beside]) -> RawTable:
    """A block with the columns of other groups at its times."""
    if not joined or not len(table):
        return table
    time = next(cell for cell in table.columns if parse_header(cell)[0] == "time")
    seconds = table.columns[time] * clock_s(time, table.file)
    columns = dict(table.columns) | {one.cell: one.at(stored, seconds) for one in joined}
    return replace(table, cells=tuple(columns), columns=columns)


def container_columns(
    path: Path,
    kind: str,
    sources: Sequence[str | int],
    clock: str | int | None,
    held: Collection[str | int | None] = (),
) -> tuple[dict[str | int, FloatArray], tuple[Finding, ...]]:
    """Columns of a file of groups by ``GROUP/FIELD``, or by the field where there is one of that name.

    All are brought to the times of the group that most of them are of, or that holds `clock`; those of `held`
    keep a value until the next one.

    Raises
    ------
    InputError
        If a source is not there, or a group of another rate has no clock.
    """
    names = [source for source in sources if isinstance(source, str)]
    with stored_file(path, kind, names, DEFAULT_LIMITS) as stored:
        groups = {group.name: group for group in groups_of(stored, kind)}
        found = {source: _source(path, stored, source) for source in sources}
        for source, array in found.items():
            if fault := vector_fault(array):
                raise InputError(f"{path.name}, column {quoted(str(source))}: {fault}; name another")
        home = {array.index: group.name for group in groups.values() for _, array in group.columns}
        names = [home[array.index] for array in found.values()]
        main = home[found[clock].index] if clock is not None else max(names, key=names.count)
        count = max(next(array for array in found.values() if home[array.index] == main).shape)
        columns: dict[str | int, FloatArray] = {}
        findings = [*unused_attributes(stored)]
        for source, array in found.items():
            stored.limits.check_size(path, float(max(array.shape)))
            values = _read_long(stored, array)
            if (group := home[array.index]) != main:
                at, own = (_clock_of(path, stored, groups[name]) for name in (main, group))
                findings.append(next(_joined_findings([(array.name, groups[group], array)])))
                if source not in held:
                    findings += held_beyond(array.name, clock_ends(at), clock_ends(own), len(own))
                values = interpolated(at, own, values, source in held)
            columns[source] = values
            if len(values) != count:
                raise InputError(
                    f"{path.name}: {quoted(str(source))} holds {len(values)} values of {count}; by a clock "
                    "of its own 'join' brings it in, with the same file"
                )
    return columns, tuple(findings)


def _read_long(stored: StoredFile, array: StoredArray) -> FloatArray:
    """All values of an array, as many as a block's at a time."""
    count = max(array.shape)
    if count <= large.HELD_VALUES:
        return stored.read(array, 0, count)
    held = large.Growing()
    for start in range(0, count, large.HELD_VALUES):
        held.append(stored.read(array, start, min(start + large.HELD_VALUES, count)))
    return held.array()


def _source(path: Path, stored: StoredFile, source: str | int) -> StoredArray:
    if isinstance(source, int):
        raise InputError(f"{path.name}: source {source}: columns of this format are named, 'GROUP/FIELD'")
    whole = [array for array in stored.arrays if f"{array.group}/{array.name}" == source]
    found = whole or [array for array in stored.arrays if array.name == source]
    if len(found) != 1:
        held = [f"{a.group}/{a.name}" if a.group else a.name for a in found or stored.arrays]
        fault = "no column" if not found else "more than one column"
        raise InputError(f"{path.name}: {fault} {quoted(source)}; it holds {listed(held, 40)}")
    return found[0]


def _clock_ends(path: Path, stored: StoredFile, group: Group, rows: int = 256) -> tuple[float, float]:
    """First and last time of a group [s], by so many `rows` at either end: at ends, readings may be none."""
    cell, array = group.column("time")
    count = max(array.shape)
    parts = [stored.read(array, *ends) for ends in ((0, min(rows, count)), (max(count - rows, 0), count))]
    return clock_ends(np.concatenate(parts) * clock_s(cell, path.name))


def _clock_of(path: Path, stored: StoredFile, group: Group) -> FloatArray:
    """Times of a group's samples [s]."""
    if not group.is_timed:
        raise InputError(f"{path.name}: {quoted(group.name)} has no clock by which it could be joined")
    cell, array = group.column("time")
    return stored.read(array, 0, max(array.shape)) * clock_s(cell, path.name)


def unknown_fields(path: Path, kind: str, groups: Sequence[Group]) -> InputError:
    """What to say of a file in which no group holds a clock and a gyro: what it holds, and the way on."""
    label = reader_of(kind).label
    fields = [f"{of}/{c}" if (of := a.group) else c for group in groups for c, a in group.columns]
    return InputError(
        f"{path.name}: a {label} file, and none of its groups has both 'time' and 'gyro' by name; it holds "
        f"{listed(fields, 40) or 'nothing'}. 'fogml import {printable(path.name)} --draft -o profile.yaml' "
        "writes a profile with guesses to correct, and --profile reads by it"
    )
