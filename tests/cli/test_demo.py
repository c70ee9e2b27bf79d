"""``fogml demo``: the main job on the shipped thermal cycle."""

from __future__ import annotations

import json

import pytest
from click.testing import CliRunner

from fogml.cli.main import app


@pytest.fixture(scope="module")
def demo(tmp_path_factory):
    """The folder of a demonstration, and what it printed."""
    out = tmp_path_factory.mktemp("demo") / "results"
    result = CliRunner().invoke(app, ["demo", "-o", str(out)])
    assert result.exit_code == 0, result.output
    return out, result.stdout


def names(folder):
    return {path.name for path in folder.iterdir()}


def test_writes_three_axes_as_train_does(demo):
    out, _ = demo
    assert names(out) == {"x", "y", "z", "index.html", "demo.config.yaml"}
    for axis in "xyz":
        reports = {"report.json", "report.html", "report.xlsx"}
        assert names(out / axis) == {"model", "train.config.yaml", *reports}
        (judged,) = json.loads((out / axis / "report.json").read_text())["test"]
        assert (judged["run"], judged["axis"]) == (f"thermal-cycle-3-{axis}", axis)


def test_does_no_harm(demo):
    for axis in "xyz":
        (judged,) = json.loads((demo[0] / axis / "report.json").read_text())["test"]
        assert judged["after"]["rms"] <= judged["before"]["rms"] + judged["floor"]


def test_says_what_to_open_and_what_the_unit_is(demo):
    out, printed = demo
    assert f"Open {out / 'index.html'}" in printed
    assert "not a fibre-optic gyro" in printed
    page = (out / "index.html").read_text()
    for axis in "xyz":
        assert f"{axis}/report.html" in page


def test_an_axis_is_trained_again_from_its_configuration(demo, invoke_json, tmp_path):
    config = demo[0] / "y" / "train.config.yaml"
    again = invoke_json("train", "--config", config, "-o", tmp_path / "again")
    assert again == json.loads((demo[0] / "y" / "report.json").read_text())


def test_axis_x_is_not_to_be_used(demo):
    out, printed = demo
    told = "Do not use: trained one way"
    assert f"Axis x: ✗ {told}" in printed
    assert told in (out / "x" / "report.html").read_text()
    assert told in (out / "index.html").read_text()
    report = json.loads((out / "x" / "report.json").read_text())
    assert (report["verdict"], report["next_step"]) == ("do_not_use", "Train on a run that goes up and down.")
