"""Headers, clocks and lines around the data as laboratories write them: the same run as from a plain file."""

from __future__ import annotations

from datetime import UTC, datetime, timedelta
from time import perf_counter

import numpy as np
import pytest

from fogml.errors import InputError
from fogml.runs.columns import conversion
from fogml.runs.header_spelling import canonical_cells, with_units_below
from fogml.runs.reading import read_blocks, read_run

COUNT = 30
TIME = np.arange(COUNT) * 0.5
GYRO = 1000.0 + np.arange(COUNT) ** 2 % 17 * 100 + 0.25
INNER = 20.0 + np.arange(COUNT) / 8
PLAIN = [f"{t},{g},{w}" for t, g, w in zip(TIME, GYRO, INNER, strict=True)]
HEADER = "time [s],gyro [deg/h],T_in [degC]"


def lines(header=HEADER, rows=PLAIN, above=(), below=()):
    return "\n".join([*above, header, *rows, *below]) + "\n"


def german(number):
    return f"{number:,.3f}".translate(str.maketrans(",.", ".,"))


def stamped(form):
    moments = [datetime(2026, 3, 28, 23, 59, 50) + timedelta(seconds=t) for t in TIME]
    return [f"{form(moment)},{g},{w}" for moment, g, w in zip(moments, GYRO, INNER, strict=True)]


def semicolons(rows):
    return [row.replace(",", ";") for row in rows]


def thousandths(moment):
    return f"{moment:%H:%M:%S},{moment.microsecond // 1000:03d}"


def labview(separator="\t", comma=False, names="X_Value,gyro,T_in,Comment", x_columns="One", rows=PLAIN):
    """A measurement file as LabVIEW writes it: two blocks of keys, names, and rows without a comment."""
    file = f"""LabVIEW Measurement,
Writer_Version,2
Separator,{"Comma" if separator == "," else "Tab"}
Decimal_Separator,{"," if comma else "."}
Multi_Headings,No
X_Columns,{x_columns}
Date,2026/01/05
Time,10:00:00.25
***End_of_Header***,
,
Channels,2,
Samples,30,30,
Date,2026/01/05,2026/01/05,
Y_Unit_Label,deg/h,degC,
X_Dimension,Time,Time,
X0,0.0E+0,0.0E+0,
Delta_X,0.5,0.5,
***End_of_Header***,,,""".splitlines()
    rows = [row.replace(",", separator) for row in rows]
    text = "\n".join([*(line.replace(",", separator) for line in [*file, names]), *rows]) + "\n"
    return text.replace(".", ",") if comma else text


