"""Every format and every habit of headers: what each file gives, against what was written into it."""

from __future__ import annotations

import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from experiments.real_files.section import Section, table
from fogml.errors import InputError
from fogml.readers import READERS
from fogml.runs.columns import conversion, parse_header
from fogml.runs.opening import file_format
from fogml.runs.reading import read_run, read_table
from tests.readers import files
from tests.runs import test_excel_habits as excel
from tests.runs.test_headers import FILES, GYRO, TIME

WRITERS: dict[str, tuple[str, Callable[[Path], Any]]] = {
    "npz": ("log.npz", files.npz),
    "workbook": ("log.xlsx", files.xlsx),
    "struct": ("log.mat", files.mat_struct),
    "parquet": ("log.parquet", files.parquet),
    "hdf5": ("log.h5", files.hdf5),
    "tdms": ("log.tdms", files.tdms),
    "mdf": ("log.mf4", files.mdf),
    "miniseed": ("log.mseed", files.miniseed),
    "ulog": ("log.ulg", files.ulog),
    "dataflash": ("log.bin", files.dataflash),
    "rosbag": ("log.bag", files.rosbag),
    "rosbag 2": ("log.db3", lambda path: files.rosbag(path, ros1=False)),
    "mcap": ("log.mcap", files.mcap),
}
"""Format to the name of its file and what writes it."""


def section(quick: bool) -> Section:
    """Read each file and compare."""
    rows, data = [], {}
    with tempfile.TemporaryDirectory() as folder:
        for kind, (name, write) in WRITERS.items():
            path = Path(folder) / name
            path = write(path) or path
            began = time.process_time()
            held = read_table(path)
            error = max(_errors(held.columns, kind))
            columns = ", ".join(held.cells)
            data[kind] = {"columns": list(held.cells), "rows": len(held), "relative_error": error}
            label = next(reader.label for reader in READERS if reader.name == file_format(path))
            rows.append(
                [label, name, len(held), columns, f"{error:.1g}", f"{time.process_time() - began:.2f}"]
            )
        habits, said = [], {}
        for habit, text in FILES.items():
            path = Path(folder) / "habit.csv"
            path.write_bytes(text.encode())
            said[habit] = _outcome(path)
            habits.append([habit, text.splitlines()[0][:40].replace("\0", ""), said[habit]])
        tables, answers = [], {}
        for name, content in (excel.READ | {"book.xlsx": ""} | excel.ANSWERS).items():
            path = Path(folder) / name
            if name == "book.xlsx":
                excel.write_book(path)
            else:
                excel.write(path, content)
            answers[name] = _answer(path)
            first = path.read_bytes().splitlines()[:1] if name != "book.xlsx" else []
            shown = b"".join(first).decode("gbk" if name == "gbk.csv" else "utf-8").replace("\t", " ⇥ ")
            tables.append([name, shown, answers[name].removeprefix(f"{name}: ").removeprefix(f"{name}, ")])
    markdown = "\n\n".join(
        [
            "## Formats and headers",
            f"Files of {files.COUNT} samples, written by the library behind each reader (ULog and DataFlash "
            "byte by byte after their documents), read as they are; the error is that of gyro and clock"
            " against what was written, relative to the largest value. Time is this process's own.",
            table(["format", "file", "rows", "columns", "error", "CPU [s]"], rows),
            "Text files of 30 samples with one habit each:",
            table(["habit", "first line", "outcome"], habits),
            f"Tables of {excel.COUNT} samples as spreadsheet programs leave them, read as `inspect` and "
            "`train` do; a model over temperature asks for the temperature too:",
            table(["file", "first line", "outcome"], tables),
        ]
    )
    return Section(markdown, {"formats": data, "habits": said, "spreadsheets": answers})


def _errors(columns: Any, kind: str) -> list[float]:
    """Largest relative error of the clock and of each gyro."""
    right = {"gyro": files.GYRO, **{f"gyro_{axis}": values for axis, values in files.AXES.items()}}
    found = []
    for cell, values in columns.items():
        name, unit = parse_header(cell)
        if name == "time":
            seconds = values * conversion(name, unit, kind)[0]
            found.append(float(np.max(np.abs(seconds - files.TIME)) / files.TIME[-1]))
        elif name in right:
            wanted = np.round(1000.0 * right[name]) if unit == "count" else right[name]
            found.append(float(np.max(np.abs(values - wanted)) / np.max(np.abs(wanted))))
    return found


def _answer(path: Path) -> str:
    """How a spreadsheet's table is taken, its temperature asked for as a model does."""
    try:
        run = read_run(path)
        warmth = run.temperature("T")
    except InputError as error:
        return str(error)
    gyro = excel.GYRO + (1000.0 if path.name == "thousands.csv" else 0.0)
    pairs = (run.time, excel.TIME), (run.gyro, gyro), (warmth, excel.INNER)
    return "read" if all(np.allclose(found, right, atol=1e-4) for found, right in pairs) else "WRONG"


def _outcome(path: Path) -> str:
    try:
        run = read_run(path)
    except InputError as error:
        return str(error)
    same = np.allclose(run.time, TIME, atol=1e-9) and np.array_equal(run.gyro, GYRO)
    return "as the plain file" if same else "WRONG"
