"""``fogml export``: files and figures, whole or not at all."""

from __future__ import annotations

import json
import shutil

import pytest
import yaml

from fogml.cli.model_jobs import ExportJobSettings, _print_export
from fogml.cli.terminal import Terminal

pytestmark = pytest.mark.skipif(shutil.which("gcc") is None, reason="gcc is not installed")


@pytest.fixture
def model(trained, tmp_path):
    """A trained model of a test's own."""
    return shutil.copytree(trained(), tmp_path / "model")


def test_c_with_figures(invoke_json, model, tmp_path):
    out = tmp_path / "firmware"
    values = invoke_json("export", model, "--to", "c", "--dtype", "float32", "-o", out)
    written = json.loads((out / "export.json").read_text())
    assert written == values
    assert (values["schema"], values["to"], values["dtype"]) == ("fogml.export/1", "c", "float32")
    assert values["unit"] == "deg/h"
    assert values["bytes_weights"] == 4 * 6
    assert 0.0 <= values["largest_difference"] <= values["tolerance"]
    assert values["operations_per_sample"] > 20
    header = (out / "fogml_model.h").read_text()
    assert "int fogml_step(fogml_state *state, fogml_time time_us, const float *temperatures" in header
    assert "int fogml_self_test(void);" in header
    assert "FOG-1, axis x" in header


def test_the_configuration_gives_the_same_files(invoke, model, tmp_path):
    out = tmp_path / "firmware"
    invoke("export", model, "--dtype", "q31", "--bytes", "400", "-o", out)
    first = {path.name: path.read_bytes() for path in out.iterdir()}
    assert yaml.safe_load((out / "export.config.yaml").read_text())["bytes"] == 400
    again = tmp_path / "again.yaml"
    shutil.move(out / "export.config.yaml", again)
    invoke("export", "--config", again)
    assert {path.name: path.read_bytes() for path in out.iterdir()} == first


def test_training_runs_are_repaired_as_they_were_to_train(invoke, invoke_json, run_files, tmp_path):
    train, test = run_files
    rows = train.read_text().splitlines()
    time, _, temperature = rows[40].split(",")
    train.write_text("\n".join([*rows[:40], f"{time},nan,{temperature}", *rows[41:]]))
    quick = ("--model", "polynomial", "--features", "T", "--repair", "-o", tmp_path / "out")
    invoke("train", train, "--test", test, *quick)
    arguments = ("export", tmp_path / "out", "--to", "json", "--train", train, "-o", tmp_path / "small")
    assert "--repair drops the rows" in invoke(*arguments, status=2).stderr
    assert invoke_json(*arguments, "--repair")["accuracy"]["on"] == "training folds"


def test_training_runs_prune_and_judge(invoke_json, model, run_files, tmp_path):
    arguments = ("--to", "json", "--bytes", "30", "--train", run_files[0], "-o", tmp_path / "small")
    values = invoke_json("export", model, *arguments)
    assert values["bytes_weights"] <= 30
    assert values["accuracy"]["on"] == "training folds"


def test_bytes_that_hold_little_of_the_model_are_told(invoke_json, model, tmp_path, capsys):
    out = tmp_path / "small"
    report = invoke_json("export", model, "--to", "json", "--bytes", "16", "-o", out)
    for share, told in ((0.4, False), (0.6, True)):
        report["pruning"]["rms_difference"] = share * report["pruning"]["model_deviation"]
        _print_export(ExportJobSettings(model=[str(model)], out=str(out)), report, Terminal())
        assert ("or prune on its training runs (--train)" in capsys.readouterr().err) == told


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("--tolerance", "0"), "differs by up to"),
        (("--to", "pdf"), "known are"),
        (("--to", "segmets"), "did you mean 'segments'"),
        (("--bytes", "3"), "too few"),
        (("--sample-s", "200"), "too short"),
    ],
)
def test_refused_and_nothing_written(invoke, model, tmp_path, words, message):
    out = tmp_path / "refused"
    result = invoke("export", model, *words, "-o", out, status=2)
    assert message in result.stderr
    assert "Traceback" not in result.stderr
    assert not out.exists()
    assert not list(tmp_path.glob(".partial-*"))


def test_without_a_compiler_c_is_refused(invoke, model, tmp_path, monkeypatch):
    monkeypatch.setenv("PATH", str(tmp_path))
    result = invoke("export", model, "-o", tmp_path / "refused", status=2)
    assert "no C compiler" in result.stderr


def test_a_table_with_what_it_loses(invoke_json, invoke, model, run_files, tmp_path):
    out = tmp_path / "table"
    values = invoke_json("export", model, "--to", "segments", "--train", run_files[0], "-o", out)
    assert json.loads((out / "export.json").read_text()) == values
    told = values["axes"]["x"]
    assert told["accuracy"]["rms_model"] <= told["accuracy"]["rms_exported"]
    assert (out / "fogml_segments.csv").is_file() and (out / "fogml_segments.h").is_file()
    again = yaml.safe_load((out / "export.config.yaml").read_text())
    assert again["model"] == str(model)
    assert "leave it out" in invoke("export", model, "--to", "px4", "--bytes", 9, status=2).stderr
    assert "takes one model" in invoke("export", model, model, "--to", "onnx", status=2).stderr
    assert "leave it out" in invoke("export", model, "--breakpoints", 4, status=2).stderr
