"""Programs end at their limits, nothing of them lives on, and no shell reads their words."""

from __future__ import annotations

import os
import sys
import time
from pathlib import Path

import pytest

from fogml.cli.app_job import serve
from fogml.cli.run_commands import AppSettings
from fogml.cli.terminal import Terminal
from fogml.errors import InputError
from fogml.export.c_program import host_compiler
from fogml.limited import LimitExceededError, ProgramLimits, run_limited

PYTHON = [sys.executable, "-I", "-S", "-c"]


def test_words_and_input_arrive_as_they_are():
    words = ["$(id)", "; touch x", "a b", "*"]
    done = run_limited(
        [*PYTHON, "import sys; print(sys.argv[1:]); sys.stdout.write(sys.stdin.read()); sys.exit(3)", *words],
        ProgramLimits(),
        b"in",
    )
    assert done.status == 3 and done.output.decode() == f"{words}\nin"


@pytest.mark.parametrize(
    ("limits", "code", "told"),
    [
        (ProgramLimits(cpu_s=1), "while True: pass", "1 s of processor time"),
        (ProgramLimits(wall_s=0.5), "import time; time.sleep(60)", r"more than 0\.5 s"),
    ],
)
def test_each_limit_is_told(limits, code, told):
    with pytest.raises(LimitExceededError, match=told):
        run_limited([*PYTHON, code], limits)


def test_a_system_that_tells_no_end_of_a_process_is_asked_for_it(monkeypatch):
    def none(pid: int) -> int:
        raise OSError("no such call, as before Linux 5.3")

    monkeypatch.setattr(os, "pidfd_open", none)
    assert run_limited([*PYTHON, "import sys; sys.exit(4)"], ProgramLimits()).status == 4
    with pytest.raises(LimitExceededError, match=r"more than 0\.2 s"):
        run_limited([*PYTHON, "import time; time.sleep(60)"], ProgramLimits(wall_s=0.2))


def test_what_writes_too_much_is_ended_by_the_first_byte_beyond():
    with pytest.raises(LimitExceededError, match="wrote more than 1 MB"):
        run_limited(["head", "-c", str(2 << 20), "/dev/zero"], ProgramLimits(output_bytes=1 << 20))


def test_memory_has_a_limit():
    done = run_limited([*PYTHON, "bytearray(1 << 30)"], ProgramLimits(memory_bytes=1 << 28))
    assert done.status == 1 and "MemoryError" in done.errors


def test_a_program_that_may_not_run_is_told_with_what_to_do(tmp_path):
    """As on a disk for temporary files that is mounted without leave to run them."""
    program = tmp_path / "program"
    program.write_text("#!/bin/sh\n")
    with pytest.raises(InputError, match=r"program: cannot be run \(Permission denied\); .* TMPDIR"):
        run_limited([str(program)], ProgramLimits())


def test_what_a_program_started_ends_with_it(tmp_path):
    note = tmp_path / "pid"
    code = (
        "import os, sys, time\n"
        "child = os.fork()\n"
        "if child == 0: time.sleep(60)\n"
        "open(sys.argv[1], 'w').write(str(child))\n"
    )
    run_limited([*PYTHON, code, str(note)], ProgramLimits())
    child = int(note.read_text())
    status = Path(f"/proc/{child}/status")
    for _ in range(100):
        if not status.exists() or "\nState:\tZ" in status.read_text():
            return
        time.sleep(0.05)
    raise AssertionError("the program's child lives on")


def test_what_a_program_leaves_among_temporary_files_goes_with_it(tmp_path, monkeypatch):
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    code = "import os, time; open(os.environ['TMPDIR'] + '/left.s', 'w'); time.sleep(60)"
    with pytest.raises(LimitExceededError):
        run_limited([*PYTHON, code], ProgramLimits(wall_s=0.5))
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("lacking", ["fork", "killpg"])
def test_a_system_without_groups_of_processes_is_told_before_anything_runs(monkeypatch, tmp_path, lacking):
    monkeypatch.delattr(os, lacking)
    for action in (
        lambda: run_limited(["cc", "--version"], ProgramLimits()),
        host_compiler,
        lambda: serve(AppSettings(folder=str(tmp_path / "app")), Terminal()),
    ):
        with pytest.raises(InputError, match=r"needs Linux; on Windows it works in WSL 2"):
            action()
    assert not list(tmp_path.iterdir())
