"""The header of a LabVIEW measurement file (.lvm): two blocks of keys above a row of names.

National Instruments, "LabVIEW Measurement File (*.lvm) Specification": separators part keys from values,
each block ends with a mark, and ``Y_Unit_Label`` holds the channels' units.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

_BEGINS = "LabVIEW Measurement"
_END_OF_BLOCK = "***End_of_Header***"
_SEPARATORS = {"Comma": ",", "Tab": "\t"}


class LabviewHeader(NamedTuple):
    """Where the names stand among the lines, what is between fields, and the cells with their units."""

    line: int
    separator: str
    cells: list[str]


def labview_header(lines: Sequence[str]) -> LabviewHeader | None:
    """The header of a LabVIEW measurement file; None of another, or where the first lines hold no names.

    The first column of X values is the time where its dimension is one. Comments are no column: rows without
    one end before it.

    Examples
    --------
    >>> lines = ["LabVIEW Measurement", "Separator\\tTab", "***End_of_Header***", "Y_Unit_Label\\tdeg/h"]
    >>> lines += ["X_Dimension\\tTime", "***End_of_Header***", "X_Value\\tgyro\\tComment"]
    >>> labview_header(lines).cells
    ['time [s]', 'gyro [deg/h]']
    """
    filled = [i for i, line in enumerate(lines) if line.strip()]
    ends = [i for i in filled if lines[i].startswith(_END_OF_BLOCK)]
    if not filled or not lines[filled[0]].startswith(_BEGINS) or len(ends) < 2 or filled[-1] == ends[1]:
        return None
    above = "\n".join(lines[: ends[0]])
    separator = next((mark for name, mark in _SEPARATORS.items() if f"Separator{mark}{name}" in above), "\t")
    keys = {fields[0]: fields[1:] for fields in (line.split(separator) for line in lines[: ends[1]])}
    place = next(i for i in filled if i > ends[1])
    names = [name.strip() for name in lines[place].split(separator)]
    if names[-1] in ("Comment", ""):
        names.pop()
    is_time = keys.get("X_Columns", ["One"])[0] != "No" and keys.get("X_Dimension", ["Time"])[0] == "Time"
    units, cells = iter(keys.get("Y_Unit_Label", [])), []
    for i, name in enumerate(names):
        if name == "X_Value":
            cells.append("time [s]" if i == 0 and is_time else f"X_Value {i}")
        else:
            unit = next(units, "").strip()
            cells.append(f"{name} [{unit}]" if unit else name)
    return LabviewHeader(place, separator, cells)
