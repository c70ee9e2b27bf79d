"""Logs that lie packed are read as what they unpack to, within bounds."""

from __future__ import annotations

import bz2
import gc
import gzip
import io
import lzma
import tempfile
import zipfile
from pathlib import Path

import numpy as np
import pyarrow
import pytest

from fogml.errors import InputError
from fogml.runs.profile_draft import draft_profile
from fogml.runs.profiles import import_recording
from fogml.runs.reading import read_blocks, read_run, read_runs
from fogml.runs.reading_limits import ReadingLimits
from tests.runs.files import csv_of, samples

TEXT = csv_of(samples()).encode()


def zipped(**files: bytes) -> bytes:
    """A zip archive as a Mac makes it, with folders and files of the system's own."""
    held = io.BytesIO()
    with zipfile.ZipFile(held, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("log/", b"")
        for name, content in files.items():
            archive.writestr(f"log/{name}.csv", content)
            archive.writestr(f"__MACOSX/log/._{name}.csv", b"\0\1")
    return held.getvalue()


def zstd(content: bytes) -> bytes:
    return bytes(pyarrow.compress(content, "zstd", asbytes=True))


PACKERS = {
    "log.csv.gz": gzip.compress,
    "log.csv.bz2": bz2.compress,
    "log.csv.xz": lzma.compress,
    "log.csv.zst": zstd,
    "log.zip": lambda content: zipped(any=content),
    "log.csv": gzip.compress,  # as programs that load pages leave them
}


@pytest.fixture
def scratch(tmp_path, monkeypatch) -> Path:
    """Where temporary files of this process go."""
    folder = tmp_path / "scratch"
    folder.mkdir()
    monkeypatch.setattr(tempfile, "tempdir", str(folder))
    return folder


@pytest.mark.parametrize("name", PACKERS)
def test_a_packed_log_is_the_run_that_it_unpacks_to(tmp_path, scratch, name):
    path = tmp_path / name
    path.write_bytes(PACKERS[name](TEXT))
    (tmp_path / "log.yaml").write_text("unit: FOG-7\n")
    run = read_run(path)
    assert run.name == name and run.facts.unit == "FOG-7"
    for cell, values in samples().items():
        np.testing.assert_array_equal(run.columns[cell.partition(" ")[0]], values)
    blocks = list(read_blocks(path, block_rows=70, columns=["T_in"]))
    assert [len(block) for block in blocks] == [70, 70, 60]
    np.testing.assert_array_equal(np.concatenate([block.gyro for block in blocks]), run.gyro)
    (long,) = read_runs(path, limits=ReadingLimits(long_mb=0.0))
    np.testing.assert_array_equal(long.gyro, run.gyro)
    del run, blocks, long
    assert not list(scratch.iterdir())


def test_faults_and_repairs_name_the_packed_file_and_the_line_within(tmp_path):
    path = tmp_path / "log.csv.gz"
    lines = TEXT.splitlines(keepends=True)
    lines[100] = b"oops" + lines[100]
    path.write_bytes(gzip.compress(b"".join(lines)))
    with pytest.raises(InputError, match=r"log\.csv\.gz, line 101, column 'time': 'oops"):
        read_run(path)
    assert len(read_run(path, repair=True)) == 199


def test_a_profile_reads_a_packed_log_and_names_runs_by_its_text(tmp_path):
    path, profile = tmp_path / "log.csv.gz", tmp_path / "profile.yaml"
    path.write_bytes(gzip.compress(TEXT, mtime=0))
    profile.write_text(draft_profile(path))
    (run,) = import_recording(path, profile)
    assert run.name == "log"
    np.testing.assert_array_equal(run.gyro, samples()["gyro [deg/h]"])


ENCRYPTED = bytearray(zipped(a=TEXT))
ENCRYPTED[ENCRYPTED.index(b"log/a.csv") - 24] |= 1  # the flag in the local header ...
ENCRYPTED[ENCRYPTED.rindex(b"log/a.csv") - 38] |= 1  # ... and in the directory


@pytest.mark.parametrize(
    ("name", "content", "told"),
    [
        ("log.csv.gz", gzip.compress(TEXT, mtime=0)[:-400], "damaged.*end-of-stream"),
        ("log.csv.gz", gzip.compress(TEXT, mtime=0)[:-8] + bytes(8), "damaged.*CRC"),
        ("log.csv.xz", lzma.compress(TEXT)[:-400], "damaged"),
        ("log.csv.zst", zstd(TEXT)[:-400], "damaged"),
        ("log.csv.gz", gzip.compress(b"", mtime=0), "empty"),
        ("log.csv.gz", gzip.compress(gzip.compress(TEXT, mtime=0), mtime=0), "holds a gzip.*unpack it first"),
        (
            "log.csv.gz",
            gzip.compress(b"\x89HDF\r\n\x1a\n" + bytes(99), mtime=0),
            "holds a HDF5 file.*unpack it first",
        ),
        ("log.csv.gz", gzip.compress(np.random.default_rng(0).bytes(4000), mtime=0), "not a text file"),
        ("log.mat", gzip.compress(TEXT, mtime=0), "named as MATLAB; unpack it first"),
        ("log.zip", zipped(a=TEXT, b=TEXT), r"holds 2 files \(log/a\.csv, log/b\.csv\).*unpack it first"),
        ("log.zip", zipped(), "holds no file"),
        ("log.zip", bytes(ENCRYPTED), "encrypted"),
        ("log.zip", zipped(a=TEXT)[:-30], "damaged"),
    ],
)
def test_what_is_no_packed_log_is_told_in_one_message(tmp_path, scratch, name, content, told):
    path = tmp_path / name
    path.write_bytes(content)
    with pytest.raises(InputError, match=rf"^log\.\S+ .*{told}|^log\.[\w.]+: .*{told}") as caught:
        read_run(path)
    assert "\n" not in str(caught.value) and str(scratch) not in str(caught.value)
    del caught
    gc.collect()
    assert not list(scratch.iterdir())


@pytest.mark.parametrize("pack", [bz2.compress, lzma.compress])
def test_a_bomb_is_refused_before_it_goes_off(tmp_path, scratch, pack):
    """6 MB of nothing in a few kB: no more is unpacked than a recording of that size can hold."""
    path = tmp_path / "log.csv.gz"
    head = b"time [s],gyro [deg/h]\n"
    path.write_bytes(pack(head + b"0,0\n" * 1_500_000))
    limits = ReadingLimits(spare_mb=1.0)
    with pytest.raises(InputError, match=r"log\.csv\.gz: damaged: it unpacks to over \d+ MB") as caught:
        read_run(path, limits=limits)
    most = 1e-6 * limits.expansion * path.stat().st_size + limits.spare_mb
    assert f"over {most:.0f} MB" in str(caught.value) and most < 4.0
    assert not list(scratch.iterdir())
    path.write_bytes(gzip.compress(TEXT, mtime=0))
    assert len(read_run(path)) == 200  # the bound holds for one file alone


def test_a_drive_without_room_for_the_text_is_told(tmp_path, monkeypatch):
    def full(self, *arguments, **options):
        raise OSError(28, "No space left on device")

    path = tmp_path / "log.csv.gz"
    path.write_bytes(gzip.compress(TEXT, mtime=0))
    read = Path.open
    monkeypatch.setattr(Path, "open", lambda self, mode="r", **k: (full if "w" in mode else read)(self, mode))
    with pytest.raises(InputError, match=r"no room for .*No space left.*TMPDIR"):
        read_run(path)
