"""``fogml diagnose``: what it writes, that its twin replays to its figures, and what it refuses."""

from __future__ import annotations

import base64
import json
import math
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import yaml
from click.testing import CliRunner

from fogml.cli.diagnose_job import _print
from fogml.cli.main import app
from fogml.cli.terminal import Terminal
from fogml.gap.diagnosis import diagnose
from fogml.gap.result import Estimate
from fogml.gap.units import SharedCause, UnitsDiagnosis
from fogml.runs.reading import read_run
from fogml.runs.run import Run
from fogml.runs.writing import write_run
from fogml.twin.programme import load_programme
from fogml.twin.simulate import simulate
from fogml.twin.twin_file import load_twin
from tests.cli.conftest import run_program
from tests.report.diagnoses import every_diagnosis
from tests.report.pages import Page

RAMP = "1 degC/min"
PROGRAMMES = {
    "a": (25, 55, -10, 25),
    "b": (25, 0, 50, 20),
    "c": (25, 45, 5, 30),
}
HYSTERESIS = 0.3
SAMPLE_S = 30.0
LAB = {"hours": 14, "coldest": -15, "hottest": 45, "fastest_ramp": 0.8, "fastest_turn": 5}
"""What the lab can do for the next run."""


def steps(levels: tuple[int, ...]) -> list[str]:
    """Soaks at the given temperatures [degC] with ramps between."""
    told = [f"soak at {levels[0]} degC for 30 min"]
    for level in levels[1:]:
        told += [f"ramp to {level} degC at {RAMP}", f"soak at {level} degC for 40 min"]
    return told


@pytest.fixture(scope="module")
def runs(tmp_path_factory) -> dict[str, Path]:
    """Three runs of one synthetic unit with hysteresis of the bias."""
    twin = load_twin("nominal").with_nominal(b0=2.0, b1=0.02, e0=100.0, m=0.5)
    twin = twin.with_effect("thermal_hysteresis", HYSTERESIS, half_width=8.0)
    folder = tmp_path_factory.mktemp("runs")
    paths = {}
    for seed, (name, levels) in enumerate(PROGRAMMES.items(), start=1):
        columns = ["T_in", "T_out", "rate"]
        made = simulate(load_programme(steps(levels)), twin, sample_s=SAMPLE_S, seed=seed, columns=columns)
        paths[name] = folder / f"{name}.csv"
        write_run(made.run, paths[name])
    return paths


@pytest.fixture(scope="module")
def diagnosed(runs, tmp_path_factory) -> Path:
    """The folder that a diagnosis of the three wrote."""
    out = tmp_path_factory.mktemp("diagnosis") / "out"
    given = [str(runs["a"]), str(runs["b"]), "--held-out", str(runs["c"]), "--out", str(out)]
    lab = [word for limit in LAB.items() for word in ("--lab", "{}={}".format(*limit))]
    result = CliRunner().invoke(app, ["diagnose", *given, "--rehearse", *lab], catch_exceptions=False)
    assert result.exit_code == 0, result.stderr
    assert re.search("Verdict: (explained|ambiguous)", result.stdout)
    return out


@pytest.fixture(scope="module")
def gap(diagnosed) -> dict:
    return json.loads((diagnosed / "gap.json").read_text())


def test_what_is_written(diagnosed):
    written = sorted(path.name for path in diagnosed.iterdir())
    files = ["diagnose.config.yaml", "gap.html", "gap.json", "next-run.yaml", "twin.yaml", "what-if.html"]
    assert written == files
    assert re.search("<h1>(Explained|Ambiguous)", (diagnosed / "gap.html").read_text(encoding="utf-8"))


