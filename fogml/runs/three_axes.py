"""A file of three gyros, ``gyro_x``, ``gyro_y``, ``gyro_z``, that share temperatures: one run an axis."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from fogml.errors import InputError, quoted
from fogml.runs.columns import parse_header
from fogml.runs.findings import Finding
from fogml.runs.raw_table import RawTable
from fogml.runs.run import Run

AXES = ("x", "y", "z")
OF_AN_AXIS = ("gyro", "rate")
"""Columns that a file may hold for each axis, as ``gyro_x``."""


class SeveralAxes(InputError):
    """A file, by its base name, holds the gyros of several axes where one is needed."""

    def __init__(self, file: str, axes: tuple[str, ...]) -> None:
        self.axes = axes
        super().__init__(
            f"{file}: holds the gyros {', '.join(f'gyro_{axis}' for axis in axes)}, and one is needed here; "
            f"name it (--axis {axes[0]}, where the command takes that), or save it as a file of its own with "
            "the column 'gyro'"
        )


def axes_of(names: Collection[str]) -> tuple[str, ...]:
    """The axes that columns of these names are of; none where there is a plain ``gyro``."""
    return () if "gyro" in names else tuple(axis for axis in AXES if f"gyro_{axis}" in names)


@dataclass
class OneAxis:
    """Takes one axis out of a file, its table first, then the runs made of that.

    Of none it takes whatever the file holds.
    """

    axis: str | None
    several: bool = False
    own_rate: bool = False

    def __post_init__(self) -> None:
        """Check the axis.

        Raises
        ------
        InputError
            If it is none.
        """
        if self.axis is not None and self.axis not in AXES:
            raise InputError(f"axis {quoted(self.axis)}: one of {', '.join(AXES)} was expected")

    def columns(self, names: Collection[str] | None) -> Collection[str] | None:
        """Names of columns to read, those of the axis beside them; None for all."""
        if names is None or self.axis is None:
            return names
        return {*names, *(f"{name}_{self.axis}" for name in OF_AN_AXIS)}

    def table(self, table: RawTable) -> RawTable:
        """A file's table with the axis' columns as ``gyro`` and ``rate``, and without the other axes'.

        A table of one gyro stays as it is.

        Raises
        ------
        InputError
            If it holds other axes and not this one.
        """
        names = {cell: parse_header(cell)[0] for cell in table.cells}
        held = axes_of(names.values())
        if self.axis is None or not held:
            return table
        if self.axis not in held:
            raise InputError(f"{table.file}: no column 'gyro_{self.axis}'; it holds {', '.join(held)}")
        self.several, self.own_rate = True, f"rate_{self.axis}" in names.values()
        left_out = {f"{name}_{other}" for name in OF_AN_AXIS for other in AXES if other != self.axis}
        left_out |= {"rate"} if self.own_rate else set()
        own = {f"{name}_{self.axis}": name for name in OF_AN_AXIS}
        cells = {
            cell: cell.replace(name, own[name], 1) if name in own else cell
            for cell, name in names.items()
            if name not in left_out
        }
        columns = {cells[cell]: values for cell, values in table.columns.items() if cell in cells}
        called = {name: other for other, name in own.items() if other in names.values()}
        return replace(table, cells=tuple(cells.values()), columns=columns, called=called)

    def run(self, run: Run) -> Run:
        """A run of that table with the facts of its axis.

        What a side file states of an attitude or a table is of the ``axis`` that it names, and what stands
        under ``axes`` of each.

        Raises
        ------
        InputError
            If a run of one gyro is not of that axis, or a table turns and nothing tells about which axis.
        """
        axis, facts = self.axis, run.facts
        if axis is None:
            return run
        if not self.several:
            if facts.axis != axis:
                stated = f"is of axis {quoted(facts.axis)}" if facts.axis else "does not state its axis"
                raise InputError(
                    f"{run.name}: axis {axis} is wanted and it {stated}; write 'axis: {axis}' into its side "
                    "file if it is"
                )
            return run
        told = next((own for name, own in (facts.axes or {}).items() if name == axis), None)
        update: dict[str, Any] = {"axis": axis, "axes": None}
        update |= {} if told is None else {name: getattr(told, name) for name in told.model_fields_set}
        findings, columns = [], dict(run.columns)
        if facts.axis != axis and facts.input_axis is not None and "input_axis" not in update:
            update["input_axis"] = None
            whose = f"of axis {facts.axis}" if facts.axis else "of no axis by name"
            message = (
                f"the side file states an input axis {whose}; that of {axis} is not known: write "
                f"'axes: {{{axis}: {{input_axis: ...}}}}'"
            )
            findings.append(Finding("input_axis_of_another", message))
        if "rate" in columns and not self.own_rate and facts.axis != axis and np.any(columns["rate"] != 0.0):
            if facts.axis is None:
                raise InputError(
                    f"{run.name}: the table turns (column 'rate'), and nothing tells about which axis; write "
                    "'axis: z' into the side file, or name the columns rate_x, rate_y, rate_z"
                )
            del columns["rate"]
            message = (
                f"the table turns about {facts.axis}: no rate about {axis}, so that what leaks in by "
                "misalignment counts as drift"
            )
            findings.append(Finding("rate_of_another_axis", message, column="rate"))
        of_axis = facts.model_copy(update=update)
        return Run.derived(run.name, columns, of_axis, run.gyro_unit, (*run.findings, *findings))
