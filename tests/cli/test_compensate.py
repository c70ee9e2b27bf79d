"""``fogml compensate``: the numbers of the model, in the run's own columns, or one message."""

from __future__ import annotations

import json
import shutil

import numpy as np
import pytest
import yaml

from fogml.json_files import content_hash
from fogml.models.saved import load_model
from fogml.runs.reading import read_run
from fogml.runs.shipped import shipped_run
from tests.cli.conftest import csv_text

ADDED = ["drift", "gyro_compensated", "flag"]


@pytest.fixture
def model(trained, tmp_path):
    """A trained model of a test's own."""
    return shutil.copytree(trained("--features", "T, dT"), tmp_path / "model")


@pytest.mark.parametrize("suffix", [".csv", ".parquet"])
def test_equals_the_model_on_the_whole_run(invoke_json, model, run_files, tmp_path, suffix):
    out = tmp_path / f"out{suffix}"
    values = invoke_json("compensate", run_files[1], "--model", model, "-o", out)
    run, written = read_run(run_files[1]), read_run(out)
    expected = load_model(model).compensate(run)
    assert list(written.columns) == [*run.columns, *ADDED]
    for name in run.columns:
        np.testing.assert_allclose(written.columns[name], run.columns[name], rtol=1e-12, atol=1e-12)
    np.testing.assert_allclose(written.columns["drift"], expected.drift, rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(written.columns["gyro_compensated"], expected.compensated, atol=1e-9)
    np.testing.assert_array_equal(written.columns["flag"], expected.flag)
    assert values["rows"] == len(run)
    assert list(values["flags"].values()) == np.bincount(expected.flag, minlength=3).tolist()
    assert written.facts == run.facts


def test_a_shipped_run(invoke_json, tmp_path):
    out = tmp_path / "out"
    arguments = ("--averaging", "10", "-o", out)
    told = invoke_json(
        "train", "shipped:thermal-cycle-2-x", "--test", "shipped:thermal-cycle-3-x", *arguments
    )
    written = tmp_path / "written.csv"
    values = invoke_json("compensate", "shipped:thermal-cycle-3-x", "--model", out / "model", "-o", written)
    assert len(read_run(written)) == values["rows"] == len(shipped_run("thermal-cycle-3-x"))
    # What was chosen has one name.
    assert values["model"] == told["model"]["kind"] != "auto"


def test_samples_outside_training_are_flagged(invoke_json, model, tmp_path):
    hot = tmp_path / "hot.csv"
    hot.write_text(csv_text(3, low=30.0))
    values = invoke_json("compensate", hot, "--model", model, "-o", tmp_path / "out.csv")
    assert values["flags"]["outside_training"] > 0
    assert values["flags"]["window_not_full"] > 0


def test_the_configuration_gives_the_same_file(invoke, model, run_files, tmp_path):
    out = tmp_path / "out.csv"
    invoke("compensate", run_files[1], "--model", model, "-o", out)
    first = out.read_bytes()
    config = tmp_path / "out.compensate.config.yaml"
    assert yaml.safe_load(config.read_text())["model"] == str(model)
    out.unlink()
    invoke("compensate", "--config", config)
    assert out.read_bytes() == first


def test_another_unit_is_refused_unless_allowed(invoke, model, run_files, tmp_path):
    run_files[1].with_suffix(".yaml").write_text("unit: FOG-2\naxis: x\n")
    out = tmp_path / "out.csv"
    result = invoke("compensate", run_files[1], "--model", model, "-o", out, status=2)
    assert "FOG-2" in result.stderr
    assert "--any-unit" in result.stderr
    assert not list(tmp_path.glob("out*"))
    told = invoke("compensate", run_files[1], "--model", model, "-o", out, "--any-unit").stderr
    assert "unit 'FOG-2', but the model was trained on unit" in told
    notes = yaml.safe_load(out.with_suffix(".yaml").read_text())["notes"]
    assert "unit 'FOG-2', but the model was trained on unit" in notes


def test_earth_rate_that_the_model_holds_is_told(invoke, model, run_files, tmp_path):
    run_files[1].with_suffix(".yaml").write_text("unit: FOG-1\naxis: x\nlatitude: 39.9\ninput_axis: down\n")
    out = tmp_path / "out.csv"
    told = invoke("compensate", run_files[1], "--model", model, "-o", out).stderr
    assert "the model's drift holds the Earth rate of the training attitude" in told
    assert "Earth rate" in yaml.safe_load(out.with_suffix(".yaml").read_text())["notes"]


@pytest.mark.parametrize("name", ["model.json", "weights.safetensors"])
def test_a_model_file_cut_short(invoke, model, run_files, tmp_path, name):
    path = model / name
    path.write_bytes(path.read_bytes()[:-20])
    result = invoke("compensate", run_files[1], "--model", model, "-o", tmp_path / "out.csv", status=2)
    assert name in result.stderr
    assert "Traceback" not in result.stderr
    assert not list(tmp_path.glob("out*"))


def test_a_key_added_to_a_model_file(invoke, model, run_files, tmp_path):
    path = model / "model.json"
    path.write_text(json.dumps({**json.loads(path.read_text()), "extra": 1}))
    result = invoke("compensate", run_files[1], "--model", model, "-o", tmp_path / "out.csv", status=2)
    assert "changed" in result.stderr


def test_a_model_of_the_first_version_says_what_is_another(invoke, model, run_files, tmp_path):
    path = model / "model.json"
    document = json.loads(path.read_text())
    document["card"]["fogml_version"] = "0.1.0"
    del document["sha256"]
    weights = (model / "weights.safetensors").read_bytes()
    document["sha256"] = content_hash(document, {"weights.safetensors": weights})
    path.write_text(json.dumps(document))
    asked = ("compensate", run_files[1], "--model", model, "-o", tmp_path / "out.csv")
    told = " ".join(invoke(*asked).stderr.split())
    assert told.count("made by fogml 0.1.0") == 1 and "In the first 128 s of a run" in told
    assert "Warning" not in told
    assert invoke(*asked, "--quiet").stderr == ""


def test_a_fault_late_in_the_run_leaves_nothing(invoke, model, run_files, tmp_path):
    text = run_files[1].read_text().splitlines()
    text[-5] = "2990.0,fault,1.0"
    run_files[1].write_text("\n".join(text) + "\n")
    result = invoke("compensate", run_files[1], "--model", model, "-o", tmp_path / "out.csv", status=2)
    assert "b.csv" in result.stderr
    assert not list(tmp_path.glob("out*"))
    assert not list(tmp_path.glob(".partial*"))


def test_bad_usage(invoke, model, run_files, tmp_path):
    run, out = run_files[1], tmp_path / "out.csv"
    assert "no run" in invoke("compensate", status=2).stderr
    assert "no --model" in invoke("compensate", run, status=2).stderr
    assert "no --out" in invoke("compensate", run, "--model", model, status=2).stderr
    assert "is itself read" in invoke("compensate", run, "--model", model, "-o", run, status=2).stderr
    assert "none" in invoke("compensate", run, "--model", tmp_path / "none", "-o", out, status=2).stderr
    wrong = invoke("compensate", run, "--model", model, "-o", tmp_path / "out.txt", status=2)
    assert ".csv" in wrong.stderr
    below = invoke("compensate", run, "--model", model, "-o", run / "out.csv", status=2)
    assert "b.csv" in below.stderr
    assert not list(tmp_path.glob("out*"))


def test_a_run_without_the_temperature_that_the_model_needs(invoke, model, run_files, tmp_path):
    run_files[1].write_text(run_files[1].read_text().replace("T [degC]", "T_chamber [degC]"))
    result = invoke("compensate", run_files[1], "--model", model, "-o", tmp_path / "out.csv", status=2)
    assert "'T'" in result.stderr


def test_what_a_memory_waits_for_is_told_with_what_is_left_there(invoke, run_files, tmp_path):
    """A play of half width 15 degC is told once the run has spanned 30 of its 40 degC."""
    runs, out = (run_files[0], "--test", run_files[1], "--model", "polynomial"), tmp_path / "out"
    told = invoke("train", *runs, "--features", "T, play(T, 15 degC)", "-o", out).stdout
    assert "windows are full and its memories settled (flag 2)" in " ".join(told.split())
    (run,) = json.loads((out / "report.json").read_text())["test"]
    temperature = read_run(run_files[1]).temperature("T")
    share = float(np.mean(np.maximum.accumulate(temperature) - temperature[0] < 30.0))
    assert run["not_settled"] == pytest.approx(share, abs=0.01)
    words = invoke("compensate", run_files[1], "--model", out / "model", "-o", tmp_path / "c.csv").stdout
    assert "play(T, 15 degC): go by what was before" in " ".join(words.split())
    alone = invoke("train", *runs, "--features", "T, T^2", "-o", tmp_path / "alone").stdout
    assert "flag 2" not in alone
