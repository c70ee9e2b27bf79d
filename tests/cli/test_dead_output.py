"""A gyro that was not connected: every command asks for that, and none takes its zeros for figures."""

from __future__ import annotations

import numpy as np
import pytest

from tests.cli.conftest import csv_text


@pytest.fixture
def dead(tmp_path):
    """A run whose output is zero throughout, while the temperature moves."""
    path = tmp_path / "dead.csv"
    head, *rows = csv_text(3).splitlines()
    cells = [row.split(",") for row in rows]
    path.write_text("\n".join([head, *(f"{time},0.000000,{warm}" for time, _, warm in cells)]) + "\n")
    path.with_suffix(".yaml").write_text("unit: FOG-1\naxis: x\n")
    return path


def test_the_verdict_on_a_dead_test_run_asks_for_the_gyro(run_files, dead, tmp_path, invoke):
    out = tmp_path / "out"
    told = invoke("train", run_files[0], "--test", dead, "--model", "polynomial", "-o", out)
    assert "Do not use: the output of dead.csv stands still" in told.stdout
    assert "not connected or not switched on" in told.stderr
    report = (out / "report.json").read_text()
    assert "See whether the gyro was connected" in report and '"left_is_noise": false' in report
    page = (out / "report.html").read_text()
    assert "On dead.csv nothing is judged" in page
    for words in ("does harm", "train on runs that are like", "Train on runs that are like"):
        assert words not in told.stdout and words not in report and words not in page


def test_the_verdict_on_a_dead_training_run_asks_for_the_gyro(run_files, dead, tmp_path, invoke_json):
    report = invoke_json("train", dead, "--test", run_files[1], "-o", tmp_path / "out")
    assert report["verdict"] == "do_not_use" and "record dead.csv again" in report["next_step"]
    assert report["train"][0]["findings"][0]["code"] == "dead_output"


def test_a_dead_output_meets_no_limit_of_an_acceptance_report(dead, tmp_path, invoke_json):
    limits = tmp_path / "limits.yaml"
    limits.write_text("limits: {bias_stability: 0.02}\n")
    report = invoke_json("lab", "acceptance", dead, "--limits", limits, "-o", tmp_path / "report", status=1)
    assert report["verdict"] == "incomplete" and "not connected" in report["reasons"][0]


def test_a_dead_output_is_refused_where_it_would_be_evidence(run_files, dead, tmp_path, invoke, trained):
    for command in (
        ("diagnose", dead, "--held-out", run_files[0]),
        ("diagnose", run_files[0], "--held-out", dead),
        ("monitor", trained(), dead, "--averaging", "20"),
    ):
        told = invoke(*command, "-o", tmp_path / "out", status=2).stderr
        assert told.splitlines()[-1].startswith("fogml: dead.csv: 'gyro' is 0 in every sample")


def test_no_model_is_compared_on_a_dead_output_in_silence(run_files, dead, tmp_path, invoke):
    out = tmp_path / "out"
    words = ("compare", run_files[0], "--test", dead, "--models", "mean,M2", "-o", out)
    for told in (invoke(*words).stdout, (out / "compare.html").read_text()):
        assert "not connected or not switched on" in told and "nothing is judged there" in told
        assert "∞" not in told
    assert '"floor_ci90": null' in (out / "compare.json").read_text()


def test_a_fleet_says_which_unit_was_not_connected(run_files, dead, tmp_path, invoke_json):
    manifest = tmp_path / "units.csv"
    manifest.write_text(f"unit,job,train,test\nFOG-1,train,{run_files[0]},{dead}\n")
    fleet = invoke_json("fleet", manifest, "--model", "polynomial", "-o", tmp_path / "fleet")
    (again,) = fleet["again"]
    assert "the output of dead.csv stands still" in again["why"] and "harm" not in again["why"]


def test_compensating_a_dead_output_says_so(dead, tmp_path, invoke, trained):
    told = invoke("compensate", dead, "--model", trained(), "-o", tmp_path / "out.csv")
    assert told.stderr.count("dead.csv: 'gyro' is 0 in every sample") == 1
    rows = np.loadtxt(tmp_path / "out.csv", delimiter=",", skiprows=1)
    assert len(rows) == 1500


def test_a_fleet_says_which_unit_s_temperature_can_not_be(run_files, tmp_path, invoke_json):
    head, *rows = csv_text(4).splitlines()
    cells = [row.split(",") for row in rows]
    path = tmp_path / "kelvin.csv"
    warm = [",".join([*row[:2], f"{float(row[2]) + 273.15:.3f}"]) for row in cells]
    path.write_text("\n".join([head, *warm]) + "\n")
    manifest = tmp_path / "manifest.csv"
    manifest.write_text(f"unit,job,train,test\nFOG-1,train,{run_files[0]},{path}\n")
    told = invoke_json("fleet", manifest, "--model", "M2", "-o", tmp_path / "out")
    assert "kelvin?" in told["again"][0]["why"]
