"""Outputs appear whole or not at all, whoever else writes and whenever a writer is killed."""

from __future__ import annotations

import json
import multiprocessing
import os
import shutil
import signal
import socket
import subprocess
import sys
import time
from pathlib import Path

import pytest

from fogml import folders, outputs
from fogml.errors import InputError
from fogml.locks import Held, sole_writer
from fogml.outputs import folder_to_fill, scratch_folder, settle, whole_file, whole_files, whole_folder

ROOT = Path(__file__).parents[2]


def tree(folder: Path) -> dict[str, str]:
    """Every file below a folder with what it holds."""
    return {str(p.relative_to(folder)): p.read_text() for p in sorted(folder.rglob("*")) if p.is_file()}


def write(folder: Path, **files: str) -> None:
    for name, text in files.items():
        path = folder / name.replace("__", "/")
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)


def not_permitted(*_, **__):
    raise PermissionError(1, "Operation not permitted")


@pytest.fixture(params=["exchange", "one by one", "no hard links", "no modes"])
def way(request, monkeypatch):
    """Every way of replacing a folder that is there, on shares that lack something too."""
    if request.param == "one by one":
        monkeypatch.setattr(folders, "_exchange", lambda one, other: False)
    elif request.param == "no hard links":
        monkeypatch.setattr(os, "link", not_permitted)
    elif request.param == "no modes":
        monkeypatch.setattr(os, "chmod", not_permitted)
    return request.param


def test_a_folder_is_replaced_and_keeps_what_is_not_of_it(tmp_path, way):
    out = tmp_path / "out"
    write(out, report="old", model__a="old", model__b="old", mine="mine", notes__x="mine")
    (out / "link").symlink_to("mine")
    with whole_folder(out) as folder:
        write(folder, report="new", model__a="new")
    assert tree(out) == {
        "report": "new",
        "model/a": "new",
        "mine": "mine",
        "notes/x": "mine",
        "link": "mine",
    }
    assert (out / "link").is_symlink()
    assert os.listdir(tmp_path) == ["out"]


@pytest.mark.parametrize("shared", [True, False])
def test_a_folder_takes_the_place_of_a_link_or_a_file(tmp_path, way, shared):
    """As of one that was moved to a larger disk; what the link leads to stays as it is."""
    write(tmp_path, elsewhere__page="old", out__model="a file", out__mine="mine")
    (tmp_path / "out" / "units").symlink_to("../elsewhere")
    with whole_folder(tmp_path / "out", shared=shared) as folder:
        write(folder, report="new", model__a="new", units__page="new")
    assert tree(tmp_path) == {
        "elsewhere/page": "old",
        "out/report": "new",
        "out/model/a": "new",
        "out/units/page": "new",
        "out/mine": "mine",
    }


@pytest.mark.parametrize("lacking", [(), ("link",)])
def test_a_name_is_given_once_with_and_without_hard_links(tmp_path, monkeypatch, lacking):
    for name in lacking:
        monkeypatch.setattr(os, name, not_permitted)
    write(tmp_path, one="1", other="2")
    folders.give_name(tmp_path / "one", tmp_path / "named")
    with pytest.raises(FileExistsError):
        folders.give_name(tmp_path / "other", tmp_path / "named")
    assert tree(tmp_path) == {"named": "1", "other": "2"}


def test_an_error_leaves_the_old_folder_as_it_was(tmp_path, way):
    out = tmp_path / "out"
    write(out, report="old", model__a="old")
    with pytest.raises(RuntimeError), whole_folder(out) as folder:
        write(folder, report="new")
        raise RuntimeError
    assert tree(tmp_path) == {"out/report": "old", "out/model/a": "old"}


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="renameat2 is Linux's")
def test_a_reader_never_sees_parts_of_two_results(tmp_path):
    out = tmp_path / "out"
    write(out, a="0", b__c="0")
    seen = set()
    context = multiprocessing.get_context("spawn")
    writer = context.Process(target=_replace_often, args=(out, 150))
    writer.start()
    while writer.is_alive():
        handle = os.open(out, os.O_RDONLY)
        try:
            # Both names of one folder, whichever it is.
            parts = []
            for name in ("a", "b/c"):
                with open(os.open(name, os.O_RDONLY, dir_fd=handle), encoding="ascii") as file:
                    parts.append(file.read())
            seen.add(tuple(parts))
        except FileNotFoundError:
            pass  # it was removed since it was opened
        finally:
            os.close(handle)
    writer.join()
    assert writer.exitcode == 0
    assert seen <= {(str(n), str(n)) for n in range(151)}


