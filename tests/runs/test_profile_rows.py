"""What import profiles say of rows, clocks, legs and logs beside a recording."""

from __future__ import annotations

from datetime import datetime, timedelta

import numpy as np
import pytest

from fogml.errors import InputError
from fogml.runs.logger_text import read_logger_text
from fogml.runs.profile_draft import draft_profile
from fogml.runs.profiles import import_recording, load_profile
from fogml.runs.reading import read_run
from tests.readers import files

COUNT = 40
TIME = np.arange(COUNT) * 0.5
BEGIN = datetime(2026, 3, 28, 23, 59, 50)
STATE = ["up" if 8 <= i < 30 else "idle" for i in range(COUNT)]
WARM = 20.0 + TIME / 4.0
HEAD = """schema: fogml.import/1
description: a bench
header_text: Omega
"""
COLUMNS = """columns:
  time: {source: [Date, Clock], unit: stamp}
  gyro: {source: Omega, unit: dph}
  T: {source: Temp, unit: ℃, missing: [-9999]}
"""


def log(warm=WARM):
    rows = ["Bench 4,operator Li", "", "Date,Clock,Omega,Temp,State,Mode,P"]
    for i, t in enumerate(TIME):
        moment = BEGIN + timedelta(seconds=t)
        rows.append(f"{moment:%d.%m.%Y},{moment:%H:%M:%S.%f},{i}.5,{warm[i]},{STATE[i]},{i // 10},{i * 2}")
    return "\n".join(rows) + "\n"


@pytest.fixture
def read(tmp_path):
    def read(profile, text=None, name="log.csv"):
        (tmp_path / "own.yaml").write_text(profile)
        if text is not None:
            (tmp_path / name).write_text(text)
        return import_recording(tmp_path / name, tmp_path / "own.yaml")

    return read


def test_header_by_text_stamps_in_two_columns_units_by_alias_and_columns_kept(read):
    (run,) = read(HEAD + COLUMNS + "keep: [P]\n", log())
    np.testing.assert_allclose(run.time, TIME, atol=1e-9)
    np.testing.assert_array_equal(run.gyro, np.arange(COUNT) + 0.5)
    np.testing.assert_array_equal(run.columns["T"], WARM)
    np.testing.assert_array_equal(run.columns["P"], 2.0 * np.arange(COUNT))
    assert run.facts.started == BEGIN


@pytest.mark.parametrize(
    ("where", "kept"),
    [
        ("{source: State, equals: up}", range(8, 30)),
        ("{source: Mode, equals: [0, 3]}", [*range(10), *range(30, 40)]),
        ("{source: P, at_least: 20, at_most: 40}", range(10, 21)),
    ],
)
def test_rows_are_chosen_and_the_others_counted(read, where, kept):
    (run,) = read(HEAD + COLUMNS + f"where: [{where}]\n", log())
    np.testing.assert_array_equal(run.gyro, np.array(kept) + 0.5)
    (finding,) = (f for f in run.findings if f.code == "rejected_rows")
    assert finding.count == COUNT - len(kept)


def test_values_that_stand_for_none(read):
    warm = WARM.copy()
    warm[[5, 6]] = -9999
    (run,) = read(HEAD + COLUMNS, log(warm))
    np.testing.assert_allclose(run.columns["T"], WARM, atol=1e-12)
    assert [f.count for f in run.findings if f.code == "sentinel"] == [2]
    # A line in time, also where rows are not evenly apart.
    profile = (
        "schema: fogml.import/1\ndescription: a bench\ncolumns:\n  time: {source: t, unit: s}\n"
        "  gyro: {source: g, unit: dph}\n  T: {source: T, unit: degC, missing: [85]}\n"
    )
    (run,) = read(profile, "t,g,T\n0,1.5,20\n1,2.5,21\n2,1.25,85\n10,2.25,30\n11,1.75,31\n")
    np.testing.assert_allclose(run.columns["T"], 20.0 + run.time)
    gyro = COLUMNS.replace("unit: dph", "unit: dph, missing: [3.5, 4.5]")
    (run,) = read(HEAD + gyro, log())
    assert len(run) == COUNT - 2


@pytest.mark.parametrize(
    "legs",
    [
        "{a: [0, 8], b: [8, 30]}",
        "{a: {from_s: 0, to_s: 4}, b: {from_s: 4, to_s: 15}}",
        "{a: {source: P, at_most: 15}, b: {source: State, equals: up}}",
    ],
)
def test_legs_by_row_time_and_state(read, legs):
    a, b = read(HEAD + COLUMNS + f"legs: {legs}\n", log())
    assert (a.name, b.name) == ("log-a", "log-b")
    np.testing.assert_array_equal(a.gyro, np.arange(8) + 0.5)
    np.testing.assert_array_equal(b.gyro, np.arange(8, 30) + 0.5)
    assert a.time[0] == b.time[0] == 0.0


