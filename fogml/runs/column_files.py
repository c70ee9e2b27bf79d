"""Parquet, HDF5 and MATLAB files: one dataset or vector per column, or in a group or struct ``run``.

In Parquet columns are named ``name [unit]``. Set-up facts stand in the schema's metadata: JSON under
``fogml.facts``, as `write_run` puts them, or one key per fact.

An HDF5 dataset is named ``name [unit]``, or ``name`` with an attribute ``unit``. Set-up facts are attributes
of the same group, as those of Parquet. With h5py::

    with h5py.File("run.h5", "w") as file:
        file["time [s]"], file["gyro [deg/h]"], file["T_in [degC]"] = time, gyro, temperature
        file.attrs["unit"], file.attrs["axis"], file.attrs["latitude"] = "FOG-0417", "x", 39.9

Of several groups the one that holds a time and a gyro is read; fields of a table are columns, and so are the
columns of a narrow matrix. HDF5 makes a group ``gyro [deg`` of that name with a dataset ``h]`` in it; it is
read as it was meant.

In MATLAB files, versions 5 to 7.3, a vector is named as the column (``time``, ``gyro``, ``T_in``); its unit
stands under the same name in a struct ``units``. Set-up facts stand as JSON text in ``facts``. In MATLAB::

    time = (0:35999)'; gyro = ...; T_in = ...;
    units.time = 's'; units.gyro = 'deg/h'; units.T_in = 'degC';
    facts = jsonencode(struct('unit', 'FOG-0417', 'axis', 'x'));
    save('run.mat', 'time', 'gyro', 'T_in', 'units', 'facts')
"""

from __future__ import annotations

import json
import re
from collections.abc import Collection, Iterator, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from fogml.errors import InputError, install_words, listed, quoted
from fogml.readers.matlab import RESERVED, USER_BLOCK
from fogml.runs.columns import column_spec, parse_header, stated_cell
from fogml.runs.container_files import Group, grouped, unknown_fields, unused_attributes
from fogml.runs.facts import Facts, facts_from
from fogml.runs.findings import Finding
from fogml.runs.header_spelling import canonical_cells
from fogml.runs.raw_table import (
    FACTS_KEY,
    RawTable,
    choose_vectors,
    embedded_facts,
    facts_from_json,
    moment,
    stored_blocks,
    text_column,
)
from fogml.runs.reader_process import StoredArray, StoredFile, stored_file
from fogml.runs.reading_limits import DEFAULT_LIMITS, ReadingLimits
from fogml.runs.run import Run