def _replace_often(out: Path, times: int) -> None:
    for number in range(1, times + 1):
        with whole_folder(out) as folder:
            write(folder, a=str(number), b__c=str(number))


class Killed(BaseException):
    """Stands for a kill: nothing is cleaned up after it."""


@pytest.mark.parametrize("locks", [True, False])
@pytest.mark.parametrize("place", range(12))
def test_a_kill_between_two_renames_is_made_good_by_the_next_writer(tmp_path, monkeypatch, place, locks):
    out = tmp_path / "out"
    if not locks:
        with subprocess.Popen([sys.executable, "-c", ""]) as dead:
            told = json.dumps({"pid": dead.pid, "host": socket.gethostname(), "started": "1"})
        monkeypatch.setattr("fogml.locks.this_process", lambda: told)
        monkeypatch.setattr("fogml.locks.fcntl", None)
    write(out, a="old", model__w="old", model__x="old", mine="mine")
    count = 0

    def counted(rename):
        def run(*words, **more):
            nonlocal count
            count += 1
            if count == place:
                raise Killed
            return rename(*words, **more)

        return run

    monkeypatch.setattr(os, "rename", counted(os.rename))
    monkeypatch.setattr(os, "replace", counted(os.replace))
    monkeypatch.setattr(shutil, "rmtree", lambda *words, **more: None)
    try:
        with whole_folder(out, shared=True) as folder:
            write(folder, a="new", b="new", model__w="new")
    except Killed:
        pass
    monkeypatch.undo()
    if not locks:
        monkeypatch.setattr("fogml.locks.fcntl", None)
    settle(out)
    old = {"a": "old", "model/w": "old", "model/x": "old", "mine": "mine"}
    new = {"a": "new", "b": "new", "model/w": "new", "mine": "mine"}
    assert tree(out) in ([new] if place != 1 else [old])
    assert not [path for path in out.iterdir() if path.name.startswith(".")]


def test_a_kill_while_the_staging_folder_is_removed_is_made_good(tmp_path, monkeypatch):
    remove = shutil.rmtree

    monkeypatch.setattr(shutil, "rmtree", lambda path, **more: remove(path / "content"))
    with whole_files(tmp_path / "run.csv", tmp_path / "run.yaml") as (run, side):
        run.write_text("rows")
        side.write_text("facts")
    monkeypatch.undo()
    assert len(list(tmp_path.glob(".commit-*"))) == 1
    settle(tmp_path)
    assert sorted(os.listdir(tmp_path)) == ["run.csv", "run.yaml"]


def test_an_interrupt_while_the_staging_folder_is_removed_leaves_none(tmp_path, monkeypatch):
    remove = shutil.rmtree

    def interrupted(path, **more):
        monkeypatch.undo()
        remove(path / "content")
        raise KeyboardInterrupt

    monkeypatch.setattr(shutil, "rmtree", interrupted)
    with pytest.raises(KeyboardInterrupt), whole_file(tmp_path / "run.csv") as partial:
        partial.write_text("rows")
    assert os.listdir(tmp_path) == ["run.csv"]


