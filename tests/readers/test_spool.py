"""Long logs are read in blocks: what comes back is what was written, and little of it is held."""

from __future__ import annotations

import re
from contextlib import closing
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from experiments.real_files import long_logs
from fogml.readers import columns
from fogml.readers.columns import Rows, Spool
from fogml.runs import reader_process
from fogml.runs.other_rate import Beside, interpolated
from fogml.runs.reader_process import StoredArray
from fogml.runs.reading import read_blocks
from fogml.runs.reading_limits import DEFAULT_LIMITS

LAYOUTS = [np.dtype("<f8"), np.dtype("u1"), np.dtype([("a", "<u2"), ("b", "<f8"), ("c", "S3")])]
LAYOUTS.append(np.dtype({"names": ["x", "y"], "formats": ["<f4", "u1"], "offsets": [3, 9], "itemsize": 12}))


@settings(max_examples=40)
@given(st.sampled_from(LAYOUTS), st.lists(st.integers(0, 40), max_size=8), st.integers(0, 9), st.data())
def test_rows_come_back(layout, sizes, seed, data):
    rng = np.random.default_rng(seed)
    content = rng.bytes(sum(sizes) * layout.itemsize)
    whole = np.frombuffer(content, layout)
    with pytest.MonkeyPatch.context() as patch, closing(Spool()) as spool:
        patch.setattr(columns, "BLOCK_BYTES", data.draw(st.integers(1, 200)))
        rows, other, at = Rows(spool, layout), Rows(spool, "<i4"), 0
        for size in sizes:
            rows += content[at : at + size * layout.itemsize]
            other.add(np.arange(at, at + size))
            at += size * layout.itemsize
        assert rows.count == len(whole)
        start = data.draw(st.integers(0, len(whole)))
        stop = data.draw(st.integers(start, len(whole)))
        for name in layout.names or (None,):
            expected = whole if name is None else whole[name]
            assert rows.read(name, start, stop).tobytes() == expected[start:stop].tobytes()


class Held:
    """Arrays in memory in a stored file's place."""

    path, limits = None, DEFAULT_LIMITS

    def __init__(self, tmp_path, *arrays):
        self.path, self.arrays = tmp_path, arrays
        self.most = 0

    def read(self, array, start, stop):
        self.most = max(self.most, stop - start)
        return self.arrays[array.index][start:stop]


@pytest.mark.parametrize("back", [None, "clock", "run"])
def test_a_column_beside_is_interpolated_block_by_block(tmp_path, back):
    (tmp_path / "log").write_bytes(bytes(100_000))
    rng = np.random.default_rng(0)
    at, seconds = np.sort(rng.uniform(0, 100, 500)), np.linspace(-5.0, 105.0, 900)
    if back:
        moved = at if back == "clock" else seconds
        moved[300:310] -= 20.0
    values = rng.normal(size=500)
    values[[3, 77]] = np.nan
    held = Held(tmp_path / "log", at, values)
    arrays = [StoredArray(i, "T", None, "f", "f8", (500,), None) for i in range(2)]
    beside = Beside("T [degC]", ("time [s]", arrays[0]), arrays[1], step=16)
    found = np.concatenate([beside.at(held, seconds[i : i + 70]) for i in range(0, 900, 70)])
    # Blocks before the clock is seen to go back are as if what comes later were not there.
    known = seconds > at[299] if back == "clock" else np.isfinite(seconds)
    np.testing.assert_array_equal(found[known], interpolated(seconds, at, values)[known])
    assert held.most == (500 if back else 16)


@pytest.mark.parametrize(("kind", "suffix"), [("ulog", ".ulg"), ("dataflash", ".bin"), ("npz", ".npz")])
def test_a_long_log_takes_no_more_memory_than_a_short_one(tmp_path, monkeypatch, kind, suffix):
    pytest.importorskip({"ulog": "pyulog", "dataflash": "pymavlink"}.get(kind, "numpy"))
    monkeypatch.setattr(reader_process._processes, "process", None)
    peaks, rows = [], 0
    for hours in (0.01, 0.15):
        path = tmp_path / f"log{suffix}"
        getattr(long_logs, kind)(path, hours)
        scale = 1.0 if kind == "npz" else np.degrees(3600.0)
        for block in read_blocks(path, axis=None if kind == "npz" else "x", block_rows=20_000):
            np.testing.assert_allclose(block.gyro, scale * long_logs.gyro(block.time), rtol=1e-6)
            rows += len(block)
        process = reader_process._processes.process
        assert process is not None
        status = Path(f"/proc/{process._process.pid}/status").read_text()
        peaks.append(1024 * int(re.search(r"VmHWM:\s*(\d+)", status)[1]))
    assert rows == 0.16 * 3600 * 400
    assert peaks[1] - peaks[0] < 0.5 * path.stat().st_size
