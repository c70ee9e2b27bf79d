"""A run as others ask for it: as a pandas frame, pickled, and shown in a notebook."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Self

import numpy as np

from fogml.errors import InputError
from fogml.numerals import short
from fogml.pictures import BEFORE, OTHERS, Panel, Pictured, in_time
from fogml.runs.columns import column_spec, conversion, header, is_temperature, parse_header
from fogml.runs.facts import Facts
from fogml.runs.header_spelling import canonical_cells
from fogml.runs.possible import as_vector

if TYPE_CHECKING:
    import pandas as pd

    from fogml.runs.run import Run


class Exchange(Pictured):
    """What a `Run` has besides its columns and facts for the tools around it."""

    name: str
    columns: Mapping[str, Any]
    facts: Facts
    gyro_unit: str

    @property
    def hash(self) -> str:
        """Tells what columns hold."""
        raise NotImplementedError

    def _check_set_up(self) -> None:
        """Hold that facts and the output's unit are such."""
        if self.gyro_unit not in ("deg/h", "count"):
            raise InputError(f"{self.name}: gyro_unit is '{self.gyro_unit}'; it may be deg/h or count")
        checked_facts(self.name, self.facts)

    @classmethod
    def from_pandas(cls, frame: pd.DataFrame, name: str = "run", facts: Facts | None = None) -> Self:
        """A run from a frame, a column each, looked at as a file's is (``findings``).

        What becomes of the frame later does not change it.

        Parameters
        ----------
        frame
            Columns called as in a run's file, ``gyro`` or ``gyro [deg/s]``; without a unit they are in the
            run format's. Where there is no column ``time`` the index is it, if it holds dates, durations or
            fractional numbers [s], or is called so, ``time [ms]`` say. Of dates the first is the fact
            ``started``, unless that is stated.
        name
            Name of the run.
        facts
            Set-up facts.

        Raises
        ------
        InputError
            If it is no frame or has no rows, a column is named twice, one of the run format is in a unit that
            it does not take or holds what is no number, or there are no times. Other columns that hold no
            numbers are left out, which ``findings`` tells.
        """
        import pandas as pd

        from fogml.runs.checks import check_run  # which takes runs
        from fogml.runs.raw_table import text_column

        if not isinstance(frame, pd.DataFrame):
            kind = f"{type(frame).__module__.partition('.')[0]}.{type(frame).__name__}"
            raise InputError(
                f"{name}: a pandas DataFrame is needed, found {kind}; tables of polars and Arrow have a "
                "method to_pandas"
            )
        if frame.empty:
            raise InputError(f"{name}: the frame has no rows; rows of numbers were expected")
        text = []
        cells = canonical_cells([str(cell) for cell in frame.columns])
        held = [(*parse_header(cell), frame.iloc[:, place]) for place, cell in enumerate(cells)]
        if "time" not in [column for column, _, _ in held]:
            held.insert(0, _times_of_index(frame.index, name))
        columns: dict[str, Any] = {}
        facts = checked_facts(name, facts or Facts())
        for column, unit, series in held:
            if column in columns:
                raise InputError(f"{name}: column '{column}' is there twice")
            # Of dates with a time zone pandas makes objects unless it is asked for dates.
            kind = np.dtype("M8[ns]") if series.dtype.kind == "M" else None
            try:
                values = as_vector(name, column, series.to_numpy(kind))
            except InputError:
                if column_spec(column) is not None:
                    raise
                text.append(text_column(column))
                continue
            factor, offset = (1.0, 0.0) if unit is None else conversion(column, unit, name)
            if (factor, offset) != (1.0, 0.0) and series.dtype.kind not in "mM":  # these tell their unit
                values = values * factor + offset
            if column == "time" and facts.started is None and series.dtype.kind == "M" and len(series):
                facts = facts.model_copy(update={"started": series[:1].to_list()[0].to_pydatetime()})
            columns[column] = values
        is_count = ("gyro", "count") in [(column, unit) for column, unit, _ in held]
        run: Any = cls(name, columns, facts, "count" if is_count else "deg/h")  # type: ignore[call-arg]
        noticed: Self = run.with_findings((*text, *check_run(run)))
        return noticed

    def to_pandas(self) -> pd.DataFrame:
        """The columns as a frame, in internal units that the names state: ``gyro [deg/h]``."""
        import pandas as pd

        units = {"gyro": self.gyro_unit}
        return pd.DataFrame({header(n, units.get(n)): np.array(x) for n, x in self.columns.items()})

    def __eq__(self, other: object) -> bool:
        """Whether another run has the same name, facts and columns, number for number."""
        if self is other or not isinstance(other, Exchange):
            return self is other
        same = self.name == other.name and self.facts == other.facts
        return same and self.hash == other.hash

    def __hash__(self) -> int:
        # Without what columns hold: reading all of a long run takes seconds.
        return hash((self.name, frozenset(self.columns)))

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


def _times_of_index(index: pd.Index[Any], name: str) -> tuple[str, str | None, Any]:
    """Column, unit and values of the times that an index holds; refused where it may count rows instead."""
    cell = "time" if index.name is None else canonical_cells([str(index.name)])[0]
    column, unit = parse_header(cell)
    if index.dtype.kind in "mM":
        return "time", unit if column == "time" else None, index
    if column != "time" or (index.name is None and index.dtype.kind != "f"):
        raise InputError(
            f"{name}: no column 'time', and the index is not called so: it may count rows; add the times in "
            "seconds as a column 'time', or call the index 'time [s]'"
        )
    return column, unit, index


def checked_facts(name: str, facts: object) -> Facts:
    """The facts of the run of a name, which have to be such."""
    if not isinstance(facts, Facts):
        kind = type(facts).__name__
        raise InputError(f"{name}: facts are {kind}; fogml.Facts(unit=..., axis=...) was expected")
    return facts


def runs_of(given: Run | Sequence[Run]) -> tuple[Run, ...]:
    """One run or several as a tuple.

    Raises
    ------
    InputError
        If something is no run, as a table or the name of a file.
    """
    found: Any = given
    one = isinstance(found, str | Path) or hasattr(found, "columns") or not isinstance(found, Iterable)
    group: tuple[Any, ...] = (found,) if one else tuple(found)
    for run in group:
        if not isinstance(run, Exchange):
            raise InputError(
                f"runs are needed, found {type(run).__name__}; fogml.read_run makes one of a file, "
                "fogml.Run.from_pandas of a table"
            )
    return group


def one_run(found: Any) -> Run:
    """What has to be a run.

    Raises
    ------
    InputError
        If it is several, or none.
    """
    if isinstance(found, list | tuple):
        raise InputError(f"one run is needed, found {type(found).__name__}; call it for each run")
    return runs_of(found)[0]
