"""Loggers' files by import profile: right values, counted rejects, and every wrong file refused."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fogml.errors import InputError
from fogml.runs.profile_schema import PROFILE_FOLDER, ImportProfile
from fogml.runs.profiles import import_recording, load_profile, profile_names

ROOT = Path(__file__).parents[2]

COLD_START = """Ax,Gx,Gy ,Gz,dTemp, Temp ,Time
6,8,-4,-19,-8884,8.58,17139
-4,9,-2,-21,-8881,9.26,17152
0,8,-4,-21,-8886,9.26,17168
10,8,-5,-20,-8877,9.31,20000
"""
TERMINAL = """=~=~= PuTTY log 2026.05.08 15:24:01 =~=~=
0,0.003,-0.032,0.73,0.12,-1.10
49.353516,0.250,0.003,-0.032,0.31,-0.31,0.00
49.341797,0.251,0.003,-0.033,0.18,-0.85,0.12
49.308594,047.306641,0.248,0.026,-0.029,0.31,-0.18,0.06
47.318359,0.249,0.027,-0.029,0.49,-0.31,-0.55
47.269531,0.249,0.027,-0.029,0.31,0.12,0.00
47.292969,0.248,0.026,-0.029,0.06,-0.3-0.31,-0.18
47.294922,0.248,0.027,-0.029,0.37,-0.24,-0.18
47.267578,0.249,0.026,-0.029,0.43,-0.06,-0.24
4"""
PSINS = """% PSINS-format SIMU log file. (DO NOT EDIT!)
% latitude0(°), by a station at 34°

0.0 0.0 -90.6 0.0 0.0 0.0
34.246 108.9 380.0 0.0 10.0 9.78
0.1 0.1 0.1 125.0 125.0 125.0\x20
0 0 2 0 0 80
2 -1 7   0 0 80
-4 3 -12\t0 2 80
"""
THERMAL_HEADER = "timestamp\timu.gyro.x\timu.gyro.y\timu.gyro.z\timu.acc.x\timu.status\timu.temperature"


def thermal(rows: int) -> str:
    lines = [
        f"{505_697 * i}\t-0.07{i % 7}\t0.0156\t0.0228\t0.15\t0\t{52 - 0.01 * i:.4f}" for i in range(rows)
    ]
    lines[0] = "0\t-0.0471\t0.0155\t0.0225\t0.17\t0\t51.6"
    return "\n".join([THERMAL_HEADER, *lines]) + "\n"


MINIATURES = {
    "cold-start-mpu6050": COLD_START.encode(),
    "two-temperatures-bmi270": TERMINAL.encode(),
    "ring-laser-static": PSINS.encode("latin-1"),
    "thermal-cycle-mems": thermal(8400).encode(),
}

LOGGER = """
schema: fogml.import/1
description: a logger of one's own
separator: semicolon
decimal: ","
columns:
  time: {source: t, unit: ms}
  gyro: {source: rate, unit: deg/s}
  T: {source: temp, unit: K}
