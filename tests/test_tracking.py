"""What a tracker is told: each trial and unit once; nothing depends on it. A stand-in is MLflow's client."""

from __future__ import annotations

import json
import sys
from types import ModuleType, SimpleNamespace
from typing import Any

import pytest

from fogml.errors import InputError
from fogml.tracking import KEY, Tracker, shown_tracker
from tests.cli.conftest import run_program
from tests.fleet.units import write_fleet


class Page(list):
    """A page of MLflow's answers."""

    token: str | None = None


class Client:
    """What of MLflow's client is used; `held` is its store, by address."""

    held: dict[str, dict[str, dict[str, Any]]] = {}
    away_after: int | None = None

    def __init__(self, tracking_uri: str) -> None:
        self.uri, self.runs = tracking_uri, self.held.setdefault(tracking_uri, {})

    def get_experiment_by_name(self, name: str) -> Any:
        return None if not self.runs else SimpleNamespace(experiment_id="1")

    def create_experiment(self, name: str) -> str:
        return "1"

    def search_runs(self, experiments: list[str], page_token: str | None) -> Page:
        # One a page, so that pages are turned.
        place = int(page_token or 0)
        runs = list(self.runs.values())
        page = Page(
            SimpleNamespace(data=SimpleNamespace(tags=run["tags"])) for run in runs[place : place + 1]
        )
        page.token = str(place + 1) if place + 1 < len(runs) else None
        return page

    def create_run(self, experiment: str, run_name: str) -> Any:
        if self.away_after is not None and len(self.runs) >= self.away_after:
            # As mlflow.utils.rest_utils.http_request says it.
            raise ConnectionError(f"API request to {self.uri}/api failed: no route to host\nmore")
        name = str(len(self.runs))
        self.runs[name] = {"name": run_name, "params": {}, "metrics": {}, "tags": {}, "ended": False}
        return SimpleNamespace(info=SimpleNamespace(run_id=name))

    def log_param(self, run: str, key: str, value: str) -> None:
        self.runs[run]["params"][key] = value

    def log_metric(self, run: str, key: str, value: float) -> None:
        self.runs[run]["metrics"][key] = value

    def set_tag(self, run: str, key: str, value: str) -> None:
        self.runs[run]["tags"][key] = value

    def set_terminated(self, run: str) -> None:
        self.runs[run]["ended"] = True


@pytest.fixture
def store(monkeypatch: pytest.MonkeyPatch) -> dict[str, dict[str, dict[str, Any]]]:
    module = ModuleType("mlflow")
    module.MlflowClient = Client  # type: ignore[attr-defined]
    monkeypatch.setitem(sys.modules, "mlflow", module)
    monkeypatch.setattr(Client, "held", {})
    monkeypatch.setattr(Client, "away_after", None)
    for name in ("MLFLOW_DISABLE_TELEMETRY", "DO_NOT_TRACK"):
        monkeypatch.setenv(name, "true")
    return Client.held


def test_each_is_told_once_even_after_a_restart(store) -> None:
    for count in (2, 4):
        tracker = Tracker("mlruns", "fogml sweep", print)
        for place in range(count):
            metrics = {"rms": 0.1 * place, "bytes": None, "bias": float("nan")}
            tracker.log(
                f"key{place}", f"trial {place}", {"model": "rbf" * 300}, metrics, {"state": "complete"}
            )
    runs = list(store["mlruns"].values())
    assert [run["tags"][KEY] for run in runs] == ["key0", "key1", "key2", "key3"]
    assert runs[1]["metrics"] == {"rms": 0.1} and len(runs[0]["params"]["model"]) == 500
    assert all(run["ended"] for run in runs)


def test_one_that_is_away_costs_a_note_and_no_more(store, monkeypatch) -> None:
    monkeypatch.setattr(Client, "away_after", 1)
    notes: list[str] = []
    tracker = Tracker("http://me:secret@host:5000", "fogml fleet", notes.append)
    for place in range(4):
        tracker.log(f"key{place}", "", {}, {}, {})
    (note,) = notes
    assert "http://host:5000" in note and "no route to host" in note and "secret" not in note
    assert len(store["http://me:secret@host:5000"]) == 1


def test_a_fleet_tells_of_its_units_and_its_results_are_the_same(store, tmp_path) -> None:
    manifest = write_fleet(tmp_path, 2)
    common = ("fleet", manifest, "--model", "mean", "--out")
    plain = run_program(*common, tmp_path / "plain", "--json").stdout
    place = "http://me:secret@host/x"
    told = run_program(*common, tmp_path / "out", "--json", "--track", place).stdout
    assert told == plain
    runs = list(store[place].values())
    assert [run["params"]["model"] for run in runs] == ["mean", "mean"]
    assert all(run["metrics"]["after"] > 0.0 for run in runs)
    config = tmp_path / "out" / "fleet.config.yaml"
    assert "secret" not in config.read_text()
    # Done before: nothing is told twice.
    run_program(*common, tmp_path / "out", "--quiet", "--track", place)
    assert len(store[place]) == 2


def test_mlflow_itself_keeps_what_it_is_told(tmp_path, monkeypatch) -> None:
    """Read back with MLflow's own client, where it is installed."""
    mlflow = pytest.importorskip("mlflow", reason="MLflow is not installed: pip install -e '.[mlflow]'")
    manifest, store = write_fleet(tmp_path, 2), str(tmp_path / "mlruns")
    common = ("fleet", manifest, "--model", "mean", "--quiet", "--out", tmp_path / "out", "--track", store)
    run_program(*common)
    run_program(*common)
    client = mlflow.MlflowClient(tracking_uri=store)
    experiment = client.get_experiment_by_name("fogml fleet")
    runs = client.search_runs([experiment.experiment_id])
    assert sorted(run.data.params["unit"] for run in runs) == ["FOG-000", "FOG-001"]
    assert {run.info.status for run in runs} == {"FINISHED"}
    told = json.loads((tmp_path / "out" / "fleet.json").read_text())["units"]
    assert sorted(run.data.metrics["after"] for run in runs) == sorted(unit["after"] for unit in told)


def test_without_mlflow_it_is_said_before_any_work(monkeypatch, tmp_path) -> None:
    monkeypatch.setitem(sys.modules, "mlflow", None)
    with pytest.raises(InputError, match="--track needs MLflow"):
        Tracker("mlruns", "fogml sweep", print)
    assert shown_tracker("mlruns/x") == "mlruns/x"
