"""``fogml plan``: what it writes, and what it refuses."""

from __future__ import annotations

import json
from functools import partial

import numpy as np
import pytest
import yaml

from fogml.gap.planning.plan import plan_runs
from fogml.report.plan_page import verdict_sentences
from fogml.runs.reading import read_run
from fogml.twin.programme import load_programme


@pytest.fixture(autouse=True)
def few_programmes_tried(monkeypatch):
    """How well the search does is tested of `plan_runs` itself."""
    monkeypatch.setattr("fogml.cli.plan_job.plan_runs", partial(plan_runs, most=12))


def test_plan_then_simulate(tmp_path, invoke, invoke_json, monkeypatch):
    out = tmp_path / "plan"
    ask = ("plan", "--want", "k1", "--separate", "thermal_hysteresis,stress_relaxation", "--hours", "5")
    values = invoke_json(*ask, "--criterion", "a", "--input-axis", "up", "-o", out)
    assert values["schema"] == "fogml.plan/1" and values == json.loads((out / "plan.json").read_text())
    assert values["criterion"] == "A" and values["total_hours"] <= 5.0
    (wanted,) = values["wanted"]
    assert (
        wanted["name"] == "k1" and wanted["unit"] == "ppm/degC" and wanted["se"] < wanted["prior_se"] == 50.0
    )
    (apart,) = values["separations"]
    assert apart["distance"] == min(pair["distance"] for pair in apart["pairs"])
    assert "synthetic" in values["data"] and values["assumed"]
    told = {r["effect"]: r for r in values["rehearsal"] if r["form"] == "usual"}
    assert "thermal_hysteresis" in told and {r["size"] for r in told.values()} == {"usual"}
    assert all((r["outcome"] == "missed") == (not r["named_as"]) for r in told.values())
    # What hardly shows can't be named.
    assert {r["outcome"] for r in told.values() if r["length"] < 2.0} == {"missed"}
    programme = load_programme(out / "programme.yaml")
    assert programme.total_hours == pytest.approx(values["runs"][0]["hours"])
    profile = values["runs"][0]["profile"]
    assert profile["set_point"]["time_s"][-1] == pytest.approx(3600.0 * programme.total_hours)
    page = (out / "plan.html").read_text()
    assert "What a diagnosis of these runs would name" in page
    assert "Expected standard errors" in page and "http-equiv" in page and 'src="http' not in page
    run = tmp_path / "run.csv"
    invoke(
        "simulate", "--programme", out / "programme.yaml", "--twin", "nominal", "--sample", "60", "-o", run
    )
    first = read_run(run)
    # The simulation's own file states the set-up as well, and the heat that is assumed.
    config = yaml.safe_load((out / "simulation.yaml").read_text())
    assert config["facts"]["input_axis"] == "up"
    monkeypatch.chdir(out)
    invoke("simulate", "simulation.yaml", "--sample", "60", "-o", tmp_path / "again.csv")
    again = read_run(tmp_path / "again.csv")
    coil = values["runs"][0]["profile"]["coil"]
    expected = np.interp(again.time, coil["time_s"], coil["value"])
    off, without = (np.abs(run.columns["T_in"] - expected) for run in (again, first))
    assert np.median(off) < 0.5 and np.median(without) > 2.0


def test_a_programme_carries_the_mounting_and_a_simulation_what_is_recorded(tmp_path, invoke_json, invoke):
    out = tmp_path / "plan"
    ask = ("plan", "--want", "b1,m", "--hours", "5", "--input-axis", "east", "--columns", "T,rate")
    values = invoke_json(*ask, "--fastest-ramp", "1.5", "--no-yaw", "--fastest-turn", "0", "-o", out)
    assert [one["name"] for one in values["wanted"]] == ["b1", "m"]
    assert (values["fastest_ramp_degC_min"], values["fastest_turn_deg_s"]) == (1.5, 0.0)
    runs = tmp_path / "by-hand.csv", tmp_path / "by-file.csv"
    invoke("simulate", "--programme", out / "programme.yaml", "--sample", "60", "-o", runs[0])
    invoke("simulate", out / "simulation.yaml", "--sample", "60", "-o", runs[1])
    assert [read_run(run).facts.input_axis for run in runs] == ["east", "east"]
    assert set(read_run(runs[1]).columns) == {"time", "gyro", "T", "rate"}


def test_the_verdict_tells_what_a_diagnosis_would_not_name():
    apart = {"separates": ["thermal_hysteresis", "stress_relaxation"], "distance": 7.0, "enough": True}
    rehearsal = [
        {"effect": "thermal_hysteresis", "form": "usual", "outcome": "named"},
        {"effect": "stress_relaxation", "form": "usual", "outcome": "missed"},
        {"effect": "stress_relaxation", "form": "low", "outcome": "named"},
        {"effect": "ageing", "form": "usual", "outcome": "missed"},
    ]
    values = {"wanted": [], "separations": [apart], "runs": [{}], "total_hours": 9.0, "rehearsal": rehearsal}
    assert verdict_sentences(values)[-1].endswith("would not name stress_relaxation of usual size.")
    assert "It tells" in verdict_sentences({**values, "rehearsal": []})[-1]


def test_the_configuration_gives_the_same_plan_again(tmp_path, invoke_json, invoke):
    config = tmp_path / "plan.yaml"
    config.write_text("want: [coil_expansion]\nhours: 3.8\nruns: 2\n")
    values = invoke_json("plan", "--config", config, "-o", tmp_path / "one")
    assert [run["programme"] for run in values["runs"]] == ["programme.yaml", "programme-2.yaml"]
    written = tmp_path / "one" / "plan.config.yaml"
    assert values == invoke_json("plan", "--config", written, "-o", tmp_path / "two")
    # It is k1 under another name, and the page says that it does not show.
    assert not values["wanted"][0]["shown"]
    assert "the best programme does not show" in (tmp_path / "one" / "plan.html").read_text()


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ((), "nothing is asked for"),
        (("--want", "thermal_histeresis"), "did you mean 'thermal_hysteresis'"),
        (("--want", "k1", "--hours", "1"), "the shortest programme"),
        (("--want", "k1", "--hours", "nan"), "hours"),
        (("--want", "k1", "--criterion", "X"), "D or A was expected"),
        (("--want", "k1", "--twin", "nothing.yaml"), "nothing.yaml"),
        (("--want", "k1", "--coldest", "40"), "temperature limits"),
        (("--want", "k1", "--input-axis", "sideways"), "input_axis"),
        (("--want", "k1", "--fastest-ramp", "0"), "'fastest_ramp' is 0"),
        (("--want", "k1", "--columns", "T_foo"), "can't be recorded"),
    ],
)
def test_faults(tmp_path, invoke, arguments, message):
    out = tmp_path / "plan"
    result = invoke("plan", *arguments, "-o", out, status=2)
    assert message in result.stderr and not out.exists()
