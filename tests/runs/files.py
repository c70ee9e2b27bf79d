"""Run files made by other libraries than fogml, to read them with fogml."""

from __future__ import annotations

import csv
import io
from collections.abc import Mapping
from pathlib import Path

import h5py
import numpy as np
import pyarrow as arrow
import pyarrow.parquet as parquet
from hypothesis import strategies as st
from scipy.io import savemat

from fogml.runs.columns import KNOWN, parse_header
from fogml.runs.run import Run

SUFFIXES = (".csv", ".parquet", ".h5", ".mat")
finite = st.floats(-1e19, 1e19)


def write_table(path: Path, columns: Mapping[str, np.ndarray]) -> Path:
    """Header cells and values as a file of the format that the suffix names."""
    columns = {cell: np.asarray(values) for cell, values in columns.items()}
    if path.suffix == ".csv":
        path.write_text(csv_of(columns), encoding="utf-8")
    elif path.suffix == ".parquet":
        parquet.write_table(arrow.table(columns), path)
    elif path.suffix == ".h5":
        with h5py.File(path, "w") as file:
            for cell, values in columns.items():
                name, unit = parse_header(cell)
                dataset = file.create_dataset(name, data=values)
                if unit is not None:
                    dataset.attrs["unit"] = unit
    else:
        labels = {cell: parse_header(cell) for cell in columns}
        units = {name: unit for name, unit in labels.values() if unit is not None}
        vectors = {labels[cell][0]: values[:, None] for cell, values in columns.items()}
        savemat(path, {**vectors, "units": units}, long_field_names=True)
    return path


def csv_of(
    columns: Mapping[str, np.ndarray],
    separator: str = ",",
    decimal: str = ".",
    line_end: str = "\n",
    quoted: bool = False,
) -> str:
    """The text of a CSV file, with every digit of the values."""
    text = io.StringIO()
    quoting = csv.QUOTE_ALL if quoted else csv.QUOTE_MINIMAL
    csv.writer(text, delimiter=separator, lineterminator=line_end, quoting=quoting).writerow(columns)
    plain = csv.writer(text, delimiter=separator, lineterminator=line_end)
    for row in zip(*columns.values(), strict=True):
        plain.writerow([repr(float(value)).replace(".", decimal) for value in row])
    return text.getvalue()


def samples(rows: int = 200, step: float = 0.5, seed: int = 0) -> dict[str, np.ndarray]:
    """A sound run: white noise on a drift that follows a moving temperature."""
    rng = np.random.default_rng(seed)
    time = step * np.arange(rows)
    temperature = 20.0 + 10.0 * np.sin(2.0 * np.pi * np.arange(rows) / rows)
    return {
        "time [s]": time,
        "gyro [deg/h]": 5.0 + 0.1 * temperature + rng.normal(0.0, 0.05, rows),
        "T_in [degC]": temperature,
        "T_out [degC]": temperature + 0.3,
    }


@st.composite
def tables(draw) -> dict[str, np.ndarray]:
    """Header cells of the run format in internal units, and any finite values; time increases."""
    names = draw(st.sets(st.sampled_from([*sorted(set(KNOWN) - {"time", "gyro"}), "T1", "T2", "T17"])))
    rows = draw(st.integers(2, 12))
    ticks = st.integers(-(10**9), 10**9)
    time = [
        1.1e-3 * tick for tick in draw(st.lists(ticks, min_size=rows, max_size=rows, unique=True).map(sorted))
    ]
    cells = [f"{name} [{KNOWN[name].internal if name in KNOWN else 'degC'}]" for name in sorted(names)]
    columns = {"time [s]": time, "gyro [deg/h]": draw(st.lists(finite, min_size=rows, max_size=rows))}
    columns |= {cell: draw(st.lists(finite, min_size=rows, max_size=rows)) for cell in cells}
    return {cell: np.array(column) for cell, column in columns.items()}


def same(run: Run, columns: Mapping[str, np.ndarray]) -> bool:
    """Whether a run holds these columns, given in internal units, to the last digit."""
    read = {cell.split(" [")[0]: values for cell, values in columns.items()}
    # HDF5 knows columns by name only, without order.
    return set(run.columns) == set(read) and all(
        np.array_equal(run.columns[name], values) for name, values in read.items()
    )
