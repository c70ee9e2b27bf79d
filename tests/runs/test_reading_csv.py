"""CSV files in every spelling that loggers and spreadsheets use give the same run."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from fogml.runs.reading import read_blocks, read_run
from tests.runs.files import csv_of, same, samples, tables, write_table

slow = settings(max_examples=100, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])

TIME = [0.0, 0.5, 1.25, 2.0]
GYRO = [1.5, -2.25, 3.0, 0.125]
INNER = [20.0, 20.5, 21.0, 26.75]
HEADER = ("time [s]", "gyro [deg/h]", "T_in [degC]")


def table(separator: str, mark: str, end: str, quote: str = "") -> str:
    rows = [[repr(value).replace(".", mark) for value in row] for row in zip(TIME, GYRO, INNER, strict=True)]
    lines = [separator.join(f"{quote}{cell}{quote}" for cell in row) for row in (HEADER, *rows)]
    return end.join(lines) + end


def check(run):
    np.testing.assert_array_equal(run.time, TIME)
    np.testing.assert_array_equal(run.gyro, GYRO)
    np.testing.assert_array_equal(run.columns["T_in"], INNER)


def test_quoted_decimal_commas_between_commas(tmp_path):
    path = tmp_path / "run.csv"
    path.write_text(table(",", ",", "\n", quote='"'))
    check(read_run(path))


@pytest.mark.parametrize("whole", [3, 20_000])
def test_decimal_commas_that_come_after_whole_numbers(tmp_path, whole):
    lines = [
        "time [s];gyro [deg/h]",
        *(f"{i};{i % 7}" for i in range(whole)),
        f"{whole}.0;0,5".replace(".", ","),
    ]
    path = tmp_path / "run.csv"
    path.write_text("\n".join(lines) + "\n")
    run = read_run(path)
    assert len(run) == whole + 1
    assert run.gyro[-1] == 0.5


@pytest.mark.parametrize("encoding", ["utf-8", "latin-1"])
def test_degree_signs(tmp_path, encoding):
    path = tmp_path / "run.csv"
    path.write_text("time [s],gyro [°/s],T [°C]\n0,1,20\n1,2,30\n", encoding=encoding)
    run = read_run(path)
    np.testing.assert_array_equal(run.gyro, [3600.0, 7200.0])
    np.testing.assert_array_equal(run.columns["T"], [20.0, 30.0])


def test_side_file_and_name(tmp_path):
    path = tmp_path / "run.csv"
    path.write_text(table(",", ".", "\n"))
    path.with_suffix(".yaml").write_text("unit: 0417\naxis: x\nlatitude: 39.9\ninput_axis: up\n")
    run = read_run(path, name="oven run")
    assert (run.name, run.facts.unit, run.facts.axis) == ("oven run", "0417", "x")
    assert run.facts.earth_rate_deg_h == pytest.approx(15.041067 * np.sin(np.radians(39.9)))


@slow
@given(
    columns=tables(),
    separator=st.sampled_from([";", "\t", ","]),
    comma=st.booleans(),
    line_end=st.sampled_from(["\n", "\r\n", "\r"]),
    quoted=st.booleans(),
    bom=st.booleans(),
    leading=st.integers(0, 3),
    blank=st.booleans(),
    trailing=st.integers(0, 2),
    in_header=st.booleans(),
    end=st.booleans(),
)
def test_any_dialect(
    tmp_path, columns, separator, comma, line_end, quoted, bom, leading, blank, trailing, in_header, end
):
    lines = csv_of(columns, separator, "," if comma else ".", "\n", quoted).splitlines()
    lines = [line + separator * (trailing if number or in_header else 0) for number, line in enumerate(lines)]
    text = line_end * leading + (line_end * (1 + blank)).join(lines) + (line_end if end else "")
    path = tmp_path / "run.csv"
    path.write_bytes((b"\xef\xbb\xbf" if bom else b"") + text.encode())
    run = read_run(path)
    assert same(run, columns)
    assert ("unfinished_line" in [finding.code for finding in run.findings]) is not end
    assert same(next(read_blocks(path)), columns)


def test_spellings_of_numbers_that_the_fast_parser_does_not_know(tmp_path):
    path = tmp_path / "run.csv"
    path.write_text("time [s],gyro [deg/h]\n+0.0, +1.5\n1e0 ,-.5E+1\n 2,  7.\n")
    assert read_run(path).gyro.tolist() == [1.5, -5.0, 7.0]
    assert next(read_blocks(path)).gyro.tolist() == [1.5, -5.0, 7.0]


def test_unknown_columns_are_kept_and_named(tmp_path):
    # A table's index comes without a name.
    columns = {
        "": np.arange(200.0),
        **samples(),
        "flow [l/min]": np.arange(200.0),
        "time_on [s]": np.arange(200.0),
    }
    run = read_run(write_table(tmp_path / "run.csv", columns))
    assert run.columns["flow"].tolist() == list(range(200))
    (note,) = [finding for finding in run.findings if finding.code == "unknown_column"]
    # What the simulator itself writes beside is known.
    assert "'flow'" in note.message and note.count == 2 and "time_on" not in note.message


@pytest.mark.parametrize("late", [5, 60_000])
def test_text_in_an_unknown_column_is_no_fault(tmp_path, late):
    rows = late + 10
    events = [""] * rows
    events[late] = "door opened"
    lines = [f"{i},{i % 7},{1 if late > 10 else ''}{events[i]}" for i in range(rows)]
    path = tmp_path / "run.csv"
    path.write_text("time [s],gyro [deg/h],event\n" + "\n".join(lines) + "\n")
    for run in (read_run(path), next(read_blocks(path))):
        assert len(run) == rows
        told = [finding for finding in run.findings if finding.code == "text_column"]
        assert [finding.column for finding in told] == ["event"]
        if "event" in run.columns:
            assert np.isnan(run.columns["event"][late])
            assert f"line {late + 2}" in told[0].message


def test_missing_values_of_unknown_columns_are_no_fault(tmp_path):
    path = tmp_path / "run.csv"
    path.write_text("time [s],gyro [deg/h],flow\n0,1,\n1,2,3\n2,3,NaN\n")
    flow = read_run(path).columns["flow"]
    assert np.isnan(flow[[0, 2]]).all() and flow[1] == 3.0
