"""HDF5 files: one dataset per column, at the root or in a group ``run``.

A dataset is named ``name [unit]``, or ``name`` with an attribute ``unit``. Set-up facts are attributes of
the same group: JSON in ``fogml.facts``, as `write_run` puts them, or one attribute per fact. With h5py::

    with h5py.File("run.h5", "w") as file:
        file["time [s]"], file["gyro [deg/h]"], file["T_in [degC]"] = time, gyro, temperature
        file.attrs["unit"], file.attrs["axis"], file.attrs["latitude"] = "FOG-0417", "x", 39.9

HDF5 makes a group ``gyro [deg`` of that name with a dataset ``h]`` in it; it is read as it was meant.
"""

from __future__ import annotations

import json
from collections.abc import Collection, Iterator
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fogml.errors import InputError
from fogml.runs.columns import parse_header
from fogml.runs.raw_table import (
    FACTS_KEY,
    RawTable,
    axis_of_samples,
    choose_vectors,
    embedded_facts,
    first_line,
    named_from,
    wanted_cells,
)
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


def hdf5_blocks(path: Path, rows: int | None, columns: Collection[str] | None = None) -> Iterator[RawTable]:
    """The table of an HDF5 file in blocks of `rows` rows; all at once for None.

    Only time, gyro and `columns` are read where these are given.

    Raises
    ------
    InputError
        As `read_hdf5`.
    """
    h5py = h5py_module()
    try:
        with h5py.File(path, "r") as file:
            group = file["run"] if isinstance(file.get("run"), h5py.Group) else file
            found = [(_cell(name, item), item) for name, item in _datasets(group)]
            if not found:
                raise InputError(
                    f"{path.name}: holds no datasets; one per column was expected, e.g. 'time [s]'"
                )
            datasets, findings = choose_vectors(path.name, found)
            stated = {key: _plain(value) for key, value in group.attrs.items()}
            facts = embedded_facts(stated, f"{path.name}, facts in the attributes")
            wanted = wanted_cells((cell for cell, _ in datasets), columns)
            datasets = [(cell, item) for cell, item in datasets if cell in wanted]
            cells = tuple(cell for cell, _ in datasets)
            count = max((max(item.shape) for _, item in datasets), default=0)
            step = rows or max(count, 1)
            for start in range(0, max(count, 1), step):
                columns = {cell: _samples(item, start, start + step) for cell, item in datasets}
                yield RawTable(path.name, cells, columns, facts, named_from(start), findings)
    except InputError:
        raise
    except Exception as error:  # h5py raises whatever the damage leads to
        raise InputError(
            f"{path.name}: damaged, or no HDF5 file of numbers ({first_line(error)}); copy or export it again"
        ) from None


def _samples(dataset: Any, start: int, stop: int) -> NDArray[np.float64]:
    along = axis_of_samples(dataset.shape)
    part = tuple(slice(start, stop) if axis == along else 0 for axis in range(dataset.ndim))
    return np.asarray(dataset[part], dtype=np.float64)


def _datasets(group: Any, above: str = "") -> list[tuple[str, Any]]:
    """Datasets of a group by name, also where the unit holds a slash."""
    h5py = h5py_module()
    found: list[tuple[str, Any]] = []
    for name, item in group.items():
        full = above + name
        if isinstance(item, h5py.Dataset):
            found.append((full, item))
        elif isinstance(item, h5py.Group) and "[" in full:
            found += _datasets(item, full + "/")
    return found


def _plain(value: Any) -> Any:
    """An attribute of one value as Python's own type, None for an array."""
    if isinstance(value, str | bytes):
        return value
    return value.item() if getattr(value, "size", 0) == 1 else None


def _cell(name: str, dataset: Any) -> str:
    unit = dataset.attrs.get("unit")
    if unit is None:
        return str(name)
    unit = unit.decode("utf-8", errors="replace") if isinstance(unit, bytes) else str(unit)
    return f"{parse_header(name)[0]} [{unit}]"


def write_hdf5(run: Run, cells: dict[str, str], path: Path) -> None:
    """Write a run's columns under their header cells, and its facts, to a new HDF5 file.

    Raises
    ------
    InputError
        If a column's name can't be a dataset's.
    """
    # Headers of HDF5 1.8 and later carry checksums, as the chunks of samples do.
    with h5py_module().File(path, "w", libver=("v108", "v108"), track_order=True) as file:
        for name, cell in cells.items():
            label, unit = parse_header(cell)
            if "/" in label or "\0" in label or label in ("", ".", "run"):
                raise InputError(
                    f"{path.name}: column '{label}' can't be named so in an HDF5 file; rename it, "
                    "or write CSV or Parquet"
                )
            dataset = file.create_dataset(
                label, data=run.columns[name], compression="gzip", shuffle=True, fletcher32=True
            )
            if unit is not None:
                dataset.attrs["unit"] = unit
        file.attrs[FACTS_KEY] = json.dumps(run.facts.as_dict(), ensure_ascii=False)
