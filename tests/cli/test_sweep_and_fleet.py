"""The commands sweep and fleet: what they write, how they go on, and what they refuse."""

from __future__ import annotations

import json
import os

import pytest
import yaml

from fogml.cli.fleet_job import batch_of
from fogml.errors import InputError
from fogml.fleet.tasks import DONE
from tests.fleet.units import write_fleet, write_run

pytest.importorskip("optuna", reason="Optuna is not installed: pip install -e '.[sweep]'")

SPACE = {
    "features": {"static": ["T", "T^1..2"], "rate": ["", "dT[block, {window} s]"]},
    "window": [16, 32],
    "models": {"polynomial": {"ridge": [0.0, 1e-6]}},
}


@pytest.fixture
def sweep_config(tmp_path):
    for seed, name in enumerate(("a", "b", "c")):
        write_run(tmp_path / f"{name}.csv", "FOG-1", seed, slope=0.05, cycles=1.0 + 0.3 * seed, rows=400)
    values = {
        "schema": "fogml.sweep/1",
        "name": "mine",
        "runs": ["a.csv", "b.csv"],
        "test": ["c.csv"],
        "space": SPACE,
        "objectives": ["rms", "bytes", "operations"],
        "trials": 4,
        "out": str(tmp_path / "out"),
    }
    path = tmp_path / "mine.yaml"
    path.write_text(yaml.safe_dump(values))
    return path


def test_a_sweep_writes_its_winner_as_a_configuration_of_train(invoke_json, sweep_config, tmp_path):
    values = invoke_json("sweep", sweep_config)
    written = {path.name for path in (tmp_path / "out").iterdir() if not path.name.startswith(".")}
    assert written == {"best.yaml", "sweep.config.yaml", "study.journal", "sweep.html", "sweep.json"}
    assert values == json.loads((tmp_path / "out" / "sweep.json").read_text())
    assert values["schema"] == "fogml.study/1"
    assert values["counts"]["complete"] + values["counts"]["pruned"] == 4
    assert "dT" in values["winner"]["features"]
    report = invoke_json("train", "--config", tmp_path / "out" / "best.yaml", "--out", tmp_path / "best")
    assert report["test"] == values["winner"]["judged"]["test"]
    again = invoke_json("sweep", tmp_path / "out" / "sweep.config.yaml")
    assert again == values
    more = invoke_json("sweep", sweep_config, "--trials", 5)
    assert [trial["rms"] for trial in more["trials"]][:4] == [trial["rms"] for trial in values["trials"]]
    page = (tmp_path / "out" / "sweep.html").read_text()
    assert "fogml train" in page


def test_all_that_a_sweep_lacks_is_named_at_once(invoke, tmp_path):
    config = tmp_path / "sweep.yaml"
    config.write_text("trials: 3\n")
    assert "nothing is given for 'space', 'runs'" in invoke("sweep", config, status=2).stderr


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"objectives": ["bytes"]}, "rms is missing"),
        ({"objectives": "rms, speed"}, "objectives rms, speed"),
        ({"space": {**SPACE, "models": {"polynomial": {"rigde": [1]}}}}, "no parameter 'rigde'"),
        ({"space": {**SPACE, "models": ["auto"]}}, "leaves nothing to choose"),
        ({"space": {"features": ["T"], "models": ["rbf"], "window": 16.0}}, "'window' would change nothing"),
        (
            {"space": {**SPACE, "window": {"low": 64, "high": 16}}},
            "'space': window: low 64 must be below high",
        ),
        ({"folds": "runs", "fold_count": 4}, "'fold_count' is of folds in time"),
        ({"space": {"features": ["T, q"], "models": ["rbf"]}}, "the run holds T"),
        ({"space": {"features": ["T_in"], "models": ["rbf"]}}, "the run holds T"),
        ({"space": {**SPACE, "window": {"low": 5, "high": 1}}}, "low 5 must be below high 1"),
        ({"space": {"models": ["rbf"]}}, "features"),
        ({"trials": 0}, "at least 1"),
        ({"folds": "time", "fold_count": 3}, "3 folds"),
        ({"sampler": "magic"}, "sampler 'magic'"),
        ({"workers": 0}, "'workers' is 0"),
        ({"runs": []}, "no training run"),
        ({"schema": "fogml.sweep/9"}, "fogml.sweep/1"),
        ({"storage": "postgresql://127.0.0.1:9/x"}, "does not answer"),
    ],
)
def test_bad_sweeps(invoke, sweep_config, tmp_path, change, message):
    sweep_config.write_text(yaml.safe_dump({**yaml.safe_load(sweep_config.read_text()), **change}))
    result = invoke("sweep", sweep_config, status=2)
    assert message in result.stderr.splitlines()[-1]
    assert not (tmp_path / "out" / "sweep.json").exists()


def test_a_test_run_of_another_unit_is_refused_before_the_trials(invoke, sweep_config, tmp_path):
    write_run(tmp_path / "c.csv", "FOG-2", 2, slope=0.05, cycles=1.6, rows=400)
    told = invoke("sweep", sweep_config, status=2).stderr
    assert "c.csv: unit 'FOG-2', but the training runs are of unit 'FOG-1'" in told
    assert "any-unit" not in told and "tried" not in told
    assert not (tmp_path / "out" / "study.journal").exists()