SHORT = "Time;Gyro [dph];T_in [C]"
DAYS = [r.replace("28/", "03/").replace("29/", "04/") for r in stamped(lambda m: f"{m:%d/%m/%Y %H:%M:%S}")]
TWO = stamped(lambda moment: f"{moment:%d.%m.%Y},{moment:%H:%M:%S.%f}")
FILES = {
    "parentheses": lines("Time (s),Gyro (°/h),T_in (°C)"),
    "case": lines("TIME [S],GYRO [DEG/H],T_IN [DEGC]"),
    "signs": lines("time[sec],gyro[˚/h],T_in[℃]"),
    "words": lines("time [seconds],gyro [dph],T_in [Celsius]"),
    "other separators": lines("time / s,gyro in deg/hr,T_in_C"),
    "comment mark": lines(f"# {HEADER}", above=["# Logger 1.2", "# Serial: 0417"]),
    "title lines": lines(above=["Chamber test FOG-0417,,", "Operator: Li; second shift", ""]),
    "row of units": lines("Time,Gyro,T in", rows=["s,deg/h,°C", *PLAIN]),
    "separator line": lines(HEADER.replace(",", ";"), semicolons(PLAIN), above=["sep=;"]),
    "separator at the end": lines(HEADER + ",", rows=[row + "," for row in PLAIN]),
    "footer": lines(below=["", "End of file", "Samples: 30", "Mean,1.0;x,"]),
    "empty rows below": lines(below=[",,", ",,"]),
    "thousands": lines(rows=[row.replace("1000.25", '"1,000.25"') for row in PLAIN]),
    "german thousands": lines(
        HEADER.replace(",", ";"),
        [f"{german(t)};{german(g)};{german(w)}" for t, g, w in zip(TIME, GYRO, INNER, strict=True)],
    ),
    "LabVIEW": labview(),
    "LabVIEW with commas": labview(","),
    "LabVIEW with decimal commas": labview(comma=True),
    "LabVIEW with a time for each channel": labview(
        names="X_Value,gyro,X_Value,T_in,Comment",
        x_columns="Multi",
        rows=["{0},{1},{0},{2}".format(*row.split(",")) for row in PLAIN],
    ),
    "quotes": lines('"time [s]","gyro [deg/h]","T_in [degC]"', [f'"{r}"'.replace(",", '","') for r in PLAIN]),
    "carriage returns": lines().replace("\n", "\r"),
    "zero bytes in fields": lines(rows=[row + "\0\0" for row in PLAIN]),
    "zero bytes at the end": lines() + "\0" * 3_000_000,
    "ISO": lines(rows=stamped(lambda m: m.isoformat(" "))),
    "ISO with a zone": lines("Timestamp,gyro_dph,T_in_C", stamped(lambda m: f"{m.isoformat()}+02:00")),
    "days first": lines(
        SHORT.replace("Time", "Date/Time"), semicolons(stamped(lambda m: f"{m:%d/%m/%Y %T.%f}"))
    ),
    "month first": lines(rows=stamped(lambda m: f"{m:%m/%d/%Y %I:%M:%S.%f %p}")),
    "time of day over midnight": lines(SHORT, semicolons(stamped(lambda m: f"{m:%H:%M:%S.%f}"))),
    "milliseconds behind a comma": lines(
        SHORT, [row.replace(";", ",", 1) for row in semicolons(stamped(thousandths))]
    ),
    "date and time": lines("Date,Time,Gyro [deg/h],T_in [°C]", TWO),
    "units of other columns": lines(
        "Time,Gyro,T in,Pressure,State", ["s,deg/h,°C,hPa,text", *(f"{row},1013,up" for row in PLAIN)]
    ),
    "form of the times": lines("Time,Gyro,T in", ["HH:MM:SS.fff,dph,degC", *stamped(lambda m: f"{m:%T.%f}")]),
    "line ends in cells": lines('"Time\n[s]","Gyro\n[deg/h]","T_in\n[°C]"', above=["Station 4"]),
    "decimal commas and commas in names": lines(
        "Time, s;Gyro, °/h;T_in, °C", [row.replace(",", ";").replace(".", ",") for row in PLAIN]
    ),
    "names in a title": lines(above=["time,gyro,operator", "12:00,FOG-0417,Li"]),
    "other names": lines("Elapsed (Sec.),Omega (deg per hour),T_in (º C)"),
    "means below": lines(below=["Mean,1.0,20.5", "Std,0.1,0.2"]),
    "minus signs": lines(rows=[f"{row},\u22121" for row in PLAIN], header=HEADER + ",T_out [degC]"),
    "months by name": lines(rows=stamped(lambda m: f"{m:%d-%b-%Y %T.%f}")),
    "ISO without marks": lines(rows=stamped(lambda m: f"{m:%Y%m%dT%H%M%S.%f}")),
    "milliseconds behind a comma among commas": lines("Time,Gyro [dph],T_in [C]", stamped(thousandths)),
    "minutes and seconds over the hour": lines(rows=stamped(lambda m: f"{m:%M:%S.%f}")),
}  # fmt: skip


def check(run):
    np.testing.assert_allclose(run.time, TIME, atol=1e-9)
    np.testing.assert_array_equal(run.gyro, GYRO)
    np.testing.assert_array_equal(run.columns["T_in"], INNER)


@pytest.mark.parametrize("kind", FILES)
def test_gives_the_plain_run(tmp_path, kind):
    path = tmp_path / "log.csv"
    path.write_bytes(FILES[kind].encode())
    check(run := read_run(path))
    said = {finding.code for finding in run.findings}
    assert ("footer" in said) == (kind in ("footer", "means below"))
    blocks = list(read_blocks(path, block_rows=7))
    np.testing.assert_allclose(np.concatenate([block.time for block in blocks]), TIME, atol=1e-9)


@pytest.mark.parametrize("encoding", ["utf-16", "utf-16-le", "utf-16-be", "utf-8-sig", "latin-1", "gb18030"])
@pytest.mark.parametrize("end", ["\n", "\r\n"])
def test_encodings(tmp_path, encoding, end):
    path = tmp_path / "log.csv"
    above = ["Größe: 3" if encoding == "latin-1" else "FOG"]
    text = lines("time [s],gyro [°/h],T_in [°C]", above=above, below=["fin"])
    path.write_bytes(text.replace("\n", end).encode(encoding))
    check(read_run(path))
    path.write_bytes(text.replace("20.5", "twenty").replace("\n", end).encode(encoding))
    with pytest.raises(InputError, match=r"log\.csv, line 7, column 'T_in': 'twenty'"):
        read_run(path)


