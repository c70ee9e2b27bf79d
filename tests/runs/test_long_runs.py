"""Long runs are looked into in bounded memory, and the figures are those of short ones."""

from __future__ import annotations

import dataclasses
import math
import re
import tracemalloc
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from fogml.errors import InputError
from fogml.report.inspect_page import inspect_page
from fogml.runs import reading
from fogml.runs.checks import check_run
from fogml.runs.facts import Facts
from fogml.runs.noise_of_run import noise_report
from fogml.runs.reading import read_run
from fogml.runs.reading_limits import ReadingLimits
from fogml.runs.run import Run
from fogml.runs.writing import write_run
from fogml.signals import large
from fogml.validation.floors import floors_over
from fogml.validation.inspection import inspection_json

HELD = ReadingLimits(long_mb=math.inf)
LONG = ReadingLimits(long_mb=0.0)
SAMPLES = 24_000


def _faulty_run() -> Run:
    """Gaps, a stuck sensor, dropouts, outliers, saturation, uneven times, a table that turns."""
    rng = np.random.default_rng(4)
    time = np.arange(SAMPLES) * 0.5 + rng.uniform(0.0, 0.1, SAMPLES)
    time[8_000:] += 500.0
    temperature = 20.0 + 30.0 * np.sin(time / 3000.0) + rng.normal(0.0, 0.02, SAMPLES)
    temperature[[700, 701, 18_000]] = -127.0
    stuck = temperature + 1.0
    stuck[10_000:12_000] = 33.0
    rate = np.where((np.arange(SAMPLES) // 4_000) % 3 == 1, 0.5, 0.0) + rng.normal(0.0, 1e-5, SAMPLES)
    gyro = 9.0 + rng.normal(0.0, 2.0, SAMPLES) + 0.1 * temperature + 3600.0 * rate
    gyro[[5, 15_555]] += 400.0
    gyro[20_000:20_010] = gyro.max()
    columns = {"time": time, "gyro": gyro, "T": temperature, "T_case": stuck, "rate": rate}
    return Run("faulty", columns, Facts(latitude=40.0, input_axis="up"))


def _quiet_run(samples: int = SAMPLES) -> Run:
    rng = np.random.default_rng(5)
    time = np.arange(samples) * 0.0025
    walk = np.cumsum(rng.normal(0.0, 1e-3, samples))
    gyro = 10.0 + rng.normal(0.0, 5.0, samples) + 0.5 * np.sin(time) + walk
    return Run("quiet", {"time": time, "gyro": gyro, "T": 20.0 + 3.0 * np.sin(time / 20.0)})


def _told(run: Run) -> dict[str, Any]:
    told: dict[str, Any] = {"inspect": inspection_json([run]), "page": inspect_page(run)}
    if "rate" not in run.columns:
        told["noise"] = noise_report(run)
        told["floors"] = [dataclasses.asdict(floor) for floor in floors_over(run, 10.0, [10.0, 50.0])]
    return told


def _same(one: Any, other: Any, place: str = "") -> None:
    if isinstance(one, dict):
        assert one.keys() == other.keys(), place
        for key in one:
            _same(one[key], other[key], f"{place}/{key}")
    elif isinstance(one, list | tuple):
        assert len(one) == len(other), place
        for index, (a, b) in enumerate(zip(one, other, strict=True)):
            _same(a, b, f"{place}/{index}")
    elif isinstance(one, float):
        assert other == pytest.approx(one, rel=1e-7, abs=1e-300), place
    else:
        assert one == other, place


@pytest.mark.parametrize("made", [_faulty_run, _quiet_run])
def test_a_long_run_gives_the_figures_of_a_short_one(
    made: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    write_run(made(), path := tmp_path / "run.csv")
    short = read_run(path, limits=HELD)
    expected = _told(short)
    monkeypatch.setattr(large, "HELD_VALUES", 3000)
    monkeypatch.setattr(large, "PIECE", 2500)
    long = read_run(path, limits=LONG)
    assert long.findings == short.findings
    assert long.facts == short.facts
    assert all(np.array_equal(long.columns[name], values) for name, values in short.columns.items())
    _same(expected, _told(long))


def test_what_all_rows_tell_of_columns_is_told_of_a_long_file_too(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    time = np.arange(6000.0)
    time[4000:] += 8.0
    # A clock 1000 ppm fast: 6 s in all, and in no thousand rows over two samples.
    heater = np.where(time < 3000.0, 0.4, 0.8)
    text = "\n".join(
        f"{t!r},{7 + t % 7},{1.001 * t!r},{h}" for t, h in zip(time.tolist(), heater, strict=True)
    )
    path = tmp_path / "run.csv"
    path.write_text(f"time [s],gyro [deg/h],logger [s],heater [%]\n{text}\n")
    short = read_run(path, limits=HELD)
    assert "shows 6013.01 s where 'time' shows 6007 s" in "; ".join(f.message for f in short.findings)
    monkeypatch.setattr(reading, "BLOCK_ROWS", 1000)
    assert read_run(path, limits=LONG).findings == short.findings
    assert {"gap", "other_clock", "small_shares"} <= {finding.code for finding in short.findings}
    # Where a column of another rate has it read whole nothing is told twice.
    sparse = "".join(f"{t!r},7.{i % 7},{20 + i if i % 5 == 0 else ''}\n" for i, t in enumerate(time.tolist()))
    path.write_text("time [s],gyro [deg/h],T [degC]\n" + sparse)
    assert read_run(path, limits=LONG).findings == read_run(path, limits=HELD).findings


def test_a_fault_of_a_long_file_is_counted_in_the_rows_that_were_read(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(reading, "BLOCK_ROWS", 1000)
    for spoilt, told in (
        (
            (-1, math.nan),
            "'gyro', line 1502: the value is missing (NaN), 500 such in rows 1001 to 2000; correct",
        ),
        (
            (0, 0.0),
            "line 1502: time goes back; it must strictly increase: in rows 1001 to 2000 the clock restarts",
        ),
    ):
        rows = [[float(i), i % 7.0] for i in range(4000)]
        for i in range(1500, 4000):
            rows[i][spoilt[0]] = spoilt[1] + i - 1500
        path = tmp_path / "run.csv"
        path.write_text("time [s],gyro [deg/h]\n" + "".join(f"{t},{g}\n" for t, g in rows))
        with pytest.raises(InputError, match=re.escape(told)):
            read_run(path, limits=LONG)


def test_a_long_run_takes_no_memory_of_its_length(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(large, "HELD_VALUES", 4000)
    monkeypatch.setattr(large, "PIECE", 4000)
    peaks = []
    for samples in (24_000, 24_000, 240_000):
        run = _quiet_run(samples)
        columns = {name: large.each(np.copy, values) for name, values in run.columns.items()}
        del run
        tracemalloc.start()
        try:
            long = Run.derived("run", columns)
            inspection_json([long.with_findings(check_run(long))])
            noise_report(long)
            peaks.append(tracemalloc.get_traced_memory()[1])
        finally:
            tracemalloc.stop()
    # The first time tells what is imported and cached. Marks of rows are held, and a rate of zeros, which
    # takes no memory; two more columns do not fit.
    assert peaks[2] - peaks[1] < 2 * 8 * (240_000 - 24_000)
