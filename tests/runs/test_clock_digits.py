"""Times of day in digits, 095959 before 100000, are no seconds; seconds are never taken for them."""

from __future__ import annotations

from datetime import datetime, timedelta

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fogml.errors import InputError
from fogml.runs.possible import digits_of_clock
from fogml.runs.reading import read_blocks, read_run
from fogml.runs.run import Run
from fogml.signals import large


def in_digits(start: datetime, step_s: float, count: int) -> np.ndarray:
    moments = [start + timedelta(seconds=step_s * i) for i in range(count)]
    return np.array([float(moment.strftime("%H%M%S.%f")) for moment in moments])


@settings(max_examples=100, deadline=None)
@given(st.integers(0, 43_200), st.sampled_from([0.1, 0.25, 1.0, 2.0, 5.0, 7.0, 25.0, 30.0, 40.0]))
def test_digits_are_found_from_the_second_minute_on(second: int, step_s: float) -> None:
    start = datetime(2026, 1, 1) + timedelta(seconds=second)
    assert digits_of_clock(in_digits(start, step_s, int(max(185.0, 15.0 * step_s) / step_s)))
    assert not digits_of_clock(in_digits(start.replace(second=0), step_s, int(59.0 / step_s) + 1))


@settings(max_examples=200, deadline=None)
@given(
    st.floats(0.0, 239_000.0),
    st.floats(0.01, 500.0),
    st.integers(2, 300),
    st.lists(st.tuples(st.integers(1, 299), st.floats(1.0, 300.0)), max_size=3),
)
def test_seconds_are_none(start: float, step_s: float, count: int, gaps: list[tuple[int, float]]) -> None:
    time = start + step_s * np.arange(count)
    for row, length in gaps:
        time[row:] += length
    assert not digits_of_clock(time)


def test_whole_hundreds_of_seconds_are_none() -> None:
    assert not digits_of_clock(100.0 * np.arange(50))
    assert not digits_of_clock(np.array([0.0, 50.0, 100.0, 150.0, 200.0, 250.0, 300.0]))


def test_long_ones_are_told_piece_by_piece(monkeypatch) -> None:
    time = in_digits(datetime(2026, 1, 1, 9, 58), 1.0, 3000)
    monkeypatch.setattr(large, "HELD_VALUES", 500)
    monkeypatch.setattr(large, "PIECE", 128)
    assert digits_of_clock(time)
    assert not digits_of_clock(np.arange(3000.0))


def test_a_file_with_them_is_refused(tmp_path) -> None:
    time = in_digits(datetime(2026, 1, 1, 9, 58), 1.0, 300)
    path = tmp_path / "run.csv"
    rows = [f"{value:06.0f},{i % 7}.25,20.5" for i, value in enumerate(time)]
    path.write_text("time [s],gyro [deg/h],T [degC]\n" + "\n".join(rows) + "\n")
    for read in (read_run, lambda path: list(read_blocks(path))):
        with pytest.raises(InputError, match=r"run\.csv, column 'time': times such as 100259 are hours"):
            read(path)
    with pytest.raises(InputError, match="times such as 100259 are hours"):
        Run.from_columns("r", None, time=time, gyro=np.zeros(300))
