"""Files in a process of their own: whatever they do to it, the caller gets a message."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

import h5py
import numpy as np
import pytest

from fogml.errors import InputError
from fogml.runs import reader_process
from fogml.runs.reader_process import CHILD, ReaderProcess, ReadingLimits
from fogml.runs.reading import read_blocks, read_run
from tests.runs.files import samples, write_table

DAMAGED = Path(__file__).with_name("damaged")


@pytest.fixture
def hdf5(tmp_path):
    return write_table(tmp_path / "run.h5", samples(50))


def test_files_that_crash_or_hang_their_library_are_damaged_files():
    with pytest.raises(InputError, match=r"crashes\.mat: damaged"):
        read_run(DAMAGED / "crashes.mat")
    with pytest.raises(InputError, match=r"crashes\.parquet: damaged"):
        read_run(DAMAGED / "crashes.parquet")
    with pytest.raises(InputError, match=r"hangs\.h5: damaged"):
        read_run(DAMAGED / "hangs.h5", limits=ReadingLimits(cpu_s=1.0))


@pytest.mark.parametrize(
    ("does", "told"),
    [
        ("os.kill(os.getpid(), signal.SIGSEGV)", r"its reader crashed \(SIGSEGV\)"),
        ("os.abort()", r"SIGABRT: for want of memory\? A workbook may have a lone cell far from its table"),
        ("sys.exit(3)", r"its reader crashed \(status 3\)"),
        ("resource.setrlimit(resource.RLIMIT_CPU, (1, 1))\nwhile True: pass", "crashed|no end"),
        ("time.sleep(60)", "came to no end and was stopped"),
        ("print('{\"count\"', flush=True)", "crashed"),
        ("print('[' * 5000, flush=True)", "crashed|no end"),
        ("print('{\"memory\": 1}', flush=True)", "takes more than 1024 MB"),
        ('print(\'{"fault": "odd\\\\u001b"}\', flush=True)', r"no HDF5 file \(odd"),
    ],
)
def test_however_the_process_ends_the_file_is_named(tmp_path, hdf5, monkeypatch, does, told):
    script = tmp_path / "child.py"
    script.write_text(f"import os, resource, signal, sys, time\nsys.stdin.readline()\n{does}\n")
    monkeypatch.setattr(reader_process._processes, "process", ReaderProcess(script))
    monkeypatch.setattr(reader_process._processes, "owner", os.getpid())
    with pytest.raises(InputError, match=rf"run\.h5: damaged.*({told})"):
        read_run(hdf5, limits=ReadingLimits(wall_s=0.5 if "sleep" in does else 60.0))
    # The next file is read by a new process.
    assert len(read_run(hdf5)) == 50


def test_memory_is_limited(tmp_path):
    path = tmp_path / "run.h5"
    with h5py.File(path, "w") as file:
        for name, unit in (("time", "s"), ("gyro", "deg/h")):
            # All of a chunk is unpacked at once: 32 MB.
            file.create_dataset(name, (4_000_000,), float, chunks=(4_000_000,), compression="gzip")
            file[name].attrs["unit"] = unit
            file[name][0] = 1.0
    limits = ReadingLimits(memory_mb=16.0, memory_per_byte=0.0)
    with pytest.raises(InputError, match=r"run\.h5: damaged"):
        read_run(path, limits=limits)


@pytest.mark.parametrize(
    "kind", ["external link", "soft link", "virtual", "external storage", "plug-in", "huge"]
)
@pytest.mark.parametrize("column", ["gyro", "other"])
def test_samples_are_the_files_own(tmp_path, hdf5, kind, column):
    elsewhere = tmp_path / "elsewhere.h5"
    with h5py.File(elsewhere, "w") as file:
        file["secret"] = np.arange(50.0)
    (tmp_path / "raw").write_bytes(np.arange(50.0).tobytes())
    with h5py.File(hdf5, "a") as file:
        if column in file:
            del file[column]
        if kind == "external link":
            file[column] = h5py.ExternalLink(str(elsewhere), "/secret")
        elif kind == "soft link":
            file[column] = h5py.SoftLink("/T_in")
        elif kind == "virtual":
            layout = h5py.VirtualLayout((50,), float)
            layout[:] = h5py.VirtualSource(str(elsewhere), "secret", (50,))
            file.create_virtual_dataset(column, layout)
        elif kind == "external storage":
            file.create_dataset(column, (50,), float, external=[(str(tmp_path / "raw"), 0, 400)])
        elif kind == "huge":
            file.create_dataset(column, (1 << 50,), float, chunks=(50,))
        else:
            creation = h5py.h5p.create(h5py.h5p.DATASET_CREATE)
            creation.set_chunk((50,))
            creation.set_filter(32015, h5py.h5z.FLAG_OPTIONAL, ())
            space, kind_of = h5py.h5s.create_simple((50,)), h5py.h5t.NATIVE_DOUBLE
            h5py.h5d.create(file.id, column.encode(), kind_of, space, creation)
    if column == "gyro":
        with pytest.raises(InputError, match=r"run\.h5, column 'gyro': (is a link|refers|is packed|holds)"):
            read_run(hdf5)
    else:
        run = read_run(hdf5)
        assert "other" not in run.columns
        assert any("'other' is left out" in finding.message for finding in run.findings)


def test_more_samples_than_a_file_can_hold(tmp_path):
    path = tmp_path / "run.h5"
    with h5py.File(path, "w") as file:
        for name, unit in (("time", "s"), ("gyro", "deg/h")):
            file.create_dataset(name, (1 << 40,), float, chunks=(1 << 10,)).attrs["unit"] = unit
    for read in (read_run, lambda path: next(read_blocks(path))):
        with pytest.raises(InputError, match=r"run\.h5: damaged: it states 2\.2 × 10¹² values"):
            read(path)


def test_groups_within_themselves(tmp_path, hdf5):
    with h5py.File(hdf5, "a") as file:
        group = file.create_group("loop [a")
        group["again"] = group
    assert len(read_run(hdf5)) == 50


def test_two_files_at_once_and_one_that_is_left(tmp_path):
    paths = [write_table(tmp_path / f"{i}.h5", samples(300, seed=i)) for i in range(2)]
    both = zip(*(read_blocks(path, block_rows=100) for path in paths), strict=True)
    for start, blocks in zip(range(0, 300, 100), both, strict=True):
        for i, block in enumerate(blocks):
            wanted = samples(300, seed=i)["gyro [deg/h]"][start : start + 100]
            assert np.array_equal(block.columns["gyro"], wanted)
    left = read_blocks(paths[0], block_rows=100)
    next(left)
    left.close()
    assert len(read_run(paths[1])) == 300


def test_threads_have_processes_of_their_own(hdf5):
    lengths: list[int] = []
    threads = [threading.Thread(target=lambda: lengths.append(len(read_run(hdf5)))) for _ in range(3)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert lengths == [50, 50, 50]


def test_a_program_ends_whose_blocks_are_not_all_asked_for(hdf5):
    # What is in a cycle is let go of at the very end, when no thread can begin any more.
    script = (
        "import sys; from fogml.runs.reading import read_blocks\n"
        "held = [read_blocks(sys.argv[1], block_rows=10)]; held.append(held); print(len(next(held[0])))"
    )
    ended = subprocess.run([sys.executable, "-c", script, str(hdf5)], capture_output=True, timeout=20)
    assert (ended.returncode, ended.stdout.split(), ended.stderr) == (0, [b"10"], b"")


@pytest.mark.skipif(sys.platform != "linux", reason="elsewhere the closed input ends it, once it reads")
def test_the_process_ends_with_its_parent_whatever_it_is_in(tmp_path):
    script = tmp_path / "child.py"
    script.write_text(
        f"import sys\nsys.path.insert(0, {str(CHILD.parent)!r})\nfrom reader_child import end_with_parent\n"
        "end_with_parent(int(sys.argv[1]))\nprint('{}', flush=True)\nwhile True: pass\n"
    )
    parent = subprocess.Popen(
        [sys.executable, "-c",
         "import sys, time; from pathlib import Path; from fogml.runs.reader_process import ReaderProcess\n"
         "process = ReaderProcess(Path(sys.argv[1])); process.ask({}, None, 60.0)\n"
         "print(process._process.pid, flush=True); time.sleep(60)", str(script)],
        stdout=subprocess.PIPE, text=True,
    )  # fmt: skip
    assert parent.stdout is not None
    child = int(parent.stdout.readline())
    os.kill(child, 0)
    parent.send_signal(signal.SIGKILL)
    parent.communicate()
    for _ in range(200):
        try:
            state = Path(f"/proc/{child}/stat").read_text().rpartition(")")[2].split()[0]
        except OSError:
            return
        if state == "Z":
            return
        time.sleep(0.05)
    raise AssertionError("the process lives on")


def test_samples_come_in_parts_and_a_fault_among_them_is_told(tmp_path):
    script = tmp_path / "child.py"
    script.write_text(
        "import json, sys\nimport numpy as np\n"
        "def send(told, *values):\n"
        "    sys.stdout.buffer.write(json.dumps(told).encode() + b'\\n' + np.array(values).tobytes())\n"
        "    sys.stdout.buffer.flush()\n"
        "for line in sys.stdin:\n"
        "    send({'count': 2}, 1.0, 2.0)\n"
        "    if (wanted := json.loads(line)['do']) != 'too many':\n"
        "        send({'fault': 'odd'}) if wanted == 'fault' else send({'count': 1}, 3.0)\n"
    )
    process = ReaderProcess(script)
    values = np.empty(3)
    assert process.ask({"do": "read"}, values, 60.0) == {"count": 1}
    assert values.tolist() == [1.0, 2.0, 3.0]
    assert process.ask({"do": "fault"}, values, 60.0) == {"fault": "odd"}
    assert process.is_ready()
    assert process.ask({"do": "too many"}, np.empty(1), 60.0) is None
    assert not process.is_ready()
