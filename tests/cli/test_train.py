"""``fogml train``: what it writes, what it prints, how it ends."""

from __future__ import annotations

import json
import sys

import pytest
import yaml

from fogml.numerals import number
from tests.cli.conftest import csv_text
from tests.report.pages import Page

QUICK = ("--model", "polynomial", "--features", "T, dT")


def test_writes_everything_and_prints_a_table(invoke, run_files, tmp_path):
    train, test = run_files
    out = tmp_path / "out"
    result = invoke("train", train, "--test", test, *QUICK, "-o", out)
    written = {path.name for path in out.iterdir()}
    assert written == {"model", "report.json", "report.html", "report.xlsx", "train.config.yaml"}
    assert "on b.csv, not trained on; noise floor" in result.stdout and "Rms " in result.stdout
    assert "report.html" in result.stdout
    report = json.loads((out / "report.json").read_text())
    (judged,) = report["test"]
    # The drift is linear in T and dT; what is left is the noise: 0.05 / sqrt(50).
    assert judged["after"]["bias_stability"] < 0.02 < 0.3 < judged["before"]["bias_stability"]
    assert judged["floor"] == pytest.approx(0.05 / 50**0.5, rel=0.5)
    assert [run["run"] for run in report["train"]] == ["a.csv"]


def test_json_is_the_result_alone(invoke, run_files, tmp_path):
    train, test = run_files
    result = invoke("train", train, "--test", test, *QUICK, "-o", tmp_path / "out", "--json")
    assert json.loads(result.stdout) == json.loads((tmp_path / "out" / "report.json").read_text())


def test_quiet_prints_nothing(invoke, run_files, tmp_path):
    train, test = run_files
    result = invoke("train", train, "--test", test, *QUICK, "-o", tmp_path / "out", "--quiet")
    assert (result.stdout, result.stderr) == ("", "")


def test_runs_of_one_name_are_told_apart_by_their_folders(invoke, invoke_json, run_files, tmp_path):
    train, test = run_files
    for seed, folder in enumerate(("cold", "hot"), 1):
        (tmp_path / folder).mkdir()
        (tmp_path / folder / "a.csv").write_text(csv_text(seed, low=5.0 * seed))
    tests = [tmp_path / folder / "a.csv" for folder in ("cold", "hot")]
    out = tmp_path / "out"
    told = invoke_json("compare", train, "--test", *tests, "--models", "none,polynomial", "--out", out)
    judged = told["models"]["polynomial"]["test"]
    assert [run["run"] for run in judged] == ["cold/a.csv", "hot/a.csv"]
    # A row of the page's table by run holds a figure of each.
    row = " ".join(number(run["after"]["rms"]) for run in judged)
    assert f"polynomial {row}" in Page((out / "compare.html").read_text()).text
    named = invoke("compare", train, "--test", test, f"{tmp_path}/./b.csv", "--out", out, status=2)
    assert "named more than once; give each run once" in named.stderr


def test_a_faulty_noise_run_is_repaired_as_the_others_are(invoke, invoke_json, run_files, tmp_path):
    train, test = run_files
    rows = csv_text(7).splitlines()
    time, _, temperature = rows[40].split(",")
    rows[40] = f"{time},nan,{temperature}"
    noise = tmp_path / "noise.csv"
    noise.write_text("\n".join(rows))
    arguments = ("train", train, "--test", test, *QUICK, "--noise", noise, "-o", tmp_path / "out")
    assert "--repair drops the rows" in invoke(*arguments, status=2).stderr
    assert invoke_json(*arguments, "--repair")["test"][0]["floor_source"].endswith("noise.csv")


def test_a_static_run_is_not_told_that_its_temperature_stands_still(invoke, run_files, tmp_path):
    train, test = run_files
    noise = tmp_path / "noise.csv"
    rows = [line.split(",") for line in csv_text(7).splitlines()]
    noise.write_text("\n".join([",".join(rows[0]), *(f"{time},{gyro},25.0" for time, gyro, _ in rows[1:])]))
    assert "the temperature spans" in invoke("inspect", noise).stdout
    told = [
        invoke("noise", noise),
        invoke("train", train, "--test", test, *QUICK, "--noise", noise, "-o", tmp_path / "out"),
    ]
    assert not any("the temperature spans" in one.stdout + one.stderr for one in told)


