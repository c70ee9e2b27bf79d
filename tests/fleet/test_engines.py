"""Engines: every unit once, whatever happens to workers; bad units do not stop the others."""

from __future__ import annotations

import errno
import json
import os
import signal
import subprocess
import sys
import time
from collections import Counter
from concurrent.futures import Future
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

import pytest

from fogml.errors import InputError
from fogml.fleet.engines import run_tasks
from fogml.fleet.tasks import OUTCOME
from tests.fleet.units import deadly_while_writing, noted, one_bad, one_deadly, quick, slow, tasks

ROOT = Path(__file__).parents[2]
WORST = {
    "run": "b.csv",
    "averaging_s": 100.0,
    "before": 2.0,
    "after": 1.0,
    "floor": 0.5,
    "outside_training": 0.0,
}


def test_units_that_are_done_are_not_done_again(tmp_path):
    first = run_tasks(tasks(tmp_path, 4, quick)[:2])
    every = run_tasks(tasks(tmp_path, 4, quick), workers=2)
    assert [outcome["found"]["number"] for outcome in every] == [0, 1, 2, 3]
    assert every[:2] == first
    assert Counter(noted(tmp_path / "out")) == Counter(f"done FOG-00{n}" for n in range(4))
    (tmp_path / "1a.csv").write_text((tmp_path / "1a.csv").read_text() + "9999,1,20\n")
    run_tasks(tasks(tmp_path, 4, quick))
    assert noted(tmp_path / "out").count("done FOG-001") == 2


@pytest.mark.parametrize(
    ("key", "value"),
    [
        ("found", 0.03),
        ("found", {"worst": [1.0]}),
        ("found", {"worst": WORST | {"after": "small"}}),
        ("found", {"worst": WORST | {"before": None}}),
        ("found", {"worst": WORST | {"after": 1e308}}),
        ("found", {"worst": WORST | {"floor": -1.0}}),
        ("found", {"met": "yes"}),
        ("found", {"notes": "none"}),
        ("found", {"constants": 3}),
        ("axis", 1),
        ("unit", None),
    ],
)
def test_an_outcome_that_no_job_has_written_is_made_again(tmp_path, key, value):
    (sound,) = run_tasks(tasks(tmp_path, 1, quick))
    path = tmp_path / "out" / "FOG-000-x" / OUTCOME
    path.write_text(json.dumps(sound | {key: value}))
    assert run_tasks(tasks(tmp_path, 1, quick)) == [sound]
    assert json.loads(path.read_text()) == sound


def test_a_kill_leaves_no_outcome_beside_the_results_of_other_settings(tmp_path):
    (task,) = tasks(tmp_path, 1, quick)
    run_tasks([task])
    with pytest.raises(Killed):
        run_tasks([replace(task, job=killed, settings={"model": "other"})])
    run_tasks([task])
    assert noted(tmp_path / "out").count("done FOG-000") == 2


def test_a_folder_that_another_unit_has_stays_as_it_is(tmp_path):
    """Names of units are many to one folder: of another manifest, 'a/b' comes where 'a_b' lies."""
    (task,) = tasks(tmp_path, 1, quick)
    run_tasks([task])
    held = (task.folder / OUTCOME).read_bytes()
    (other,) = run_tasks([replace(task, unit=replace(task.unit, name="FOG 000"))])
    assert other["status"] == "failed"
    assert "holds the results of 'FOG-000 x'; choose another --out" in other["reason"]
    assert (task.folder / OUTCOME).read_bytes() == held


class Killed(BaseException):
    """Stands for a kill: nothing is cleaned up after it."""


def killed(unit, folder):
    raise Killed


@pytest.mark.parametrize("workers", [1, 2])
def test_bad_units_are_reported_and_the_rest_go_on(tmp_path, workers):
    seen = []
    outcomes = run_tasks(tasks(tmp_path, 4, one_bad), workers=workers, progress=seen.append)
    assert [outcome["status"] for outcome in outcomes] == ["done", "failed", "failed", "done"]
    assert outcomes[1]["reason"] == "the run is empty"
    assert outcomes[2]["reason"] == "RuntimeError: unforeseen"
    assert len(seen) == 4
    # A unit that failed is tried again.
    again = run_tasks(tasks(tmp_path, 4, one_bad))
    assert [outcome["status"] for outcome in again] == ["done", "failed", "failed", "done"]
    assert Counter(noted(tmp_path / "out"))["done FOG-000"] == 1


def test_a_unit_that_ends_its_process_is_found(tmp_path):
    outcomes = run_tasks(tasks(tmp_path, 4, one_deadly), workers=2)
    assert [outcome["status"] for outcome in outcomes] == ["done", "done", "failed", "done"]
    assert "killed" in outcomes[2]["reason"]
    # What ran beside it may have been ended before its outcome was written: then it was done again.
    times = Counter(noted(tmp_path / "out"))
    assert set(times) == {f"done FOG-00{n}" for n in (0, 1, 3)}
    assert max(times.values()) <= 3


