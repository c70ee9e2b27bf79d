"""Manifests: a list of units with the job and the runs of each, as CSV or YAML."""

from __future__ import annotations

import csv
import io
import re
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from fogml.errors import InputError, known_are, quoted
from fogml.folders import safe_name, with_slashes
from fogml.runs.csv_dialect import text_of
from fogml.yaml_text import read_yaml

MANIFEST_SCHEMA = "fogml.manifest/1"
_LONGEST_FOLDER = 100
"""Bytes of a unit's folder: names of files may have 255 bytes, and some stand beside it."""
COLUMNS = ("unit", "job", "train", "test", "axis")
COVARIATE = "covariate:"
"""What the names of columns begin with that state a number or a label of a unit's production."""
JOBS = ("train", "compare", "diagnose", "acceptance")
SHIPPED = "shipped:"
_COVARIATE_NAME = re.compile(COVARIATE + r"[A-Za-z0-9_ -]+")
_FILE = re.compile(r"\.(json|html|xlsx|yaml)$", re.IGNORECASE)
# How files end that stand beside the units' folders.


@dataclass(frozen=True)
class Unit:
    """One line of a manifest.

    Attributes
    ----------
    name
        Serial number.
    job
        ``train``, ``compare``, ``diagnose`` or ``acceptance``.
    train, test
        Paths of runs; for ``diagnose`` those fitted to, and those held out; for ``acceptance`` those that the
        unit's model is trained on, if it has one, and those that the report is of.
    axis
        Axis, or an empty text.
    folder
        Name of the unit's own folder, unlike every other's.
    fault
        What is wrong with the unit's runs: it fails with that, and the others go on.
    covariates
        What is known of its production, numbers or labels by name.
    """

    name: str
    job: str
    train: tuple[str, ...]
    test: tuple[str, ...]
    axis: str
    folder: str
    fault: str = ""
    covariates: Mapping[str, str] = field(default_factory=dict)

    @property
    def label(self) -> str:
        """Serial number and axis."""
        return f"{self.name} {self.axis}".strip()


def read_manifest(path: str | Path) -> list[Unit]:
    """The units of a manifest, in its order.

    A CSV file has the columns ``unit, job, train, test, axis``, lists of runs separated by ``;``, within
    quotation marks where that separates cells too. Lines that begin with ``#`` are comments. Columns
    such as ``covariate:coil_lot`` state what is known of a unit's production; empty cells are not known.
    A YAML file is a list of mappings with these keys, or has them under ``units``. Runs are looked
    for from here, then from where the manifest lies.

    Raises
    ------
    InputError
        Naming file, row and column of the first fault; a run that is not there is its unit's.
    """
    path = Path(path)
    if not path.is_file():
        what = "is a folder" if path.is_dir() else "no such file"
        raise InputError(f"{path}: {what}{with_slashes(path)}; a manifest was expected, CSV or YAML")
    rows = _yaml_rows(path) if path.suffix.lower() in (".yaml", ".yml") else _csv_rows(path)
    units = [_unit(row, place, path) for place, row in rows]
    if not units:
        raise InputError(f"{path.name}: holds no unit")
    return _with_folders(units, path)


def _csv_rows(path: Path) -> list[tuple[str, Mapping[str, Any]]]:
    """Rows as a spreadsheet program saves them, in any language: its encoding and what separates cells."""
    # Rows are told by the numbers that a spreadsheet program shows beside them.
    numbered = list(enumerate(io.StringIO(text_of(path), newline=""), start=1))
    numbers, lines = zip(*[(i, line) for i, line in numbered if line.strip() and line[0] != "#"] or [(1, "")])
    head = lines[0]
    separator = next((mark for mark in ",;\t" if mark in head), ",")
    try:
        reader = csv.DictReader(lines, delimiter=separator, skipinitialspace=True, strict=True)
        heads = [str(name).strip() for name in reader.fieldnames or ()]
        _check_keys(heads, f"{path.name}: header")
        reader.fieldnames = heads
        return [(f"row {numbers[reader.line_num - 1]}", row) for row in reader if any(row.values())]
    except csv.Error as error:
        raise InputError(
            f"{path.name}: not readable as CSV ({error}); is a quotation mark not closed?"
        ) from None


def _yaml_rows(path: Path) -> list[tuple[str, Mapping[str, Any]]]:
    values = read_yaml(path, COLUMNS, MANIFEST_SCHEMA)
    if isinstance(values, dict):
        values = values.get("units")
    if not isinstance(values, list) or not all(isinstance(row, dict) for row in values):
        raise InputError(f"{path.name}: a list of units was expected, each with {', '.join(COLUMNS)}")
    rows = []
    for number, row in enumerate(values, start=1):
        _check_keys([str(key) for key in row], f"{path.name}: unit {number}")
        rows.append((f"unit {number}", row))
    return rows


