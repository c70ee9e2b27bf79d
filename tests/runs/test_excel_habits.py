"""Tables as spreadsheet programs leave them: each is read, or answered with what to do."""

from __future__ import annotations

import re
import sqlite3
import zipfile
from contextlib import closing
from datetime import datetime, timedelta

import numpy as np
import openpyxl
import pandas as pd
import pytest

from fogml.errors import InputError
from fogml.runs.profile_draft import draft_profile
from fogml.runs.profiles import import_recording, load_profile
from fogml.runs.reading import read_run
from tests.cli.conftest import run_program

COUNT = 240
TIME = 10.0 * np.arange(COUNT)
INNER = 20.0 + 30.0 * np.sin(np.arange(COUNT) / 38.0)
OUTER = INNER + 0.5
GYRO = 10.0 + 0.02 * INNER + 0.05 * np.sin(1e4 * np.arange(COUNT))
HEADER = "time [s],gyro [deg/h],T_in [degC],T_out [degC]"
ROWS = [f"{t:g},{g:.6f},{a:.4f},{b:.4f}" for t, g, a, b in zip(TIME, GYRO, INNER, OUTER, strict=True)]


def text(header=HEADER, rows=ROWS):
    return "\n".join([header, *rows, ""])


def semicolons(line):
    return line.replace(",", ";").replace(".", ",")


def moment(row):
    seconds, _, rest = row.partition(",")
    at = np.datetime64("2026-01-05T08:00:00") + np.timedelta64(int(seconds), "s")
    return f"{str(at).replace('T', ' ')},{rest}"


def thousands(row):
    seconds, gyro, *rest = row.split(",")
    return ",".join([seconds, f'"{1000.0 + float(gyro):,.6f}"', *rest])


READ = {
    "plain.csv": text(),
    "bom.csv": ("\ufeff" + text()).replace("\n", "\r\n"),
    "case.csv": text("Time [s],Gyro [deg/h],T_In [degC],T_Out [degC]"),
    "degsym.csv": text("time[s],gyro[°/h],T_in[℃],T_out[℃]"),
    "gbk.csv": text("时间 [s],陀螺 [°/h],温度 [°C],T_out [°C]").encode("gbk"),
    "german.csv": "\ufeff" + semicolons(HEADER) + "\n" + "\n".join(map(semicolons, ROWS)) + "\n",
    "kreisel.csv": text("Zeit [s],Kreisel [°/h],Spulentemperatur [°C],T_out [°C]"),
    "chinese.csv": text("时间(s),陀螺仪输出(°/h),线圈温度(℃),T_out(℃)").encode("gb18030"),
    "faces.csv": text("Zeit [s],Kreisel [°/h],Spulentemperatur innen [°C],Spulentemperatur außen [°C]"),
    "faces2.csv": text("Time (s),Gyro (°/h),inner coil temperature (°C),coil temp outside (°C)"),
    "faces3.csv": text("时间(s),陀螺(°/h),线圈内侧温度(℃),线圈外侧温度(℃)"),
    "merged.csv": text("Protokoll,,,\nZeit,,Temperaturen,\n,gyro,T_in,T_out\ns,deg/h,°C,°C"),
    "parens.csv": text("Time (s),Gyro (°/h),T_in (°C),T_out (°C)"),
    "stamps.csv": text(rows=map(moment, ROWS)),
    "tab.txt": text().replace(",", "\t"),
    "temp.csv": text("time [s],gyro [deg/hr],Temp [degC],T_out [degC]"),
    "thousands.csv": text(rows=map(thousands, ROWS)),
    "title.csv": "Chamber test FOG-0417;;;\nOperator: Li\n" + text(),
    "trailing.csv": text(HEADER + ",", [row + "," for row in ROWS]),
    "unit.csv": text("time [s],gyro [dph],T_in [degC],T_out [degC]"),
    "unit2.csv": text("time [sec],gyro [deg/h],T_in [Celsius],T_out [degC]"),
}
ANSWERED = {
    "badcells.csv": (
        text(rows=[*ROWS[:7], "70,10.5,OVF,20", *ROWS[8:]]),
        r"line 9, column 'T_in': 'OVF' is not a number .*; correct the line, or --repair drops such rows",
    ),
    "dups.csv": (
        text(rows=[*ROWS[:100], ROWS[99], *ROWS[100:]]),
        r"line 102: .*or --repair drops the repeats",
    ),
    "empty.csv": (text(rows=[]), "a header and no samples; rows of numbers were expected below it"),
    "nounits.csv": (text("time,gyro,T_in,T_out"), r"'time' states no unit; write 'time \[s\]' in the header"),
    "zero.csv": ("", "the file is empty; a header and samples were expected"),
    "zeros.csv": ("\0" * 2_000_000, "the file is empty; a header and samples were expected"),
}
NO_TEMPERATURE = text("time [s],gyro [deg/h]", [",".join(row.split(",")[:2]) for row in ROWS])
ANSWERS = {name: content for name, (content, _) in ANSWERED.items()} | {"notemp.csv": NO_TEMPERATURE}


