"""The recordings that ship with fogml: real, public, and none of them of a fibre-optic gyro.

Each is stored as its source columns in the source's own units and digits, and passes through
the same import profile as the original file would.
"""

from __future__ import annotations

import json
from functools import cache
from pathlib import Path

import numpy as np

from fogml.arrow_arrays import values_of
from fogml.errors import InputError, did_you_mean
from fogml.runs.findings import Finding
from fogml.runs.logger_text import LoggerTable
from fogml.runs.profile_schema import ImportProfile, load_profile
from fogml.runs.profiles import run_names, runs_from_table
from fogml.runs.run import Run

RECORDING_FOLDER = Path(__file__).parent / "recordings"
METADATA_KEY = b"fogml.recording"
ROW_COLUMN = "row"

PROFILES = {
    "thermal-cycle": "thermal-cycle-mems",
    "cold-start": "cold-start-mpu6050",
    "two-temperatures-cold": "two-temperatures-bmi270",
    "two-temperatures-hot": "two-temperatures-bmi270",
    "ring-laser": "ring-laser-static",
}
"""Shipped recording to the import profile that it passes through."""


def shipped_names() -> tuple[str, ...]:
    """Names of the shipped runs, ``RECORDING[-LEG]-AXIS``."""
    return tuple(_index())


def shipped_run(name: str) -> Run:
    """A shipped run by its name, e.g. ``thermal-cycle-2-x``.

    Its notes say what kind of unit it is and where it comes from.

    Raises
    ------
    InputError
        If no run of that name ships.
    """
    if name not in _index():
        hint = did_you_mean(name, shipped_names(), most=3)
        raise InputError(f"'{name}': no such recording ships; {hint}there are {', '.join(shipped_names())}")
    return _runs(_index()[name])[name]


@cache
def _profile(recording: str) -> ImportProfile:
    return load_profile(PROFILES[recording])


@cache
def _index() -> dict[str, str]:
    """Run name to the recording that holds it."""
    return {name: recording for recording in PROFILES for name in run_names(_profile(recording), recording)}


@cache
def _runs(recording: str) -> dict[str, Run]:
    path = RECORDING_FOLDER / f"{recording}.parquet"
    profile = _profile(recording)
    runs = runs_from_table(_stored_table(path, profile), profile, recording, path.name)
    return {run.name: run for run in runs}


def _stored_table(path: Path, profile: ImportProfile) -> LoggerTable:
    from pyarrow.parquet import ParquetFile

    with ParquetFile(path) as file:
        stored = file.read()
    stated = json.loads(stored.schema.metadata[METADATA_KEY])
    columns = {source: values_of(stored[str(source)]).astype(np.float64) for source in profile.sources}
    rows = values_of(stored[ROW_COLUMN]).astype(np.intp)
    findings = tuple(Finding(**finding) for finding in stated["findings"])
    return LoggerTable(columns, rows, stated["total_rows"], findings)