JOIN = """join:
  - file: "{stem}-oven.txt"
    separator: tab
    decimal: ","
    columns:
      time: {source: When, unit: stamp}
      T_chamber: {source: Oven, unit: K}
"""


def test_a_thermometers_log_of_another_rate_is_joined_at_its_true_times(read, tmp_path):
    moments = [BEGIN + timedelta(seconds=s) for s in (-3, 7, 17, 27)]
    rows = "".join(f"{m:%Y-%m-%d %H:%M:%S}\t{300 + i},25\n" for i, m in enumerate(moments))
    with pytest.raises(InputError, match=r"log-oven\.txt: no such file beside log\.csv"):
        read(HEAD + COLUMNS + JOIN, log())
    (tmp_path / "log-oven.txt").write_text("When\tOven\n" + rows)
    (run,) = read(HEAD + COLUMNS + JOIN, log())
    right = np.interp(TIME, [-3, 7, 17, 27], 300.25 + np.arange(4) - 273.15)
    np.testing.assert_allclose(run.columns["T_chamber"], right, atol=1e-9)


def test_a_joined_log_of_another_day_or_without_dates_is_refused(read, tmp_path):
    """Its first or last value would be held all through the recording."""
    rows = "".join(f"23:59:{50 + i}\t300,25\n" for i in range(4))
    (tmp_path / "log-oven.txt").write_text("When\tOven\n" + rows)
    with pytest.raises(
        InputError, match=r"the joined log-oven\.txt covers -17746560\d\d to .* dates in both"
    ):
        read(HEAD + COLUMNS + JOIN, log())


@pytest.mark.parametrize("part_bytes", [120, 333, 1000])
@pytest.mark.parametrize(
    "changed",
    [
        lambda text: text,
        lambda text: text.replace("\n", "\r"),
        lambda text: text.replace(",idle,", ',"idle, or ""off""",').removesuffix("\n"),
        lambda text: text.replace(",3.5,", ",overload,").replace("29.03.", "# a new day\n\n29.03.", 1),
    ],
)
def test_a_text_read_in_parts_is_that_read_at_once(tmp_path, changed, part_bytes):
    more = "legs: {up: {source: State, equals: [up]}}\n"
    (tmp_path / "own.yaml").write_text(HEAD + "comment: '#'\nreject: {not_numbers: true}\n" + COLUMNS + more)
    (tmp_path / "log.csv").write_bytes(changed(log()).encode())
    profile = load_profile(tmp_path / "own.yaml")
    whole, parts = (
        read_logger_text(tmp_path / "log.csv", profile, "own", size) for size in (1 << 20, part_bytes)
    )
    assert parts.total_rows == whole.total_rows and parts.rows.tolist() == whole.rows.tolist()
    assert parts.findings == whole.findings and len(whole.rows) >= COUNT - 1
    np.testing.assert_array_equal(parts.seconds, whole.seconds)
    for source, values in {**whole.columns, **whole.texts}.items():
        np.testing.assert_array_equal({**parts.columns, **parts.texts}[source], values)


def test_columns_come_in_the_order_of_the_profile(read, tmp_path):
    """Also those of a joined log, of which the first temperature may lead."""
    names = ["T_top", "T_bottom", "T_case", "T_chamber", "T_electronics", "supply", "power", "humidity"]
    (tmp_path / "log-oven.txt").write_text(
        "t," + ",".join(names) + "\n0" + ",1" * 8 + "\n20" + ",1" * 8 + "\n"
    )
    units = ["degC"] * 5 + ["V", "W", "%"]
    joined = "".join(f"      {n}: {{source: {n}, unit: '{u}'}}\n" for n, u in zip(names, units, strict=True))
    profile = (
        "schema: fogml.import/1\ndescription: a bench\nsample_s: 0.5\ncolumns:\n"
        '  gyro: {source: g, unit: deg/h}\njoin:\n  - file: "{stem}-oven.txt"\n    columns:\n'
        "      time: {source: t, unit: s}\n" + joined
    )
    (run,) = read(profile, "g\n" + "7.5\n7.25\n" * 20)
    assert list(run.columns) == ["time", "gyro", *names]


