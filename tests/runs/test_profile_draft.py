"""A drafted profile reads the file that it was drafted for, and calls what it can't know a guess."""

from __future__ import annotations

import json
import re
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner
from scipy.io import savemat

from fogml.cli.main import app
from fogml.errors import InputError
from fogml.runs.header_spelling import canonical_cells
from fogml.runs.profile_draft import draft_profile
from fogml.runs.profiles import import_recording, load_profile
from fogml.runs.reading import read_run
from tests.readers import files
from tests.runs.test_headers import GYRO, labview

COUNT = 60
TIME = np.arange(COUNT) * 10
XSENS = "// Start 0\nPacketCounter\tSampleTimeFine\tGyr_X\tGyr_Y\tTemperature\n" + "".join(
    f"{i}\t{t}\t0.{i:03d}\t-0.{i:03d}\t{25 + i / 100}\n" for i, t in enumerate(TIME)
)
GERMAN = "Prüfstand 4;;;\nDatum;Zeit;Drehrate;Temperatur\n" + "".join(
    f"05.01.2026;08:00:{i:02d},500;{i},25;2{i % 10},5\n" for i in range(COUNT)
)
BARE = "".join(f"{i * 0.1:.1f} {i} {300 + i / 10:.1f}\n" for i in range(COUNT))
QUOTED = "Time (s),Note,Omega (dph),Wärme [°C]\n" + "".join(
    f'{i},"a, b","{1000 + i:,}.25",{25 + i / 8}\n' for i in range(COUNT)
)
QUOTED += "End of test\n"
RETURNS = "t;state;val\r" + "".join(f"{i};{i % 3};{950 + i:,}\r".replace(",", ".") for i in range(COUNT))
LABVIEW = labview(names="X_Value,Voltage_0,Thermistor_1,Comment").replace("deg/h\tdegC", "V\tOhm")
UNITS = "Logger 3\nt,omega,die\n[ms],[deg/s],[°C]\n" + "".join(
    f"{t},{i}.5,{25}\n" for i, t in enumerate(TIME)
)


@pytest.mark.parametrize(
    ("text", "gyro", "told", "runs"),
    [
        (
            XSENS,
            206264.80624709636 * np.arange(COUNT) / 1000,
            ["header_text", "axes: {x: Gyr_X, y: Gyr_Y}"],
            2,
        ),
        (
            GERMAN,
            3600.0 * (np.arange(COUNT) + 0.25),
            ["[Datum, Zeit], unit: stamp", "separator: semicolon"],
            1,
        ),
        (BARE, np.arange(COUNT), ["header: false", "separator: whitespace", "unit: count"], 1),
        (
            QUOTED,
            1000.25 + np.arange(COUNT),
            ["reject: {not_numbers: true, wrong_field_count: true}", 'T: {source: "Wärme [°C]", unit: degC}'],
            1,
        ),
        (RETURNS, np.arange(COUNT) + 950.0, ["gyro: {source: val, unit: count", 'decimal: ","'], 1),
        (
            LABVIEW,
            3600.0 * GYRO,
            ["time: {source: 0, unit: s}\n", "the file says 'V': state a scale", "2 Thermistor_1"],
            1,
        ),
        (UNITS, 3600.0 * (np.arange(COUNT) + 0.5), ["source: t, unit: ms}\n", "unit: deg/s}\n"], 1),
    ],
    ids=[
        "motion tracker",
        "german bench",
        "no header",
        "quotes and footer",
        "returns",
        "LabVIEW",
        "row of units",
    ],
)
def test_text(tmp_path, text, gyro, told, runs):
    path, profile = tmp_path / "log.txt", tmp_path / "p.yaml"
    path.write_text(text, encoding="utf-8")
    draft = draft_profile(path)
    for part in told:
        assert part in draft
    # What the file can't tell is a guess; corrected, it gives what was written.
    profile.write_text(draft.replace("gyro: {unit: deg/s}", "gyro: {unit: rad/s}"), encoding="utf-8")
    found = import_recording(path, profile)
    assert len(found) == runs
    np.testing.assert_allclose(found[0].gyro, gyro, rtol=1e-9)


def test_a_matrix_of_matlab(tmp_path):
    path, profile = tmp_path / "log.mat", tmp_path / "p.yaml"
    savemat(path, {"data": np.c_[TIME / 10.0, np.sin(TIME), 25.0 + TIME / 100.0]})
    with pytest.raises(
        InputError, match=r"log\.mat: no column 'time'.*data column 3.*import log\.mat --draft"
    ):
        read_run(path)
    profile.write_text(draft_profile(path).replace("unit: deg/s", "unit: deg/h"))
    (run,) = import_recording(path, profile)
    np.testing.assert_array_equal(run.time, TIME / 10.0)
    np.testing.assert_array_equal(run.gyro, np.sin(TIME))


