"""``fogml monitor``: run by run, with repeated, late and damaged runs, and several units."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest

from fogml.monitor.store import open_store
from fogml.report import monitor_page
from tests.monitor.service import write_model, write_run
from tests.monitor.test_watch import service as records_of


@pytest.fixture(scope="module")
def service(tmp_path_factory):
    """A model, and twelve runs of its unit; from the ninth on the bias is 0.1 deg/h higher."""
    folder = tmp_path_factory.mktemp("service")
    return write_model(folder), [
        write_run(folder, day, bias=5.1 if day >= 9 else 5.0) for day in range(1, 13)
    ]


def test_a_unit_that_changes_is_noticed_once_and_for_all(service, tmp_path, invoke_json, invoke):
    model, runs = service
    out = tmp_path / "out"
    first = invoke_json("monitor", model, *runs[:8:2], "-o", out)
    assert first["schema"] == "fogml.monitor/1"
    assert first["runs"] == {"added": 4, "repeated": 0}
    # Late runs, and some again.
    invoke_json("monitor", model, *runs[:8], "-o", out)
    told = invoke_json("monitor", model, *runs[6:], "-o", out, status=1)
    assert told["runs"] == {"added": 4, "repeated": 2}
    (unit,) = told["units"]
    assert [run["run"] for run in unit["runs"]] == [path.name for path in runs]
    (alarm,) = unit["alarms"]
    assert alarm["onset"] == "FOG-1-09.csv"
    assert alarm["size"] == pytest.approx(0.1, abs=0.02)
    assert json.loads((out / "monitor.json").read_text())["units"] == told["units"]
    # The same again, with no run: what the store holds.
    again = invoke("monitor", "--config", out / "monitor.config.yaml", status=1)
    assert "The bias moves by" in again.stdout
    assert "--no-wander finds them" in (out / "monitor.html").read_text()
    steady = invoke_json("monitor", model, "-o", out, "--no-wander", status=1)
    assert told["wander"] and not steady["wander"]
    assert steady["units"][0]["alarms"][0]["onset"] == "FOG-1-09.csv"
    assert len(list((out / "units").iterdir())) == 1


def test_a_run_that_cannot_be_used_is_told_and_holds_up_no_other(service, tmp_path, invoke, invoke_json):
    model, runs = service
    (tmp_path / "bad.csv").write_text("time [s],gyro [deg/h],T [degC]\n1,2,3\n")
    out = tmp_path / "out"
    told = invoke("monitor", model, tmp_path / "bad.csv", "-o", out, status=2)
    assert "bad.csv" in told.stderr
    assert not out.exists()
    told = invoke_json("monitor", model, tmp_path / "bad.csv", runs[0], "-o", out, status=1)
    (refused,) = told["refused"]
    assert refused["run"] == str(tmp_path / "bad.csv") and "bad.csv" in refused["reason"]
    assert told["runs"] == {"added": 1, "repeated": 0} and told["units"][0]["state"] == "baseline"
    assert "Runs that were not used" in (out / "monitor.html").read_text()
    assert invoke_json("monitor", model, "-o", out)["refused"] == []


def test_of_runs_that_are_all_unusable_each_is_told(service, tmp_path, invoke):
    model, _ = service
    bad = [tmp_path / f"bad-{n}.csv" for n in range(3)]
    for path, header in zip(
        bad, ("time [s],gyro [deg/h]", "time [s],T [degC]", "gyro [deg/h],T [degC]"), strict=True
    ):
        path.write_text(header + "\n" + "".join(f"{n},{n % 5}\n" for n in range(700)))
    told = invoke("monitor", model, *bad, "-o", tmp_path / "out", status=2).stderr.splitlines()
    assert [sum(path.name in line for line in told) for path in bad] == [2, 1, 1]
    assert told[-1].startswith("fogml: none of 3 runs can be used; the first: ")
    assert not (tmp_path / "out").exists()


def test_a_stranger_or_a_run_named_twice_is_refused(service, tmp_path, invoke):
    model, runs = service
    out = tmp_path / "out"
    other = write_run(tmp_path, 3, unit="FOG-9")
    assert "FOG-9" in invoke("monitor", model, other, "-o", out, status=2).stderr
    assert "more than once" in invoke("monitor", model, runs[0], runs[0], "-o", out, status=2).stderr
    assert "the store holds none" in invoke("monitor", model, "-o", out, status=2).stderr


def test_a_run_of_another_unit_of_temperature_is_said(service, tmp_path, invoke):
    """In blocks as whole: before, monitor and compensate took kelvin under degC in silence."""
    model, runs = service
    table = np.loadtxt(runs[0], delimiter=",", skiprows=1)
    table[:, 2] += 273.15
    path = tmp_path / "kelvin.csv"
    np.savetxt(path, table, "%.6f", ",", header="time [s],gyro [deg/h],T [degC]", comments="")
    path.with_suffix(".yaml").write_text(runs[0].with_suffix(".yaml").read_text())
    for told in (
        invoke("monitor", model, path, "-o", tmp_path / "out", status=2),
        invoke("compensate", path, "--model", model, "-o", tmp_path / "done.csv"),
    ):
        assert "kelvin.csv: 'T' is stated in degC" in told.stderr and "kelvin?" in told.stderr
    assert "stated in" not in invoke("monitor", model, runs[1], "-o", tmp_path / "out").stderr


def test_a_fleet_s_models_are_found_by_unit(tmp_path, invoke_json, invoke):
    units = []
    for unit in ("FOG-1", "FOG-2"):
        (tmp_path / unit).mkdir()
        write_model(tmp_path / unit, unit)
        units.append({"unit": unit, "axis": "x", "folder": unit})
    (tmp_path / "fleet.json").write_text(json.dumps({"units": units}))
    runs = [write_run(tmp_path / unit, 5, unit=unit) for unit in ("FOG-1", "FOG-2")]
    told = invoke_json("monitor", tmp_path, *runs, "-o", tmp_path / "out")
    assert [unit["unit"] for unit in told["units"]] == ["FOG-1", "FOG-2"]
    assert len({unit["runs"][0]["model"] for unit in told["units"]}) == 2
    stranger = write_run(tmp_path, 6, unit="FOG-3")
    told = invoke("monitor", tmp_path, stranger, "-o", tmp_path / "out", status=2)
    assert "holds no model" in told.stderr


def test_a_unit_s_jobs_without_a_model_hide_none(tmp_path, invoke, invoke_json):
    """Before, the last line of a unit counted, and a fleet with reports beside models watched no run."""
    (tmp_path / "trained").mkdir()
    write_model(tmp_path / "trained")
    (tmp_path / "reported").mkdir()
    about = [{"unit": "FOG-1", "axis": "x", "folder": folder} for folder in ("trained", "reported")]
    (tmp_path / "fleet.json").write_text(json.dumps({"units": about}))
    told = invoke_json("monitor", tmp_path, write_run(tmp_path, 5), "-o", tmp_path / "out")
    assert told["runs"] == {"added": 1, "repeated": 0} and not told["refused"]
    # A model of before the unit failed is no longer the fleet's.
    about[0]["status"] = "failed"
    (tmp_path / "fleet.json").write_text(json.dumps({"units": about}))
    told = invoke("monitor", tmp_path, write_run(tmp_path, 6), "-o", tmp_path / "out", status=2)
    assert "holds no model" in told.stderr


def test_of_many_units_those_that_changed_are_shown_first(service, tmp_path, invoke, monkeypatch):
    """Before, the terminal showed the first by their names, and never said that there were more."""
    monkeypatch.setattr("fogml.cli.monitor_job.UNITS_SHOWN", 3)
    held = [
        record
        for number in (2, 9, 10, 11)
        for record in records_of(10, unit=f"U-{number}", seed=number, step_at=6 if number == 11 else None)
    ]
    open_store(str(tmp_path / "store")).add(held)
    told = invoke("monitor", service[0], "--store", tmp_path / "store", "-o", tmp_path / "out", status=1)
    places = [told.stdout.index(f" U-{number} x ") for number in (11, 2, 9)]
    assert places == sorted(places) and " U-10 x " not in told.stdout
    assert "3 of 4 units are shown, those that changed first" in told.stdout


def test_only_pages_of_units_of_which_something_is_new_are_drawn(service, tmp_path, invoke_json, monkeypatch):
    model, _ = service
    out, (record, *_) = tmp_path / "out", records_of(1)
    open_store(str(tmp_path / "store")).add([replace(record, unit=unit, key=unit) for unit in ("A", "B")])
    command = ("monitor", model, "-o", out, "--store", tmp_path / "store")
    drawn, page = [], monitor_page.unit_page

    def counted(unit, limit):
        drawn.append(unit["unit"])
        return page(unit, limit)

    monkeypatch.setattr(monitor_page, "unit_page", counted)
    invoke_json(*command)
    before = {path.name: path.read_bytes() for path in (out / "units").iterdir()}
    open_store(str(tmp_path / "store")).add([replace(record, unit="B", key="B2", run="later.csv")])
    invoke_json(*command)
    after = {path.name: path.read_bytes() for path in (out / "units").iterdir()}
    assert drawn == ["A", "B", "B"]
    assert before.keys() == after.keys() and sum(before[name] == after[name] for name in before) == 1
    # At another limit, by another version, or where one was lost, they are made anew.
    invoke_json(*command, "--false-alarm-every", 500)
    next((out / "units").glob("A*")).write_text("of another version")
    next((out / "units").glob("B*")).unlink()
    invoke_json(*command, "--false-alarm-every", 500)
    assert drawn[3:] == ["A", "B", "A", "B"]
