"""Jobs: each runs once, goes on without its server, and is found again."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from fogml.app.jobs import CANCELLED, ENDED, PROCESS, Jobs
from fogml.errors import InputError

ENDLESS = ["app", "endless", "--port", "0"]


def until(state: str, jobs: Jobs, name: str) -> None:
    """Wait for a job's state."""
    while (now := jobs.state(name)) != state:
        assert now in ("waiting", "running"), jobs.in_full(name)
        jobs.start_waiting()
        time.sleep(0.02)


def test_a_job_goes_on_without_its_server_and_is_found_again(tmp_path: Path) -> None:
    code = (
        "import sys, os; from pathlib import Path; from fogml.app.jobs import Jobs\n"
        f"Jobs(Path({str(tmp_path)!r}), 1).add(lambda results: ['docs', 'index'])\n"
        "os.kill(os.getpid(), 9)"
    )
    subprocess.run([sys.executable, "-c", code], check=False)
    jobs = Jobs(tmp_path, 1)
    assert jobs.names() == ["0001"]
    until("done", jobs, "0001")
    told = jobs.in_full("0001")
    assert told["line"] == "fogml docs index" and told["status"] == 0
    assert "Fibre-optic gyros drift" in told["stdout"]
    # Once it has begun, nobody begins it again.
    began = (tmp_path / "jobs" / "0001" / PROCESS).stat().st_mtime_ns
    again = subprocess.run(
        [sys.executable, "-m", "fogml.app.jobs", str(tmp_path / "jobs" / "0001")], check=True
    )
    assert again.returncode == 0
    assert (tmp_path / "jobs" / "0001" / PROCESS).stat().st_mtime_ns == began
    jobs.remove("0001")
    assert jobs.names() == []


def test_jobs_wait_for_each_other_and_are_cancelled(tmp_path: Path) -> None:
    jobs = Jobs(tmp_path, 1)
    first = jobs.add(lambda results: ENDLESS)
    second = jobs.add(lambda results: ["docs"])
    while "Open" not in jobs.in_full(first)["stdout"]:
        time.sleep(0.02)
    assert [jobs.state(name) for name in (first, second)] == ["running", "waiting"]
    with pytest.raises(InputError, match="cancel it first"):
        jobs.remove(first)
    jobs.cancel(second)
    assert jobs.state(second) == "cancelled"
    jobs.cancel(first)
    until("cancelled", jobs, first)
    assert jobs.told(first)["status"] == 143


def test_a_job_that_can_not_be_begun_leaves_no_process(tmp_path: Path) -> None:
    """The process made for it holds the pipe of stderr as long as it is there."""
    command = [sys.executable, "-m", "fogml.app.jobs", str(tmp_path / "no such folder")]
    assert subprocess.run(command, stderr=subprocess.PIPE, timeout=30).returncode != 0


def test_a_job_that_can_not_be_begun_now_waits_on(tmp_path: Path, monkeypatch) -> None:
    jobs = Jobs(tmp_path, 1)
    with monkeypatch.context() as patched:
        patched.setattr("fogml.app.jobs.sys.executable", "/bin/false")
        name = jobs.add(lambda results: ["docs", "--help"])
        assert jobs.state(name) == "waiting"
    until("done", jobs, name)


def test_jobs_are_in_the_order_of_their_numbers(tmp_path: Path) -> None:
    jobs = Jobs(tmp_path, 0)
    for name in ("9999", "²"):
        (jobs.folder / name).mkdir()
        (jobs.folder / name / "job.json").write_text('{"words": ["docs"], "made": ""}')
    assert jobs.add(lambda results: ["docs"]) == "10000"
    assert jobs.names() == ["9999", "10000"]


