"""Small runs as files, and a runner of the command line."""

from __future__ import annotations

import json
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from fogml.cli.main import app


def csv_text(
    seed: int, *, low: float = 0.0, rows: int = 1500, header: str = "time [s],gyro [deg/h],T [degC]"
) -> str:
    """A ramp up and down over 40 degC, one sample in 2 s; drift linear in T and its rate."""
    rng = np.random.default_rng(seed)
    time = 2.0 * np.arange(rows)
    temperature = low + 20.0 * (1.0 - np.cos(2 * np.pi * time / time[-1]))
    rate = np.gradient(temperature, time) * 60.0
    gyro = 5.0 + 0.05 * temperature + 0.2 * rate + 0.05 * rng.normal(size=rows)
    lines = [f"{t:.3f},{g:.6f},{c:.4f}" for t, g, c in zip(time, gyro, temperature, strict=True)]
    return "\n".join([header, *lines]) + "\n"


@pytest.fixture
def run_files(tmp_path: Path) -> tuple[Path, Path]:
    """A training run and a test run with side files."""
    return write_runs(tmp_path)


def write_runs(folder: Path) -> tuple[Path, Path]:
    """A training run and a test run with side files in a folder."""
    paths = folder / "a.csv", folder / "b.csv"
    for seed, path in enumerate(paths):
        path.write_text(csv_text(seed))
        path.with_suffix(".yaml").write_text("unit: FOG-1\naxis: x\n")
    return paths


def run_program(*arguments: object, status: int = 0):
    """Run ``fogml`` with arguments; the result has exit_code, stdout, stderr and json()."""
    result = CliRunner().invoke(app, [str(argument) for argument in arguments])
    if result.exception is not None and not isinstance(result.exception, SystemExit):
        raise result.exception
    assert result.exit_code == status, result.stderr + result.stdout
    return result


@pytest.fixture
def invoke():
    """`run_program`."""
    return run_program


@pytest.fixture(scope="session")
def trained(tmp_path_factory: pytest.TempPathFactory):
    """Gives the folder of a polynomial of features that `fogml train` wrote of `run_files`, trained once."""

    @cache
    def folder(*words: str) -> Path:
        home = tmp_path_factory.mktemp("trained")
        train, test = write_runs(home)
        run_program(
            "train", train, "--test", test, "--model", "polynomial", *words, "-o", home / "out", "--quiet"
        )
        return home / "out" / "model"

    return folder


@pytest.fixture
def invoke_json(invoke):
    """Run ``fogml`` with ``--json`` and give what it printed."""

    def run(*arguments: object, status: int = 0):
        return json.loads(invoke(*arguments, "--json", status=status).stdout)

    return run
