"""Ways of writing dates and times of day: each is read as the calendar has it, or told as open."""

from __future__ import annotations

from datetime import datetime, timedelta

import numpy as np
import pytest

from fogml.errors import InputError
from fogml.runs.profile_draft import draft_profile
from fogml.runs.profiles import import_recording, load_profile
from fogml.runs.reading import read_run

COUNT = 90
PROFILE = """schema: fogml.import/1
description: d
columns:
  time: {{source: {}, unit: stamp}}
  gyro: {{source: w, unit: deg/h}}
"""


def log(path, texts, header="time,gyro [deg/h],T [degC]"):
    rows = [f"{text},{9.5 + i * i % 37},20.5" for i, text in enumerate(texts)]
    path.write_text("\n".join([header, *rows, ""]), encoding="utf-8")
    return path


def moments(start, step_s=1.0):
    return [start + timedelta(seconds=step_s * i) for i in range(COUNT)]


NOON = datetime(2026, 3, 11, 11, 59, 10)


@pytest.mark.parametrize(
    "written",
    [
        lambda at: at.strftime("%m/%d/%Y %I:%M:%S ") + ("a.m." if at.hour < 12 else "p.m."),
        lambda at: at.strftime("%m/%d/%Y %I:%M:%S\u202f") + ("a.\u00a0m." if at.hour < 12 else "p.\u00a0m."),
        lambda at: at.strftime("%Y-%m-%d %I:%M:%S\u202f%p"),
        lambda at: at.strftime("%Y/%m/%d ") + ("上午" if at.hour < 12 else "下午") + at.strftime(" %I:%M:%S"),
        lambda at: ("오전" if at.hour < 12 else "오후") + at.strftime(" %I:%M:%S"),
        lambda at: at.strftime("%Y:%j:%H:%M:%S.%f"),
        lambda at: at.strftime("%Y-%jT%H:%M:%SZ"),
        lambda at: at.strftime("%Y-%m-%d %H:%M:%S+01"),
        lambda at: at.strftime("%Y-%m-%d %H:%M:%S GMT+0800"),
        lambda at: at.strftime("%Y-%m-%d %H:%M:%S CET"),
        lambda at: at.strftime("%Y年%m月%d日 %H时%M分%S秒"),
        lambda at: at.strftime("11. Mrz %Y %H:%M:%S Uhr"),
        lambda at: at.strftime("%a %b %d %H:%M:%S %Y"),
        lambda at: at.strftime("%b %d %Y %H:%M:%S.%f"),
    ],
)
def test_is_read_over_noon(tmp_path, written):
    path = log(tmp_path / "a.csv", map(written, moments(NOON)))
    np.testing.assert_array_equal(read_run(path).time, np.arange(COUNT))
    drafted = tmp_path / "p.yaml"
    drafted.write_text(draft_profile(path), encoding="utf-8")
    assert "unit: stamp}\n" in drafted.read_text(encoding="utf-8")
    (run,) = import_recording(path, load_profile(drafted))
    np.testing.assert_array_equal(run.time, np.arange(COUNT))


def test_clocks_of_zones_go_on_where_summer_time_begins(tmp_path):
    utc = moments(datetime(2026, 3, 29, 0, 59, 30))
    spring = datetime(2026, 3, 29, 1)
    zones = [("CEST", 2) if at >= spring else ("CET", 1) for at in utc]
    texts = [
        f"{at + timedelta(hours=h):%Y-%m-%d %H:%M:%S} {z}" for at, (z, h) in zip(utc, zones, strict=True)
    ]
    run = read_run(log(tmp_path / "a.csv", texts))
    np.testing.assert_array_equal(run.time, np.arange(COUNT))
    assert run.facts.started.isoformat() == "2026-03-29T00:59:30+00:00"


@pytest.mark.parametrize(("mark", "step_ms"), [(".", 50), (",", 30), (":", 70), (".", 1010)])
def test_milliseconds_without_zeros_before_them_are_no_decimals(tmp_path, mark, step_ms):
    """As C# and Basic put numbers together: 08:00:00.50 is 50 ms after eight."""
    ms = step_ms * np.arange(COUNT)
    texts = [f"08:{v // 60000:02d}:{v // 1000 % 60:02d}{mark}{v % 1000}" for v in ms.tolist()]
    header = "time;gyro [deg/h];T [degC]" if mark == "," else "time,gyro [deg/h],T [degC]"
    path = log(tmp_path / "a.csv", texts, header)
    if mark == ",":
        rows = path.read_text().splitlines()
        path.write_text("\n".join([rows[0], *(";".join(row.rsplit(",", 2)) for row in rows[1:]), ""]))
    np.testing.assert_allclose(read_run(path).time, 1e-3 * ms, atol=1e-9)