@pytest.mark.parametrize("name", ["runtime gyro", "gyro\u2028legs: {a: [0, 1]}", "gyro\x85x", "gyro \u202ey"])
def test_a_name_of_any_characters_is_the_source_and_no_other_key(tmp_path, name):
    """Nor is a word for time in it taken for a clock."""
    rows = "".join(f"{7.6 + 0.01 * (i * 7 % 13):.3f},{25 + i * 7 % 11},{i % 3}\n" for i in range(40))
    (tmp_path / "log.csv").write_text(f'"{name}",die,"flag\u2028b"\n{rows}', encoding="utf-8")
    (tmp_path / "p.yaml").write_text(draft_profile(tmp_path / "log.csv"), encoding="utf-8")
    profile = load_profile(tmp_path / "p.yaml")
    assert profile.columns["gyro"].source == name
    assert profile.sample_s == 0.01 and not profile.legs


def test_a_temperature_that_grows_is_no_clock_and_a_clock_that_does_not_is_there_once(tmp_path):
    h5py = pytest.importorskip("h5py")
    path, profile = tmp_path / "log.h5", tmp_path / "p.yaml"
    columns = {"T [degC]": 20.0 + np.arange(50.0), "gyro [deg/h]": np.sin(np.arange(50.0))}
    with h5py.File(path, "w") as file:
        for name, values in (columns | {"time [s]": 0.5 * np.arange(50.0)}).items():
            file[name] = values
    profile.write_text(draft_profile(path))
    (run,) = import_recording(path, profile)
    np.testing.assert_array_equal(run.time, 0.5 * np.arange(50.0))
    np.testing.assert_array_equal(run.columns["T"], columns["T [degC]"])
    with h5py.File(path, "a") as file:
        file["time [s]"][3] = 0.0
    profile.write_text(draft_profile(path))
    with pytest.raises(InputError, match="column 'time', data row 4: time goes back"):
        import_recording(path, profile)


def test_a_source_that_is_no_vector_is_named(tmp_path):
    h5py = pytest.importorskip("h5py")
    path, profile = tmp_path / "log.h5", tmp_path / "p.yaml"
    with h5py.File(path, "w") as file:
        file["time [s]"], file["gyro [deg/h]"] = np.arange(9.0), 2.0
    profile.write_text(draft_profile(path))
    with pytest.raises(
        InputError, match=r"log\.h5, column 'gyro \[deg/h\]': holds float64 \(one value\), a vector"
    ):
        import_recording(path, profile)


def test_the_command_writes_it_and_shows_the_first_rows(tmp_path):
    files.npz(tmp_path / "log.npz")
    profile = tmp_path / "profile.yaml"
    arguments = ["import", str(tmp_path / "log.npz"), "--draft", "-o", str(profile), "--json"]
    outcome = CliRunner().invoke(app, arguments)
    assert outcome.exit_code == 0, outcome.output
    told = json.loads(outcome.stdout)
    assert told["profile"] == profile.read_text(encoding="utf-8")
    assert told["runs"][0]["rows"] == files.COUNT
    (run,) = import_recording(tmp_path / "log.npz", profile)
    np.testing.assert_array_equal(run.gyro, files.GYRO)


@pytest.mark.parametrize("text", ["only words\nand more\n", "\n\n"])
def test_a_file_without_numbers(tmp_path, text):
    (tmp_path / "log.txt").write_text(text)
    with pytest.raises(InputError, match=r"log\.txt: no rows of numbers"):
        draft_profile(tmp_path / "log.txt")


def test_the_profiles_of_the_guide_are_valid(tmp_path):
    guide = Path(__file__).parents[2] / "docs" / "import-profiles.md"
    blocks = re.findall(r"```(?:text|yaml)\n(.*?)```", guide.read_text(encoding="utf-8"), re.DOTALL)
    profiles = [block for block in blocks if re.search("^columns:", block, re.MULTILINE)]
    whole = [block for block in profiles if block.startswith("schema:")]
    joined = next(block for block in blocks if block.startswith("join:"))
    for block in [*profiles, whole[0] + joined]:
        head = "" if block.startswith("schema:") else "schema: fogml.import/1\ndescription: of the guide\n"
        path = tmp_path / "profile.yaml"
        path.write_text(head + block, encoding="utf-8")
        assert load_profile(path).columns["gyro"].unit
    assert len(profiles) == 4


