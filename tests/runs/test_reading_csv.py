"""CSV files in every spelling that loggers and spreadsheets use give the same run."""

from __future__ import annotations

import numpy as np
import pytest

from fogml.runs.reading import read_run

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


@pytest.mark.parametrize("quote", ["", '"'], ids=["plain", "quoted"])
@pytest.mark.parametrize("end", ["\n", "\r\n", "\r"], ids=["lf", "crlf", "cr"])
@pytest.mark.parametrize(
    ("separator", "mark"),
    [(",", "."), (";", "."), ("\t", "."), (";", ","), ("\t", ",")],
    ids=["comma", "semicolon", "tab", "semicolon, decimal comma", "tab, decimal comma"],
)
@pytest.mark.parametrize("start", [b"", b"\xef\xbb\xbf"], ids=["", "mark"])
def test_every_spelling(tmp_path, separator, mark, end, quote, start):
    path = tmp_path / "run.csv"
    path.write_bytes(start + table(separator, mark, end, quote).encode())
    run = read_run(path)
    check(run)
    assert run.name == "run.csv"


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


@pytest.mark.parametrize(
    ("cell", "value", "name", "expected"),
    [
        ("time [ms]", 1500, "time", 1.5),
        ("time [us]", 1500, "time", 1.5e-3),
        ("time [ns]", 1500, "time", 1.5e-6),
        ("time [min]", 1.5, "time", 90.0),
        ("time [h]", 1.5, "time", 5400.0),
        ("gyro [rad/s]", np.pi / 180 / 3600, "gyro", 1.0),
        ("T [K]", 293.15, "T", 20.0),
        ("T3 [K]", 273.15, "T3", 0.0),
        ("T_chamber [K]", 233.15, "T_chamber", -40.0),
        ("rate [deg/h]", 3600, "rate", 1.0),
        ("rate [rad/s]", np.pi, "rate", 180.0),
        ("angle [rad]", np.pi / 2, "angle", 90.0),
        ("heater [%]", 25, "heater", 0.25),
        ("fan [0/1]", 1, "fan", 1.0),
        ("humidity [%]", 25, "humidity", 25.0),
        ("B_x [G]", 0.5, "B_x", 50.0),
        ("B_z [uT]", 48, "B_z", 48.0),
    ],
)
def test_units(tmp_path, cell, value, name, expected):
    cells = [c for c in ("time [s]", "gyro [deg/h]") if not cell.startswith(c.split()[0])]
    path = tmp_path / "run.csv"
    zeros = ",".join("0" for _ in cells)
    ones = ",".join("1" for _ in cells)
    start = "0" if name == "time" else repr(float(value))
    path.write_text(",".join([*cells, cell]) + f"\n{zeros},{start}\n{ones},{float(value)!r}\n")
    assert read_run(path).columns[name][-1] == pytest.approx(expected, rel=1e-12, abs=1e-12)


def test_counts_stay_counts(tmp_path):
    path = tmp_path / "run.csv"
    path.write_text("time [s],gyro [count],T [degC]\n0,100,20\n1,-300,30\n")
    path.with_suffix(".yaml").write_text('scale_factor: {value: 50, unit: "count per deg/h"}\n')
    run = read_run(path)
    assert run.gyro_unit == "count"
    np.testing.assert_array_equal(run.gyro, [100.0, -300.0])
    np.testing.assert_array_equal(run.gyro_deg_h, [2.0, -6.0])


def test_other_columns_are_kept_and_named(tmp_path):
    path = tmp_path / "run.csv"
    path.write_text("time [s],gyro [deg/h],flow [l/min],state,T [degC]\n0,1,5,on,20\n1,2,,off,30\n")
    run = read_run(path)
    np.testing.assert_array_equal(run.columns["flow"], [5.0, np.nan])
    assert "state" not in run.columns
    messages = {finding.code: finding.message for finding in run.findings}
    assert "flow" in messages["unknown_column"]
    assert "state" in messages["text_column"]


def test_separators_at_the_end_of_every_line(tmp_path):
    path = tmp_path / "run.csv"
    path.write_text("\n".join(line + ";" for line in table(";", ",", "\n").splitlines()[1:]))
    path.write_text(table(";", ",", "\n").splitlines()[0] + "\n" + path.read_text() + "\n")
    check(read_run(path))


def test_every_digit_is_read(tmp_path):
    values = np.random.default_rng(1).normal(size=2000) * 10.0 ** np.random.default_rng(2).integers(
        -200, 200, 2000
    )
    path = tmp_path / "run.csv"
    rows = "".join(f"{i},{value!r}\n" for i, value in enumerate(values.tolist()))
    path.write_text("time [s],gyro [deg/h]\n" + rows)
    np.testing.assert_array_equal(read_run(path).gyro, values)


def test_side_file_and_name(tmp_path):
    path = tmp_path / "run.csv"
    path.write_text(table(",", ".", "\n"))
    path.with_suffix(".yaml").write_text("unit: 0417\naxis: x\nlatitude: 39.9\ninput_axis: up\n")
    run = read_run(path, name="oven run")
    assert (run.name, run.facts.unit, run.facts.axis) == ("oven run", "0417", "x")
    assert run.facts.earth_rate_deg_h == pytest.approx(15.041067 * np.sin(np.radians(39.9)))