@pytest.mark.parametrize(
    "texts",
    [
        [f"08:00:{i:02d}.{'5' if i % 2 else '25'}" for i in range(60)],  # zeros at the end left out
        [f"08:00:{i:02d}.{'500' if i % 2 else '250100'}" for i in range(60)],  # as Java writes an instant
        [f"08:00:{i:02d}.{i % 2 * 50 + 25:03d}" for i in range(60)],
    ],
)
def test_decimals_of_a_second_are_decimals(tmp_path, texts):
    expected = np.array([int(text[6:8]) + float(f"0{text[8:]}") for text in texts])
    np.testing.assert_allclose(
        read_run(log(tmp_path / "a.csv", texts)).time, expected - expected[0], atol=1e-9
    )


@pytest.mark.parametrize(
    ("texts", "said"),
    [
        ([f"0:23:{i // 60:02d}:{i % 60:02d}" for i in range(COUNT)], "four numbers with colons"),
        ([f"08:00:{i:02d}.{i % 12 * 5}" for i in range(60)], "parts of a second such as"),
    ],
)
def test_what_nobody_can_tell_is_refused(tmp_path, texts, said):
    with pytest.raises(InputError, match=said):
        read_run(log(tmp_path / "a.csv", texts))


def test_hundredths_behind_a_colon_are_read(tmp_path):
    texts = [f"08:00:{i // 4:02d}:{i % 4 * 25:02d}" for i in range(COUNT)]
    np.testing.assert_allclose(read_run(log(tmp_path / "a.csv", texts)).time, 0.25 * np.arange(COUNT))


@pytest.mark.parametrize(
    ("start", "form", "began"),
    [
        (datetime(2026, 3, 11, 23, 59, 30), "%y-%m-%d %H:%M:%S", 2026),  # the last changes over midnight
        (datetime(2026, 3, 28, 23, 59, 30), "%d/%m/%y %H:%M:%S", 2026),  # the first does
        (datetime(2026, 3, 11, 8), "%y-%m-%d %H:%M:%S", None),  # 2026-03-11, or 26 March 2011
        (datetime(2026, 3, 11, 8), "%d.%m.%y %H:%M:%S", 2026),
        (datetime(1999, 3, 11, 8), "%d-%b-%Y %H:%M:%S", 1999),
    ],
)
def test_years_of_two_digits(tmp_path, start, form, began):
    run = read_run(log(tmp_path / "a.csv", (at.strftime(form) for at in moments(start))))
    np.testing.assert_array_equal(run.time, np.arange(COUNT))
    assert (run.facts.started.year if run.facts.started else None) == began


@pytest.mark.parametrize(("form", "is_read"), [("%d/%m/%y %H:%M:%S", True), ("%y-%m-%d %H:%M:%S", False)])
def test_a_date_that_changes_late_tells_whether_it_was_read_aright(tmp_path, monkeypatch, form, is_read):
    monkeypatch.setattr("fogml.runs.stamps._FIRST_ROWS", 10)
    path = log(tmp_path / "a.csv", (at.strftime(form) for at in moments(datetime(2026, 3, 26, 23, 59, 15))))
    if is_read:
        np.testing.assert_array_equal(read_run(path).time, np.arange(COUNT))
    else:
        with pytest.raises(InputError, match="day and year of the dates can't be told apart"):
            read_run(path)


@pytest.mark.parametrize(
    ("source", "form"),
    [("utc", "%H%M%S.%f"), ("utc", "%Y%m%d%H%M%S"), ("[day, utc]", "%Y%m%d,%H%M%S")],
)
def test_a_profile_reads_times_in_digits_over_midnight(tmp_path, source, form):
    """As NMEA writes them; by themselves they are numbers to every command."""
    texts = (at.strftime(form) for at in moments(datetime(2026, 3, 11, 23, 59, 15)))
    path = log(tmp_path / "a.csv", texts, "day,utc,w,T" if "day" in source else "utc,w,T")
    (tmp_path / "p.yaml").write_text(PROFILE.format(source))
    (run,) = import_recording(path, load_profile(tmp_path / "p.yaml"))
    np.testing.assert_array_equal(run.time, np.arange(COUNT))