"""


@pytest.fixture
def write(tmp_path):
    def put(name: str, content: str | bytes) -> Path:
        path = tmp_path / name
        path.write_bytes(content if isinstance(content, bytes) else content.encode())
        return path

    return put


def counts(run) -> dict[str, int]:
    return {f.message: f.count for f in run.findings if f.code == "rejected_rows"}


def test_the_profiles_that_ship_load_and_are_linked_from_configs():
    assert set(profile_names()) == set(MINIATURES)
    for name in profile_names():
        assert "fibre-optic gyro" in " ".join(load_profile(name).notes)
    link = ROOT / "configs" / "import"
    assert link.is_symlink()
    assert not link.readlink().is_absolute()
    assert link.resolve() == PROFILE_FOLDER.resolve()


def test_cold_start(write):
    runs = import_recording(write("log.csv", COLD_START), "cold-start-mpu6050")
    assert [run.name for run in runs] == ["log-x", "log-y", "log-z"]
    x = runs[0]
    assert x.time == pytest.approx([0, 0.013, 0.029, 2.861], abs=1e-12)
    assert x.gyro == pytest.approx(np.array([8, 9, 8, 8]) / 16.4 * 3600)
    assert x.temperature("T") == pytest.approx(np.array([-8884, -8881, -8886, -8877]) / 340 + 36.53)
    assert x.columns["T_case"] == pytest.approx([8.58, 9.26, 9.26, 9.31])
    assert runs[2].gyro[0] == pytest.approx(-19 / 16.4 * 3600)
    assert len(x.stretches) == 2
    assert x.facts.axis == "x"


def test_terminal_log_counts_what_it_rejects_and_keeps_their_time(write):
    (y,) = import_recording(write("hot.csv", TERMINAL), "two-temperatures-bmi270", axis="y")
    assert y.name == "hot-y"
    assert y.temperature("T") == pytest.approx([47.318359, 47.269531, 47.294922, 47.267578])
    assert y.gyro == pytest.approx(3600 * np.array([-0.31, 0.12, -0.24, -0.06]))
    assert y.time == pytest.approx([0, 0.02, 0.06, 0.08])  # the rejected row keeps its place
    assert sorted(counts(y).values()) == [1, 2, 3]
    assert sum(counts(y).values()) + len(y) == 10
    assert "50 Hz is assumed" in y.facts.notes


def test_ring_laser(write):
    runs = import_recording(write("rlg.imu", PSINS.encode("latin-1")), "ring-laser-static")
    assert [run.gyro.tolist() for run in runs] == [[0, 20, -40], [0, -10, 30], [20, 70, -120]]
    assert runs[0].time == pytest.approx([0, 0.01, 0.02])
    assert runs[0].facts.latitude == 34.246
    assert not runs[0].earth_known
    assert runs[2].facts.earth_rate_deg_h == pytest.approx(15.041067 * np.sin(np.radians(34.246)))


def test_thermal_cycle_is_cut_into_legs_with_a_clock_of_their_own(write):
    runs = import_recording(write("imu.csv", thermal(8400)), "thermal-cycle-mems", axis="x")
    assert [run.name for run in runs] == ["imu-1-x", "imu-2-x", "imu-3-x"]
    assert [len(run) for run in runs] == [2687, 3502, 2206]
    for run, first in zip(runs, (5, 2692, 6194)):
        assert run.time == pytest.approx(0.5057 * np.arange(len(run)))
        assert run.temperature("T")[0] == pytest.approx(52 - 0.01 * first)
        assert "clock cannot be trusted" in run.facts.notes
        assert sum(counts(run).values()) == 5
    assert runs[0].gyro[0] == pytest.approx(-0.075 * 3600)


def test_a_first_row_that_is_no_outlier_stays(write):
    text = thermal(8400).replace("-0.0471", "-0.0702")
    run = import_recording(write("imu.csv", text), "thermal-cycle-mems", axis="z")[0]
    assert list(counts(run).values()) == [5]


@pytest.mark.parametrize("profile", sorted(MINIATURES))
@pytest.mark.parametrize("file", sorted(MINIATURES))
def test_a_file_of_another_logger_is_refused(write, profile, file):
    path = write("recording.txt", MINIATURES[file])
    if profile == file:
        assert import_recording(path, profile)
        return
    with pytest.raises(InputError, match=r"recording\.txt"):
        import_recording(path, profile)


@pytest.mark.parametrize("profile", sorted(MINIATURES))
@pytest.mark.parametrize(
    "content",
    [b"", b"  \n\n", bytes(range(256)) * 40, b"PK\x03\x04" + bytes(500), b"%\n", b"a,b\n"],
)
def test_no_recording_at_all_is_refused(write, profile, content):
    with pytest.raises(InputError, match=r"nothing\.bin"):
        import_recording(write("nothing.bin", content), profile)


def test_a_missing_file_and_a_folder_are_refused(tmp_path):
    for path, told in ((tmp_path / "absent.csv", "no such file"), (tmp_path, "is a folder")):
        with pytest.raises(InputError, match=told):
            import_recording(path, "cold-start-mpu6050")


def test_a_recording_shorter_than_the_legs_is_refused(write):
    with pytest.raises(InputError, match=r"imu.csv: leg '2' ends at row 6194, the file has only 3000"):
        import_recording(write("imu.csv", thermal(3000)), "thermal-cycle-mems")


def test_an_unknown_axis_lists_the_known(write):
    with pytest.raises(InputError, match=r"axis 'w'.*x, y, z"):
        import_recording(write("log.csv", COLD_START), "cold-start-mpu6050", axis="w")


def test_a_missing_column_lists_those_there(write):
    with pytest.raises(InputError, match=r"log.csv: no column 'Gy'; the header holds Ax, Gx"):
        import_recording(write("log.csv", COLD_START.replace("Gy ", "rate")), "cold-start-mpu6050")


@pytest.mark.parametrize(
    ("row", "message"),
    [
        ("1,2,3", "7 fields were expected, line 6 has 3"),
        ("1,2,3,4,five,6,30000", "line 6, column 'dTemp': 'five' is no number"),
        ("1,2,3,4,,6,30000", "line 6, column 'dTemp': empty, a number was expected"),
        ("1,2,3,4,5,6,20000", "column 'time', data row 5: time repeats; .*--repair drops the repeats"),
        ("1,2,3,4,5,6,19000", "column 'time', data row 5: time goes back; .*--repair makes each leg"),
    ],
)
def test_a_faulty_row_that_the_profile_does_not_reject_is_an_error(write, row, message):
    with pytest.raises(InputError, match=message):
        import_recording(write("log.csv", COLD_START + row + "\n"), "cold-start-mpu6050")


def test_a_log_of_mostly_faulty_rows_is_refused(write):
    with pytest.raises(InputError, match="7 fields were expected"):
        import_recording(write("hot.csv", TERMINAL + "\n1\n" * 20), "two-temperatures-bmi270")


def test_own_profile_with_decimal_comma_and_kelvin(write):
    profile = write("logger.yaml", LOGGER)
    file = write("day.csv", "t;rate;temp\r\n0;0,5;300,15\r\n1000;-0,25;310\r\n2500;1e-3;320,65")
    (run,) = import_recording(file, profile)
    assert run.name == "day"
    assert run.time.tolist() == [0.0, 1.0, 2.5]
    assert run.gyro == pytest.approx([1800.0, -900.0, 3.6])
    assert run.temperature() == pytest.approx([27.0, 36.85, 47.5])
    assert run.facts.axis is None


def test_a_side_file_overrides_the_profile(write):
    profile = write("logger.yaml", LOGGER + "facts: {unit: A, latitude: 10}\nnotes: [From the lab.]\n")
    file = write("day.csv", "t;rate;temp\n0;0,5;300,15\n1000;0;300\n")
    write("day.yaml", "unit: FOG-0417\ninput_axis: up\nnotes: Second try.\n")
    (run,) = import_recording(file, profile)
    assert run.facts.unit == "FOG-0417"
    assert run.facts.latitude == 10
    assert run.earth_known
    assert run.facts.notes == "From the lab. Second try."


def test_counts_stay_counts(write):
    text = LOGGER.replace("unit: deg/s", "unit: count") + "facts: {scale_factor: {value: 2.0}}\n"
    file = write("day.csv", "t;rate;temp\n0;5;300\n1000;7;300\n")
    (run,) = import_recording(file, write("logger.yaml", text))
    assert run.gyro_unit == "count"
    assert run.gyro.tolist() == [5.0, 7.0]
    assert run.gyro_deg_h.tolist() == [2.5, 3.5]


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (
            "colums: {}\n",
            r"unknown key 'colums'; did you mean 'columns'\? known keys are schema, description",
        ),
        ("reject: {short: true}\n", r"unknown key 'reject.short'; known keys are wrong_field_count"),
        ("facts: {serial: 3}\n", r"unknown key 'facts.serial'; known keys are unit, axis"),
        ("sample_s: 0.1\n", r"either a column 'time' or 'sample_s'"),
        ("axes: {x: a}\n", r"columns.gyro.source"),
        ("legs: {'1': [5, 5]}\n", r"key 'legs.1'"),
        ("encoding: utf-99\n", r"no text encoding is called 'utf-99'"),
        ("header: false\n", r"key 'fields'"),
        ("header: false\nfields: 3\n", r"given by position"),
        ("axis_facts: {q: {}}\n", r"axis_facts.q"),
        ("separator: pipe\n", r"key 'separator'"),
        ("sample_s: [1\n", r"line \d+, column \d+: not readable as YAML"),
    ],
)
def test_a_faulty_profile_names_file_and_key(write, change, message):
    base = LOGGER.replace("separator: semicolon\n", "") if change.startswith("separator") else LOGGER
    with pytest.raises(InputError, match=r"logger\.yaml") as error:
        load_profile(write("logger.yaml", base + change))
    assert re.search(message, str(error.value)), str(error.value)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("unit: deg/s", "unit: rpm", r"columns.gyro.unit': 'rpm' is not accepted; accepted units are deg/h"),
        ("unit: deg/s", "unit: deg/s, scale: 1/0", r"columns.gyro.scale"),
        (
            "unit: deg/s",
            "unit: deg/s, factor: 2",
            r"'columns.gyro.factor'; known keys are source",
        ),
        ("  T:", "  temperature:", r"columns.temperature': not a column of the run format"),
        ("  gyro: {source: rate, unit: deg/s}\n", "", r"always needs 'gyro'"),
        ("source: temp, ", "", r"columns.T.source': missing"),
        ("schema: fogml.import/1", "schema: fogml.import/9", "of a newer fogml"),
        ("description: a logger of one's own\n", "", r"key 'description' is missing"),
    ],
)
def test_a_faulty_entry_names_its_key(write, old, new, message):
    with pytest.raises(InputError, match=message):
        load_profile(write("logger.yaml", LOGGER.replace(old, new)))


def test_an_unknown_profile_lists_the_known(write):
    with pytest.raises(InputError, match="ring-laser-static"):
        load_profile("ring-lazer")


VALUES = st.lists(st.tuples(*[st.floats(-1e6, 1e6, allow_nan=False, width=32)] * 2), min_size=3, max_size=30)
GARBAGE = st.sampled_from(["1", "a,b,c,d", "", "   ", "# note", "1,2,3,4,5", "#"])


@settings(max_examples=60, deadline=None)
@given(
    values=VALUES, garbage=st.lists(st.tuples(st.integers(0, 30), GARBAGE), max_size=3), crlf=st.booleans()
)
def test_numbers_come_back_to_the_last_digit_among_garbage(tmp_path_factory, values, garbage, crlf):
    lines = [f"{i},{gyro!r},{temperature!r}" for i, (gyro, temperature) in enumerate(values)]
    for place, text in garbage:
        lines.insert(min(place, len(lines)), text)
    path = tmp_path_factory.mktemp("log") / "log.csv"
    path.write_bytes(("\r\n" if crlf else "\n").join(lines).encode())
    profile = ImportProfile.model_validate(
        {
            "schema": "fogml.import/1",
            "description": "plain",
            "comment": "#",
            "header": False,
            "fields": 3,
            "reject": {"wrong_field_count": True, "not_numbers": True},
            "columns": {
                "time": {"source": 0, "unit": "s"},
                "gyro": {"source": 1, "unit": "deg/h"},
                "T": {"source": 2, "unit": "degC"},
            },
        }
    )
    counted = [text for _, text in garbage if text.strip() and not text.startswith("#")]
    if 2 * len(counted) > len(values) + len(counted):
        return
    (run,) = import_recording(path, profile)
    assert run.gyro.tolist() == [gyro for gyro, _ in values]
    assert run.columns["T"].tolist() == [temperature for _, temperature in values]
    assert sum(counts(run).values()) == len(counted)


TABLE = """time;rate;temp;note
0;0,5;300;a
100;0,25;301;b
200;"-0,5";302;"c"
300;0,75;303;d
"""
OWN = LOGGER.replace("source: t,", "source: time,")


@pytest.mark.parametrize(
    ("old", "new", "told"),
    [
        ("100;", '"100;', r", line 3, column 'time': '\"100.*' is no number \(1 such row\)"),
        ("100;", "1\x0000;", "'1 00' is no number"),
        ("100;", "100\r;", None),
        ("0,25;", "0,\r25;", "line 3, column 'rate': .*is no number|line 3, column 'rate'"),
        ("0,25;", "1e400;", "line 3, column 'rate': '1e400'|no finite number"),
        ("b\n", 'b"\n', None),
        ("b\n", "b;\n", "4 fields were expected, line 3 has 5"),
        ("a\n", "\udcff\n", "byte 30 is no utf-8 text"),
    ],
)
def test_marks_and_control_characters_in_a_loggers_file(write, tmp_path, old, new, told):
    path = tmp_path / "log.csv"
    path.write_bytes(TABLE.replace(old, new, 1).encode(errors="surrogateescape"))
    profile = write("own.yaml", OWN)
    if told is None:
        (run,) = import_recording(path, profile)
        np.testing.assert_allclose(run.time, [0.0, 0.1, 0.2, 0.3])
        np.testing.assert_allclose(run.columns["gyro"], [1800.0, 900.0, -1800.0, 2700.0])
        return
    with pytest.raises(InputError, match=rf"log\.csv.*({told})"):
        import_recording(path, profile)


def test_a_zero_byte_far_below_is_a_fault_of_its_line(write, tmp_path):
    path = tmp_path / "log.csv"
    rows = "".join(f"{i};0,5;300;a\n" for i in range(2000))
    path.write_text("time;rate;temp;note\n" + rows + "20\x0000;0,5;300;a\n")
    with pytest.raises(InputError, match=r"log\.csv, line 2002, column 'time': '20.00' is no number"):
        import_recording(path, write("own.yaml", OWN))


@pytest.mark.parametrize(
    ("old", "new", "told"),
    [
        ("source: rate", "source: 4", r"source 4 is column 4 counted from 0, and a row has 4 fields"),
        ("source: rate", "source: 999999999999", r"counted from 0, and a row has 4 fields"),
        ("source: rate", "source: -1", "columns.gyro.source"),
        ("source: rate", f"source: {'9' * 400}", "too large"),
        ("description:", "fields: 2\ndescription:", "source 'temp' is column 2 .* a row has 2 fields"),
        ("unit: deg/s", "unit: deg/s, scale: 1e308", "column 'gyro' is no finite number at data row 1"),
        ("unit: deg/s", "unit: deg/s, offset: 1e308", "column 'gyro' is no finite number at data row 1"),
        ("unit: deg/s", "unit: deg/s, scale: 1e999999999/3", "columns.gyro.scale"),
        ("unit: deg/s", "unit: deg/s, scale: '2'", "columns.gyro.scale"),
        ("unit: deg/s", "unit: deg/s, scale: true", "columns.gyro.scale"),
        ("description:", "encoding: punycode\ndescription:", "no text encoding is called 'punycode'"),
        ("description:", 'encoding: "a\\0b"\ndescription:', "a character of code 0"),
        ("description:", "skip_lines: 9000000000\ndescription:", "no data rows"),
        ("description:", "header_lines: 9000000000\ndescription:", "no data rows"),
        ("description:", "fields: 9000000000\ndescription:", "9000000000 fields were expected"),
        ("description:", "legs: {../up: [0, 4]}\ndescription:", r"key 'legs': '\.\./up'"),
        ("description:", "legs: {'1': [true, 4]}\ndescription:", "legs"),
        ("description:", "legs: {'1': [0, 9000000000]}\ndescription:", "leg '1' ends at row"),
    ],
)
def test_profiles_that_ask_for_what_is_not_there(write, tmp_path, old, new, told):
    path = write("log.csv", TABLE)
    profile = write("own.yaml", OWN.replace(old, new, 1))
    with pytest.raises(InputError, match=told):
        import_recording(path, profile)


@pytest.mark.parametrize("name", ["../x", "/tmp/x", ".hidden", "a/b", "", "a" * 50])
def test_axes_name_no_other_place(write, name):
    own = OWN.replace("gyro: {source: rate, ", "gyro: {").rstrip() + f"\naxes: {{'{name}': rate}}\n"
    with pytest.raises(InputError, match="key 'axes'"):
        load_profile(write("own.yaml", own))


PLAIN = """
schema: fogml.import/1
description: plain columns
columns:
  time: {source: t, unit: us}
  gyro: {source: rate, unit: deg/h}
  T: {source: temp, unit: degC}