def test_a_clock_is_repaired_where_the_profile_says_so(read):
    text = "t,w,d\n" + "".join(f"{i % 256 * 256},{i},25\n" for i in range(600))
    profile = HEAD.replace("header_text: Omega\n", "") + (
        "columns:\n  time: {source: t, unit: us}\n  gyro: {source: w, unit: deg/h}\n"
        "  T: {source: d, unit: C}\n"
    )
    with pytest.raises(InputError, match="wraps"):
        read(profile, text)
    (run,) = read(profile + "repair: true\n", text)
    assert len(run) == 600
    np.testing.assert_allclose(np.diff(run.time), 256e-6)


def test_legs_by_time_are_the_same_with_a_clock_and_with_a_sample_interval(read):
    """Counted from the first row that is kept, wherever in the file that is."""
    text = "t,g\n0.0,warming up\n0.5,warming up\n" + "".join(f"{0.5 * i},{i}\n" for i in range(2, 400))
    more = "  gyro: {source: g, unit: deg/h}\nreject: {not_numbers: true}\n"
    more += "legs: {first: {from_s: 0, to_s: 50}, second: {from_s: 50, to_s: 150}}\n"
    found = []
    for clock in ("columns:\n  time: {source: t, unit: s}\n", "sample_s: 0.5\ncolumns:\n"):
        found.append(read("schema: fogml.import/1\ndescription: a bench\n" + clock + more, text))
    for run, same in zip(*found, strict=True):
        assert run.gyro.tolist() == same.gyro.tolist() and run.time.tolist() == same.time.tolist()
    assert [len(run) for run in found[0]] == [100, 200] and found[0][0].gyro[0] == 2.0


def test_fields_of_a_container_by_group(read, tmp_path):
    files.tdms(tmp_path / "log.tdms")
    profile = (
        "schema: fogml.import/1\ndescription: bench\ncolumns:\n  time: {source: Gyro/time, unit: s}\n"
        "  gyro: {source: gyro, unit: deg/s}\n  T_case: {source: Slow/T_in, unit: degC}\n"
    )
    (run,) = read(profile, name="log.tdms")
    np.testing.assert_allclose(run.gyro, 3600.0 * files.GYRO)
    np.testing.assert_allclose(
        run.columns["T_case"], np.interp(files.TIME, files.TIME[::10], files.WARM[::10])
    )
    with pytest.raises(InputError, match=r"no column 'Fast/T'; it holds Gyro/time, Gyro/gyro"):
        read(profile.replace("Slow/T_in", "Fast/T"), name="log.tdms")


@pytest.mark.parametrize(
    ("more", "told"),
    [
        ("legs: {a: {from_s: 4, to_s: 4}}\n", "'to_s' must be later"),
        ("join: [{file: ../x, columns: {}}]\n", "a name in the recording's folder"),
        ("join: [{file: x, columns: {T: {source: a, unit: degC}}}]\n", "'time' and columns"),
        ("where: [{source: State}]\n", "key 'where': 'equals', 'at_least' or 'at_most' was expected"),
        ("legs: {a: {source: State}}\n", "key 'legs.a': 'equals', 'at_least' or 'at_most'"),
        ("where: [{source: State, equals: up, at_most: 2}]\n", "texts have no range"),
        ('keep: ["T_case [K]"]\n', "key 'keep': 'T_case' is of the run format; state it under 'columns'"),
        ('keep: ["P [bar]", "P [mbar]"]\n', "column 'P' is stated twice"),
        (JOIN.replace("T_chamber", "T"), "column 'T' is stated twice"),
        (JOIN.replace("source: Oven, ", ""), r"key 'join\.columns\.T_chamber\.source': missing"),
        (JOIN.replace("source: When, unit: stamp", "unit: s"), r"key 'join\.columns\.time\.source': missing"),
        (JOIN.replace("unit: K", "unit: s"), r"key 'join\.columns\.T_chamber\.unit': 's' is not accepted"),
        (
            JOIN.replace("unit: K", "unit: K, scale: 0"),
            r"'join\.columns\.T_chamber\.scale': 0 makes one value",
        ),
        (
            "where: [{source: State, equal: up}]\n",
            "unknown key 'where.0.equal'; did you mean 'equals'. known keys are source",
        ),
    ],
)
def test_faults_of_a_profile(tmp_path, more, told):
    path = tmp_path / "own.yaml"
    path.write_text(HEAD + COLUMNS + more)
    with pytest.raises(InputError, match=told):
        load_profile(path)


