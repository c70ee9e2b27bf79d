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

from fogml.errors import InputError, quoted
from fogml.runs.columns import parse_header
from fogml.runs.facts import Facts
from fogml.runs.header_spelling import canonical_cells
from fogml.runs.raw_table import (
    FACTS_KEY,
    RawTable,
    choose_vectors,
    embedded_facts,
    stored_blocks,
)
from fogml.runs.reader_process import StoredArray, stored_file
from fogml.runs.reading_limits import DEFAULT_LIMITS, ReadingLimits
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
            "HDF5 and MATLAB 7.3 files need the package h5py: pip install -e '.[hdf5]' in fogml's source"
        ) from None
    return h5py


def hdf5_blocks(
    path: Path,
    rows: int | None,
    columns: Collection[str] | None = None,
    limits: ReadingLimits = DEFAULT_LIMITS,
) -> Iterator[RawTable]:
    """The table of an HDF5 file in blocks of `rows` rows; all at once for None.

    Only time, gyro and `columns` are read where these are given.
    """
    h5py_module()
    with stored_file(path, "hdf5", (FACTS_KEY, *Facts.model_fields), limits) as stored:
        if not stored.arrays:
            raise InputError(f"{path.name}: holds no datasets; one per column was expected, e.g. 'time [s]'")
        vectors, findings = choose_vectors(
            path.name,
            list(zip(canonical_cells([_cell(a) for a in stored.arrays]), stored.arrays, strict=True)),
        )
        facts = embedded_facts(stored.told["facts"], f"{path.name}, facts in the attributes")
        yield from stored_blocks(stored, vectors, findings, facts, rows, columns)


def _cell(array: StoredArray) -> str:
    return array.name if array.unit is None else f"{parse_header(array.name)[0]} [{array.unit}]"


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
                    f"{path.name}: column {quoted(label)} can't be named so in an HDF5 file; rename it, "
                    "or write CSV or Parquet"
                )
            dataset = file.create_dataset(
                label, data=run.columns[name], compression="gzip", shuffle=True, fletcher32=True
            )
            if unit is not None:
                dataset.attrs["unit"] = unit
        file.attrs[FACTS_KEY] = json.dumps(run.facts.as_dict(), ensure_ascii=False)
