"""Files damaged at random give a run or one message, and never anything else."""

from __future__ import annotations

import subprocess
import sys
import warnings
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st

from fogml.errors import InputError
from fogml.runs.facts import Facts
from fogml.runs.reading import read_blocks, read_run
from fogml.runs.run import Run
from fogml.runs.writing import write_run
from tests.runs.files import SUFFIXES, csv_of, samples

quick = settings(
    max_examples=50,
    deadline=None,
    suppress_health_check=[HealthCheck.function_scoped_fixture, HealthCheck.too_slow],
)


def read_in_every_way(path: Path) -> str | None:
    """The message that reading gives; anything but a run or an `InputError` goes through."""
    messages = []
    for read in (
        read_run,
        lambda p: read_run(p, repair=True),
        lambda p: [*read_blocks(p)],
        lambda p: [*read_blocks(p, block_rows=7)],
    ):
        try:
            read(path)
            messages.append(None)
        except InputError as error:
            messages.append(str(error))
            assert path.stem in str(error)
            assert len(str(error)) < 3000
            assert "\n" not in str(error)
    # Blocks and the whole agree on whether a file is sound.
    assert (messages[0] is None) == (messages[2] is None) == (messages[3] is None)
    return messages[0]


@cache
def sound_bytes(suffix: str, folder: Path) -> bytes:
    run = Run("run", {cell.split(" [")[0]: v for cell, v in samples(60).items()}, Facts(unit="0417"))
    path = folder / f"sound{suffix}"
    write_run(run, path)
    return path.read_bytes()


def mutated(data, content: bytes) -> bytes:
    """Bytes changed, cut out, doubled or cut off."""
    content = bytearray(content)
    for _ in range(data.draw(st.integers(1, 4))):
        at = data.draw(st.integers(0, max(len(content) - 1, 0)))
        length = data.draw(st.sampled_from([0, 1, 8, 100]))
        how = data.draw(st.sampled_from(["put", "put", "cut", "double", "end"]))
        if how == "put":
            content[at : at + length] = data.draw(st.binary(min_size=length, max_size=length))
        elif how == "cut":
            del content[at : at + length]
        elif how == "double":
            content[at:at] = content[at : at + length]
        else:
            del content[at:]
    return bytes(content)


@quick
@given(data=st.data())
def test_a_csv(tmp_path_factory, tmp_path, data):
    content = sound_bytes(".csv", tmp_path_factory.getbasetemp())
    (tmp_path / "bad.csv").write_bytes(mutated(data, content))
    read_in_every_way(tmp_path / "bad.csv")


@quick
@given(content=st.binary(max_size=300))
@example(b"\xa0")
@example(b"\xef\xbb\xbf")
@example(b"\x85\n\x85")
@example(b'"')
@example(b'time [s],gyro [deg/h]\n0,"1\n')
@example(b"time [s],gyro [deg/h]\n0,1\n1,2\n,\n")
@example(b"time [s],gyro [deg/h]\n0,1e308\n1,1e308\n1e308,-1e308\n")
@example(b"time [h],gyro [rad/s]\n0,1e308\n1e308,1e308\n")
def test_any_bytes_as_csv(tmp_path, content):
    (tmp_path / "bad.csv").write_bytes(content)
    read_in_every_way(tmp_path / "bad.csv")


fields = st.one_of(
    st.floats().map(repr),
    st.integers(-9, 9).map(str),
    st.sampled_from(
        ["", " ", "NaN", "inf", "1,5", '"1.5"', '"', "x", "°C", "+1", "1e", "1e999", "0x1F", "１"]
    ),
)


@quick
@given(
    rows=st.lists(st.lists(fields, min_size=1, max_size=5), max_size=8),
    separator=st.sampled_from([",", ";", "\t"]),
    header=st.sampled_from([["time [s]", "gyro [deg/h]", "T [K]"], ["time [ms]", "gyro [count]", "note"]]),
    end=st.sampled_from(["\n", "\r\n", "\r", ""]),
)
def test_any_fields(tmp_path, rows, separator, header, end):
    text = "\n".join(separator.join(row) for row in [header, *rows]) + end
    (tmp_path / "bad.csv").write_text(text, encoding="utf-8")
    read_in_every_way(tmp_path / "bad.csv")


@quick
@given(content=st.binary(max_size=200) | st.text(max_size=200).map(str.encode))
def test_any_side_file(tmp_path, content):
    path = tmp_path / "bad.csv"
    path.write_text(csv_of(samples(5)))
    path.with_suffix(".yaml").write_bytes(content)
    read_in_every_way(path)


@pytest.mark.parametrize("suffix", SUFFIXES[1:])
def test_binary_formats(tmp_path, suffix):
    # The libraries behind these formats are not all written for damaged files: should one end the
    # process, that is seen from outside, and ends no other test.
    root = Path(__file__).parents[2]
    told = subprocess.run(
        [sys.executable, "-W", "error", "-m", "tests.runs.damage_in_a_process", str(tmp_path), suffix],
        cwd=root, capture_output=True, text=True, timeout=300, check=False,
    )  # fmt: skip
    assert told.returncode == 0, told.stderr[-3000:]
    assert "messages" in told.stdout


@pytest.mark.parametrize("suffix", SUFFIXES[1:])
def test_a_bit_that_flips_in_the_samples_is_told(tmp_path, tmp_path_factory, suffix):
    """Checksums or compression tell damage that still reads as a number; CSV has neither."""
    content = bytearray(sound_bytes(suffix, tmp_path_factory.getbasetemp()))
    sound = read_run(tmp_path_factory.getbasetemp() / f"sound{suffix}")
    path = tmp_path / f"bad{suffix}"
    for at in range(200, len(content), len(content) // 40):
        content[at] ^= 0x10
        path.write_bytes(content)
        content[at] ^= 0x10
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            try:
                run = read_run(path)
            except InputError:
                continue
        # What still reads is what was written: the flipped bit is padding or a name.
        for name in set(run.columns) & set(sound.columns):
            assert np.array_equal(run.columns[name], sound.columns[name])
