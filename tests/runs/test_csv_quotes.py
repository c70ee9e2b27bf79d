"""Quotation marks of CSV files take no rows away, and the fast parser reads them as the exact one."""

from __future__ import annotations

import csv
import io
import re
from unittest import mock

import numpy as np
import pyarrow as arrow
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from fogml.errors import InputError
from fogml.runs.csv_files import quotes_are_plain
from fogml.runs.csv_source import CsvSource
from fogml.runs.logger_lines import hide_quoted, shown
from fogml.runs.reading import read_blocks, read_run

HEADER = "time [s],gyro [deg/h],note"
ABOVE = [f"{i},{i},ok" for i in range(4)]
READS = [read_run, lambda path: read_run(path, repair=True), lambda path: list(read_blocks(path))]


@pytest.mark.parametrize("rows", [5, 15_000])
@pytest.mark.parametrize(
    "fault", ['4,4,"bad', '4,"4,bad', '"4,4,bad', '4,"4"4,bad', '4,4,"bad"x', '4,4,"bad""']
)
@pytest.mark.parametrize("closed_below", [False, True])
def test_a_mark_that_is_not_closed_takes_no_rows_away(tmp_path, rows, fault, closed_below):
    below = [f"{i},{i},ok" for i in range(5, rows + 5)]
    if closed_below:
        below[2] = '7,7,b"ad'
    path = tmp_path / "run.csv"
    path.write_text("\n".join([HEADER, *ABOVE, fault, *below]) + "\n")
    for read in READS:
        with pytest.raises(InputError, match=r"run\.csv, line 6: not readable as CSV"):
            read(path)


@pytest.mark.parametrize("text", ['"ok"', '"a, b"', '"a ""b"""', '""', 'a "b" c', '"two\nlines, ""quoted"""'])
def test_marks_that_are_closed(tmp_path, text):
    path = tmp_path / "run.csv"
    rows = [f'{i},"{i}",{text}' for i in range(4, 40)]
    path.write_text("\n".join([HEADER, *ABOVE, *rows]) + "\n")
    assert np.array_equal(read_run(path).columns["gyro"], np.arange(40.0))
    blocks = list(read_blocks(path, block_rows=7))
    assert np.array_equal(np.concatenate([block.columns["gyro"] for block in blocks]), np.arange(40.0))


@settings(max_examples=100, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(text=st.text(alphabet='"",;a1\n\r ', max_size=40), part=st.sampled_from([7, 20, 1 << 20]))
def test_where_marks_are_plain_every_line_is_a_row(tmp_path, text, part):
    path = tmp_path / "any.csv"
    path.write_bytes(text.encode())
    with mock.patch("fogml.runs.csv_source.LINES_BYTES", part):
        try:
            parts = [bytes(lines) for lines in CsvSource(path).whole_lines()]
        except arrow.ArrowInvalid:
            # A line that does not fit is left to the exact reader as well.
            assert max(map(len, re.split("[\r\n]", text))) >= part
            return
    assert b"".join(parts) == text.encode()
    plain = all(quotes_are_plain(memoryview(lines), ",") for lines in parts)
    lines = [next(csv.reader([line]), []) for line in re.split("\r\n|\r|\n", text)]
    try:
        rows = list(csv.reader(io.StringIO(text, newline=""), strict=True))
    except csv.Error:
        assert not plain
        return
    assert not plain or [row for row in rows if row] == [row for row in lines if row]


@pytest.mark.parametrize(
    "text", ["x" * 100_000, "\n" * 100_000, "time [s],gyro [deg/h]" + ",c" * 100_000 + "\n0,1\n"]
)
def test_a_header_without_an_end(tmp_path, text):
    path = tmp_path / "run.csv"
    path.write_text(text)
    with pytest.raises(InputError, match=r"run\.csv: no line ends within the first 65536 bytes"):
        read_run(path)


def test_separators_between_quotation_marks_are_hidden_and_come_back():
    line = b'1;"a;b";"c";2'
    hidden = hide_quoted(line, ";")
    assert hidden.count(b";") == 3 and shown(hidden.decode(), ";") == line.decode()
    assert hide_quoted(line, None) == line and hide_quoted(b"1;2", ";") == b"1;2"