def write(path, content):
    path.write_bytes(content if isinstance(content, bytes) else content.encode())


def write_book(path):
    import xlsxwriter

    with xlsxwriter.Workbook(str(path)) as book:
        sheet = book.add_worksheet()
        sheet.write_row(0, 0, HEADER.split(","))
        for place, row in enumerate(ROWS, start=1):
            sheet.write_row(place, 0, map(float, row.split(",")))


@pytest.mark.parametrize("name", READ)
def test_is_read(tmp_path, name):
    path = tmp_path / name
    write(path, READ[name])
    run = read_run(path)
    np.testing.assert_allclose(run.time, TIME)
    np.testing.assert_allclose(run.gyro, GYRO + (1000.0 if name == "thousands.csv" else 0.0), atol=1e-6)
    np.testing.assert_allclose(run.temperature("T"), INNER, atol=1e-4)
    np.testing.assert_allclose(run.temperature("T_out"), OUTER, atol=1e-4)


def test_a_workbook_is_read(tmp_path):
    pytest.importorskip("python_calamine")
    pytest.importorskip("xlsxwriter")
    write_book(path := tmp_path / "book.xlsx")
    np.testing.assert_allclose(read_run(path).temperature("T"), INNER, atol=1e-4)


RUN = [HEADER.split(","), *([float(cell) for cell in row.split(",")] for row in ROWS)]


def book_of(path, sheets):
    """A workbook of sheets: name, whether it is hidden, rows."""
    pytest.importorskip("python_calamine")
    openpyxl = pytest.importorskip("openpyxl")
    book = openpyxl.Workbook()
    book.remove(book.active)
    for name, is_hidden, rows in sheets:
        sheet = book.create_sheet(name)
        sheet.sheet_state = "hidden" if is_hidden else "visible"
        for row in rows:
            sheet.append(row)
    book.save(path)


def test_the_sheet_that_is_shown_comes_before_a_hidden_one(tmp_path):
    other = [RUN[0], *([t, g + 100.0, a, b] for t, g, a, b in RUN[1:])]
    book_of(path := tmp_path / "book.xlsx", [("old", True, other), ("shown", False, RUN)])
    run = read_run(path)
    np.testing.assert_allclose(run.gyro, GYRO, atol=1e-6)
    assert "hidden_sheet" not in {finding.code for finding in run.findings}


def test_a_hidden_sheet_is_read_where_no_other_holds_a_run_and_is_told(tmp_path):
    book_of(path := tmp_path / "book.xlsx", [("notes", False, [["Test", "4"]]), ("data", True, RUN)])
    run = read_run(path)
    np.testing.assert_allclose(run.gyro, GYRO, atol=1e-6)
    (finding,) = (finding for finding in run.findings if finding.code == "hidden_sheet")
    assert "'data'" in finding.message


def test_true_and_false_are_a_switch_and_no_temperature(tmp_path):
    header = ["time [s]", "gyro [deg/h]", "T [degC]", "heater [0/1]"]
    rows = [[i, 1.0 + 0.1 * (i % 3), 20.0 + i % 7, i % 2 == 1] for i in range(40)]
    path = tmp_path / "run.xlsx"
    book_of(path, [("run", False, [header, *rows])])
    assert read_run(path).columns["heater"].tolist() == [i % 2 for i in range(40)]
    rows[4][2] = True
    book_of(path, [("run", False, [header, *rows])])
    with pytest.raises(
        InputError, match=r"run.xlsx, line 6, column 'T': holds TRUE or FALSE, where a number"
    ):
        read_run(path)


def test_a_column_of_numbers_and_of_text_with_a_comma_is_told(tmp_path):
    """A paste that a spreadsheet program took for text in some rows: 1000 times too much, or right."""
    rows = [[i, 9.25 + i / 1000 if i % 5 else f"9,{250 + i}", 20.5 + i / 10] for i in range(40)]
    book_of(
        path := tmp_path / "run.xlsx", [("run", False, [["time [s]", "gyro [deg/h]", "T [degC]"], *rows])]
    )
    (told,) = (f.message for f in read_run(path).findings if "are read as" in f.message)
    assert "'9,250' are read as 9250; where 9.25 is meant" in told


