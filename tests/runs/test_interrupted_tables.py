"""Tables with remarks, blank lines or another header within: no row is lost, none read as other columns."""

from __future__ import annotations

import numpy as np
import pytest

from fogml.errors import InputError
from fogml.runs.profile_draft import draft_profile
from fogml.runs.profiles import import_recording, load_profile
from fogml.runs.reading import read_run

COUNT, BREAK = 120, 30
TIME = np.arange(COUNT, dtype=float)
GYRO = 9.6 + 0.01 * (np.arange(COUNT) ** 2 % 37)
HEADER = "time [s],gyro [deg/h],T [degC]"
ROWS = [f"{i},{g:.3f},{25 + 0.05 * i:.2f}" for i, g in enumerate(GYRO)]


def file_with(path, within, rows=ROWS, header=HEADER):
    """A table with a line after its first rows."""
    lines = [*([header] if header else []), *rows[:BREAK], within, *rows[BREAK:]]
    path.write_text("\n".join([*lines, ""]), encoding="utf-8")
    return path


def drafted(path):
    profile = path.with_name("p.yaml")
    profile.write_text(draft_profile(path), encoding="utf-8")
    return import_recording(path, load_profile(profile))


@pytest.mark.parametrize("within", ["Over,range,found", ",,", "overrange", "# event, 1", HEADER, '"","",""'])
def test_a_draft_reads_the_rows_on_both_sides_of_a_line_within(tmp_path, within):
    (run,) = drafted(file_with(tmp_path / "a.csv", within))
    np.testing.assert_array_equal(run.time, TIME)
    np.testing.assert_allclose(run.gyro, np.round(GYRO, 3))
    assert sum(f.count for f in run.findings if f.code == "rejected_rows") == 1


def test_a_draft_of_blanks_without_a_header_reads_both_sides(tmp_path):
    rows = [row.replace(",", " ") for row in ROWS]
    (run,) = drafted(file_with(tmp_path / "a.txt", "WARN over range", rows, None))
    np.testing.assert_array_equal(run.time, TIME)


def test_facts_above_the_data_are_no_rows_of_it(tmp_path):
    above = "Rate,100,1\nGain,2,2\nOffset,1,3\n"
    path = tmp_path / "a.csv"
    path.write_text(above + "\n".join([HEADER, *ROWS, ""]))
    (run,) = drafted(path)
    np.testing.assert_array_equal(run.time, TIME)


@pytest.mark.parametrize(
    "other",
    [
        "time [s],T [degC],gyro [deg/h]",
        "time [s],gyro [deg/s],T [degC]",
        "time [s],gyro [deg/h],P [W],T [degC]",
    ],
    ids=["swapped", "unit", "a column more"],
)
def test_the_header_of_other_columns_within_is_refused_and_never_dropped(tmp_path, other):
    path = file_with(tmp_path / "a.csv", other)
    said = rf"a\.csv, line {BREAK + 2}: another header, .* save the rows from there on"
    with pytest.raises(InputError, match=said):
        read_run(path)
    with pytest.raises(InputError, match=said):
        read_run(path, repair=True)
    with pytest.raises(InputError, match=said):
        drafted(path)


def test_a_header_of_names_that_a_profile_alone_knows_is_compared_too(tmp_path):
    path = file_with(tmp_path / "a.csv", "t,die,w", header="t,w,die")
    with pytest.raises(InputError, match="line 32: another header, 't,die,w'"):
        drafted(path)


def test_the_same_header_again_is_a_line_to_leave_out(tmp_path):
    run = read_run(file_with(tmp_path / "a.csv", HEADER), repair=True)
    np.testing.assert_array_equal(run.time, TIME)
    units_apart = file_with(tmp_path / "b.csv", "time,gyro,T", header="time,gyro,T\ns,deg/h,degC")
    np.testing.assert_array_equal(read_run(units_apart, repair=True).time, TIME)


@pytest.mark.parametrize("place", [0, 40, 300, 2000])
def test_noise_of_a_line_costs_the_rows_it_hits_and_no_others(tmp_path, place):
    content = ("\n".join([*ROWS, ""])).encode()
    path = tmp_path / "a.txt"
    at = content.rfind(b"\n", 0, place) + 1
    path.write_bytes(content[:at] + b"\x00\xfe\x07\xf0ga,rb,\n" + content[at:])
    (run,) = drafted(path)
    np.testing.assert_array_equal(run.time, TIME)


def test_files_put_together_lose_no_row_to_a_mark_of_encoding(tmp_path):
    path = tmp_path / "a.csv"
    path.write_text("\n".join([HEADER, *ROWS[:BREAK], "\ufeff" + ROWS[BREAK], *ROWS[BREAK + 1 :], ""]))
    for run in (read_run(path), *drafted(path)):
        np.testing.assert_array_equal(run.time, TIME)
        assert not {f.code for f in run.findings} & {"rejected_rows", "repaired_rows"}
