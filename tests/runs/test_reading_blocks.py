"""Blocks of a run are the whole run, in memory that does not grow with the file."""

from __future__ import annotations

import os
import tracemalloc
from pathlib import Path

import numpy as np
import pyarrow as pa
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from fogml.runs import reader_process
from fogml.runs.facts import Facts
from fogml.runs.reading import read_blocks, read_run
from fogml.runs.run import Run
from fogml.runs.writing import BlockWriter, write_run

SUFFIXES = [".csv", ".parquet", ".h5", ".mat"]
FACTS = Facts(unit="FOG-0417", axis="x", latitude=39.9, input_axis="up")


def a_run(rows: int) -> Run:
    rng = np.random.default_rng(0)
    columns = {"time": np.cumsum(rng.uniform(0.5, 1.5, rows)), "gyro": rng.normal(size=rows)}
    columns |= {"T_in": rng.normal(size=rows), "T_out": rng.normal(size=rows), "flow": rng.normal(size=rows)}
    return Run("run", columns, FACTS)


@pytest.fixture(scope="module")
def files(tmp_path_factory):
    folder = tmp_path_factory.mktemp("blocks")
    for suffix in SUFFIXES:
        write_run(a_run(1000), folder / f"run{suffix}")
    return folder


@pytest.mark.parametrize("suffix", SUFFIXES)
@settings(max_examples=4, deadline=None)
@example(block_rows=7)
@example(block_rows=999)
@example(block_rows=1000)
@given(block_rows=st.integers(100, 1100))
def test_blocks_are_the_whole_run(files, suffix, block_rows):
    path = files / f"run{suffix}"
    whole = read_run(path)
    blocks = list(read_blocks(path, block_rows=block_rows))
    assert max(map(len, blocks)) <= block_rows
    for name, values in whole.columns.items():
        np.testing.assert_array_equal(np.concatenate([block.columns[name] for block in blocks]), values)
    assert {block.name for block in blocks} == {path.name}
    assert all(block.facts == FACTS for block in blocks)


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_columns_of_choice(files, suffix):
    whole = read_run(files / f"run{suffix}")
    for block in read_blocks(files / f"run{suffix}", columns=["T_out"], block_rows=600):
        assert set(block.columns) == {"time", "gyro", "T_out"}
        rows = np.searchsorted(whole.time, block.time)
        np.testing.assert_array_equal(block.columns["T_out"], whole.columns["T_out"][rows])


_POOLS: list[pa.MemoryPool] = []
"""Arrow's threads let go of the last buffers after an answer: a pool has to outlive them."""


def peak_bytes(path, block_rows: int) -> int:
    """Most memory held at once while a file is read in blocks: by NumPy, Python, Arrow, and by its reader."""
    pool, usual = pa.proxy_memory_pool(pa.default_memory_pool()), pa.default_memory_pool()
    _POOLS.append(pool)
    pa.set_memory_pool(pool)
    tracemalloc.start()
    reader = reader_process.ReaderProcess()
    reader_process._processes.process, reader_process._processes.owner = reader, os.getpid()
    # Once it answers it has loaded what it needs, however soon the file is read.
    assert reader.ask({"do": "close", "file": -1, "cpu_s": 60.0}, None, 60.0) is not None
    try:
        rows = sum(len(block) for block in read_blocks(path, block_rows=block_rows))
        assert rows > 0
        status = Path(f"/proc/{reader._process.pid}/status").read_text()
        (peak,) = [int(line.split()[1]) for line in status.splitlines() if line.startswith("VmHWM")]
        return tracemalloc.get_traced_memory()[1] + pool.max_memory() + 1024 * peak
    finally:
        tracemalloc.stop()
        pa.set_memory_pool(usual)


@pytest.mark.parametrize(("suffix", "least"), [(".parquet", 4), (".csv", 4)])
def test_memory_does_not_grow_with_the_file(tmp_path, suffix, least):
    part = 250_000
    gyro = np.random.default_rng(0).normal(size=part)
    peaks = []
    for parts in (least, 3 * least):
        path = tmp_path / f"run{parts}{suffix}"
        with BlockWriter(path) as writer:
            for i in range(parts):
                writer.write({"time [s]": np.arange(part) + i * part, "gyro [deg/h]": gyro, "T [degC]": gyro})
        peaks.append(peak_bytes(path, 50_000))
    # How far Arrow reads ahead depends on what else the machine does; three times the file would be three.
    assert peaks[1] < 1.8 * peaks[0]
