"""``simulate``, ``replay`` and ``effects``: what they print and write, and what they refuse."""

from __future__ import annotations

import re
from types import SimpleNamespace

import numpy as np
import pytest
import yaml

from fogml.runs.reading import read_run
from fogml.twin.registry import effects
from fogml.twin.truth import read_truth
from fogml.twin.twin import Twin
from fogml.twin.twin_file import load_twin, save_twin

STEPS = ["soak at 25 degC for 10 min", "ramp to 35 degC at 1 degC/min", "soak at 35 degC for 10 min"]


@pytest.fixture
def config(tmp_path):
    path = tmp_path / "simulation.yaml"
    values = {
        "schema": "fogml.simulate/1",
        "seed": 3,
        "sample_s": 5.0,
        "programme": STEPS,
        "twin": "tactical",
        "columns": ["T_in", "T_out", "rate"],
    }
    path.write_text(yaml.safe_dump(values))
    return path


def test_simulate_then_replay(config, tmp_path, invoke_json, invoke):
    out, truth = tmp_path / "run.csv", tmp_path / "truth.parquet"
    values = invoke_json("simulate", config, "-o", out, "--truth", truth)
    assert values["schema"] == "fogml.simulation/1"
    assert (values["rows"], values["seed"], values["twin"]) == (360, 3, "tactical")
    run = read_run(out)
    assert list(run.columns) == ["time", "gyro", "T_in", "T_out", "rate"] and run.facts.unit == "tactical"

    again = tmp_path / "again.csv"
    replayed = invoke_json("replay", "tactical", out, "-o", again, "--truth", truth)
    assert replayed["schema"] == "fogml.replay/1" and replayed["rows"] == 360
    column = read_run(again).columns["replayed"]
    assert "replayed [deg/h]" in again.read_text().splitlines()[0]
    np.testing.assert_allclose(column, read_truth(truth).noise_free, atol=1e-9)
    assert replayed["gap_rms"] == pytest.approx(np.sqrt(np.mean((run.gyro - column) ** 2)))

    result = invoke("replay", "tactical", out, "-o", again, "--only", "thermal_hysteresis")
    assert "thermal_hysteresis changes run.csv by" in result.stdout
    part = read_run(again).columns["replayed"]
    wanted = read_truth(truth).contributions["thermal_hysteresis"]
    # A play operator turns the errors of the sensor, steps of 0.0625 degC and noise, into A / w times them.
    np.testing.assert_allclose(part, wanted, atol=0.12 / 8.0 * 0.2)


@pytest.mark.parametrize("truth", [False, True], ids=["run alone", "with its truth"])
def test_effects_that_changed_nothing_are_told(tmp_path, invoke, invoke_json, truth):
    """No dose, no end of the range; that a sensor never lagged, only the truth tells."""
    twin, out = tmp_path / "twin.yaml", tmp_path / "run.csv"
    on = ["electronic_crosstalk", "radiation", "rate_range", "output_counts", "sensor_lag"]
    unit = Twin("unit")
    for id in on:
        unit = unit.with_effect(id)
    save_twin(unit, twin)
    config = tmp_path / "simulation.yaml"
    values = {"schema": "fogml.simulate/1", "twin": str(twin), "programme": ["soak at 25 degC for 10 min"]}
    config.write_text(yaml.safe_dump(values))
    command = ["simulate", config, "-o", out]
    command += ["--truth", tmp_path / "truth.parquet"] if truth else []
    values = invoke_json(*command)
    assert values["effects"] == on
    assert values["silent"] == ["radiation", "rate_range", *(["sensor_lag"] if truth else [])]
    assert "On, but without any part in the output" in invoke(*command).stdout


def test_rates_that_samples_may_miss_are_told(tmp_path, invoke):
    config = tmp_path / "simulation.yaml"
    steps = [{"soak at 25 degC for 1 h": ["turn at 5 deg/s for 60 s from minute 5"]}]
    config.write_text(yaml.safe_dump({"schema": "fogml.simulate/1", "programme": steps}))
    told = [
        invoke("simulate", config, "-o", tmp_path / "run.csv", "--sample", s).stdout for s in ("1", "100")
    ]
    assert ["1 rate of the table held for less than a sample of 100 s" in t for t in told] == [False, True]