def test_a_second_sheet_with_a_run_is_told(tmp_path):
    other = [RUN[0], *([t, g + 100.0, a, b] for t, g, a, b in RUN[1:])]
    sheets = [
        ("notes", False, [["Test", "4"]]),
        ("up", False, RUN),
        ("down", False, other),
        ("old", True, other),
    ]
    book_of(path := tmp_path / "book.xlsx", sheets)
    run = read_run(path)
    np.testing.assert_allclose(run.gyro, GYRO, atol=1e-6)
    (finding,) = (finding for finding in run.findings if finding.code == "other_sheets")
    assert "'up' is read, and 'down' not" in finding.message and "'old'" not in finding.message


def test_a_draft_takes_no_other_column_for_a_gyro_of_formulas_without_values(tmp_path):
    rows = [[t, f"=10+0.02*C{at}", a, b] for at, (t, _, a, b) in enumerate(RUN[1:], start=1)]
    book_of(path := tmp_path / "book.xlsx", [("data", False, [RUN[0], *rows])])
    with pytest.raises(InputError, match=r"book\.xlsx, column 'gyro': empty, .* formulas without values"):
        draft_profile(path)


@pytest.mark.parametrize(
    ("columns", "place"), [((0,), ", column 'time'"), ((1,), ", column 'gyro'"), ((0, 1, 2, 3), "")]
)
def test_formulas_without_values_are_told(tmp_path, columns, place):
    formulas = {0: "=A{0}+10", 1: "=10+0.02*C{0}", 2: "=20+ROW()", 3: "=C{0}+0.5"}
    rows = [
        [formulas[i].format(at) if i in columns else value for i, value in enumerate(row)]
        for at, row in enumerate(RUN[1:], start=1)
    ]
    book_of(path := tmp_path / "book.xlsx", [("data", False, [RUN[0], *rows])])
    said = rf"book\.xlsx{place}: empty, .* formulas without values; open the file in a spreadsheet program"
    with pytest.raises(InputError, match=said):
        read_run(path)
    # The first row may hold the values that formulas go on from.
    book_of(path, [("data", False, [RUN[0], RUN[1], *rows[1:]])])
    with pytest.raises(InputError, match=said if place else "formulas without values"):
        read_run(path)


def test_an_empty_column_without_formulas_and_formulas_with_values_are_told_apart(tmp_path):
    pytest.importorskip("python_calamine")
    xlsxwriter = pytest.importorskip("xlsxwriter")
    path = tmp_path / "book.xlsx"
    with xlsxwriter.Workbook(str(path)) as book:
        sheet = book.add_worksheet()
        for place, row in enumerate(RUN):
            sheet.write_row(place, 0, [row[0], None, *row[2:]] if place else [*row, "note", "again"])
            if place:
                sheet.write_formula(place, 4, '=IF(A1>0,"","")', None, "")
                sheet.write_formula(place, 5, "=A1", None, row[0])
    # Nothing is what the formula shows, which Excel writes as an empty text.
    with zipfile.ZipFile(path) as archive:
        held = {name: archive.read(name) for name in archive.namelist()}
    with zipfile.ZipFile(path, "w") as archive:
        for name, content in held.items():
            archive.writestr(name, re.sub(rb'<c (r="E\d+")>', rb'<c \1 t="str">', content))
    with pytest.raises(InputError, match=r"column 'gyro', line 2: the value is missing"):
        read_run(path)


@pytest.mark.parametrize(
    "cell",
    [
        "Date/Time",
        "Datum/Zeit",
        "Datum Zeit",
        "Datum / Uhrzeit",
        "Datum und Uhrzeit",
        "日期/时间",
        "日期时间",
    ],
)
def test_date_and_time_in_one_column_by_its_name(tmp_path, cell):
    write(
        path := tmp_path / "run.csv", text(f"{cell},gyro [deg/h],T_in [degC],T_out [degC]", map(moment, ROWS))
    )
    np.testing.assert_allclose(read_run(path).time, TIME)


@pytest.mark.parametrize("name", ANSWERED)
def test_is_answered(tmp_path, name):
    content, said = ANSWERED[name]
    path = tmp_path / name
    path.write_text(content)
    with pytest.raises(InputError, match=said):
        read_run(path)


def test_without_a_temperature_is_inspected_and_not_trained(tmp_path):
    path = tmp_path / "notemp.csv"
    path.write_text(NO_TEMPERATURE)
    run_program("inspect", path, "-o", tmp_path / "inspected", "--quiet")
    told = run_program("train", path, "--test", path, "-o", tmp_path / "trained", status=2).stderr
    assert "no temperature 'T'" in told
    assert "the run holds none; call the column that measures it 'T [degC]', or let an import profile" in told


