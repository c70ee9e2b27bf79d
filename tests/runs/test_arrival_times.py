"""Times of arrival are told from those of sampling and from real pauses, and the even clock is found."""

from __future__ import annotations

import numpy as np
import pytest

from fogml.runs.arrival_times import burst_ends, pauses_are_real, sampling_times
from fogml.runs.reading import read_blocks, read_run
from fogml.runs.run import Run
from fogml.runs.shipped import shipped_run
from tests.runs.files import write_table

ROWS, INTERVAL = 6000, 0.1


def arrival(size, jitter=0.0, drift=0.0, gap=0.0, at=ROWS // 2):
    """True times, and those of arrival: bursts of samples 2 ms apart, late by up to `jitter` periods."""
    index = np.arange(ROWS)
    true = INTERVAL * (index + 0.5 * drift * index**2 / ROWS)
    true[at:] += gap
    last = np.minimum(index // size * size + size - 1, ROWS - 1)
    late = np.random.default_rng(5).uniform(0.0, jitter * size * INTERVAL, ROWS // size + 1)
    return true, true[last] + late[index // size] + 0.002 * (index % size - size + 1)


@pytest.mark.parametrize("size", [2, 5, 32, 128])
@pytest.mark.parametrize("jitter", [0.0, 0.3])
def test_bursts_become_even_samples(size, jitter):
    true, times = arrival(size, jitter)
    gyro = np.random.default_rng(1).normal(size=ROWS)
    run = Run("run", {"time": times, "gyro": gyro})
    (finding,) = run.findings
    assert finding.code == "arrival_times"
    assert run.sample_s == pytest.approx(INTERVAL, rel=2e-4)
    assert len(run.gap_starts) == 0
    # Late by one delay, and within the error that is told beside it.
    off = run.time - true
    assert np.ptp(off) <= 0.4 * size * INTERVAL * jitter + 1e-6


def test_drift_of_the_clock_is_followed_and_a_real_gap_kept():
    true, times = arrival(5, drift=2e-3)
    time, finding = sampling_times({"time": times, "gyro": np.zeros(ROWS)})
    assert np.ptp(time - true) < 0.01 * INTERVAL
    assert "drift 1" in finding.message or "drift 2" in finding.message  # 2000 ppm, from start to end


@pytest.mark.parametrize("at", [15, ROWS // 2, ROWS - 10])
def test_a_real_gap_is_kept_however_few_bursts_are_on_one_side(at):
    true, times = arrival(5, gap=7.0, at=at)
    run = Run("run", {"time": times, "gyro": np.zeros(ROWS)})
    assert run.gap_starts.tolist() == [at]
    assert np.ptp(run.time - true) < 0.01


@pytest.mark.parametrize("pauses", [True, False])
def test_a_drift_tells_real_pauses_from_bursts(pauses):
    index = np.arange(ROWS)
    time = index // 10 * 5.0 + index % 10 * 0.1
    passed = time if pauses else index * 0.5
    gyro = 4e-3 * passed + np.random.default_rng(2).normal(0.0, 0.02, ROWS)
    ends = burst_ends(time)
    assert pauses_are_real(time, ends, {"time": time, "gyro": gyro}) is pauses
    run = Run("run", {"time": time, "gyro": gyro})
    assert len(run.gap_starts) == (ROWS // 10 - 1 if pauses else 0)


def test_no_bursts_in_other_clocks():
    rng = np.random.default_rng(3)
    even = INTERVAL * np.arange(ROWS)
    clocks = {
        "even": even,
        "jittered": even + rng.uniform(0.0, 0.05, ROWS),
        "random": np.cumsum(rng.exponential(INTERVAL, ROWS)),
        "a third lost": even[rng.uniform(size=ROWS) < 0.67],
        "every second lost": even[::2],
        "few gaps": even + 50.0 * (np.arange(ROWS) // 700),
        "five times as quick at last": np.cumsum(np.where(np.arange(ROWS) < 2500, 5.0, 1.0)),
        "quick in the middle": np.cumsum(np.where(np.abs(np.arange(ROWS) - 3000) < 1800, 1.0, 5.0)),
    }
    for name, time in clocks.items():
        run = Run(name, {"time": time, "gyro": rng.normal(size=len(time))})
        assert run.findings == (), name
        assert np.array_equal(run.time, time)


def test_pauses_of_the_shipped_cold_start_are_real():
    run = shipped_run("cold-start-x")
    assert len(run.gap_starts) == 378
    assert "arrival_times" not in {finding.code for finding in run.findings}


@pytest.mark.parametrize("suffix", [".csv", ".parquet"])
def test_in_files_whole_and_in_blocks(tmp_path, suffix):
    _, times = arrival(5)
    columns = {"time [s]": times, "gyro [deg/h]": np.random.default_rng(1).normal(size=ROWS)}
    path = write_table(tmp_path / f"run{suffix}", columns)
    whole = read_run(path)
    assert [finding.code for finding in whole.findings] == ["arrival_times"]
    blocks = list(read_blocks(path, block_rows=1000))
    assert len(blocks) == 6
    np.testing.assert_array_equal(np.concatenate([block.time for block in blocks]), whole.time)


@pytest.mark.parametrize("sparse", ["T", "gyro"])
def test_a_column_of_another_rate(tmp_path, sparse):
    time = 0.1 * np.arange(500)
    columns = {"time [s]": time, "gyro [deg/h]": 2.0 * time, "T [degC]": 20.0 + 0.5 * time}
    columns["heater [0/1]"] = (time > 20.0).astype(float)
    cell = "T [degC]" if sparse == "T" else "gyro [deg/h]"
    columns[cell] = np.where(np.arange(500) % 10 == 3, columns[cell], np.nan)
    columns["heater [0/1]"][np.arange(500) % 2 == 1] = np.nan
    path = write_table(tmp_path / "run.csv", columns)
    for run in (read_run(path), Run.derived("", next(read_blocks(path)).columns)):
        assert len(run) == (500 if sparse == "T" else 50)
        within = (run.time >= 0.3) & (run.time <= 49.3)
        np.testing.assert_allclose(run.columns["T"][within], 20.0 + 0.5 * run.time[within])
        np.testing.assert_allclose(run.gyro, 2.0 * run.time)
        assert np.array_equal(run.columns["heater"], run.time > 20.15)
    codes = [finding.code for finding in read_run(path).findings]
    assert codes.count("other_rate") == 2