def test_days_of_a_spreadsheet_are_told(tmp_path):
    path, profile = tmp_path / "log.csv", tmp_path / "profile.yaml"
    seconds = 10.0 * np.arange(300)
    rows = [f"{46000.0 + t / 86400.0:.9f};{np.sin(t):.4f};{20.0 + t / 1000.0:.2f}" for t in seconds]
    path.write_text("\n".join(["Datum;gyro [deg/h];T_in [degC]", *rows, ""]))
    profile.write_text(draft_profile(path))
    assert "unit: d}" in profile.read_text() and "as a spreadsheet counts them" in profile.read_text()
    (run,) = import_recording(path, profile)
    np.testing.assert_allclose(run.time, seconds, atol=1e-3)


def test_units_and_names_that_yaml_takes_for_something_else_are_read_back(tmp_path) -> None:
    """A percent sign begins no YAML value, a dimension of 1 is a number there, and 'no' is false."""
    path, profile = tmp_path / "rig.csv", tmp_path / "profile.yaml"
    rows = "".join(f"{t},{t / 8},{25 + t / 100},{40 + t / 50},{t % 2},{t}\n" for t in TIME)
    path.write_text(f"time [s],gyro [deg/h],T_in [degC],humidity [%],compressor [1],no\n{rows}")
    profile.write_text(draft_profile(path).replace("# keep:", "keep:"))
    (run,) = import_recording(path, load_profile(profile))
    direct = read_run(path)
    for name in ("gyro", "T_in", "humidity", "compressor"):
        np.testing.assert_allclose(run.columns[name], direct.columns[name], rtol=1e-12)
    np.testing.assert_array_equal(run.columns["no"], TIME)


@pytest.mark.parametrize(
    ("step", "told"), [(1000, "steps of 1000: 16.7 min, or 1.00 s if they are ms"), (1, "of 1;")]
)
def test_a_clock_without_a_unit_is_told_by_what_its_steps_would_be(tmp_path, step, told) -> None:
    path = tmp_path / "log.csv"
    path.write_text("Zeit,Kreisel,Temp\n" + "".join(f"{step * i},{i % 7},{20 + i}\n" for i in range(50)))
    assert told in draft_profile(path)


@pytest.mark.parametrize(
    ("cell", "factor"),
    [
        ("Drehrate in Grad/s", 3600.0),
        ("Gyro [Grad/h]", 1.0),
        ("wx_rad", 648000.0 / np.pi),
        ("w_degph", 1.0),
        ("w_deg_per_h", 1.0),
        ("w_deg_per_sec", 3600.0),
        ("Gyro °/h (S/N 17)", 1.0),
        ("w deg/h (LGR S/N: 20)", 1.0),
        ("field.angular_velocity.x", 648000.0 / np.pi),
    ],
)
def test_a_guess_of_the_gyros_unit_goes_by_what_the_cell_says(tmp_path, cell, factor) -> None:
    """Grad is no radian: the guess of a file of German headers was 57 or 3600 times off."""
    path, profile = tmp_path / "log.csv", tmp_path / "profile.yaml"
    path.write_text(f"Zeit [s];{cell};T [°C]\n" + "".join(f"{i};{i % 7},25;{20 + i}\n" for i in range(50)))
    profile.write_text(draft_profile(path))
    assert "GUESS" in profile.read_text()
    (run,) = import_recording(path, profile)
    np.testing.assert_allclose(run.gyro, factor * (np.arange(50) % 7 + 0.25), rtol=1e-12)


@pytest.mark.parametrize("cell", ["dtheta [arcsec]", "dtheta_arcsec"])
def test_angles_of_a_sample_become_a_rate_by_what_the_draft_says(tmp_path, cell) -> None:
    """An arcsecond in a tenth of a second is 10 deg/h."""
    path, profile = tmp_path / "log.csv", tmp_path / "profile.yaml"
    path.write_text(
        f"time [s],{cell},T [degC]\n" + "".join(f"{i / 10},{i % 7},{20 + i}\n" for i in range(50))
    )
    draft = draft_profile(path)
    scale = re.search(r"arcsec turned in a sample\? Then '(scale: \S+)/DT'", draft)
    assert scale is not None
    profile.write_text(draft.replace("unit: deg/s}", f"unit: deg/s, {scale[1]}/0.1}}"))
    (run,) = import_recording(path, profile)
    np.testing.assert_allclose(run.gyro, 10.0 * (np.arange(50) % 7), rtol=1e-8)


