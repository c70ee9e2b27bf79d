"""A small fleet as files, and jobs that other processes can import."""

from __future__ import annotations

import os
import time
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from fogml.errors import InputError
from fogml.fleet.manifest import Unit, read_manifest
from fogml.fleet.tasks import Task
from fogml.outputs import whole_folder

SLOPE, SPREAD = 0.05, 0.01


def write_run(path: Path, unit: str, seed: int, *, slope: float, cycles: float, rows: int = 800) -> None:
    """A run of a unit: drift linear in T and its rate, white noise of 0.02 deg/h."""
    rng = np.random.default_rng(seed)
    time_s = 4.0 * np.arange(rows)
    temperature = 20.0 + 30.0 * np.sin(2 * np.pi * time_s * cycles / time_s[-1])
    gyro = 1.0 + slope * temperature + 3.0 * np.gradient(temperature, time_s) + 0.02 * rng.normal(size=rows)
    lines = [f"{t:.1f},{g:.6f},{c:.4f}" for t, g, c in zip(time_s, gyro, temperature, strict=True)]
    path.write_text("\n".join(["time [s],gyro [deg/h],T [degC]", *lines]) + "\n")
    path.with_suffix(".yaml").write_text(f"unit: {unit}\naxis: x\n")


def write_fleet(folder: Path, count: int) -> Path:
    """Runs and a manifest of so many units."""
    lines = ["unit,job,train,test,axis"]
    for number in range(count):
        name = f"FOG-{number:03d}"
        slope = SLOPE + SPREAD * np.random.default_rng(number).normal()
        write_run(folder / f"{number}a.csv", name, 2 * number, slope=slope, cycles=1.0)
        write_run(folder / f"{number}b.csv", name, 2 * number + 1, slope=slope, cycles=1.3)
        lines.append(f"{name},train,{number}a.csv,{number}b.csv,x")
    path = folder / "fleet.csv"
    path.write_text("\n".join(lines) + "\n")
    return path


def tasks(folder: Path, count: int, job: Any, home: str = "out") -> list[Task]:
    """Tasks of a small fleet."""
    if not (folder / "fleet.csv").exists():
        write_fleet(folder, count)
    return [Task(unit, job, str(folder / home), {}) for unit in read_manifest(folder / "fleet.csv")]


def note(folder: Path, text: str) -> None:
    """Append a line to a log that many processes share."""
    handle = os.open(folder.parent / "log", os.O_WRONLY | os.O_APPEND | os.O_CREAT)
    os.write(handle, f"{text}\n".encode())
    os.close(handle)


def noted(folder: Path) -> list[str]:
    """Lines of the log."""
    path = folder / "log"
    return path.read_text().split("\n")[:-1] if path.exists() else []


def quick(unit: Unit, folder: Path) -> Mapping[str, Any]:
    """Notes that it was done."""
    folder.parent.mkdir(parents=True, exist_ok=True)
    note(folder, f"done {unit.name}")
    return {"number": int(unit.name[-3:])}


def slow(unit: Unit, folder: Path) -> Mapping[str, Any]:
    """As `quick`, after a while; says which process begins."""
    folder.parent.mkdir(parents=True, exist_ok=True)
    note(folder, f"begun {unit.name} {os.getpid()}")
    time.sleep(0.3)
    return quick(unit, folder)


def one_bad(unit: Unit, folder: Path) -> Mapping[str, Any]:
    """As `quick`, but for units 1 (bad input) and 2 (a defect)."""
    if unit.name.endswith("1"):
        raise InputError("the run is empty")
    if unit.name.endswith("2"):
        raise RuntimeError("unforeseen")
    return quick(unit, folder)


def one_deadly(unit: Unit, folder: Path) -> Mapping[str, Any]:
    """As `quick`, but unit 2 ends its process."""
    if unit.name.endswith("2"):
        os._exit(9)
    return quick(unit, folder)


def deadly_while_writing(unit: Unit, folder: Path) -> Mapping[str, Any]:
    """Ends its process while its results are half-written."""
    with whole_folder(folder) as staging:
        (staging / "half").write_text("half")
        os._exit(9)
