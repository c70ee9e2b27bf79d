"""The files that make a run: all of them count, by what they hold, and none may change while it is read."""

from __future__ import annotations

import os

import pytest

from fogml.errors import InputError
from fogml.runs import reading
from fogml.runs.reading import read_blocks, read_run
from fogml.runs.sources import run_sources, sources_stamp, unchanged
from tests.runs.files import SUFFIXES, samples, write_table


@pytest.mark.parametrize("suffix", [".yaml", ".yml"])
def test_the_side_file_counts_by_either_suffix(tmp_path, suffix):
    data, side = tmp_path / "a.csv", tmp_path / f"a{suffix}"
    data.write_text("time [s],gyro [deg/h]\n0,1\n1,2\n")
    alone = sources_stamp(run_sources(data))
    side.write_text("latitude: 39.9\n")
    assert run_sources(data) == (data, side)
    north = sources_stamp(run_sources(data))
    side.write_text("latitude: -9.9\n")
    south = sources_stamp(run_sources(data))
    assert len({alone, north, south}) == 3


def test_only_what_is_held_counts(tmp_path):
    data = tmp_path / "a.csv"
    data.write_text("1")
    stamp = sources_stamp([data])
    os.utime(data, ns=(1, 1))
    assert sources_stamp([data]) == stamp
    data.write_text("2")
    assert sources_stamp([data]) != stamp
    data.unlink()
    assert sources_stamp([data]) != stamp


def edited(path):
    path.write_text("b")


def replaced(path):
    state = path.stat()
    path.with_name("new").write_text("a")
    os.utime(path.with_name("new"), ns=(state.st_atime_ns, state.st_mtime_ns))
    path.with_name("new").replace(path)


@pytest.mark.parametrize("change", [edited, replaced, lambda path: path.unlink()])
@pytest.mark.parametrize("fault", [False, True])
def test_a_file_that_changes_while_it_is_read_is_told(tmp_path, change, fault):
    path = tmp_path / "a.csv"
    path.write_text("a")
    os.utime(path, ns=(1, 1))
    with pytest.raises(InputError, match=r"a\.csv: changed while it was read"), unchanged(path):
        change(path)
        if fault:
            raise InputError("what a half-written file looks like")


def test_a_fault_in_a_file_that_stays_is_told_as_it_is(tmp_path):
    with pytest.raises(InputError, match="row 3"), unchanged(tmp_path):
        raise InputError("row 3")


@pytest.mark.parametrize("suffix", SUFFIXES)
@pytest.mark.parametrize("change", ["cut", "edited", "side"])
def test_no_run_is_made_of_a_file_that_changes(tmp_path, suffix, change):
    path = write_table(tmp_path / f"a{suffix}", samples(300))
    path.with_suffix(".yaml").write_text("latitude: 39.9\n")
    touched = path.with_suffix(".yaml") if change == "side" else path
    blocks = read_blocks(path, block_rows=100)
    assert len(next(blocks)) == 100
    content = bytearray(touched.read_bytes())
    if change == "cut":
        del content[len(content) // 2 :]
    touched.write_bytes(content)
    os.utime(touched, ns=(1, 1))
    with pytest.raises(InputError, match=rf"{touched.name}: changed while it was read"):
        list(blocks)


def test_a_run_read_whole_from_a_file_that_is_replaced_meanwhile(tmp_path, monkeypatch):
    path = write_table(tmp_path / "a.csv", samples())
    read = reading.runs_of_table

    def replaced_meanwhile(*arguments, **more):
        replaced(path)
        return read(*arguments, **more)

    monkeypatch.setattr("fogml.runs.reading.runs_of_table", replaced_meanwhile)
    with pytest.raises(InputError, match=r"a\.csv: changed while it was read"):
        read_run(path)
