"""``inspect``, ``noise``, ``import``, ``compare`` and ``demo``: what they print and write."""

from __future__ import annotations

import json

import numpy as np
import pytest

from fogml.runs.shipped import shipped_run
from fogml.validation.floors import floor_of_run


def names(folder):
    return {path.name for path in folder.iterdir()}


def test_inspect_says_what_is_in_a_run(invoke_json, invoke, run_files, tmp_path):
    values = invoke_json("inspect", *run_files)
    assert values["schema"] == "fogml.inspect/1"
    first = values["runs"][0]
    assert (first["run"], first["rows"], first["sample_s"], first["serial_number"]) == (
        "a.csv",
        1500,
        2.0,
        "FOG-1",
    )
    assert [column["name"] for column in first["columns"]] == ["time", "gyro", "T"]
    assert first["temperatures"]["T"]["span"] == pytest.approx(40.0, abs=0.01)
    # 20 (1 - cos(2 pi t / 3000 s)) rises at most by 20 * 2 pi / 3000 s.
    assert first["temperatures"]["T"]["fastest_rise"] == pytest.approx(20 * 2 * np.pi / 3000 * 60, rel=0.01)
    assert first["gaps"]["count"] == 0
    assert sum(first["regimes"]["seconds"].values()) == pytest.approx(3000.0)
    assert names(tmp_path) == {"a.csv", "a.yaml", "b.csv", "b.yaml"}
    out = tmp_path / "out"
    result = invoke("inspect", *run_files, "-o", out)
    assert names(out) == {"inspect.json", "inspect.html", "inspect.config.yaml"}
    assert "a.csv: 1500 rows" in result.stdout
    assert json.loads((out / "inspect.json").read_text()) == values


def test_inspect_counts_the_gaps_of_the_cold_start(invoke_json):
    (run,) = invoke_json("inspect", "shipped:cold-start-x")["runs"]
    recorded = shipped_run("cold-start-x")
    assert run["gaps"]["count"] == len(recorded.gap_starts)
    assert run["gaps"]["stretches"] == run["gaps"]["count"] + 1
    assert sum(run["regimes"]["seconds"].values()) == pytest.approx(
        recorded.span_s - run["gaps"]["total_s"], rel=0.02
    )


@pytest.mark.parametrize(
    ("flag", "expected"), [("--overlapping", (8.71, 1.49, 0.40)), ("--not-overlapping", (7.25, 1.53, 0.28))]
)
def test_noise_of_the_ring_laser(invoke_json, flag, expected):
    values = invoke_json("noise", "shipped:ring-laser-z", flag)
    deviation = dict(zip(values["taus_s"], values["adev"], strict=True))
    assert [deviation[tau] for tau in (1.0, 10.0, 60.0)] == pytest.approx(expected, abs=0.006)
    assert values["overlapping"] is (flag == "--overlapping")


def test_noise_keys_and_files(invoke_json, tmp_path):
    out = tmp_path / "out"
    values = invoke_json("noise", "shipped:ring-laser-x", "-o", out)
    assert names(out) == {"noise.json", "noise.html", "noise.config.yaml"}
    assert (values["schema"], values["unit"]) == ("fogml.noise/1", "deg/h")
    assert len(values["taus_s"]) == len(values["adev"]) == len(values["ci"])
    assert set(values["terms"]) == {"N", "B", "K", "Q", "R"}
    assert set(values["minimum"]) == {"adev", "tau_s"}
    run = shipped_run("ring-laser-x")
    floor = floor_of_run(run, np.ones(len(run), dtype=bool), run.error_deg_h, 100.0)
    told = (values["floor"]["value"][0], *values["floor"]["ci"][0])
    assert told == pytest.approx((floor.value, floor.lower, floor.upper))
    assert values["floor"]["source"] == floor.source and floor.source.endswith("that is loud")
    assert "noise floor" in (out / "noise.html").read_text(encoding="utf-8")
    for (low, high), deviation in zip(values["ci"], values["adev"], strict=True):
        assert low <= deviation <= high
    assert invoke_json("noise", "--config", out / "noise.config.yaml") == values


def test_noise_does_not_read_k_and_r_from_moving_temperature(invoke_json, run_files):
    values = invoke_json("noise", run_files[0])
    assert values["terms"]["K"]["value"] is values["terms"]["R"]["value"] is None
    assert any("temperature moves" in note for note in values["notes"])


