"""The acceptance report against a unit whose bias, hysteresis and scale factor are known in closed form."""

from __future__ import annotations

import json
import math
import re
from pathlib import Path

import numpy as np
import openpyxl
import pytest
from click.testing import CliRunner

from fogml.cli.main import app
from fogml.errors import InputError
from fogml.lab.acceptance import acceptance_json
from fogml.lab.acceptance_rows import QUANTITIES, Limit, Limits, read_limits
from fogml.models.names import make_model
from fogml.pictures import Curve
from fogml.report import acceptance_page as page
from fogml.report.acceptance_page import acceptance_page, limit_words, named
from fogml.runs.facts import Facts
from fogml.runs.run import Run
from fogml.runs.writing import write_run
from tests.lab.units import EARTH, SOAKS, Unit, row


@pytest.fixture(scope="module")
def report(cycle):
    """The report of the unit as it is."""
    return acceptance_json([cycle])


def test_soaks_are_those_of_the_unit(report):
    found = {
        (round(line["temperature_degC"]), way): line["before"][way]
        for line in report["soaks"]
        for way in ("start", "up", "down", "hysteresis")
        if line["before"][way] is not None
    }
    bias = {soak: 0.05 + 0.002 * (soak - 25.0) for soak in (-40, -10, 25, 60)}
    expected = {(-40, "start"): bias[-40], (-40, "down"): bias[-40] - 0.015, (60, "up"): bias[60] + 0.015}
    for soak in (-10, 25):
        expected |= {(soak, "up"): bias[soak] + 0.015, (soak, "down"): bias[soak] - 0.015}
        expected[soak, "hysteresis"] = 0.03
    assert found == pytest.approx(expected, abs=5e-4)


def test_rows_are_those_of_the_unit(report):
    assert row(report, "hysteresis")["before"] == pytest.approx(0.03, abs=5e-4)
    assert row(report, "scale_factor_temperature_sensitivity")["before"] == pytest.approx(4.0, abs=0.01)
    mean = np.mean(SOAKS) - 25.0
    assert row(report, "scale_factor_error")["before"] == pytest.approx(120.0 + 4.0 * mean, abs=0.5)
    # The greatest slope from 25 degC: the loop adds to that of -10 degC, reached on the way down.
    sensitivity = row(report, "temperature_sensitivity")["before"]
    assert sensitivity == pytest.approx(0.002 + 0.03 / 35.0, abs=5e-5)
    for key in ("scale_factor_nonlinearity", "scale_factor_asymmetry"):
        assert row(report, key)["before"] == pytest.approx(0.0, abs=0.5)


def test_what_the_run_does_not_tell_is_not_tested(report):
    lacking = {one["quantity"] for one in report["rows"] if not one["tested"]}
    assert {"bias_repeatability", "threshold", "resolution", "turn_on_time", "angle_random_walk"} <= lacking
    for one in report["rows"]:
        assert one["tested"] or (one["before"] is None and one["remark"].startswith("not tested: needs"))
    assert [one["quantity"] for one in report["rows"]] == [one.key for one in QUANTITIES]


def test_repeatability_and_noise_where_runs_tell_them():
    rng = np.random.default_rng(1)
    offsets = 0.02 * rng.standard_normal(6)
    facts = Facts(unit="FOG-0417", axis="z", latitude=39.9, input_axis="up", powered_on=0.0)
    runs = []
    for place, offset in enumerate(offsets):
        gyro = EARTH + offset + 0.1 * rng.standard_normal(3000)
        columns = {"time": np.arange(3000.0), "gyro": gyro, "T": np.full(3000, 25.0)}
        runs.append(Run.from_columns(f"on{place}", facts, **columns))
    values = acceptance_json(runs)
    spread = float(np.std([float(run.gyro.mean()) for run in runs], ddof=1))
    assert row(values, "bias_repeatability")["before"] == pytest.approx(spread, rel=1e-6)
    assert "power cycles" in row(values, "bias_repeatability")["of"]
    # White noise of 0.1 deg/h in a second: N = 0.1 / 60 deg/sqrt(h).
    assert row(values, "angle_random_walk")["before"] == pytest.approx(0.1 / 60.0, rel=0.05)
    assert row(values, "angle_random_walk")["clause"] == "annex C"


