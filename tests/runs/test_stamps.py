"""Clocks of stamps: a gap among coarse ones, a faulty one, midnight before a fault, zones."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pyarrow as arrow
import pytest

from fogml.errors import InputError
from fogml.runs.arrival_times import spread_stamps
from fogml.runs.reading import read_blocks, read_run
from fogml.runs.stamps import StampClock, stamps_of


def of_day(seconds):
    """A time of day."""
    seconds %= 86400
    return f"{seconds // 3600:02d}:{seconds % 3600 // 60:02d}:{seconds % 60:02d}"


def test_samples_of_a_coarse_stamp_stay_before_the_gap_that_follows():
    true = np.concatenate([np.arange(600), np.arange(1600, 2200)]) / 10.0
    found, words = spread_stamps(np.floor(true))
    np.testing.assert_allclose(found, true, atol=1e-6)
    assert "1 gap kept" in words


def test_a_faulty_stamp_late_in_a_day_is_no_midnight():
    seconds = np.arange(600, 86400, 600)
    texts = [of_day(int(s)) for s in seconds]
    texts[-3] = "no time"
    clock = StampClock(stamps_of([(0, texts)]), "file")
    found = clock.seconds([arrow.array(texts)])
    np.testing.assert_array_equal(np.delete(found, -3), np.delete(seconds - 600.0, -3))
    assert np.isnan(found[-3])
    # The next block goes on after midnight.
    assert clock.seconds([arrow.array(["00:10:00"])]).tolist() == [86400.0]


def test_days_count_on_where_the_exact_reader_takes_over(tmp_path, monkeypatch):
    monkeypatch.setattr("fogml.runs.csv_source.LINES_BYTES", 1 << 14)
    lines = [f"{of_day(85000 + 20 * i)},{7.5 + i % 3},{'-' if i == 5900 else 1.5}" for i in range(6000)]
    path = tmp_path / "run.csv"
    path.write_text("\n".join(["time,gyro [deg/h],own [V]", *lines]) + "\n")
    times = np.concatenate([block.time for block in read_blocks(path, block_rows=500)])
    np.testing.assert_array_equal(times, 20.0 * np.arange(6000))


def test_days_are_those_of_their_month():
    texts = ["2024-02-28 12:00:00", "2024-02-29 12:00:00", "2024-02-30 12:00:00", "2024-04-31 12:00:00"]
    found = StampClock(stamps_of([(0, texts)]), "file").seconds([arrow.array(texts)])
    np.testing.assert_array_equal(found, [0.0, 86400.0, np.nan, np.nan])


@pytest.mark.parametrize(
    ("date", "clock", "zone"),
    [("23-03-2026", "08:00:{:02d}", None), ("23-03-2026", "08:00:{:02d}+01:00", 0.0)],
)
def test_a_year_behind_a_dash_is_no_zone(tmp_path, date, clock, zone):
    lines = [f"{date},{clock.format(i)},7.{i}" for i in range(30)]
    (tmp_path / "run.csv").write_text("\n".join(["date,time,gyro [deg/h]", *lines]) + "\n")
    started = read_run(tmp_path / "run.csv").facts.started
    assert (None if started.utcoffset() is None else started.utcoffset().total_seconds()) == zone
    assert (started.day, started.hour) == (23, 8 if zone is None else 7)


def test_greenwich_is_a_zone_and_a_date_that_is_not_read_is_told_as_one(tmp_path):
    lines = [f"2026-03-23 08:00:{i:02d} ZONE,7.{i}" for i in range(30)]
    text = "\n".join(["time,gyro [deg/h]", *lines]) + "\n"
    (tmp_path / "run.csv").write_text(text.replace("ZONE", "GMT"))
    assert read_run(tmp_path / "run.csv").facts.started.isoformat() == "2026-03-23T08:00:00+00:00"
    (tmp_path / "run.csv").write_text(text.replace("ZONE", "CST"))
    with pytest.raises(
        InputError, match="'2026-03-23 08:00:00 CST' is no date or time of day that is read, such as"
    ):
        read_run(tmp_path / "run.csv")


@pytest.mark.parametrize(("unit", "per_s"), [("sec", 1.0), ("min", 1.0 / 60.0), ("hr", 1.0 / 3600.0)])
def test_times_as_matlab_writes_those_of_a_timetable(tmp_path, unit, per_s):
    seconds = np.arange(0.0, 1800.0, 18.0)
    rows = "".join(f"{(90.0 + s) * per_s:g} {unit},{9.5 + s:.2f},20.5\n" for s in seconds)
    (tmp_path / "run.csv").write_text("Time,gyro [deg/h],T [degC]\n" + rows)
    np.testing.assert_allclose(read_run(tmp_path / "run.csv").time, seconds, atol=1e-9)


def test_times_as_pandas_writes_those_of_durations(tmp_path):
    seconds = np.arange(0.0, 200_000.0, 1_800.5)
    frame = pd.DataFrame({"gyro [deg/h]": np.sin(seconds), "T [degC]": 20.0}, pd.to_timedelta(seconds, "s"))
    frame.rename_axis("time").to_csv(tmp_path / "run.csv")
    assert "2 days 0" in (tmp_path / "run.csv").read_text()
    np.testing.assert_allclose(read_run(tmp_path / "run.csv").time, seconds, atol=1e-8)