def test_files_appear_together_and_a_folder_in_their_place_is_refused_first(tmp_path):
    with whole_files(tmp_path / "run.csv", tmp_path / "run.yaml") as (run, side):
        run.write_text("rows")
        side.write_text("facts")
    assert tree(tmp_path) == {"run.csv": "rows", "run.yaml": "facts"}
    (tmp_path / "folder.csv").mkdir()
    with (
        pytest.raises(InputError, match=r"folder\.csv: is a folder"),
        whole_files(tmp_path / "side.yaml", tmp_path / "folder.csv"),
    ):
        raise AssertionError
    assert tree(tmp_path) == {"run.csv": "rows", "run.yaml": "facts"}


def test_a_living_writer_s_folder_stays_and_a_dead_one_s_goes(tmp_path):
    with whole_file(tmp_path / "mine") as partial:
        settle(tmp_path)
        partial.write_text("here")
    assert tree(tmp_path) == {"mine": "here"}
    code = (
        "import os, sys\nfrom fogml.outputs import whole_file\n"
        "with whole_file(sys.argv[1]) as partial:\n"
        "    partial.write_text('half')\n    print('writing', flush=True)\n    sys.stdin.read()"
    )
    process = subprocess.Popen(
        [sys.executable, "-c", code, str(tmp_path / "other")],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
    )
    assert process.stdout is not None and process.stdin is not None
    process.stdout.readline()
    settle(tmp_path)
    assert len(list(tmp_path.glob(".partial-*"))) == 1
    foreign = tmp_path / ".partial-0123abcd-0000"
    foreign.mkdir()
    os.kill(process.pid, signal.SIGKILL)
    process.wait()
    process.stdin.close()
    process.stdout.close()
    with whole_file(tmp_path / "third") as partial:
        partial.write_text("here")
    # Only its own host knows whether the process of the remaining one lives.
    assert sorted(os.listdir(tmp_path)) == [foreign.name, "mine", "third"]


def test_the_second_writer_is_told_who_the_first_is(tmp_path):
    out = tmp_path / "out"
    with whole_folder(out) as folder:
        write(folder, a="first")
        who = f"process {os.getpid()} on {socket.gethostname()}"
        with pytest.raises(InputError, match=who), whole_folder(out):
            raise AssertionError
        with whole_folder(tmp_path / "other") as other:
            write(other, a="other")
    assert tree(tmp_path) == {"out/a": "first", "other/a": "other"}


def test_the_lock_of_a_dead_process_is_taken_over(tmp_path, monkeypatch):
    lock, out = tmp_path / ".out.lock", tmp_path / "out"
    here, gone = socket.gethostname(), {"pid": 999999999, "started": "1"}
    for host in (here, "a container that is gone"):
        lock.write_text(json.dumps({**gone, "host": host}))
        with sole_writer(out):
            assert json.loads(lock.read_text())["pid"] == os.getpid()
        assert not lock.exists()
    # On a file system without locks there is only what the file states.
    monkeypatch.setattr("fogml.locks._locked", lambda handle, wait: False)
    who = f"process {os.getpid()} on {here}"
    for text in ("", "garbage", json.dumps({**gone, "host": here})):
        lock.write_text(text)
        with sole_writer(out), pytest.raises(Held, match=who) as held, sole_writer(out):
            raise AssertionError
        assert held.value.who == who
    lock.write_text(json.dumps({**gone, "host": "elsewhere"}))
    who = r"process 999999999 on elsewhere .* remove .*\.out\.lock"
    with pytest.raises(InputError, match=who), sole_writer(out):
        raise AssertionError


def test_the_next_writer_in_a_folder_removes_the_locks_of_dead_processes_alone(tmp_path):
    gone = {"pid": 999999999, "host": socket.gethostname(), "started": "1"}
    texts = {
        ".out+F-1.lock": gone,
        ".far.lock": gone | {"host": "elsewhere"},
        ".other.lock": [1],
        ".endless.lock": gone | {"pid": float("inf")},
        ".no-number.lock": gone | {"pid": 10**30},
        "kept.lock": gone,
    }
    for name, told in texts.items():
        (tmp_path / name).write_text(json.dumps(told))
    with sole_writer(tmp_path / "mine"), whole_file(tmp_path / "run.csv") as partial:
        partial.write_text("")
        assert (tmp_path / ".mine.lock").exists()
    assert {path.name for path in tmp_path.iterdir()} == {*texts, "run.csv"} - {
        ".out+F-1.lock",
        ".no-number.lock",
    }