def test_the_next_run_is_a_programme_to_simulate(diagnosed, gap):
    programme = load_programme(str(diagnosed / "next-run.yaml"))
    assert math.isclose(programme.total_hours, gap["separating_run"]["hours"])
    assert gap["separating_run"]["programme"] == (diagnosed / "next-run.yaml").read_text(encoding="utf-8")
    assert 0.0 < programme.total_hours <= LAB["hours"]
    set_points, rates = programme.schedule.set_point.arrays, programme.schedule.table_rate.values
    assert LAB["coldest"] <= set_points[1].min() < set_points[1].max() <= LAB["hottest"]
    slopes = np.abs(np.diff(set_points[1])) / np.diff(set_points[0] / 60.0)
    assert slopes.max() <= LAB["fastest_ramp"] * (1.0 + 1e-9)
    assert max(map(abs, rates), default=0.0) <= LAB["fastest_turn"]
    # Mounted as the runs were.
    assert programme.input_axis == "up"


def test_gap_json_holds_every_key(gap):
    assert gap["schema"] == "fogml.gap/1"
    assert (gap["runs"]["fit"], gap["runs"]["held_out"], gap["runs"]["noise"]) == (
        ["a.csv", "b.csv"],
        ["c.csv"],
        None,
    )
    assert set(gap) >= {"verdict", "which", "unknown", "where", "how_far", "undetectable", "separating_run"}
    assert set(gap["unknown"]) >= {"probability", "looks_like"}
    keys = {
        "stage": {"name", "share"},
        "regime": {"name", "excess_rms", "unit", "share"},
        "temperature": {"from", "to", "excess_rms", "unit"},
        "timescale": {"tau_s", "excess"},
        "segments": {"run", "from_s", "to_s", "excess_rms", "unit"},
    }
    assert set(gap["where"]) == set(keys)
    for name, wanted in keys.items():
        assert gap["where"][name], name
        assert all(set(item) >= wanted for item in gap["where"][name]), name
    for name in ("stage", "regime"):
        assert math.isclose(sum(item["share"] for item in gap["where"][name]), 1.0)
    (far,) = gap["how_far"]
    wanted = {
        "run",
        "averaging_s",
        "unit",
        "before",
        "recalibrated",
        "after",
        "floor",
        "closed",
        "closed_ci90",
    }
    assert set(far) >= wanted and far["run"] == "c.csv" and len(far["closed_ci90"]) == 2


def test_the_effect_is_named_with_its_size(gap):
    assert gap["verdict"] in ("explained", "ambiguous")
    found = gap["which"][0]
    assert set(found) >= {"effect", "class", "probability", "amplitude", "parameters"}
    # With Earth rate known a hysteresis of the scale factor looks the same on a table at rest.
    assert found["effect"] == "thermal_hysteresis"
    assert set(found["class"]) <= {"thermal_hysteresis", "sf_hysteresis"}
    assert found["probability"] >= 0.5 > gap["unknown"]["probability"]
    amplitude = found["amplitude"]
    assert amplitude["unit"] == "deg/h"
    assert abs(amplitude["value"] - HYSTERESIS) < 4.0 * amplitude["se"] < 0.2
    assert set(found["parameters"]["half_width"]) == {"value", "se", "unit"}


def test_what_if_and_the_rehearsal_agree_with_what_was_found(diagnosed, gap):
    (far,) = gap["how_far"]
    assert far["closed"] > 0.9
    alone = [w for w in gap["what_if"] if w["effect"] == "thermal_hysteresis" and not w["beside"]]
    assert alone[0]["closed"] == pytest.approx(far["closed"], abs=0.1)
    rehearsed = [r for r in gap["rehearsal"] if r["effect"] == "thermal_hysteresis" and r["size"] == "found"]
    assert {r["outcome"] for r in rehearsed} == {"named"}
    page = (diagnosed / "gap.html").read_text(encoding="utf-8")
    assert "What these runs would name" in page and "What if: with each candidate" in page
    assert gap["headline"][0] in page


