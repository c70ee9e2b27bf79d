"""The fields of a container that nobody has described: of its gyro's group, and of what has other clocks."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from fogml.errors import InputError
from fogml.readers.beside import tells_interval
from fogml.runs.columns import parse_header
from fogml.runs.container_files import Group, groups_of
from fogml.runs.draft_layout import MOST_ROWS, Field
from fogml.runs.draft_words import GYRO, WARM
from fogml.runs.raw_table import vector_fault
from fogml.runs.reader_process import StoredFile, stored_file
from fogml.runs.reading_limits import DEFAULT_LIMITS

_VALUES = frozenset({"data", "value", "values", "signal"})
"""What the values of a series are called, as in MATLAB's ``timeseries``, whose group has its name."""


def container_fields(
    path: Path, kind: str
) -> tuple[list[str], list[Field], list[list[Field]], tuple[str, float] | None]:
    """What a draft needs of a container.

    Returns
    -------
    layout, fields, tables, interval
        Remarks; the fields of the group most like a gyro's, and others' temperatures that are brought to its
        times; fields of other lengths or groups, table by table; what tells the sample interval, in seconds.
    """
    with stored_file(path, kind, (), DEFAULT_LIMITS) as stored:
        groups = groups_of(stored, kind)
        scores = {
            group.name: sum(bool(GYRO.search(name)) for name in (*group.names, group.name)) + 2 * group.is_run
            for group in groups
        }
        if not scores:
            raise InputError(f"{path.name}: holds no columns of numbers; a draft needs some")
        main = max(scores, key=lambda name: scores[name])
        timed = [g.name for g in groups if g.is_timed and parse_header(g.column("time")[0])[1]]
        fields: list[Field] = []
        tables: list[list[Field]] = []
        for group in groups:
            found = _fields(stored, group)
            if group.name == main:
                of_gyro = [count for one, count in found if GYRO.search(one.name)]
                counts = [count for _, count in found]
                usual = of_gyro[0] if of_gyro else max(counts, key=counts.count)
                fields += [one for one, count in found if count in (usual, 0)]
                others = dict.fromkeys(count for count in counts if count not in (usual, 0))
                tables += [[one for one, count in found if count == other] for other in others]
            elif {main, group.name} <= set(timed):
                joined = not group.is_run
                fields += [one for one, _ in found if joined and one.name != "time" and WARM.search(one.name)]
            else:
                tables.append([one for one, _ in found])
        interval = stored.told.get("interval")
    rest = [name for name in scores if name != main]
    return [f"# Other groups of the file: {', '.join(rest[:20])}"] if rest else [], fields, tables, interval


def _fields(stored: StoredFile, group: Group) -> list[tuple[Field, int]]:
    """The fields of a group, each with how many values it has; 0 of what is no column of numbers."""
    found = []
    for cell, array in group.columns:
        name, unit = parse_header(cell)
        if tells_interval(array.name) and array.fault is None and np.prod(array.shape) == 1:
            continue
        if name.lower() in _VALUES and array.group:
            name = array.group.rpartition(".")[2].rpartition("/")[2]
        source = f"{array.group}/{array.name}" if array.group else array.name
        count = max(array.shape) if vector_fault(array) is None else 0
        held = stored.read(array, 0, min(count, MOST_ROWS)) if count else ()
        found.append((Field(source, name, unit, [repr(float(value)) for value in held]), count))
    return found