def test_a_draft_takes_times_in_digits_for_stamps_and_plain_numbers_for_none(tmp_path):
    digits = log(
        tmp_path / "a.csv", (at.strftime("%H%M%S.00") for at in moments(datetime(2026, 3, 11, 8))), "utc,w,T"
    )
    assert "time: {source: utc, unit: stamp}    # GUESS" in draft_profile(digits)
    for first in ("100000", "000000"):
        plain = log(tmp_path / "b.csv", (f"{int(first) + i:06d}" for i in range(COUNT)), "time,w,T")
        assert "time: {source: time, unit: s}" in draft_profile(plain)
    wrong = log(tmp_path / "c.csv", [*(f"0801{i:02d}" for i in range(60)), "086100"], "utc,w,T")
    (tmp_path / "p.yaml").write_text(PROFILE.format("utc"))
    with pytest.raises(InputError, match=r"line 62, column 'utc': '086100' is no date and time"):
        import_recording(wrong, load_profile(tmp_path / "p.yaml"))


@pytest.mark.parametrize("step_ms", [250, 1010])
@pytest.mark.parametrize("header", ["Date,Time,ms", "Date,Time,Millisecond", "Timestamp,msec"])
def test_milliseconds_in_a_column_of_their_own_belong_to_the_clock(tmp_path, header, step_ms):
    """At a sample a second they were left aside, and times up to 1 s off."""
    at = [datetime(2026, 3, 11, 8) + timedelta(milliseconds=5 + step_ms * i) for i in range(COUNT)]
    form = "%d.%m.%Y,%H:%M:%S," if "Date" in header else "%Y-%m-%d %H:%M:%S,"
    texts = [moment.strftime(form) + str(moment.microsecond // 1000) for moment in at]
    path = log(tmp_path / "a.csv", texts, f"{header},gyro [deg/h],T [degC]")
    run = read_run(path)
    np.testing.assert_allclose(run.time, 1e-3 * step_ms * np.arange(COUNT), atol=1e-9)
    assert run.facts.started == at[0]
    (tmp_path / "p.yaml").write_text(draft_profile(path))
    (run,) = import_recording(path, load_profile(tmp_path / "p.yaml"))
    np.testing.assert_allclose(run.time, 1e-3 * step_ms * np.arange(COUNT), atol=1e-9)
    texts[40] += "x"
    with pytest.raises(InputError, match="line 42, column 'time"):
        read_run(log(tmp_path / "b.csv", texts, f"{header},gyro [deg/h],T [degC]"))
    with pytest.raises(InputError, match="line 42, column"):
        import_recording(tmp_path / "b.csv", load_profile(tmp_path / "p.yaml"))


def test_a_count_of_milliseconds_that_goes_on_is_no_part_of_a_second(tmp_path):
    texts = [f"08:00:{i // 1000:02d},{i}" for i in range(1400)]
    with pytest.raises(InputError, match="column 'time', line 1002: the value is missing"):
        read_run(log(tmp_path / "a.csv", texts, "Time,ms,gyro [deg/h],T [degC]"))


def test_decimals_of_seconds_in_a_column_of_their_own_belong_to_the_clock(tmp_path):
    """As Yokogawa's recorders write them, with a row of units below."""
    rows = [
        f"2026/03/11,08:00:{i // 2:02d},{'.500' if i % 2 else '.000'},{9.5 + i * i % 37},20"
        for i in range(COUNT)
    ]
    path = tmp_path / "a.csv"
    path.write_text("\n".join(["Date,Time,Sec,Gyro,CH2", ",,,deg/h,C", *rows, ""]))
    np.testing.assert_allclose(read_run(path).time, 0.5 * np.arange(COUNT))
    (tmp_path / "p.yaml").write_text(draft_profile(path))
    (run,) = import_recording(path, load_profile(tmp_path / "p.yaml"))
    np.testing.assert_allclose(run.time, 0.5 * np.arange(COUNT))


def test_every_german_month_is_its_own(tmp_path):
    names = ["Jan", "Feb", "Mrz", "Apr", "Mai", "Jun", "Jul", "Aug", "Sep", "Okt", "Nov", "Dez"]
    texts = [f"1. {name} 2026 00:00:00" for name in names]
    days = np.cumsum([0, 31, 28, 31, 30, 31, 30, 31, 31, 30, 31, 30])
    np.testing.assert_array_equal(read_run(log(tmp_path / "a.csv", texts)).time, 86400.0 * days)


def test_a_gyro_without_zeros_before_the_point_is_no_part_of_a_second(tmp_path):
    rows = [f"08:00:{i:02d},.{500 + i},20" for i in range(60)]
    path = tmp_path / "a.csv"
    path.write_text("\n".join(["time,gyro [deg/h],T [degC]", *rows, ""]))
    (tmp_path / "p.yaml").write_text(draft_profile(path))
    for run in (read_run(path), *import_recording(path, load_profile(tmp_path / "p.yaml"))):
        np.testing.assert_array_equal(run.time, np.arange(60))
        np.testing.assert_allclose(run.gyro, 0.5 + 0.001 * np.arange(60))
