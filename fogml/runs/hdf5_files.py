"""HDF5 files: one dataset per column, at the root or in a group ``run``.

A dataset is named ``name [unit]``, or ``name`` with an attribute ``unit``. Set-up facts stand as JSON
in the attribute ``fogml.facts`` of the same group.
"""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from fogml.errors import InputError
from fogml.runs.columns import parse_header
from fogml.runs.facts import facts_from
from fogml.runs.parquet_files import json_value
from fogml.runs.raw_table import FACTS_KEY, RawTable, numbered_row
from fogml.runs.run import Run


def h5py_module() -> Any:
    """The h5py package.

    Raises
    ------
    InputError
        If it is not installed.
    """
    try:
        import h5py
    except ImportError:
        raise InputError(
            "HDF5 and MATLAB 7.3 files need the package h5py; install it with pip install 'fogml[hdf5]'"
        ) from None
    return h5py


def read_hdf5(path: Path) -> RawTable:
    """The table of an HDF5 file.

    Raises
    ------
    InputError
        If the file is damaged or holds no columns of one length.
    """
    return next(hdf5_blocks(path, None))


def hdf5_blocks(path: Path, rows: int | None) -> Iterator[RawTable]:
    """The table of an HDF5 file in blocks of `rows` rows; all at once for None.

    Raises
    ------
    InputError
        As `read_hdf5`.
    """
    h5py = h5py_module()
    try:
        with h5py.File(path, "r") as file:
            group = file["run"] if "run" in file and isinstance(file["run"], h5py.Group) else file
            datasets = {
                _cell(name, item): item for name, item in group.items() if isinstance(item, h5py.Dataset)
            }
            count = _length(path.name, datasets)
            text = group.attrs.get(FACTS_KEY)
            facts = None
            if text is not None:
                facts = facts_from(json_value(text, path.name), f"{path.name}, facts in the attributes")
            step = rows or max(count, 1)
            for start in range(0, max(count, 1), step):
                columns = {
                    cell: np.asarray(item[start : start + step], dtype=np.float64).reshape(-1)
                    for cell, item in datasets.items()
                }
                yield RawTable(path.name, tuple(columns), columns, facts, _named_from(start))
    except (OSError, ValueError, TypeError, KeyError) as error:
        reason = str(error).splitlines()[0] if str(error) else type(error).__name__
        raise InputError(
            f"{path.name}: damaged, or no HDF5 file of numbers ({reason}); copy or export it again"
        ) from None


def _named_from(start: int) -> Any:
    return lambda i: numbered_row(start + i)


def _cell(name: str, dataset: Any) -> str:
    unit = dataset.attrs.get("unit")
    if unit is None:
        return str(name)
    unit = unit.decode() if isinstance(unit, bytes) else str(unit)
    return f"{parse_header(name)[0]} [{unit}]"


def _length(file: str, datasets: dict[str, Any]) -> int:
    if not datasets:
        raise InputError(f"{file}: holds no datasets; one per column was expected, e.g. 'time [s]'")
    sizes = {cell: int(item.size) for cell, item in datasets.items()}
    if len(set(sizes.values())) > 1:
        raise InputError(f"{file}: datasets differ in length: {sizes}; one value per sample was expected")
    return next(iter(sizes.values()))


def write_hdf5(run: Run, cells: dict[str, str], path: Path) -> None:
    """Write a run's columns under their header cells, and its facts, to a new HDF5 file."""
    with h5py_module().File(path, "w") as file:
        for name, cell in cells.items():
            label, unit = parse_header(cell)
            dataset = file.create_dataset(label, data=run.columns[name], compression="gzip", shuffle=True)
            if unit is not None:
                dataset.attrs["unit"] = unit
        file.attrs[FACTS_KEY] = json.dumps(run.facts.as_dict(), ensure_ascii=False)