@pytest.mark.parametrize("suffixes", [(".csv", ".parquet"), (".parquet", ".csv")])
def test_a_truth_of_the_run_s_stem_leaves_its_facts(config, tmp_path, invoke, suffixes):
    out, truth = (tmp_path / f"run{suffix}" for suffix in suffixes)
    for seed in (3, 4):
        invoke("simulate", config, "-o", out, "--truth", truth, "--seed", seed)
        facts = read_run(out).facts
        assert facts.unit == "tactical" and f"seed {seed}" in str(facts.notes)
        assert yaml.safe_load((tmp_path / "run.yaml").read_text()) == facts.as_dict()
    invoke("replay", "tactical", out, "-o", tmp_path / "again.csv", "--truth", truth)
    assert read_run(out).facts == facts
    refused = invoke("replay", "tactical", out, "-o", truth, "--truth", truth, status=2)
    assert "is itself read ('truth')" in refused.stderr


def test_a_simulation_of_other_facts_does_not_replace_them(config, tmp_path, invoke):
    out = tmp_path / "run.csv"
    invoke("simulate", config, "-o", out)
    values = yaml.safe_load(config.read_text()) | {"facts": {"axis": "z", "unit": "another"}}
    config.write_text(yaml.safe_dump(values))
    refused = invoke("simulate", config, "-o", out, status=2)
    assert "run.yaml" in refused.stderr and "unit: tactical" in refused.stderr
    assert read_run(out).facts.unit == "tactical"


def test_the_written_settings_give_the_same_run(config, tmp_path, invoke):
    out = tmp_path / "run.parquet"
    invoke("simulate", config, "-o", out, "--seed", 8)
    first = read_run(out)
    written = tmp_path / "run.simulate.config.yaml"
    assert yaml.safe_load(written.read_text())["schema"] == "fogml.simulate/1"
    other = tmp_path / "other.parquet"
    invoke("simulate", written, "-o", other)
    assert read_run(other).hash == first.hash


def test_files_lie_beside_the_configuration(config, tmp_path, invoke, monkeypatch):
    save_twin(load_twin("navigation").named("own"), tmp_path / "own.yaml")
    values = yaml.safe_load(config.read_text()) | {"twin": "own.yaml", "facts": {"axis": "z"}}
    config.write_text(yaml.safe_dump(values))
    (tmp_path / "elsewhere").mkdir()
    monkeypatch.chdir(tmp_path / "elsewhere")
    result = invoke("simulate", config, "-o", tmp_path / "run.csv")
    assert "Twin own, seed 3" in result.stdout
    run = read_run(tmp_path / "run.csv")
    assert (run.facts.unit, run.facts.axis, run.facts.latitude) == ("own", "z", None)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"programm": "x"}, "unknown key 'programm'; did you mean 'programme'?"),
        ({"twin": "nominl"}, "nominl: no such twin"),
        ({"programme": "nix"}, "nix: no such programme"),
        ({"programme": ["soak at 25 degC for ever"]}, "programme, step 1"),
        ({"columns": ["T_hub"]}, "'T_hub' can't be recorded"),
        ({"schema": "fogml.simulate/2"}, "fogml.simulate/1"),
        ({"sample_s": -1}, "'sample_s' is -1"),
        ({"sample_s": 1e-12}, "samples do not fit into the"),
        ({"storage": {"temperature": 20.0}}, "'storage' is of the time between runs"),
        ({"facts": {"latitud": 3}}, "facts: unknown key 'latitud'"),
        ({"twin": {"schema": "fogml.twin/1", "nominal": {"b9": 1}}}, "unknown key 'nominal.b9'"),
    ],
)
def test_faults_of_a_simulation(config, tmp_path, invoke, change, message):
    config.write_text(yaml.safe_dump(yaml.safe_load(config.read_text()) | change))
    out = tmp_path / "run.csv"
    result = invoke("simulate", config, "-o", out, status=2)
    assert message in result.stderr and result.stdout == ""
    assert not out.exists() and not list(tmp_path.glob("*.config.yaml"))