@pytest.mark.parametrize(
    ("separator", "numbers", "right", "is_told"),
    [
        (";", ["950", "1.000", "-1.050"], [950.0, 1000.0, -1050.0], True),
        ("\t", ["950", "1,000", "1,050"], [950.0, 1000.0, 1050.0], True),
        (",", ['"950"', '"1,000"', '"1,050"'], [950.0, 1000.0, 1050.0], True),
        (",", ['"20,000"', '"20,001"', '"20,002"'], [20000.0, 20001.0, 20002.0], True),
        # A semicolon and a point don't go together, and three decimals are common.
        (";", ["20.000", "20.001", "20.002"], [20.0, 20.001, 20.002], True),
        (";", ["0.000", "20.001", "20.002"], [0.0, 20.001, 20.002], False),
        (";", ["20,000", "20,001", "20,002"], [20.0, 20.001, 20.002], False),
        (";", ["20", "20.5", "20.125"], [20.0, 20.5, 20.125], False),
    ],
)
def test_a_mark_before_three_digits(tmp_path, separator, numbers, right, is_told):
    path = tmp_path / "log.csv"
    rows = [f"{i}{separator}{number}" for i, number in enumerate(numbers)]
    path.write_text("\n".join([f"time [s]{separator}gyro [deg/h]", *rows, ""]))
    run = read_run(path)
    np.testing.assert_array_equal(run.gyro, right)
    told = [finding.message for finding in run.findings if finding.code == "marks_of_thousands"]
    assert len(told) == is_told
    assert not told or "are read as" in told[0]


def test_hours_or_minutes(tmp_path):
    path = tmp_path / "log.csv"
    path.write_text(lines(rows=[f"00:{i:02d},{row.partition(',')[2]}" for i, row in enumerate(PLAIN)]))
    with pytest.raises(InputError, match="hours and minutes, or minutes and seconds; write them"):
        read_run(path)
    # Beside a date they are hours and minutes.
    path.write_text(
        lines(rows=stamped(lambda m: f"2026-03-02 08:{round(2 * (m.second - 50) % 60):02d}")[::2])
    )
    np.testing.assert_allclose(np.diff(read_run(path).time), 120.0)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (lines("time gyro T", ["1.5 2.5 20"]), "blanks between its fields.*import log.txt --draft"),
        (
            lines(rows=[PLAIN[1].replace(".", ",")]),
            "6 fields where the header has 3.*is the comma a decimal mark",
        ),
    ],
)
def test_the_way_on(tmp_path, text, said):
    path = tmp_path / "log.txt"
    path.write_text(text)
    with pytest.raises(InputError, match=said):
        read_run(path)


def test_names_in_chinese(tmp_path):
    path = tmp_path / "log.csv"
    path.write_bytes(lines("时间 [s],陀螺 [°/h],温度 [°C]").encode("gbk"))
    np.testing.assert_array_equal(read_run(path).columns["T"], INNER)


@pytest.mark.parametrize(
    ("cells", "right"),
    [
        (["t [s]", "gyro [dps]", "t [degC]"], ("time [s]", "gyro [deg/s]", "T [degC]")),
        (["time_us", "gyro_dps", "Temperature (K)"], ("time [us]", "gyro [deg/s]", "T [K]")),
        (["Time_s", "Gyro_degph", "Tin_degC"], ("time [s]", "gyro [deg/h]", "T_in [degC]")),
        (["t_s", "gyro_degPerHour", "T_C"], ("time [s]", "gyro [deg/h]", "T [degC]")),
        (["t_s", "omega_radps", "T_C"], ("time [s]", "gyro [rad/s]", "T [degC]")),
        (
            ["时刻（秒）", "陀螺角速率（度/小时）", "光纤环内温度（摄氏度）", "转台速率（度/秒）"],
            ("time [s]", "gyro [deg/h]", "T_in [degC]", "rate [deg/s]"),
        ),
        (["Time (min)", "Gyro (mdps)", "Temp [C]"], ("time [min]", "gyro [mdeg/s]", "T [degC]")),
        (["time [s]", "gyro [dph]", "Temp [C]", "T1"], ("time [s]", "gyro [deg/h]", "Temp [degC]", "T1")),
        (["time [s]", "gyro [dph]", "Temp [C]", "T_out"], ("time [s]", "gyro [deg/h]", "T [degC]", "T_out")),
        (["IMU (left)", "B_x (G)", "vibration [g]"], ("IMU (left)", "B_x [G]", "vibration [g]")),
        (["time [s]", "GyrX (dps)", "w_y [rad/s]"], ("time [s]", "gyro_x [deg/s]", "gyro_y [rad/s]")),
        (["gyro [Hz]", "time", "T2 [℃]"], ("gyro [Hz]", "time", "T2 [degC]")),
    ],
)  # fmt: skip
def test_cells(cells, right):
    assert canonical_cells(cells) == right


