"""The compiled CSV writer against Arrow's text and against Python's numbers."""

from __future__ import annotations

import io
from pathlib import Path

import numpy as np
import pyarrow as pa
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from pyarrow import csv

from fogml.runs import csv_sink
from fogml.runs.csv_text_kernel import plain_lines
from fogml.runs.run import Run
from fogml.runs.writing import write_run

decimal = st.builds(
    lambda whole, places: whole / 10**places, st.integers(-(10**15), 10**15), st.integers(0, 15)
)


def arrow_lines(columns: np.ndarray) -> bytes:
    sink = io.BytesIO()
    table = pa.table({str(i): column for i, column in enumerate(columns)})
    csv.write_csv(table, sink, csv.WriteOptions(include_header=False))
    return sink.getvalue()


@settings(max_examples=600, deadline=None)
@given(values=st.lists(decimal | st.floats(), min_size=1, max_size=6), begin=st.integers(0, 15))
@example(values=[0.0, -0.0, 1e-5, 9999999999.5, 0.1, 1.0, -123456.789, 100.0], begin=3)
@example(values=[9.99999e-6], begin=0)
@example(values=[1e10], begin=0)
def test_text_is_arrows_or_left_alone(values: list[float], begin: int) -> None:
    column = np.array([values])
    lines = plain_lines(column, np.array([begin]))
    size = np.abs(column)
    if lines is not None:
        assert bytes(lines) == arrow_lines(column)
    else:
        rounded = [f"{value:.15g}" for value in values]
        within = np.all((column == 0.0) | ((size >= 1e-5) & (size < 1e10)))
        # One more digit than 15 may be needed, or decimals beyond the fifteenth.
        many = any(
            float(a) != b or len(a.lstrip("-0.")) > 14 or abs(b) < 1e-3 for a, b in zip(rounded, values)
        )
        assert not within or many


def test_columns_keep_their_own_decimals() -> None:
    rng = np.random.default_rng(0)
    places = np.array([0, 5, 2, 12])
    columns = np.stack([np.round(rng.normal(size=3000), n) for n in places])
    decimals = np.zeros(4, dtype=np.intp)
    assert bytes(plain_lines(columns, decimals)) == arrow_lines(columns)
    np.testing.assert_array_equal(decimals, places)


@pytest.mark.parametrize("fault", [None, np.nan, 1 / 3, 1e300])
def test_files_are_the_same_with_it_and_without(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, fault: float | None
) -> None:
    rng = np.random.default_rng(1)
    gyro = np.round(rng.normal(size=200_000), 4)
    if fault is not None:
        gyro[100_000] = fault
    run = Run.from_columns(time=np.arange(200_000.0), gyro=gyro, T=np.full(200_000, 25.25))
    monkeypatch.setattr(csv_sink, "pays_by_now", lambda saving_s: True)
    write_run(run, tmp_path / "compiled.csv")
    text = (tmp_path / "compiled.csv").read_bytes()
    header, lines = text.split(b"\n", 1)
    assert lines == arrow_lines(np.stack([run.time, run.gyro, run.columns["T"]]))
    assert header == b"time [s],gyro [deg/h],T [degC]"