def test_values_that_stand_for_none_of_several_gyros(read):
    profile = (
        "schema: fogml.import/1\ndescription: a bench\nsample_s: 1\n"
        "columns:\n  gyro: {unit: deg/h, missing: [-9999]}\naxes: {x: Wx, y: Wy}\n"
    )
    x, y = read(profile, "Wx,Wy\n1.5,7.5\n-9999,6.5\n2.5,-9999\n3.5,5.5\n4.5,4.5\n")
    np.testing.assert_array_equal(x.gyro, [1.5, 3.5, 4.5])
    np.testing.assert_array_equal(y.gyro, [7.5, 5.5, 4.5])
    np.testing.assert_array_equal(x.time, [0.0, 3.0, 4.0])
    assert [f.count for f in x.findings if f.code == "rejected_rows"] == [1, 1]


@pytest.mark.parametrize(
    ("more", "rows"),
    [
        ("where: [{source: State, equals: up}]\n", [8]),
        ("legs: {a: {from_s: 1, to_s: 6}, b: {source: State, equals: up}}\n", [2, 8]),
        ("facts: {started: 2026-03-28T12:00:00}\nwhere: [{source: State, equals: up}]\n", None),
    ],
)
def test_a_run_started_when_its_first_row_did(read, more, rows):
    runs = read(HEAD + COLUMNS + more, log())
    stated = [datetime(2026, 3, 28, 12)] if rows is None else [BEGIN + timedelta(seconds=i / 2) for i in rows]
    assert [run.facts.started for run in runs] == stated


def test_two_columns_of_dates_are_not_added_up(read, tmp_path):
    rows = "".join(f"2026-03-02 0{7 + i // 2}:00:00,2026-03-02 08:00:{i:02d},{i}.5\n" for i in range(4))
    columns = "columns:\n  time: {source: [UTC, Local], unit: stamp}\n  gyro: {source: Omega, unit: dph}\n"
    with pytest.raises(InputError, match=r"column 'UTC', 'Local': .* no date in one, time of day in"):
        read(HEAD + columns, "UTC,Local,Omega\n" + rows)


def test_a_joined_log_of_a_part_of_the_recording_is_said(read, tmp_path):
    """What is held before its first value and after its last looks like a soak."""
    moments = [BEGIN + timedelta(seconds=s) for s in (5, 6, 7, 8)]
    rows = "".join(f"{m:%Y-%m-%d %H:%M:%S}\t{300 + i},25\n" for i, m in enumerate(moments))
    (tmp_path / "log-oven.txt").write_text("When\tOven\n" + rows)
    (run,) = read(HEAD + COLUMNS + JOIN, log())
    (told,) = (f.message for f in run.findings if f.code == "held_beyond")
    assert told.startswith("'T_chamber' is not known 5.00 s before its first value and 11.5 s after its last")


def test_a_slower_group_of_a_container_of_a_part_of_the_recording_is_said(tmp_path):
    nptdms = pytest.importorskip("nptdms")
    clock = {"wf_start_time": np.datetime64(files.START_S, "s"), "wf_start_offset": 0.0}
    fast, slow = ({**clock, "wf_increment": step} for step in (0.25, 2.5))
    with nptdms.TdmsWriter(str(tmp_path / "log.tdms")) as writer:
        writer.write_segment(
            [
                nptdms.ChannelObject("Gyro", "gyro", files.GYRO, properties={"unit_string": "deg/h", **fast}),
                nptdms.ChannelObject(
                    "Slow", "T", files.WARM[:40:10], properties={"unit_string": "°C", **slow}
                ),
            ]
        )
    (tmp_path / "own.yaml").write_text(
        "schema: fogml.import/1\ndescription: bench\ncolumns:\n  time: {source: Gyro/time, unit: s}\n"
        "  gyro: {source: gyro, unit: deg/h}\n  T: {source: Slow/T, unit: degC}\n"
    )
    runs = [read_run(tmp_path / "log.tdms"), *import_recording(tmp_path / "log.tdms", tmp_path / "own.yaml")]
    for run in runs:
        (told,) = (f.message for f in run.findings if f.code == "held_beyond")
        assert told.startswith("'T' is not known 22.2 s after its last:")


def test_a_column_of_another_rate_that_ends_early_is_said(tmp_path):
    rows = "".join(f"{i},{i % 7},{20 + i / 10 if i % 5 == 0 and i < 50 else ''}\n" for i in range(100))
    (tmp_path / "run.csv").write_text("time [s],gyro [deg/h],T [degC]\n" + rows)
    (told,) = (f.message for f in read_run(tmp_path / "run.csv").findings if f.code == "held_beyond")
    assert told.startswith("'T' is not known 54.0 s after its last:")


