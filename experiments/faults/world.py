"""Sound inputs of every format, tiny, made by fogml itself: what is spoiled afterwards."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from experiments.faults.containers import FOLDER, write_recordings
from experiments.faults.sandbox import Limits, Sandbox
from fogml.runs.facts import Facts
from fogml.runs.run import Run
from fogml.runs.writing import write_run

ROWS, SAMPLE_S = 48, 10.0
_LARGE = ("rbf", "forest")
MODELS: dict[str, tuple[str, ...]] = {
    "polynomial": ("--model", "polynomial", "--features", "T, dT[block, 20 s]"),
    "M2": ("--model", "M2"),
    "mean": ("--model", "mean"),
    "table": ("--model", "multipoint-2-1"),
    "rbf": ("--model", "rbf", "--features", "T", "--set", "centres=3"),
    "ridge": ("--model", "sklearn.linear_model.Ridge", "--features", "T"),
    "forest": (
        "--model",
        "sklearn.ensemble.RandomForestRegressor",
        "--features",
        "T",
        "--set",
        "n_estimators=2",
    ),
}
"""Models that are trained, saved and spoiled."""
STEPS = ["soak at 25 degC for 4 min", "ramp to 31 degC at 1 degC/min", "soak at 31 degC for 3 min"]
SIMULATION: dict[str, Any] = {
    "schema": "fogml.simulate/1", "seed": 3, "sample_s": 10.0, "programme": STEPS, "twin": "tactical",
    "columns": ["T_in", "T_out", "rate"], "facts": {"axis": "z", "latitude": 39.9, "input_axis": "up"},
}  # fmt: skip
FACTS: dict[str, Any] = {
    "unit": "FOG-1", "axis": "x", "latitude": 39.9, "input_axis": {"heading": 30.0}, "powered_on": -5.0,
    "scale_factor": {"value": 2.0, "unit": "count per deg/h"}, "started": "2026-03-02T08:00:00Z",
    "notes": "of a lab",
}  # fmt: skip
SPACE: dict[str, Any] = {
    "features": {"static": ["T", "T^1..2"], "rate": ["", "dT[block, {window} s]"]},
    "window": {"low": 20, "high": 40},
    "models": {"polynomial": {"ridge": {"low": 1e-8, "high": 1e-2, "log": True}}},
}
PROFILE: dict[str, Any] = {
    "schema": "fogml.import/1", "description": "a logger", "encoding": "utf-8", "separator": "tab",
    "decimal": ".",
    "signature": "imu.T", "skip_lines": 0, "header": True, "reject": {"wrong_field_count": True,
    "not_numbers": True},
    "columns": {"gyro": {"unit": "deg/s", "scale": "1/131"}, "T": {"source": "imu.T", "unit": "degC",
    "offset": 36.53}},
    "axes": {"x": "imu.x", "y": "imu.y"}, "legs": {"1": [0, 20], "2": [20, 40]}, "sample_s": 0.5,
    "facts": {"unit": "logger"}, "axis_facts": {"x": {"axis": "x"}}, "notes": ["a note"],
}  # fmt: skip


def run(seed: int, rows: int = ROWS, **facts: Any) -> Run:
    """Half a cycle of temperature; drift linear in T, white noise of 0.02 deg/h."""
    rng = np.random.default_rng(seed)
    time = SAMPLE_S * np.arange(rows)
    temperature = 25.0 + (8.0 + seed) * np.sin(np.pi * (1.0 + 0.2 * seed) * time / time[-1])
    gyro = 1.0 + 0.05 * temperature + 0.02 * rng.normal(size=rows)
    columns = {
        "time": time, "gyro": gyro.round(6), "T_in": temperature.round(3),
        "T_out": (temperature + 0.2).round(3),
        "rate": np.zeros(rows),
    }  # fmt: skip
    return Run("run", columns, Facts(**facts))


def misalignment_rows() -> list[list[str]]:
    """Averages of the four-state procedure."""
    from fogml.lab.misalignment_simulation import TableUnit, measurements

    made = measurements(TableUnit(1.2345, 5.0, 3.0, 0.5), (0.0, 30.0, 60.0, 90.0), (10.0, -10.0), noise=1e-5)
    rows = [["state", "tilt [deg]", "rate [deg/s]", "segment", "output [V]"]]
    turns = np.column_stack([made.state, made.tilt_deg, made.rate_deg_s, made.output])
    for state, tilt, rate, value in turns.tolist():
        for segment, level in (("before", 0.2), ("turn", 0.2 + value), ("after", 0.2)):
            rows.append([f"{state:g}", f"{tilt:g}", f"{rate:g}", segment, f"{level:.6f}"])
    return rows


def position_rows() -> list[list[str]]:
    """A seek of north at 77 deg in four positions."""
    rows = [["time [s]", "gyro [deg/h]", "position"]]
    for second in range(0, 160, 2):
        place, within = divmod(second, 40)
        angle = np.radians(77.0 + 90.0 * place)
        value = 11.5 * np.cos(angle) + 0.4 + 0.001 * np.sin(second)
        rows.append([str(second), f"{value:.6f}", str(place + 1 if within >= 10 else 0)])
    return rows


def logger_rows() -> list[list[str]]:
    """What the logger of `PROFILE` writes."""
    rng = np.random.default_rng(5)
    rows = [["imu.x", "imu.y", "imu.T", "imu.status"]]
    return rows + [
        [f"{x:.4f}", f"{y:.4f}", f"{20 + 0.05 * i:.2f}", "0"]
        for i, (x, y) in enumerate(rng.normal(size=(45, 2)))
    ]


def joined(rows: list[list[str]], separator: str = ",") -> bytes:
    """A table as text."""
    return ("\n".join(separator.join(row) for row in rows) + "\n").encode("utf-8", errors="surrogatepass")


def make_world(home: Path, *, quick: bool = False) -> dict[str, bytes]:
    """Sound files by their names: runs in every format, models, studies, a fleet, a blind suite.

    With `quick`, without studies, fleet, suite and the models of large libraries.

    Every command is run once on the way, so that its libraries are loaded and compiled before a
    process is forked.
    """
    limits = Limits()
    sandbox = Sandbox(home, limits)
    folder = home / "world"
    folder.mkdir(parents=True)
    facts = {"unit": "FOG-1", "axis": "x"}
    for seed, name in enumerate("abc"):
        write_run(run(seed, **facts), folder / f"{name}.csv")
    for suffix in ("parquet", "h5", "mat"):
        write_run(run(0, **facts), folder / f"run.{suffix}")
    write_run(run(0, **facts), folder / "new.mat", mat_version="7.3")
    for name, rows, separator in (
        ("turns.csv", misalignment_rows(), ","),
        ("positions.csv", position_rows(), ","),
        ("log.txt", logger_rows(), "\t"),
    ):
        (folder / name).write_bytes(joined(rows, separator))
    if not quick:
        write_recordings(folder)
    manifest = "unit,job,train,test,axis\nFOG-1,train,a.csv,b.csv,x\nFOG-2,train,c.csv,b.csv,x\n"
    (folder / "fleet.csv").write_text(manifest, encoding="utf-8")
    for name, values in (("simulation.yaml", SIMULATION), ("profile.yaml", PROFILE), ("sweep.yaml", sweep())):
        (folder / name).write_text(json.dumps(values), encoding="utf-8")
    was = Path.cwd()
    os.chdir(folder)
    try:
        with sandbox.catching():
            for arguments in _commands(quick):
                status, _, stderr = sandbox.command((*arguments, "--quiet"))
                if status not in (0, 1):
                    raise RuntimeError(f"fogml {' '.join(arguments)}: {status}: {stderr}")
    finally:
        os.chdir(was)
    return _contents(folder)


def recordings_alone(home: Path) -> dict[str, bytes]:
    """Sound recordings by their names, without the rest of the world."""
    folder = home / "world"
    folder.mkdir(parents=True)
    write_recordings(folder)
    return _contents(folder)


def _contents(folder: Path) -> dict[str, bytes]:
    return {
        str(path.relative_to(folder)): path.read_bytes()
        for path in sorted(folder.rglob("*"))
        if path.is_file() and (path.suffix not in (".html", ".xlsx") or path.parent.name == FOLDER)
    }


def sweep(**more: Any) -> dict[str, Any]:
    """The configuration of a sweep of a few quick trials."""
    return {
        "schema": "fogml.sweep/1", "name": "mine", "runs": ["a.csv", "c.csv"], "test": ["b.csv"],
        "space": SPACE,
        "objectives": ["rms", "bytes"], "trials": 3, "averaging": 30, "out": "swept", **more,
    }  # fmt: skip


def _commands(quick: bool) -> list[tuple[str, ...]]:
    judged = ("a.csv", "--test", "b.csv", "--averaging", "30")
    suite = ("--count", "1", "--sample", "20", "--kind", "one", "--workers", "1")
    trained = {name: words for name, words in MODELS.items() if not quick or name not in _LARGE}
    first: list[tuple[str, ...]] = [
        *[("train", *judged, *words, "-o", f"trained/{name}") for name, words in trained.items()],
        ("inspect", "a.csv", "run.parquet", "run.h5", "run.mat", "new.mat", "-o", "inspected"),
        ("noise", "a.csv", "-o", "noisy"),
        ("compare", *judged, "--models", "mean,M2", "-o", "compared"),
        ("compensate", "b.csv", "--model", "trained/polynomial/model", "-o", "compensated.csv"),
        ("export", "trained/polynomial/model", "--to", "c", "-o", "exported"),
        ("simulate", "simulation.yaml", "-o", "simulated.csv", "--truth", "truth.csv"),
        ("replay", "tactical", "simulated.csv", "-o", "replayed.csv"),
        ("lab", "misalignment", "turns.csv", "-o", "turned"),
        ("lab", "north", "--positions", "positions.csv", "--latitude", "39.9", "-o", "sought"),
        ("import", "log.txt", "--profile", "profile.yaml", "-o", "imported"),
    ]
    return (
        first
        if quick
        else [
            *first,
            ("sweep", "sweep.yaml"),
            ("fleet", "fleet.csv", "--any-unit", "--model", "M2", "--averaging", "30", "-o", "fleet"),
            ("blind", "make", "suite", *suite),
            ("blind", "run", "suite", "--method", "abstain", "--workers", "1"),
            ("blind", "score", "suite", "--workers", "1"),
        ]
    )


def models(world: Mapping[str, bytes]) -> tuple[str, ...]:
    """Names of the models that were trained."""
    return tuple(name for name in MODELS if f"trained/{name}/model/model.json" in world)
