"""Cells that a spreadsheet program shows otherwise than a file holds them are read as shown, or told."""

from __future__ import annotations

from datetime import datetime

import numpy as np
import openpyxl
import pytest
import xlsxwriter

from fogml.errors import InputError
from fogml.runs.profiles import import_recording, load_profile
from fogml.runs.reading import read_run

COUNT = 40
SHARE = 0.5 + 0.01 * (np.arange(COUNT) % 7)


def workbook(path, headers, cells, hidden=()):
    """By xlsxwriter, which writes 0 as the value of a formula; cells are a value, and a format, by column."""
    with xlsxwriter.Workbook(path) as book:
        sheet = book.add_worksheet()
        formats = {}
        for place, name in enumerate(["time [s]", "gyro [deg/h]", *headers]):
            sheet.write(0, place, name)
        for i in range(COUNT):
            sheet.write_row(i + 1, 0, [i, 9.6 + 0.01 * (i * i % 11)])
            for place, (value, shown) in enumerate(cells(i), start=2):
                form = shown and formats.setdefault(shown, book.add_format({"num_format": shown}))
                sheet.write(i + 1, place, value, form)
            if i in hidden:
                sheet.set_row(i + 1, None, None, {"hidden": True})
    return path


def write(path, text):
    path.write_text(text, encoding="utf-8")
    return path


def codes(run):
    return {finding.code: finding for finding in run.findings}


@pytest.mark.parametrize(
    ("header", "shown", "value", "read", "told"),
    [
        ("heater [%]", "0%", SHARE, SHARE, False),  # 52 % is a duty of 0.52
        ("heater [%]", "[Red]0.0%;-0.0%", SHARE, SHARE, False),
        ("humidity (%)", "0.00%", SHARE, 100.0 * SHARE, False),
        ("heater [1]", "0%", SHARE, SHARE, False),
        ("heater [%]", '0.0" %"', 100.0 * SHARE, SHARE, False),  # a sign that is shown, and nothing else
        ("heater [%]", r"0.0\%", 100.0 * SHARE, SHARE, False),
        ("share", "0%", SHARE, SHARE, True),
    ],
)
def test_percent_are_read_as_they_are_shown(tmp_path, header, shown, value, read, told):
    run = read_run(workbook(tmp_path / "a.xlsx", [header], lambda i: [(value[i], shown)]))
    np.testing.assert_allclose(run.columns[header.split()[0]], read, rtol=1e-12)
    assert ("percent_cells" in codes(run)) is told
    assert not told or "column C" in codes(run)["percent_cells"].message


def test_percent_cells_and_plain_ones_in_a_column_are_told_apart(tmp_path):
    cells = workbook(
        tmp_path / "a.xlsx", ["heater [%]"], lambda i: [(SHARE[i], "0%") if i % 2 else (100 * SHARE[i], None)]
    )
    np.testing.assert_allclose(read_run(cells).columns["heater"], SHARE, rtol=1e-12)


@pytest.mark.parametrize(
    ("name", "top", "said"),
    [("heater", 0.9, True), ("humidity", 1.0, True), ("humidity", 40.0, False), ("fan", 0.0, False)],
)
def test_shares_of_one_under_percent_are_told_of_any_format(tmp_path, name, top, said):
    rows = [f"{i},{9.6 + 0.01 * (i * i % 11):.2f},{top * i / (COUNT - 1)!r}" for i in range(COUNT)]
    run = read_run(write(tmp_path / "a.csv", "\n".join([f"time [s],gyro [deg/h],{name} [%]", *rows, ""])))
    assert ("small_shares" in codes(run)) is said
    if name == "heater":
        text = (tmp_path / "a.csv").read_text().replace("[%]", "[1]")
        assert "small_shares" not in codes(read_run(write(tmp_path / "b.csv", text)))


def test_rows_that_are_hidden_are_read_and_told(tmp_path):
    shown = workbook(tmp_path / "a.xlsx", ["T [degC]"], lambda i: [(25.0 + i, None)])
    part = workbook(tmp_path / "b.xlsx", ["T [degC]"], lambda i: [(25.0 + i, None)], hidden=(7, 8, 9))
    assert "hidden_rows" not in codes(read_run(shown))
    run = read_run(part)
    found = codes(run)["hidden_rows"]
    assert (len(run), found.count, found.row) == (COUNT, 3, 9)  # data begins in line 2


def test_formulas_that_nothing_calculated_are_no_zeros(tmp_path):
    """xlsxwriter writes 0 as their value and asks to be calculated on loading; openpyxl writes none."""
    of_gyro = workbook(tmp_path / "a.xlsx", ["T [degC]"], lambda i: [(f"=25+A{i + 2}", None)])
    with pytest.raises(InputError, match="column 'T': empty, and the workbook holds formulas without"):
        read_run(of_gyro)
    unused = workbook(
        tmp_path / "b.xlsx", ["T [degC]", "sum"], lambda i: [(25 + i, None), (f"=A{i + 2}", None)]
    )
    run = read_run(unused)
    assert np.isnan(run.columns["sum"]).all()
    assert "column D " in codes(run)["uncalculated"].message


def test_formulas_with_values_are_read_zeros_too(tmp_path):
    path = tmp_path / "a.xlsx"
    with xlsxwriter.Workbook(path) as book:
        sheet = book.add_worksheet()
        sheet.write_row(0, 0, ["time [s]", "gyro [deg/h]", "rate [deg/s]"])
        for i in range(COUNT):
            sheet.write_row(i + 1, 0, [i, 9.6 + 0.01 * (i * i % 11)])
            sheet.write_formula(i + 1, 2, f"=D{i + 2}*2", None, 10.0 * (i % 3 == 0))
    np.testing.assert_array_equal(read_run(path).columns["rate"], 10.0 * (np.arange(COUNT) % 3 == 0))


def test_a_profile_meets_what_a_sheet_shows_otherwise(tmp_path):
    path = workbook(
        tmp_path / "a.xlsx", ["die", "rh"], lambda i: [(25.0 + i, None), (SHARE[i], "0%")], hidden=(3,)
    )
    profile = write(
        tmp_path / "p.yaml",
        'schema: fogml.import/1\ndescription: d\ncolumns:\n  time: {source: "time [s]", unit: s}\n'
        '  gyro: {source: "gyro [deg/h]", unit: deg/h}\n  T: {source: die, unit: degC}\n'
        '  humidity: {source: rh, unit: "%"}\n',
    )
    (run,) = import_recording(path, load_profile(profile))
    assert {"hidden_rows", "percent_cells", "small_shares"} <= set(codes(run))


def test_a_workbook_written_by_openpyxl_is_marked_alike(tmp_path):
    book = openpyxl.Workbook()
    sheet = book.create_sheet("Zweite & letzte", 0)
    sheet.append(["Stand", datetime(2026, 3, 2)])
    sheet.append(["time [s]", "gyro [deg/h]", "heater [%]"])
    for i in range(COUNT):
        sheet.append([i, 9.6 + 0.01 * (i * i % 11), float(SHARE[i])])
        sheet.cell(i + 3, 3).number_format = "0.0%"
    sheet.row_dimensions[5].hidden = True
    book.save(tmp_path / "a.xlsx")
    run = read_run(tmp_path / "a.xlsx")
    np.testing.assert_allclose(run.columns["heater"], SHARE, rtol=1e-12)
    assert codes(run)["hidden_rows"].row == 5
