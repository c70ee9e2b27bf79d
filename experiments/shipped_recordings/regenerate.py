"""Writes the recordings that ship with fogml from the upstream files.

    python experiments/shipped_recordings/regenerate.py FOLDER

FOLDER holds one folder per recording, as listed in SOURCES, each with its licence. The source
columns are stored in the source's units and digits: as the smallest integers that hold them,
else as float64 under a dictionary, so nothing is rounded.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as parquet

from fogml.outputs import whole_file
from fogml.runs.logger_text import LoggerTable, read_logger_text
from fogml.runs.profile_schema import load_profile
from fogml.runs.shipped import METADATA_KEY, PROFILES, RECORDING_FOLDER, ROW_COLUMN

SOURCES = {
    "thermal-cycle": ("thermal-cycle-mems/imu_raw_data.csv", "github.com/tofupilot/examples"),
    "cold-start": ("cold-start-mpu6050/Tempdata01-02-14.csv", "github.com/mjs513/FreeIMU-Updates"),
    "two-temperatures-cold": (
        "two-temperatures-bmi270/BMI_270_cold_test_.csv",
        "github.com/Ganesh999-tech/BMI270-Thermal-Drift-Compensation",
    ),
    "two-temperatures-hot": (
        "two-temperatures-bmi270/BMI_270_hot_test.csv",
        "github.com/Ganesh999-tech/BMI270-Thermal-Drift-Compensation",
    ),
    "ring-laser": ("ring-laser-static/lasergyro.imu", "github.com/WangShanpeng/PSINS"),
}
LICENSE = "LICENSE.upstream.txt"


def compact(values: np.ndarray) -> np.ndarray:
    """The values as the smallest integer type that holds them exactly, else as float64."""
    for kind in (np.int8, np.int16, np.int32):
        bounds = np.iinfo(kind)
        if values.min() >= bounds.min and values.max() <= bounds.max:
            as_integers = values.astype(kind)
            if np.array_equal(as_integers, values):
                return as_integers
    return values


def store(table: LoggerTable, recording: str, source: str, file: Path) -> None:
    columns = {ROW_COLUMN: compact(table.rows)}
    columns |= {str(name): compact(values) for name, values in table.columns.items()}
    stated = {
        "source": source,
        "licence": f"LICENSE.{PROFILES[recording]}.txt",
        "total_rows": table.total_rows,
        "findings": [finding.as_dict() for finding in table.findings],
    }
    stored = pa.table(columns).replace_schema_metadata({METADATA_KEY: json.dumps(stated)})
    floats = [name for name, values in columns.items() if values.dtype == np.float64]
    split = [name for name in floats if len(np.unique(columns[name])) > len(table.rows) / 4]
    dictionary = [name for name in columns if name != ROW_COLUMN and name not in split]
    encoding = dict.fromkeys(split, "BYTE_STREAM_SPLIT")
    encoding[ROW_COLUMN] = "DELTA_BINARY_PACKED"
    parquet.write_table(
        stored,
        file,
        compression="zstd",
        compression_level=19,
        use_dictionary=dictionary,
        column_encoding=encoding,
        write_statistics=False,
        row_group_size=len(table.rows),
    )


def main(folder: Path) -> None:
    for recording, (place, source) in SOURCES.items():
        original = folder / place
        table = read_logger_text(original, load_profile(PROFILES[recording]), PROFILES[recording])
        target = RECORDING_FOLDER / f"{recording}.parquet"
        with whole_file(target) as partial:
            store(table, recording, source, partial)
        with whole_file(RECORDING_FOLDER / f"LICENSE.{PROFILES[recording]}.txt") as partial:
            partial.write_bytes((original.parent / LICENSE).read_bytes())
        print(f"{target.name}: {len(table.rows)} rows, {target.stat().st_size} bytes")


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    main(Path(sys.argv[1]))