def test_a_study_of_another_space_is_refused(invoke, sweep_config):
    invoke("sweep", sweep_config, "--trials", 2, "--quiet")
    values = yaml.safe_load(sweep_config.read_text())
    values["space"] = {**SPACE, "window": [16, 64]}
    sweep_config.write_text(yaml.safe_dump(values))
    result = invoke("sweep", sweep_config, status=2)
    assert "another search space" in result.stderr


def test_a_fleet_and_the_next_unit_drawn_to_it(invoke, invoke_json, tmp_path):
    manifest = write_fleet(tmp_path, 4)
    lines = manifest.read_text().splitlines()
    manifest.write_text("\n".join([*lines, "FOG-000,compare,0a.csv,0b.csv,x", "WRONG,train,1a.csv,1b.csv,x"]))
    model = ("--model", "polynomial", "--features", "T, dT")
    arguments = ("fleet", manifest, *model, "--averaging", 40, "--out", tmp_path / "out")
    values = invoke_json(*arguments, status=1)
    states = {(unit["unit"], unit["job"]): unit for unit in values["units"]}
    assert states[("WRONG", "train")]["status"] == "failed"
    assert "the manifest names 'WRONG'" in states[("WRONG", "train")]["reason"]
    done = [unit for unit in values["units"] if unit["status"] == "done"]
    assert len(done) == 5
    for unit in done:
        assert unit["after"] < 0.1 * unit["before"]
        name = "compare.json" if unit["job"] == "compare" else "report.json"
        assert (tmp_path / "out" / unit["folder"] / name).is_file()
    assert {path.name for path in (tmp_path / "out").iterdir()} >= {"fleet.json", "fleet.html", "fleet.xlsx"}
    report = json.loads((tmp_path / "out" / done[0]["folder"] / "report.json").read_text())
    assert done[0]["after"] == report["test"][0]["after"]["rms"]
    before = (tmp_path / "out" / done[0]["folder"] / "report.json").stat().st_mtime_ns
    assert invoke_json(*arguments, status=1) == values
    assert (tmp_path / "out" / done[0]["folder"] / "report.json").stat().st_mtime_ns == before
    one = "\n".join(lines[:2]) + "\n"
    (tmp_path / "next.csv").write_text(one + one.splitlines()[1].replace("train", "acceptance") + "\n")
    drawn = invoke_json(
        "fleet", tmp_path / "next.csv", "--prior", tmp_path / "out" / "fleet.json", "--out", tmp_path / "next"
    )
    assert [unit["model"] for unit in drawn["units"]] == ["shared", "shared"]
    report_of = json.loads((tmp_path / "next" / drawn["units"][1]["folder"] / "acceptance.json").read_text())
    assert "shared" in json.dumps(report_of)
    # What makes the model again says so, and nothing says that 'train' would.
    own = tmp_path / "next" / drawn["units"][0]["folder"]
    assert (own / "report.json").is_file() and not (own / "train.config.yaml").exists()
    again = invoke_json(
        "fleet", "--config", tmp_path / "next" / "fleet.config.yaml", "--out", tmp_path / "again"
    )
    assert again["units"][0]["after"] == drawn["units"][0]["after"]
    assert drawn["settings"]["prior"] == str(tmp_path / "out" / "fleet.json")
    whole = tmp_path / "out" / done[0]["folder"] / "train.config.yaml"
    assert invoke_json("train", "--config", whole, "--out", tmp_path / "one") == report


def test_networks_of_a_fleet_are_those_of_train(invoke_json, tmp_path):
    manifest = write_fleet(tmp_path, 2)
    model = ("--model", "rbf", "--features", "T, dT", "--set", "centres=4", "--set", "average_rows=200")
    shared = ("--averaging", 40)
    values = invoke_json("fleet", manifest, *model, *shared, "--device", "cpu", "--out", tmp_path / "out")
    runs = (tmp_path / "1a.csv", "--test", tmp_path / "1b.csv")
    report = invoke_json("train", *runs, *model, *shared, "--out", tmp_path / "one")
    assert values["units"][1]["after"] == pytest.approx(report["test"][0]["after"]["rms"], abs=1e-6)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("--cluster", "tcp://127.0.0.1:9"), "does not answer"),
        (("--device", "cuda:99", "--model", "rbf"), "--device cuda:99: is not there"),
        (("--device", "cpu", "--model", "auto"), "--model rbf"),
        (("--prior", "nothing.json"), "no such file"),
        (("--prior", "prior.json", "--model", "rbf"), "--model: with --prior the earlier fleet makes"),
        (("--prior", "prior.json", "--features", "T"), "--features: with --prior the earlier fleet makes"),
        (("--workers", 0), "'workers' is 0"),
        (("--model", "nothing"), "model 'nothing' is not known"),
        (("--form", "T, time"), "known: temperatures"),
    ],
)
def test_bad_fleets(invoke, tmp_path, monkeypatch, arguments, message):
    monkeypatch.setattr("fogml.fleet.engines._ANSWER_S", 1)
    monkeypatch.chdir(tmp_path)
    (tmp_path / "prior.json").write_text("{}")
    manifest = write_fleet(tmp_path, 1)
    result = invoke("fleet", manifest, "--out", tmp_path / "out", *arguments, status=2)
    assert message in result.stderr.splitlines()[-1]
    assert not (tmp_path / "out" / "fleet.json").exists()


