"""The compiled parser of plain CSV against Python's own numbers, and against what it has to leave alone."""

from __future__ import annotations

import struct
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st

from fogml.runs import csv_files
from fogml.runs.csv_dialect import csv_dialect
from fogml.runs.csv_kernel import plain_columns
from fogml.runs.reading import read_run

HEADER = "time [s],gyro [deg/h],note,T [degC]"


def written(folder: Path, lines: list[str], header: str = HEADER, end: str = "\n") -> Path:
    path = folder / "run.csv"
    path.write_bytes(end.join([header, *lines, ""]).encode("latin-1"))
    return path


def parsed(path: Path, threads: int = 1) -> list[np.ndarray] | None:
    return plain_columns(path, csv_dialect(path), threads)


def bits(value: float) -> bytes:
    return struct.pack("d", value)


digits = st.text("0123456789", min_size=0, max_size=12)
signs = st.sampled_from(["", "+", "-"])
exponents = st.just("") | st.builds("{}{}{}".format, st.sampled_from("eE"), signs, st.integers(0, 12))
marks = st.sampled_from(["", "."])
spelt = st.builds("{}{}{}{}{}".format, st.sampled_from(["", "-"]), digits, marks, digits, exponents)


@settings(max_examples=400, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(fields=st.lists(spelt, min_size=1, max_size=8), decimal=st.sampled_from([".", ","]))
@example(fields=["9007199254740993", "-0", "-0.0", "1e22", "4.35", "0.1e-3"], decimal=".")
def test_a_number_is_pythons_or_left_alone(tmp_path: Path, fields: list[str], decimal: str) -> None:
    try:
        wanted = [float(field) for field in fields]
    except ValueError:
        wanted = None
    lines = [f"{i};{field.replace('.', decimal)};0{decimal}5" for i, field in enumerate(fields)]
    found = parsed(written(tmp_path, lines, "time [s];gyro [deg/h];T [degC]"))
    if wanted is None:
        assert found is None
    elif found is not None:
        assert [bits(v) for v in found[1]] == [bits(v) for v in wanted]
    else:
        # Only what may need more than one rounding is left to others.
        assert any(may_round_twice(field) for field in fields)


def may_round_twice(field: str) -> bool:
    """Whether digits and power of ten are not both numbers that float64 holds."""
    number, _, power = field.lower().lstrip("-").partition("e")
    return len(number.replace(".", "")) > 15 or abs(int(power or 0)) + len(number) > 22


@pytest.mark.parametrize("threads", [1, 2, 5])
@pytest.mark.parametrize("end", ["\n", "\r\n"])
@pytest.mark.parametrize("rows", [1, 3, 40_000])
def test_every_row_goes_to_its_place(tmp_path: Path, threads: int, end: str, rows: int) -> None:
    lines = [f"{i},{-i / 8},x{i},{1e-5 * i:.5f}" for i in range(rows)]
    path = written(tmp_path, lines, end=end)
    path.write_bytes(path.read_bytes()[: -len(end)] if rows == 3 else path.read_bytes())
    time, gyro, temperature = parsed(path, threads)
    index = np.arange(float(rows))
    np.testing.assert_array_equal(time, index)
    np.testing.assert_array_equal(gyro, -index / 8.0)
    np.testing.assert_array_equal(temperature, index / 1e5)


@pytest.mark.parametrize(
    "line",
    [
        *(
            "3,,a,4",
            "3,nan,a,4",
            "3,inf,a,5",
            "3,4,a",
            "3,4,a,5,6",
            '3,4,"a,b",5',
            "",
            "3, 4,a,5",
            "3,4,a,5 ",
        ),
        *("3,+4,a,5", "3,-,a,5", "3,.,a,5", "3,4e,a,5", "3,4e+,a,5", "3,1.2.3,a,5", "3,0x1,a,5"),
        *("3,4,a,5\r\r", "3,1e400,a,5", "3,12345678901234567890,a,5"),
    ],
)
def test_what_is_not_plain_is_left_alone(tmp_path: Path, line: str) -> None:
    lines = ["1,2,a,3", "2,2.5,b,3", line, "4,2,c,5"]
    assert parsed(written(tmp_path, lines)) is None
    lines[2] = "3,4,a,5"
    assert parsed(written(tmp_path, lines)) is not None


def test_reading_is_the_same_with_it_and_without(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    rng = np.random.default_rng(0)
    table = np.round(rng.normal(size=(5000, 2)), 5)
    lines = [f"{0.1 * i:.1f},{a},text,{b}" for i, (a, b) in enumerate(table.tolist())]
    path = written(tmp_path, lines)
    monkeypatch.setattr(csv_files, "pays_by_now", lambda saving_s: True)
    compiled = read_run(path)
    monkeypatch.setattr(csv_files, "_plain_columns", lambda path, dialect: None)
    strict = read_run(path)
    assert compiled.hash == strict.hash and compiled.findings == strict.findings
    np.testing.assert_array_equal(compiled.gyro, table[:, 0])
