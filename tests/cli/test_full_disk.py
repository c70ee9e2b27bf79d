"""A disk that fills in the middle: one message, status 2, nothing half-written, finished work kept.

Errors are the kernel's own: of a small disk where one may be mounted, and of a limit on the size of
files, which needs no privilege.
"""

from __future__ import annotations

import contextlib
import os
import resource
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from fogml.models.names import make_model
from fogml.models.saved import save_model
from fogml.runs.reading import read_run
from tests.cli.conftest import csv_text
from tests.fleet.units import write_fleet

FLEET = ("--model", "polynomial", "--features", "T", "--averaging", "40", "--workers", "1", "--quiet")
UNIT_KIB = 1570
"""What a unit's results take, nearly all of it the page's."""


@contextlib.contextmanager
def files_up_to(most: int) -> Iterator[None]:
    """No file may have more than `most` bytes; Python would keep half of a module's bytecode."""
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    written, sys.dont_write_bytecode = sys.dont_write_bytecode, True
    resource.setrlimit(resource.RLIMIT_FSIZE, (most, hard))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
        sys.dont_write_bytecode = written


@pytest.fixture
def refused(invoke):
    """Check for status 2 and one line that says what the kernel said and what to do."""

    def check(message: str, *arguments: object, most: int | None = None) -> None:
        with contextlib.nullcontext() if most is None else files_up_to(most):
            done = invoke(*arguments, status=2)
        assert done.stdout == ""
        (line,) = done.stderr.strip().splitlines()
        assert message in line
        assert "make room" in line

    return check


def finished(home: Path) -> dict[str, int]:
    """Units with an outcome, and when their reports were written [ns]."""
    return {
        path.parent.name: (path.parent / "report.json").stat().st_mtime_ns
        for path in home.glob("*/outcome.json")
    }


@pytest.fixture
def small_disk(tmp_path: Path) -> Iterator[Callable[[int], Path]]:
    """Gives a disk of so many KiB; called again, resizes it."""
    place = tmp_path / "disk"
    place.mkdir()

    def sized(kib: int) -> Path:
        again = ["-o", f"remount,size={kib}k"] if place.is_mount() else ["-o", f"size={kib}k"]
        try:
            done = subprocess.run(
                ["mount", "-t", "tmpfs", *again, "tmpfs", str(place)], capture_output=True, text=True
            )
        except FileNotFoundError:
            pytest.skip("mount is not installed")
        if done.returncode != 0:
            pytest.skip(f"a small disk may not be mounted here: {done.stderr.strip()}")
        return place

    yield sized
    if place.is_mount():
        subprocess.run(["umount", "-l", str(place)], check=True)


def test_a_fleet_on_a_disk_that_fills(small_disk, invoke, refused, tmp_path):
    manifest = write_fleet(tmp_path, 3)
    home = small_disk(2 * UNIT_KIB + UNIT_KIB // 2) / "out"
    arguments = ("fleet", manifest, *FLEET, "--out", home)
    refused("No space left on device", *arguments)
    kept = finished(home)
    assert 1 <= len(kept) <= 2
    for folder in home.iterdir():
        # What is there of a unit is all that a unit has.
        assert {path.name for path in folder.iterdir()} >= {"report.json", "report.html", "model"}
    assert not list(home.parent.rglob(".partial-*"))
    small_disk(8 * UNIT_KIB)
    assert invoke(*arguments).stderr == ""
    assert len(finished(home)) == 3
    assert {name: finished(home)[name] for name in kept} == kept


def test_a_fleets_own_page_on_a_full_disk(small_disk, invoke, refused, tmp_path):
    manifest = write_fleet(tmp_path, 2)
    home = small_disk(2 * UNIT_KIB + UNIT_KIB // 2) / "out"
    arguments = ("fleet", manifest, *FLEET, "--out", home)
    refused("finished units are kept", *arguments)
    kept = finished(home)
    assert len(kept) == 2
    assert {path.name for path in home.iterdir()} == set(kept)
    small_disk(8 * UNIT_KIB)
    invoke(*arguments)
    assert finished(home) == kept
    assert (home / "fleet.html").is_file()


def test_a_fleet_whose_files_may_not_grow(invoke, refused, tmp_path):
    manifest = write_fleet(tmp_path, 2)
    lines = manifest.read_text().splitlines()
    arguments = ("fleet", manifest, *FLEET, "--out", tmp_path / "out")
    manifest.write_text("\n".join(lines[:2]) + "\n")
    invoke(*arguments)
    kept = finished(tmp_path / "out")
    manifest.write_text("\n".join(lines) + "\n")
    # The limits stop the workbook of the second unit, and its page.
    for most in (5000, 1_000_000):
        refused("File too large", *arguments, most=most)
        assert finished(tmp_path / "out") == kept
        assert not (tmp_path / "out" / "FOG-001-x").exists()
        assert not list(tmp_path.rglob(".partial-*"))


@pytest.fixture(scope="module")
def model(tmp_path_factory):
    """A trained model."""
    home = tmp_path_factory.mktemp("trained")
    (home / "a.csv").write_text(csv_text(0))
    (home / "a.yaml").write_text("unit: FOG-1\naxis: x\n")
    save_model(make_model("M2").fit(read_run(home / "a.csv")), home / "model")
    return home / "model"


@pytest.mark.parametrize("most", [5000, 1_000_000])
def test_a_training_whose_files_may_not_grow(run_files, refused, tmp_path, most):
    arguments = ("--test", run_files[1], "--model", "M2", "-o", tmp_path / "out", "--quiet")
    refused("File too large", "train", run_files[0], *arguments, most=most)
    assert not (tmp_path / "out").exists()
    assert not list(tmp_path.rglob(".partial-*"))


@pytest.mark.parametrize(("form", "most"), [("json", 60), ("onnx", 300)])
def test_an_export_whose_files_may_not_grow(model, refused, tmp_path, form, most):
    if form == "onnx":
        pytest.importorskip("onnxruntime", reason="ONNX is not installed: pip install -e '.[export]'")
    arguments = ("export", model, "--to", form, "-o", tmp_path / "firmware", "--quiet")
    refused("File too large", *arguments, most=most)
    assert not (tmp_path / "firmware").exists()
    assert not list(tmp_path.rglob(".partial-*"))


@pytest.mark.parametrize(("form", "free_kib"), [("c", 8), ("json", 4)])
def test_an_export_on_a_disk_that_fills(small_disk, model, invoke, refused, tmp_path, form, free_kib):
    disk = small_disk(1024)
    (disk / "firmware").mkdir()
    (disk / "firmware" / "mine.txt").write_text("mine")
    state = os.statvfs(disk)
    with (disk / "full").open("wb") as file:
        os.posix_fallocate(file.fileno(), 0, state.f_bavail * state.f_frsize - free_kib * 1024)
    arguments = ("export", model, "--to", form, "-o", disk / "firmware", "--quiet")
    refused("No space left on device", *arguments)
    assert [path.name for path in (disk / "firmware").iterdir()] == ["mine.txt"]
    assert not list(disk.rglob(".partial-*"))
    (disk / "full").unlink()
    invoke(*arguments)
    assert (disk / "firmware" / "export.json").is_file()