def _check_keys(keys: Iterable[str], place: str) -> None:
    keys = list(keys)
    for key in keys:
        if keys.count(key) > 1:
            raise InputError(
                f"{place}: column {quoted(key)} stands {keys.count(key)} times, once was expected; several "
                "runs go into one cell, with ';' between them"
            )
        if key not in COLUMNS and not (key.startswith(COVARIATE) and _COVARIATE_NAME.fullmatch(key)):
            raise InputError(
                f"{place}: unknown column {quoted(key)}; {known_are(key, COLUMNS)}, "
                f"and those of production such as {COVARIATE}coil_lot"
            )
    for key in ("unit", "train"):
        if key not in keys:
            raise InputError(f"{place}: column '{key}' is missing; columns are {', '.join(COLUMNS)}")


def _unit(row: Mapping[str, Any], place: str, path: Path) -> Unit:
    where = f"{path.name}: {place}"
    if None in row:
        raise InputError(f"{where}: has more cells than the header; separate runs by ';'")
    name, job, axis = (_text(row.get(key), f"{where}: column '{key}'") for key in ("unit", "job", "axis"))
    job = job or "train"
    if not name:
        raise InputError(f"{where}: column 'unit' is empty; a serial number was expected")
    if job not in JOBS:
        raise InputError(f"{where}: column 'job': {quoted(job)}; {', '.join(JOBS)} were expected")
    faults: list[str] = []
    train, test = (
        tuple(
            _found(run, f"{where}: column '{key}'", path.parent, faults)
            for run in _listed(row.get(key), f"{where}: column '{key}'")
        )
        for key in ("train", "test")
    )
    if not train and job != "acceptance":
        raise InputError(f"{where}: column 'train' names no run")
    if not test and job != "diagnose":
        raise InputError(f"{where}: column 'test' names no run; '{job}' judges on at least one")
    known = {
        key.removeprefix(COVARIATE): text
        for key in row
        if key.startswith(COVARIATE) and (text := _text(row[key], f"{where}: column '{key}'"))
    }
    return Unit(name, job, train, test, axis, "", "; ".join(faults), known)


def _text(value: Any, place: str) -> str:
    if isinstance(value, list | dict):
        raise InputError(f"{place}: {quoted(value)}; one name was expected")
    return "" if value is None else str(value).strip()


def _listed(value: Any, place: str) -> list[str]:
    items = value if isinstance(value, list) else _text(value, place).split(";")
    return [text for item in items if (text := _text(item, place))]


def _found(run: str, place: str, folder: Path, faults: list[str]) -> str:
    """The run's path in full; one that is not there is added to the faults."""
    if run.startswith(SHIPPED):
        from fogml.runs.shipped import shipped_names

        if run.removeprefix(SHIPPED) not in shipped_names():
            faults.append(f"{place}: {run}: no such recording ships")
        return run
    for home in (Path(), folder):
        if (home / run).is_file():
            return str((home / run).absolute())
    faults.append(f"{place}: {run}: no such file, here or beside the manifest{with_slashes(run, folder)}")
    return str((folder / run).absolute())


def _with_folders(units: list[Unit], path: Path) -> list[Unit]:
    from dataclasses import replace

    twice = Counter((unit.name, unit.axis, unit.job) for unit in units)
    for (name, axis, job), count in twice.items():
        if count > 1:
            raise InputError(
                f"{path.name}: unit {name}{' axis ' + axis if axis else ''} has the job {quoted(job)} "
                f"{count} times; once was expected"
            )
    jobs = len({unit.job for unit in units}) > 1
    parts = [[unit.name, unit.axis, unit.job if jobs else ""] for unit in units]
    folders = folder_names(["-".join(part for part in held if part) for held in parts])
    return [replace(unit, folder=folder) for unit, folder in zip(units, folders)]


def folder_names(units: Sequence[str]) -> list[str]:
    """A folder for each unit's name, none the same as another's on any system."""
    placed: list[str] = []
    taken: set[str] = set()
    for unit in units:
        wanted = _FILE.sub(r"_\1", safe_name(unit, "_", _LONGEST_FOLDER))
        folder, number = wanted, 1
        # Names that differ only in case are one folder on some systems.
        while folder.casefold() in taken:
            number += 1
            folder = f"{wanted}-{number}"
        taken.add(folder.casefold())
        placed.append(folder)
    return placed