@pytest.mark.parametrize(
    ("name", "unit", "value", "internal"),
    [
        ("gyro", "mdeg/s", 1.0, 3.6),
        ("gyro", "arcsec/s", 1.0, 1.0),
        ("gyro", "mrad/s", 1.0, 0.18 / np.pi * 3600),
        ("T", "degF", 212.0, 100.0),
        ("time", "day", 1.0, 86400.0),
        ("B_x", "mT", 1.0, 1000.0),
    ],
)
def test_units_that_are_not_listed(name, unit, value, internal):
    factor, offset = conversion(name, unit, "log.csv")
    assert value * factor + offset == pytest.approx(internal, rel=1e-9)


@pytest.mark.parametrize("unit", ["Hz", "m/s", "deg", "nonsense", "deg**9999999999/h", "1/h"])
def test_units_that_are_none_of_a_gyro(unit):
    with pytest.raises(InputError, match="not accepted here"):
        conversion("gyro", unit, "log.csv")


def test_when_a_recording_began(tmp_path):
    path = tmp_path / "log.csv"
    path.write_text(FILES["ISO with a zone"])
    assert read_run(path).facts.started == datetime(2026, 3, 28, 21, 59, 50, tzinfo=UTC)
    path.write_text(FILES["date and time"])
    assert read_run(path).facts.started == datetime(2026, 3, 28, 23, 59, 50)
    path.with_suffix(".yaml").write_text("started: 2026-01-01T00:00:00\n")
    assert read_run(path).facts.started == datetime(2026, 1, 1)


@pytest.mark.parametrize(
    ("text", "told"),
    [
        (lines().replace("21.125", "OVF"), r"line 11, column 'T_in': 'OVF'"),
        (FILES["ISO"].replace("23:59:55.5", "23h59"), r"line 13, column 'time'.*is no date and time"),
        (lines(rows=DAYS), "day and month"),
        (lines("Time,Gyro,T"), r"'time' states no unit; write 'time \[s\]'"),
    ],
)  # fmt: skip
def test_faults_are_named_with_their_place(tmp_path, text, told):
    path = tmp_path / "log.csv"
    path.write_text(text)
    with pytest.raises(InputError, match=told):
        read_run(path)


@pytest.mark.parametrize("sign", [b"\xb0", b"\xb0\xe4\xff"])
def test_a_footer_in_another_encoding_than_the_head_takes_no_digit_along(tmp_path, sign):
    """Bytes that are no text of the head's encoding stay as many as they are."""
    rows = "".join(f"{i},{2500 + i % 7},{i % 9 + 290}\n" for i in range(9000)).encode()
    path = tmp_path / "run.csv"
    path.write_bytes(b"time [s],gyro [deg/h],T [K]\n" + rows + b"Mean: 25 " + sign + b"C\n")
    run = read_run(path)
    np.testing.assert_allclose(run.columns["T"], np.arange(9000) % 9 + 290 - 273.15, atol=1e-9)
    assert "footer" in [finding.code for finding in run.findings]


def test_a_header_of_very_many_blanks_is_read_at_once():
    started = perf_counter()
    cells = canonical_cells(["time" + " " * 60_000 + "[s]", "a" + " " * 60_000 + "b c;"])
    assert perf_counter() - started < 1.0  # with a search from each blank it took minutes
    assert cells == ("time [s]", "a b c;")


def test_a_row_cut_short_is_no_footer(tmp_path):
    path = tmp_path / "log.csv"
    path.write_text(lines(below=["15.0"]))
    with pytest.raises(InputError, match="line 32"):
        read_run(path)


@pytest.mark.parametrize(
    ("row", "right"),
    [
        (["s", "deg/h", "as shown"], ("time [s]", "gyro [deg/h]", "place [as shown]")),
        (["s", "what it says", "as shown"], None),
    ],
)
def test_a_row_of_words_is_one_of_units_where_two_columns_accept_theirs(row, right):
    assert with_units_below(["time", "gyro", "place"], row) == right


def test_a_table_of_campbells_loggers_has_names_units_and_no_rows_of_how(tmp_path):
    """TOA5: names in its second line, units in the third, processing in the fourth."""
    head = [
        '"TOA5","CR1000","CR1000","1","CR1000.Std.32","CPU:a.CR1","5","Table1"',
        '"TIMESTAMP","RECORD","gyro","T_in"',
        '"TS","RN","deg/s","Deg C"',
        '"","","Avg","Smp"',
    ]
    rows = [
        f'"2026-03-11 08:00:{i:02d}",{i},{g},{w}' for i, (g, w) in enumerate(zip(GYRO, INNER, strict=True))
    ]
    (tmp_path / "a.dat").write_text("\n".join([*head, *rows, ""]))
    run = read_run(tmp_path / "a.dat")
    np.testing.assert_allclose(run.gyro, 3600.0 * GYRO)
    np.testing.assert_allclose(run.columns["T_in"], INNER)
    np.testing.assert_array_equal(run.time, np.arange(COUNT))