@pytest.mark.parametrize("fact", ["unit", "axis"])
def test_a_noise_run_of_another_unit_is_refused_unless_any_is_allowed(invoke, run_files, tmp_path, fact):
    train, test = run_files
    noise = tmp_path / "noise.csv"
    noise.write_text(csv_text(7))
    noise.with_suffix(".yaml").write_text(f"{fact}: another\n")
    given = ("--test", test, *QUICK, "--noise", noise, "-o", tmp_path / "out")
    told = (
        f"noise.csv: a static run of {fact} 'another', beside runs of '{'FOG-1' if fact == 'unit' else 'x'}'"
    )
    assert told in invoke("train", train, *given, status=2).stderr
    assert told in invoke("train", train, *given, "--any-unit").stderr
    report = ("lab", "acceptance", train, "--noise", noise)
    assert f"{told}; --noise takes one of the same {fact}" in invoke(*report, status=2).stderr


def test_an_unmet_design_index_is_status_1_and_everything_is_written(invoke, run_files, tmp_path):
    train, test = run_files
    out = tmp_path / "out"
    arguments = ("train", train, "--test", test, *QUICK, "-o", out)
    result = invoke(*arguments, "--design-index", "0.0001", status=1)
    assert "NOT met" in result.stdout
    assert (out / "certificate.html").exists()
    report = json.loads((out / "report.json").read_text())
    assert report["design_index"]["met"] is False
    invoke(*arguments, "--design-index", "1")


def test_limits(invoke_json, run_files, tmp_path):
    train, test = run_files
    arguments = ("train", train, "--test", test, *QUICK, "-o", tmp_path / "out")
    report = invoke_json(*arguments, "--limit", "bias_stability=1", "--limit", "range=1e-6", status=1)
    assert [(limit["quantity"], limit["met"]) for limit in report["limits"]] == [
        ("bias_stability", True),
        ("range", False),
    ]


def test_config_is_run_again_with_the_same_numbers(invoke_json, run_files, tmp_path, monkeypatch):
    train, test = run_files
    out = tmp_path / "out"
    first = invoke_json(
        *("train", train, "--test", test, *QUICK, "-o", out, "--averaging", "50", "--seed", "3"),
        *("--limit", "bias_stability=1"),
    )
    config = tmp_path / "again.yaml"
    config.write_text((out / "train.config.yaml").read_text())
    elsewhere = tmp_path / "elsewhere"
    elsewhere.mkdir()
    monkeypatch.chdir(elsewhere)
    assert invoke_json("train", "--config", config) == first
    assert yaml.safe_load(config.read_text())["seed"] == 3
    other = invoke_json("train", "--config", config, "--averaging", "100", "-o", "other")
    assert other["test"][0]["averaging_s"] == 100
    assert (elsewhere / "other" / "report.json").exists()


def test_several_test_runs_after_one_option(invoke_json, run_files, tmp_path):
    train, test = run_files
    again = tmp_path / "c.csv"
    again.write_text(test.read_text())
    report = invoke_json("train", train, "--test", test, again, *QUICK, "-o", tmp_path / "out")
    assert [run["run"] for run in report["test"]] == ["b.csv", "c.csv"]
    report = invoke_json("train", train, "--test", test, "--test", again, *QUICK, "-o", tmp_path / "out")
    assert [run["run"] for run in report["test"]] == ["b.csv", "c.csv"]


def test_a_test_run_outside_training_is_an_error_when_strict(invoke, run_files, tmp_path):
    from tests.cli.conftest import csv_text

    train, _ = run_files
    hot = tmp_path / "hot.csv"
    hot.write_text(csv_text(5, low=30.0))
    out = tmp_path / "out"
    arguments = ("train", train, "--test", hot, *QUICK, "-o", out)
    result = invoke(*arguments, "--strict", status=2)
    assert "outside" in result.stderr
    assert not out.exists()
    assert "outside training" in invoke(*arguments).stdout


def test_another_axis_needs_any_unit(invoke, run_files, tmp_path):
    train, test = run_files
    test.with_suffix(".yaml").write_text("unit: FOG-1\naxis: y\n")
    out = tmp_path / "out"
    result = invoke("train", train, "--test", test, *QUICK, "-o", out, status=2)
    assert "--any-unit" in result.stderr
    assert not out.exists()
    invoke("train", train, "--test", test, *QUICK, "-o", out, "--any-unit")
    assert "axis" in (out / "report.json").read_text()


