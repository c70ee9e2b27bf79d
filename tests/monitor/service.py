"""A unit in service: a model, and runs whose bias moves a little from run to run."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from fogml.models.names import make_model
from fogml.models.saved import save_model
from fogml.runs.reading import read_run

BETWEEN_RUNS = 0.01


def write_run(
    folder: Path,
    day: int,
    *,
    bias: float = 5.0,
    slope: float = 0.05,
    noise: float = 0.05,
    unit: str = "FOG-1",
    dated: bool = True,
    rate: float = 0.0,
) -> Path:
    """A ramp up and down, one sample in 4 s; with `rate` [deg/s] the table turns in its middle."""
    rng = np.random.default_rng(day)
    time = 4.0 * np.arange(700)
    temperature = 20.0 * (1.0 - np.cos(2 * np.pi * time / time[-1]))
    gyro = bias + BETWEEN_RUNS * rng.normal() + slope * temperature + noise * rng.normal(size=700)
    cells, columns = ["time [s]", "gyro [deg/h]", "T [degC]"], [time, gyro, temperature]
    if rate:
        table = np.where((time > 1000.0) & (time < 1800.0), rate, 0.0)
        gyro += 3600.0 * table * (1.0 + 50e-6)
        cells.append("rate [deg/s]")
        columns.append(table)
    path = folder / f"{unit}-{day:02d}.csv"
    np.savetxt(path, np.stack(columns, axis=1), "%.6f", ",", header=",".join(cells), comments="")
    facts = f"unit: {unit}\naxis: x\n" + (f"started: 2026-03-{day:02d}T08:00:00Z\n" if dated else "")
    path.with_suffix(".yaml").write_text(facts)
    return path


def write_model(folder: Path, unit: str = "FOG-1") -> Path:
    """A model of the unit, fitted to a run of its own."""
    training = folder / "training"
    training.mkdir(exist_ok=True)
    model = make_model("polynomial", None, 0, {})
    model.fit([read_run(write_run(training, 28, unit=unit))])
    save_model(model, folder / "model")
    return folder / "model"
