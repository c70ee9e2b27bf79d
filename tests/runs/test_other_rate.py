"""Columns of another rate, and what is said of a clock's ends."""

from __future__ import annotations

import numpy as np
import pytest

from fogml.errors import InputError
from fogml.runs.other_rate import clock_ends, is_of_another_rate
from fogml.runs.reading import read_run


@pytest.mark.parametrize("times", [[1.0, 2.0, 4.0], [np.nan, 4.0, 1.0, 2.0, np.nan], [4.0, np.inf, 1.0]])
def test_a_clock_ends_where_its_sound_times_do(times):
    assert clock_ends(np.array(times)) == (1.0, 4.0)


def test_of_no_sound_time_there_is_no_end():
    assert np.isnan(clock_ends(np.full(3, np.nan))).all() and np.isnan(clock_ends(np.empty(0))).all()


COUNT = 60
T = 25.0 + np.arange(COUNT) / 8


def found(path, header, *columns):
    rows = zip(range(COUNT), 9.5 + np.arange(COUNT) ** 2 % 37, T, *columns, strict=True)
    lines = [",".join(str(value) for value in row) for row in rows]
    path.write_text("\n".join([f"time [s],gyro [deg/h],T [degC],{header}", *lines, ""]))
    return {finding.code: finding.message for finding in read_run(path).findings}


@pytest.mark.parametrize(
    ("header", "values", "told"),
    [
        ("t2 [s]", 10 * np.arange(COUNT), "shows 590 s where 'time' shows 59 s"),
        ("DAQ time [ms]", 1000 + 1050 * np.arange(COUNT), "shows 61.95 s where 'time' shows 59 s"),
        ("DAQ time [ms]", 5000 + 1000 * np.arange(COUNT), None),  # begun earlier
        ("Elapsed [min]", np.arange(COUNT) / 60, None),
        ("exposure [ms]", 5 + np.arange(COUNT) % 3, None),  # a time, and no clock
        ("count", 10 * np.arange(COUNT), None),
    ],
)
def test_a_second_clock_that_goes_otherwise_is_told(tmp_path, header, values, told):
    message = found(tmp_path / "a.csv", header, values).get("other_clock")
    assert (message is None) is (told is None)
    assert told is None or told in message


def test_channels_of_labview_by_other_clocks_are_told(tmp_path):
    """With a column of X values for each channel, units stand above the channels."""
    keys = "LabVIEW Measurement,,,,|Separator,Comma,,,|X_Columns,Multi,,,|***End_of_Header***,,,,|,,,,"
    keys += "|Channels,2,,,|Y_Unit_Label,deg/h,,degC,|X_Dimension,Time,,Time,|***End_of_Header***,,,,"
    rows = [f"{i},{i * i % 37},{10 * i},{w}" for i, w in enumerate(T)]
    path = tmp_path / "a.lvm"
    path.write_text("\n".join([*keys.split("|"), "X_Value,gyro,X_Value,T,Comment", *rows, ""]))
    run = read_run(path)
    np.testing.assert_array_equal(run.columns["T"], T)
    assert "other_clock" in {finding.code for finding in run.findings}


@pytest.mark.parametrize("unit", ["s", "ms"])
def test_milliseconds_of_an_epoch_are_no_seconds(tmp_path, unit):
    """The year 58,000: a thousand times too slow a clock that a constant temperature didn't give away."""
    scale = 1000 if unit == "s" else 1_000_000
    rows = [f"{(1_773_216_000 + i) * scale},{i * i % 37}" for i in range(COUNT)]
    (tmp_path / "a.csv").write_text("\n".join([f"time [{unit}],gyro [deg/h]", *rows, ""]))
    with pytest.raises(InputError, match=r"times up to 1\.77 × 10¹² s are no clock's"):
        read_run(tmp_path / "a.csv")


def test_units_below_a_header_that_says_others_are_no_row_of_units(tmp_path):
    rows = "".join(f"{i},{i * i % 37}\n" for i in range(COUNT))
    (tmp_path / "a.csv").write_text(f"time [s],gyro [deg/h]\ns,deg/s\n{rows}")
    with pytest.raises(InputError, match="line 2, column 'time': 's' is not a number"):
        read_run(tmp_path / "a.csv")
    (tmp_path / "a.csv").write_text(f"time [s],gyro [deg/h]\nsec,°/h\n{rows}")
    assert len(read_run(tmp_path / "a.csv")) == COUNT


@pytest.mark.parametrize(
    ("step", "count", "is_slower"), [(10, 6, True), (2, 30, True), (1, 20, False), (1, 36, False)]
)
def test_a_column_that_is_full_until_it_ends_is_of_no_slower_rate(step, count, is_slower):
    """The last 20 of 60 values stood for the 40 rows behind them."""
    values = np.full(COUNT, np.nan)
    values[: step * count : step] = 20.0
    assert is_of_another_rate(values) is is_slower