def test_train_again_searches_on_training_folds(invoke_json, invoke, run_files, tmp_path):
    train, test = run_files
    arguments = ("train", train, "--test", test, "--model", "polynomial", "-o", tmp_path / "out")
    report = invoke_json(*arguments, "--train-again", "--design-index", "0.2")
    assert any("folds of the training runs" in note for note in report["notes"])
    assert report["design_index"]["met"] is True
    result = invoke(*arguments, "--train-again", status=2)
    assert "--design-index" in result.stderr


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("--test", "b.csv"), "no training run"),
        (("a.csv",), "no test run"),
        (("a.csv", "--test", "b.csv", "--model", "rbff"), "did you mean"),
        (("a.csv", "--test", "b.csv", "--features", "T, dX"), "dX"),
        (("a.csv", "--test", "b.csv", "--limit", "speed=3"), "known are"),
        (("a.csv", "--test", "b.csv", "--limit", "rms"), "NAME=VALUE"),
        (("a.csv", "--test", "b.csv", "--averaging", "-5"), "greater than 0"),
        (("a.csv", "--test", "b.csv", "--averaging", "1"), "samples are 2 s apart"),
        (("a.csv", "--test", "b.csv", "--averaging", "2900"), "at least 2"),
        (("a.csv", "--test", "b.csv", "--limit", "scale_factor_error=3"), "no test run tells it"),
        (("a.csv", "a.csv", "--test", "b.csv"), "more than once"),
        (("a.csv", "--test", "none.csv"), "none.csv"),
        (("a.csv", "--test", "shipped:nothing"), "no such recording"),
        (("a.csv", "--test", "b.csv", "-o", "a.csv"), "is itself read"),
        (("a.csv", "--test", "b.csv", "-o", "a.csv/out"), "a.csv"),
    ],
)
def test_bad_usage_is_one_message_and_nothing_is_written(invoke, run_files, monkeypatch, arguments, message):
    folder = run_files[0].parent
    monkeypatch.chdir(folder)
    before = sorted(folder.iterdir())
    features = () if "--features" in arguments or "rbff" in arguments else ("--features", "T, dT")
    model = () if "--model" in arguments else ("--model", "polynomial")
    result = invoke("train", *arguments, *features, *model, status=2)
    assert message in result.stderr
    assert "Traceback" not in result.stderr
    assert result.stdout == ""
    assert sorted(folder.iterdir()) == before


def test_an_unknown_key_in_the_configuration(invoke, run_files, tmp_path):
    config = tmp_path / "mine.yaml"
    config.write_text("runs: [a.csv]\ntest: [b.csv]\nmodle: M1\n")
    result = invoke("train", "--config", config, "-o", tmp_path / "out", status=2)
    assert result.stderr == (
        "fogml: mine.yaml: unknown key 'modle'; did you mean 'model'? known keys are seed, averaging, "
        "design_index, limits, turn_on_band, noise, runs, test, model, features, parameters, train_again, "
        "from_diagnosis, causes, navigation, axis, repair, strict, any_unit, out\n"
    )
    assert not (tmp_path / "out").exists()


def test_turns_are_told(invoke, tmp_path):
    rate = [0.0] * 600 + [10.0] * 60 + [-10.0] * 60 + [0.0] * 600
    lines = ["time [s],gyro [deg/h],T [degC],rate [deg/s]"]
    lines += [f"{i},{3600 * r * 1.0005:.6f},{20 + i / 100},{r}" for i, r in enumerate(rate)]
    for name in ("a.csv", "b.csv"):
        (tmp_path / name).write_text("\n".join(lines) + "\n")
    arguments = ("--model", "mean", "-o", tmp_path / "out")
    result = invoke("train", tmp_path / "a.csv", "--test", tmp_path / "b.csv", *arguments)
    told = [line.split() for line in result.stdout.splitlines()]
    assert ["Scale-factor", "error", "500", "500", "ppm"] in told


def test_a_test_run_that_was_trained_on_is_told(invoke, run_files, tmp_path):
    same, other = (
        invoke("train", run_files[0], "--test", test, *QUICK, "-o", tmp_path / name)
        for test, name in ((run_files[0], "same"), (run_files[1], "other"))
    )
    told = "its figures say nothing of a run not trained on"
    assert told in " ".join(same.stdout.split()) and told in (tmp_path / "same" / "report.html").read_text()
    assert told not in " ".join(other.stdout.split())


def test_a_closed_folder_is_found_before_training(invoke, run_files, tmp_path, monkeypatch):
    monkeypatch.setattr("os.access", lambda *_: False)
    result = invoke("train", run_files[0], "--test", run_files[1], *QUICK, "-o", tmp_path / "out", status=2)
    assert "no permission to write" in result.stderr
    assert not (tmp_path / "out").exists()


def test_a_failure_while_writing_leaves_nothing(invoke, run_files, tmp_path, monkeypatch):

    def full(*_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(sys.modules["fogml.report.train_page"], "train_page", full)
    result = invoke("train", run_files[0], "--test", run_files[1], *QUICK, "-o", tmp_path / "out", status=2)
    assert "No space left" in result.stderr
    assert not (tmp_path / "out").exists()
    assert not list(tmp_path.glob(".partial-*"))