@pytest.mark.parametrize(
    ("head", "row", "told"),
    [
        (
            "UTC;Local;w",
            "2026-03-02 07:00:{0:02d};2026-03-02 08:00:{0:02d};{0},5",
            "source: UTC, unit: stamp",
        ),
        ("Date;Stamp;w", "2026-03-02;2026-03-02 08:00:{0:02d};{0},5", "source: Stamp, unit: stamp"),
        ("Since;Clock;Day;w", "08:00:00;08:00:{0:02d};2026-03-02;{0},5", "source: [Day, Clock]"),
    ],
)
def test_of_several_columns_of_dates_one_is_the_clock(tmp_path, head, row, told):
    path = tmp_path / "log.csv"
    path.write_text(head + "\n" + "".join(row.format(i) + "\n" for i in range(COUNT)))
    draft = draft_profile(path)
    assert told in draft and "# GUESS: or by " in draft
    (tmp_path / "p.yaml").write_text(draft)
    (run,) = import_recording(path, tmp_path / "p.yaml")
    np.testing.assert_array_equal(run.time, np.arange(COUNT))


VALUES = 9.5 + np.arange(COUNT) % 7 / 8
ODD = {
    "a header that names two alike": (
        "time [s],gyro [deg/h],T [degC],T [degC]\n"
        + "".join(f"{i},{g},20,{30 + i}\n" for i, g in enumerate(VALUES)),
        "header: false",
    ),
    "cells merged over two rows": (
        "Bench 4,,,\ntime [s],Kreisel,,T [degC]\n,gyro [deg/h],Status,\n"
        + "".join(f"{i},{g},ok,{20 + i}\n" for i, g in enumerate(VALUES)),
        "source: 3, unit: degC",
    ),
    "means below": (
        "time [s],gyro [deg/h],T [degC]\n"
        + "".join(f"{i},{g},{20 + i}\n" for i, g in enumerate(VALUES))
        + "Mean,9.8,50\n,0.2,17\n",
        "lines within or below the data: left out",
    ),
    "days in a column of times": (
        "Time;gyro [deg/h];T [degC]\n"
        + "".join(f"{46083.25 + i / 86400:.9f};{g};{20 + i}\n" for i, g in enumerate(VALUES)),
        "unit: d}",
    ),
    "days since year 0": (
        "Date/Time;gyro [deg/h];T [degC]\n"
        + "".join(f"{740043.25 + i / 86400:.9f};{g};{20 + i}\n" for i, g in enumerate(VALUES)),
        "unit: d}",
    ),
    "a clock named as a sensor might be": (
        "TOW [s],gyro [deg/h],T [degC]\n"
        + "".join(f"{(604790 + i) % 604800},{g},{20 + i}\n" for i, g in enumerate(VALUES)),
        'time: {source: "TOW [s]", unit: s}',
    ),
    "decimal commas between commas": (
        '"time [s]","gyro [deg/h]","T [degC]"\n'
        + "".join(f'"{i},0","{g:.3f}","{20 + i},5"\n'.replace(".", ",") for i, g in enumerate(VALUES)),
        'decimal: ","',
    ),
    "another minus": (
        "time [s],gyro [deg/h],T [degC]\n"
        + "".join(f"{i},{g},\u2212{20 + i}\n" for i, g in enumerate(VALUES)),
        "gyro: {source:",
    ),
    "a number beside the header": (
        "time [s],gyro [deg/h],T [degC],,9.75\n"
        + "".join(f"{i},{g},{20 + i},,\n" for i, g in enumerate(VALUES)),
        'gyro: {source: "gyro [deg/h]", unit: deg/h}',
    ),
}


@pytest.mark.parametrize("name", ODD)
def test_odd_tables_of_spreadsheets(tmp_path, name):
    text, told = ODD[name]
    path, profile = tmp_path / "log.csv", tmp_path / "p.yaml"
    path.write_text(text, encoding="utf-8")
    profile.write_text(draft_profile(path), encoding="utf-8")
    assert told in profile.read_text(encoding="utf-8")
    (run,) = import_recording(path, profile, repair="TOW" in text)
    np.testing.assert_allclose(run.gyro, VALUES, rtol=1e-12)
    np.testing.assert_allclose(run.time, np.arange(COUNT), atol=1e-4)


def test_a_gyro_of_no_numbers_is_no_other_column(tmp_path):
    path, profile = tmp_path / "log.csv", tmp_path / "p.yaml"
    path.write_text(
        "Time;gyro [deg/h];T [degC];V\n"
        + "".join(f"2. Mai 2026 08:{i};({i});{20 + i};5\n" for i in range(COUNT))
    )
    profile.write_text(draft_profile(path))
    assert "'2. Mai 2026 08:0' is no date that is read" in profile.read_text()
    with pytest.raises(InputError, match=r"column 'gyro \[deg/h\]': '\(0\)' is no number"):
        import_recording(path, profile)