"""


def plain_log(time_us: np.ndarray, blanks: np.ndarray | None = None) -> tuple[str, np.ndarray, np.ndarray]:
    """A log of a ramp, with blank temperatures; its gyro and its temperature everywhere."""
    rows = np.arange(len(time_us))
    gyro, T = np.round(np.random.default_rng(0).normal(5.0, 1.0, len(rows)), 4), 20.0 + 0.01 * rows
    blank = np.zeros(len(rows), dtype=bool) if blanks is None else blanks
    lines = [
        f"{t:.0f},{g:.4f},{'' if b else f'{x:.3f}'}"
        for t, g, x, b in zip(time_us, gyro, T, blank, strict=True)
    ]
    return "\n".join(["t,rate,temp", *lines]) + "\n", gyro, T


@pytest.mark.parametrize("rejects", ["", "reject: {not_numbers: true}\n"])
@pytest.mark.parametrize("every", [2, 10])
def test_a_column_of_another_rate_costs_no_rows(write, rejects, every):
    rows = np.arange(400)
    log, gyro, T = plain_log(1e5 * rows, rows % every != 0)
    (run,) = import_recording(write("log.csv", log), write("p.yaml", PLAIN + rejects))
    np.testing.assert_array_equal(run.gyro, gyro)
    last = rows[-1] // every * every
    np.testing.assert_allclose(run.columns["T"][: last + 1], T[: last + 1], atol=1e-9)
    assert [f.code for f in run.findings if f.code in ("other_rate", "rejected_rows")] == ["other_rate"]


def test_rows_that_a_profile_rejects_are_told_in_the_runs_notes(write):
    rows = np.arange(400)
    blanks = np.random.default_rng(1).uniform(size=400) < 0.3
    log, *_ = plain_log(1e5 * rows, blanks)
    path = write("log.csv", log)
    with pytest.raises(InputError, match="empty, a number was expected"):
        import_recording(path, write("p.yaml", PLAIN))
    (run,) = import_recording(path, write("p.yaml", PLAIN + "reject: {not_numbers: true}\n"))
    assert len(run) == 400 - blanks.sum()
    assert f"On import {blanks.sum()} of 400 rows were left out" in run.facts.notes
    log, *_ = plain_log(1e5 * rows, rows == 7)
    (run,) = import_recording(write("log.csv", log), write("p.yaml", PLAIN + "reject: {not_numbers: true}\n"))
    assert run.facts.notes is None


def test_a_recording_cut_within_its_last_number_is_refused_or_loses_that_row(write):
    log, gyro, _ = plain_log(1e5 * np.arange(100))
    path = write("log.csv", log.rstrip("\n")[:-4])
    with pytest.raises(InputError, match=r"log.csv, last line: .* middle of a number.*reject: "):
        import_recording(path, write("p.yaml", PLAIN))
    (run,) = import_recording(path, write("p.yaml", PLAIN + "reject: {not_numbers: true}\n"))
    np.testing.assert_array_equal(run.gyro, gyro[:-1])
    (whole,) = import_recording(write("log.csv", log.rstrip("\n")), write("p.yaml", PLAIN))
    assert len(whole) == 100


def test_a_counter_that_wraps_is_unwrapped_and_one_that_restarts_makes_legs(write):
    wrapped = (2**32 - 2e7 + 1e5 * np.arange(400)) % 2**32
    log, gyro, _ = plain_log(wrapped)
    with pytest.raises(InputError, match="wraps"):
        import_recording(write("log.csv", log), write("p.yaml", PLAIN))
    (run,) = import_recording(write("log.csv", log), write("p.yaml", PLAIN), repair=True)
    np.testing.assert_allclose(run.time, 0.1 * np.arange(400), atol=1e-9)
    np.testing.assert_array_equal(run.gyro, gyro)
    log, gyro, _ = plain_log(np.concatenate([1e5 * np.arange(200), 1e5 * np.arange(200)]))
    legs = import_recording(write("log.csv", log), write("p.yaml", PLAIN), repair=True)
    assert [run.name for run in legs] == ["log leg 1", "log leg 2"]
    for number, leg in enumerate(legs):
        np.testing.assert_allclose(leg.time, 0.1 * np.arange(200), atol=1e-9)
        np.testing.assert_array_equal(leg.gyro, gyro[200 * number : 200 * (number + 1)])


def test_a_profile_of_the_logs_own_name_is_no_side_file(write):
    log, gyro, _ = plain_log(1e5 * np.arange(100))
    (run,) = import_recording(write("day.csv", log), write("day.yaml", PLAIN))
    np.testing.assert_array_equal(run.gyro, gyro)
    write("day.yaml", "unit: F-7\n")
    (run,) = import_recording(write("day.csv", log), write("p.yaml", PLAIN))
    assert run.facts.unit == "F-7"