def _h5py_module() -> Any:
    """The h5py package, an extra."""
    try:
        import h5py
    except ImportError:
        raise InputError(
            f"HDF5 and MATLAB 7.3 files need the package h5py: {install_words('hdf5')}"
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
    _h5py_module()
    with stored_file(path, "hdf5", (FACTS_KEY, *Facts.model_fields), limits) as stored:
        if not stored.arrays:
            raise InputError(f"{path.name}: holds no datasets; one per column was expected, e.g. 'time [s]'")
        vectors, findings = _chosen(path, "hdf5", stored, {})
        findings = (*findings, *unused_attributes(stored))
        facts = embedded_facts(stored.told["facts"], f"{path.name}, facts in the attributes")
        yield from stored_blocks(stored, vectors, findings, facts, rows, columns)


def write_hdf5(run: Run, cells: dict[str, str], path: Path) -> None:
    """Write a run's columns under their header cells, and its facts, to a new HDF5 file.

    Raises
    ------
    InputError
        If a column's name can't be a dataset's.
    """
    # Headers of HDF5 1.8 and later carry checksums, as the chunks of samples do.
    with _h5py_module().File(path, "w", libver=("v108", "v108"), track_order=True) as file:
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


_LARGEST_V5_BYTES = 1 << 31
_VARIABLE = re.compile(r"[A-Za-z][A-Za-z0-9_]{0,62}\Z")


def mat_blocks(
    path: Path,
    rows: int | None,
    columns: Collection[str] | None = None,
    limits: ReadingLimits = DEFAULT_LIMITS,
) -> Iterator[RawTable]:
    """The table of a MATLAB file in blocks of `rows` rows; all at once for None.

    Only time, gyro and `columns` are read where these are given. The process that reads
    it holds a variable of version 5 whole while it is unpacked.
    """
    with stored_file(path, "mat", (), limits) as stored:
        units, stated = stored.told["units"], stored.told["facts"]
        if units is None:
            raise InputError(f"{path.name}: 'units' must be a struct of texts, e.g. units.time = 's'")
        if not stored.arrays:
            raise InputError(f"{path.name}: holds no numeric vectors; time, gyro and others were expected")
        vectors, findings = _chosen(path, "mat", stored, units)
        source = f"{path.name}, facts"
        facts = facts_from_json(stated, source) if isinstance(stated, str) else facts_from(stated, source)
        yield from stored_blocks(stored, vectors, findings, None if stated is None else facts, rows, columns)


def _chosen(
    path: Path, kind: str, stored: StoredFile, units: Mapping[str, str]
) -> tuple[list[tuple[str, StoredArray]], tuple[Finding, ...]]:
    """Vectors of the columns at the top, or of the only struct or group that holds a time and a gyro.

    What others hold of a run is said: whether their clocks go with that one nobody can tell.
    """
    groups = []
    for name, held in grouped(stored).items():
        cells = canonical_cells(
            [stated_cell(array.name, array.unit or units.get(array.name)) for array in held]
        )
        groups.append(Group(name, tuple(zip(cells, held))))
    runs = [group for group in groups if group.is_run]
    # What stands at the top comes before what else is kept.
    runs = [group for group in runs if not group.name] or runs
    if len(runs) > 1:
        names = listed([group.name for group in runs])
        raise InputError(
            f"{path.name}: {names} each hold a time and a gyro; save the one that is meant as its own file, "
            "or read it by an import profile"
        )
    if not runs and len(groups) > 1:
        raise unknown_fields(path, kind, groups)
    chosen = (runs or groups)[0]
    others = [(group.name, name) for group in groups for name in group.names if group is not chosen]
    unread = [f"{of}/{name}" if of else name for of, name in others if name != "time" and column_spec(name)]
    vectors, findings = choose_vectors(path.name, chosen.columns)
    if not unread:
        return vectors, findings
    told = f"not read, of other structs or groups: {listed(map(quoted, unread))}; a profile reads them"
    return vectors, (*findings, Finding("other_columns", told, count=len(unread)))


def take_out_date(path: Path) -> None:
    """Take the time of writing out of a new MATLAB file of version 5: the same content has the same bytes."""
    with path.open("r+b") as raw:
        raw.write(b"MATLAB 5.0 MAT-file, Platform: fogml, Created on: unknown".ljust(116))


def write_mat(
    run: Run, cells: dict[str, str], path: Path, version: Literal["5", "7.3"] | None = None
) -> None:
    """Write a run to a new MATLAB file: version 5, or 7.3 where asked or where 5 can't hold it.

    Raises
    ------
    InputError
        If a column's name can't be a variable's.
    """
    labels = {name: parse_header(cell) for name, cell in cells.items()}
    for label, _ in labels.values():
        if not _VARIABLE.match(label) or label in (*RESERVED, "run"):
            raise InputError(
                f"{path.name}: column {quoted(label)} can't be named so in a MATLAB file; rename it to "
                "letters, digits and underscores, or write CSV or Parquet"
            )
    if version is None:
        version = "7.3" if 8 * len(run) >= _LARGEST_V5_BYTES else "5"
    facts = json.dumps(run.facts.as_dict(), ensure_ascii=True)
    units = {label: unit for label, unit in labels.values() if unit is not None}
    if version == "5":
        from scipy.io import savemat

        vectors: dict[str, Any] = {label: run.columns[name][:, None] for name, (label, _) in labels.items()}
        savemat(path, {**vectors, "units": units, "facts": facts}, long_field_names=True, do_compression=True)
        take_out_date(path)
        return
    with _h5py_module().File(path, "w", userblock_size=USER_BLOCK, track_order=True) as file:
        for name, (label, _) in labels.items():
            dataset = file.create_dataset(label, data=run.columns[name][None, :], compression="gzip")
            dataset.attrs["MATLAB_class"] = np.bytes_("double")
        group = file.create_group("units")
        group.attrs["MATLAB_class"] = np.bytes_("struct")
        for label, unit in units.items():
            _write_text(group, label, unit)
        _write_text(file, "facts", facts)
    # MATLAB tells its own files by this block before the HDF5 part.
    text = b"MATLAB 7.3 MAT-file, Platform: fogml, Created on: unknown HDF5 schema 1.00 ."
    with path.open("r+b") as raw:
        raw.write(text.ljust(116) + b"\x00" * 8 + b"\x00\x02IM")


def _write_text(group: Any, name: str, text: str) -> None:
    codes = np.array([[ord(character)] for character in text], dtype=np.uint16)
    dataset = group.create_dataset(name, data=codes)
    dataset.attrs["MATLAB_class"] = np.bytes_("char")
    dataset.attrs["MATLAB_int_decode"] = np.int32(2)


def parquet_blocks(
    path: Path,
    rows: int | None,
    columns: Collection[str] | None = None,
    limits: ReadingLimits = DEFAULT_LIMITS,
) -> Iterator[RawTable]:
    """The table of a Parquet file in blocks of at most `rows` rows, in bounded memory; whole for None.

    Only time, gyro and `columns` are read where these are given.
    """
    with stored_file(path, "parquet", (FACTS_KEY, *Facts.model_fields), limits) as stored:
        vectors, findings = [], []
        for array in stored.arrays:
            name = parse_header(array.name)[0]
            if array.kind == "f":
                vectors.append((stated_cell(array.name, array.unit), array))
            elif column_spec(name) is not None:
                raise InputError(
                    f"{path.name}, column '{name}': holds {array.type_name}, numbers were expected; write it "
                    "with numbers or timestamps, a column for each axis"
                )
            else:
                findings.append(text_column(name))
        facts = embedded_facts(stored.told["facts"], f"{path.name}, facts in the metadata")
        cells = canonical_cells([cell for cell, _ in vectors])
        vectors = [(cell, array) for cell, (_, array) in zip(cells, vectors, strict=True)]
        clock = next((array for cell, array in vectors if parse_header(cell)[0] == "time"), None)
        started = None if clock is None else moment(stored.told["origins_s"][clock.index])
        for table in stored_blocks(stored, vectors, tuple(findings), facts, rows, columns):
            yield replace(table, started=started)


def parquet_rows(path: Path) -> int:
    """Number of rows of a Parquet file."""
    with stored_file(path, "parquet", (), DEFAULT_LIMITS) as stored:
        return max((max(array.shape) for array in stored.arrays), default=0)


def parquet_values(path: Path) -> int:
    """Number of values of a Parquet file, in all its columns."""
    with stored_file(path, "parquet", (), DEFAULT_LIMITS) as stored:
        return sum(max(array.shape) for array in stored.arrays)


def parquet_marks(path: Path, cell: str) -> NDArray[np.str_]:
    """The texts of a column of marks, shape (n,), by its header cell."""
    with stored_file(path, "parquet", (), DEFAULT_LIMITS) as stored:
        return stored.marks(_named(stored, cell))


def _named(stored: StoredFile, cell: str) -> StoredArray:
    found = [array for array in stored.arrays if array.name == cell]
    if not found:
        raise InputError(f"{stored.path.name}: column '{cell}' is missing; export it again")
    return found[0]


BLOCKS = {"parquet": parquet_blocks, "hdf5": hdf5_blocks, "mat": mat_blocks}
"""What reads each format, by its name."""