@pytest.mark.parametrize(
    ("scale", "unit", "told"), [(1e3, "ms", "1.00 s"), (1e6, "us", "1.00 s"), (1e9, "ns", "1.00 s")]
)
def test_a_clock_that_would_show_centuries_in_seconds_counts_less(tmp_path, scale, unit, told):
    rows = "".join(f"{int(scale * (1767600000 + i))};{7 + i % 3};{20 + i}\n" for i in range(COUNT))
    (tmp_path / "log.csv").write_text("timestamp;gyro [deg/h];T [degC]\n" + rows)
    (tmp_path / "p.yaml").write_text(draft := draft_profile(tmp_path / "log.csv"))
    assert f"unit: {unit}}}    # GUESS: steps of " in draft and told in draft
    (run,) = import_recording(tmp_path / "log.csv", tmp_path / "p.yaml")
    np.testing.assert_allclose(run.time, np.arange(COUNT), atol=1e-3)


@pytest.mark.parametrize("units", ["", "s deg/h degC"])
def test_the_header_that_numpy_writes_behind_a_mark_names_the_columns(tmp_path, units):
    table = np.column_stack((np.arange(COUNT), 9.5 + np.arange(COUNT) % 31, 20.0 + 0.1 * np.arange(COUNT)))
    names = "time gyro_dph T_in" if not units else "time gyro T_in"
    np.savetxt(tmp_path / "log.txt", table, header="\n".join([names, *([units] if units else [])]))
    (tmp_path / "profile.yaml").write_text(draft_profile(tmp_path / "log.txt"))
    (run,) = import_recording(tmp_path / "log.txt", tmp_path / "profile.yaml")
    np.testing.assert_allclose(np.column_stack((run.time, run.gyro, run.columns["T_in"])), table)


@pytest.mark.parametrize("form", ["{:g}", "{:.9e}"])
def test_a_clock_in_six_columns_is_that_of_its_dates(tmp_path, form):
    """As MATLAB's clock() gives it, with names or as `save -ascii` writes it, over a month's end."""
    begin = np.datetime64("2028-02-28T23:59:45.250")
    moments = begin + (np.arange(COUNT) * 43_200_500).astype("timedelta64[ms]")
    dates = [moment.item() for moment in moments]
    cells = [(d.year, d.month, d.day, d.hour, d.minute, d.second + d.microsecond / 1e6) for d in dates]
    rows = [[*cell, 9.5 + i % 31, 20.0 + 0.1 * i] for i, cell in enumerate(cells)]
    text = "".join(",".join(form.format(value) for value in row) + "\n" for row in rows)
    (tmp_path / "log.csv").write_text(("" if "e" in form else "Y,M,D,h,m,s,gyro_dph,T_degC\n") + text)
    draft = draft_profile(tmp_path / "log.csv")
    (tmp_path / "profile.yaml").write_text(draft.replace("unit: deg/s", "unit: deg/h"))
    (run,) = import_recording(tmp_path / "log.csv", tmp_path / "profile.yaml")
    np.testing.assert_allclose(run.time, 43200.5 * np.arange(COUNT), rtol=0, atol=1e-6)
    np.testing.assert_allclose(run.gyro, 9.5 + np.arange(COUNT) % 31)


def test_a_set_point_is_no_reading_and_a_second_thermometer_is_a_guess(tmp_path):
    """A chamber's log: its set temperature was taken for the coil's inner face."""
    head = "Zeit [s];Feuchte [%];Omega [V];Temp Istwert [°C];Temp Sollwert [°C];Temp Halter [°C]\n"
    rows = "".join(f"{i};{i % 29},0;{i % 37},5;{20 + i},5;25,0;{19 + i},5\n" for i in range(COUNT))
    (tmp_path / "log.csv").write_text(head + rows)
    draft = draft_profile(tmp_path / "log.csv").splitlines()
    assert next(line for line in draft if "Omega" in line).startswith("  gyro:")
    assert next(line for line in draft if "Sollwert" in line).startswith("# keep")
    assert ["GUESS" in line for line in draft if "Istwert" in line or "Halter" in line] == [True, True]


def test_a_remark_with_a_date_is_no_header(tmp_path):
    rows = "".join(f"{i} {7 + i % 3}.5 {20 + i} 0 1 2\n" for i in range(COUNT))
    (tmp_path / "log.txt").write_text("% 2014-03-21 17:31:51 by a fitter\n" + rows)
    draft = draft_profile(tmp_path / "log.txt")
    assert "header: false" in draft and "skip_lines: 1" in draft