def test_after_a_broken_pool_the_rest_go_on_side_by_side(tmp_path, monkeypatch):
    """Units one by one cost a process each: those that the pool may have been at alone are run so."""
    from joblib.externals.loky.process_executor import BrokenProcessPool

    pools = []

    class Breaking:
        """Runs in this process; from a deadly unit on, as a pool whose process was killed."""

        def __init__(self):
            self.broken = False

        def submit(self, job, task):
            future = Future()
            self.broken = self.broken or task.unit.name in ("FOG-002", "FOG-012")
            if self.broken:
                future.set_exception(BrokenProcessPool())
            else:
                future.set_result(job(task))
            return future

    @contextmanager
    def pool(processes):
        pools.append(processes)
        yield Breaking()

    monkeypatch.setattr("fogml.fleet.engines.worker_pool", pool)
    outcomes = run_tasks(tasks(tmp_path, 20, quick), workers=2)
    failed = [outcome["unit"] for outcome in outcomes if outcome["status"] == "failed"]
    assert failed == ["FOG-002", "FOG-012"]
    assert pools == [2, 1, 1, 1, 1, 2, 1, 1, 1, 1, 2]
    assert set(Counter(noted(tmp_path / "out")).values()) == {1}


def test_what_an_ended_worker_had_half_written_is_removed(tmp_path):
    (outcome,) = run_tasks(tasks(tmp_path, 1, deadly_while_writing), workers=2)
    assert "killed" in outcome["reason"]
    assert not list(tmp_path.rglob(".partial-*"))


def test_a_full_disk_stops_the_fleet_with_one_message_and_keeps_what_is_done(tmp_path, monkeypatch):
    run_tasks(tasks(tmp_path, 3, quick)[:1])

    def full(*words: object, **more: object) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr("fogml.fleet.tasks.whole_file", full)
    with pytest.raises(InputError, match="No space left on device"):
        run_tasks(tasks(tmp_path, 3, quick))
    monkeypatch.undo()
    assert not (tmp_path / "out" / "FOG-001-x" / OUTCOME).exists()
    assert all(outcome["status"] == "done" for outcome in run_tasks(tasks(tmp_path, 3, quick)))
    assert noted(tmp_path / "out").count("done FOG-000") == 1


@pytest.fixture
def cluster(tmp_path):
    """A scheduler and two worker processes; its address and the workers."""
    pytest.importorskip("distributed", reason="Dask is not installed: pip install -e '.[cluster]'")
    started = []

    def start(*words: str) -> subprocess.Popen:
        environment = {**os.environ, "PYTHONPATH": str(ROOT), "PYTHONWARNINGS": ""}
        with (tmp_path / f"{len(started)}.log").open("w") as log:
            process = subprocess.Popen(
                [sys.executable, "-m", "distributed.cli." + words[0], *words[1:]],
                stdout=log,
                stderr=log,
                env=environment,
                cwd=tmp_path,
                start_new_session=True,
            )
        started.append(process)
        return process

    place = tmp_path / "scheduler.json"
    start(
        "dask_scheduler",
        "--host",
        "127.0.0.1",
        "--port",
        "0",
        "--no-dashboard",
        "--scheduler-file",
        str(place),
    )
    _wait_for(place.exists)
    workers = [
        start(
            "dask_worker", "--scheduler-file", str(place), "--nthreads", "1", "--no-nanny", "--no-dashboard"
        )
        for _ in range(2)
    ]
    import json

    address = json.loads(place.read_text())["address"]
    yield address, workers
    for process in reversed(started):
        process.kill()
        process.wait()


def _wait_for(what, seconds: float = 60.0) -> None:
    deadline = time.monotonic() + seconds
    while not what():
        assert time.monotonic() < deadline
        time.sleep(0.05)


def test_a_cluster_does_every_unit_once_though_a_worker_is_killed(tmp_path, cluster):
    address, workers = cluster
    all_tasks = tasks(tmp_path, 12, slow)
    seen = []

    def kill_one(outcome) -> None:
        seen.append(outcome)
        if len(seen) == 2:
            # One that has begun a unit and has results behind it.
            pids = [int(line.split()[2]) for line in noted(tmp_path / "out") if line.startswith("begun")]
            victim = next(worker for worker in workers if worker.pid in pids)
            os.kill(victim.pid, signal.SIGKILL)

    outcomes = run_tasks(all_tasks, cluster=address, progress=kill_one)
    assert [outcome["status"] for outcome in outcomes] == ["done"] * 12
    assert [outcome["found"]["number"] for outcome in outcomes] == list(range(12))
    done = Counter(line for line in noted(tmp_path / "out") if line.startswith("done"))
    assert done == Counter(f"done FOG-{n:03d}" for n in range(12))
    assert len({line.split()[2] for line in noted(tmp_path / "out") if line.startswith("begun")}) == 2


def test_a_cluster_that_does_not_answer(tmp_path, monkeypatch):
    pytest.importorskip("distributed", reason="Dask is not installed: pip install -e '.[cluster]'")
    monkeypatch.setattr("fogml.fleet.engines._ANSWER_S", 1)
    with pytest.raises(InputError, match="does not answer"):
        run_tasks(tasks(tmp_path, 2, quick), cluster="tcp://127.0.0.1:9")
