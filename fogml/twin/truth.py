"""What a simulated run really was: every node, what moved it, and what each effect made of it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from fogml.arrays import FloatArray
from fogml.errors import InputError
from fogml.runs.column_files import parquet_blocks
from fogml.runs.columns import header, parse_header

_PART = "contribution of "
_DRIVE_UNITS = {"heading": "deg", "shaking": "1", "dose": "Gy"}


TIME_ON = "time_on [s]"
"""Header cell of the time since the latest power-on."""


def written_time_on(values: FloatArray) -> FloatArray:
    """Time since power-on as a file has it: no value where the unit was on long before."""
    return np.where(np.isinf(values), np.nan, values)


def read_time_on(values: FloatArray) -> FloatArray:
    """Time since power-on of a file: infinite where it has no value."""
    return np.where(np.isnan(values), np.inf, values)


@dataclass(frozen=True, eq=False)
class Truth:
    """The truth of a simulation at each recorded sample; all columns of shape (n,).

    Attributes
    ----------
    time
        Time [s].
    nodes
        Temperature of every node of the plant [degC].
    table_rate
        Table rate about the input axis [deg/s].
    drives
        What else acts on the unit, by the run format's names and in its units.
    time_on
        Time since the latest power-on [s]; infinite where that was long before.
    noise_free
        The output without noise, as logged [deg/h].
    noise
        The noise before the logger [deg/h].
    contributions
        What each effect makes of the output [deg/h], and ``nominal`` for the nominal gyro. Those of
        ``nominal`` and of the effects from rig to read-out add to the output before the logger, and with
        those of the logger, each what it changes in what it meets, to `noise_free`. A random effect's
        is its part of `noise`, the rest of which are the twin's own noise terms. Two kinds stand
        beside the sums: a thermal effect's is the difference that it makes by way of the nodes, which
        the others hold already, and a sensor effect's is what a replay lacks that trusts the
        sensors. Empty unless asked for.
    """

    time: FloatArray
    nodes: Mapping[str, FloatArray]
    table_rate: FloatArray
    drives: Mapping[str, FloatArray]
    time_on: FloatArray
    noise_free: FloatArray
    noise: FloatArray
    contributions: Mapping[str, FloatArray] = field(default_factory=dict)

    def __len__(self) -> int:
        return len(self.time)

    def columns(self) -> dict[str, FloatArray]:
        """Header cell to values, as in a truth file."""
        on = written_time_on(self.time_on)
        columns = {"time [s]": self.time, "rate [deg/s]": self.table_rate, TIME_ON: on}
        columns |= {f"{name} [degC]": values for name, values in self.nodes.items()}
        columns |= {header(name, _DRIVE_UNITS.get(name)): values for name, values in self.drives.items()}
        columns |= {"noise_free [deg/h]": self.noise_free, "noise [deg/h]": self.noise}
        return columns | {f"{_PART}{id} [deg/h]": values for id, values in self.contributions.items()}

    def check_fits(self, time: FloatArray, name: str) -> None:
        """Check that this is the truth of a recording with these times."""
        if len(time) != len(self.time) or not np.allclose(time, self.time, rtol=0.0, atol=1e-6):
            raise InputError(
                f"{name}: its {len(time)} times are not those of the truth, which has {len(self.time)}; "
                "give the truth that was written together with this run"
            )


def truth_from_columns(columns: Mapping[str, FloatArray], source: str = "truth") -> Truth:
    """The truth from the columns of its file."""
    named = {parse_header(cell)[0]: np.asarray(values) for cell, values in columns.items()}
    for name in ("time", "rate", "time_on", "noise_free", "noise"):
        if name not in named:
            raise InputError(
                f"{source}: no column '{name}'; a file that `fogml simulate --truth` wrote is needed"
            )
    for name, values in named.items():
        if not np.issubdtype(values.dtype, np.number):
            raise InputError(f"{source}: column '{name}' holds no numbers")
        named[name] = values.astype(np.float64, copy=False)
    parts = {name.removeprefix(_PART): named.pop(name) for name in list(named) if name.startswith(_PART)}
    time, rate, on = (named.pop(name) for name in ("time", "rate", "time_on"))
    on = read_time_on(on)
    free, noise = named.pop("noise_free"), named.pop("noise")
    nodes = {name: values for name, values in named.items() if name.startswith("T_")}
    drives = {name: values for name, values in named.items() if name not in nodes}
    return Truth(time, nodes, rate, drives, on, free, noise, parts)


def read_truth(path: str | Path) -> Truth:
    """The truth in a Parquet or CSV file."""
    path = Path(path)
    if path.suffix.lower() == ".parquet":
        return truth_from_columns(next(parquet_blocks(path, None)).columns, path.name)
    import pyarrow as arrow
    from pyarrow import csv

    try:
        # "nan" is a number: a column of nothing else stays one of numbers.
        table = csv.read_csv(path, convert_options=csv.ConvertOptions(null_values=[""]))
        # Cells that are all empty, as a spreadsheet leaves those of no number, are no text.
        fields = [
            arrow.field(f.name, arrow.float64() if arrow.types.is_null(f.type) else f.type)
            for f in table.schema
        ]
        table = table.cast(arrow.schema(fields))
        columns = dict(zip(table.column_names, (column.to_numpy() for column in table.columns)))
    except (OSError, arrow.ArrowException) as error:
        raise InputError(f"{path}: no truth can be read from it ({str(error).splitlines()[0]})") from None
    if len(columns) < table.num_columns:
        raise InputError(f"{path}: two of its columns have one name; remove one of them")
    return truth_from_columns(columns, path.name)
