"""Storages: journals survive killed writers and full disks; a database that is not there is told plainly."""

from __future__ import annotations

import errno
import fcntl
import json
import multiprocessing
import resource
import sys
import time
from concurrent.futures import ThreadPoolExecutor

import pytest
from optuna.storages import JournalStorage

from experiments.faults.postgres import free_port
from fogml.databases import without_password
from fogml.errors import InputError
from fogml.tuning import journal
from fogml.tuning.journal import WholeLines
from fogml.tuning.storage import JOURNAL, open_storage, shown
from fogml.tuning.study import is_finished
from fogml.tuning.sweep import run_sweep
from tests.tuning.world import plan


def test_a_database_that_does_not_answer(tmp_path):
    url = f"postgresql://somebody:secret@127.0.0.1:{free_port()}/studies"
    with pytest.raises(InputError) as told:
        run_sweep(plan(tmp_path, storage=url))
    assert "does not answer" in str(told.value)
    assert "secret" not in str(told.value)
    assert "secret" not in shown(url)
    assert without_password(url) == url.replace(":secret", "")
    # libpq takes it among the options, too.
    option = "postgresql://somebody@host/studies?password=secret&application_name=x"
    assert "secret" not in shown(option) + without_password(option)
    assert "application_name=x" in without_password(option)


@pytest.mark.parametrize("url", ["not a url", "nosuchdatabase://x/y"])
def test_a_storage_that_is_not_known(tmp_path, url):
    with pytest.raises(InputError, match="--storage"):
        open_storage(url, tmp_path)


def test_a_journal_that_is_none(tmp_path):
    (tmp_path / JOURNAL).write_text('{"a": 1}\n{"b": 2}\n')
    with pytest.raises(InputError, match="no study's journal"):
        open_storage(None, tmp_path)


def test_half_a_line_is_dropped_by_the_next_writer(tmp_path):
    path = tmp_path / "journal"
    held = WholeLines(str(path))
    held.append_logs([{"a": 1}, {"b": 2}])
    with path.open("ab") as file:
        file.write(b'{"c": ')
    assert list(WholeLines(str(path)).read_logs(0)) == [{"a": 1}, {"b": 2}]
    WholeLines(str(path)).append_logs([{"d": 4}])
    assert [json.loads(line) for line in path.read_text().splitlines()] == [{"a": 1}, {"b": 2}, {"d": 4}]
    assert list(held.read_logs(2)) == [{"d": 4}]
    assert list(tmp_path.iterdir()) == [path]


def test_without_locks_of_the_system_two_writers_lose_no_line(tmp_path, monkeypatch):
    """As on a share that knows none: while one writes, another that looks where to write waits."""

    def no_locks(handle, operation):
        raise OSError(errno.ENOLCK, "No locks available")

    monkeypatch.setattr(fcntl, "flock", no_locks)
    path = tmp_path / "journal"
    one, other = WholeLines(str(path)), WholeLines(str(path))
    write_all = journal._write_all

    def slowly(file, data):
        time.sleep(0.02)
        write_all(file, data)

    monkeypatch.setattr(journal, "_write_all", slowly)
    with ThreadPoolExecutor(2) as both:
        told = [both.submit(log.append_logs, [{key: 1}]) for log, key in ((one, "a"), (other, "b"))]
        for writing in told:
            writing.result()
    assert sorted(one.read_logs(0), key=str) == [{"a": 1}, {"b": 1}]
    assert list(tmp_path.iterdir()) == [path]


def _sweep_on_a_small_disk(settings, most, told):
    sys.dont_write_bytecode = True  # else half of a module's stays
    resource.setrlimit(resource.RLIMIT_FSIZE, (most, most))
    try:
        run_sweep(settings)
    except InputError as error:
        told.send(str(error))


def test_a_disk_that_fills_in_the_middle_keeps_the_finished_trials(tmp_path):
    settings = plan(tmp_path, trials=6)
    run_sweep(plan(tmp_path, trials=3))
    most = (tmp_path / JOURNAL).stat().st_size + 700
    context = multiprocessing.get_context("spawn")
    here, there = context.Pipe()
    process = context.Process(target=_sweep_on_a_small_disk, args=(settings, most, there))
    process.start()
    process.join(60)
    assert here.poll()
    assert "cannot be written" in here.recv()
    text = (tmp_path / JOURNAL).read_text()
    assert text.endswith("\n")
    assert len(text) <= most
    assert JournalStorage(WholeLines(str(tmp_path / JOURNAL))).get_all_studies()
    ended = run_sweep(settings)
    assert sum(is_finished(trial) for trial in ended.get_trials()) == 6


def test_a_journal_that_took_nothing_does_not_stay(tmp_path, monkeypatch):
    def full(file, data):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("fogml.tuning.journal._write_all", full)
    with pytest.raises(InputError, match=r"study\.journal: cannot be written"):
        run_sweep(plan(tmp_path / "new" / "out", trials=3))
    assert not list(tmp_path.glob("new*"))


def test_the_database_gets_the_password_that_is_shown_to_nobody(monkeypatch):
    asked = []

    def storage(url, engine_kwargs):
        asked.append(url)
        raise RuntimeError("refused")

    monkeypatch.setattr("optuna.storages.RDBStorage", storage)
    with pytest.raises(InputError, match="does not answer") as told:
        open_storage("postgresql://lab:secret@host/studies", ".")
    assert all(url.endswith("://lab:secret@host/studies") for url in asked) and asked
    assert "secret" not in str(told.value)