@pytest.mark.parametrize("clock", ["time: {source: t, unit: s}", "time: {source: s, unit: stamp}"])
def test_a_leg_was_switched_on_with_its_recording(read, clock):
    text = "t,s,w\n" + "".join(f"{500 + i},08:00:{i:02d},{7 + i % 3}.5\n" for i in range(40))
    profile = (
        "schema: fogml.import/1\ndescription: a bench\ncolumns:\n  gyro: {source: w, unit: deg/h}\n"
        f"  {clock}\n"
        "legs: {a: [0, 10], b: [10, 40]}\nfacts: {powered_on: -5.0}\n"
    )
    assert [run.facts.powered_on for run in read(profile, text)] == [-5.0, -15.0]


def of_bench(path, name, rows):
    (path / name).write_text("\n".join(rows) + "\n")


@pytest.mark.parametrize("units", ["dd.mm.yyyy,hh:mm:ss,deg/h,°C", ",,deg/h,°C"])
def test_a_row_of_units_above_dates_is_left_out(tmp_path, units):
    rows = [f"2026-03-13,08:00:{i:02d},{9.5 + i},{20.5 + i}" for i in range(40)]
    of_bench(tmp_path, "log.csv", ["Bench 3,,,", "Date,Time,Gyro,Oven", units, *rows])
    (tmp_path / "profile.yaml").write_text(draft_profile(tmp_path / "log.csv"))
    (run,) = import_recording(tmp_path / "log.csv", tmp_path / "profile.yaml")
    np.testing.assert_allclose(run.time, np.arange(40), atol=1e-9)
    np.testing.assert_allclose(run.gyro, 9.5 + np.arange(40))
    np.testing.assert_allclose(run.columns["T"], 20.5 + np.arange(40))
    assert str(run.facts.started).startswith("2026-03-13 08:00:00")


def test_a_joined_log_in_local_time_is_no_hour_late(tmp_path):
    """An oven that shows Central European Time beside a gyro in UTC, by its temperature in each minute."""
    gyro = [f"2026-03-13T07:{i // 60:02d}:{i % 60:02d}Z,{9.5 + i}" for i in range(600)]
    of_bench(tmp_path, "run.csv", ["When,Gyro [deg/h]", *gyro])
    oven = [f"2026-03-13 {6 + i // 60:02d}:{i % 60:02d}:00,{i}" for i in range(240)]
    of_bench(tmp_path, "run-oven.csv", ["When,Oven", *oven])
    profile = """schema: fogml.import/1
description: bench
separator: comma
columns: {time: {source: When, unit: stamp}, gyro: {source: "Gyro [deg/h]", unit: deg/h}}
join:
  - file: "{stem}-oven.csv"
    separator: comma
    columns: {time: {source: When, unit: stamp}, T_chamber: {source: Oven, unit: degC}}
"""
    (tmp_path / "profile.yaml").write_text(profile)
    with pytest.raises(InputError, match=r"run-oven.csv: stamps of run.csv state their zone and those of"):
        import_recording(tmp_path / "run.csv", tmp_path / "profile.yaml")
    (tmp_path / "profile.yaml").write_text(profile + "    offset_s: -3600\n")
    (run,) = import_recording(tmp_path / "run.csv", tmp_path / "profile.yaml")
    # At 07:00 UTC the oven's clock shows 08:00, two hours after its log began.
    np.testing.assert_allclose(run.columns["T_chamber"], 120.0 + np.arange(600) / 60.0, atol=1e-9)


@pytest.mark.parametrize("other", ["9.850", "1.009.850"])
def test_a_mark_of_thousands_without_decimals_beside_decimals_is_no_number(tmp_path, other):
    """Of a file that two programs wrote: 9.850 beside 9,604 was read as 9850, without a word."""
    rows = [f"{i};{9 + i % 3},{600 + i};25" for i in range(COUNT)]
    rows[20] = f"20;{other};25"
    (tmp_path / "a.csv").write_text("\n".join(["t;w;T", *rows, ""]))
    text = "columns:\n  time: {source: t, unit: s}\n  gyro: {source: w, unit: deg/h}\n"
    (tmp_path / "p.yaml").write_text(
        f'schema: fogml.import/1\ndescription: d\nseparator: semicolon\ndecimal: ","\n{text}'
    )
    with pytest.raises(InputError, match=f"line 22, column 'w': '{other}' is no number"):
        import_recording(tmp_path / "a.csv", load_profile(tmp_path / "p.yaml"))
    (tmp_path / "a.csv").write_text((tmp_path / "a.csv").read_text().replace(other, "1.009,850"))
    (run,) = import_recording(tmp_path / "a.csv", load_profile(tmp_path / "p.yaml"))
    assert run.gyro[20] == 1009.85