def test_a_folder_to_fill_is_gone_where_nothing_came_into_it(tmp_path):
    (tmp_path / "here").mkdir()
    for error in (OSError, KeyboardInterrupt):
        with pytest.raises(error), folder_to_fill(tmp_path / "here" / "deep" / "er"):
            raise error
        assert not list((tmp_path / "here").iterdir())
    with pytest.raises(OSError, match="full"), folder_to_fill(tmp_path / "here" / "deep" / "er"):
        (tmp_path / "here" / "deep" / "kept").write_text("")
        raise OSError("full")
    assert tree(tmp_path) == {"here/deep/kept": ""}
    assert not (tmp_path / "here" / "deep" / "er").exists()


def test_messages_name_the_output_and_not_where_it_lies_meanwhile(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(InputError) as told, whole_folder("out") as folder:
        raise InputError(f"{folder / 'report.json'}: is bad, and so is {folder}")
    assert str(told.value) == "out/report.json: is bad, and so is out"
    with pytest.raises(InputError) as told, whole_file("run.csv") as partial:
        (partial / "deeper").write_text("")
    assert (
        str(told.value)
        == "run.csv/deeper: cannot be written (No such file or directory); choose another place"
    )
    with pytest.raises(FileNotFoundError, match=r"input\.csv"), whole_folder("out"):
        Path("input.csv").read_text()


@pytest.mark.parametrize("moment", ["meanwhile", "at the end"])
def test_a_shared_folder_that_another_made_first_stays_the_folder_it_is(tmp_path, monkeypatch, moment):
    """An exchange would take away from under a third writer what that one has begun in it."""
    out, replaced = tmp_path / "out", os.replace

    def another():
        out.mkdir()
        (out / "theirs").write_text("1")

    def replace(one, other):
        if moment == "at the end" and not out.exists():
            another()
        replaced(one, other)

    monkeypatch.setattr("fogml.outputs.os.replace", replace)
    with whole_folder(out, shared=True) as folder:
        (folder / "mine").write_text("2")
        if moment == "meanwhile":
            another()
            there = out.stat().st_ino
    if moment == "meanwhile":
        assert out.stat().st_ino == there
    assert {path.name: path.read_text() for path in out.iterdir()} == {"theirs": "1", "mine": "2"}
    assert [path.name for path in tmp_path.iterdir()] == ["out"]


@pytest.mark.parametrize("shared", [True, False])
def test_places_that_are_links_or_the_present_folder(tmp_path, monkeypatch, shared):
    real = tmp_path / "real"
    write(real, a="old", mine="mine")
    (tmp_path / "link").symlink_to("real")
    (tmp_path / "dangling").symlink_to("missing")
    for name in ("link", "dangling"):
        with whole_folder(tmp_path / name, shared=shared) as folder:
            write(folder, a="new")
        assert (tmp_path / name).is_symlink()
    assert tree(real) == {"a": "new", "mine": "mine"}
    assert tree(tmp_path / "missing") == {"a": "new"}
    monkeypatch.chdir(real)
    before = os.stat(".").st_ino
    with whole_folder(".", shared=shared) as folder:
        write(folder, a="newer")
    assert os.stat(real).st_ino == before
    assert tree(Path()) == {"a": "newer", "mine": "mine"}


@pytest.mark.parametrize("whole", [whole_file, whole_folder])
def test_places_that_cannot_be(tmp_path, whole):
    write(tmp_path, file="mine")
    with (
        pytest.raises(InputError, match="file: is a file, a folder was expected"),
        whole(tmp_path / "file" / "x"),
    ):
        raise AssertionError
    assert tree(tmp_path) == {"file": "mine"}


def test_a_scratch_folder_is_gone_after_its_block(tmp_path, monkeypatch):
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    with scratch_folder() as folder:
        (folder / "x").touch()
    assert not list(tmp_path.iterdir())
    assert outputs.PARTIAL in str(folder)


def test_waiting_writers_take_turns(tmp_path):
    """A lock is not held by two, though its file is removed each time it is given back."""
    context = multiprocessing.get_context("spawn")
    crew = [context.Process(target=_add_one, args=(tmp_path, 60)) for _ in range(2)]
    for process in crew:
        process.start()
    for process in crew:
        process.join()
    assert (tmp_path / "count").read_text() == "120"


def _add_one(home: Path, times: int) -> None:
    done = 0
    while done < times:
        try:
            with sole_writer(home / "count"):
                path = home / "count"
                number = int(path.read_text()) if path.exists() else 0
                time.sleep(0.0005)
                path.write_text(str(number + 1))
            done += 1
        except InputError:
            time.sleep(0.0005)


def test_a_link_stays_and_what_it_leads_to_is_written(tmp_path):
    """As a shell's redirection does; a side file appears beside the link, where it is looked for."""
    (tmp_path / "disk").mkdir()
    (tmp_path / "disk" / "kept.csv").write_text("old")
    link, new = tmp_path / "run.csv", tmp_path / "new.csv"
    link.symlink_to("disk/kept.csv")
    new.symlink_to("disk/new-one.csv")
    for place in (link, new):
        with whole_file(place) as partial:
            assert partial.name == place.name
            partial.write_text("written")
    with whole_files(link, tmp_path / "run.yaml") as (partial, beside):
        partial.write_text("again")
        beside.write_text("facts")
    with pytest.raises(ValueError), whole_file(link) as partial:
        partial.write_text("half")
        raise ValueError
    assert link.is_symlink() and new.is_symlink()
    assert tree(tmp_path / "disk") == {"kept.csv": "again", "new-one.csv": "written"}
    assert (tmp_path / "run.yaml").read_text() == "facts" and (tmp_path / "run.yaml").is_file()
    assert sorted(os.listdir(tmp_path)) == ["disk", "new.csv", "run.csv", "run.yaml"]


def test_what_no_file_can_be_put_in_place_of_is_refused(tmp_path):
    os.mkfifo(tmp_path / "pipe")
    (tmp_path / "link").symlink_to("pipe")
    (tmp_path / "away").symlink_to("no-folder/run.csv")
    for name, reason in (
        ("pipe", "no ordinary file"),
        ("link", "no ordinary file"),
        ("away", "no such folder"),
    ):
        with pytest.raises(InputError, match=reason), whole_file(tmp_path / name):
            pass
    (tmp_path / "same.csv").symlink_to("kept.csv")
    both = tmp_path / "same.csv", tmp_path / "kept.csv"
    with pytest.raises(InputError, match="links to one file"), whole_files(*both):
        pass
    assert (tmp_path / "pipe").is_fifo() and (tmp_path / "link").is_symlink()


@pytest.mark.parametrize("parts", [("a" * 250,), ("b" * 60,) * 5, ("c",)])
def test_an_output_may_have_as_long_a_name_as_the_system_takes(tmp_path, parts):
    """One writer at a time all the same: a second is refused, and no lock stays."""
    out = tmp_path.joinpath(*parts)
    with whole_folder(out) as folder:
        (folder / "x").write_text("1")
        with pytest.raises(InputError, match="is writing it"), whole_folder(out):
            pass
    assert (out / "x").read_text() == "1"
    assert [entry.name for entry in tmp_path.iterdir()] == [parts[0]]


def test_a_disk_that_is_full_at_the_begin_is_told_with_the_output(tmp_path, monkeypatch):
    def full(handle, text, offset):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "pwrite", full)
    with pytest.raises(OSError, match=r"No space left on device: '.*out'"), sole_writer(tmp_path / "out"):
        pass
    assert list(tmp_path.iterdir()) == []