def test_what_is_suspected_is_told_beside_what_was_found(capsys):
    found = every_diagnosis()["explained"]
    suspected = replace(found.found[0], effect="moisture", members=("moisture", "ageing"), probability=0.72)
    for case in (found, replace(found, suspected=(suspected,))):
        _print(case, Terminal())
        told = " ".join(capsys.readouterr().out.split())
        said = "Suspected, and not sure enough to be named: moisture or ageing (72 %)"
        assert (said in told) == bool(case.suspected)


def test_segments_lie_within_their_run(gap, runs):
    for segment in gap["where"]["segments"]:
        end = read_run(runs[segment["run"][0]]).span_s
        assert segment["run"] in gap["runs"]["fit"]
        assert segment["from_s"] >= -SAMPLE_S and segment["to_s"] <= end + SAMPLE_S
        assert segment["to_s"] - segment["from_s"] >= 600.0


def test_the_written_twin_has_the_effect_and_replays_the_run_held_out(diagnosed, gap, runs, tmp_path, invoke):
    written = load_twin(diagnosed / "twin.yaml").settings["thermal_hysteresis"]
    # The twin's goes with its constants, the one of the cause is beside all that acts.
    told = gap["which"][0]["amplitude"]
    assert written.amplitude == pytest.approx(told["value"], abs=told["se"])
    assert written.amplitude == pytest.approx(HYSTERESIS, rel=0.1)
    out = tmp_path / "replayed.parquet"
    invoke("replay", diagnosed / "twin.yaml", runs["c"], "-o", out)
    recorded = read_run(runs["c"])
    left = recorded.gyro_deg_h - read_run(out).columns["replayed"]
    # The nominal model's change of temperature reaches back over the last 128 s.
    left = left[recorded.time - recorded.time[0] >= 128.0]
    (far,) = gap["how_far"]
    width = round(far["averaging_s"] / SAMPLE_S)
    averages = left[: len(left) // width * width].reshape(-1, width).mean(axis=1)
    # It has the catalogue's form, near the family's but not the same.
    assert np.sqrt(np.mean(averages**2)) < 0.7 * far["recalibrated"]
    assert far["after"] < 0.7 * far["recalibrated"]


def test_the_written_settings_hold_what_was_asked(diagnosed, runs):
    settings = yaml.safe_load((diagnosed / "diagnose.config.yaml").read_text())
    assert settings["twin"] == "nominal" and settings["rehearse"]
    assert settings["runs"] == [str(runs["a"]), str(runs["b"])]
    assert settings["held_out"] == [str(runs["c"])]


def test_the_page_tells_the_figures_of_the_json(diagnosed, gap):
    page = Page((diagnosed / "gap.html").read_text(encoding="utf-8"))
    (far,) = gap["how_far"]
    assert f"{100 * far['closed']:.0f} %" in page.text
    assert "synthetic" in page.text and "Thermal hysteresis of the bias" in page.text


def rewritten(path: Path, folder: Path, name: str, **changes) -> Path:
    """A run under another name, with columns or facts changed."""
    run = read_run(path)
    facts = run.facts.model_copy(update=changes.pop("facts", {}))
    rows = changes.pop("rows", slice(None))
    columns = {key: values[rows] for key, values in ({**run.columns} | changes).items()}
    target = folder / name
    write_run(Run.from_columns(name, facts, **columns), target)
    return target


def refused(invoke, tmp_path: Path, *arguments: object) -> str:
    """The one message of a refusal that writes nothing."""
    out = tmp_path / "refused"
    result = invoke("diagnose", *arguments, "--out", out, status=2)
    assert not out.exists() and result.stdout == ""
    assert len(result.stderr.strip().splitlines()) <= 4 and "Traceback" not in result.stderr
    return " ".join(result.stderr.split())


def test_a_held_out_run_that_is_a_fit_run(runs, tmp_path, invoke):
    told = refused(invoke, tmp_path, runs["a"], runs["c"], "--held-out", runs["c"])
    assert "c.csv" in told and "held out" in told
    copy = tmp_path / "copy.csv"
    copy.write_bytes(runs["c"].read_bytes())
    told = refused(invoke, tmp_path, runs["a"], runs["c"], "--held-out", copy)
    assert "copy.csv" in told and "c.csv" in told


def test_runs_of_different_units(runs, tmp_path, invoke, monkeypatch):
    one = rewritten(runs["a"], tmp_path, "one.csv", facts={"unit": "FOG/1"})
    other = rewritten(runs["b"], tmp_path, "other.csv", facts={"unit": "FOG-2"})
    told = refused(invoke, tmp_path, one, "--held-out", other)
    assert "different units" in told and "FOG-2" in told and "other.csv" in told
    told = refused(invoke, tmp_path, one, other, "--rehearse")
    assert "of one unit at a time" in told
    asked = {}

    def together(model, fit, held_out, *, noise, **rest):
        """Each unit's own answer, and a cause of both."""
        asked.update(fit=[(r.name, r.facts.unit) for r in fit], held_out=held_out, noise=noise)
        own = replace(next(iter(every_diagnosis().values())), effects=(), constants=(), separating_run=None)
        sizes = {"FOG/1": Estimate(0.3, 0.01, "deg/h"), "FOG-2": Estimate(0.4, 0.01, "deg/h")}
        mean = Estimate(0.35, 0.05, "deg/h")
        cause = SharedCause("thermal_hysteresis", 0.97, sizes, mean, 0.07, (-0.2, 0.9), "deg/h")
        return UnitsDiagnosis({"FOG/1": own, "FOG-2": own}, (cause,))

    monkeypatch.setattr("fogml.cli.diagnose_job.diagnose_units", together)
    monkeypatch.setattr(
        "fogml.gap.result.Diagnosis.write_model", lambda self, model, path: path.write_text("")
    )
    out = tmp_path / "both"
    said = invoke("diagnose", one, other, "--out", out).stdout
    assert asked == {"fit": [("one.csv", "FOG/1"), ("other.csv", "FOG-2")], "held_out": [], "noise": []}
    told = json.loads((out / "units.json").read_text(encoding="utf-8"))
    assert told["folders"] == {"FOG/1": "FOG_1", "FOG-2": "FOG-2"}
    for folder in told["folders"].values():
        assert {p.name for p in (out / folder).iterdir()} == {"gap.json", "gap.html", "twin.yaml"}
    assert told["shared"][0]["sizes"]["FOG-2"]["value"] == 0.4
    page = (out / "units.html").read_text(encoding="utf-8")
    assert set(re.findall(r'href="([^"]*)"', page)) == {"FOG_1/gap.html", "FOG-2/gap.html"}
    assert "−0.200 … 0.900" in page and "units.html" in said
    assert "the next unit's lies between −0.2 and 0.9 deg/h" in " ".join(said.split())


def test_no_temperature_that_moves(runs, tmp_path, invoke):
    flat = np.full(len(read_run(runs["a"])), 25.0)
    still = rewritten(runs["a"], tmp_path, "still.csv", T_in=flat, T_out=flat)
    told = refused(invoke, tmp_path, still, "--held-out", runs["c"])
    assert "still.csv" in told and "temperature moves by 0" in told


def test_a_twin_with_an_unknown_effect(runs, tmp_path, invoke):
    twin = tmp_path / "own.yaml"
    twin.write_text("schema: fogml.twin/1\nname: own\neffects:\n  thermal_hysteresys: {amplitude: 0.1}\n")
    told = refused(invoke, tmp_path, runs["a"], "--held-out", runs["c"], "--twin", twin)
    assert "own.yaml" in told and "thermal_hysteresys" in told and "did you mean" in told


def test_a_run_that_is_too_short(runs, tmp_path, invoke):
    short = rewritten(runs["a"], tmp_path, "short.csv", rows=slice(0, 15))
    told = refused(invoke, tmp_path, short, "--held-out", runs["c"])
    assert "short.csv" in told and "a diagnosis needs more" in told


@pytest.mark.parametrize("column", ["gyro", "T_in"])
def test_a_column_without_a_number(runs, tmp_path, invoke, column):
    lines = runs["a"].read_text().splitlines()
    place = [cell.split(" ")[0] for cell in lines[0].split(",")].index(column)
    rows = [line.split(",") for line in lines[1:]]
    empty = tmp_path / "empty.csv"
    body = [",".join([*row[:place], "nan", *row[place + 1 :]]) for row in rows]
    empty.write_text("\n".join([lines[0], *body]) + "\n")
    told = refused(invoke, tmp_path, empty, "--held-out", runs["c"])
    assert "empty.csv" in told and column in told


def test_an_unknown_candidate_to_leave_out(runs, tmp_path, invoke):
    told = refused(invoke, tmp_path, runs["a"], "--held-out", runs["c"], "--without", "hysteresis")
    assert "--without hysteresis" in told and "fogml effects" in told


def test_no_run_at_all(tmp_path, invoke):
    assert "no run is given" in refused(invoke, tmp_path)


@pytest.fixture(scope="module")
def one_usable(runs, tmp_path_factory) -> Path:
    """The folder that a diagnosis wrote of one run and two that can't be used, an effect left out."""
    folder = tmp_path_factory.mktemp("one-usable")
    short = rewritten(runs["a"], folder, "short.csv", rows=slice(0, 15))
    run = read_run(runs["b"])
    bare = folder / "bare.csv"
    write_run(Run.from_columns("bare.csv", run.facts, time=run.time, gyro=run.gyro), bare)
    words = [runs["a"], short, bare, "--without", "thermal_hysteresis", "--out", folder / "out"]
    run_program("diagnose", *words)
    return folder / "out"


def test_a_run_that_cannot_be_used_is_told_where_others_can(one_usable):
    gap = json.loads((one_usable / "gap.json").read_text())
    assert gap["runs"]["fit"] == ["a.csv"]
    reasons = {item["run"]: item["reason"] for item in gap["runs"]["unusable"]}
    assert set(reasons) == {"short.csv", "bare.csv"}
    assert "a diagnosis needs more" in reasons["short.csv"] and "temperature" in reasons["bare.csv"]
    page = Page((one_usable / "gap.html").read_text(encoding="utf-8")).text
    assert "short.csv was not used" in page


def test_without_an_effect_it_is_not_named_and_nothing_held_out_is_said(one_usable):
    gap = json.loads((one_usable / "gap.json").read_text())
    assert gap["runs"]["held_out_is_part_of_last_run"] is True
    assert all("thermal_hysteresis" not in found["class"] for found in gap["which"])
    assert "No run was held out" in (one_usable / "gap.html").read_text(encoding="utf-8")


def test_the_written_settings_repeat_the_diagnosis(one_usable, tmp_path, invoke):
    invoke("diagnose", "--config", one_usable / "diagnose.config.yaml", "--out", tmp_path / "again")
    assert (tmp_path / "again" / "gap.json").read_bytes() == (one_usable / "gap.json").read_bytes()


def test_a_found_cause_is_compensated(runs, diagnosed, gap, tmp_path, monkeypatch):
    """``train --from-diagnosis`` gives on the held-out run what the diagnosis said, beside another model."""
    from fogml.models.names import make_model

    monkeypatch.setattr("fogml.models.auto.AutoModel", lambda seed: make_model("polynomial"))
    (told,) = gap["compensation"]["held_out"]
    assert told["after"] < 0.6 * told["constants"] < told["before"]
    given = ["train", runs["a"], runs["b"], "--test", runs["c"], "--from-diagnosis", diagnosed]
    printed = run_program(*given, "--out", tmp_path / "out")
    report = json.loads((tmp_path / "out" / "report.json").read_text())
    assert report["test"][0]["after"]["rms"] == pytest.approx(told["after"], rel=1e-6)
    assert report["model"]["causes"].keys() == {"thermal_hysteresis"}
    assert report["beside"]["auto"]["test"][0]["rows_used"] == report["test"][0]["rows_used"]
    assert "Beside other models" in printed.stdout
    # Which of the two to use stands on the terminal and on the page.
    assert "Use this model rather than auto" in printed.stdout
    assert "Use this model rather than auto" in (tmp_path / "out" / "report.html").read_text()
    run_program("export", tmp_path / "out", "--to", "json", "-o", tmp_path / "json")


def test_a_diagnosis_that_makes_no_model_is_told(runs, diagnosed, tmp_path):
    given = ["train", runs["a"], "--test", runs["c"], "--out", tmp_path / "out", "--from-diagnosis"]
    for more, told in (
        ([diagnosed, "--cause", "ageing"], "can't be compensated: it goes with the unit's own days"),
        ([diagnosed, "--cause", "nothing"], "no candidate of that diagnosis"),
        ([diagnosed, "--model", "rbf"], "the diagnosis makes the model"),
        ([diagnosed, "--features", "T"], "--features: the diagnosis makes the model"),
        ([tmp_path], "gap.json"),
    ):
        assert told in run_program(*given, *more, status=2).stderr
    assert "of which diagnosis" in run_program(*given[:-1], "--cause", "ageing", status=2).stderr


def test_the_twin_of_a_diagnosis_is_simulated_and_shows_no_gap(diagnosed, tmp_path):
    """What it simulates differs from it in nothing, and its draws scatter as it is unsure."""
    config = {"programme": steps(PROGRAMMES["b"]), "twin": str(diagnosed / "twin.yaml"), "sample_s": SAMPLE_S}
    file = tmp_path / "simulate.yaml"
    file.write_text(yaml.safe_dump(config | {"columns": ["T_in", "T_out", "rate"]}))
    run_program("simulate", file, "--out", tmp_path / "again.csv")
    twin = load_twin(diagnosed / "twin.yaml")
    assert diagnose(twin, [read_run(tmp_path / "again.csv")], plan=False).verdict == "no_gap"
    assert {"nominal.b0", "effects.thermal_hysteresis.amplitude"} <= set(twin.uncertainty.names)
    printed = run_program("simulate", file, "--draws", 3, "--out", tmp_path / "d.csv", "--json")
    drawn = [read_run(tmp_path / f"d-{number}.csv") for number in (1, 2, 3)]
    assert len({run.facts.unit for run in drawn}) == 3
    assert [one["run"] for one in json.loads(printed.stdout)["draws"]] == ["d-1.csv", "d-2.csv", "d-3.csv"]
    assert np.ptp([run.gyro_deg_h.mean() for run in drawn]) < 0.5 < abs(drawn[0].gyro_deg_h.mean())
    assert "no --out" in run_program("simulate", file, "--draws", 2, status=2).stderr


def test_sizes_on_sliders_add_up_to_what_was_replayed(diagnosed, gap):
    """The page's own numbers: nothing acting, plus the course as found, leaves what the diagnosis says."""
    text = (diagnosed / "what-if.html").read_text(encoding="utf-8")
    packed = re.search(r'id="what-if-data">(.*?)</script>', text, re.DOTALL)
    run = json.loads(packed[1])["runs"][0]

    def values(cell: str) -> np.ndarray:
        return np.frombuffer(base64.b64decode(cell), dtype="<f4").astype(float)

    course = values(run["courses"]["thermal_hysteresis"])
    left = values(run["recorded"]) - values(run["replayed"])
    (told,) = gap["how_far"]
    assert np.sqrt(np.mean((left - course) ** 2)) == pytest.approx(told["after"], rel=1e-4)
    assert np.sqrt(np.mean(left**2)) > 2.0 * told["after"]
    assert run["floor"] == pytest.approx(told["floor"], rel=0.1)
    assert len(run["courses"]) > 10 and "deadband" not in run["courses"]
    assert all(len(values(cell)) == len(left) for cell in run["courses"].values())