def test_a_text_takes_two_bytes_a_cell_at_least(config, tmp_path, invoke, monkeypatch):
    # 360 samples of time, gyro and three columns.
    for free, status in ((3599, 2), (3601, 0)):
        room = SimpleNamespace(free=free)
        monkeypatch.setattr("fogml.outputs.shutil.disk_usage", lambda path, room=room: room)
        result = invoke("simulate", config, "-o", tmp_path / "run.csv", status=status)
        assert ("360 samples do not fit into the 3.6e-06 GB free" in result.stderr) is (status == 2)


def test_usage_faults(config, tmp_path, invoke):
    out = tmp_path / "run.csv"
    assert "no --out is given" in invoke("simulate", config, status=2).stderr
    assert "no programme is given" in invoke("simulate", "-o", out, status=2).stderr
    assert "choose another --truth" in invoke("simulate", config, "-o", out, "--truth", out, status=2).stderr
    assert "no twin is given" in invoke("replay", status=2).stderr
    assert "no run is given" in invoke("replay", "nominal", status=2).stderr
    assert "no --out is given" in invoke("replay", "nominal", "shipped:cold-start-x", status=2).stderr
    result = invoke("replay", "nominal", "shipped:cold-start-x", "-o", out, "--only", "moisture", status=2)
    assert "effect 'moisture' is not on" in result.stderr
    result = invoke("replay", "nominal", "shipped:cold-start-x", "-o", out, "--axis", "z", status=2)
    assert "--axis is of a simulator's output" in result.stderr
    # Before anything is read.
    told = invoke("replay", "nominal", config, "-o", tmp_path / "run.mat", status=2).stderr
    assert "'.mat' is not written block by block; use one of .csv, .parquet" in told
    result = invoke("replay", "nominal", "shipped:cold-start-x", "-o", out, "--truth", config, status=2)
    assert "truth" in result.stderr and not out.exists()


def test_replay_of_a_recording(tmp_path, invoke_json):
    out = tmp_path / "replayed.parquet"
    values = invoke_json("replay", "nominal", "shipped:thermal-cycle-2-x", "-o", out)
    run = read_run(out)
    assert values["rows"] == len(run) and not run.columns["replayed"].any()


def test_effects_lists_the_catalogue(invoke_json, invoke):
    values = invoke_json("effects")
    assert [entry["id"] for entry in values["effects"]] == list(effects())
    lines = invoke("effects").stdout.splitlines()
    row = "B8 thermal_hysteresis bias Thermal hysteresis of the bias"
    assert any(line.split() == row.split() for line in lines)


def test_a_curve_is_no_wider_than_the_terminal_and_no_line_of_question_marks(invoke, monkeypatch):
    for columns, width in (("200", 60), ("40", 40)):
        monkeypatch.setenv("COLUMNS", columns)
        drawn = [line for line in invoke("effects", "kerr").stdout.splitlines() if line[:1] >= "\u2800"]
        assert {len(line) for line in drawn} == {width}


def test_formulas_of_a_card_stand_below_each_other(invoke):
    lines = invoke("effects", "thermal_shock").stdout.splitlines()
    first = lines.index("    b = J q,")
    assert lines[first + 1] == "    dq/dt = -q / tau + ds/dt," and lines[first + 2].startswith("    E[ds/dt]")
    assert max(map(len, lines[first : first + 3])) <= 80


def test_a_card(invoke_json, invoke, tmp_path):
    card = invoke_json("effects", "shupe_trim")
    assert card["schema"] == "fogml.effect/1" and "delta" in card["equation"]
    assert card["amplitude"]["unit"] == "m" and card["amplitude"]["tactical"] == [0.1, 2.0]
    assert "shupe_mohr" in card["confused_with"] and card["source"]
    told = invoke("effects", "shupe_trim", "-o", tmp_path / "cards").stdout
    for words in ("dT_coil/dt", "Shows:", "Confused with", "Source:", "multi-point-cycle", "0.1 to 2"):
        assert words in told
    assert any(ord(character) > 0x2800 for character in told)
    page = (tmp_path / "cards" / "shupe_trim.html").read_text(encoding="utf-8")
    assert page.count("<svg") == 10 and "http" not in page.replace("http-equiv", "").replace(
        "http://www.w3.org/2000/svg", ""
    )
    assert "did you mean 'shupe_trim'" in invoke("effects", "shup_trim", status=2).stderr