@pytest.mark.parametrize(
    ("inner", "outer"),
    [
        ("Temperatur innen", "Temperatur außen"),
        ("Innentemperatur", "Aussentemperatur"),
        ("inside temperature", "outside temp"),
    ],
)
def test_inside_and_outside_of_whatever_is_asked_and_not_taken_for_the_coils_faces(tmp_path, inner, outer):
    path = tmp_path / "run.csv"
    path.write_text(text(f"time [s],gyro [deg/h],{inner} [°C],{outer} [°C]"))
    run = read_run(path)
    assert run.temperature_columns == ()
    (finding,) = (f for f in run.findings if f.code == "unknown_column")
    call = (
        f"call '{inner}' 'T_in [degC]' and '{outer}' 'T_out [degC]' if measured on the coil's inner and outer"
    )
    assert call in finding.message and "'T_chamber [degC]' of the air" in finding.message
    drafted = draft_profile(path)
    for name, source in (("T_in", inner), ("T_out", outer)):
        assert re.search(
            rf'^  {name}: {{source: "{source} \[°C\]", unit: degC}} +# GUESS', drafted, re.MULTILINE
        )


@pytest.mark.parametrize("name", ["T_out", "T_chamber"])
def test_another_temperature_than_the_coils_is_enough_to_inspect(tmp_path, name):
    path = tmp_path / "run.csv"
    path.write_text(text(f"time [s],gyro [deg/h],{name} [degC],note [1]"))
    run_program("inspect", path, "-o", tmp_path / "inspected", "--quiet")


STAMPED = """schema: fogml.import/1
description: by hand
columns:
  time: {source: Zeit, unit: stamp}
  gyro: {source: Rate, unit: deg/h}
"""


@pytest.mark.parametrize(
    ("unit", "place", "value", "told"),
    [
        (
            "s",
            "B",
            "=A{row}*0.1+5",
            "column 'Rate': empty, and the workbook holds formulas without values; open",
        ),
        ("s", "B", None, "line 2, column 'Rate': empty, a number was expected \\(9 such rows\\)"),
        (
            "s",
            "B5",
            "k. A.",
            "line 5, column 'Rate': 'k\\. A\\.' is no number \\(1 such row\\); correct it, or leave",
        ),
        (
            "s",
            "A",
            datetime(2026, 3, 1, 8),
            "'2026-03-01 08:00:00' is a date or time of day, which 'unit: stamp'",
        ),
        (
            "stamp",
            "A5",
            "Pause",
            "line 5, column 'Zeit': 'Pause' is no date and time as in the first row, '2026-",
        ),
        (
            "stamp",
            "A7",
            3600.0,
            "line 7, column 'Zeit': '3600' is no date and time as in the first row, '2026-",
        ),
        ("stamp", "A2", "Start", "column 'Zeit': 'Start' in the first row is no date or time of day"),
    ],
)
def test_what_a_profile_by_hand_meets_in_a_workbook_is_told_by_row_and_value(
    tmp_path, unit, place, value, told
):
    """One cell, or a whole column."""
    book = openpyxl.Workbook()
    sheet = book.active
    sheet.append(["Zeit", "Rate"])
    for i in range(9):
        moment = datetime(2026, 3, 1, 8) + timedelta(seconds=i)
        sheet.append([float(i) if unit == "s" else moment, 5.0 + 0.01 * i])
    for row in range(2, 11) if len(place) == 1 else [int(place[1:])]:
        cell = sheet[f"{place[0]}{row}"]
        cell.value = value.format(row=row) if isinstance(value, str) else value
        cell.number_format = "General" if isinstance(value, float) else "yyyy-mm-dd hh:mm"
    book.save(tmp_path / "book.xlsx")
    (tmp_path / "own.yaml").write_text(STAMPED.replace("unit: stamp", f"unit: {unit}"))
    with pytest.raises(InputError, match=rf"^book\.xlsx, .*{told}"):
        import_recording(tmp_path / "book.xlsx", load_profile(str(tmp_path / "own.yaml")))


@pytest.mark.parametrize("first", [0, -3], ids=["at the begin", "within"])
def test_a_date_with_time_at_midnight_is_no_bare_date(tmp_path, first):
    import datetime

    book = openpyxl.Workbook()
    book.active.append(["Date/Time", "Gyro (deg/h)"])
    for row in range(12):
        moment = datetime.datetime(2026, 3, 3) + datetime.timedelta(seconds=first + row)
        book.active.append([moment, 9.0 + 0.1 * (row % 3)])
    book.save(tmp_path / "night.xlsx")
    run = read_run(tmp_path / "night.xlsx")
    np.testing.assert_allclose(run.time - run.time[0], np.arange(12.0), atol=1e-6)


