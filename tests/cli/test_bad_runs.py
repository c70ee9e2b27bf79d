"""Every fault of a run file: exit status 2, one message that names file and place, nothing written."""

from __future__ import annotations

import numpy as np
import pytest

from tests.cli.conftest import csv_text

HEADER = "time [s],gyro [deg/h],T [degC]"


def spoiled(row: int, text: str) -> str:
    lines = csv_text(0, rows=200).splitlines()
    lines[row] = text
    return "\n".join(lines) + "\n"


FAULTS = {
    "no header": (csv_text(0, rows=50).split("\n", 1)[1], "time"),
    "no time": (csv_text(0, rows=50, header="clock [s],gyro [deg/h],T [degC]"), "time"),
    "no gyro": (csv_text(0, rows=50, header="time [s],output [deg/h],T [degC]"), "gyro"),
    "no unit": (csv_text(0, rows=50, header="time [s],gyro,T [degC]"), "deg/h, deg/s, rad/s, count"),
    "unknown unit": (
        csv_text(0, rows=50, header="time [s],gyro [rpm],T [degC]"),
        "deg/h, deg/s, rad/s, count",
    ),
    "time goes back": (spoiled(100, "3.0,5.0,20.0"), "time"),
    "time repeats": (spoiled(100, "196.0,5.0,20.0"), "time"),
    "not a number": (spoiled(100, "198.0,nan,20.0"), "gyro"),
    "infinite": (spoiled(100, "198.0,inf,20.0"), "gyro"),
    "text": (spoiled(100, "198.0,fault,20.0"), "gyro"),
    "row cut short": (spoiled(100, "198.0,5.0"), ""),
    "cut in the last row": (csv_text(0, rows=200)[:-9], ""),
    "empty": ("", ""),
    "header only": (HEADER + "\n", ""),
    "one row": (HEADER + "\n0.0,5.0,20.0\n", ""),
}
REPAIRED = ("time goes back", "time repeats", "not a number", "infinite", "text", "row cut short")


@pytest.mark.parametrize("fault", FAULTS)
def test_each_fault_of_a_csv(invoke, run_files, tmp_path, fault):
    text, place = FAULTS[fault]
    bad = tmp_path / "bad.csv"
    bad.write_text(text)
    for arguments in (("train", bad, "--test", run_files[1]), ("train", run_files[0], "--test", bad)):
        result = invoke(*arguments, "-o", tmp_path / "out", "--model", "M1", status=2)
        assert "bad.csv" in result.stderr
        assert place in result.stderr
        assert len(result.stderr.strip().splitlines()) <= 3
        assert "Traceback" not in result.stderr
        assert result.stdout == ""
        assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("fault", REPAIRED)
def test_repair_counts_what_it_does(invoke_json, tmp_path, fault):
    bad = tmp_path / "bad.csv"
    bad.write_text(FAULTS[fault][0])
    (run,) = invoke_json("inspect", bad, "--repair")["runs"]
    repaired = [finding for finding in run["findings"] if finding["code"].startswith("repaired")]
    assert sum(finding["count"] for finding in repaired) == 1


@pytest.mark.parametrize("name", ["bad.csv", "bad.parquet", "bad.h5", "bad.mat"])
@pytest.mark.parametrize("command", ["inspect", "noise"])
def test_a_binary_file_under_any_name(invoke, tmp_path, name, command):
    bad = tmp_path / name
    bad.write_bytes(np.random.default_rng(0).bytes(5000))
    result = invoke(command, bad, "-o", tmp_path / "out", status=2)
    assert name in result.stderr
    assert "Traceback" not in result.stderr
    assert not (tmp_path / "out").exists()


def test_a_folder_and_a_missing_file(invoke, tmp_path):
    assert "folder" in invoke("inspect", tmp_path, status=2).stderr
    assert "none.csv" in invoke("inspect", tmp_path / "none.csv", status=2).stderr


def test_an_unknown_key_in_a_side_file(invoke, run_files):
    run_files[0].with_suffix(".yaml").write_text("unit: FOG-1\nlattitude: 30\n")
    result = invoke("inspect", run_files[0], status=2)
    assert "lattitude" in result.stderr
    assert "a.yaml" in result.stderr
