"""A study in a database is opened by optuna-dashboard, as the README says."""

from __future__ import annotations

import json
import shutil
import subprocess
import sys
import time
import urllib.error
import urllib.request
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from experiments.faults.postgres import free_port
from fogml.tuning.storage import JOURNAL
from fogml.tuning.study import is_finished
from fogml.tuning.sweep import run_sweep
from tests.tuning.world import plan

_ANSWER_S = 60


def _program() -> str:
    beside = Path(sys.executable).with_name("optuna-dashboard")
    found = str(beside) if beside.exists() else shutil.which("optuna-dashboard")
    if found is None:
        pytest.skip("optuna-dashboard is not installed: pip install optuna-dashboard")
    return found


@pytest.fixture
def dashboard(tmp_path: Path) -> Iterator[Callable[[str], Callable[[str], Any]]]:
    """Starts optuna-dashboard on a storage; gives what reads its HTTP interface."""
    started = []

    def start(storage: str) -> Callable[[str], Any]:
        port = free_port()
        words = [_program(), storage, "--host", "127.0.0.1", "--port", str(port), "--server", "wsgiref"]
        with (tmp_path / "dashboard.log").open("w") as log:
            process = subprocess.Popen(words, stdout=log, stderr=subprocess.STDOUT)
        started.append(process)

        def read(path: str) -> Any:
            with urllib.request.urlopen(f"http://127.0.0.1:{port}{path}", timeout=_ANSWER_S) as answer:
                return json.load(answer)

        deadline = time.monotonic() + _ANSWER_S
        while True:
            try:
                read("/api/studies")
                return read
            except urllib.error.URLError:
                told = (tmp_path / "dashboard.log").read_text()
                assert process.poll() is None, told
                assert time.monotonic() < deadline, told
                time.sleep(0.2)

    yield start
    for process in started:
        process.terminate()
        process.wait(30)


@pytest.mark.parametrize("kept_in", ["journal", "postgres"])
def test_a_study_is_seen_with_its_trials(tmp_path, dashboard, kept_in, request):
    storage = request.getfixturevalue("database") if kept_in == "postgres" else None
    settings = replace(plan(tmp_path, storage=storage, trials=3), name=f"seen {kept_in} {tmp_path}")
    study = run_sweep(settings)
    read = dashboard(str(tmp_path / JOURNAL) if storage is None else storage)
    (told,) = [one for one in read("/api/studies")["study_summaries"] if one["study_name"] == settings.name]
    trials = read(f"/api/studies/{told['study_id']}")["trials"]
    ours = {trial.number: trial.values for trial in study.get_trials() if is_finished(trial)}
    theirs = {trial["number"]: trial.get("values") for trial in trials}
    assert len(ours) == 3
    assert {number: theirs[number] for number in ours} == ours
