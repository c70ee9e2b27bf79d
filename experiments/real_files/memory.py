"""What reading long logs takes: size, peak of memory in both processes, time."""

from __future__ import annotations

import json
import math
import subprocess
import sys
import tempfile
import time
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from experiments.real_files import long_logs
from experiments.real_files.section import Section, table
from fogml.readers import READERS

HOURS = {
    "npz": (24.0,),
    "mat": (1.0, 4.0),
    "workbook": (1e6 / 3600.0 / long_logs.RATE_HZ,),
    "tdms": (24.0,),
    "mdf": (24.0,),
    "miniseed": (24.0,),
    "ulog": (24.0,),
    "dataflash": (24.0,),
    "rosbag": (0.25, 1.0),
    "rosbag2": (0.05, 0.15),
    "mcap": (1.0, 4.0),
}
"""Lengths of each format's logs [h]: a worksheet ends at 1,048,576 rows, ROS takes long to write. Where 24 h
are not among them, a peak that stays from one length to the next tells that it does for 24 h too."""
QUICK_HOURS = 0.01


def section(quick: bool, most_hours: float = math.inf, formats: Sequence[str] = ()) -> Section:
    """Write each log, read it in a process of its own, and take that one's figures.

    Parameters
    ----------
    quick
        Logs of a few seconds, to see that it runs.
    most_hours
        No log is longer [h].
    formats
        Only these; all by default. Rows of the others stay as they were measured before.
    """
    data = [] if quick or not formats else [row for row in _before() if row["format"] not in formats]
    for kind, lengths in HOURS.items():
        if formats and kind not in formats:
            continue
        for hours in sorted({min(length, most_hours) for length in lengths}):
            with tempfile.TemporaryDirectory(dir="/tmp") as folder:
                suffix = next((reader.suffixes[0] for reader in READERS if reader.name == kind), ".db3")
                path = Path(folder) / f"log{suffix}"
                written = getattr(long_logs, kind)(path, QUICK_HOURS if quick else hours)
                found = _measured(written or path)
            print(kind, hours, found, file=sys.stderr, flush=True)
            data.append({"format": kind, "hours": QUICK_HOURS if quick else hours, **found})
    order = list(HOURS)
    return told(sorted(data, key=lambda row: (order.index(row["format"]), row["hours"])))


def _before() -> list[dict[str, Any]]:
    """The rows that the page holds."""
    kept = Path(__file__).parent / "parts" / "memory.json"
    if not kept.exists():
        return []
    rows: list[dict[str, Any]] = json.loads(kept.read_text("utf-8"))["data"]["logs"]
    return rows


def told(data: Sequence[Mapping[str, Any]]) -> Section:
    """The section of logs that were measured."""
    rows = [
        [
            found["format"],
            f"{found['hours']:.3g}",
            f"{found['rows']:,}",
            f"{found['size_mb']:.0f}",
            f"{found['peak_mb']:.0f}",
            f"{found['reader_peak_mb']:.0f}",
            f"{found['cpu_s']:.0f}",
            f"{found['error']:.1g}",
        ]
        for found in data
    ]
    left = [kind for kind in HOURS if kind not in {found["format"] for found in data}]
    heads = ["format", "log [h]", "rows", "file [MB]", "peak [MB]", "reader's peak [MB]", "CPU [s]", "error"]
    markdown = "\n\n".join(
        [
            "## Memory",
            f"Synthetic logs at {long_logs.RATE_HZ:g} Hz, read from the first block to the last "
            "(`read_blocks`, a million rows each or ten million numbers, every column), in a process of its "
            "own. Peaks are resident memory of that process, its libraries among it, and of the one that "
            "unpacks the file. "
            "The error is that of the gyro against what was written, relative. "
            f"Not measured: {', '.join(left) or 'none of the formats'}.",
            table(heads, rows),
        ]
    )
    return Section(markdown, {"logs": list(data)})


def _measured(path: Path) -> dict[str, float]:
    done = subprocess.run(
        [sys.executable, "-m", "experiments.real_files.memory", str(path)], capture_output=True, text=True
    )
    if done.returncode:
        raise RuntimeError(done.stderr)
    found: dict[str, float] = json.loads(done.stdout)
    return found


def _peak_mb(process: int | str) -> float:
    """Most resident memory that a process has had [MB]."""
    for line in Path(f"/proc/{process}/status").read_text().splitlines():
        if line.startswith("VmHWM:"):
            return int(line.split()[1]) / 1024.0
    raise RuntimeError("the system tells no peak of memory")


def read(path: Path) -> dict[str, float]:
    """Read a log block by block, and tell what that took."""
    import numpy as np

    from fogml.runs import reader_process
    from fogml.runs.reading import read_blocks

    scale = {".mseed": 1000.0}.get(path.suffix, 1.0)
    axis = "x" if path.suffix in (".ulg", ".bin", ".bag", ".db3", ".mcap") else None
    # Those of three axes are in rad/s.
    scale *= 1.0 if axis is None else float(np.degrees(3600.0))
    began, rows, error = time.process_time(), 0, 0.0
    child = None
    for block in read_blocks(path, axis=axis):
        right = scale * long_logs.gyro(block.time)
        error = max(error, float(np.max(np.abs(block.gyro - right)) / np.max(np.abs(right))))
        rows += len(block)
        child = reader_process._processes.process
        peak = _peak_mb(child._process.pid) if child is not None and child.is_ready() else 0.0
    return {
        "rows": rows,
        "size_mb": path.stat().st_size / 1e6,
        "peak_mb": _peak_mb("self"),
        "reader_peak_mb": peak,
        "cpu_s": time.process_time() - began + _cpu_s(child._process.pid if child is not None else None),
        "error": error,
    }


def _cpu_s(process: int | None) -> float:
    """Time that a process has computed [s]."""
    import os

    if process is None:
        return 0.0
    fields = Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


if __name__ == "__main__":
    print(json.dumps(read(Path(sys.argv[1]))))
