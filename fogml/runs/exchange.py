"""A run as others ask for it: as a pandas frame, pickled, and shown in a notebook."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, Self

import numpy as np

from fogml.errors import InputError
from fogml.numerals import short
from fogml.pictures import BEFORE, OTHERS, Panel, Pictured, in_time
from fogml.runs.columns import conversion, header, is_temperature, parse_header
from fogml.runs.facts import Facts
from fogml.runs.possible import as_vector

if TYPE_CHECKING:
    import pandas as pd


class Exchange(Pictured):
    """What a `Run` has besides its columns and facts for the tools around it."""

    name: str
    columns: Mapping[str, Any]
    facts: Facts
    gyro_unit: str

    @classmethod
    def from_pandas(cls, frame: pd.DataFrame, name: str = "run", facts: Facts | None = None) -> Self:
        """A run from a frame, a column each.

        Parameters
        ----------
        frame
            Columns called as in a run's file, ``gyro`` or ``gyro [deg/s]``; without a unit they are in the
            run format's. An index of times, not one that counts rows, becomes ``time`` where there is no
            such column.
        name
            Name of the run.
        facts
            Set-up facts.

        Raises
        ------
        InputError
            If a column is named twice, or in a unit that the run format does not take, its values are no
            numbers, or there are no times.
        """
        columns: dict[str, Any] = {}
        unit_of_gyro = "deg/h"
        for position, cell in enumerate(map(str, frame.columns)):
            column, unit = parse_header(cell)
            values = frame.iloc[:, position].to_numpy()
            if column in columns:
                raise InputError(f"{name}: column '{column}' is there twice")
            factor, offset = (1.0, 0.0) if unit is None else conversion(column, unit, name)
            if (factor, offset) != (1.0, 0.0):
                values = as_vector(name, column, values) * factor + offset
            if column == "gyro" and unit == "count":
                unit_of_gyro = "count"
            columns[column] = values
        if "time" not in columns:
            if type(frame.index).__name__ == "RangeIndex":
                raise InputError(
                    f"{name}: no column 'time', and the index counts rows; add the times in seconds as a "
                    "column 'time' or as the index"
                )
            index = frame.index.to_numpy()
            seconds = index / np.timedelta64(1, "s") if index.dtype.kind == "m" else index
            columns = {"time": seconds, **columns}
        return cls(name, columns, facts or Facts(), unit_of_gyro)  # type: ignore[call-arg]

    def to_pandas(self) -> pd.DataFrame:
        """The columns as a frame, in internal units that the names state: ``gyro [deg/h]``."""
        import pandas as pd

        units = {"gyro": self.gyro_unit}
        return pd.DataFrame({header(n, units.get(n)): np.array(x) for n, x in self.columns.items()})

    def __getstate__(self) -> dict[str, Any]:
        """Columns and facts alone: what was worked out from them is worked out anew."""
        held = {"name", "facts", "gyro_unit", "findings", "_rule"}
        state = {key: value for key, value in self.__dict__.items() if key in held}
        return state | {"columns": {name: np.array(values) for name, values in self.columns.items()}}

    def __setstate__(self, state: dict[str, Any]) -> None:
        columns = state.pop("columns")
        self.__dict__.update(state)
        self._freeze(columns)

    def _freeze(self, columns: Mapping[str, Any]) -> None:
        raise NotImplementedError

    def _heading(self) -> Sequence[str]:
        time = self.columns["time"]
        span = (time[-1] - time[0]) / 3600.0 if len(time) else 0.0
        facts = " ".join(filter(None, (self.facts.unit, self.facts.axis and f"axis {self.facts.axis}")))
        return [self.name, f"{len(time)} samples, {short(span)} h; {', '.join(self.columns)}", facts]

    def _panels(self) -> Sequence[Panel]:
        time = self.columns["time"]
        if not len(time):
            return []
        warm = [name for name in self.columns if is_temperature(name)]
        gyro = in_time(time, self.columns["gyro"], "gyro", BEFORE)
        panels = [Panel([gyro], "time [h]", f"gyro [{self.gyro_unit}]")]
        if warm:
            colours = OTHERS * len(warm)
            curves = [in_time(time, self.columns[n], n, c) for n, c in zip(warm, colours, strict=False)]
            panels.append(Panel(curves, "time [h]", "temperature [°C]"))
        return panels
