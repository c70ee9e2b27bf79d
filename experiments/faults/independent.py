"""Runs read by other libraries, written from the run format alone: what fogml read has to be the same.

Where a file leaves room for doubt (no plain header, a cell that `float` refuses), nothing is compared.
"""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from experiments.faults.sandbox import SilentChange

Columns = dict[str, NDArray[np.float64]]
_DEGREES = 180.0 / math.pi
_UNITS: dict[str, dict[str, tuple[float, float]]] = {
    "time": {"s": (1, 0), "ms": (1e-3, 0), "us": (1e-6, 0), "ns": (1e-9, 0), "min": (60, 0), "h": (3600, 0)},
    "gyro": {"deg/h": (1, 0), "deg/s": (3600, 0), "rad/s": (3600 * _DEGREES, 0), "count": (1, 0)},
    "rate": {"deg/s": (1, 0), "deg/h": (1 / 3600, 0), "rad/s": (_DEGREES, 0)},
    "T": {"degC": (1, 0), "K": (1, -273.15)},
    "T_in": {"degC": (1, 0), "K": (1, -273.15)},
    "T_out": {"degC": (1, 0), "K": (1, -273.15)},
}
_TOLERANCE = 1e-12
"""Relative difference by which two orders of the same conversions may differ."""


def compare(runs: Mapping[Path, Any]) -> bool:
    """Whether every run could be compared with an independent reading.

    Raises
    ------
    SilentChange
        If a value differs, or a row or a column is missing, and no finding says so.
    """
    compared = False
    for path, run in runs.items():
        columns = _read(path)
        if columns is None:
            continue
        compared = True
        _compare(path.name, columns, run)
    return compared


def _read(path: Path) -> Columns | None:
    try:
        if path.suffix == ".csv":
            cells = _csv(path)
        elif path.suffix == ".parquet":
            cells = _parquet(path)
        elif path.suffix == ".h5":
            cells = _hdf5(path)
        else:
            cells = _mat(path) if path.suffix == ".mat" else None
    except Exception:
        return None
    return None if cells is None else _internal(cells)


def _internal(cells: Mapping[str, NDArray[np.float64]]) -> Columns | None:
    columns: Columns = {}
    for cell, values in cells.items():
        name, _, rest = cell.partition(" [")
        units = _UNITS.get(name)
        if units is None:
            continue
        if not rest.endswith("]") or rest[:-1] not in units or name in columns:
            return None
        factor, offset = units[rest[:-1]]
        columns[name] = values * factor + offset
    return columns if {"time", "gyro"} <= columns.keys() else None


def _csv(path: Path) -> dict[str, NDArray[np.float64]] | None:
    held = path.read_bytes()
    if held.startswith((b"\xff\xfe", b"\xfe\xff")):
        text = held.decode("utf-16")
    else:
        try:
            text = held.decode("utf-8-sig")
        except UnicodeDecodeError:
            text = held.decode("latin-1")
    first = next(line for line in text.splitlines() if line.strip())
    separator = max(",;\t", key=first.count)
    records = [
        row
        for row in csv.reader(io.StringIO(text, newline=""), delimiter=separator)
        if any(c.strip() for c in row)
    ]
    head = [cell.strip() for cell in records[0]]
    if len(set(head)) < len(head):
        return None
    comma = separator != "," and any("," in cell for row in records[1:] for cell in row)
    columns: dict[str, list[float]] = {cell: [] for cell in head}
    for row in records[1:]:
        if len(row) < len(head):
            return None
        for cell, value in zip(head, row, strict=False):
            known = cell.partition(" [")[0] in _UNITS
            columns[cell].append(float(value.replace(",", ".") if comma else value) if known else math.nan)
    return {cell: np.array(values) for cell, values in columns.items()}


def _parquet(path: Path) -> dict[str, NDArray[np.float64]]:
    import pandas

    frame = pandas.read_parquet(path)
    return {
        name: frame[name].to_numpy(np.float64) for name in frame.columns if name.partition(" [")[0] in _UNITS
    }


def _hdf5(path: Path) -> dict[str, NDArray[np.float64]]:
    import h5py

    found: dict[str, NDArray[np.float64]] = {}

    def note(name: str, item: Any) -> None:
        if isinstance(item, h5py.Dataset):
            unit = item.attrs.get("unit")
            cell = name if unit is None else f"{name} [{unit}]"
            found[cell] = np.asarray(item[()], dtype=np.float64).reshape(-1)

    with h5py.File(path, "r") as file:
        file.visititems(note)
    return found


def _mat(path: Path) -> dict[str, NDArray[np.float64]]:
    from scipy.io import loadmat

    held = loadmat(path, simplify_cells=True)
    held = held["run"] if isinstance(held.get("run"), dict) else held
    units = held["units"]
    return {
        f"{name} [{units[name]}]": np.asarray(held[name], dtype=np.float64).reshape(-1)
        for name in _UNITS
        if name in held
    }


def _compare(file: str, columns: Columns, run: Any) -> None:
    said = {finding.column for finding in run.findings} | {
        name for name in columns for finding in run.findings if f"'{name}'" in finding.message
    }
    count = len(columns["time"])
    told = [finding for finding in run.findings if finding.count or finding.code.startswith("repaired")]
    if len(run) != count or any(finding.code.startswith("repaired") for finding in run.findings):
        if not told:
            raise SilentChange(f"{file}: {count} rows in the file, {len(run)} read, and nothing said")
        held = set(zip(columns["time"].tolist(), columns["gyro"].tolist(), strict=True))
        if (
            "time" not in said
            and "gyro" not in said
            and len(held & set(zip(run.time.tolist(), run.gyro.tolist(), strict=True))) < len(run) / 2
        ):
            raise SilentChange(f"{file}: rows were read that the file does not hold")
        return
    for name, values in columns.items():
        if name in said:
            continue
        if name not in run.columns:
            raise SilentChange(f"{file}: column '{name}' is not there, and nothing said")
        read = run.columns[name]
        differs = ~(np.isclose(read, values, rtol=_TOLERANCE, atol=0.0) | (np.isnan(read) & np.isnan(values)))
        if name == "time":
            differs &= ~np.isclose(read - read[0], values - values[0], rtol=1e-9, atol=1e-9)
        if differs.any():
            row = int(np.argmax(differs))
            raise SilentChange(
                f"{file}: column '{name}', row {row + 1}: {values[row]!r} in the file, {read[row]!r} read"
            )
