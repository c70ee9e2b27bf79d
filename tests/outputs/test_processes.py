"""Workers end with the one that started them, however it ends, and leave nothing half-written."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import threading
import time
import warnings
from pathlib import Path

import pytest

from fogml.outputs import settle
from fogml.processes import in_processes, made_ahead, process_is_alive, process_start

ROOT = Path(__file__).parents[2]
HANGING = """
import os, time

def hang(case, out):
    (out / "gap.json").write_text("{}")
    # The keeper's copy of the folder is all that a sealed process can write to.
    open(os.path.join(out, f"{os.getpid()}.worker"), "w").close()
    time.sleep(600.0)
"""


def wait_for(what, seconds: float = 120.0):
    deadline = time.monotonic() + seconds
    while not (found := what()):
        assert time.monotonic() < deadline
        time.sleep(0.05)
    return found


def children(pid: int) -> list[int]:
    """Processes whose parent is this one, as the system says."""
    found = []
    for stat in Path("/proc").glob("[0-9]*/stat"):
        try:
            fields = stat.read_text(errors="replace").rpartition(")")[2].split()
        except OSError:
            continue
        if int(fields[1]) == pid:
            found.append(int(stat.parent.name))
    return found


@pytest.fixture
def place(tmp_path):
    for number in range(1, 3):
        case = tmp_path / "suite" / "cases" / f"{number:04d}"
        case.mkdir(parents=True)
        (case / "fit-1.csv").write_text("time [s],gyro [deg/h],T [degC]\n0,1,2\n1,1,2\n")
    (tmp_path / "suite" / "truth").mkdir()
    (tmp_path / "code").mkdir()
    (tmp_path / "code" / "hanging.py").write_text(HANGING)
    (tmp_path / "tmp").mkdir()
    return tmp_path


@pytest.mark.skipif(not Path("/proc/self/stat").exists(), reason="needs /proc")
@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGKILL])
@pytest.mark.parametrize("job", ["fleet", "sweep", "blind"])
def test_workers_end_with_their_parent(place, job, number):
    environment = {**os.environ, "PYTHONPATH": str(ROOT), "TMPDIR": str(place / "tmp")}
    process = subprocess.Popen(
        [sys.executable, "-m", "tests.outputs.children", job, str(place)], env=environment, cwd=ROOT
    )
    try:
        wait_for(lambda: len(list(place.rglob("*.worker"))) == 2 or process.poll() is not None)
        assert process.poll() is None
        workers = {child: process_start(child) for child in children(process.pid)}
        noted = {int(path.stem) for path in place.rglob("*.worker")}
        assert len(noted) == 2 and noted <= set(workers)
        os.kill(process.pid, number)
        status = process.wait(60)
    finally:
        process.kill()
    assert status == (143 if number == signal.SIGTERM else -signal.SIGKILL)
    wait_for(lambda: not any(process_is_alive(pid, start) for pid, start in workers.items()))
    if number == signal.SIGKILL:
        for folder in [place / "tmp", *place.glob("out/*")]:
            settle(folder)
    assert not list(place.rglob(".partial-*"))
    assert not list(place.rglob("outcome.json"))


def double(number: int) -> int:
    # What a library would print must not reach the terminal of a command.
    warnings.warn("overflow", RuntimeWarning, stacklevel=1)
    return 2 * number


def refuse(number: int) -> int:
    raise ValueError(number)


@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize("workers", [1, 2])
def test_processes_give_what_the_function_gives(workers, capfd):
    assert list(in_processes(double, range(4), workers, ordered=True)) == [0, 2, 4, 6]
    assert sorted(in_processes(double, range(4), workers)) == [0, 2, 4, 6]
    with pytest.raises(ValueError, match="3"):
        list(in_processes(refuse, [3, 3], workers))
    assert "overflow" not in capfd.readouterr().err


def test_what_is_made_ahead_is_one_item_in_order_and_faults_come_with_theirs():
    made, began = [], threading.Event()

    def items():
        for i in range(5):
            if i == 3:
                raise ValueError("the fourth")
            made.append((i, threading.get_ident()))
            if i == 1:
                began.set()
            yield i

    taken = made_ahead(items())
    assert next(taken) == 0
    assert began.wait(60.0), "the second is made while the first is worked on"
    assert [next(taken), next(taken)] == [1, 2]
    assert made[0][1] == threading.get_ident() and len({thread for _, thread in made[1:]}) == 1
    with pytest.raises(ValueError, match="the fourth"):
        next(taken)


def test_what_is_made_ahead_is_not_made_on_once_it_is_left():
    made = []
    taken = made_ahead(made.append(i) or i for i in range(1000))
    assert next(taken) == 0
    taken.close()
    assert len(made) <= 2