def test_a_code_in_hexadecimal_that_is_a_number_now_and_then_does_not_cut_the_data(tmp_path):
    """Rows before the longest stretch of codes of digits alone were taken for lines above the data."""
    codes = [f"{7 * i:04X}" for i in range(COUNT)]
    assert any(code.isdigit() for code in codes) and not all(code.isdigit() for code in codes)
    rows = [f"$GYRO,{i},{code},{7 + i % 41}.5,OK*3F" for i, code in enumerate(codes)]
    (tmp_path / "log.txt").write_text("\n".join(["# a capture", *rows, ""]))
    (tmp_path / "profile.yaml").write_text(draft_profile(tmp_path / "log.txt"))
    (run,) = import_recording(tmp_path / "log.txt", tmp_path / "profile.yaml")
    np.testing.assert_array_equal(run.time, np.arange(COUNT))
    np.testing.assert_allclose(run.gyro, 3600.0 * (7.5 + np.arange(COUNT) % 41))


@pytest.mark.parametrize(
    ("line", "mark"),
    [
        ("[2026-03-11 {}] {},{}", "] "),
        ("[{}]{},{}", "]"),
        ("2026-03-11 {} {},{}", " "),
        ("{} -> {},{}", " -> "),
        ("11.03.2026 {} [RX] - {},{}", " [RX] - "),
        ("2026/03/11 {}: {};{}", ": "),
        ("[2026-03-11 {}] {} {}", "] "),
    ],
)
def test_stamps_of_a_terminal_before_each_line_are_its_clock(tmp_path, line, mark):
    """No sign of a reading is taken for a part of what follows the stamp."""
    gyro = np.where(np.arange(COUNT) % 9 == 0, 0.25, -7.25 - np.arange(COUNT))
    seconds = [f"10:15:{i:02d}.250" for i in range(COUNT)]
    rows = [line.format(*row) for row in zip(seconds, gyro, 20.5 + 0.1 * np.arange(COUNT), strict=True)]
    (tmp_path / "log.txt").write_text("\n".join([*rows, ""]))
    draft = draft_profile(tmp_path / "log.txt")
    assert f'line_stamp: "{mark}"' in draft
    (tmp_path / "profile.yaml").write_text(draft)
    (run,) = import_recording(tmp_path / "log.txt", tmp_path / "profile.yaml")
    np.testing.assert_allclose(run.gyro, 3600.0 * gyro)
    np.testing.assert_allclose(run.time, np.arange(COUNT), atol=1e-9)