@pytest.mark.parametrize("above", [0, 4])
def test_a_line_of_a_workbook_is_the_row_that_its_program_shows(tmp_path, above):
    book = openpyxl.Workbook()
    for i, cells in enumerate(
        [["time [s]", "gyro [deg/h]"], *([float(t), 9.0 + 0.1 * (t % 3)] for t in range(40))]
    ):
        for place, value in enumerate(cells):
            book.active.cell(above + 1 + i, 3 + place, value)
    book.active.cell(above + 20, 4, "kaputt")
    book.save(tmp_path / "low.xlsx")
    with pytest.raises(InputError, match=f"low.xlsx, line {above + 20}, column 'gyro': 'kaputt'"):
        read_run(tmp_path / "low.xlsx")


@pytest.mark.parametrize("header", ["Elapsed", "Elapsed [s]", "Elapsed [min]", "Time"])
@pytest.mark.parametrize("shown", ["h:mm:ss", "mm:ss.0", "[h]:mm:ss", "[mm]:ss"])
@pytest.mark.parametrize("step_s", [600.5, 3600.0, 40_000.5])
def test_a_cell_of_hours_minutes_and_seconds_goes_on_past_a_day(tmp_path, header, shown, step_s):
    """As a date of 1900, which a program of tables makes of it."""
    book = openpyxl.Workbook()
    sheet = book.active
    sheet.append([header, "Gyro (deg/h)"])
    seconds = np.arange(100) * step_s
    for i, elapsed in enumerate(seconds):
        sheet.append([elapsed / 86400.0, 9.0 + 0.1 * (i % 3)])
        sheet.cell(i + 2, 1).number_format = shown
    book.save(tmp_path / "book.xlsx")
    run = read_run(tmp_path / "book.xlsx")
    np.testing.assert_allclose(run.time, seconds, atol=1e-5)


def test_durations_of_a_profile_and_beside_a_clock_are_seconds(tmp_path):
    book = openpyxl.Workbook()
    sheet = book.active
    sheet.append(["Zeit", "Rate", "Held [s]"])
    for i in range(9):
        sheet.append([timedelta(seconds=20 * i), 5.0 + 0.01 * i, timedelta(seconds=7 * i)])
    book.save(tmp_path / "book.xlsx")
    (tmp_path / "own.yaml").write_text(STAMPED.replace("unit: stamp", "unit: s"))
    (run,) = import_recording(tmp_path / "book.xlsx", load_profile(str(tmp_path / "own.yaml")))
    np.testing.assert_allclose(run.time, 20.0 * np.arange(9.0), atol=1e-6)
    sheet["A1"], sheet["B1"] = "time", "gyro [deg/h]"
    book.save(tmp_path / "book.xlsx")
    run = read_run(tmp_path / "book.xlsx")
    np.testing.assert_allclose(run.time, 20.0 * np.arange(9.0), atol=1e-6)
    np.testing.assert_allclose(run.columns["Held"], 7.0 * np.arange(9.0), atol=1e-6)


@pytest.mark.parametrize(
    ("name", "write", "said"),
    [
        ("log.dta", pd.DataFrame.to_stata, "a Stata file; write it as Parquet or CSV"),
        ("log.json", pd.DataFrame.to_json, "JSON; write its columns as CSV or Parquet"),
        ("log.pkl", pd.DataFrame.to_pickle, "a pickle, which would run what it holds"),
        ("log.xls", pd.DataFrame.to_html, "a page or XML; save its table as CSV"),
        ("log.orc", pd.DataFrame.to_orc, "an ORC file; write it as Parquet"),
        ("log.xls", pd.DataFrame.to_csv, "if it is text, rename it to 'log.csv'"),
    ],
)
def test_formats_that_are_not_read_are_named_with_a_way_on(tmp_path, name, write, said):
    write(pd.DataFrame({"time": [0.0, 1.0], "gyro": [1.0, 2.0]}), tmp_path / name)
    with pytest.raises(InputError, match=said):
        read_run(tmp_path / name)


def test_a_database_that_is_no_bag_is_named(tmp_path):
    with closing(sqlite3.connect(tmp_path / "log.db")) as base:
        base.execute("create table log (time, gyro)")
    with pytest.raises(InputError, match="an SQLite database; write its table as CSV or Parquet"):
        read_run(tmp_path / "log.db")
