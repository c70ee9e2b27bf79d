"""MATLAB files, versions 5 to 7.3: one vector per column, at the top or in a struct ``run``.

A vector is named as the column (``time``, ``gyro``, ``T_in``); its unit stands under the same name in a
struct ``units``. Set-up facts stand as JSON text in ``facts``. In MATLAB::

    time = (0:35999)'; gyro = ...; T_in = ...;
    units.time = 's'; units.gyro = 'deg/h'; units.T_in = 'degC';
    facts = jsonencode(struct('unit', 'FOG-0417', 'axis', 'x'));
    save('run.mat', 'time', 'gyro', 'T_in', 'units', 'facts')
"""

from __future__ import annotations

import json
import re
import warnings
from pathlib import Path
from typing import Any, Literal

import numpy as np

from fogml.errors import InputError
from fogml.runs.columns import parse_header
from fogml.runs.facts import facts_from
from fogml.runs.hdf5_files import h5py_module
from fogml.runs.raw_table import RawTable, choose_vectors, facts_from_json, first_line
from fogml.runs.run import Run

_HDF5_MAGIC = b"\x89HDF\r\n\x1a\n"
_USER_BLOCK = 512
_LARGEST_V5_BYTES = 1 << 31
_RESERVED = ("units", "facts")
_VARIABLE = re.compile(r"[A-Za-z][A-Za-z0-9_]{0,62}\Z")


def read_mat(path: Path) -> RawTable:
    """The table of a MATLAB file.

    Raises
    ------
    InputError
        If the file is damaged, or holds no numeric vectors of one length.
    """
    with path.open("rb") as file:
        head = file.read(_USER_BLOCK + len(_HDF5_MAGIC))
    is_hdf5 = head.startswith(_HDF5_MAGIC) or head[_USER_BLOCK:].startswith(_HDF5_MAGIC)
    try:
        with warnings.catch_warnings():
            # SciPy warns of variables that it can't read; those it leaves out are missed below.
            warnings.simplefilter("ignore")
            variables = _hdf5_variables(path) if is_hdf5 else _v5_variables(path)
    except InputError:
        raise
    except Exception as error:  # scipy raises whatever the damage leads to
        raise InputError(
            f"{path.name}: damaged or no MATLAB file ({first_line(error)}); save it again"
        ) from None
    return _raw(path.name, variables)


def _v5_variables(path: Path) -> dict[str, Any]:
    from scipy.io import loadmat

    loaded = loadmat(path, simplify_cells=True, mat_dtype=False, chars_as_strings=True)
    return {name: value for name, value in loaded.items() if not name.startswith("__")}


def _hdf5_variables(path: Path) -> dict[str, Any]:
    h5py = h5py_module()

    def value_of(item: Any) -> Any:
        if isinstance(item, h5py.Group):
            return {name: value_of(member) for name, member in item.items() if not name.startswith("#")}
        values = np.asarray(item)
        if item.attrs.get("MATLAB_class", b"") in (b"char", "char"):
            return "".join(chr(int(code)) for code in values.T.reshape(-1))
        return values

    with h5py.File(path, "r") as file:
        return {name: value_of(item) for name, item in file.items() if not name.startswith("#")}


def _raw(file: str, variables: dict[str, Any]) -> RawTable:
    held = variables["run"] if isinstance(variables.get("run"), dict) else variables
    units = held.get("units", variables.get("units", {}))
    if not isinstance(units, dict):
        raise InputError(f"{file}: 'units' must be a struct of texts, e.g. units.time = 's'")
    arrays = []
    for name, value in held.items():
        if name in _RESERVED:
            continue
        unit = units.get(name)
        cell = name if unit is None else f"{parse_header(name)[0]} [{str(unit).strip()}]"
        arrays.append((cell, np.asarray(value)))
    if not arrays:
        raise InputError(f"{file}: holds no numeric vectors; time, gyro and others were expected")
    vectors, findings = choose_vectors(file, arrays)
    columns = {cell: values.reshape(-1).astype(np.float64) for cell, values in vectors}
    source = f"{file}, facts"
    stated = held.get("facts", variables.get("facts"))
    facts = facts_from_json(stated, source) if isinstance(stated, str) else facts_from(stated, source)
    cells = tuple(cell for cell, _ in vectors)
    return RawTable(file, cells, columns, None if stated is None else facts, findings=findings)


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
        if not _VARIABLE.match(label) or label in (*_RESERVED, "run"):
            raise InputError(
                f"{path.name}: column '{label}' can't be named so in a MATLAB file; rename it to letters, "
                "digits and underscores, or write CSV or Parquet"
            )
    if version is None:
        version = "7.3" if 8 * len(run) >= _LARGEST_V5_BYTES else "5"
    facts = json.dumps(run.facts.as_dict(), ensure_ascii=True)
    units = {label: unit for label, unit in labels.values() if unit is not None}
    if version == "5":
        from scipy.io import savemat

        vectors: dict[str, Any] = {label: run.columns[name][:, None] for name, (label, _) in labels.items()}
        savemat(path, {**vectors, "units": units, "facts": facts}, long_field_names=True, do_compression=True)
        return
    with h5py_module().File(path, "w", userblock_size=_USER_BLOCK, track_order=True) as file:
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