def test_after_a_model_the_slope_is_gone_and_the_loop_stays(cycle):
    model = make_model("polynomial", "T").fit([Unit().run("train", seed=5)])
    values = acceptance_json([cycle], model)
    sensitivity = row(values, "temperature_sensitivity")
    # Both biases stand against Earth rate, with nothing taken off.
    assert row(values, "bias")["before"] == pytest.approx(
        cycle.error_deg_h[cycle.rate == 0.0].mean(), abs=2e-3
    )
    assert row(values, "bias")["after"] == pytest.approx(0.0, abs=5e-3)
    # The loop tilts the model's own slope a little.
    assert sensitivity["after"] == pytest.approx(0.03 / 35.0, abs=2e-4)
    assert row(values, "hysteresis")["after"] == pytest.approx(0.03, abs=5e-4)
    assert row(values, "scale_factor_temperature_sensitivity")["after"] == pytest.approx(4.0, abs=0.01)
    assert len(values["model"]["sha256"]) == 64 and values["runs"][0]["sha256"] == cycle.hash
    page = acceptance_page(values)
    assert page.count("not tested") and cycle.hash in page and "零偏温度灵敏度" in page
    fitted = acceptance_json([Unit().run("train", seed=5)], model)
    assert any("trained on this run" in note for note in fitted["notes"])


def test_verdicts(cycle, limits):
    def verdict(**stated):
        return acceptance_json([cycle], limits=limits(**stated))

    assert acceptance_json([cycle])["verdict"] == "no_limits"
    assert verdict(hysteresis=0.05, scale_factor_error={"from": -200, "to": 200})["verdict"] == "accepted"
    rejected = verdict(hysteresis=0.02, threshold=1.0)
    assert rejected["verdict"] == "rejected"
    assert rejected["reasons"][0] == "Thermal hysteresis of the bias is over its limit"
    assert verdict(threshold=1.0)["verdict"] == "incomplete"
    low = verdict(scale_factor_error={"from": 100})
    assert row(low, "scale_factor_error")["met"] is False
    assert low["reasons"] == ["Scale factor error is below its limit"]


def test_a_run_of_training_is_no_test(cycle, limits):
    model = make_model("polynomial", "T").fit([cycle])
    values = acceptance_json([cycle], model, limits(hysteresis=0.05))
    assert values["verdict"] == "incomplete" and "training run" in values["reasons"][0]


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("limits: {drift: 1}", "no quantity 'drift'"),
        ("limits: {bias: -1}", "positive number"),
        ("limits: {bias: {from: 2, to: 1}}", "from and to"),
        ("bias: 1", "'limits' was expected"),
        ("limits: {bias: 1}\nclient: x", "unknown key 'client'"),
    ],
)
def test_faults_of_a_limits_file_are_named(tmp_path, text, told):
    path = tmp_path / "limits.yaml"
    path.write_text(text)
    with pytest.raises(InputError, match=told):
        read_limits(path)


def test_a_gyro_is_named_by_what_is_known_of_it():
    assert named({"serial_number": "FOG-0417", "axis": "z"}) == "FOG-0417, axis z"
    assert named({"serial_number": "FOG-0417", "axis": None}) == "FOG-0417"
    assert named({"serial_number": None, "axis": "z"}) == "unit not stated, axis z"


def test_limits_in_words():
    def words(limit, key="bias"):
        return limit_words({"quantity": key, "limit": limit})

    assert words({"from": -0.1, "to": 0.1}) == "± 0.1"
    assert words({"from": -0.1, "to": 0.1}, "bias_stability") == "≤ 0.1"
    assert words({"from": None, "to": 5.0}) == "≤ 5" and words({"from": 3.0, "to": None}) == "≥ 3"
    assert words({"from": -1.0, "to": 2.0}) == "−1 … 2" and words(None) == ""