def test_a_thermometer_behind_a_clock_of_its_own_is_a_guess(tmp_path):
    """Two logs side by side in one worksheet: by the gyro's clock its ramp would be ten times too fast."""
    slow = [f"{10.0 * i},{20.5 + i}" if i < COUNT // 10 else "," for i in range(COUNT)]
    rows = [f"{i},{9.5 + i % 7},,{right}" for i, right in enumerate(slow)]
    header = "time [s],gyro [deg/h],,time [s],T [degC]"
    (tmp_path / "log.csv").write_text("\n".join([header, *rows, ""]))
    (line,) = (text for text in draft_profile(tmp_path / "log.csv").splitlines() if text.startswith("  T:"))
    assert "source: 4" in line and "# GUESS: by the clock of column 3?" in line and "join" in line


@pytest.mark.parametrize("after", [" AM", " UTC", " +02:00"])
def test_what_ends_a_date_is_no_text_of_a_device(tmp_path, after):
    rows = [f"2026-03-11 10:15:{i:02d}{after},{9.5 + i},{20.5 + 0.1 * i}" for i in range(COUNT)]
    (tmp_path / "log.csv").write_text("\n".join(["When,Gyro [deg/h],T [degC]", *rows, ""]))
    draft = draft_profile(tmp_path / "log.csv")
    (tmp_path / "profile.yaml").write_text(draft)
    (run,) = import_recording(tmp_path / "log.csv", tmp_path / "profile.yaml")
    np.testing.assert_allclose(run.gyro, 9.5 + np.arange(COUNT))
    np.testing.assert_allclose(run.columns["T"], 20.5 + 0.1 * np.arange(COUNT))


def test_a_long_file_whose_lines_end_with_carriage_returns_is_drafted(tmp_path):
    rows = "".join(f"{i},{9.5 + i % 7},{20 + i % 3}\r" for i in range(6000))
    (tmp_path / "log.csv").write_bytes(f"tick,omega,die\r{rows}".encode())
    assert "source: omega" in draft_profile(tmp_path / "log.csv")


def test_the_first_rows_of_counts_are_in_counts(tmp_path):
    rows = "".join(f"{i},{1000 + i % 7}\n" for i in range(COUNT))
    (tmp_path / "log.csv").write_text("time [s],gyro [count]\n" + rows)
    outcome = CliRunner().invoke(app, ["import", str(tmp_path / "log.csv"), "--draft"])
    assert "gyro [count]" in outcome.stdout.partition("the first rows")[2]


def test_a_number_of_the_row_is_no_clock_and_a_unit_that_is_not_known_is_told(tmp_path):
    rows = "".join(f"{i},{7 + i % 3}.5,{20 + i},{20000 + i}\n" for i in range(COUNT))
    (tmp_path / "log.csv").write_text("Sample,gyro [deg/h],T_inner,T_casing [m°C]\n" + rows)
    draft = draft_profile(tmp_path / "log.csv")
    assert "sample_s: 0.01    # GUESS: no clock" in draft and "T_in: {source: T_inner, unit: degC}" in draft
    assert "GUESS: which sensor, the file says 'm°C': state a scale" in draft


@pytest.mark.parametrize(
    ("header", "line"),
    [
        (
            "time [s],gyro1 [deg/h],gyro2 [deg/h],T [degC]",
            'gyro: {source: "gyro1 [deg/h]", unit: deg/h}    # GUESS: or',
        ),
        (
            "time [s],gyro std [deg/h],gyro mean [deg/h],T [degC]",
            'gyro: {source: "gyro mean [deg/h]", unit: deg/h}    #',
        ),
        (
            "time [s],Table rate [deg/s],IMU rate [deg/s],T [degC]",
            'gyro: {source: "IMU rate [deg/s]", unit: deg/s}\n',
        ),
        ("time [s],fog x1000 [deg/h],b,T [degC]", "# GUESS: its name says x1000: state a scale"),
        (
            "time [s],gyro [deg/h],b,Oven [degC]",
            'T: {source: "Oven [degC]", unit: degC}    # GUESS: the gyro\'s own?',
        ),
        ("time [s],gyro [deg/h],SP [degC],PV [degC]", 'T: {source: "PV [degC]", unit: degC}    # GUESS'),
        ("Record,time [s],101 (VDC),T [degC]", 'gyro: {source: "101 (VDC)", unit: deg/s}    # GUESS'),
        ("time [s],gyro [deg/h],b,Ch2 °C", 'T: {source: "Ch2 °C", unit: degC}    # GUESS'),
        ("tick,gyro [deg/h],b,T [degC]", "time: {source: tick, unit: s}    # GUESS"),
    ],
)
def test_what_could_be_another_column_is_a_guess(tmp_path, header, line):
    rows = "".join(f"{i},{i},{i * i % 37}.5,{25 + i / 100}\n" for i in range(COUNT))
    if not header.startswith("Record"):
        rows = "".join(f"{i},{i * i % 31}.25,{i * i % 37}.5,{25 + i / 100}\n" for i in range(COUNT))
    (tmp_path / "a.csv").write_text(f"{header}\n{rows}", encoding="utf-8")
    assert line in draft_profile(tmp_path / "a.csv")


def test_the_clock_of_a_shorter_log_beside_is_told(tmp_path):
    rows = [f"{i},{i * i % 37}.5," + (f"{10 * i},{25 + i / 8}" if i < 9 else ",") for i in range(COUNT)]
    (tmp_path / "a.csv").write_text("\n".join(["time [s],gyro [deg/h],t2 [s],T [degC]", *rows, ""]))
    assert '# GUESS: or by "t2 [s]"?' in draft_profile(tmp_path / "a.csv")


def test_two_clocks_are_a_guess(tmp_path):
    rows = "".join(f"2026-03-11 08:00:{i:02d}.1,{i},{i * i % 37}.5\n" for i in range(COUNT))
    (tmp_path / "a.csv").write_text(f"PC time,DAQ time [s],gyro [deg/h]\n{rows}")
    assert '# GUESS: or by "DAQ time [s]"?' in draft_profile(tmp_path / "a.csv")


@pytest.mark.parametrize(
    ("above", "interval"),
    [
        ("Sample rate: 50 Hz", "0.02"),
        ("Sampling Frequency [kHz];0,05 kHz", "0.02"),
        ("Sample interval = 20 ms", "0.02"),
        ("Rate range: 50", "0.01"),
    ],
)
def test_an_interval_above_the_data_is_a_guess_where_no_clock_is(tmp_path, above, interval):
    rows = "".join(f"{i * i % 37}.5;{25 + i % 3}\n" for i in range(COUNT))
    (tmp_path / "a.csv").write_text(f"{above}\ngyro [deg/h];T [degC]\n{rows}")
    assert f"sample_s: {interval}    # GUESS" in draft_profile(tmp_path / "a.csv")


def test_a_labview_file_without_x_columns_has_its_interval_and_separator_stated(tmp_path):
    rows = [f",{g},{25 + i / 8}" for i, g in enumerate(GYRO)]
    path = tmp_path / "a.lvm"
    path.write_text(labview(x_columns="No", comma=True, rows=rows))
    (tmp_path / "p.yaml").write_text(draft_profile(path))
    assert "sample_s: 0.5    # GUESS: no clock was found; by Delta_X" in (tmp_path / "p.yaml").read_text()
    (run,) = import_recording(path, load_profile(tmp_path / "p.yaml"))
    np.testing.assert_allclose(run.gyro, GYRO)


SLOW = np.arange(0.0, 10.0 * COUNT, 100.0)


@pytest.mark.parametrize(
    ("name", "arrays"),
    [
        ("a.npz", {"t": TIME, "gyro": TIME % 37 + 0.5, "t_T": SLOW, "T": 25 + SLOW / 100}),
        ("a.mat", {"t": TIME, "gyro": TIME % 37 + 0.5, "t_temp": SLOW, "temp": 25 + SLOW / 100}),
        (
            "b.mat",  # as timeseries made structs
            {
                "gyro": {"Time": TIME, "Data": TIME % 37 + 0.5, "Units": "deg/s"},
                "die": {"Time": SLOW, "Data": 25 + SLOW / 100, "Units": "degC"},
            },
        ),
    ],
)
def test_a_thermometer_with_a_clock_of_its_own_in_the_file_is_joined(tmp_path, name, arrays):
    (np.savez if name.endswith("npz") else savemat)(tmp_path / name, **(
        arrays if name.endswith("npz") else {"mdict": arrays}
    ))  # fmt: skip
    (tmp_path / "p.yaml").write_text(draft_profile(tmp_path / name))
    (run,) = import_recording(tmp_path / name, load_profile(tmp_path / "p.yaml"))
    np.testing.assert_allclose(run.gyro, 3600.0 * (TIME % 37 + 0.5))
    known = SLOW[-1] >= TIME
    np.testing.assert_allclose(run.columns["T"][known], 25 + TIME[known] / 100)


def test_a_thermometer_beside_a_clock_called_t_is_no_clock():
    assert canonical_cells(["t", "gyro", "T"]) == ("time", "gyro", "T")
    assert canonical_cells(["t", "T [degC]"]) == ("time", "T [degC]")


def test_a_decimal_comma_among_tabs_is_no_separator(tmp_path):
    rows = "".join(f"{9 + i % 7},{1000 + i}\t{20 + i % 3},{5000 + i}\n" for i in range(COUNT))
    (tmp_path / "a.txt").write_text(rows)
    draft = draft_profile(tmp_path / "a.txt")
    assert 'separator: tab\ndecimal: ","\n' in draft and "fields: 2\n" in draft


def test_names_of_a_table_of_campbells_loggers_are_told_with_their_units(tmp_path):
    head = '"TOA5","a","b"\n"TIMESTAMP","RECORD","Gyro_Avg","Coil_Avg"\n'
    head += '"TS","RN","deg/h","Deg C"\n"","","Avg","Avg"\n'
    rows = "".join(f'"2026-03-11 08:00:{i:02d}",{i},{i * i % 37}.5,{25 + i / 8}\n' for i in range(COUNT))
    (tmp_path / "a.dat").write_text(head + rows)
    (tmp_path / "p.yaml").write_text(draft_profile(tmp_path / "a.dat"))
    assert "# Fields: 0 time, 1 RECORD, 2 Gyro_Avg, 3 Coil_Avg" in (tmp_path / "p.yaml").read_text()
    (run,) = import_recording(tmp_path / "a.dat", load_profile(tmp_path / "p.yaml"))
    np.testing.assert_allclose(run.gyro, np.arange(COUNT) ** 2 % 37 + 0.5)
    np.testing.assert_allclose(run.columns["T"], 25 + np.arange(COUNT) / 8)


def test_marks_that_may_be_of_thousands_are_a_guess(tmp_path):
    rows = "".join(f'{i},"{9 + i % 7},{100 + i}"\n' for i in range(COUNT))
    (tmp_path / "a.csv").write_text("time [s],gyro [deg/h]\n" + rows)
    assert """decimal: "."    # GUESS: numbers such as '9,100' are read as 9100""" in draft_profile(
        tmp_path / "a.csv"
    )
