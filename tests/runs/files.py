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
from scipy.io import savemat

from fogml.runs.columns import parse_header

SUFFIXES = (".csv", ".parquet", ".h5", ".mat")


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