PROFILE = """\
schema: fogml.import/1
description: three columns after two lines of text
separator: whitespace
skip_lines: 1
header: true
columns:
  time: {source: ms, unit: ms}
  gyro: {source: gyro, unit: deg/s}
  T: {source: temp, unit: degC}
"""


def test_import_writes_runs_that_can_be_inspected(invoke, invoke_json, tmp_path):
    log = tmp_path / "log.txt"
    lines = [f"{100 * i} {i % 7} {20 + i}" for i in range(50)]
    log.write_text("first line\nms gyro temp\n" + "\n".join(lines) + "\n")
    profile = tmp_path / "mine.yaml"
    profile.write_text(PROFILE)
    out = tmp_path / "runs"
    values = invoke_json("import", log, "--profile", profile, "-o", out)
    assert [run["run"] for run in values["runs"]] == ["log.csv"]
    assert {"log.csv", "import.config.yaml"} <= names(out)
    (run,) = invoke_json("inspect", out / "log.csv")["runs"]
    assert run["rows"] == 50
    assert run["sample_s"] == pytest.approx(0.1)
    (out / "log.yaml").write_text("unit: by hand\n")
    refused = invoke("import", log, "--profile", profile, "-o", out, status=2)
    assert "log.yaml" in refused.stderr and "unit: by hand" in refused.stderr
    assert (out / "log.yaml").read_text() == "unit: by hand\n"


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ((), "no file"),
        (("log.txt",), "no --profile"),
        (("log.txt", "--profile", "ring-laser-static"), "no --out"),
        (("log.txt", "--profile", "nothing", "-o", "out"), "nothing"),
        (("log.txt", "--profile", "ring-laser-static", "-o", "out"), "log.txt"),
    ],
)
def test_import_with_bad_input(invoke, tmp_path, monkeypatch, arguments, message):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "log.txt").write_bytes(bytes(range(256)))
    result = invoke("import", *arguments, status=2)
    assert message in result.stderr
    assert not (tmp_path / "out").exists()


def test_compare(invoke_json, invoke, run_files, tmp_path):
    out = tmp_path / "out"
    train, test = run_files
    arguments = ("compare", train, "--test", test, "--models", "none,mean,polynomial,M3,joint", "-o", out)
    values = invoke_json(*arguments)
    assert names(out) == {"compare.json", "compare.html", "compare.config.yaml"}
    assert values["schema"] == "fogml.compare/1"
    assert list(values["models"]) == ["none", "mean", "polynomial"]
    # M3 wants T_in and T_out, joint wants turns: each is told with its reason.
    assert set(values["failed"]) == {"M3", "joint"}
    assert "T_in" in values["failed"]["M3"]
    rms = {name: model["test"][0]["after"]["rms"] for name, model in values["models"].items()}
    assert rms["polynomial"] < 0.2 * rms["mean"]
    assert invoke_json("compare", "--config", out / "compare.config.yaml") == values
    printed = invoke(*arguments).stdout
    assert "polynomial" in printed
    assert "joint: not fitted" in printed


def test_compare_leaves_one_run_out(invoke_json, invoke, run_files, tmp_path):
    values = invoke_json(
        "compare", *run_files, "--leave-one-out", "--models", "M1,mean", "-o", tmp_path / "out"
    )
    assert [run["run"] for run in values["models"]["M1"]["test"]] == ["a.csv", "b.csv"]
    arguments = ("compare", *run_files, "--models", "M1", "-o", tmp_path / "other")
    assert "--leave-one-out" in invoke(*arguments, status=2).stderr
    assert "--leave-one-out" in invoke(*arguments, "--leave-one-out", "--test", run_files[0], status=2).stderr


def test_compare_where_nothing_fits(invoke, run_files, tmp_path):
    train, test = run_files
    result = invoke("compare", train, "--test", test, "--models", "joint", "-o", tmp_path / "out", status=2)
    assert "joint" in result.stderr
    assert not (tmp_path / "out").exists()


def test_compare_exit_status(invoke, run_files, tmp_path):
    arguments = (
        "compare",
        run_files[0],
        "--test",
        run_files[1],
        "--models",
        "M1,mean",
        "-o",
        tmp_path / "out",
    )
    invoke(*arguments, "--design-index", "1e-6", status=1)
    invoke(*arguments, "--design-index", "10")


def test_compare_with_an_unknown_model(invoke, run_files, tmp_path):
    arguments = ("compare", run_files[0], "--test", run_files[1], "--models", "M1,M9", "-o", tmp_path / "out")
    assert "M9" in invoke(*arguments, status=2).stderr