def test_runs_of_two_units_are_refused(cycle):
    other = Run.derived("other", cycle.columns, cycle.facts.model_copy(update={"unit": "FOG-9"}))
    with pytest.raises(InputError, match="one gyro; the runs are of unit FOG-0417, FOG-9"):
        acceptance_json([cycle, other])


def test_command_writes_page_sheets_and_json(cycle, tmp_path):
    write_run(cycle, tmp_path / "cycle.csv")
    (tmp_path / "limits.yaml").write_text("limits: {hysteresis: 0.02}\n")
    words = ["lab", "acceptance", tmp_path / "cycle.csv", "--limits", tmp_path / "limits.yaml"]
    result = CliRunner().invoke(app, [*map(str, words), "-o", str(tmp_path / "out")])
    assert result.exit_code == 1 and "Rejected" in result.stdout
    values = json.loads((tmp_path / "out" / "acceptance.json").read_text())
    assert values["verdict"] == "rejected" and values["limits"]["file"] == "limits.yaml"
    sheet = openpyxl.load_workbook(tmp_path / "out" / "acceptance.xlsx")["Acceptance"]
    found = {line[0]: line[6] for line in sheet.iter_rows(min_row=5, values_only=True)}
    assert found["hysteresis"] == pytest.approx(row(values, "hysteresis")["before"])
    soaks = openpyxl.load_workbook(tmp_path / "out" / "acceptance.xlsx")["Soaks"]
    heads = [cell.value for cell in soaks[1]]
    assert [head for head in heads if "before" in head] and not [head for head in heads if "after" in head]
    held = openpyxl.load_workbook(tmp_path / "out" / "acceptance.xlsx")["Stands on"]
    stated = dict(held.iter_rows(min_row=2, max_col=2, values_only=True))
    assert stated["SHA-256 of limits.yaml"] == values["limits"]["sha256"]
    assert stated["SHA-256 of cycle.csv"] == values["runs"][0]["sha256"]
    assert "Rejected" in (tmp_path / "out" / "acceptance.html").read_text()


def test_what_is_written_and_the_example_are_of_the_documented_schema(report, cycle, limits):
    jsonschema = pytest.importorskip("jsonschema")
    text = (Path(__file__).parents[2] / "docs" / "acceptance.md").read_text(encoding="utf-8")
    schema, example = (json.loads(block) for block in re.findall(r"```json\n(.*?)```", text, re.DOTALL))
    check = jsonschema.Draft202012Validator(schema)
    for values in (example, report, acceptance_json([cycle], limits=limits(threshold=1.0))):
        assert not [error.message for error in check.iter_errors(values)]
    assert [error.message for error in check.iter_errors({**example, "verdict": "good"})]


def test_soaks_of_two_runs_are_no_one_line(monkeypatch: pytest.MonkeyPatch) -> None:
    """Of two runs over the same temperatures each is a line of its own, over every temperature once."""
    drawn: list[Curve] = []
    monkeypatch.setattr(page, "line_figure", lambda curves, *_: drawn.extend(curves))
    ways = {"down": None, "start": None, "hysteresis": None}
    soaks = [
        {"run": run, "temperature_degC": at, "before": {"up": bias + at, **ways}}
        for run, bias in (("a.csv", 0.0), ("b.csv", 5.0))
        for at in (-40.0, 60.0)
    ]
    page._figure({"soaks": soaks, "model": None})
    assert [curve.y.tolist() for curve in drawn] == [[-40.0, 60.0], [-35.0, 65.0]]
    assert [curve.label for curve in drawn] == ["way up", ""]


def test_limits_that_python_sets_are_checked_as_those_of_a_file():
    with pytest.raises(InputError, match="no quantity 'bias_stabilty'; did you mean 'bias_stability'"):
        Limits({"bias_stabilty": Limit(-1.0, 1.0)})
    for low, high in ((1.0, -1.0), (math.nan, 1.0)):
        with pytest.raises(InputError, match="the first is the lower one"):
            Limit(low, high)