def test_a_missing_file_fails_its_unit_and_the_others_go_on(invoke, invoke_json, tmp_path):
    manifest = write_fleet(tmp_path, 2)
    manifest.write_text(
        manifest.read_text() + "F-9,train,gone.csv,0b.csv,x\nF-8,train,shipped:gone,0b.csv,x\n"
    )
    arguments = ("fleet", manifest, "--model", "M1", "--averaging", 40, "--out", tmp_path / "out")
    units = {unit["unit"]: unit for unit in invoke_json(*arguments, status=1)["units"]}
    assert [unit["status"] for unit in units.values()] == ["done", "done", "failed", "failed"]
    reason = "fleet.csv: row 4: column 'train': gone.csv: no such file, here or beside the manifest"
    assert units["F-9"]["reason"] == reason
    assert "no such recording ships" in units["F-8"]["reason"]
    # Once it is there, that unit is done, and the others are not done again.
    done = tmp_path / "out" / "FOG-000-x" / "report.json"
    before = done.stat().st_mtime_ns
    for suffix in (".csv", ".yaml"):
        text = (tmp_path / f"0a{suffix}").read_text().replace("FOG-000", "F-9")
        (tmp_path / f"gone{suffix}").write_text(text)
    (tmp_path / "0b.yaml").unlink()
    units = {unit["unit"]: unit for unit in invoke_json(*arguments, status=1)["units"]}
    assert units["F-9"]["status"] == "done"
    assert done.stat().st_mtime_ns != before


@pytest.mark.parametrize("suffix", [".yaml", ".yml"])
def test_a_fleet_done_before_is_done_again_where_a_side_file_has_changed(invoke_json, tmp_path, suffix):
    manifest = write_fleet(tmp_path, 1)
    for name in ("0a", "0b"):
        (tmp_path / f"{name}.yaml").rename(tmp_path / f"{name}{suffix}")
        side = tmp_path / f"{name}{suffix}"
        side.write_text(side.read_text() + 'scale_factor: {value: 1.0, unit: "count per deg/h"}\n')
        run = tmp_path / f"{name}.csv"
        run.write_text(run.read_text().replace("gyro [deg/h]", "gyro [count]"))
    arguments = ("fleet", manifest, "--model", "none", "--averaging", 40, "--out")
    first = invoke_json(*arguments, tmp_path / "out")["units"][0]
    times = (tmp_path / f"0b{suffix}").stat()
    side = tmp_path / f"0b{suffix}"
    side.write_text(side.read_text().replace("1.0", "0.5"))
    # Not told by its size, nor by a time that a copy keeps.
    os.utime(side, ns=(times.st_atime_ns, times.st_mtime_ns))
    resumed = invoke_json(*arguments, tmp_path / "out")["units"][0]
    assert resumed == invoke_json(*arguments, tmp_path / "anew")["units"][0]
    assert resumed["after"] != first["after"]


def test_a_fleet_done_before_is_done_again_where_its_noise_run_has_changed(invoke_json, tmp_path):
    manifest = write_fleet(tmp_path, 1)
    noise = tmp_path / "still.csv"
    write_run(noise, "FOG-000", 9, slope=0.0, cycles=0.0)
    arguments = ("fleet", manifest, "--model", "none", "--averaging", 40, "--noise", noise, "--out")
    first = invoke_json(*arguments, tmp_path / "out")["units"][0]
    head, *rows = noise.read_text().splitlines()
    louder = (row.split(",") for row in rows)
    noise.write_text("\n".join([head, *(",".join([t, str(10 * float(g)), *rest]) for t, g, *rest in louder)]))
    again = invoke_json(*arguments, tmp_path / "out")["units"][0]
    assert again["floor"] == pytest.approx(10.0 * first["floor"], rel=1e-6)


@pytest.mark.parametrize("job", ["compare", "diagnose"])
def test_every_job_is_of_the_unit_that_the_manifest_names(invoke_json, tmp_path, job):
    write_fleet(tmp_path, 2)
    (tmp_path / "mixed.csv").write_text(f"unit,job,train,test\nFOG-000,{job},1a.csv,1b.csv\n")
    told = invoke_json("fleet", tmp_path / "mixed.csv", "--out", tmp_path / "out", status=1)["units"][0]
    assert told["reason"] == "1a.csv: is of unit 'FOG-001', the manifest names 'FOG-000'"


def test_a_batch_is_of_the_units_that_are_done(tmp_path):
    unit = {"job": "acceptance", "status": "failed", "folder": "FOG-1"}
    assert batch_of([unit, {**unit, "job": "train", "status": DONE}], tmp_path) is None
    with pytest.raises(InputError, match="FOG-1"):
        batch_of([{**unit, "status": DONE}], tmp_path)
