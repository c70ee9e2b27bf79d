"""Compiled kernels work where nothing can be kept on disk, and every kernel is made in one place."""

from __future__ import annotations

import ast
import errno
import importlib.util
import os
import pickle
import sys
from pathlib import Path

import pytest
from numba.core import caching

import fogml
from fogml.signals.compiled import kernel

SOURCE = """
from numba import float64
from fogml.signals.compiled import kernel

@kernel()
def lazy(x):
    return 2.0 * x + 1.0

@kernel(float64(float64))
def eager(x):
    return 2.0 * x + 1.0
"""


@pytest.fixture
def load(tmp_path, monkeypatch):
    """Import the module of two kernels anew, as another process would."""
    monkeypatch.setattr(sys, "dont_write_bytecode", True)
    path = tmp_path / "kernels.py"
    path.write_text(SOURCE)

    def loaded():
        spec = importlib.util.spec_from_file_location("kernels", path)
        module = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(module)
        assert module.lazy(3.0) == module.eager(3.0) == 7.0
        return module

    return loaded


def hits(function) -> int:
    return sum(function.stats.cache_hits.values())


def test_a_kernel_is_kept_for_the_next_process(load):
    first = load()
    assert hits(first.lazy) == hits(first.eager) == 0
    again = load()
    assert hits(again.lazy) == hits(again.eager) == 1


def test_no_folder_can_be_written(load, monkeypatch):
    def refused(self):
        raise OSError(errno.EROFS, os.strerror(errno.EROFS))

    monkeypatch.setattr(caching._CacheLocator, "ensure_cache_path", refused)
    for locator in caching.CacheImpl._locator_classes:
        monkeypatch.setattr(locator, "ensure_cache_path", refused)
    load()
    assert hits(load().lazy) == 0


def test_the_disk_is_full(load, monkeypatch, tmp_path):
    def full(*words, **more):
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(caching.IndexDataCacheFile, "save", full)
    load()
    assert hits(load().lazy) == 0


@pytest.mark.parametrize("damage", [b"", b"garbage", pickle.dumps("other")])
def test_what_is_kept_is_damaged(load, tmp_path, damage):
    load()
    kept = [path for path in tmp_path.rglob("*") if path.suffix in (".nbi", ".nbc")]
    assert kept
    for path in kept:
        path.write_bytes(damage)
    load()


def test_every_kernel_of_the_toolkit_is_made_here():
    own = Path(fogml.__file__).parent
    for path in own.rglob("*.py"):
        if path == own / "signals" / "compiled.py":
            continue
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.ImportFrom) and node.module and node.module.startswith("numba"):
                assert not {"njit", "jit", "vectorize", "guvectorize"} & {alias.name for alias in node.names}
    assert callable(kernel)