def test_a_job_whose_processes_are_gone_has_failed(tmp_path: Path) -> None:
    jobs = Jobs(tmp_path, 2)
    name = jobs.add(lambda results: ENDLESS)
    while "Open" not in jobs.in_full(name)["stdout"]:
        time.sleep(0.02)
    group = os.getpgid(json.loads((tmp_path / "jobs" / name / PROCESS).read_text())["pid"])
    assert group != os.getpgid(0)
    os.killpg(group, signal.SIGKILL)
    until("failed", jobs, name)


def test_a_command_whose_runner_is_killed_still_runs_and_is_cancelled(tmp_path: Path) -> None:
    jobs = Jobs(tmp_path, 1)
    name = jobs.add(lambda results: ENDLESS)
    while "Open" not in jobs.in_full(name)["stdout"]:
        time.sleep(0.02)
    os.kill(json.loads((tmp_path / "jobs" / name / PROCESS).read_text())["pid"], signal.SIGKILL)
    assert jobs.state(name) == "running"
    with pytest.raises(InputError, match="cancel it first"):
        jobs.remove(name)
    jobs.cancel(name)
    until("cancelled", jobs, name)


def test_what_was_done_before_it_heard_of_a_cancel_is_done(tmp_path: Path) -> None:
    jobs = Jobs(tmp_path, 0)
    name = jobs.add(lambda results: ["docs"])
    (tmp_path / "jobs" / name / CANCELLED).touch()
    states = {}
    for status in (0, 1, 143, -15):
        (tmp_path / "jobs" / name / ENDED).write_text(json.dumps({"status": status, "seconds": 1.0}))
        states[status] = jobs.state(name)
    assert states == {0: "done", 1: "limit", 143: "cancelled", -15: "cancelled"}


def test_runs_to_choose_from_are_those_that_were_imported(tmp_path: Path) -> None:
    jobs = Jobs(tmp_path, 1)
    for name, words in (("0001", ["import", "log.txt"]), ("0002", ["compensate", "import"]), ("0003", [])):
        results = tmp_path / "jobs" / name / "results"
        results.mkdir(parents=True)
        (results / "run.csv").write_text("time [s]\n0\n")
        (results.parent / "job.json").write_text(json.dumps({"words": words, "made": ""}))
    assert jobs.runs() == [
        {"name": path, "path": path, "bytes": 11, "run": True} for path in ["jobs/0001/results/run.csv"]
    ]


def test_a_refused_command_says_why(tmp_path: Path) -> None:
    jobs = Jobs(tmp_path, 1)
    name = jobs.add(lambda results: ["inspect", "files/none.csv", "--out", results])
    until("refused", jobs, name)
    told = jobs.in_full(name)
    # What it said last is no progress once it has ended.
    assert "none.csv" in told["stderr"] and told["files"] == [] and told["progress"] == ""


def test_results_of_a_job_that_has_ended_are_looked_for_once(tmp_path: Path, monkeypatch) -> None:
    """A page asks each second, and a month's fleet is thousands of folders."""
    jobs = Jobs(tmp_path, 0)
    ended, running = jobs.add(lambda results: ["docs"]), jobs.add(lambda results: ["docs"])
    for name in (ended, running):
        (tmp_path / "jobs" / name / "results" / "fleet.json").write_text("{}")
    (tmp_path / "jobs" / ended / ENDED).write_text('{"status": 0, "seconds": 1.0}')
    assert jobs.written("fleet.json") == [f"jobs/{ended}/results/fleet.json"]
    with monkeypatch.context() as patched:
        patched.setattr(Path, "glob", None)
        assert jobs.written("fleet.json") == [f"jobs/{ended}/results/fleet.json"]
    # Another job that gets the number of one that was removed is looked at anew.
    (tmp_path / "jobs" / running / ENDED).write_text('{"status": 0, "seconds": 1.0}')
    assert len(jobs.written("fleet.json")) == 2
    jobs.remove(running)
    assert jobs.add(lambda results: ["docs"]) == running
    (tmp_path / "jobs" / running / ENDED).write_text('{"status": 0, "seconds": 1.0}')
    assert jobs.written("fleet.json") == [f"jobs/{ended}/results/fleet.json"]