def test_every_effect_has_a_whole_card(invoke_json):
    from fogml.twin.pictures import card_values

    for id, declared in effects().items():
        card = card_values(declared)
        assert card["equation"] and card["summary"] and card["source"] and card["shows"], id
        assert "``" not in " ".join(card["remarks"]), id


def test_the_catalogue_page(invoke, tmp_path):
    invoke("effects", "-o", tmp_path / "pages", "--quiet")
    page = (tmp_path / "pages" / "catalogue.html").read_text(encoding="utf-8")
    for id in effects():
        assert f'<article id="{id}">' in page
    assert "othing of it shows" not in page


def test_a_units_runs_in_one_file_and_a_replay_after_the_first(tmp_path, invoke_json, invoke):
    """The play of the second run is where the first one left it: a replay needs --after to tell."""
    twin, config = tmp_path / "twin.yaml", tmp_path / "runs.yaml"
    save_twin(Twin("unit").with_effect("thermal_hysteresis"), twin)
    first, second = tmp_path / "first.csv", tmp_path / "second.csv"
    values = {
        "schema": "fogml.simulate/1",
        "sample_s": 10.0,
        "twin": str(twin),
        "storage": {"temperature": 20.0, "power": "off"},
        "runs": [
            {"programme": ["soak at 55 degC for 4 h"], "started": "2026-03-02T08:00:00Z", "out": str(first)},
            {"programme": STEPS, "started": "2026-03-05T08:00:00Z", "out": str(second)},
        ],
    }
    config.write_text(yaml.safe_dump(values))
    told = invoke_json("simulate", config)
    assert [run["run"] for run in told["runs"]] == ["first.csv", "second.csv"]
    assert read_run(second).facts.started.isoformat() == "2026-03-05T08:00:00+00:00"
    stored = ("--storage-temperature", "20")
    found = {}
    for name, more in (("after", ("--after", first, *stored)), ("alone", ())):
        out = tmp_path / f"{name}.csv"
        invoke("replay", twin, second, "-o", out, *more)
        found[name] = np.abs(read_run(out).columns["replayed"] - read_run(second).gyro).max()
    assert found["after"] < 1e-6 < 0.05 < found["alone"]
    refused = invoke("replay", twin, second, "-o", out, *stored, status=2).stderr
    assert "--storage-temperature is of the time since another run" in refused
    again = invoke_json("simulate", tmp_path / "first.simulate.config.yaml")
    assert again["runs"] == told["runs"]


START = "2026-03-02T08:00:00Z"


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"programme": STEPS}, "there are 'runs'; state it in each of them"),
        ({"storage": {"temperature": 300.0}}, "storage: temperature is 300"),
        ({"runs": [{"programme": STEPS, "out": "a.csv"}]}, "nothing is given for 'runs.0.started'"),
        (
            {"runs": [{"programme": STEPS, "out": "a.csv", "truth": "./b/../a.csv", "started": START}]},
            "a.csv; give each 'out' and 'truth' its own name",
        ),
        ({"runs": [{"programme": STEPS, "out": "a.csv", "sample_s": 0.0, "started": START}]}, "0 s"),
    ],
)
def test_faulty_runs_are_refused(tmp_path, invoke, monkeypatch, change, message):
    monkeypatch.chdir(tmp_path)
    config = tmp_path / "runs.yaml"
    run = {"programme": STEPS, "started": START, "out": str(tmp_path / "a.csv")}
    config.write_text(yaml.safe_dump({"schema": "fogml.simulate/1", "runs": [run], **change}))
    result = invoke("simulate", config, status=2)
    assert message in result.stderr
    assert not (tmp_path / "a.csv").exists()


@pytest.mark.parametrize("option", ["--out", "--truth"])
def test_the_root_is_no_file_to_write(invoke, tmp_path, option):
    other = {"--out": "--truth", "--truth": "--out"}[option]
    words = ("simulate", "--programme", "four-positions", option, "/", other, tmp_path / "run.csv")
    assert re.match("fogml: /: (is a folder|format '' is not known)", invoke(*words, status=2).stderr)
    assert not list(tmp_path.iterdir())
